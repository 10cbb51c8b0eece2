/// The guarantees of readers of meshes.
#pragma once

#include "fuzz_target.h"

#include "scene/mesh/mesh_io.h"

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace crt::fuzz {

inline void checkMesh(const LoadedMesh& loaded) {
    const Mesh& mesh = loaded.mesh;
    const std::size_t triangles = mesh.triangles.size();
    if (triangles == 0) finding("mesh", "has no triangles");
    for (const auto& triangle : mesh.triangles)
        for (const std::uint32_t index : triangle)
            if (index >= mesh.positions.size()) finding("mesh", "an index is out of range");
    for (const auto& position : mesh.positions)
        for (const double x : position)
            if (!std::isfinite(x)) finding("mesh", "a coordinate is not finite");
    if (!mesh.normal_index.empty() && mesh.normal_index.size() != triangles)
        finding("mesh", "has not one triple of normals a triangle");
    for (const auto& triangle : mesh.normal_index)
        for (const std::uint32_t index : triangle) {
            if (index == kNoNormal) continue;
            if (index >= mesh.normals.size()) finding("mesh", "a normal's index is out of range");
            for (const double x : mesh.normals[index])
                if (!std::isfinite(x)) finding("mesh", "a normal in use is not finite");
        }
    if (!mesh.uv_index.empty() && mesh.uv_index.size() != triangles)
        finding("mesh", "has not one triple of texture coordinates a triangle");
    for (const auto& triangle : mesh.uv_index)
        for (const std::uint32_t index : triangle) {
            if (index == kNoUv) continue;
            if (index >= mesh.uvs.size())
                finding("mesh", "the index of texture coordinates is out of range");
            for (const double x : mesh.uvs[index])
                if (!std::isfinite(x)) finding("mesh", "texture coordinates are not finite");
        }
    if (!mesh.colors.empty() && mesh.colors.size() != mesh.positions.size())
        finding("mesh", "has not one colour a vertex");
    for (const auto& color : mesh.colors)
        for (const float x : color)
            if (!(x >= 0 && x <= 1)) finding("mesh", "a colour is not within 0 and 1");
    for (const std::int32_t m : mesh.material)
        if (m < -1 || m >= static_cast<std::int32_t>(loaded.materials.size()))
            finding("mesh", "a material's index is out of range");
    if (!mesh.material.empty() && mesh.material.size() != triangles)
        finding("mesh", "has not one material a triangle");
    if (!loaded.part.empty() && loaded.part.size() != triangles)
        finding("mesh", "has not one part a triangle");
    for (const std::int32_t part : loaded.part)
        if (part < -1 || part >= static_cast<std::int32_t>(loaded.parts.size()))
            finding("mesh", "a part's index is out of range");
    for (const LoadedMaterial& m : loaded.materials)
        if (m.mtl && m.mtl->material.type == MaterialType::Dielectric && !(m.mtl->material.eta.min() > 1.0))
            finding("glass", "does not refract");
}

}  // namespace crt::fuzz
