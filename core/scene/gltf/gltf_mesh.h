/// A primitive of a glTF file → Mesh.
#pragma once

#include "scene/gltf/gltf_file.h"
#include "scene/scene.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace crt {

struct GltfPrimitive {
    std::size_t mesh = 0, primitive = 0;
    std::size_t uv_set = 0;                       ///< n of TEXCOORD_n.
    std::array<double, 3> color_factor{1, 1, 1};  ///< On COLOR_0, linear sRGB.
    bool opacity = false;  ///< The alpha of COLOR_0 in place of texture coordinates (Mesh::uvs_are_opacity).

    auto operator<=>(const GltfPrimitive&) const = default;
};

/// Reads positions, normals, texture coordinates (v turned up), colours and triangles, strips and fans as
/// triangles. Triangles without area are left out and counted. Throws crt::Error(Scene) with a JSON pointer
/// for a primitive that is not there, has no triangles by its mode, or whose numbers are out of range.
/// Members that are not empty show what it has.
Mesh readGltfPrimitive(GltfFile& file, const GltfPrimitive& which, std::uint64_t& without_area);

/// Range of the alpha of COLOR_0: its least and its largest value; 1 and 1 without it.
std::array<double, 2> alphaRange(GltfFile& file, std::size_t mesh, std::size_t primitive);

/// TANGENT, by vertex: a direction, and which way the other one of the surface turns; empty: none.
std::vector<std::array<double, 4>> readGltfTangents(GltfFile& file, std::size_t mesh, std::size_t primitive);

}  // namespace crt
