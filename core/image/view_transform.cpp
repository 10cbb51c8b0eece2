#include "image/view_transform.h"

#include <algorithm>
#include <cmath>

namespace crt {
namespace {

using Matrix = std::array<Vec3d, 3>;  // Rows.

Vec3d times(const Matrix& m, const Vec3d& v) { return {dot(m[0], v), dot(m[1], v), dot(m[2], v)}; }

double filmic(double x) {
    const double bounded = std::clamp(x, 0.0, 1e6);  // Far above where the curve ends.
    return std::min(1.0, bounded * (2.51 * bounded + 0.03) / (bounded * (2.43 * bounded + 0.59) + 0.14));
}

/// The sigmoid of AgX's default contrast, of a logarithm from 0 to 1.
double agxCurve(double x) {
    const double x2 = x * x, x4 = x2 * x2;
    return 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x -
           0.00232;
}

Vec3d agx(const Vec3d& rgb) {
    constexpr Matrix kIn{{{0.842479062253094, 0.0784335999999992, 0.0792237451477643},
                          {0.0423282422610123, 0.878468636469772, 0.0791661274605434},
                          {0.0423756549057051, 0.0784336, 0.879142973793104}}};
    constexpr Matrix kOut{{{1.19687900512017, -0.0980208811401368, -0.0990297440797205},
                           {-0.0528968517574562, 1.15190312990417, -0.0989611768448433},
                           {-0.0529716355144438, -0.0980434501171241, 1.15107367264116}}};
    constexpr double kLeast_ev = -12.47393, kMost_ev = 4.026069;
    Vec3d curved = times(kIn, rgb);
    for (double& value : curved) {
        const double ev = std::clamp(std::log2(std::max(value, 1e-10)), kLeast_ev, kMost_ev);
        value = agxCurve((ev - kLeast_ev) / (kMost_ev - kLeast_ev));
    }
    Vec3d display = times(kOut, curved);
    // The curve ends in codes of a screen whose exponent is 2.2.
    for (double& value : display) value = std::pow(std::clamp(value, 0.0, 1.0), 2.2);
    return display;
}

}  // namespace

Vec3d onScreen(ViewTransform view, const Vec3d& linear_srgb) {
    if (view == ViewTransform::None) return linear_srgb;
    Vec3d rgb = linear_srgb;
    for (double& value : rgb)
        if (!(value > 0)) value = 0;  // NaN too.
    if (view == ViewTransform::Filmic) return {filmic(rgb[0]), filmic(rgb[1]), filmic(rgb[2])};
    for (double& value : rgb) value = std::min(value, 1e6);
    return agx(rgb);
}

}  // namespace crt
