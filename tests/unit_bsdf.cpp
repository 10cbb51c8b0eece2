// Invariants of every material: tests crt_layered_prepare, _sample, _eval and _pdf of each kind in
// CRT_MATERIAL_LIST (bsdf_test.h). Backends are held to the same bits elsewhere.
#include "bsdf_test.h"
#include "compile/coat.h"

#include <set>

using namespace bsdf_test;

namespace {

/// Azimuth from which w_o looks along a flat surface's brushing as it does along that of `bsdf`.
double azimuthOnFlat(const CrtBsdf& bsdf, const Bench& flat, const Vec3d& wo) {
    if ((bsdf.flags & CRT_BSDF_ANISOTROPIC) == 0) return 0.7;
    const auto azimuth = [](const CrtBsdf& b, const Vec3d& w) {
        const Vec3d tangent = toDouble(b.tangent);
        return std::atan2(dot(w, cross(toDouble(b.ns), tangent)), dot(w, tangent));
    };
    const Vec3d about{0.6, 0, 0.8};
    return azimuth(bsdf, wo) - azimuth(flat.prepare(about), about);
}

/// χ² of directions against their density in each cell.
void checkDistribution(const std::array<double, kCells>& density,
                       const std::function<CrtScatter()>& sample) {
    constexpr std::uint64_t kSamples = 400000;
    std::array<std::uint64_t, kCells> counts{};
    std::uint64_t rejected = 0;
    for (std::uint64_t i = 0; i < kSamples; ++i) {
        const CrtScatter scatter = sample();
        if (scatter.valid && scatter.pdf > 0) ++counts[cellOf(toDouble(scatter.wi))];
        else ++rejected;
    }
    // Cells of few samples are taken together, with what is rejected.
    std::vector<std::uint64_t> observed{rejected};
    std::vector<double> expected{std::max(0.0, 1 - total(density)) * kSamples};
    for (std::size_t c = 0; c < kCells; ++c) {
        const double e = density[c] * kSamples;
        if (e >= 20) {
            observed.push_back(counts[c]);
            expected.push_back(e);
        } else {
            observed[0] += counts[c];
            expected[0] += e;
        }
    }
    if (expected[0] < 20) {
        CHECK(static_cast<double>(observed[0]) < 60);
        observed.erase(observed.begin());
        expected.erase(expected.begin());
    }
    REQUIRE(observed.size() > 4);
    CHECK(std::abs(chiSquaredDeviate(observed, expected)) < 4.4);
}

}  // namespace

TEST_CASE("BSDF: every kind of material is asked", "[kernel][bsdf][materials]") {
    std::set<MaterialType> asked{MaterialType::ThinDielectric};  // is passed: unit_panes.cpp
    for (const Subject& s : subjects()) asked.insert(s.material.type);
    CHECK(asked.size() == std::size(crt::kMaterialNames));
}

TEST_CASE("BSDF: directions are distributed as the pdf says", "[kernel][bsdf][materials]") {
    Random random(71);
    for (const Subject& s : subjects()) {
        const Bench bench(s.material);
        for (const Vec3d& wo : views()) {
            const CrtBsdf bsdf = bench.prepare(wo);
            if (isDelta(bsdf)) continue;
            INFO(s.name << " from " << wo[2]);
            const auto density =
                overCells([&](const Vec3d& w) { return crt_layered_pdf(&bsdf, unitFloat(w)); });
            // Together with the chance of a single direction.
            CHECK(total(density) < 1 - chanceOfSingle(bsdf) + 1e-3);
            checkDistribution(density, [&] { return Bench::sample(bsdf, random.pair(), random.pair()); });
        }
    }
}

TEST_CASE("BSDF: seen along the surface or its normal's plane, all is finite", "[kernel][bsdf][materials]") {
    Random random(75);
    const auto finite = [](double x) { return std::isfinite(x) && x >= 0; };
    const auto all_finite = [&](vec4 v) {
        return finite(V4X(v)) && finite(V4Y(v)) && finite(V4Z(v)) && finite(V4W(v));
    };
    for (const Subject& s : subjects())
        for (const double tilt : {0.0, 0.53, 1.1}) {
            const Vec3d normal = spherical(std::cos(tilt), 0.2);
            const Vec3d across = spherical(std::cos(tilt + kPi / 2), 0.2), along = cross(normal, across);
            const Bench bench(s.material, normal);
            INFO(s.name << " at " << tilt);
            std::uint64_t wrong = 0;
            for (int i = 0; i < 300; ++i) {
                // In floats these are before and behind the normal in turn, by its rounding.
                const double phi = 2 * kPi * random.pair().x;
                Vec3d wo;
                for (std::size_t k = 0; k < 3; ++k)
                    wo[k] = across[k] * std::cos(phi) + along[k] * std::sin(phi);
                const CrtBsdf bsdf = bench.prepare(wo);
                wrong += !all_finite(bsdf.albedo);
                const CrtScatter there = Bench::sampleSurface(bsdf, random.pair(), random.pair());
                wrong += there.valid && !(all_finite(there.weight) && finite(there.pdf));
                if (isDelta(bsdf)) continue;
                const CrtRandom2 u = random.pair();
                const vec3 w = unitFloat(spherical(2 * u.x - 1, 2 * kPi * u.y));
                wrong += !all_finite(crt_surface_eval(&bsdf, w)) || !finite(crt_surface_pdf(&bsdf, w));
            }
            CHECK(wrong == 0);
        }
    CHECK(crt_fresnel_dielectric(0.0f, 1.0f) == 0.0f);  // even then there is no surface
}

TEST_CASE("BSDF: about interpolated normals nothing that is reflected is lost",
          "[kernel][bsdf][materials]") {
    Random random(74);
    for (const Subject& s : subjects()) {
        if (s.material.isClear() || s.tinted) continue;
        const bool sheet = s.material.isTranslucent();
        const Bench flat(s.material);
        for (const double tilt : {0.35, 1.1})
            // From before the normal, and from behind it on the other side.
            for (const Vec3d& wo : {spherical(0.6, 0.7), spherical(-0.2, 0.7)}) {
                const Vec3d normal = spherical(std::cos(tilt), 0.2);
                // From behind the normal, of kinds that only mirror it is the face's.
                const bool mirrors = s.material.type == MaterialType::Conductor ||
                                     s.material.type == MaterialType::Mirror;
                const bool face = mirrors && wo[2] < 0;
                const double cosine = face ? -wo[2] : std::abs(dot(wo, normal));
                const Bench bench(s.material, normal);
                const CrtBsdf bsdf = bench.prepare(wo);
                const CrtBsdf upright = flat.prepare(spherical(cosine, azimuthOnFlat(bsdf, flat, wo)));
                INFO(s.name << " at " << tilt << " from " << wo[2]);
                double kept = 0, expected = 0, single = 0, worst_pdf = 0;
                std::uint64_t below = 0;
                overNumbers([&](CrtRandom2 u, CrtRandom2 choice, double share) {
                    const CrtScatter there = Bench::sampleSurface(bsdf, u, choice),
                                     here = Bench::sample(upright, u, choice);
                    if (here.valid) expected += share * V4X(here.weight);
                    if (!there.valid) return;
                    kept += share * V4X(there.weight);
                    if (there.pdf == 0) single += share * V4X(there.weight);
                    below += (!sheet && there.wi.z * wo[2] <= 0) ||
                             std::abs(length(toDouble(there.wi)) - 1) > 1e-6;
                    if (there.pdf > 0)
                        worst_pdf = fartherFrom0(worst_pdf,
                                                 crt_surface_pdf(&bsdf, there.wi) / double{there.pdf} - 1);
                });
                CHECK(kept == Approx(expected).epsilon(1e-3));
                CHECK(below == 0);
                CHECK(worst_pdf < 1e-3);
                if (isDelta(bsdf)) continue;
                const auto above = [&](const auto& f) {
                    return overCells([&](const Vec3d& w) -> double {
                        return sheet || w[2] * wo[2] > 0 ? f(unitFloat(w)) : 0;
                    });
                };
                const auto density = above([&](vec3 w) -> double { return crt_surface_pdf(&bsdf, w); });
                const double lobe =
                    total(above([&](vec3 w) -> double { return V4X(crt_surface_eval(&bsdf, w)); }));
                CHECK(lobe + single == Approx(expected).epsilon(0.01));
                checkDistribution(density, [&] {
                    return Bench::sampleSurface(bsdf, random.pair(), random.pair());
                });
            }
    }
}

TEST_CASE("BSDF: Lambert's light is raised without a seam, and where it came from is known",
          "[kernel][bsdf]") {
    Random random(75);
    for (const double tilt : {0.01, 0.2, 1.1}) {
        const Vec3d normal = spherical(std::cos(tilt), 0.2);
        const Bench bench(reflecting(MaterialType::Diffuse, 1), normal);
        const CrtBsdf bsdf = bench.prepare({0, 0, 1});
        CHECK(crt_below(&bsdf) == Approx((1 - std::cos(tilt)) / 2).epsilon(1e-3));
        for (int i = 0; i < 2000; ++i) {
            const double depth = std::sin(tilt) * (i % 2 == 0 ? 1 : 1e-3) * random.uniform();
            const Vec3d w = spherical(-depth, random.uniform(-kPi, kPi));
            const double before = dot(w, normal);
            if (!(before > 1e-3)) continue;
            const vec3 raised = crt_lift(&bsdf, toFloat(w));
            CHECK(raised.z >= 0);
            CHECK(length(toDouble(raised)) == Approx(1).margin(1e-6));
            CHECK(crt_cosine_before_lift(crt_below(&bsdf), dot3(raised, bsdf.ns), raised.z) ==
                  Approx(before).margin(2e-3 * std::sin(tilt) + 1e-5 / tilt));
            if (i % 2 == 1) CHECK(length(minus(toDouble(raised), w)) < 0.2);
        }
    }
}

TEST_CASE("BSDF: a sample's weight is the value over the density of its direction",
          "[kernel][bsdf][materials]") {
    Random random(72);
    for (const Subject& s : subjects()) {
        const Bench bench(s.material);
        for (const Vec3d& wo : views()) {
            const CrtBsdf bsdf = bench.prepare(wo);
            INFO(s.name << " from " << wo[2]);
            const bool has_singles = s.single(wo[2]) > 0;
            double worst_weight = 0, worst_pdf = 0;
            std::uint64_t valid = 0, wrong_side = 0, wrong_delta = 0, wrong_single = 0;
            for (int i = 0; i < 20000; ++i) {
                const CrtScatter scatter = Bench::sample(bsdf, random.pair(), random.pair());
                if (!scatter.valid) continue;
                ++valid;
                const u32 side =
                    (scatter.wi.z > 0) == (wo[2] > 0) ? CRT_BSDF_REFLECTS : CRT_BSDF_TRANSMITS;
                wrong_side += (bsdf.flags & side) == 0 || std::abs(length(toDouble(scatter.wi)) - 1) > 1e-6;
                const double pdf = crt_layered_pdf(&bsdf, scatter.wi);
                const vec4 value = crt_layered_eval(&bsdf, scatter.wi);
                if (isDelta(bsdf)) {
                    wrong_delta += scatter.pdf != 0 || pdf != 0 || max4(value) != 0 ||
                                   (scatter.hero_only && (bsdf.flags & CRT_BSDF_DISPERSIVE) == 0);
                    continue;
                }
                if (scatter.pdf == 0) {
                    wrong_single += !has_singles ||
                                    length(minus(toDouble(scatter.wi), {-wo[0], -wo[1], wo[2]})) > 1e-5;
                    continue;
                }
                worst_pdf = std::max(worst_pdf, std::abs(scatter.pdf / pdf - 1));
                // Of a refraction whose direction depends on the wavelength, some may have no part in it.
                for (u32 l = 0; l < 4; ++l)
                    worst_weight =
                        fartherFrom0(worst_weight, (lane(scatter.weight, l) * pdf - lane(value, l)) /
                                                       std::max<double>(lane(value, l), 1e-3 * max4(value)));
            }
            CHECK(valid > 5000);
            CHECK(wrong_side == 0);
            CHECK(wrong_delta == 0);
            CHECK(wrong_single == 0);
            CHECK(worst_pdf < 1e-3);
            CHECK(worst_weight < 1e-3);
        }
    }
}

TEST_CASE("BSDF: the way back is as bright as the way there", "[kernel][bsdf][materials]") {
    Random random(73);
    for (const Subject& s : subjects()) {
        if (!s.reciprocal) continue;
        const Bench bench(s.material);
        INFO(s.name);
        double worst = 0;
        std::uint64_t compared = 0;
        for (int i = 0; i < 20000; ++i) {
            const Vec3d wo = random.direction();
            if (std::abs(wo[2]) < 0.01) continue;
            const CrtBsdf there = bench.prepare(wo, true);
            if (isDelta(there)) {
                // Of deltas the weights, for the hero alone: crossing scales radiance by 1/η², and back by
                // η².
                CrtRandom2 u = random.pair();
                const CrtScatter first = Bench::sample(there, u, u, 1);
                if (!first.valid) continue;
                const CrtBsdf back = bench.prepare(toDouble(first.wi), true);
                for (u.x = 0.0005f; u.x < 1; u.x += 0.001f) {
                    const CrtScatter second = Bench::sample(back, u, u, 1);
                    if (!second.valid || length(minus(toDouble(second.wi), wo)) > 1e-3) continue;
                    const u32 l = Bench::kHero;
                    worst = std::max(worst, std::abs(lane(first.weight, l) * first.eta_square -
                                                     lane(second.weight, l) * second.eta_square));
                    ++compared;
                    break;
                }
                if (compared > 500) break;
                continue;
            }
            const Vec3d wi = random.direction();
            if (std::abs(wi[2]) < 0.01) continue;
            const CrtBsdf back = bench.prepare(wi);
            for (u32 l = 0; l < 4; ++l) {
                // The arriving light is compressed by the index on its side, squared.
                const double square = indexSquare(s.material, l);
                const double a = lane(crt_layered_eval(&there, unitFloat(wi)), l) / std::abs(wi[2]) *
                                 (wi[2] < 0 ? square : 1),
                             b = lane(crt_layered_eval(&back, unitFloat(wo)), l) / std::abs(wo[2]) *
                                 (wo[2] < 0 ? square : 1);
                if (a == 0 && b == 0) continue;
                // Fresnel's transmittance rises from the critical angle like a root, so that rounding is
                // 2.4e-4 of it there: next to nothing, but not relative to what little passes.
                const double least = s.material.type == MaterialType::RoughDielectric ? 0.1 : 0.01;
                worst = std::max(worst, std::abs(a - b) / std::max({a, b, least}));
                ++compared;
            }
        }
        CHECK(compared > 400);
        CHECK(worst < 2e-3);
    }
}

TEST_CASE("BSDF: in white light everything is as bright as its albedo says, and no brighter than 1",
          "[kernel][bsdf][materials]") {
    for (const Subject& s : subjects()) {
        const Bench bench(s.material);
        for (const Vec3d& wo : views()) {
            const CrtBsdf bsdf = bench.prepare(wo);
            INFO(s.name << " from " << wo[2]);
            const double expected = s.albedo(wo[2]);
            // By samples: of a refraction that depends on the wavelength, the hero stands for all four.
            double sampled = 0;
            const auto kept = [&](const vec3& wi) {  // of the hero's radiance, by refraction
                const double square = indexSquare(s.material, Bench::kHero);
                return (wi.z > 0) == (wo[2] > 0) ? 1 : wo[2] > 0 ? square : 1 / square;
            };
            overNumbers([&](CrtRandom2 u, CrtRandom2 choice, double share) {
                const CrtScatter scatter = Bench::sample(bsdf, u, choice);
                if (scatter.valid)
                    sampled += lane(scatter.weight, Bench::kHero) * kept(scatter.wi) * share;
            });
            CHECK(sampled < 1 + 2e-3);
            CHECK(sampled == Approx(expected).margin(3e-3));
            if (isDelta(bsdf)) continue;
            const double integral = total(overCells([&](const Vec3d& w) {
                const vec3 wi = unitFloat(w);
                return lane(crt_layered_eval(&bsdf, wi), Bench::kHero) * kept(wi);
            }));
            CHECK(integral < 1 + 2e-3);  // by cells, as the next line
            CHECK(integral == Approx(expected - s.single(wo[2])).margin(2e-3));
        }
    }
}

TEST_CASE("BSDF: directions follow the wavelengths that the path carries", "[kernel][bsdf][materials]") {
    // Wavelengths that carry nothing are not looked for; each wavelength's mean does not depend on the
    // others.
    const Bench bench(roughGlass(1.9, 1.4, 0.4));
    const Vec3d wo = spherical(0.7, 0.3);
    std::array<double, 3> passed{};
    const vec4 carried[3] = {splat4(1), make_vec4(0.1f, 2, 0.5f, 1), make_vec4(0, 0, 4, 0)};
    for (std::size_t c = 0; c < 3; ++c) {
        const CrtBsdf bsdf = bench.prepare(wo, carried[c]);
        const auto density = overCells([&](const Vec3d& w) { return crt_layered_pdf(&bsdf, unitFloat(w)); });
        CHECK(total(density) < 1 + 1e-3);
        overNumbers([&](CrtRandom2 u, CrtRandom2 choice, double share) {
            const CrtScatter scatter = Bench::sample(bsdf, u, choice);
            if (!scatter.valid || scatter.wi.z > 0) return;
            passed[c] += lane(scatter.weight, Bench::kHero) * share;
            if (c == 2) CHECK(lane(scatter.weight, Bench::kHero) < 1);
        });
    }
    CHECK(passed[0] == Approx(passed[2]).epsilon(5e-3));
    CHECK(passed[1] == Approx(passed[2]).epsilon(5e-3));
}

TEST_CASE("coats: the table agrees with quadrature over the normals, and is not above 1",
          "[kernel][bsdf][materials]") {
    for (const double eta : {1.1, 1.5, 2.5})
        for (const double roughness : {0.1, 0.3, 0.6, 1.0}) {
            for (const double cosine : {0.05, 0.3, 0.7, 1.0}) {
                INFO(eta << " " << roughness << " at " << cosine);
                CHECK(crt::coatAlbedo(cosine, eta, roughness * roughness) ==
                      Approx(crt::verify::microfacetShares(cosine, eta, roughness).reflected)
                          .margin(3e-4));
            }
            for (int i = 0; i <= 10; ++i)
                CHECK(crt::coatAlbedo(std::max(1e-4, i / 10.0), eta, roughness * roughness) <= 1);
        }
    // Of a smooth coat, what is sent back from below is diffuse light against glass from within.
    const Material polished = plastic(1, 0);
    CHECK(crt::coatOf(crt::coatsOf({&polished, nullptr}), polished).internal_reflectance ==
          Approx(0.5963457597).epsilon(1e-6));
}

// The tables of a roughness that depends on the place are those of CRT_COAT_ROUGHNESSES roughnesses.
TEST_CASE("coats: between two tables the albedo is that of the roughness", "[kernel][bsdf][materials]") {
    for (const double eta : {1.2, 1.5, 2.5}) {
        Material rough = plastic(1, 0, eta);
        rough.roughness_texture = 0;
        const crt::VaryingCoat varying = crt::varyingCoatOf(crt::coatsOf({&rough}), eta);
        REQUIRE(varying.albedos.size() == CRT_COAT_ROUGHNESSES);
        std::vector<float> tables;
        for (const crt::Spectrum& albedo : varying.albedos) {
            for (const double v : albedo.values) tables.push_back(static_cast<float>(v));
            tables.push_back(tables.back());
        }
        for (double roughness = 0.0317; roughness <= 1; roughness += 0.0137) {
            const f32 place = crt_coat_place(static_cast<f32>(roughness));
            const u32 first = std::min(static_cast<u32>(place), CRT_COAT_ROUGHNESSES - 2);
            const CrtCoat coat{tables.data() + first * CRT_SPECTRUM_STRIDE, place - static_cast<f32>(first)};
            for (const double cosine : {0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0}) {
                INFO(eta << ", roughness " << roughness << " at " << cosine);
                const f32 eta_single = static_cast<f32>(eta);
                CHECK(std::abs(static_cast<double>(
                                   crt_coat_reflects(coat, static_cast<f32>(cosine), eta_single)) -
                               crt::coatAlbedo(cosine, eta, roughness * roughness)) < 3e-3);
            }
        }
    }
}
