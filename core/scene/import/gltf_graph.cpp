#include "scene/import/gltf_graph.h"

#include "scene/gltf/gltf_accessor.h"
#include "scene/gltf/gltf_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace crt {
namespace {

/// glTF writes matrices by columns.
Matrix4d byRows(const double* columns) {
    Matrix4d m;
    for (std::size_t r = 0; r < 4; ++r)
        for (std::size_t c = 0; c < 4; ++c) m[4 * r + c] = columns[4 * c + r];
    return m;
}

/// As a quaternion and a scale, glTF 2.0, 5.25.
Matrix4d fromParts(const tinygltf::Node& node) {
    const std::vector<double>&t = node.translation, &q = node.rotation, &s = node.scale;
    double x = 0, y = 0, z = 0, w = 1;
    if (q.size() == 4) {
        const double size = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
        if (size > 0) x = q[0] / size, y = q[1] / size, z = q[2] / size, w = q[3] / size;
    }
    Matrix4d m{1 - 2 * (y * y + z * z),
               2 * (x * y - z * w),
               2 * (x * z + y * w),
               0,
               2 * (x * y + z * w),
               1 - 2 * (x * x + z * z),
               2 * (y * z - x * w),
               0,
               2 * (x * z - y * w),
               2 * (y * z + x * w),
               1 - 2 * (x * x + y * y),
               0,
               0,
               0,
               0,
               1};
    for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c) m[4 * r + c] *= s.size() == 3 ? s[c] : 1;
        m[4 * r + 3] = t.size() == 3 ? t[r] : 0;
    }
    return m;
}

Matrix4d matrixOf(const tinygltf::Node& node) {
    if (node.matrix.size() != 16) return fromParts(node);
    Matrix4d m = byRows(node.matrix.data());
    constexpr double kRounding = 1e-5;  // Of exporters that multiply in single precision.
    if (std::abs(m[12]) + std::abs(m[13]) + std::abs(m[14]) + std::abs(m[15] - 1) <= kRounding)
        m[12] = m[13] = m[14] = 0, m[15] = 1;
    return m;
}

int lightOf(const GltfFile& file, std::size_t index) {
    const tinygltf::Node& node = file.model().nodes[index];
    const auto found = node.extensions.find("KHR_lights_punctual");
    if (found == node.extensions.end() || !found->second.IsObject() || !found->second.Has("light"))
        return -1;
    const tinygltf::Value& light = found->second.Get("light");
    const int number = light.IsInt() ? light.GetNumberAsInt() : -1;
    if (number < 0 || static_cast<std::size_t>(number) >= file.model().lights.size())
        file.fail(fmt::format("/nodes/{}/extensions/KHR_lights_punctual/light", index),
                  fmt::format("the file has only {} lights", file.model().lights.size()));
    return number;
}

std::vector<int> rootsOf(const GltfFile& file, Losses& losses) {
    const tinygltf::Model& model = file.model();
    if (!model.scenes.empty()) {
        const std::size_t shown = model.defaultScene >= 0 ? static_cast<std::size_t>(model.defaultScene) : 0;
        for (std::size_t i = 1; i < model.scenes.size(); ++i)
            losses.add("a scene other than the one shown");
        return model.scenes[shown].nodes;
    }
    std::vector<bool> is_child(model.nodes.size());
    for (const tinygltf::Node& node : model.nodes)
        for (const int child : node.children) is_child[static_cast<std::size_t>(child)] = true;
    std::vector<int> roots;
    for (std::size_t i = 0; i < is_child.size(); ++i)
        if (!is_child[i]) roots.push_back(static_cast<int>(i));
    return roots;
}

}  // namespace

Vec3d pointAt(const Matrix4d& m, const Vec3d& p) {
    Vec3d q;
    for (std::size_t r = 0; r < 3; ++r)
        q[r] = m[4 * r] * p[0] + m[4 * r + 1] * p[1] + m[4 * r + 2] * p[2] + m[4 * r + 3];
    return q;
}
Vec3d directionAt(const Matrix4d& m, const Vec3d& v) {
    Vec3d q;
    for (std::size_t r = 0; r < 3; ++r) q[r] = m[4 * r] * v[0] + m[4 * r + 1] * v[1] + m[4 * r + 2] * v[2];
    return q;
}

bool flattens(const Matrix4d& m) {
    Vec3d rows[3];
    for (std::size_t r = 0; r < 3; ++r) {
        rows[r] = {m[4 * r], m[4 * r + 1], m[4 * r + 2]};
        const double largest = std::max({std::abs(rows[r][0]), std::abs(rows[r][1]), std::abs(rows[r][2])});
        if (!(largest > 0)) return true;
        rows[r] = rows[r] * (1 / largest);
        rows[r] = rows[r] * (1 / length(rows[r]));
    }
    return !(std::abs(dot(rows[0], cross(rows[1], rows[2]))) > 2e-12);
}

GltfGraph readGltfGraph(const GltfFile& file, Losses& losses) {
    const tinygltf::Model& model = file.model();
    GltfGraph graph;
    graph.world.assign(model.nodes.size(), kIdentity4d);
    std::vector<bool> met(model.nodes.size());
    std::vector<std::pair<int, int>> waiting;  // A node and its parent.
    const std::vector<int> roots = rootsOf(file, losses);
    for (auto root = roots.rbegin(); root != roots.rend(); ++root) waiting.emplace_back(*root, -1);
    while (!waiting.empty()) {
        const auto [number, parent] = waiting.back();
        waiting.pop_back();
        const auto i = static_cast<std::size_t>(number);
        if (met[i])
            file.fail(fmt::format("/nodes/{}", number), "this node is its own ancestor, or has two parents");
        met[i] = true;
        const tinygltf::Node& node = model.nodes[i];
        const Matrix4d own = matrixOf(node);
        const Matrix4d& world = graph.world[i] =
            parent < 0 ? own : multiply(graph.world[static_cast<std::size_t>(parent)], own);
        if (!std::all_of(world.begin(), world.end(), [](double x) { return std::abs(x) < 1e100; }))
            file.fail(fmt::format("/nodes/{}", number), "its place in the world overflows");
        if (world[12] != 0 || world[13] != 0 || world[14] != 0 || world[15] != 1)
            file.fail(fmt::format("/nodes/{}/matrix", number), "its last row is not 0 0 0 1");
        if (node.mesh >= 0) graph.meshes.push_back({number, node.mesh, world});
        if (node.camera >= 0) graph.cameras.push_back({number, node.camera, world});
        if (const int light = lightOf(file, i); light >= 0) graph.lights.push_back({number, light, world});
        for (auto child = node.children.rbegin(); child != node.children.rend(); ++child)
            waiting.emplace_back(*child, number);
    }
    return graph;
}

Matrix4d gltfBindPose(GltfFile& file, const GltfGraph& graph, const GltfPlaced& placed, Losses& losses) {
    const tinygltf::Model& model = file.model();
    const int number = model.nodes[static_cast<std::size_t>(placed.node)].skin;
    if (number < 0) return placed.world;
    losses.add("a skin: its mesh keeps the pose in which it was bound");
    const tinygltf::Skin& skin = model.skins[static_cast<std::size_t>(number)];
    if (skin.joints.empty()) return placed.world;
    const Matrix4d& joint = graph.world[static_cast<std::size_t>(skin.joints[0])];
    if (skin.inverseBindMatrices < 0) return joint;
    const std::string at = fmt::format("/skins/{}/inverseBindMatrices", number);
    const GltfAccessor accessor(file, skin.inverseBindMatrices, at);
    accessor.requireComponents(16, 16);
    const Matrix4d world = multiply(joint, byRows(accessor.rows<16>()[0].data()));
    const bool affine = world[12] == 0 && world[13] == 0 && world[14] == 0 && std::abs(world[15] - 1) < 1e-6;
    Matrix4d exact = world;
    exact[15] = 1;
    return affine && !flattens(exact) ? exact : placed.world;
}

}  // namespace crt
