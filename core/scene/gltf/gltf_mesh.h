/// A primitive of a glTF file → Mesh.
#pragma once

#include "scene/gltf/gltf_file.h"
#include "scene/scene.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace crt {

struct GltfPrimitive {
    std::size_t mesh = 0, primitive = 0;
    std::size_t uv_set = 0;                       ///< n of TEXCOORD_n.
    std::array<double, 3> color_factor{1, 1, 1};  ///< On COLOR_0, linear sRGB.

    auto operator<=>(const GltfPrimitive&) const = default;
};

/// Reads positions, normals, texture coordinates (v turned up), colours and triangles, strips and fans as
/// triangles. Triangles without area are left out and counted. Throws crt::Error(Scene) with a JSON pointer
/// for a primitive that is not there, has no triangles by its mode, or whose numbers are out of range.
/// What it has is told by the members that are not empty.
Mesh readGltfPrimitive(GltfFile& file, const GltfPrimitive& which, std::uint64_t& without_area);

}  // namespace crt
