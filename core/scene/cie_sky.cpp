#include "scene/cie_sky.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace crt {
namespace {

/// Table 1 of the standard: a and b of the gradation, c, d and e of the indicatrix.
struct Parameters {
    double a, b, c, d, e;
};
constexpr std::array<Parameters, kCieSkyTypes> kTypes{{
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
double gradation(const Parameters& p, double cosine) {
    return cosine > 0 ? 1 + p.a * std::exp(p.b / cosine) : 1;
}

/// Scattering of the sky at an angle with the sun.
double indicatrix(const Parameters& p, double angle) {
    const double cosine = std::cos(angle);
    return 1 + p.c * (std::exp(p.d * angle) - std::exp(p.d * std::numbers::pi / 2)) + p.e * cosine * cosine;
}

}  // namespace

double cieSkyLuminance(int type, double zenith_angle, double sun_zenith_angle, double from_sun) {
    const Parameters& p = kTypes[static_cast<std::size_t>(type - 1)];
    return indicatrix(p, from_sun) * gradation(p, std::cos(zenith_angle)) /
           (indicatrix(p, sun_zenith_angle) * gradation(p, 1));
}

double cieSkyLuminance(int type, const Vec3d& towards, const Vec3d& sun, const Vec3d& zenith) {
    const double cosine = dot(towards, zenith);
    if (!(cosine > 0)) return 0;
    const auto angle = [](double c) { return std::acos(std::clamp(c, -1.0, 1.0)); };
    return cieSkyLuminance(type, angle(cosine), angle(dot(sun, zenith)), angle(dot(towards, sun)));
}

}  // namespace crt
