#include "scene/mesh/triangulate.h"

#include "base/vec3d.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <utility>

namespace crt {
namespace {

/// Twice the signed area of three points; positive is a left turn.
double turnOf(const PointTree::Point& a, const PointTree::Point& b, const PointTree::Point& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

}  // namespace

// ---- Points ---------------------------------------------------------------------------------------------

void PointTree::build(std::span<const Point> points) {
    points_ = points;
    order_.resize(points.size());
    for (std::uint32_t i = 0; i < order_.size(); ++i) order_[i] = i;
    leaf_of_.resize(points.size());
    nodes_.clear();
    build(0, 0, static_cast<std::uint32_t>(points.size()));
}

void PointTree::build(std::size_t index, std::uint32_t first, std::uint32_t end) {
    constexpr std::uint32_t kLeafPoints = 8;
    constexpr double inf = std::numeric_limits<double>::infinity();
    Node node{{inf, inf}, {-inf, -inf}, first, end, end - first};
    for (std::uint32_t i = first; i < end; ++i)
        for (std::size_t k = 0; k < 2; ++k) {
            node.lower[k] = std::min(node.lower[k], points_[order_[i]][k]);
            node.upper[k] = std::max(node.upper[k], points_[order_[i]][k]);
        }
    if (nodes_.size() <= index) nodes_.resize(index + 1, Node{});
    nodes_[index] = node;
    if (end - first <= kLeafPoints) {
        for (std::uint32_t i = first; i < end; ++i) leaf_of_[order_[i]] = static_cast<std::uint32_t>(index);
        return;
    }
    const std::size_t axis = node.upper[0] - node.lower[0] >= node.upper[1] - node.lower[1] ? 0 : 1;
    const std::uint32_t middle = first + (end - first) / 2;
    std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) { return points_[a][axis] < points_[b][axis]; });
    build(2 * index + 1, first, middle);
    build(2 * index + 2, middle, end);
}

void PointTree::remove(std::uint32_t point) {
    std::size_t node = leaf_of_[point];
    std::uint32_t* const first = &order_[nodes_[node].first];
    // Those that are left stand first in their leaf.
    std::uint32_t* const last = first + nodes_[node].left - 1;
    std::swap(*std::find(first, last, point), *last);
    for (;; node = (node - 1) / 2) {
        --nodes_[node].left;
        if (node == 0) return;
    }
}

/// True if an edge of the triangle has the whole box on its outer side, by more than rounding.
bool PointTree::apart(const Node& node, const std::array<Point, 3>& triangle) const {
    for (std::size_t v = 0; v < 3; ++v) {
        const Point &a = triangle[v], &b = triangle[(v + 1) % 3];
        double innermost = -std::numeric_limits<double>::infinity(), largest = 0;
        for (const double x : {node.lower[0], node.upper[0]})
            for (const double y : {node.lower[1], node.upper[1]}) {
                const double p = (b[0] - a[0]) * (y - a[1]), q = (b[1] - a[1]) * (x - a[0]);
                innermost = std::max(innermost, p - q);
                largest = std::max({largest, std::abs(p), std::abs(q)});
            }
        if (innermost < -1e-14 * largest) return true;
    }
    return false;
}

bool PointTree::anyInside(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    const std::array<Point, 3> triangle{points_[a], points_[b], points_[c]};
    open_.assign(1, 0);
    while (!open_.empty()) {
        const std::size_t index = open_.back();
        const Node& node = nodes_[index];
        open_.pop_back();
        if (node.left == 0 || apart(node, triangle)) continue;
        if (leaf_of_[order_[node.first]] != index) {
            open_.push_back(static_cast<std::uint32_t>(2 * index + 1));
            open_.push_back(static_cast<std::uint32_t>(2 * index + 2));
            continue;
        }
        for (std::uint32_t i = node.first; i < node.first + node.left; ++i) {
            const Point& p = points_[order_[i]];
            if (p == triangle[0] || p == triangle[1] || p == triangle[2]) continue;
            if (turnOf(triangle[0], triangle[1], p) >= 0.0 && turnOf(triangle[1], triangle[2], p) >= 0.0 &&
                turnOf(triangle[2], triangle[0], p) >= 0.0)
                return true;
        }
    }
    return false;
}

// ---- Polygons -------------------------------------------------------------------------------------------

const std::vector<PolygonTriangle>& Triangulator::split(std::span<const Vec3d> corners) {
    triangles_.clear();
    const auto n = static_cast<std::uint32_t>(corners.size());
    if (n == 3) {
        triangles_.push_back({0, 1, 2});
        return triangles_;
    }
    project(corners);
    bool convex = true;
    for (std::uint32_t i = 0; i < n && convex; ++i) {
        const std::uint32_t b = (i + 1) % n, c = (i + 2) % n;
        const double turned = turn(i, b, c);
        convex = turned > 0.0 || (turned == 0.0 && !turnsBack(i, b, c));
    }

    ring_.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) ring_[i] = i;
    if (!convex) {
        cutEars();
        if (ring_.size() > 3) ++crossing_;
    }
    for (std::size_t i = 1; i + 1 < ring_.size(); ++i)
        triangles_.push_back({ring_[0], ring_[i], ring_[i + 1]});
    return triangles_;
}

/// Into the coordinate plane the polygon faces most, counter-clockwise.
void Triangulator::project(std::span<const Vec3d> corners) {
    // Newell's normal, about the first corner: the same for flat and for warped polygons, and far from the
    // origin.
    Vec3d normal{};
    for (std::size_t i = 1; i + 1 < corners.size(); ++i)
        normal = normal + cross(corners[i] - corners[0], corners[i + 1] - corners[0]);
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

double Triangulator::turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    return turnOf(points_[a], points_[b], points_[c]);
}

/// A corner that is turned left and whose triangle holds no other.
bool Triangulator::isEar(std::uint32_t corner) const {
    const std::uint32_t a = before_[corner], c = after_[corner];
    return turn(a, corner, c) > 0.0 && !tree_.anyInside(a, corner, c);
}

/// True if the edge from `corner` to `to` runs back along the edge from `from` to `corner`.
bool Triangulator::turnsBack(std::uint32_t from, std::uint32_t corner, std::uint32_t to) const {
    const PointTree::Point &a = points_[from], &b = points_[corner], &c = points_[to];
    const double p = (a[0] - b[0]) * (c[1] - b[1]), q = (a[1] - b[1]) * (c[0] - b[0]);
    const double along = (a[0] - b[0]) * (c[0] - b[0]) + (a[1] - b[1]) * (c[1] - b[1]);
    return along > 0 && std::abs(p - q) <= 1e-14 * (std::abs(p) + std::abs(q));
}

/// True for the tip of a spike of zero width, and for a corner that coincides with the next one.
bool Triangulator::isSpike(std::uint32_t corner) const {
    return points_[corner] == points_[after_[corner]] ||
           turnsBack(before_[corner], corner, after_[corner]);
}

/// Removes the tips of spikes and returns a remaining corner. `left` is the number of corners.
std::uint32_t Triangulator::dropSpikes(std::uint32_t& left) {
    std::uint32_t corner = 0;
    for (std::uint32_t asked = 0; asked < left && left > 3;) {
        if (!isSpike(corner)) {
            corner = after_[corner];
            ++asked;
            continue;
        }
        const std::uint32_t a = before_[corner], c = after_[corner];
        after_[a] = c;
        before_[c] = a;
        tree_.remove(corner);
        --left;
        corner = a;  // A spike may have several corners: test the neighbours again.
        asked -= std::min(asked, 2u);
    }
    return corner;
}

/// Cuts off what can be cut off, and leaves the rest in ring_. To cut an ear makes no ears but of its two
/// neighbours (Meisters 1975), so each corner is asked once and then again after a cut beside it.
void Triangulator::cutEars() {
    const auto n = static_cast<std::uint32_t>(ring_.size());
    before_.resize(n);
    after_.resize(n);
    for (std::uint32_t i = 0; i < n; ++i) {
        before_[i] = (i + n - 1) % n;
        after_[i] = (i + 1) % n;
    }
    tree_.build(points_);
    std::uint32_t left = n, any = dropSpikes(left);

    // A neighbour of a cut goes to the end of the queue: ears are taken all around rather than one beside
    // the other, which would make slivers.
    std::vector<std::uint32_t> turn_of(n, 0);  // Only the newest entry of a corner counts.
    std::deque<std::pair<std::uint32_t, std::uint32_t>> waiting;
    const auto ask = [&](std::uint32_t corner) { waiting.emplace_back(corner, ++turn_of[corner]); };
    std::uint32_t cuts = 0;
    // Where corners coincide or edges cross, one cut may free others; then all are tested again.
    constexpr int kRounds = 16;
    for (int round = 0; round < kRounds && left > 3 && (round == 0 || cuts > 0); ++round) {
        cuts = 0;
        std::uint32_t corner = any;
        for (std::uint32_t i = 0; i < left; ++i, corner = after_[corner]) ask(corner);
        while (!waiting.empty() && left > 3) {
            const auto [ear, entry] = waiting.front();
            waiting.pop_front();
            if (entry != turn_of[ear] || !isEar(ear)) continue;
            const std::uint32_t a = before_[ear], c = after_[ear];
            triangles_.push_back({a, ear, c});
            after_[a] = c;
            before_[c] = a;
            ++turn_of[ear];
            tree_.remove(ear);
            any = a;
            --left;
            ++cuts;
            ask(a);
            ask(c);
        }
        waiting.clear();
    }
    ring_.clear();
    for (std::uint32_t i = 0, corner = any; i < left; ++i, corner = after_[corner]) ring_.push_back(corner);
}

}  // namespace crt
