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
    const double root_o = smithRoot(cos_o, alpha);
    const double share = cos_i * (cos_o + root_o) / (root_o * cos_i + smithRoot(cos_i, alpha) * cos_o);
    return cos_i > 0 ? share : 0;
}

/// The same of directions whose azimuth counts.
inline double smithRoot(const Vec3d& w, const Widths& alpha) {
    const double x = alpha.along * w[0], y = alpha.across * w[1];
    return std::sqrt(w[2] * w[2] + x * x + y * y);
}
inline double unshadowed(const Vec3d& w_o, const Vec3d& w_i, const Widths& alpha) {
    const double root_o = smithRoot(w_o, alpha);
    const double share = w_i[2] * (w_o[2] + root_o) / (root_o * w_i[2] + smithRoot(w_i, alpha) * w_o[2]);
    return w_i[2] > 0 ? share : 0;
}

/// Unit, in the plane of x and z.
inline Vec3d atCosine(double cosine) { return {std::sqrt(std::max(0.0, 1 - cosine * cosine)), 0, cosine}; }

/// The azimuths of meanOverVisibleNormals(): of half of the circle, and of all of it.
template <std::size_t kAzimuths>
struct Azimuths {
    std::array<double, kAzimuths> cosines, sines;
    std::array<double, 2 * kAzimuths> all_cosines, all_sines;

    Azimuths() {
        const auto half = halfCircle<kAzimuths>();
        for (std::size_t i = 0; i < kAzimuths; ++i) {
            cosines[i] = all_cosines[2 * i] = all_cosines[2 * i + 1] = half[i][0];
            sines[i] = all_sines[2 * i] = half[i][1];
            all_sines[2 * i + 1] = -half[i][1];
        }
    }
};

/// Mean of f(cos_m, m) over the normals m that w_o sees: cos_m with w_o. Midpoint rule over spherical caps
/// (Dupuy and Benyoub 2023), `kAzimuths` times `kHeights` points of half of each; an integrand with a kink
/// at the critical angle needs more of them than 32.
///
/// Compilers evaluate several azimuths at once if f has no branches: it is evaluated at every point, at 0
/// where cos_m is below, and its value is ignored unless cos_m is above 0.
template <std::size_t kAzimuths, std::size_t kHeights, class F>
double meanOverVisibleNormals(const Vec3d& w_o, const Widths& alpha, const F& f) {
    static const Azimuths<kAzimuths> azimuths;
    const bool symmetric = w_o[1] == 0;  // one half of the azimuths is as the other
    const std::size_t points = symmetric ? kAzimuths : 2 * kAzimuths;
    const double* const cosines = symmetric ? azimuths.cosines.data() : azimuths.all_cosines.data();
    const double* const sines = symmetric ? azimuths.sines.data() : azimuths.all_sines.data();
    const double a = alpha.along * w_o[0], b = alpha.across * w_o[1];
    // In this order isotropic surfaces keep the bits of their tables.
    const double stretch = std::sqrt(a * alpha.along * w_o[0] + b * b + w_o[2] * w_o[2]);
    const double x = a / stretch, y = b / stretch, z = w_o[2] / stretch;  // w_o, stretched
    std::array<double, 2 * kAzimuths> values;
    double sum = 0;
    for (std::size_t i = 0; i < kHeights; ++i) {
        // Closer together towards normals along the surface, where what they mirror ends at the horizon.
        const double rest = 1 - (static_cast<double>(i) + 0.5) / kHeights;
        const double height = rest * rest * (1 + z) - z;
        const double radius = std::sqrt(std::max(0.0, 1 - height * height));
        const double m_z = std::max(0.0, height + z);
        for (std::size_t j = 0; j < points; ++j) {
            const double m_x = alpha.along * (radius * cosines[j] + x),
                         m_y = alpha.across * radius * sines[j] + alpha.across * y;
            const double size = std::sqrt(m_x * m_x + m_y * m_y + m_z * m_z);
            const double cos_m = std::min(1.0, (w_o[0] * m_x + w_o[1] * m_y + w_o[2] * m_z) / size);
            const double value = f(std::max(0.0, cos_m), Vec3d{m_x / size, m_y / size, m_z / size});
            values[j] = cos_m > 0 ? value : 0;
        }
        double row = 0;
        for (std::size_t j = 0; j < points; ++j) row += values[j];
        sum += 2 * rest * row;
    }
    return sum / (kHeights * kAzimuths * (symmetric ? 1.0 : 2.0));
}

}  // namespace crt
