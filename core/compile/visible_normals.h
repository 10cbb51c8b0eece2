/// Means over the normals of GGX that a direction sees: what the tables of rough surfaces are made of.
#pragma once

#include "base/vec3d.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace crt {

/// Cosine and sine at the middles of `parts` equal parts of the half circle, a power of two. Made of
/// + − × ÷ √ alone, so that every host has the same bits.
template <std::size_t parts>
std::array<std::array<double, 2>, parts> halfCircle() {
    static_assert((parts & (parts - 1)) == 0);
    double cosine = 0, sine = 1;  // of a quarter turn, halved until it is half a part
    for (std::size_t n = 1; n < parts; n *= 2) {
        cosine = std::sqrt((1 + cosine) / 2);
        sine /= 2 * cosine;
    }
    const double step_cosine = cosine * cosine - sine * sine, step_sine = 2 * cosine * sine;
    std::array<std::array<double, 2>, parts> points;
    for (auto& point : points) {
        point = {cosine, sine};
        const double next = cosine * step_cosine - sine * step_sine;
        sine = cosine * step_sine + sine * step_cosine;
        cosine = next;
    }
    return points;
}

/// Of GGX: along the tangent, which is x, and across it.
struct Widths {
    double along, across;
};

/// The root of Smith's shadowing, a = √(cos² + α² sin²), of which Λ = (a/cos − 1)/2.
inline double smithRoot(double cosine, double alpha) {
    return std::sqrt(cosine * cosine + alpha * alpha * (1 - cosine * cosine));
}

/// Of light that leaves a normal seen from `cos_o` towards `cos_i`, the share that nothing is in the way of:
/// G₂ / G₁, correlated by height (Heitz 2014). 0 below the horizon.
inline double unshadowed(double cos_o, double cos_i, double alpha) {
    if (!(cos_i > 0)) return 0;
    const double root_o = smithRoot(cos_o, alpha);
    return cos_i * (cos_o + root_o) / (root_o * cos_i + smithRoot(cos_i, alpha) * cos_o);
}

/// The same of directions whose azimuth counts.
inline double smithRoot(const Vec3d& w, const Widths& alpha) {
    const double x = alpha.along * w[0], y = alpha.across * w[1];
    return std::sqrt(w[2] * w[2] + x * x + y * y);
}
inline double unshadowed(const Vec3d& w_o, const Vec3d& w_i, const Widths& alpha) {
    if (!(w_i[2] > 0)) return 0;
    const double root_o = smithRoot(w_o, alpha);
    return w_i[2] * (w_o[2] + root_o) / (root_o * w_i[2] + smithRoot(w_i, alpha) * w_o[2]);
}

/// Unit, in the plane of x and z.
inline Vec3d atCosine(double cosine) {
    return {std::sqrt(std::max(0.0, 1 - cosine * cosine)), 0, cosine};
}

/// Mean of f(cos_m, m) over the normals m that w_o sees: cos_m with w_o. Midpoint rule over spherical caps
/// (Dupuy and Benyoub 2023), `kAzimuths` times `kHeights` points of half of each; what has a kink at the
/// critical angle wants more of them than 32.
template <std::size_t kAzimuths, std::size_t kHeights, class F>
double meanOverVisibleNormals(const Vec3d& w_o, const Widths& alpha, const F& f) {
    static const auto azimuths = halfCircle<kAzimuths>();
    const bool symmetric = w_o[1] == 0;  // one half of the azimuths is as the other
    const double a = alpha.along * w_o[0], b = alpha.across * w_o[1];
    // In this order isotropic surfaces keep the bits of their tables.
    const double stretch = std::sqrt(a * alpha.along * w_o[0] + b * b + w_o[2] * w_o[2]);
    const double x = a / stretch, y = b / stretch, z = w_o[2] / stretch;  // w_o, stretched
    double sum = 0;
    for (std::size_t i = 0; i < kHeights; ++i) {
        // Closer together towards normals along the surface, where what they mirror ends at the horizon.
        const double rest = 1 - (static_cast<double>(i) + 0.5) / kHeights;
        const double height = rest * rest * (1 + z) - z;
        const double radius = std::sqrt(std::max(0.0, 1 - height * height));
        double row = 0;
        const auto add = [&](double cos_phi, double sin_phi) {
            const Vec3d m{alpha.along * (radius * cos_phi + x),
                          alpha.across * radius * sin_phi + alpha.across * y, std::max(0.0, height + z)};
            const double size = std::sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
            const double cos_m = std::min(1.0, (w_o[0] * m[0] + w_o[1] * m[1] + w_o[2] * m[2]) / size);
            if (cos_m > 0) row += f(cos_m, Vec3d{m[0] / size, m[1] / size, m[2] / size});
        };
        for (const auto& [cos_phi, sin_phi] : azimuths) {
            add(cos_phi, sin_phi);
            if (!symmetric) add(cos_phi, -sin_phi);
        }
        sum += 2 * rest * row;
    }
    return sum / (kHeights * kAzimuths * (symmetric ? 1.0 : 2.0));
}

}  // namespace crt
