/// Floors of one material, for probes of what it sends towards a viewer.
#pragma once

#include "verify/context.h"

#include <string>

namespace crt::verify {

/// A floor of the material, seen at an angle in light 1 from everywhere.
std::string floorOf(const std::string& material, double degrees);

/// A square around the origin with normal +y, over which a checkerboard has 4 × 4 squares, the first value
/// in the middle: keys of an object.
std::string checkeredSquare(const std::string& material, double height, double half_side);

/// Such a floor, seen as floorOf.
std::string checkeredFloor(const std::string& material, double degrees);

/// Radiance of the floor towards `view`, lit by a beam from `light` that brings irradiance 1 to a plane that
/// faces it, over what the wavelengths of these few samples make of radiance 1. z is along the normal.
double inBeam(Context& context, const std::string& material, const Vec3d& view, const Vec3d& light);

}  // namespace crt::verify
