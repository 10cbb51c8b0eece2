#include "compile/divide.h"

#include "base/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>

namespace crt {
namespace {

constexpr double kLongest = 2;      ///< Edge over its distance and the details. Below 2√3: divide.h.
constexpr int kMostHalvings = 128;  ///< Of one triangle, one in another: far more than doubles have digits.
constexpr std::size_t kMeasuredAtATime = std::size_t{1} << 14;

/// In units of the details, from the focus.
class Ruler {
public:
    explicit Ruler(const Focus& focus) : focus_(focus) {}

    Vec3d operator()(const Vec3d& p) const { return (p - focus_.centre) * (1 / focus_.detail); }

    /// True if the edge must be halved. The answer is the same for (b, a), so that neighbours agree.
    static bool isLong(const Vec3d& a, const Vec3d& b) {
        if (dot(b, b) < dot(a, a)) return isLong(b, a);
        const Vec3d edge = b - a;
        const double squared = dot(edge, edge);
        const double s = squared > 0 ? std::clamp(-dot(a, edge) / squared, 0.0, 1.0) : 0.0;
        return std::sqrt(squared) > kLongest * (length(a + edge * s) + 1);
    }

private:
    Focus focus_;
};

/// From corner to corner, the lesser first.
using Edge = std::pair<Vec3d, Vec3d>;
Edge edgeOf(const Vec3d& a, const Vec3d& b) { return a < b ? Edge{a, b} : Edge{b, a}; }

/// The edges that must be halved: long ones, except edges of triangles that stay whole.
class Rule {
public:
    Rule(const Scene& scene, const std::vector<Placement>& placements, const Focus& focus)
        : scene_(scene), ruler_(focus) {
        for (const Placement& placement : placements)
            for (std::size_t i = 0; i < placement.mesh->triangles.size(); ++i)
                if (staysWhole(placement, i)) keep(cornersOf(placement, i));
    }

    static bool staysWhole(const Placement& placement) {
        return placement.object->transforms.size() > 1 || !placement.mesh->colors.empty();
    }

    /// In units of the details.
    std::array<Vec3d, 3> cornersOf(const Placement& placement, std::size_t triangle) const {
        std::array<Vec3d, 3> p = placement.corners(triangle);
        for (Vec3d& corner : p) corner = ruler_(corner);
        return p;
    }

    bool keeps(const Vec3d& a, const Vec3d& b) const {
        return !kept_.empty() && kept_.count(edgeOf(a, b)) > 0;
    }
    bool halves(const Vec3d& a, const Vec3d& b) const { return Ruler::isLong(a, b) && !keeps(a, b); }
    bool divides(const Placement& placement, std::size_t triangle) const {
        const auto [a, b, c] = cornersOf(placement, triangle);
        return (halves(a, b) || halves(b, c) || halves(c, a)) && !staysWhole(placement, triangle);
    }

private:
    bool staysWhole(const Placement& placement, std::size_t triangle) const {
        return staysWhole(placement) ||
               emissionIndexOf(scene_, *placement.object, *placement.mesh, triangle) >= 0;
    }
    void keep(const std::array<Vec3d, 3>& p) {
        for (std::size_t k = 0; k < 3; ++k)
            if (Ruler::isLong(p[k], p[(k + 1) % 3])) kept_.insert(edgeOf(p[k], p[(k + 1) % 3]));
    }

    const Scene& scene_;
    const Ruler ruler_;
    std::set<Edge> kept_;
};

/// A corner of a piece: its position in units of the details, and its vertex in the mesh.
struct Corner {
    Vec3d at;
    std::uint32_t position, normal, uv;
};

Vec3d middle(const Vec3d& a, const Vec3d& b) { return (a + b) * 0.5; }

/// A mesh whose triangles are written out in the old order, some of them as several.
class Divider {
public:
    Divider(const Placement& placement, const Rule& rule)
        : placement_(placement), rule_(rule), old_(*placement.mesh), mesh_(old_) {
        mesh_.triangles.clear();
        mesh_.normal_index.clear();
        mesh_.uv_index.clear();
        mesh_.material.clear();
        mesh_.emission.clear();
    }

    Mesh divided() {
        for (triangle_ = 0; triangle_ < old_.triangles.size(); ++triangle_) {
            const std::array<Corner, 3> corners = cornersOf(triangle_);
            const Vec3d &a = corners[0].at, &b = corners[1].at, &c = corners[2].at;
            if (rule_.divides(placement_, triangle_))
                divide(corners, {rule_.keeps(a, b), rule_.keeps(b, c), rule_.keeps(c, a)}, 0);
            else
                write(corners);
        }
        return std::move(mesh_);
    }

private:
    std::array<Corner, 3> cornersOf(std::size_t triangle) const {
        const std::array<Vec3d, 3> placed = rule_.cornersOf(placement_, triangle);
        std::array<Corner, 3> corners{};
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t from = placement_.from(k);
            corners[from] = {placed[k], old_.triangles[triangle][from],
                             old_.normal_index.empty() ? kNoNormal : old_.normal_index[triangle][from],
                             old_.uv_index.empty() ? kNoUv : old_.uv_index[triangle][from]};
        }
        return corners;
    }

    Corner between(const Corner& a, const Corner& b) {
        Corner m{middle(a.at, b.at), static_cast<std::uint32_t>(mesh_.positions.size()), kNoNormal, kNoUv};
        mesh_.positions.push_back(middle(mesh_.positions[a.position], mesh_.positions[b.position]));
        if (a.normal != kNoNormal && b.normal != kNoNormal) {
            m.normal = static_cast<std::uint32_t>(mesh_.normals.size());
            mesh_.normals.push_back(middle(mesh_.normals[a.normal], mesh_.normals[b.normal]));
        }
        if (a.uv != kNoUv && b.uv != kNoUv) {
            m.uv = static_cast<std::uint32_t>(mesh_.uvs.size());
            const std::array<double, 2> u = mesh_.uvs[a.uv], v = mesh_.uvs[b.uv];
            mesh_.uvs.push_back({(u[0] + v[0]) / 2, (u[1] + v[1]) / 2});
        }
        return m;
    }

    /// Halves the longest edge first. keep[k]: the edge from corner k to the next one stays whole.
    /// Next to one that stays whole only the triangle's own edges are halved: edges within it would all be
    /// long again, and pieces ever thinner.
    void divide(const std::array<Corner, 3>& t, const std::array<bool, 3>& keep, int halvings) {
        std::size_t from = 3;
        double longest = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3d &a = t[k].at, &b = t[(k + 1) % 3].at;
            if (!keep[k] && length(b - a) > longest && Ruler::isLong(a, b)) {
                from = k;
                longest = length(b - a);
            }
        }
        if (from == 3 || halvings == kMostHalvings) return write(t);
        const Corner &a = t[from], &b = t[(from + 1) % 3], &c = t[(from + 2) % 3], m = between(a, b);
        const bool within = keep[0] || keep[1] || keep[2];
        divide({a, m, c}, {false, within, keep[(from + 2) % 3]}, halvings + 1);
        divide({m, b, c}, {false, keep[(from + 1) % 3], within}, halvings + 1);
    }

    void write(const std::array<Corner, 3>& t) {
        mesh_.triangles.push_back({t[0].position, t[1].position, t[2].position});
        if (!old_.normal_index.empty())
            mesh_.normal_index.push_back({t[0].normal, t[1].normal, t[2].normal});
        if (!old_.uv_index.empty()) mesh_.uv_index.push_back({t[0].uv, t[1].uv, t[2].uv});
        if (!old_.material.empty()) mesh_.material.push_back(old_.material[triangle_]);
        if (!old_.emission.empty()) mesh_.emission.push_back(old_.emission[triangle_]);
    }

    const Placement& placement_;
    const Rule& rule_;
    const Mesh& old_;
    Mesh mesh_;
    std::size_t triangle_ = 0;
};

}  // namespace

DividedMeshes dividedMeshes(const Scene& scene, const std::vector<Placement>& placements,
                            const Focus& focus) {
    const Rule rule(scene, placements, focus);
    DividedMeshes divided;
    for (const Placement& placement : placements) {
        if (Rule::staysWhole(placement)) continue;
        const std::size_t count = placement.mesh->triangles.size();
        std::vector<std::uint8_t> any(partsOf(count, kMeasuredAtATime), 0);
        parallelFor(count, kMeasuredAtATime, [&](std::size_t first, std::size_t end) {
            std::uint8_t& own = any[first / kMeasuredAtATime];
            for (std::size_t i = first; i < end && own == 0; ++i) own = rule.divides(placement, i) ? 1 : 0;
        });
        if (std::any_of(any.begin(), any.end(), [](std::uint8_t part) { return part != 0; }))
            divided.emplace(placement.object, Divider(placement, rule).divided());
    }
    return divided;
}

}  // namespace crt
