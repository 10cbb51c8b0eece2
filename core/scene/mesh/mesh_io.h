/// OBJ files, with the materials of their MTL → Mesh.
#pragma once

#include "scene/mesh/mesh_rules.h"
#include "scene/mesh/mtl_material.h"
#include "scene/scene.h"

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace crt {

struct ObjOptions {
    bool use_mtl = true;                ///< Reads mtllib and usemtl.
    MtlColor color = MtlColor::Linear;  ///< Encoding of Kd, Ks and Ke.
    auto operator<=>(const ObjOptions&) const = default;
};

/// A name that usemtl gives to faces.
struct LoadedMaterial {
    std::string name;
    std::optional<MtlMaterial> mtl;  ///< Nothing where no material file defines the name.
};

/// Contents of the file of a mesh.
struct LoadedMesh {
    Mesh mesh;  ///< mesh.material indexes `materials` below, −1 none, or is empty; mesh.emission is empty.
    std::vector<LoadedMaterial> materials;  ///< Only those that faces use, in the order in which they do.
    std::vector<MeshPart> parts;  ///< Groups and objects of an OBJ, those that faces belong to among them.
    std::vector<std::int32_t>
        part;  ///< By triangle, index into `parts`, −1 none; empty where there are none.
    std::vector<std::string> missing_files;  ///< MTLs that the OBJ names and that are not there.
    std::vector<std::string> files;          ///< The mesh, its MTLs and their spectra.
    std::uint64_t degenerate_faces = 0;      ///< Zero-area triangles, left out with a warning.
};

/// Reads an OBJ. Throws crt::Error(Scene) with file:line for a file that is missing, has another format, has
/// no face, or whose faces name vertices that are not there. Errors that do not affect the whole file are
/// warnings: faces of vertices that are not finite (left out), of no area (left out, even if that leaves
/// none), of normals that are not there or have no direction (shaded flat); names that no MTL defines; what
/// crt does not support. One line summarises the materials.
LoadedMesh loadObj(const std::string& path, const ObjOptions& options = {});

}  // namespace crt
