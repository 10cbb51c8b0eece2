/// Looks at a model from within. Finds a camera for a building: a place that shows more of it than a view
/// from outside. Finds whether a camera of the file is in a closed room or under a dome, which no light from
/// outside reaches.
#pragma once

#include "base/vec3d.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace crt {

/// A triangle in the world, and which of the model's materials it has.
struct PaintedTriangle {
    std::array<float, 3> corner, to_second, to_third;
    std::uint32_t material;

    PaintedTriangle(const Vec3d& a, const Vec3d& b, const Vec3d& c, std::uint32_t painted);
};

/// Models of more are looked at from outside: to look for a place takes a while, and memory.
inline constexpr std::size_t kMostPaintedTriangles = 4'000'000;

/// Fewer tell nothing.
inline constexpr std::size_t kFewestMaterialsOfBuildings = 3;

struct InnerView {
    Vec3d position, target;
    double fov_deg;
    double distance;  ///< Half of what is seen is nearer; for a camera of the file, a quarter.
};

/// A place for the camera within the model, if one shows the front sides of more than twice as many
/// materials as eight views from around it together. That is so of buildings, whatever their size. A vase, a
/// car and a figure show outside what they are made of, and what has one material has nothing to tell by.
/// The same for the same triangles: directions are fixed. `aspect` is width over height.
std::optional<InnerView> innerView(const std::vector<PaintedTriangle>& triangles, double aspect);

/// The distance of the nearest quarter of what is seen from a place, if triangles surround the place: every
/// one of 256 directions meets one. Windows and panes count as walls. `ahead` has length 1, `fov` is in
/// radians.
std::optional<double> distanceWithin(const std::vector<PaintedTriangle>& triangles, const Vec3d& position,
                                     const Vec3d& ahead, double fov);

}  // namespace crt
