/// The shared parts of the kernel's unit tests: the kernel as plain C++, scenes made in memory, seeded
/// numbers, and chi-squared.
#pragma once

#include "base/vec3d.h"
#include "catch.h"
#include "compile/compile.h"
#include "kernel/schedule/pixel.h"
#include "verify/shapes.h"

#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace kernel_test {

using namespace crt::kernel;
using crt::cross;
using crt::dot;
using crt::length;

/// Seeded by the test, so that a failure comes back. Not std::uniform_real_distribution, whose numbers
/// depend on the library.
class Random {
public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}
    std::uint64_t bits() { return engine_(); }
    std::uint32_t below(std::uint32_t n) {
        return static_cast<std::uint32_t>(((engine_() >> 32) * n) >> 32);
    }
    double uniform() { return (static_cast<double>(engine_() >> 11) + 0.5) * 0x1p-53; }
    double uniform(double lower, double upper) { return lower + (upper - lower) * uniform(); }
    CrtRandom2 pair() {
        CrtRandom2 u;
        u.x = crt_unit(static_cast<u32>(engine_() >> 32));
        u.y = crt_unit(static_cast<u32>(engine_() >> 32));
        return u;
    }
    /// Uniform on the unit sphere.
    crt::Vec3d direction() {
        const double z = uniform(-1, 1), phi = uniform(0, 2 * 3.14159265358979323846),
                     r = std::sqrt(1 - z * z);
        return {r * std::cos(phi), r * std::sin(phi), z};
    }

private:
    std::mt19937_64 engine_;
};

inline vec3 toFloat(const crt::Vec3d& v) {
    return make_vec3(static_cast<f32>(v[0]), static_cast<f32>(v[1]), static_cast<f32>(v[2]));
}
inline crt::Vec3d toDouble(vec3 v) { return {v.x, v.y, v.z}; }
inline crt::Vec3d minus(const crt::Vec3d& a, const crt::Vec3d& b) { return crt::operator-(a, b); }
inline crt::Vec3d plus(const crt::Vec3d& a, const crt::Vec3d& b) { return crt::operator+(a, b); }
inline crt::Vec3d times(const crt::Vec3d& a, double s) { return crt::operator*(a, s); }
inline crt::Vec3d unit(const crt::Vec3d& a) { return times(a, 1 / length(a)); }
/// A unit vector in float, as near to v as rounding once allows.
inline vec3 unitFloat(const crt::Vec3d& v) { return toFloat(unit(v)); }

inline CrtRay rayOf(vec3 o, vec3 d, f32 reach = CRT_INFINITY) {
    CrtRay ray;
    ray.o = o;
    ray.d = d;
    ray.reach = reach;
    return ray;
}

/// The inverse of crt_hash: its multipliers' inverses modulo 2^32, and its shifts in the other order.
inline u32 unhash(u32 x) {
    const auto inverse = [](u32 odd) {
        u32 y = odd;
        for (int i = 0; i < 5; ++i) y *= 2u - odd * y;  // Newton
        return y;
    };
    static const u32 first = inverse(0x7feb352du), second = inverse(0x846ca68bu);
    x ^= x >> 16;
    x *= second;
    x ^= x >> 15 ^ x >> 30;
    x *= first;
    return x ^ x >> 16;
}

/// The scene as the kernel sees it. `compiled` must outlive it.
inline CrtContext contextOf(const crt::CompiledScene& compiled) {
    CrtContext ctx{};
    ctx.blob = compiled.data();
    ctx.scene = &compiled.header();
    return ctx;
}

template <class T>
const T* arrayOf(const crt::CompiledScene& compiled, CrtSpan span) {
    return CRT_ARRAY(T, compiled.data(), span);
}

/// Triangles of all sizes and shapes, anywhere within ±1.
inline crt::Mesh soup(Random& random, std::uint32_t count) {
    crt::Mesh mesh;
    for (std::uint32_t i = 0; i < count; ++i) {
        const crt::Vec3d p{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
        const double size = std::pow(10.0, random.uniform(-3, 0));
        const crt::Vec3d a = times(random.direction(), size),
                    b = times(random.direction(), size * std::pow(10.0, random.uniform(-3, 0)));
        // Some lie in planes of constant x, y or z: their boxes are flat.
        const auto flatten = [&](crt::Vec3d v) {
            if (i % 4 < 3) v[i % 4] = 0;
            return i % 8 < 4 ? v : plus(v, {});
        };
        crt::verify::addTriangle(mesh, p, plus(p, i % 8 < 4 ? flatten(a) : a),
                                 plus(p, i % 8 < 4 ? flatten(b) : b));
    }
    return mesh;
}

inline vec3 vertexOf(const CrtTriangle& t, u32 i) { return make_vec3(t.p[i], t.p[3 + i], t.p[6 + i]); }

/// The portable loop: every slot in turn, one at a time.
inline CrtHit oneByOne(const CrtContext& ctx, CrtRay ray) {
    const auto* triangles = CRT_ARRAY(CrtTriangle, ctx.blob, ctx.scene->triangles);
    const CrtShear shear = crt_shear(ray);
    CrtHit best = crt_no_hit(ray.reach);
    for (u32 slot = 0; slot < ctx.scene->triangle_count; ++slot)
        crt_test_closest(triangles, slot, shear, &best);
    return best;
}

/// One object, one mesh, nothing else; the camera looks at it from −z.
inline crt::Scene sceneOf(crt::Mesh mesh, crt::Accelerator accelerator = crt::Accelerator::Auto) {
    crt::Scene scene;
    scene.camera.position = {0, 0, -3};
    scene.camera.target = {0, 0, 0};
    scene.film.width = scene.film.height = 16;
    scene.integrator.accelerator = accelerator;
    scene.environment = crt::Environment{crt::constantSpectrum(1)};
    scene.meshes.push_back(std::move(mesh));
    scene.objects.emplace_back();
    return scene;
}

/// Standard normal deviate of a chi-squared statistic (Wilson and Hilferty): |z| < 4.4 but for one time in
/// 100,000. Both tails: counts that fit too well are no random counts either.
inline double chiSquaredDeviate(const std::vector<std::uint64_t>& observed,
                                const std::vector<double>& expected) {
    double sum = 0, chi2 = 0, total = 0;
    for (const double e : expected) sum += e;
    for (const std::uint64_t n : observed) total += static_cast<double>(n);
    for (std::size_t i = 0; i < observed.size(); ++i) {
        const double e = expected[i] * total / sum;
        chi2 += (static_cast<double>(observed[i]) - e) * (static_cast<double>(observed[i]) - e) / e;
    }
    const double k = static_cast<double>(observed.size() - 1), v = 2 / (9 * k);
    return (std::cbrt(chi2 / k) - (1 - v)) / std::sqrt(v);
}
inline double chiSquaredDeviate(const std::vector<std::uint64_t>& observed) {
    return chiSquaredDeviate(observed, std::vector<double>(observed.size(), 1.0));
}

/// Mean of many values, and how far it is from `expected` in standard errors.
struct Mean {
    std::uint64_t n = 0;
    double sum = 0, squares = 0;
    void add(double x) {
        ++n;
        sum += x;
        squares += x * x;
    }
    double mean() const { return sum / static_cast<double>(n); }
    double standardError() const {
        const double m = mean();
        return std::sqrt(std::max(0.0, squares / static_cast<double>(n) - m * m) /
                         static_cast<double>(n - 1));
    }
    double deviate(double expected) const { return (mean() - expected) / standardError(); }
};

}  // namespace kernel_test
