#include "scene/cie_sky.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace crt {
namespace {

constexpr std::array<CieSkyParameters, kCieSkyTypes> kTypes{{
    {4.0, -0.70, 0, -1.0, 0.00},
    {4.0, -0.70, 2, -1.5, 0.15},
    {1.1, -0.80, 0, -1.0, 0.00},
    {1.1, -0.80, 2, -1.5, 0.15},
    {0.0, -1.00, 0, -1.0, 0.00},
    {0.0, -1.00, 2, -1.5, 0.15},
    {0.0, -1.00, 5, -2.5, 0.30},
    {0.0, -1.00, 10, -3.0, 0.45},
    {-1.0, -0.55, 2, -1.5, 0.15},
    {-1.0, -0.55, 5, -2.5, 0.30},
    {-1.0, -0.55, 10, -3.0, 0.45},
    {-1.0, -0.32, 10, -3.0, 0.45},
    {-1.0, -0.32, 16, -3.0, 0.30},
    {-1.0, -0.15, 16, -3.0, 0.30},
    {-1.0, -0.15, 24, -2.8, 0.15},
}};

/// Brighter or darker towards the horizon.
double gradation(const CieSkyParameters& p, double cosine) {
    return cosine > 0 ? 1 + p.a * std::exp(p.b / cosine) : 1;
}

/// Scattering of the sky at an angle with the sun.
double indicatrix(const CieSkyParameters& p, double angle) {
    const double cosine = std::cos(angle);
    return 1 + p.c * (std::exp(p.d * angle) - std::exp(p.d * std::numbers::pi / 2)) + p.e * cosine * cosine;
}

/// Between unit vectors of this dot product, in radians.
double angle(double cosine) { return std::acos(std::clamp(cosine, -1.0, 1.0)); }

}  // namespace

CieSkyLuminance::CieSkyLuminance(int type, const Vec3d& sun, const Vec3d& zenith)
    : parameters_(kTypes[static_cast<std::size_t>(type - 1)]),
      sun_(sun),
      zenith_(zenith),
      of_zenith_(indicatrix(parameters_, angle(dot(sun, zenith))) * gradation(parameters_, 1)) {}

double CieSkyLuminance::operator()(const Vec3d& towards) const {
    const double cosine = dot(towards, zenith_);
    if (!(cosine > 0)) return 0;
    return indicatrix(parameters_, angle(dot(towards, sun_))) *
           gradation(parameters_, std::cos(angle(cosine))) / of_zenith_;
}

}  // namespace crt
