#include "verify/references.h"

#include "verify/shapes.h"

#include <algorithm>
#include <cmath>

namespace crt::verify {
namespace {

constexpr double kEonLeast = 0.5 - 2 / (3 * kPi), kEonMean = 2.0 / 3 - 28 / (15 * kPi);

double fujii(const Vec3d& view, const Vec3d& light, double r) {
    const double s = dot(view, light) - view[2] * light[2];
    return 1 + r * (s > 0 ? s / std::max(view[2], light[2]) : s);
}

double eonOnce(double cosine, double r) {
    const double sine = std::sqrt(1 - cosine * cosine);
    const double g = sine * (std::acos(cosine) - sine * cosine) +
                     2.0 / 3 * (sine / cosine * (1 - sine * sine * sine) - sine);
    return (1 + r * g / kPi) / (1 + kEonLeast * r);
}

/// Reflectance of what is reflected twice or more, of which one reflection loses `lost` in the mean.
double eonRounds(double rho, double lost) { return rho * rho * (1 - lost) / (1 - rho * lost); }

}  // namespace

double widened(double base, double coat) {
    return std::pow(std::min(1.0, std::pow(base, 4) + 2 * std::pow(coat, 4)), 0.25);
}

double eonReflection(const Vec3d& view, const Vec3d& light, double rho, double r) {
    const double mean = (1 + kEonMean * r) / (1 + kEonLeast * r);
    const double once = rho * fujii(view, light, r) / (1 + kEonLeast * r);
    const double more = eonRounds(rho, 1 - mean) * (1 - eonOnce(view[2], r)) *
                        (1 - eonOnce(light[2], r)) / (1 - mean);
    return (once + more) * light[2] / kPi;
}

double eonAlbedo(double cosine, double rho, double r) {
    const double mean = (1 + kEonMean * r) / (1 + kEonLeast * r), once = eonOnce(cosine, r);
    return rho * once + eonRounds(rho, 1 - mean) * (1 - once);
}

double glossyEonAlbedo(double cosine, double rho, double r, double eta) {
    constexpr int kRows = 256, kColumns = 64;
    const auto once = [&](double c) {
        const Vec3d view{std::sqrt(1 - c * c), 0, c};
        double sum = 0;
        for (int i = 0; i < kRows; ++i) {
            const double c_i = (i + 0.5) / kRows, s_i = std::sqrt(1 - c_i * c_i);
            const double passed = (1 - fresnelDielectric(c_i, eta)) * c_i / (kRows * kColumns);
            for (int k = 0; k < kColumns; ++k) {
                const double phi = kPi * (k + 0.5) / kColumns;
                sum += 2 * passed * fujii(view, {s_i * std::cos(phi), s_i * std::sin(phi), c_i}, r);
            }
        }
        return sum;
    };
    double most = 0, mean = 0, passed = 0;
    for (int i = 0; i < kRows; ++i) {
        const double c = (i + 0.5) / kRows, share = once(c), through = 1 - fresnelDielectric(c, eta);
        most = std::max(most, share);
        mean += share * through * c;
        passed += through * c;
    }
    const double lost = 1 - mean / (passed * most), here = once(cosine) / most;
    const double gloss = fresnelDielectric(cosine, eta);
    return gloss + (1 - gloss) * (rho * here + eonRounds(rho, lost) * (1 - here));
}

double Lacquer::mirrored(double cosine) const { return microfacetShares(cosine, ior, roughness).reflected; }

double Lacquer::darkened(double cosine, double base) const {
    const double specular = fresnelDielectric(cosine, ior);
    const double k = std::lerp(specular, internalReflectance(ior, roughness), base_roughness);
    return std::lerp(1.0, (1 - k) / (1 - base * k), darkening);
}

double Lacquer::passed(double cosine) const {
    const double inside = std::sqrt(1 - (1 - cosine * cosine) / (ior * ior));
    return std::pow(std::sqrt(color), 1 / inside);
}

double Lacquer::reflection(const Vec3d& view, const Vec3d& light) const {
    const double a2 = std::pow(roughness, 4);
    const Vec3d h = unit(view + light);
    const auto lambda = [&](double c) { return (std::sqrt(1 + a2 * (1 - c * c) / (c * c)) - 1) / 2; };
    const double spread = h[2] * h[2] * (a2 - 1) + 1;
    const double density = a2 / (kPi * spread * spread);
    return fresnelDielectric(dot(view, h), ior) * density /
           ((1 + lambda(view[2]) + lambda(light[2])) * 4 * view[2]);
}

double Lacquer::below(const Vec3d& view, const Vec3d& light, double base) const {
    return (1 - mirrored(view[2])) * darkened(view[2], base) * passed(view[2]) * passed(light[2]);
}

double Lacquer::albedo(double cosine, double base) const {
    constexpr int kSteps = 4096;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
        const double c = (i + 0.5) / kSteps;
        sum += 2 * c * passed(c) / kSteps;
    }
    const double gloss = mirrored(cosine);
    return gloss + (1 - gloss) * darkened(cosine, base) * passed(cosine) * base * sum;
}

double sheenAlbedo(double x, double y) {
    const double width = y * (0.0206607 + 1.58491 * y) / (0.0379424 + 1.32227 * y + y * y);
    const double middle =
        (-0.193854 * y - 1.14885 * y * y + 1.7932 * y * y * y - 0.95943 * std::pow(y, 5)) / (0.046391 + y);
    const double rest =
        (0.000654023 * y - 0.0207818 * y * y + 0.119681 * y * y * y) / (1.26264 - 1.92021 * y + y * y);
    return std::exp(-std::pow((x - middle) / width, 2) / 2) / (width * std::sqrt(2 * kPi)) + rest;
}

double sheenDensity(const Vec3d& view, const Vec3d& light, double roughness) {
    const double x = view[2], y = roughness, across = std::sqrt(view[0] * view[0] + view[1] * view[1]);
    const double a = (2.58126 * x + 0.813703 * y) * y / (1 + 0.310327 * x * x + 2.60994 * x * y);
    const double b = std::sqrt(1 - x) * (y - 1) * y * y * y /
                     (0.0000254053 + 1.71228 * x - 1.71506 * x * y + 1.34174 * y * y);
    const double along = (light[0] * view[0] + light[1] * view[1]) / across;
    const double beside = (light[1] * view[0] - light[0] * view[1]) / across;
    // Of the matrix (a 0 b; 0 a 0; 0 0 1) the determinant is a².
    const Vec3d cosine{a * along + b * light[2], a * beside, light[2]};
    const double norm = length(cosine);
    return std::max(cosine[2] / norm, 0.0) / kPi * a * a / (norm * norm * norm);
}

}  // namespace crt::verify
