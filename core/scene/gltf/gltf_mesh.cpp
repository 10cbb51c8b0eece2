#include "scene/gltf/gltf_mesh.h"

#include "base/vec3d.h"
#include "scene/gltf/gltf_accessor.h"
#include "scene/gltf/gltf_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

namespace crt {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

constexpr double kMostCoordinate = 1e6;  // Texture coordinates beyond have no digits left for the texel.

/// An accessor of a primitive, with its place.
class Attributes {
public:
    Attributes(GltfFile& file, const tinygltf::Primitive& primitive, std::string pointer)
        : file_(file), primitive_(primitive), pointer_(std::move(pointer)) {}

    std::optional<GltfAccessor> find(const std::string& name, std::size_t vertices) const {
        const auto found = primitive_.attributes.find(name);
        if (found == primitive_.attributes.end()) return std::nullopt;
        const std::string at = fmt::format("{}/attributes/{}", pointer_, name);
        GltfAccessor accessor(file_, found->second, at);
        if (vertices > 0 && accessor.count() != vertices)
            file_.fail(at, fmt::format("it has {} elements for {} positions", accessor.count(), vertices));
        return accessor;
    }

private:
    GltfFile& file_;
    const tinygltf::Primitive& primitive_;
    std::string pointer_;
};

bool hasArea(const Mesh& mesh, const Triangle& t) {
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return false;
    const Vec3d& a = mesh.positions[t[0]];
    const Vec3d n = cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
    return n[0] != 0 || n[1] != 0 || n[2] != 0;
}

/// glTF 2.0, 3.7.2.1: corners of triangle i of a list, a strip or a fan.
Triangle cornersOf(int mode, std::size_t i, const std::vector<std::uint32_t>& at) {
    switch (mode) {
        case TINYGLTF_MODE_TRIANGLE_STRIP: return {at[i], at[i + 1 + i % 2], at[i + 2 - i % 2]};
        case TINYGLTF_MODE_TRIANGLE_FAN: return {at[i + 1], at[i + 2], at[0]};
        default: return {at[3 * i], at[3 * i + 1], at[3 * i + 2]};
    }
}

void readTriangles(GltfFile& file, const tinygltf::Primitive& primitive, const std::string& pointer,
                   Mesh& mesh, std::uint64_t& without_area) {
    std::vector<std::uint32_t> indices;
    if (primitive.indices >= 0) {
        indices = GltfAccessor(file, primitive.indices, pointer + "/indices").indices();
        const std::size_t count = mesh.positions.size();
        for (std::size_t i = 0; i < indices.size(); ++i)
            if (indices[i] >= count)
                file.fail(pointer + "/indices",
                          fmt::format("element {} uses vertex {}, and there are {}", i, indices[i], count));
    } else {
        indices.resize(mesh.positions.size());
        std::iota(indices.begin(), indices.end(), 0u);
    }
    const int mode = primitive.mode;
    if (mode < TINYGLTF_MODE_TRIANGLES)
        file.fail(pointer + "/mode", "these are points or lines, which have no surface");
    const std::size_t count = mode == TINYGLTF_MODE_TRIANGLES ? indices.size() / 3
                              : indices.size() >= 3           ? indices.size() - 2
                                                              : 0;
    mesh.triangles.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        const Triangle triangle = cornersOf(mode, i, indices);
        if (hasArea(mesh, triangle))
            mesh.triangles.push_back(triangle);
        else
            ++without_area;
    }
}

/// Corners whose normal has no direction are flat.
void readNormals(const GltfAccessor& accessor, Mesh& mesh) {
    accessor.requireComponents(3, 3);
    mesh.normals = accessor.rows<3>();
    mesh.normal_index = mesh.triangles;
    for (Triangle& triangle : mesh.normal_index)
        if (std::any_of(triangle.begin(), triangle.end(), [&](std::uint32_t i) {
                const Vec3d& n = mesh.normals[i];
                return n[0] == 0 && n[1] == 0 && n[2] == 0;
            }))
            triangle = {kNoNormal, kNoNormal, kNoNormal};
}

std::string pointerTo(std::size_t mesh, std::size_t primitive) {
    return fmt::format("/meshes/{}/primitives/{}", mesh, primitive);
}

const tinygltf::Primitive& primitiveOf(GltfFile& file, std::size_t mesh, std::size_t primitive) {
    const tinygltf::Model& model = file.model();
    if (mesh >= model.meshes.size())
        file.fail("/meshes", fmt::format("there is no mesh {}: the file has {}, counted from 0", mesh,
                                         model.meshes.size()));
    const std::vector<tinygltf::Primitive>& primitives = model.meshes[mesh].primitives;
    if (primitive >= primitives.size())
        file.fail(fmt::format("/meshes/{}/primitives", mesh),
                  fmt::format("there is no primitive {}: the mesh has {}, counted from 0", primitive,
                              primitives.size()));
    return primitives[primitive];
}

void readUvs(GltfFile& file, const GltfAccessor& accessor, const std::string& at, Mesh& mesh) {
    accessor.requireComponents(2, 2);
    mesh.uvs = accessor.rows<2>();
    for (std::size_t i = 0; i < mesh.uvs.size(); ++i) {
        std::array<double, 2>& uv = mesh.uvs[i];
        if (std::abs(uv[0]) > kMostCoordinate || std::abs(uv[1]) > kMostCoordinate)
            file.fail(at, fmt::format("element {} is beyond {:g}", i, kMostCoordinate));
        uv[1] = 1 - uv[1];  // glTF's v goes down.
    }
    mesh.uv_index = mesh.triangles;
}

/// Alphas, in [0, 1], as u.
void readOpacity(const GltfAccessor& colors, Mesh& mesh) {
    colors.requireComponents(4, 4);
    for (const std::array<double, 4>& c : colors.rows<4>())
        mesh.uvs.push_back({std::clamp(c[3], 0.0, 1.0), 0});
    mesh.uv_index = mesh.triangles;
    mesh.uvs_are_opacity = true;
}

}  // namespace

Mesh readGltfPrimitive(GltfFile& file, const GltfPrimitive& which, std::uint64_t& without_area) {
    const tinygltf::Primitive& primitive = primitiveOf(file, which.mesh, which.primitive);
    const std::string pointer = pointerTo(which.mesh, which.primitive);
    const Attributes attributes(file, primitive, pointer);
    const std::optional<GltfAccessor> positions = attributes.find("POSITION", 0);
    if (!positions) file.fail(pointer + "/attributes", "'POSITION' is missing");
    positions->requireComponents(3, 3);
    Mesh mesh;
    mesh.positions = positions->rows<3>();
    const std::size_t count = mesh.positions.size();
    readTriangles(file, primitive, pointer, mesh, without_area);
    if (const auto normals = attributes.find("NORMAL", count)) readNormals(*normals, mesh);
    const std::string uv_name = fmt::format("TEXCOORD_{}", which.uv_set);
    if (const auto uvs = attributes.find(uv_name, count); uvs && !which.opacity)
        readUvs(file, *uvs, fmt::format("{}/attributes/{}", pointer, uv_name), mesh);
    const auto colors = attributes.find("COLOR_0", count);
    if (which.opacity && !colors)
        file.fail(pointer + "/attributes", "'COLOR_0' is missing, and 'vertex_opacity' needs its alpha");
    if (colors) {
        colors->requireComponents(3, 4);
        if (which.opacity) readOpacity(*colors, mesh);
        for (const Vec3d& c : colors->rows<3>()) {
            std::array<float, 3> color;
            for (std::size_t k = 0; k < 3; ++k)
                color[k] = static_cast<float>(std::clamp(c[k] * which.color_factor[k], 0.0, 1.0));
            mesh.colors.push_back(color);
        }
    }
    return mesh;
}

std::array<double, 2> alphaRange(GltfFile& file, std::size_t mesh, std::size_t primitive) {
    const tinygltf::Primitive& which = primitiveOf(file, mesh, primitive);
    const Attributes attributes(file, which, pointerTo(mesh, primitive));
    const std::optional<GltfAccessor> colors = attributes.find("COLOR_0", 0);
    std::array<double, 2> range{1, 1};
    if (!colors || colors->components() < 4 || colors->count() == 0) return range;
    range = {1, 0};
    for (const std::array<double, 4>& c : colors->rows<4>()) {
        const double alpha = std::clamp(c[3], 0.0, 1.0);
        range = {std::min(range[0], alpha), std::max(range[1], alpha)};
    }
    return range;
}

std::vector<std::array<double, 4>> readGltfTangents(GltfFile& file, std::size_t mesh,
                                                    std::size_t primitive) {
    const std::string pointer = pointerTo(mesh, primitive);
    const Attributes attributes(file, primitiveOf(file, mesh, primitive), pointer);
    const std::optional<GltfAccessor> tangents = attributes.find("TANGENT", 0);
    if (!tangents) return {};
    tangents->requireComponents(4, 4);
    return tangents->rows<4>();
}

}  // namespace crt
