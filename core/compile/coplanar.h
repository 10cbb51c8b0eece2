/// Triangles of a compiled scene that lie in one plane.
#pragma once

#include "base/vec3d.h"

#include <array>
#include <cstdint>

namespace crt {

/// A triangle of the compiled scene, in double.
struct Corners {
    std::array<Vec3d, 3> p;
    Vec3d normal;  ///< Unit; zero without area.
    double clearance = 0;
};
Corners cornersOf(const unsigned char* blob, std::uint32_t slot);
double largestEdge(const Corners& c);

/// True if the corners of the smaller lie in the plane of the larger, whose normal is known better, as well
/// as rays can tell.
bool inOnePlane(const Corners& a, const Corners& b);
/// True if the distance of the point from the triangle is at most `room`.
bool isOn(const Vec3d& point, const Corners& c, double room);
/// True if two triangles of one plane have area in common: by the separating axes of their edges. Triangles
/// that merely touch have not.
bool overlap(const Corners& a, const Corners& b);

}  // namespace crt
