// Transport modes of vertices: importance is the adjoint of radiance, for every kind of material.
#include "bsdf_test.h"

using namespace bsdf_test;

namespace {

CrtScatter sampleOf(const CrtVertex& vertex, CrtRandom2 u, CrtRandom2 choice, int alone, int mode) {
    return crt_vertex_sample(&vertex, u, choice, make_vec4(0, 0, 1, 0), alone, mode);
}

/// Of f* and f, with the cosines of the geometry: both flow along the same way.
struct BothWays {
    double worst = 0;
    std::uint64_t compared = 0;
    void compare(vec4 importance, vec4 radiance, double least) {
        for (u32 l = 0; l < 4; ++l) {
            const double a = lane(importance, l), b = lane(radiance, l);
            if (a == 0 && b == 0) continue;
            worst = fartherFrom0(worst, std::abs(a - b) / std::max({a, b, least}));
            ++compared;
        }
    }
};

/// As unit_bsdf.cpp: Fresnel's transmittance near the critical angle has few digits.
double leastOf(const Material& m) { return m.type == MaterialType::RoughDielectric ? 0.1 : 0.01; }

/// The importance that a vertex scatters from w_i to w_o, and the radiance that it scatters from w_o to w_i,
/// per projected solid angle.
void compareLobes(const Bench& bench, const Material& m, const Vec3d& wo, const Vec3d& wi,
                  BothWays& both) {
    const CrtVertex there = bench.vertex(wo), back = bench.vertex(wi);
    if (crt_vertex_is_delta(&there) || crt_vertex_is_delta(&back)) return;
    if (!crt_vertex_scatters(&there, unitFloat(wi))) return;
    both.compare(crt_vertex_eval(&there, unitFloat(wi), CRT_IMPORTANCE) / static_cast<f32>(std::abs(wi[2])),
                 crt_vertex_eval(&back, unitFloat(wo), CRT_RADIANCE) / static_cast<f32>(std::abs(wo[2])),
                 leastOf(m));
}

/// True if crt_adjoint is exact about interpolated normals, of directions on one side of both.
bool isSymmetric(const Subject& s) {
    const Material& m = s.material;
    return s.reciprocal && (m.type == MaterialType::Diffuse || m.type == MaterialType::RoughConductor ||
                            m.type == MaterialType::RoughDielectric);
}

}  // namespace

TEST_CASE("vertex: importance is radiance on the way back", "[kernel][bsdf][vertex]") {
    Random random(81);
    for (const Subject& s : subjects()) {
        if (!s.reciprocal) continue;
        const Bench bench(s.material);
        INFO(s.name);
        BothWays both;
        for (int i = 0; i < 10000 && both.compared < 20000; ++i) {
            const Vec3d wo = random.direction(), wi = random.direction();
            if (std::abs(wo[2]) < 0.01 || std::abs(wi[2]) < 0.01) continue;
            compareLobes(bench, s.material, wo, wi, both);
            // Of single directions the weights, for the hero alone.
            const CrtVertex there = bench.vertex(wo, true);
            if (!crt_vertex_is_delta(&there)) continue;
            CrtRandom2 u = random.pair();
            const CrtScatter first = sampleOf(there, u, u, 1, CRT_IMPORTANCE);
            if (!first.valid) continue;
            const CrtVertex back = bench.vertex(toDouble(first.wi), true);
            for (u.x = 0.0005f; u.x < 1; u.x += 0.001f) {
                const CrtScatter second = sampleOf(back, u, u, 1, CRT_RADIANCE);
                if (!second.valid || length(minus(toDouble(second.wi), wo)) > 1e-3) continue;
                // Per projected solid angle, which refraction compresses by η².
                const f32 importance = static_cast<f32>(lane(first.weight, Bench::kHero)),
                          radiance = static_cast<f32>(lane(second.weight, Bench::kHero));
                both.compare(splat4(importance), splat4(radiance * second.eta_square), 0.01);
                CHECK(first.eta_square == 1);
                break;
            }
            if (both.compared > 2000) break;
        }
        CHECK(both.compared > 400);
        CHECK(both.worst < 2e-3);
    }
}

TEST_CASE("vertex: importance has no factor of squared indices", "[kernel][bsdf][vertex]") {
    Random random(82);
    for (const Subject& s : subjects()) {
        if (!s.material.transmits()) continue;
        const Bench bench(s.material);
        INFO(s.name);
        double worst = 0;
        std::uint64_t crossed = 0;
        for (int i = 0; i < 20000; ++i) {
            const Vec3d wo = random.direction();
            if (std::abs(wo[2]) < 0.01) continue;
            const CrtVertex vertex = bench.vertex(wo, true);
            const CrtRandom2 u = random.pair(), choice = random.pair();
            const CrtScatter radiance = sampleOf(vertex, u, choice, 1, CRT_RADIANCE),
                             importance = sampleOf(vertex, u, choice, 1, CRT_IMPORTANCE);
            REQUIRE(radiance.valid == importance.valid);
            if (!radiance.valid) continue;
            const bool crosses = radiance.wi.z * wo[2] < 0;
            const double square = indexSquare(s.material, Bench::kHero),
                         factor = !crosses ? 1 : wo[2] > 0 ? square : 1 / square;
            crossed += crosses;
            CHECK(importance.eta_square == 1);
            CHECK(importance.pdf == radiance.pdf);
            const u32 l = Bench::kHero;
            worst = fartherFrom0(worst,
                                 lane(importance.weight, l) / (lane(radiance.weight, l) * factor) - 1);
            if (radiance.pdf == 0) continue;
            const double value = lane(crt_vertex_eval(&vertex, radiance.wi, CRT_RADIANCE), l);
            if (value == 0) continue;
            worst = fartherFrom0(
                worst,
                lane(crt_vertex_eval(&vertex, radiance.wi, CRT_IMPORTANCE), l) / (value * factor) - 1);
        }
        CHECK(crossed > 1000);
        CHECK(worst < 1e-5);
    }
}

TEST_CASE("vertex: no importance is lost or gained on flat surfaces", "[kernel][bsdf][vertex]") {
    for (const Subject& s : subjects()) {
        const Bench bench(s.material);
        for (const double cosine : {0.6, -0.6}) {
            const CrtVertex vertex = bench.vertex(spherical(cosine, 0.7));
            INFO(s.name << " from " << cosine);
            const double expected = s.albedo(cosine);
            double sampled = 0;
            overNumbers([&](CrtRandom2 u, CrtRandom2 choice, double share) {
                const CrtScatter scatter = sampleOf(vertex, u, choice, 0, CRT_IMPORTANCE);
                if (scatter.valid) sampled += lane(scatter.weight, Bench::kHero) * share;
            });
            CHECK(sampled == Approx(expected).margin(3e-3));
            if (crt_vertex_is_delta(&vertex)) continue;
            const double integral = total(overCells([&](const Vec3d& w) {
                return lane(crt_vertex_eval(&vertex, unitFloat(w), CRT_IMPORTANCE), Bench::kHero);
            }));
            CHECK(integral == Approx(expected - s.single(cosine)).margin(2e-3));
        }
    }
}

TEST_CASE("vertex: about interpolated normals importance is radiance on the way back",
          "[kernel][bsdf][vertex]") {
    Random random(83);
    for (const Subject& s : subjects()) {
        if (!isSymmetric(s)) continue;
        for (const double tilt : {0.35, 1.1}) {
            const Vec3d normal = spherical(std::cos(tilt), 0.2);
            const Bench bench(s.material, normal);
            INFO(s.name << " at " << tilt);
            const auto on_one_side = [&](const Vec3d& w) {
                // Lambert's light is raised from the side behind the normal.
                const double cosine = s.material.type == MaterialType::Diffuse ? 1 : dot(w, normal) * w[2];
                return std::abs(w[2]) > 0.01 && cosine > 1e-3;
            };
            BothWays both;
            for (int i = 0; i < 20000; ++i) {
                const Vec3d wo = random.direction(), wi = random.direction();
                if (on_one_side(wo) && on_one_side(wi)) compareLobes(bench, s.material, wo, wi, both);
            }
            const CrtVertex upright = bench.vertex({0, 0, 1});
            if (!crt_vertex_is_delta(&upright)) CHECK(both.compared > 400);
            CHECK(both.worst < 2e-3);
        }
    }
}

TEST_CASE("vertex: a sample's weight of importance is the value over the density",
          "[kernel][bsdf][vertex]") {
    Random random(84);
    for (const Subject& s : subjects())
        for (const double tilt : {0.0, 0.35}) {
            const Bench bench(s.material, spherical(std::cos(tilt), 0.2));
            for (const Vec3d& wo : views()) {
                const CrtVertex vertex = bench.vertex(wo);
                INFO(s.name << " at " << tilt << " from " << wo[2]);
                double worst = 0;
                for (int i = 0; i < 2000; ++i) {
                    const CrtScatter scatter =
                        sampleOf(vertex, random.pair(), random.pair(), 0, CRT_IMPORTANCE);
                    if (!scatter.valid || scatter.pdf == 0) continue;
                    const double pdf = crt_vertex_pdf(&vertex, scatter.wi);
                    const vec4 value = crt_vertex_eval(&vertex, scatter.wi, CRT_IMPORTANCE);
                    for (u32 l = 0; l < 4; ++l)
                        worst =
                            fartherFrom0(worst, (lane(scatter.weight, l) * pdf - lane(value, l)) /
                                                    std::max<double>(lane(value, l), 1e-3 * max4(value)));
                }
                CHECK(worst < 1e-3);
            }
        }
}
