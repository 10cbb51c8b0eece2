// Scattering by surfaces, sampling of lights, and the wavelengths of a path: closed forms, complex
// arithmetic in long double, chi-squared against the density that is claimed, and expectations that must
// come out whatever the density.
//
// Over 450 lines: densities of many kinds, judged by the same tests of distribution.
#include "kernel_test.h"

#include <algorithm>
#include <array>
#include <complex>
#include <string>

using namespace kernel_test;
using crt::Vec3d;

namespace {

constexpr double kPi = 3.14159265358979323846;

/// Unpolarised Fresnel reflectance for a complex index, from the field amplitudes.
double fresnel(double cosine, std::complex<long double> index) {
    const long double c = cosine, s2 = 1 - c * c;
    const std::complex<long double> root = std::sqrt(index * index - s2);
    const auto rs = (c - root) / (c + root), rp = (index * index * c - root) / (index * index * c + root);
    return static_cast<double>((std::norm(rs) + std::norm(rp)) / 2);
}

double lane(vec4 v, u32 i) { return i == 0 ? V4X(v) : i == 1 ? V4Y(v) : i == 2 ? V4Z(v) : V4W(v); }
vec4 heroOf(u32 i) {
    return make_vec4(i == 0 ? 1.0f : 0.0f, i == 1 ? 1.0f : 0.0f, i == 2 ? 1.0f : 0.0f, i == 3 ? 1.0f : 0.0f);
}

CrtRandom2 pairOf(double x, double y) {
    CrtRandom2 u;
    u.x = static_cast<f32>(x);
    u.y = static_cast<f32>(y);
    return u;
}

/// Solid angle of a triangle seen from the origin (Van Oosterom and Strackee 1983), in long double.
double solidAngle(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const auto dotl = [](const Vec3d& p, const Vec3d& q) {
        return static_cast<long double>(p[0]) * q[0] + static_cast<long double>(p[1]) * q[1] +
               static_cast<long double>(p[2]) * q[2];
    };
    const long double la = std::sqrt(dotl(a, a)), lb = std::sqrt(dotl(b, b)), lc = std::sqrt(dotl(c, c));
    const auto minor = [&](std::size_t i, std::size_t j) {
        return static_cast<long double>(b[i]) * c[j] - static_cast<long double>(b[j]) * c[i];
    };
    const long double triple = std::abs(a[0] * minor(1, 2) + a[1] * minor(2, 0) + a[2] * minor(0, 1));
    return static_cast<double>(
        2 * std::atan2(triple, la * lb * lc + dotl(a, b) * lc + dotl(b, c) * la + dotl(c, a) * lb));
}

/// Lambert 1760: ∫ cos dω / π over a polygon above the horizon, for a receiver at the origin with normal
/// n.
double formFactor(const std::vector<Vec3d>& polygon, const Vec3d& n) {
    double sum = 0;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Vec3d a = unit(polygon[i]), b = unit(polygon[(i + 1) % polygon.size()]), m = cross(a, b);
        const double sine = length(m);
        if (sine > 0) sum += std::atan2(sine, dot(a, b)) * dot(m, n) / sine;
    }
    return std::abs(sum) / (2 * kPi);
}

}  // namespace

TEST_CASE("Fresnel reflectance at known angles", "[kernel][bsdf]") {
    const auto at = [](double degrees, f32 eta) {
        return static_cast<double>(
            crt_fresnel_dielectric(static_cast<f32>(std::cos(degrees * kPi / 180)), eta));
    };
    CHECK(at(0, 1.5f) == Approx(.04).margin(1e-7));
    CHECK(at(56.309932, 1.5f) == Approx(.073964497).margin(1e-7));  // Brewster: all of it polarised
    CHECK(at(60, 1.5f) == Approx(.089186713).margin(1e-7));
    CHECK(at(89.9, 1.5f) == Approx(.98991188).margin(1e-6));
    CHECK(at(0, 2.4f) == Approx(.16955017).margin(1e-7));
    CHECK(at(0, 100) == Approx(.96078816).margin(1e-7));
    // From inside, to the critical angle of 41.810315°, and beyond it.
    CHECK(at(0, 1 / 1.5f) == Approx(.04).margin(1e-7));
    CHECK(at(41.8, 1 / 1.5f) < 0.95);
    for (const double degrees : {41.82, 45.0, 60.0, 89.0, 90.0}) CHECK(at(degrees, 1 / 1.5f) == 1.0);
    // Averages over a diffuse half space, outside and inside.
    double outside = 0, inside = 0;
    for (int i = 0; i < 400000; ++i) {
        const double c2 = (i + 0.5) / 400000;
        outside += crt_fresnel_dielectric(static_cast<f32>(std::sqrt(c2)), 1.5f) / 400000;
        inside += crt_fresnel_dielectric(static_cast<f32>(std::sqrt(c2)), 1 / 1.5f) / 400000;
    }
    CHECK(outside == Approx(.0917779593).margin(1e-6));
    CHECK(inside == Approx(.5963457597).margin(1e-5));
}

TEST_CASE("Fresnel reflectance of dielectrics and conductors is that of the field equations",
          "[kernel][bsdf]") {
    double dielectric = 0, conductor = 0, reciprocal = 0;
    for (int i = 1; i <= 500; ++i) {
        const f32 c = static_cast<f32>(i) / 500;
        for (const f32 eta :
             {0.1f, 0.5f, 1 / 1.5f, 0.9f, 1.001f, 1.1f, 1.33f, 1.5f, 1.9f, 2.4f, 10.0f, 1e4f}) {
            const double sin2_t = (1 - static_cast<double>(c) * c) / (static_cast<double>(eta) * eta);
            // At the critical angle the slope is infinite: rounding of the cosine decides.
            if (std::abs(1 - sin2_t) < 1e-4) continue;
            const f32 f = crt_fresnel_dielectric(c, eta);
            dielectric = std::max(dielectric, std::abs(f - (sin2_t > 1 ? 1 : fresnel(c, eta))));
            // The same from the other side, where the cosine there still tells angles apart.
            if (c > 0.1f && sin2_t < 0.99 && sin2_t > 0.01)
                reciprocal = std::max<double>(
                    reciprocal,
                    std::abs(f - crt_fresnel_dielectric(static_cast<f32>(std::sqrt(1 - sin2_t)), 1 / eta)));
        }
        for (const double n : {0.05, 0.2, 0.9, 1.5, 3.0, 8.0})
            for (const double k : {0.0, 0.5, 2.0, 7.5}) {
                // One lane at a time, so that no lane can be taken for another.
                const u32 at = static_cast<u32>(i) % 4;
                const vec4 hero = heroOf(at);
                const vec4 result =
                    crt_fresnel_conductor(c, splat4(1.3f) + hero * static_cast<f32>(n - 1.3f),
                                          splat4(2.0f) + hero * static_cast<f32>(k - 2.0f));
                const f32 nf = 1.3f + static_cast<f32>(n - 1.3f), kf = 2.0f + static_cast<f32>(k - 2.0f);
                conductor = std::max(conductor, std::abs(lane(result, at) - fresnel(c, {nf, kf})));
                conductor =
                    std::max(conductor, std::abs(lane(result, (at + 1) % 4) - fresnel(c, {1.3f, 2.0f})));
            }
    }
    CHECK(dielectric < 3e-6);
    CHECK(reciprocal < 1e-5);
    CHECK(conductor < 1e-5);  // the worst near a critical angle, for n < 1 without absorption
    // A mirror at grazing incidence, whatever it is made of.
    CHECK(V4X(crt_fresnel_conductor(0, splat4(0.2f), splat4(3))) == Approx(1).margin(1e-6));
}

TEST_CASE("an index of exactly 1 is no surface, however grazing", "[kernel][bsdf]") {
    Random random(31);
    std::uint64_t wrong = 0;
    for (int i = 0; i < 100000; ++i) {
        const vec3 n = toFloat(random.direction());
        const CrtFrame frame = crt_frame(n);
        const f32 c = static_cast<f32>(std::pow(10.0, random.uniform(-5, 0))),
                  phi = static_cast<f32>(random.uniform(-3, 3));
        const f32 s = std::sqrt(1 - c * c);
        const vec3 wo = normalize3(crt_to_world(frame, make_vec3(s * std::cos(phi), s * std::sin(phi), c)));
        if (!(dot3(wo, n) > 0)) continue;
        wrong += crt_fresnel_dielectric(c, 1) != 0;
        const CrtScatter scatter = crt_sample_dielectric(splat4(1), wo, n, heroOf(0), 0, 0,
                                                         crt_unit(static_cast<u32>(random.bits())));
        wrong += !scatter.valid || scatter.wi.x != -wo.x || scatter.wi.y != -wo.y || scatter.wi.z != -wo.z ||
                 V4X(scatter.weight) != 1;
    }
    CHECK(wrong == 0);
}

TEST_CASE("a dielectric refracts by Snell's law, reflects by the mirror's, and loses nothing",
          "[kernel][bsdf]") {
    Random random(32);
    double snell = 0, mirror = 0, not_unit = 0, unbalanced = 0;
    for (const f32 eta : {1.0f / 2.4f, 1 / 1.5f, 1.0001f, 1.33f, 1.5f, 2.4f, 20.0f})
        for (int i = 0; i < 200; ++i) {
            const Vec3d nd = random.direction();
            const vec3 n = unitFloat(nd);
            Vec3d wod = random.direction();
            if (dot(wod, nd) < 0) wod = times(wod, -1);
            const vec3 wo = unitFloat(wod);
            const double cos_i = dot(toDouble(wo), toDouble(n)),
                         sin2_t = (1 - cos_i * cos_i) / (static_cast<double>(eta) * eta);
            if (cos_i < 0.01 || std::abs(1 - sin2_t) < 1e-3) continue;
            double sum = 0, reflected = 0;
            constexpr int kSteps = 20000;
            for (int k = 0; k < kSteps; ++k) {
                const CrtScatter s = crt_sample_dielectric(splat4(eta), wo, n, heroOf(1), 0, 0,
                                                           static_cast<f32>((k + 0.5) / kSteps));
                if (!s.valid) continue;
                sum += lane(s.weight, 2) * s.eta_square / kSteps;
                if (s.eta_square == 1.0f) reflected += lane(s.weight, 2) / kSteps;
                if (k % 500 != 0) continue;
                const Vec3d wi = toDouble(s.wi), m = toDouble(n);
                not_unit = std::max(not_unit, std::abs(length(wi) - 1));
                if (dot(wi, m) > 0) {
                    mirror = std::max(mirror, length(minus(plus(wi, toDouble(wo)), times(m, 2 * cos_i))));
                    CHECK(s.eta_square == 1.0f);
                } else {
                    // η times the tangential part is that of the incident direction, turned round.
                    const Vec3d tangent = plus(times(minus(wi, times(m, dot(wi, m))), eta),
                                               minus(toDouble(wo), times(m, cos_i)));
                    snell = std::max(snell, length(tangent) / std::max(1.0, static_cast<double>(eta)));
                    CHECK(s.eta_square == eta * eta);
                }
                CHECK(s.pdf == 0);
                CHECK(s.hero_only == 0);
            }
            unbalanced = std::max(unbalanced, std::abs(sum - 1));
            CHECK(reflected == Approx(sin2_t > 1 ? 1 : fresnel(cos_i, eta)).margin(1.5 / kSteps));
        }
    CHECK(snell < 1e-6);
    CHECK(mirror < 1e-6);
    CHECK(not_unit < 3e-7);
    CHECK(unbalanced < 1e-5);
}

TEST_CASE("dispersion: on average over heroes, every wavelength is refracted with its own share",
          "[kernel][bsdf]") {
    const vec4 eta = make_vec4(1.45f, 1.5f, 1.6f, 1.8f);
    const vec3 n = make_vec3(0, 0, 1);
    constexpr int kSteps = 100000;
    for (const double degrees : {0.0, 30.0, 60.0, 80.0}) {
        const vec3 wo = unitFloat({std::sin(degrees * kPi / 180), 0, std::cos(degrees * kPi / 180)});
        for (const bool inside : {false, true}) {
            const vec4 index = inside ? splat4(1) / eta : eta;
            std::array<double, 4> reflected{}, refracted{};
            for (u32 hero = 0; hero < 4; ++hero)
                for (int k = 0; k < kSteps; ++k) {
                    const CrtScatter s = crt_sample_dielectric(index, wo, n, heroOf(hero), 1, 0,
                                                               static_cast<f32>((k + 0.5) / kSteps));
                    if (!s.valid) continue;
                    CHECK_FALSE((s.hero_only != 0) == (s.wi.z > 0));
                    for (u32 i = 0; i < 4; ++i) {
                        if (s.hero_only)  // as the path does it: the others are given up, the hero counts
                                          // four times
                            refracted[i] += lane(s.weight * heroOf(hero) * 4.0f, i) / (4.0 * kSteps);
                        else
                            reflected[i] += lane(s.weight, i) / (4.0 * kSteps);
                    }
                    if (s.hero_only) CHECK(std::abs(s.wi.x * lane(index, hero) + wo.x) < 1e-6);
                }
            for (u32 i = 0; i < 4; ++i) {
                const double relative = lane(index, i),
                             sin2_t = (1 - static_cast<double>(wo.z) * wo.z) / (relative * relative);
                const double f = sin2_t > 1 ? 1 : fresnel(wo.z, relative);
                INFO(degrees << "°, " << (inside ? "inside" : "outside") << ", lane " << i);
                CHECK(reflected[i] == Approx(f).margin(3e-5));
                CHECK(refracted[i] == Approx((1 - f) / (relative * relative)).margin(1e-4));
            }
        }
    }
    // Alone, the hero's own Fresnel decides, and nothing more is given up.
    const CrtScatter alone = crt_sample_dielectric(eta, n, n, heroOf(3), 1, 1, 0.5f);
    CHECK(alone.valid);
    CHECK(alone.hero_only == 0);
    CHECK(lane(alone.weight, 3) == Approx(1 / (1.8 * 1.8)));
}

TEST_CASE("a mirror reflects, and not through the surface", "[kernel][bsdf]") {
    const vec3 ng = make_vec3(0, 0, 1);
    const CrtScatter s = crt_sample_mirror(splat4(0.7f), unitFloat({1, 2, 3}), ng, ng);
    CHECK(s.valid);
    CHECK(length(minus(toDouble(s.wi), unit({-1, -2, 3}))) < 2e-7);
    CHECK(V4Z(s.weight) == 0.7f);
    CHECK(s.pdf == 0);
    CHECK_FALSE(crt_sample_mirror(splat4(1), unitFloat({1, 0, 0.1}), unitFloat({-1, 0, 0.2}), ng).valid);
}

TEST_CASE("diffuse directions follow cos/π, and weigh what the density leaves", "[kernel][bsdf]") {
    Random random(33);
    for (int k = 0; k < 4; ++k) {
        const vec3 ns = k == 0   ? make_vec3(0, 0, 1)
                        : k == 1 ? make_vec3(0, 0, -1)
                                 : toFloat(random.direction());
        const Vec3d z = toDouble(ns),
                    x = unit(cross(z, std::abs(z[0]) < 0.5 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0})),
                    y = cross(z, x);
        // cos² and azimuth are uniform under cos/π.
        std::vector<std::uint64_t> bins(20 * 40);
        double not_unit = 0, pdf_error = 0;
        for (int i = 0; i < 400000; ++i) {
            const CrtScatter s =
                crt_sample_diffuse(make_vec4(0.1f, 0.2f, 0.3f, 0.4f), ns, ns, random.pair());
            if (!s.valid) FAIL("a direction below the surface");
            const Vec3d w = toDouble(s.wi);
            const double cosine = dot(w, z), turn = (std::atan2(dot(w, y), dot(w, x)) + kPi) / (2 * kPi);
            ++bins[std::min<std::size_t>(19, static_cast<std::size_t>(cosine * cosine * 20)) * 40 +
                   std::min<std::size_t>(39, static_cast<std::size_t>(turn * 40))];
            not_unit = std::max(not_unit, std::abs(length(w) - 1));
            pdf_error = std::max(pdf_error, std::abs(s.pdf - cosine / kPi));
            // f·cos/pdf with f = reflectance/π.
            if (V4X(s.weight) != 0.1f || V4W(s.weight) != 0.4f) FAIL("weight is not the reflectance");
        }
        CHECK(std::abs(chiSquaredDeviate(bins)) < 4.4);
        CHECK(not_unit < 6e-7);
        CHECK(pdf_error < 2e-7);
        CHECK(crt_lambert(0.5f) == Approx(0.5 / kPi));
    }
    // A tilted shading normal loses light, it does not leak it.
    const vec3 ng = make_vec3(0, 0, 1), tilted = unitFloat({1, 0, 0.3});
    std::uint64_t through = 0, lost = 0;
    for (int i = 0; i < 20000; ++i) {
        const CrtScatter s = crt_sample_diffuse(splat4(1), tilted, ng, random.pair());
        through += s.valid && !(s.wi.z > 0);
        lost += !s.valid;
    }
    CHECK(through == 0);
    CHECK(lost > 5000);
}

TEST_CASE("the power heuristic shares out 1, for any densities", "[kernel][bsdf]") {
    Random random(34);
    double worst = 0;
    for (int i = 0; i < 100000; ++i) {
        const f32 a = static_cast<f32>(std::pow(10.0, random.uniform(-37, 38))),
                  b = static_cast<f32>(std::pow(10.0, random.uniform(-37, 38)));
        const f32 wa = crt_power_heuristic(b / a), wb = crt_power_heuristic(a / b);
        worst = std::max<double>(worst, std::abs(wa + wb - 1));
        if (!(wa >= 0 && wa <= 1)) FAIL("a weight of " << wa << " for " << a << " against " << b);
    }
    CHECK(worst < 2e-7);
    CHECK(crt_power_heuristic(1) == 0.5f);
    CHECK(crt_power_heuristic(0.5f) == 0.8f);
    CHECK(crt_power_heuristic(0) == 1);
    CHECK(crt_power_heuristic(1e38f / 1e38f) == 0.5f);
    CHECK(crt_power_heuristic(1e38f / 1e-38f) == 0);
    CHECK(crt_power_heuristic(CRT_INFINITY) == 0);
    CHECK(crt_power_heuristic(1 / CRT_INFINITY) == 1);
}

// --------------------------------------------------------------------------------------------------- lights

namespace {

/// |a·(b×c)| of the rounded directions.
f32 tripleOf(const vec3& a, const vec3& b, const vec3& c) {
    return static_cast<f32>(std::abs(dot(toDouble(a), cross(toDouble(b), toDouble(c)))));
}
f32 solidAngleOf(const vec3& a, const vec3& b, const vec3& c) {
    return crt_solid_angle(tripleOf(a, b, c), a, b, c);
}

}  // namespace

TEST_CASE("solid angles of triangles, down to 1e-8 sr", "[kernel][light]") {
    CHECK(solidAngleOf(make_vec3(1, 0, 0), make_vec3(0, 1, 0), make_vec3(0, 0, 1)) == Approx(kPi / 2));
    // A face of the regular tetrahedron, of the cube halved, of the icosahedron.
    const double t = 1 / std::sqrt(3.0), g = (1 + std::sqrt(5.0)) / 2;
    CHECK(solidAngleOf(toFloat({t, t, t}), toFloat({t, -t, -t}), toFloat({-t, t, -t})) == Approx(kPi));
    CHECK(solidAngleOf(toFloat({t, t, t}), toFloat({-t, t, t}), toFloat({-t, -t, t})) == Approx(kPi / 3));
    CHECK(solidAngleOf(unitFloat({0, 1, g}), unitFloat({0, -1, g}), unitFloat({g, 0, 1})) ==
          Approx(kPi / 5));
    // Nearly a half space, and none at all.
    CHECK(solidAngleOf(unitFloat({1, 0, 1e-3}), unitFloat({-0.5, 0.9, 1e-3}),
                       unitFloat({-0.5, -0.9, 1e-3})) == Approx(2 * kPi).margin(2e-2));
    CHECK(solidAngleOf(make_vec3(0, 0, 1), make_vec3(0, 0, 1), make_vec3(1, 0, 0)) == 0);

    // Of the same rounded directions, in long double. The rest is the rounding of the triple product, 1e-7
    // of the triangle's width.
    Random random(35);
    for (const double width : {1.0, 1e-1, 1e-2, 1e-3, 1e-4}) {
        double worst = 0;
        for (int i = 0; i < 20000; ++i) {
            const Vec3d d = random.direction(), x = unit(cross(d, random.direction())), y = cross(d, x);
            const auto corner = [&](double u, double v) {
                return unitFloat(plus(d, plus(times(x, u * width), times(y, v * width))));
            };
            const vec3 a = corner(0.9, 0.1 * random.uniform()), b = corner(-0.5, 0.8),
                       c = corner(-0.5 * random.uniform(), -0.9);
            worst = std::max(
                worst,
                std::abs(solidAngleOf(a, b, c) / solidAngle(toDouble(a), toDouble(b), toDouble(c)) - 1));
        }
        INFO("width " << width);
        CHECK(worst < 4e-7 / width);
    }
}

TEST_CASE("directions are uniform in a spherical triangle", "[kernel][light]") {
    Random random(36);
    const std::array<Vec3d, 3> triangles[] = {
        {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
        {{{0.3, 0.1, 1}, {-0.4, 0.6, 1}, {0.1, -0.5, 1}}},
        {{{5, 0, 1}, {-3, 4, 1}, {-3, -4, 1}}},        // nearly a half space
        {{{0.01, 0, 1}, {2, 0.02, 1}, {-1, 0.03, 1}}}, // narrow
        {{{1, 1, 1}, {1, -1, 1}, {-1, -1, 1}}},
    };
    for (const auto& corners : triangles) {
        const Vec3d a = unit(corners[0]), b = unit(corners[1]), c = unit(corners[2]);
        const f32 triple = tripleOf(toFloat(a), toFloat(b), toFloat(c));
        const f32 omega = solidAngleOf(toFloat(a), toFloat(b), toFloat(c));
        // The flat triangle, cut into 8 × 8 strips of smaller ones; each has its own solid angle.
        constexpr int kCut = 8;
        const auto point = [&](int i, int j) {
            return plus(a, plus(times(minus(b, a), static_cast<double>(i) / kCut),
                                times(minus(c, a), static_cast<double>(j) / kCut)));
        };
        std::vector<double> expected;
        std::vector<std::uint64_t> observed;
        std::vector<int> index(2 * kCut * kCut, -1);
        for (int i = 0; i < kCut; ++i)
            for (int j = 0; i + j < kCut; ++j)
                for (int upper = 0; upper < 2; ++upper) {
                    if (upper && i + j + 1 >= kCut) continue;
                    index[static_cast<std::size_t>(2 * (i * kCut + j) + upper)] =
                        static_cast<int>(expected.size());
                    expected.push_back(
                        upper ? solidAngle(point(i + 1, j + 1), point(i, j + 1), point(i + 1, j))
                              : solidAngle(point(i, j), point(i + 1, j), point(i, j + 1)));
                }
        observed.resize(expected.size());
        const Vec3d n = cross(minus(b, a), minus(c, a));
        std::uint64_t outside = 0;
        for (int i = 0; i < 300000; ++i) {
            const Vec3d d = toDouble(crt_sample_spherical_triangle(toFloat(a), toFloat(b), toFloat(c),
                                                                   triple, omega, random.pair()));
            const Vec3d p = minus(times(d, dot(n, a) / dot(n, d)), a);
            const double u = dot(cross(p, minus(c, a)), n) / dot(n, n),
                         v = dot(cross(minus(b, a), p), n) / dot(n, n);
            if (u < -1e-3 || v < -1e-3 || u + v > 1.001) {
                ++outside;
                continue;
            }
            const int column = std::clamp(static_cast<int>(u * kCut), 0, kCut - 1),
                      row = std::clamp(static_cast<int>(v * kCut), 0, kCut - 1 - column);
            const bool upper = u * kCut - column + v * kCut - row > 1 && column + row + 1 < kCut;
            ++observed[static_cast<std::size_t>(
                index[static_cast<std::size_t>(2 * (column * kCut + row) + upper)])];
        }
        double sum = 0;
        for (const double e : expected) sum += e;
        INFO("solid angle " << omega);
        CHECK(sum == Approx(omega).epsilon(1e-4));
        CHECK(outside < 30);
        CHECK(std::abs(chiSquaredDeviate(observed, expected)) < 4.4);
    }
}

namespace {

/// Emitters alone, each a polygon of three or four corners with its radiance.
struct Lamp {
    std::vector<Vec3d> corners;
    double radiance = 1;
    bool two_sided = false;
};

struct LitScene {
    crt::CompiledScene compiled;
    CrtContext ctx;
    double scale;

    explicit LitScene(const std::vector<Lamp>& lamps) {
        crt::Scene scene;
        scene.camera.position = {0, 0, -3};
        for (const Lamp& lamp : lamps) {
            crt::Mesh mesh;
            mesh.positions = lamp.corners;
            mesh.triangles = {{0, 1, 2}};
            if (lamp.corners.size() == 4) mesh.triangles.push_back({0, 2, 3});
            scene.emissions.push_back({crt::constantSpectrum(lamp.radiance), lamp.two_sided});
            crt::Object object;
            object.mesh = static_cast<std::uint32_t>(scene.meshes.size());
            object.emission = static_cast<std::int32_t>(scene.emissions.size()) - 1;
            scene.meshes.push_back(mesh);
            scene.objects.push_back(object);
        }
        compiled = crt::compileScene(scene, 0);
        ctx = contextOf(compiled);
        scale = std::ldexp(1.0, compiled.scale_exponent);
    }
    /// In the kernel's units.
    Vec3d place(const Vec3d& p) const { return times(minus(p, compiled.centre), scale); }
    const CrtLight& emitter(u32 i) const { return arrayOf<CrtLight>(compiled, ctx.scene->lights)[i]; }
};

CrtLightSample sampleLight(const LitScene& scene, const Vec3d& p, u32 i) {
    CrtSampler sampler = crt_sampler_begin(CRT_SAMPLER_INDEPENDENT, 0, crt_seed(3, 4), i, 0);
    const u32 light = crt_light_choose(&scene.ctx, &sampler, 8);
    return crt_light_sample(&scene.ctx, light, &sampler, 8, toFloat(p));
}

/// Triangle and parallelogram, at z = 1, facing down.
const std::vector<Vec3d> kTriangle{{-0.5, -0.5, 1}, {-0.3, 0.7, 1}, {0.9, -0.2, 1}};
const std::vector<Vec3d> kQuad{{-0.5, -0.5, 1}, {-0.4, 0.5, 1}, {0.6, 0.7, 1}, {0.5, -0.3, 1}};

}  // namespace

TEST_CASE("light sampling integrates: solid angles and form factors in closed form, near and far",
          "[kernel][light]") {
    // By solid angle under it and close by, by area far off; edge-on in between.
    const Vec3d places[] = {{0, 0, 0.9},      {0.1, -0.1, 0.5}, {0, 0, 0},   {2, 1, 0},    {0.2, 0.1, -6},
                            {1.1, 0.2, 0.95}, {0.95, 0, 0.997}, {6, 1, 0.8}, {60, 30, -50}};
    for (const auto& corners : {kTriangle, kQuad}) {
        const LitScene scene({{corners, 1, false}});
        REQUIRE(scene.compiled.emitters == 1);  // the halves of a parallelogram are one light
        for (const Vec3d& where : places) {
            const Vec3d p = scene.place(where);
            std::vector<Vec3d> seen;
            double omega = 0;
            for (const Vec3d& c : corners) seen.push_back(minus(scene.place(c), toDouble(toFloat(p))));
            for (std::size_t i = 2; i < seen.size(); ++i) omega += solidAngle(seen[0], seen[i - 1], seen[i]);
            const Vec3d up{0, 0, 1};
            Mean solid_angle, form_factor;
            double inconsistent = 0, off_plane = 0, beside = 0;
            for (u32 i = 0; i < 40000; ++i) {
                const CrtLightSample s = sampleLight(scene, p, i);
                if (!(s.pdf > 0)) {
                    solid_angle.add(0);
                    form_factor.add(0);
                    continue;
                }
                const Vec3d wi = toDouble(s.wi), to = minus(toDouble(s.point), toDouble(toFloat(p)));
                solid_angle.add(1.0 / s.pdf);
                form_factor.add(std::max(0.0, dot(wi, up)) / kPi / s.pdf);
                const f32 pdf = crt_light_pdf(&scene.ctx, 0, toFloat(p), static_cast<f32>(length(to))).pdf;
                inconsistent = std::max(inconsistent, std::abs(pdf / static_cast<double>(s.pdf) - 1));
                off_plane = std::max(off_plane, std::abs(s.point.z - scene.place(corners[0])[2]));
                beside = std::max(beside, length(minus(times(unit(to), 1.0), wi)));
                if (!(s.reach > 0.9 && s.reach < 1)) FAIL("reach " << s.reach);
            }
            INFO("seen from " << where[0] << " " << where[1] << " " << where[2] << ", Ω = " << omega);
            // Solid angle sampling has no variance here; then rounding alone is left.
            CHECK(std::abs(solid_angle.mean() - omega) <
                  4.4 * solid_angle.standardError() + 1e-5 * omega + 1e-7);
            const double f = formFactor(seen, up);
            CHECK(std::abs(form_factor.mean() - f) < 4.4 * form_factor.standardError() + 1e-5 * f + 1e-8);
            CHECK(inconsistent < 1e-3);
            CHECK(off_plane < 3e-7);
            CHECK(beside < 1e-6);
        }
    }
}

TEST_CASE("a light's density integrates to 1 over the light", "[kernel][light]") {
    for (const auto& corners : {kTriangle, kQuad}) {
        const LitScene scene({{corners, 1, false}});
        for (const Vec3d& where : {Vec3d{0, 0, 0.3}, Vec3d{2, 1, 0}, Vec3d{0, 0, -5}}) {
            const Vec3d p = toDouble(toFloat(scene.place(where)));
            double integral = 0;
            for (std::size_t half = 0; half + 2 < corners.size(); ++half) {
                const Vec3d o = scene.place(corners[0]), a = minus(scene.place(corners[half + 1]), o),
                            b = minus(scene.place(corners[half + 2]), o);
                const double area = length(cross(a, b)) / 2;
                constexpr int kCut = 300;
                for (int i = 0; i < kCut; ++i)
                    for (int j = 0; j < 2 * (kCut - i) - 1; ++j) {
                        const double third =
                            j % 2 ? 2.0 / 3 : 1.0 / 3;  // centroids of small triangles, upright and inverted
                        const Vec3d d = minus(
                            plus(o, plus(times(a, (i + third) / kCut), times(b, (j / 2 + third) / kCut))),
                            p);
                        const Vec3d wi = unit(d);
                        const f32 pdf =
                            crt_light_pdf(&scene.ctx, 0, toFloat(p), static_cast<f32>(length(d))).pdf;
                        integral += pdf * std::abs(wi[2]) / dot(d, d) * area / (kCut * kCut);
                    }
            }
            CHECK(integral == Approx(1).margin(2e-4));
        }
    }
}

TEST_CASE("lights are chosen by power, counted by choice, and seen from their front", "[kernel][light]") {
    // Four lamps, strong and weak; the last shines both ways.
    const auto at = [](double x, double z) {
        return std::vector<Vec3d>{{x, 0, z}, {x, 0.2, z}, {x + 0.2, 0, z}};
    };
    const LitScene scene(
        {{at(0, 1), 1, false}, {at(1, 1), 100, false}, {at(2, 1), 1e-3, false}, {at(3, 1), 5, true}});
    REQUIRE(scene.compiled.emitters == 4);
    double total = 0;
    for (u32 i = 0; i < 4; ++i) total += static_cast<double>(scene.emitter(i).choice_probability);
    CHECK(total == Approx(1).margin(1e-7));
    CHECK(scene.emitter(0).choice_probability == Approx(1.0 / 111.001).epsilon(1e-6));
    CHECK(scene.emitter(3).choice_probability == Approx(10.0 / 111.001).epsilon(1e-6));
    CHECK(scene.emitter(0).choice == 0);

    // From below all shine; from above only the last.
    const Vec3d below = scene.place({1.5, 0, -1}), above = scene.place({1.5, 0, 3});
    std::vector<std::uint64_t> chosen(4);
    Mean from_below, from_above;
    double expected_below = 0, expected_above = 0;
    for (const auto& [x, shines_up] : {std::pair{0.0, false}, {1.0, false}, {2.0, false}, {3.0, true}}) {
        const std::vector<Vec3d> c = at(x, 1);
        const auto angle = [&](const Vec3d& p) {
            return solidAngle(minus(scene.place(c[0]), p), minus(scene.place(c[1]), p),
                              minus(scene.place(c[2]), p));
        };
        expected_below += angle(below);
        if (shines_up) expected_above += angle(above);
    }
    for (u32 i = 0; i < 400000; ++i) {
        const CrtLightSample s = sampleLight(scene, below, i);
        const double x = toDouble(s.point)[0] / scene.scale + scene.compiled.centre[0];
        ++chosen[std::min<std::size_t>(3, static_cast<std::size_t>(std::max(0.0, x)))];
        from_below.add(s.pdf > 0 ? 1.0 / s.pdf : 0);
        const CrtLightSample t = sampleLight(scene, above, i);
        from_above.add(t.pdf > 0 ? 1.0 / t.pdf : 0);
    }
    CHECK(std::abs(chiSquaredDeviate(chosen, {1, 100, 1e-3 + 1e-30, 10})) < 4.4);
    CHECK(std::abs(from_above.deviate(expected_above)) < 4.4);
    // The weak lamp is found one time in 111,000, and then counts as often.
    CHECK(std::abs(from_below.deviate(expected_below)) < 4.4);
    // In its own plane a lamp gives nothing, and no NaN.
    for (u32 i = 0; i < 1000; ++i) {
        const CrtLightSample s = sampleLight(scene, scene.place({-0.5, 0.1, 1}), i);
        if (s.pdf > 0 && !(s.pdf < 1e30f)) FAIL("density " << s.pdf);
    }
}

// ---------------------------------------------------------------------------------------------- wavelengths

TEST_CASE("four wavelengths integrate any spectrum, together or the hero alone", "[kernel][spectrum]") {
    crt::Scene scene;
    scene.camera.position = {0, 0, -3};
    crt::Spectrum ramp, line;
    for (std::size_t i = 0; i < ramp.values.size(); ++i) ramp[i] = 0.1 + 0.002 * static_cast<double>(i);
    line[589 - 360] = 50;  // one nanometre wide at the foot: a triangle
    const crt::Spectrum spectra[] = {crt::constantSpectrum(1), *crt::illuminantSpectrum("D65"),
                                     *crt::illuminantSpectrum("F11"), ramp, line};
    for (const crt::Spectrum& spectrum : spectra) {
        scene.environment = crt::Environment{spectrum};
        const crt::CompiledScene compiled = crt::compileScene(scene, 0);
        const CrtContext ctx = contextOf(compiled);
        Vec3d all{}, alone{};
        double nanometres = 0, area = 0, highest = 0, lowest = 1000;
        constexpr u32 kSteps = 1u << 18;
        for (u32 i = 0; i < kSteps; ++i) {
            const CrtWavelengths w = crt_sample_wavelengths(&ctx, static_cast<f32>((i + 0.5) / kSteps));
            const vec4 radiance = crt_value(&ctx, ctx.scene->environment, nullptr, w.position);
            vec4 inverse_pdf;
            (void)crt_four_wavelengths(&ctx, w.u, &inverse_pdf);
            const vec4 xyz = crt_to_xyz(&ctx, w, radiance),
                       hero = crt_to_xyz(&ctx, w, radiance * heroOf(i % 4) * 4.0f);
            for (u32 k = 0; k < 3; ++k) {
                all[k] += lane(xyz, k) / kSteps;
                alone[k] += lane(hero, k) / kSteps;
            }
            for (u32 k = 0; k < 4; ++k) {
                nanometres += lane(inverse_pdf, k) / kSteps;
                area += lane(inverse_pdf, k) * lane(radiance, k) / kSteps;
                lowest = std::min(lowest, lane(w.position, k));
                highest = std::max(highest, lane(w.position, k));
            }
        }
        double trapezoid = 0;
        for (std::size_t i = 0; i + 1 < spectrum.values.size(); ++i)
            trapezoid += (spectrum[i] + spectrum[i + 1]) / 2;
        const Vec3d expected = crt::spectrumToXyz(spectrum);
        CHECK(nanometres == Approx(470).epsilon(1e-5));
        CHECK(area == Approx(trapezoid).epsilon(2e-3));
        CHECK(lowest >= 0);
        CHECK(highest <= 470);
        // The host sums products at whole nanometres; the kernel interpolates both factors between them,
        // which differs where both bend.
        for (std::size_t k = 0; k < 3; ++k) {
            CHECK(all[k] == Approx(expected[k]).epsilon(2e-3).margin(1e-5));
            CHECK(alone[k] == Approx(all[k]).epsilon(2e-3).margin(1e-5));
        }
    }
    // Radiance 1 at all wavelengths is (1, 1, 1), to what the tables of the observer give.
    const Vec3d white = crt::spectrumToXyz(crt::constantSpectrum(1));
    CHECK(white[1] == Approx(1).epsilon(1e-12));
    CHECK(white[0] == Approx(1).margin(1e-3));
    CHECK(white[2] == Approx(1).margin(1e-3));
}

TEST_CASE("the density of a wavelength is what its weight says", "[kernel][spectrum]") {
    crt::Scene scene;
    scene.camera.position = {0, 0, -3};
    scene.environment = crt::Environment{crt::constantSpectrum(1)};
    const crt::CompiledScene compiled = crt::compileScene(scene, 0);
    const CrtContext ctx = contextOf(compiled);
    // Random numbers, counted in bins of 5 nm against the integral of 1/inverse_pdf; and λ(u) grows.
    Random random(37);
    std::vector<std::uint64_t> observed(94);
    std::vector<double> expected(94);
    f32 before = -1;
    for (u32 i = 0; i < 1u << 20; ++i) {
        f32 inverse = 0;
        const f32 position = crt_wavelength(&ctx, static_cast<f32>((i + 0.5) * 0x1p-20), &inverse);
        if (!(position >= before) || !(inverse > 0)) FAIL("not monotone at " << i);
        if (i > 0 && position > before)
            expected[std::min<std::size_t>(93, static_cast<std::size_t>(position / 5))] +=
                (position - before) / inverse;
        before = position;
        ++observed[std::min<std::size_t>(
            93, static_cast<std::size_t>(crt_wavelength(&ctx, random.pair().x, &inverse) / 5))];
    }
    CHECK(std::abs(chiSquaredDeviate(observed, expected)) < 4.4);
    // The ends: no table is left.
    for (const u32 bits : {0u, 0xffffffffu}) {
        const CrtWavelengths w = crt_sample_wavelengths(&ctx, crt_unit(bits));
        vec4 inverse_pdf;
        (void)crt_four_wavelengths(&ctx, w.u, &inverse_pdf);
        for (u32 k = 0; k < 4; ++k) {
            CHECK(lane(w.position, k) >= 0);
            CHECK(lane(w.position, k) <= 470);
            CHECK(lane(inverse_pdf, k) > 0);
        }
    }
}

TEST_CASE("spectra and observer are exact at whole nanometres and linear between", "[kernel][spectrum]") {
    crt::Scene scene;
    scene.camera.position = {0, 0, -3};
    crt::Spectrum s;
    for (std::size_t i = 0; i < s.values.size(); ++i) s[i] = static_cast<double>(i * i % 97);
    scene.environment = crt::Environment{s};
    const crt::CompiledScene compiled = crt::compileScene(scene, 0);
    const CrtContext ctx = contextOf(compiled);
    for (u32 nm = 0; nm <= 470; ++nm) {
        const f32 at = static_cast<f32>(nm);
        CHECK(lane(crt_value(&ctx, ctx.scene->environment, nullptr, make_vec4(0, 0, at, 0)), 2) == s[nm]);
        CHECK(lane(crt_observer(&ctx, at), 1) ==
              static_cast<f32>(crt::cieObserver()[1][nm] / crt::cieYIntegral()));
        if (nm < 470)
            CHECK(lane(crt_value(&ctx, ctx.scene->environment, nullptr, splat4(at + 0.25f)), 0) ==
                  Approx(0.75 * s[nm] + 0.25 * s[nm + 1]).margin(1e-5));
    }
}

TEST_CASE("smooth glass sends all light to the right side of its face", "[kernel][bsdf]") {
    Random random(5);
    std::uint64_t lost = 0, on_the_wrong_side = 0;
    double worst = 0;
    const auto vectorOf = [](const Vec3d& v) {
        return make_vec3(static_cast<f32>(v[0]), static_cast<f32>(v[1]), static_cast<f32>(v[2]));
    };
    for (int i = 0; i < 200000; ++i) {
        CrtBsdf b{};
        b.type = CRT_MATERIAL_DIELECTRIC;
        b.flags = CRT_BSDF_REFLECTS | CRT_BSDF_TRANSMITS | CRT_BSDF_DELTA | CRT_BSDF_BOUNDS;
        b.eta = splat4(i % 2 == 0 ? 1.5f : 1 / 1.5f);
        b.ng = vectorOf(random.direction());
        b.ns = vectorOf(random.direction());
        b.wo = vectorOf(random.direction());
        if (dot3(b.ns, b.ng) < 0) b.ns = -b.ns;
        if (dot3(b.wo, b.ng) < 0) b.wo = -b.wo;
        crt_face_viewer(&b, 1);
        const CrtScatter s =
            crt_sample_smooth(&b, heroOf(0), 0, static_cast<f32>(random.uniform(0, 0.999999)));
        lost += !s.valid;
        on_the_wrong_side += s.valid && (s.eta_square != 1.0f) != (dot3(s.wi, b.ng) < 0);
        worst = std::max(worst, std::abs(double{V4X(s.weight)} * double{s.eta_square} - 1));
    }
    CHECK(lost == 0);
    CHECK(on_the_wrong_side == 0);
    CHECK(worst < 1e-6);
}

TEST_CASE("colours of views are the film's sRGB", "[kernel][spectrum]") {
    // The kernel's matrix to XYZ against the host's from XYZ, which resolves the image.
    const crt::Matrix3d to_rgb = crt::xyzToRgb(crt::ColorSpace::LinearSrgb);
    for (int axis = 0; axis < 3; ++axis) {
        const vec4 xyz =
            crt_srgb_to_xyz(axis == 0 ? 1.0f : 0.0f, axis == 1 ? 1.0f : 0.0f, axis == 2 ? 1.0f : 0.0f);
        const crt::Vec3d rgb = crt::multiply(to_rgb, crt::Vec3d{V4X(xyz), V4Y(xyz), V4Z(xyz)});
        for (int k = 0; k < 3; ++k) CHECK(rgb[k] == Approx(k == axis ? 1.0 : 0.0).margin(2e-6));
    }
}
