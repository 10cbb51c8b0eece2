/// Polygons → triangles.
#pragma once

#include "spectra.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace crt {

/// Corner numbers of a triangle, within its polygon.
using PolygonTriangle = std::array<std::uint32_t, 3>;

/// Splits polygons into triangles. Convex ones become a fan from their first corner, which keeps the diagonal of a quad
/// predictable; the others lose one ear after the other. Keeps its memory from one polygon to the next.
class Triangulator {
public:
    /// The n − 2 triangles of a polygon of n ≥ 3 corners; valid until the next call. A polygon that crosses itself is fanned and counted.
    const std::vector<PolygonTriangle>& split(std::span<const Vec3d> corners);

    std::uint64_t crossingPolygons() const { return crossing_; }

private:
    void project(std::span<const Vec3d> corners);
    double turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const;
    bool cutEar();

    std::vector<std::array<double, 2>> points_;
    std::vector<std::uint32_t> ring_;
    std::vector<PolygonTriangle> triangles_;
    std::uint64_t crossing_ = 0;
};

}  // namespace crt
