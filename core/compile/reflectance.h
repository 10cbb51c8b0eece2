/// Fresnel's equations and means over the cosine, in double, for tables that the compiler of scenes makes.
/// Of + − × ÷ √ alone, so that every host has the same bits.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace crt {

/// Unpolarised reflectance of an interface of relative index `eta`; 1 in total internal reflection.
inline double dielectricReflectance(double cosine, double eta) {
    const double refraction = (eta - 1) * (eta + 1) + cosine * cosine;  // (η cos of refraction)²
    const double cos_t = std::sqrt(refraction) / eta;
    const double rs = (cosine - eta * cos_t) / (cosine + eta * cos_t);
    const double rp = (eta * cosine - cos_t) / (eta * cosine + cos_t);
    const double reflectance = (rs * rs + rp * rp) / 2;
    return refraction > 0 ? reflectance : 1;  // Not before: compilers vectorize what has no branches.
}

/// Of a conductor of index n + ik.
inline double conductorReflectance(double cosine, double n, double k) {
    const double cos2 = cosine * cosine, sin2 = 1 - cos2;
    const double t0 = n * n - k * k - sin2, a2b2 = std::sqrt(t0 * t0 + 4 * n * n * k * k);
    const double a = std::sqrt(std::max((a2b2 + t0) / 2, 0.0));
    const double t1 = a2b2 + cos2, t2 = 2 * a * cosine;
    const double t3 = a2b2 * cos2 + sin2 * sin2, t4 = t2 * sin2;
    const double rs = (t1 - t2) / (t1 + t2);
    return (rs + rs * (t3 - t4) / (t3 + t4)) / 2;
}

/// 2 ∫ f(c) c dc, Simpson's rule in each of `cells`: exact where f is linear in them.
template <class F>
double cosineMean(std::size_t cells, const F& f) {
    const double step = 1.0 / static_cast<double>(cells);
    double sum = 0;
    for (std::size_t i = 0; i < cells; ++i) {
        const double c = static_cast<double>(i) * step;
        sum += f(c) * c + 4 * f(c + step / 2) * (c + step / 2) + f(c + step) * (c + step);
    }
    return sum * step / 3;
}

}  // namespace crt
