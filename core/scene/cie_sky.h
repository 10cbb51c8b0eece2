/// The CIE standard general sky (ISO 15469:2004, CIE S 011/E:2003): how bright a sky is in each direction.
#pragma once

#include "base/vec3d.h"

namespace crt {

/// Table 1 of the standard: a and b of the gradation, c, d and e of the indicatrix.
struct CieSkyParameters {
    double a, b, c, d, e;
};

/// A sky of type 1 to 15 (1 is overcast, 5 uniform, 12 clear) under a sun. Takes unit vectors.
class CieSkyLuminance {
public:
    CieSkyLuminance(int type, const Vec3d& sun, const Vec3d& zenith);

    /// Luminance towards a unit vector over that of the zenith; 0 below the horizon.
    double operator()(const Vec3d& towards) const;

private:
    CieSkyParameters parameters_;
    Vec3d sun_, zenith_;
    double of_zenith_;  ///< The product of gradation and indicatrix at the zenith.
};

inline constexpr int kCieSkyTypes = 15;

}  // namespace crt
