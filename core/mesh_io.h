/// Mesh files → Mesh. OBJ and MTL by tinyobjloader; every index is checked here because tinyobjloader does not.
#pragma once

#include "scene.h"

#include <string>
#include <vector>

namespace crt {

/// What an OBJ file brought: the mesh, and the materials of its MTL mapped to ours.
struct LoadedMesh {
    Mesh mesh;                          ///< mesh.material indexes `materials` below, or is empty; mesh.emission indexes `emissions`.
    std::vector<Material> materials;    ///< Only those that faces use.
    std::vector<Emission> emissions;    ///< From Ke.
    std::vector<std::string> files;     ///< The OBJ and its MTLs.
    std::uint64_t degenerate_faces = 0; ///< Zero-area triangles, left out with a warning.
};

/// Reads an OBJ. `use_mtl` false ignores usemtl/mtllib. Throws crt::Error(Scene) with file:line for a missing file, NaN or infinite
/// coordinates, indices out of range, a file without faces; warns about zero-area faces (dropped) and faces of a missing material.
LoadedMesh loadObj(const std::string& path, bool use_mtl);

}  // namespace crt
