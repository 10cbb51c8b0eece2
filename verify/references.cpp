#include "verify/references.h"

#include "base/memo.h"

#include "base/vec3d.h"

#include <boost/math/quadrature/gauss.hpp>

#include <algorithm>
#include <cmath>
#include <complex>

namespace crt::verify {
namespace {

/// Of a polygon around the point, what lies on the side of the normal (Sutherland and Hodgman 1974, one
/// plane).
std::vector<Vec3d> aboveHorizon(const std::vector<Vec3d>& polygon, const Vec3d& normal) {
    std::vector<Vec3d> out;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Vec3d& a = polygon[i];
        const Vec3d& b = polygon[(i + 1) % polygon.size()];
        const double ha = dot(a, normal), hb = dot(b, normal);
        if (ha >= 0) out.push_back(a);
        if ((ha > 0 && hb < 0) || (ha < 0 && hb > 0)) out.push_back(a + (b - a) * (ha / (ha - hb)));
    }
    return out;
}

/// Of a rectangle a × b at height 1 with one corner straight above the point.
double cornerFormFactor(double a, double b) {
    const double sign = (a < 0) == (b < 0) ? 1 : -1;
    a = std::abs(a);
    b = std::abs(b);
    const double ra = std::sqrt(1 + a * a), rb = std::sqrt(1 + b * b);
    return sign * (a / ra * std::atan(b / ra) + b / rb * std::atan(a / rb)) / (2 * kPi);
}

}  // namespace

double polygonFormFactor(const Vec3d& point, const Vec3d& normal, const std::vector<Vec3d>& polygon) {
    std::vector<Vec3d> corners;
    for (const Vec3d& v : polygon) corners.push_back(v - point);
    corners = aboveHorizon(corners, normal);
    double sum = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const Vec3d& a = corners[i];
        const Vec3d& b = corners[(i + 1) % corners.size()];
        const Vec3d n = cross(a, b);
        const double sine = length(n);
        if (sine > 0) sum += std::atan2(sine, dot(a, b)) * dot(n, normal) / sine;
    }
    return std::abs(sum) / (2 * kPi);
}

double squareFormFactor(double x, double half_side) {
    const double u0 = x - half_side, u1 = x + half_side;
    return 2 * (cornerFormFactor(u1, half_side) - cornerFormFactor(u0, half_side));
}

double perpendicularFormFactor(double depth, double height) {
    const double w2 = depth * depth, h2 = height * height, r2 = w2 + h2, r = std::sqrt(r2);
    const double logarithms = std::log((1 + w2) * (1 + h2) / (1 + r2)) +
                              w2 * std::log(w2 * (1 + r2) / ((1 + w2) * r2)) +
                              h2 * std::log(h2 * (1 + r2) / ((1 + h2) * r2));
    return (depth * std::atan(1 / depth) + height * std::atan(1 / height) - r * std::atan(1 / r) +
            0.25 * logarithms) /
           (kPi * depth);
}

double rectangleIntegral(const std::function<double(double, double)>& f, double u0, double u1, double v0,
                         double v1, int panels) {
    using Gauss = boost::math::quadrature::gauss<double, 30>;
    double sum = 0;
    for (int i = 0; i < panels; ++i)
        for (int j = 0; j < panels; ++j) {
            const double ua = u0 + (u1 - u0) * i / panels, ub = u0 + (u1 - u0) * (i + 1) / panels;
            const double va = v0 + (v1 - v0) * j / panels, vb = v0 + (v1 - v0) * (j + 1) / panels;
            sum += Gauss::integrate(
                [&](double u) { return Gauss::integrate([&](double v) { return f(u, v); }, va, vb); }, ua,
                ub);
        }
    return sum;
}

double furnaceRadiance(double albedo, int depth) {
    return -std::expm1((depth + 1.0) * std::log(albedo)) / (1 - albedo);
}

double fresnelDielectric(double cos_incidence, double eta) {
    const double sin2 = (1 - cos_incidence * cos_incidence) / (eta * eta);
    if (sin2 >= 1) return 1;
    const double cos_t = std::sqrt(1 - sin2);
    const double rs = (cos_incidence - eta * cos_t) / (cos_incidence + eta * cos_t);
    const double rp = (eta * cos_incidence - cos_t) / (eta * cos_incidence + cos_t);
    return 0.5 * (rs * rs + rp * rp);
}

std::array<double, 2> polarisedFilmReflectance(double cosine, double film, double thickness_nm,
                                               double wavelength_nm, std::complex<double> under) {
    using Complex = std::complex<double>;
    const double sin2 = 1 - cosine * cosine;
    const Complex i(0, 1), before = cosine, beyond_cosine = std::sqrt(1.0 - sin2 / (under * under)),
                  film_cosine = std::sqrt(Complex(1 - sin2 / (film * film)));
    const Complex phase = 2 * kPi * film * thickness_nm / wavelength_nm * film_cosine;
    std::array<double, 2> reflectance{};
    for (std::size_t in_plane = 0; in_plane < 2; ++in_plane) {
        const auto admittance = [&](Complex n, Complex c) { return in_plane == 0 ? n * c : n / c; };
        const Complex q1 = admittance(1, before), q2 = admittance(film, film_cosine),
                      q3 = admittance(under, beyond_cosine);
        // (B, C) = M (1, q₃), M the matrix of the film.
        const Complex b = std::cos(phase) - i * std::sin(phase) / q2 * q3,
                      c = -i * q2 * std::sin(phase) + std::cos(phase) * q3;
        reflectance[in_plane] = std::norm((q1 * b - c) / (q1 * b + c));
    }
    return reflectance;
}

double filmReflectance(double cosine, double film, double thickness_nm, double wavelength_nm,
                       std::complex<double> under) {
    const auto [across, in_plane] =
        polarisedFilmReflectance(cosine, film, thickness_nm, wavelength_nm, under);
    return (across + in_plane) / 2;
}

double paneTransmittance(double cosine, double eta, double film, double thickness_nm, double wavelength_nm) {
    if (1 - cosine * cosine >= eta * eta) return 0;
    const auto one = polarisedFilmReflectance(cosine, film, thickness_nm, wavelength_nm, eta);
    const auto other = polarisedFilmReflectance(cosine, 1, 0, wavelength_nm, eta);
    double sum = 0;
    for (std::size_t i = 0; i < 2; ++i) sum += (1 - one[i]) * (1 - other[i]) / (1 - one[i] * other[i]);
    return sum / 2;
}

double planck_W_m3_sr(double wavelength_nm, double temperature_K) {
    constexpr double h = 6.62607015e-34, c = 299792458.0, k = 1.380649e-23;
    const double metres = wavelength_nm * 1e-9;
    return 2 * h * c * c / (std::pow(metres, 5) * std::expm1(h * c / (metres * k * temperature_K)));
}

double fresnelConductor(double cosine, double n, double k) {
    const std::complex<double> eta(n, k), root = std::sqrt(eta * eta - (1 - cosine * cosine));
    return (std::norm((cosine - root) / (cosine + root)) +
            std::norm((eta * eta * cosine - root) / (eta * eta * cosine + root))) /
           2;
}

namespace {

/// Smith's Λ for GGX.
double smithLambda(double cosine, double alpha) {
    const double tan2 = (1 - cosine * cosine) / (cosine * cosine);
    return (std::sqrt(1 + alpha * alpha * tan2) - 1) / 2;
}

/// A microfacet of unit normal m, at `cos_m` to the surface's, seen at `between`.
struct Facet {
    double cos_m, between;
    Vec3d m;
};

/// Mean of f(m) over the normals of GGX as visible from `cosine`, but for G₁: the density D cos_m dm is
/// dx dφ / 2π with tan²(m) = α² x / (1 − x), and half of φ is enough. With x = 1 − y² the facets
/// that stand on edge, seen as 1/y, are integrated as exactly as others.
/// Where the widths along and across differ, φ is the azimuth before they stretch the normals, all of it.
double overNormals(const Vec3d& view, double along, double across,
                   const std::function<double(const Facet&)>& f, int panels) {
    const auto integrand = [&](double y, double phi) {
        const double slope = std::sqrt(1 - y * y);
        const Vec3d n{along * slope * std::cos(phi), across * slope * std::sin(phi), y};
        const Vec3d m = n * (1 / length(n));
        const double between = dot(view, m);
        return between > 0 ? 2 * y * f({m[2], between, m}) * between / (view[2] * m[2]) : 0.0;
    };
    const double first = along == across && view[1] == 0 ? 0 : -kPi;
    return rectangleIntegral(integrand, 0, 1, first, kPi, panels) / (kPi - first);
}
/// 8 panels differ from 24 by less than 4e-5 for metals and for dielectrics seen from outside. From inside,
/// total internal reflection ends at an edge, and 8 panels are off by up to 3e-4.
constexpr int kPanels = 8, kManyPanels = 24;

int panelsOf(double eta) { return eta < 1 ? kManyPanels : kPanels; }

double overNormals(double cosine, double alpha, const std::function<double(const Facet&)>& f, int panels) {
    return overNormals({std::sqrt(1 - cosine * cosine), 0, cosine}, alpha, alpha, f, panels);
}

double smithShadowing(double cos_o, double cos_i, double alpha) {
    return 1 / (1 + smithLambda(cos_o, alpha) + smithLambda(cos_i, alpha));
}

double roughReflectance(double cosine, double eta, double roughness, int panels) {
    const double alpha = roughness * roughness;
    if (alpha < 1e-3) return fresnelDielectric(cosine, eta);
    return overNormals(
        cosine, alpha,
        [&](const Facet& m) {
            const double cos_i = 2 * m.between * m.cos_m - cosine;
            return cos_i > 0 ? fresnelDielectric(m.between, eta) * smithShadowing(cosine, cos_i, alpha)
                             : 0.0;
        },
        panels);
}
double roughReflectance(double cosine, double eta, double roughness) {
    return roughReflectance(cosine, eta, roughness, panelsOf(eta));
}

}  // namespace

namespace {

/// 2 ∫ f(c) c dc, with c = t², in which what is steep along the surface is smooth.
double meanOverCosine(const std::function<double(double)>& f) {
    return boost::math::quadrature::gauss<double, 20>::integrate(
        [&](double t) { return 4 * t * t * t * f(t * t); }, 0.0, 1.0);
}

double onceMirrored(double cosine, double alpha, const std::function<double(double)>& reflectance,
                    int panels = kPanels) {
    return overNormals(
        cosine, alpha,
        [&](const Facet& m) {
            const double cos_i = 2 * m.between * m.cos_m - cosine;
            return cos_i > 0 ? reflectance(m.between) * smithShadowing(cosine, cos_i, alpha) : 0.0;
        },
        panels);
}

/// Of a metal that absorbs nothing.
double oncePerfectAlbedo(double cosine, double alpha, int panels = kPanels) {
    return onceMirrored(cosine, alpha, [](double) { return 1.0; }, panels);
}

constexpr int kFew = 4;  ///< Panels of what is a mean of means.

/// Of the light that microfacets of this mean reflectance lose, the share that comes back: after a second
/// reflection, or a third, …
double returnedShare(double mean, double lost) {
    const double escapes = 1 - 0.76 * lost;  // by random walks, tests/unit_microfacets.cpp
    double returned = 0, left = mean;
    for (int i = 0; i < 100000 && left > 1e-12; ++i, left *= mean * (1 - escapes))
        returned += left * mean * escapes;
    return returned;
}

double onceTransmitted(double cosine, double eta, double alpha, int panels) {
    return overNormals(
        cosine, alpha,
        [&](const Facet& m) {
            const double sin2 = (1 - m.between * m.between) / (eta * eta);
            if (sin2 >= 1) return 0.0;
            // Snell's law about the microfacet's normal, and of its result the part along the surface's.
            const double cos_i = (cosine - m.between * m.cos_m) / eta + std::sqrt(1 - sin2) * m.cos_m;
            return cos_i > 0
                       ? (1 - fresnelDielectric(m.between, eta)) * smithShadowing(cosine, cos_i, alpha)
                       : 0.0;
        },
        panels);
}

/// Share of diffuse light that a smooth interface lets through, from the side before it: from the denser
/// one it is as much as the other way, over n².
double diffuseTransmittance(double eta) {
    if (eta < 1) return diffuseTransmittance(1 / eta) * eta * eta;
    return 1 - meanOverCosine([&](double c) { return fresnelDielectric(c, eta); });
}

}  // namespace

double microfacetAlbedo(double cosine, double n, double k, double roughness) {
    const double alpha = roughness * roughness;
    const auto reflectance = [&](double c) { return fresnelConductor(c, n, k); };
    return alpha < 1e-3 ? reflectance(cosine) : onceMirrored(cosine, alpha, reflectance);
}

namespace {

double roughMetalAlbedo(double cosine, double roughness, const std::function<double(double)>& reflectance) {
    const double alpha = roughness * roughness;
    if (alpha < 1e-3) return reflectance(cosine);  // the kernel's limit of the smooth metal
    const double lost = 1 - meanOverCosine([&](double c) { return oncePerfectAlbedo(c, alpha, kFew); });
    return onceMirrored(cosine, alpha, reflectance) +
           (1 - oncePerfectAlbedo(cosine, alpha)) *
               returnedShare(meanOverCosine(reflectance), lost);
}

}  // namespace

double roughConductorAlbedo(double cosine, double n, double k, double roughness) {
    return roughMetalAlbedo(cosine, roughness, [&](double c) { return fresnelConductor(c, n, k); });
}

double f82Tint(double cosine, double f0, double tint) {
    const auto schlick = [&](double c) { return f0 + (1 - f0) * std::pow(1 - c, 5); };
    const auto dip = [](double c) { return c * std::pow(1 - c, 6); };
    const double edge = 1.0 / 7;
    return schlick(cosine) - dip(cosine) / dip(edge) * (1 - tint) * schlick(edge);
}

double tintedMetalAlbedo(double cosine, double f0, double tint, double weight, double roughness) {
    return roughMetalAlbedo(cosine, roughness, [&](double c) { return weight * f82Tint(c, f0, tint); });
}

ScatteredShares microfacetShares(double cosine, double eta, double roughness) {
    const double alpha = roughness * roughness;
    const double reflected = roughReflectance(cosine, eta, roughness);
    if (alpha < 1e-3) return {reflected, 1 - reflected};
    return {reflected, onceTransmitted(cosine, eta, alpha, panelsOf(eta))};
}

namespace {

/// The part of diffuse light that microfacets of rough glass lose. Kept: cases ask for many directions of
/// one surface, and this mean of means takes most of the time.
double meanLossOfGlass(double eta, double roughness) {
    using Glass = std::pair<double, double>;
    static Memo<Glass, double> kept(256);
    const auto loss = [](const Glass& glass) {
        const auto [index, width] = glass;
        return 1 - meanOverCosine([index = index, width = width](double c) {
                   return roughReflectance(c, index, width, kFew) +
                          onceTransmitted(c, index, width * width, kFew);
               });
    };
    return kept
        .of({{eta, roughness}},
            [&](const std::vector<Glass>& missing) { return std::vector<double>{loss(missing.front())}; })
        .front();
}

}  // namespace

ScatteredShares roughDielectricShares(double cosine, double eta, double roughness) {
    const ScatteredShares once = microfacetShares(cosine, eta, roughness);
    const double alpha = roughness * roughness, lost = 1 - once.reflected - once.transmitted;
    if (alpha < 1e-3) return once;
    const double here = meanLossOfGlass(eta, roughness), beyond = meanLossOfGlass(1 / eta, roughness);
    const double through = diffuseTransmittance(eta) * std::min(here, beyond) / here;
    return {once.reflected + lost * (1 - through), once.transmitted + lost * through};
}

namespace {

/// GGX of two widths, OpenPBR's.
struct Brushed {
    double along, across;

    Brushed(double roughness, double anisotropy)
        : along(roughness * roughness * std::sqrt(2 / (1 + (1 - anisotropy) * (1 - anisotropy)))),
          across((1 - anisotropy) * along) {}

    double lambda(const Vec3d& w) const {
        const double x = along * w[0], y = across * w[1];
        return (std::sqrt(1 + (x * x + y * y) / (w[2] * w[2])) - 1) / 2;
    }
    double shadowing(const Vec3d& a, const Vec3d& b) const { return 1 / (1 + lambda(a) + lambda(b)); }
    double density(const Vec3d& m) const {
        const double x = m[0] / along, y = m[1] / across, sum = x * x + y * y + m[2] * m[2];
        return 1 / (kPi * along * across * sum * sum);
    }
    /// The share that is mirrored once.
    double once(const Vec3d& view, const std::function<double(double)>& reflectance,
                int panels = kPanels) const {
        return overNormals(
            view, along, across,
            [&](const Facet& facet) {
                const Vec3d w = facet.m * (2 * facet.between) - view;
                return w[2] > 0 ? reflectance(facet.between) * shadowing(view, w) : 0.0;
            },
            panels);
    }
    /// The same of a metal that absorbs nothing.
    double perfect(const Vec3d& view, int panels = kPanels) const {
        return once(view, [](double) { return 1.0; }, panels);
    }
    /// Of light from everywhere, what a perfect metal loses: over a quarter turn, of which all are alike.
    double meanLoss() const {
        if (along == across)
            return 1 - meanOverCosine([&](double c) { return oncePerfectAlbedo(c, along, kFew); });
        return 1 - meanOverCosine([&](double c) {
                   return boost::math::quadrature::gauss<double, 10>::integrate(
                       [&](double turn) {
                           const double phi = turn * kPi / 2, sine = std::sqrt(1 - c * c);
                           return perfect({sine * std::cos(phi), sine * std::sin(phi), c}, kFew);
                       },
                       0.0, 1.0);
               });
    }
};

}  // namespace

double brushedAlbedo(const Vec3d& view, double n, double k, double roughness, double anisotropy) {
    const Brushed it(roughness, anisotropy);
    const auto reflectance = [&](double c) { return fresnelConductor(c, n, k); };
    return it.once(view, reflectance) +
           (1 - it.perfect(view)) * returnedShare(meanOverCosine(reflectance), it.meanLoss());
}

double brushedReflection(const Vec3d& view, const Vec3d& light, double roughness, double anisotropy) {
    const Brushed it(roughness, anisotropy);
    const Vec3d h = view + light;
    const double once = it.density(h * (1 / length(h))) * it.shadowing(view, light) /
                        (4 * view[2] * light[2]);
    // Sharp lobes lose so little that 8 panels are too few for the ratio to the mean.
    const double lost = (1 - it.perfect(view, kManyPanels)) * (1 - it.perfect(light, kManyPanels));
    return (once + lost / (kPi * it.meanLoss())) * light[2];
}

double internalReflectance(double eta, double roughness) {
    const double mean = boost::math::quadrature::gauss<double, 20>::integrate(
        [&](double c) { return 2 * c * roughReflectance(c, eta, roughness, 6); }, 0.0, 1.0);
    return 1 - (1 - mean) / (eta * eta);
}

double plasticAlbedo(double cosine, double base, double eta, double roughness) {
    const double below = internalReflectance(eta, roughness);
    const double above = roughReflectance(cosine, eta, roughness);
    double sum = above, round = (1 - above) * base;  // the share that leaves the base for the first time
    for (int i = 0; i < 10000 && round > 1e-12; ++i, round *= below * base) sum += round * (1 - below);
    return sum;
}

}  // namespace crt::verify
