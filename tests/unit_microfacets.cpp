// The energy loss of microfacets, and its compensation: the tables of the compiler of scenes against
// quadrature and against random walks on Smith's surface, which know neither.
#include "kernel_test.h"

#include "compile/compensation.h"
#include "verify/references.h"

#include <array>
#include <cmath>

using namespace kernel_test;
using Catch::Matchers::WithinAbs;

namespace {

constexpr double kPi = 3.14159265358979323846;

using crt::Vec3d;

/// Walks of rays between GGX microfacets of Smith's independent heights, uniform in [-1, 1] (Heitz, Hanika,
/// d'Eon and Dachsbacher 2016, "Multiple-scattering microfacet BSDFs with the Smith model").
class Walk {
public:
    Walk(double alpha, std::uint32_t seed) : alpha_(alpha), random_(seed) {}

    /// The number of microfacets that mirror a ray that comes in at `cosine`; `cosines` gets those at each.
    template <class F>
    int reflections(double cosine, F&& at) {
        Vec3d d{-std::sqrt(1 - cosine * cosine), 0, -cosine};
        double below = 1;  // the share of heights below the ray
        for (int count = 0; count < 1000; ++count) {
            if (d[2] > 0.9999999) return count;
            const double smith = lambda(d), u = number();
            if (d[2] > 0 && u > 1 - std::pow(below, smith)) return count;
            below = std::min(1.0, below / std::pow(1 - u, 1 / smith));
            const Vec3d m = normal({-d[0], -d[1], -d[2]});
            const double cos_m = -dot(d, m);
            at(std::min(1.0, cos_m));
            for (std::size_t i = 0; i < 3; ++i) d[i] += 2 * cos_m * m[i];
        }
        return 1000;
    }

private:
    double number() { return random_.uniform(); }
    double lambda(const Vec3d& d) const {
        const double tan2 = (d[0] * d[0] + d[1] * d[1]) / (d[2] * d[2]);
        return (-1 + std::copysign(std::sqrt(1 + alpha_ * alpha_ * tan2), d[2])) / 2;
    }
    /// One of those that w sees, from above or below.
    Vec3d normal(const Vec3d& w) {
        const Vec3d s = unit({alpha_ * w[0], alpha_ * w[1], w[2]});
        const double phi = 2 * kPi * number(), z = (1 - number()) * (1 + s[2]) - s[2];
        const double r = std::sqrt(std::max(0.0, 1 - z * z));
        return unit({alpha_ * (r * std::cos(phi) + s[0]), alpha_ * (r * std::sin(phi) + s[1]),
                     std::max(0.0, z + s[2])});
    }
    double alpha_;
    Random random_;
};

double reflectance(double cosine, double n, double k) {
    return crt::verify::microfacetAlbedo(cosine, n, k, 0);
}

}  // namespace

TEST_CASE("microfacets: losses agree with quadrature over the normals", "[kernel][bsdf][materials]") {
    for (const double roughness : {0.1, 0.3, 0.6, 1.0})
        for (const double cosine : {0.01, 0.05, 0.3, 0.7, 1.0}) {
            const double alpha = roughness * roughness;
            INFO("roughness " << roughness << " at " << cosine);
            CHECK(crt::microfacetLoss(cosine, 0, alpha) ==
                  Approx(1 - crt::verify::microfacetAlbedo(cosine, 1, 1e9, roughness)).margin(4e-4));
            for (const double eta : {1.5, 1 / 1.5, 2.4}) {
                const auto once = crt::verify::microfacetShares(cosine, eta, roughness);
                CHECK(crt::microfacetLoss(cosine, eta, alpha) ==
                      Approx(1 - once.reflected - once.transmitted).margin(1e-3));
            }
        }
}

TEST_CASE("microfacets: random walks between them find as much light, in the right colour",
          "[kernel][bsdf][materials]") {
    constexpr int kWalks = 100000;
    for (const double roughness : {0.3, 0.6, 1.0})
        for (const double cosine : {1.0, 0.5, 0.15})
            // Silver in the red, and what copper is in the blue.
            for (const auto& [n, k] : {std::pair{0.2, 3.0}, std::pair{1.2, 2.4}, std::pair{1.4, 1.6}}) {
                Walk walk(roughness * roughness, 81);
                double once = 0, all = 0;
                for (int i = 0; i < kWalks; ++i) {
                    double left = 1;
                    const int count =
                        walk.reflections(cosine, [&](double c) { left *= reflectance(c, n, k); });
                    all += left / kWalks;
                    if (count == 1) once += left / kWalks;
                }
                INFO("roughness " << roughness << " at " << cosine << ", n " << n << ", k " << k);
                CHECK(crt::verify::microfacetAlbedo(cosine, n, k, roughness) == Approx(once).margin(5e-3));
                // The model knows means over the cosine alone, and metals reflect more along the surface.
                CHECK(crt::verify::roughConductorAlbedo(cosine, n, k, roughness) ==
                      Approx(all).margin(cosine < 0.3 ? 0.03 : 0.02));
            }
}

TEST_CASE("microfacets: light that was lost once is lost again as often as the kernel takes it to be",
          "[kernel][bsdf][materials]") {
    for (const double roughness : {0.7, 0.85, 1.0}) {
        Walk walk(roughness * roughness, 82);
        Random random(83);
        std::array<double, 1001> after{};
        constexpr int kWalks = 200000;
        for (int i = 0; i < kWalks; ++i)
            ++after[static_cast<std::size_t>(
                walk.reflections(std::sqrt(random.uniform()), [](double) {}))];
        const double lost = 1 - after[1] / kWalks, lost_again = 1 - after[2] / (kWalks - after[1]);
        INFO("roughness " << roughness << ": lost " << lost << ", again " << lost_again);
        CHECK(lost_again / lost == Approx(static_cast<double>(CRT_LOST_AGAIN)).margin(0.07));
    }
}

TEST_CASE("microfacets: the mean reflectance under a film agrees with quadrature",
          "[kernel][bsdf][materials]") {
    const auto [thickness_nm, film] =
        GENERATE(table<double, double>({{20, 2.4}, {170, 2.4}, {550, 1.33}, {3000, 1.5}}));
    crt::Material metal;
    metal.type = crt::MaterialType::RoughConductor;
    metal.roughness = 0.3;
    metal.eta = crt::constantSpectrum(2.7);
    metal.k = crt::constantSpectrum(3.6);
    metal.film_thickness_nm = thickness_nm;
    metal.film_index = crt::constantSpectrum(film);
    const auto meanOf = [](const crt::Material& m) {
        return crt::compensationsOf({&m}).mean_reflectance.at(&m);
    };
    const crt::Spectrum mean = meanOf(metal);
    for (const std::size_t i : {std::size_t{0}, std::size_t{90}, std::size_t{470}}) {
        constexpr int kSteps = 4000;
        double expected = 0;
        for (int step = 0; step < kSteps; ++step) {
            const double c = (step + 0.5) / kSteps;
            expected += 2 * c / kSteps *
                        crt::verify::filmReflectance(c, film, thickness_nm, 360 + static_cast<double>(i),
                                                     {2.7, 3.6});
        }
        // The kernel's equations have digits of 2^-24, Simpson's rule four cells for each fringe.
        CHECK_THAT(mean[i], WithinAbs(expected, 2e-5));
    }

    // A texture makes the film thinner, or leaves it out.
    metal.film_texture = 0;
    crt::Material bare = metal;
    bare.film_thickness_nm = 0;
    CHECK(meanOf(metal) == meanOf(bare));
}

TEST_CASE("microfacets: where a texture leaves out a film the metal is bare", "[kernel][bsdf][materials]") {
    CrtContext ctx{};
    CrtMaterial material{};
    material.of.metal.mean = crt_bits(0.25f);
    CrtBsdf b{};
    b.eta = splat4(2.7f);
    b.k = splat4(3.6f);
    b.tint = splat4(1.0f);
    b.film_eta = splat4(2.4f);
    b.film_rounds = splat4(0.8f);
    const auto mean = [&] { return V4X(crt_metal_mean(&ctx, &b, &material, nullptr, splat4(0.0f))); };

    constexpr u32 kTexture = CRT_VALUE_REFERENCE;
    material.film_thickness = kTexture;
    CHECK(mean() == 0.25f);
    b.flags = CRT_BSDF_FILM;
    CHECK(mean() == V4X(crt_film_mean(&b)));
    CHECK(mean() != 0.25f);
    // Without a texture the table's mean is that under the film.
    material.film_thickness = crt_bits(1.0f);
    CHECK(mean() == 0.25f);
}
