/// Means over the normals of GGX that a direction sees: what the tables of rough surfaces are made of.
#pragma once

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

/// Mean of f(cos_m, m_z) over the normals m that w_o at `cosine` sees: cos_m with w_o, m_z with the surface.
/// Midpoint rule over spherical caps (Dupuy and Benyoub 2023), `kAzimuths` times 128 points; what has a kink
/// at the critical angle wants more of them than 32.
template <std::size_t kAzimuths, class F>
double meanOverVisibleNormals(double cosine, double alpha, const F& f) {
    constexpr std::size_t kHeights = 128;
    static const auto azimuths = halfCircle<kAzimuths>();
    const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    const double stretch = std::sqrt(alpha * sine * alpha * sine + cosine * cosine);
    const double x = alpha * sine / stretch, z = cosine / stretch;  // w_o, stretched
    double sum = 0;
    for (std::size_t i = 0; i < kHeights; ++i) {
        // Closer together towards normals along the surface, where what they mirror ends at the horizon.
        const double rest = 1 - (static_cast<double>(i) + 0.5) / kHeights;
        const double height = rest * rest * (1 + z) - z;
        const double radius = std::sqrt(std::max(0.0, 1 - height * height));
        double row = 0;
        for (const auto& [cos_phi, sin_phi] : azimuths) {  // the other half of them is the same
            const double m_x = alpha * (radius * cos_phi + x), m_y = alpha * radius * sin_phi;
            const double m_z = std::max(0.0, height + z);
            const double length = std::sqrt(m_x * m_x + m_y * m_y + m_z * m_z);
            const double cos_m = std::min(1.0, (sine * m_x + cosine * m_z) / length);
            if (cos_m > 0) row += f(cos_m, m_z / length);
        }
        sum += 2 * rest * row;
    }
    return sum / (kHeights * kAzimuths);
}

}  // namespace crt
