#include "scene/gltf/gltf_tangents.h"

#include "base/vec3d.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>

namespace crt {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

std::optional<Vec3d> directionOf(const Vec3d& v) {
    const double size = length(v);
    if (!(size > 0) || !std::isfinite(size)) return std::nullopt;
    return v * (1 / size);
}

/// Ways of u and v over a surface.
struct Ways {
    Vec3d u{}, v{};
};

/// Nothing where the coordinates of a triangle have no area.
std::optional<Ways> waysOf(const Mesh& mesh, const Triangle& corners, const Triangle& at) {
    const Vec3d &a = mesh.positions[corners[0]], e1 = mesh.positions[corners[1]] - a,
                e2 = mesh.positions[corners[2]] - a;
    const auto &p = mesh.uvs[at[0]], &q = mesh.uvs[at[1]], &r = mesh.uvs[at[2]];
    const double du1 = q[0] - p[0], dv1 = q[1] - p[1], du2 = r[0] - p[0], dv2 = r[1] - p[1];
    const double turn = du1 * dv2 - du2 * dv1 < 0 ? -1 : 1;
    const std::optional<Vec3d> u = directionOf((e1 * dv2 - e2 * dv1) * turn),
                               v = directionOf((e2 * du1 - e1 * du2) * turn);
    if (du1 * dv2 == du2 * dv1 || !u || !v) return std::nullopt;
    return Ways{*u, *v};
}

/// Across the normal.
std::optional<Vec3d> flatten(const Vec3d& way, const Vec3d& normal) {
    return directionOf(way - normal * dot(way, normal));
}

bool differs(const Ways& ways, const std::array<double, 4>& said, const Vec3d& normal) {
    constexpr double kMost_deg = 15;
    static const double least = std::cos(kMost_deg * std::numbers::pi / 180);
    const std::optional<Vec3d> own = flatten(ways.u, normal),
                               other = flatten({said[0], said[1], said[2]}, normal);
    if (!own || !other) return false;
    const bool turns_left = dot(cross(normal, *own), ways.v) >= 0;
    return dot(*own, *other) < least || turns_left != (said[3] >= 0);
}

}  // namespace

bool hasOtherTangents(const Mesh& mesh, const std::vector<std::array<double, 4>>& tangents) {
    constexpr double kMostOfAll = 0.01;
    if (mesh.uv_index.empty() || tangents.size() != mesh.positions.size()) return false;
    // Averaged over the faces around a vertex, as exporters do.
    std::vector<Ways> ways(mesh.positions.size());
    std::vector<Vec3d> faces(mesh.positions.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const Triangle& corners = mesh.triangles[i];
        const std::optional<Ways> own = waysOf(mesh, corners, mesh.uv_index[i]);
        const Vec3d& a = mesh.positions[corners[0]];
        const std::optional<Vec3d> face =
            directionOf(cross(mesh.positions[corners[1]] - a, mesh.positions[corners[2]] - a));
        for (const std::uint32_t corner : corners) {
            if (face) faces[corner] = faces[corner] + *face;
            if (own) ways[corner] = {ways[corner].u + own->u, ways[corner].v + own->v};
        }
    }
    std::size_t corners = 0, others = 0;
    for (const Triangle& triangle : mesh.triangles)
        for (const std::uint32_t corner : triangle) {
            const std::optional<Vec3d> normal =
                directionOf(mesh.normals.empty() ? faces[corner] : mesh.normals[corner]);
            ++corners;
            if (normal && differs(ways[corner], tangents[corner], *normal)) ++others;
        }
    return static_cast<double>(others) > kMostOfAll * static_cast<double>(corners);
}

}  // namespace crt
