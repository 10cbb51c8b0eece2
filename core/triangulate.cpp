#include "triangulate.h"

#include "vec3d.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace crt {

const std::vector<PolygonTriangle>& Triangulator::split(std::span<const Vec3d> corners) {
    triangles_.clear();
    const auto n = static_cast<std::uint32_t>(corners.size());
    if (n == 3) {
        triangles_.push_back({0, 1, 2});
        return triangles_;
    }
    project(corners);
    bool convex = true;
    for (std::uint32_t i = 0; i < n && convex; ++i) convex = turn(i, (i + 1) % n, (i + 2) % n) >= 0.0;

    ring_.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) ring_[i] = i;
    while (!convex && ring_.size() > 3 && cutEar()) {}
    if (!convex && ring_.size() > 3) ++crossing_;
    for (std::size_t i = 1; i + 1 < ring_.size(); ++i) triangles_.push_back({ring_[0], ring_[i], ring_[i + 1]});
    return triangles_;
}

/// Into the coordinate plane the polygon faces most, counter-clockwise.
void Triangulator::project(std::span<const Vec3d> corners) {
    // Newell's normal, about the first corner: the same for flat and for warped polygons, and far from the origin.
    Vec3d normal{};
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) normal = normal + cross(corners[i] - corners[0], corners[i + 1] - corners[0]);
    int axis = 0;
    for (int k = 1; k < 3; ++k)
        if (std::abs(normal[k]) > std::abs(normal[axis])) axis = k;
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (normal[axis] < 0.0) std::swap(u, v);
    points_.resize(corners.size());
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const Vec3d p = corners[i] - corners[0];
        points_[i] = {p[u], p[v]};
    }
}

/// Twice the signed area of three corners; positive is a left turn.
double Triangulator::turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    const auto [ax, ay] = points_[a];
    return (points_[b][0] - ax) * (points_[c][1] - ay) - (points_[b][1] - ay) * (points_[c][0] - ax);
}

/// Removes one corner whose triangle holds no other. False when there is none.
bool Triangulator::cutEar() {
    const std::size_t n = ring_.size();
    for (std::size_t i = 0; i < n; ++i) {
        const std::uint32_t a = ring_[(i + n - 1) % n], b = ring_[i], c = ring_[(i + 1) % n];
        if (turn(a, b, c) <= 0.0) continue;
        const bool empty = std::none_of(ring_.begin(), ring_.end(), [&](std::uint32_t p) {
            return p != a && p != b && p != c && points_[p] != points_[a] && points_[p] != points_[b] &&
                   points_[p] != points_[c] && turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
        });
        if (!empty) continue;
        triangles_.push_back({a, b, c});
        ring_.erase(ring_.begin() + static_cast<std::ptrdiff_t>(i));
        return true;
    }
    return false;
}

}  // namespace crt
