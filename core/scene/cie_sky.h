/// The CIE standard general sky (ISO 15469:2004, CIE S 011/E:2003): how bright a sky is in each direction.
#pragma once

#include "base/vec3d.h"

namespace crt {

/// Luminance over that of the zenith, for sky type 1 to 15: 1 is overcast, 5 uniform, 12 clear. Angles in
/// radians: of the direction and of the sun with the zenith, and of the direction with the sun. Above the
/// horizon.
double cieSkyLuminance(int type, double zenith_angle, double sun_zenith_angle, double from_sun);

/// The same of unit vectors; 0 below the horizon.
double cieSkyLuminance(int type, const Vec3d& towards, const Vec3d& sun, const Vec3d& zenith);

inline constexpr int kCieSkyTypes = 15;

}  // namespace crt
