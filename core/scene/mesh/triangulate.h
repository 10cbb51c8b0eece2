/// Polygons → triangles.
#pragma once

#include "spectra/spectra.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace crt {

/// Corner numbers of a triangle, within its polygon.
using PolygonTriangle = std::array<std::uint32_t, 3>;

/// Points of a plane in a tree of boxes (Bentley's k-d tree), from which points are taken out one by one.
class PointTree {
public:
    using Point = std::array<double, 2>;

    /// The points must stay where they are.
    void build(std::span<const Point> points);
    void remove(std::uint32_t point);
    /// True if one of the remaining corners lies in a triangle that is turned left, its edges included, and
    /// is none of its corners, by number or place.
    bool anyInside(std::uint32_t a, std::uint32_t b, std::uint32_t c) const;

private:
    struct Node {
        Point lower, upper;
        std::uint32_t first, end;  ///< In order_.
        std::uint32_t left;        ///< Points not yet removed.
    };
    void build(std::size_t node, std::uint32_t first, std::uint32_t end);
    bool apart(const Node& node, const std::array<Point, 3>& triangle) const;

    std::span<const Point> points_;
    std::vector<std::uint32_t> order_;
    std::vector<Node> nodes_;                  ///< As a heap: the children of i are 2i + 1 and 2i + 2.
    std::vector<std::uint32_t> leaf_of_;       ///< By point.
    mutable std::vector<std::uint32_t> open_;  ///< Of the walk, kept for its memory.
};

/// Splits polygons into triangles. Convex ones become a fan from their first corner, which keeps the
/// diagonal of a quad predictable; the others lose one ear after the other, in O(n log n) for n corners
/// unless they cross themselves. Keeps its memory from one polygon to the next.
class Triangulator {
public:
    /// The n − 2 triangles of a polygon of n ≥ 3 corners; valid until the next call. Spikes of
    /// zero width in a polygon that is not convex get no triangles. A polygon that crosses itself is fanned
    /// and counted.
    const std::vector<PolygonTriangle>& split(std::span<const Vec3d> corners);

    std::uint64_t crossingPolygons() const { return crossing_; }

private:
    void project(std::span<const Vec3d> corners);
    double turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const;
    bool turnsBack(std::uint32_t from, std::uint32_t corner, std::uint32_t to) const;
    bool isSpike(std::uint32_t corner) const;
    std::uint32_t dropSpikes(std::uint32_t& left);
    void cutEars();
    bool isEar(std::uint32_t corner) const;

    std::vector<std::array<double, 2>> points_;
    std::vector<std::uint32_t> before_, after_;  ///< Neighbours in what is left of the polygon.
    std::vector<std::uint32_t> ring_;            ///< The remaining corners at the end.
    PointTree tree_;
    std::vector<PolygonTriangle> triangles_;
    std::uint64_t crossing_ = 0;
};

}  // namespace crt
