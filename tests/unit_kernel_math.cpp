// kernel/dialect/math.h against long double and exact integers: what its comments promise in ulps, signs
// that must be exact, sums that lose nothing.
#include "kernel_test.h"

#include <algorithm>
#include <cfloat>
#include <numbers>

using namespace kernel_test;

namespace {

/// Error in units in the last place of the exact result.
double ulps(f32 computed, long double exact) {
    if (exact == 0) return computed == 0 ? 0 : HUGE_VAL;
    int exponent = 0;
    std::frexp(std::abs(exact), &exponent);
    return static_cast<double>(std::abs(static_cast<long double>(computed) - exact) /
                               std::ldexp(1.0L, std::max(exponent, -125) - 24));
}

/// Calls f for every `stride`-th float in [lower, upper], and for upper.
template <class F>
void forFloats(f32 lower, f32 upper, u32 stride, F f) {
    for (u32 bits = crt_bits(lower); bits < crt_bits(upper); bits += stride) f(crt_from_bits(bits));
    f(upper);
}

f32 randomFloat(Random& random, int lowest_exponent, int highest_exponent) {
    const int exponent =
        lowest_exponent +
        static_cast<int>(random.below(static_cast<u32>(highest_exponent - lowest_exponent + 1)));
    const f32 x = std::ldexp(1.0f + static_cast<f32>(random.bits() >> 41) * 0x1p-23f, exponent);
    return random.bits() & 1 ? -x : x;
}

}  // namespace

TEST_CASE("sine and cosine of up to a quarter turn's half: below 1 ulp", "[kernel][math]") {
    double sine = 0, cosine = 0;
    forFloats(0x1p-20f, static_cast<f32>(std::numbers::pi / 4), 61, [&](f32 x) {
        sine = std::max(sine, ulps(crt_sin_quarter(x), std::sin(static_cast<long double>(x))));
        cosine = std::max(cosine, ulps(crt_cos_quarter(x), std::cos(static_cast<long double>(x))));
        if (crt_sin_quarter(-x) != -crt_sin_quarter(x) || crt_cos_quarter(-x) != crt_cos_quarter(x))
            FAIL("not odd, not even at " << x);
    });
    CHECK(sine < 0.74);
    CHECK(cosine < 0.88);
    // Where the worst errors are, of all floats.
    CHECK(ulps(crt_sin_quarter(0x1.916586p-1f), std::sin(0x1.916586p-1L)) == Approx(0.7306).margin(1e-4));
    CHECK(ulps(crt_cos_quarter(0x1.8f0a1ep-1f), std::cos(0x1.8f0a1ep-1L)) == Approx(0.8777).margin(1e-4));
    CHECK(crt_sin_quarter(0.0f) == 0.0f);
    CHECK(crt_cos_quarter(0.0f) == 1.0f);
}

TEST_CASE("sine and cosine of ten turns either way: 7.8e-8", "[kernel][math]") {
    double worst = 0;
    const auto check = [&](f32 x) {
        f32 cosine = 0;
        const f32 sine = crt_sincos(x, &cosine);
        worst = std::max({worst, std::abs(sine - std::sin(static_cast<double>(x))),
                          std::abs(cosine - std::cos(static_cast<double>(x)))});
    };
    forFloats(0x1p-20f, 63.999996f, 61, [&](f32 x) {
        check(x);
        check(-x);
    });
    // Next to the multiples of π/4, where quadrants change and results vanish.
    for (int k = -81; k <= 81; ++k)
        for (f32 x = static_cast<f32>(k * std::numbers::pi / 4), n = 0; n < 50; ++n, x = crt_next_up(x)) {
            check(x);
            check(-x);
        }
    CHECK(worst < 7.8e-8);
}

TEST_CASE("exponential function of what is not above 0: below 1.01 ulp", "[kernel][math]") {
    double worst = 0;
    forFloats(0x1p-26f, 86.99999f, 61, [&](f32 x) {
        worst = std::max(worst, ulps(crt_exp_negative(-x), std::exp(static_cast<long double>(-x))));
    });
    CHECK(worst < 1.01);
    CHECK(crt_exp_negative(0.0f) == 1.0f);
    CHECK(crt_exp_negative(-1e-20f) == 1.0f);
    CHECK(crt_exp_negative(-86.99999f) > 0x1p-126f);
    CHECK(crt_exp_negative(-87.0f) == 0.0f);
    CHECK(crt_exp_negative(-CRT_INFINITY) == 0.0f);
}

TEST_CASE("arc tangent of up to 1, and of two numbers: the ulps that are promised", "[kernel][math]") {
    double worst = 0;
    forFloats(0x1p-20f, 1.0f, 61, [&](f32 x) {
        worst = std::max(worst, ulps(crt_atan_unit(x), std::atan(static_cast<long double>(x))));
    });
    CHECK(worst < 2.81);
    CHECK(ulps(crt_atan_unit(0x1.ba7036p-2f), std::atan(0x1.ba7036p-2L)) == Approx(2.8043).margin(1e-4));

    Random random(1);
    worst = 0;
    for (int i = 0; i < 2000000; ++i) {
        const int e = static_cast<int>(random.below(61)) - 30;
        const f32 y = randomFloat(random, e, e);
        const f32 x = i & 1 ? randomFloat(random, e - 2, e + 2) : randomFloat(random, -30, 30);
        worst = std::max(worst, ulps(crt_atan2(y, x),
                                     std::atan2(static_cast<long double>(y), static_cast<long double>(x))));
    }
    CHECK(worst < 3.5);
    CHECK(crt_atan2(0.0f, 0.0f) == 0.0f);
    CHECK(crt_atan2(0.0f, 1.0f) == 0.0f);
    CHECK(crt_atan2(0.0f, -1.0f) == static_cast<f32>(std::numbers::pi));
    CHECK(crt_atan2(1.0f, 0.0f) == static_cast<f32>(std::numbers::pi / 2));
    CHECK(crt_atan2(-1.0f, 0.0f) == static_cast<f32>(-std::numbers::pi / 2));
    CHECK(crt_atan2(-1.0f, -1.0f) == Approx(-3 * std::numbers::pi / 4).epsilon(2e-7));
}

TEST_CASE("a difference of products has the exact sign, and an error of at most 1.5 ulp", "[kernel][math]") {
    Random random(2);
    double worst = 0;
    std::uint64_t wrong_signs = 0, zeros = 0;
    for (int i = 0; i < 3000000; ++i) {
        const f32 a = randomFloat(random, -20, 20), b = randomFloat(random, -20, 20);
        f32 c = randomFloat(random, -20, 20), d = randomFloat(random, -20, 20);
        if (i % 3 != 0) {
            // Almost equal products: the sign of what rounding a·b alone would lose.
            c = a;
            d = b;
            for (u32 n = random.below(4); n > 0; --n) c = crt_next_up(c);
            for (u32 n = random.below(4); n > 0; --n) d = crt_next_down(d);
            if (i % 3 == 2) std::swap(c, d);
        }
        const long double exact = static_cast<long double>(static_cast<double>(a) * b) -
                                  static_cast<long double>(static_cast<double>(c) * d);
        const f32 computed = crt_difference_of_products(a, b, c, d);
        const int sign = (exact > 0) - (exact < 0);
        wrong_signs += ((computed > 0) - (computed < 0)) != sign;
        zeros += sign == 0;
        if (sign != 0) worst = std::max(worst, ulps(computed, exact));
    }
    CHECK(wrong_signs == 0);
    CHECK(worst <= 1.5);
    CHECK(zeros > 1000);
    // A case in which a plain evaluation is wrong: (1 + 2^-12)² − (1 + 2^-11) = 2^-24.
    CHECK(crt_difference_of_products(1 + 0x1p-12f, 1 + 0x1p-12f, 1 + 0x1p-11f, 1.0f) == 0x1p-24f);
}

TEST_CASE("the cross product of float vectors is right in every component", "[kernel][math]") {
    Random random(3);
    double worst = 0;
    for (int i = 0; i < 300000; ++i) {
        const vec3 a = toFloat(random.direction());
        // Nearly parallel, where the ordinary formula has no digit left.
        const vec3 b = i & 1 ? make_vec3(a.x + 1e-6f, a.y, a.z - 1e-6f) : toFloat(random.direction());
        const vec3 c = cross3(a, b);
        const crt::Vec3d exact = cross(toDouble(a), toDouble(b));
        worst = std::max({worst, ulps(c.x, exact[0]), ulps(c.y, exact[1]), ulps(c.z, exact[2])});
    }
    CHECK(worst <= 1.5);
}

TEST_CASE("the next float up and down", "[kernel][math]") {
    Random random(4);
    std::vector<f32> numbers{0.0f,     -0.0f, FLT_TRUE_MIN, -FLT_TRUE_MIN, FLT_MIN,
                             -FLT_MIN, 1.0f,  -1.0f,        FLT_MAX,       -FLT_MAX};
    for (int i = 0; i < 100000; ++i) {
        const f32 x = crt_from_bits(static_cast<u32>(random.bits()));
        if (crt_is_finite(x)) numbers.push_back(x);
    }
    std::uint64_t wrong = 0;
    for (const f32 x : numbers) {
        wrong += crt_bits(crt_next_up(x)) != crt_bits(std::nextafter(x, HUGE_VALF));
        wrong += crt_bits(crt_next_down(x)) != crt_bits(std::nextafter(x, -HUGE_VALF));
    }
    CHECK(wrong == 0);
}

TEST_CASE("finite means finite", "[kernel][math]") {
    CHECK(crt_is_finite(0.0f));
    CHECK(crt_is_finite(FLT_MAX));
    CHECK(crt_is_finite(-FLT_TRUE_MIN));
    CHECK_FALSE(crt_is_finite(CRT_INFINITY));
    CHECK_FALSE(crt_is_finite(-CRT_INFINITY));
    CHECK_FALSE(crt_is_finite(std::nanf("")));
}

TEST_CASE("frames are orthonormal, right-handed, and carry z to the normal", "[kernel][math]") {
    Random random(5);
    std::vector<crt::Vec3d> normals{{0, 0, 1}, {0, 0, -1}, {1, 0, 0},   {-1, 0, 0},
                                    {0, 1, 0}, {0, -1, 0}, {1, 0, -0.0}};
    for (int i = 0; i < 300000; ++i) normals.push_back(random.direction());
    // Around −z, where older constructions lost their digits.
    for (int i = 0; i < 100000; ++i) {
        const double e = std::pow(10.0, random.uniform(-20, -1));
        normals.push_back(unit({e * random.uniform(-1, 1), e * random.uniform(-1, 1), -1}));
    }
    double worst = 0;
    for (const crt::Vec3d& normal : normals) {
        const vec3 n = toFloat(normal);
        const CrtFrame f = crt_frame(n);
        const crt::Vec3d s = toDouble(f.s), t = toDouble(f.t), m = toDouble(n),
                         handed = minus(cross(s, t), m);
        worst = std::max({worst, std::abs(dot(s, s) - 1), std::abs(dot(t, t) - 1), std::abs(dot(s, t)),
                          std::abs(dot(s, m)), std::abs(dot(t, m)), length(handed),
                          length(minus(toDouble(crt_to_world(f, make_vec3(0, 0, 1))), m))});
    }
    CHECK(worst < 4e-7);
}

TEST_CASE("the concentric map stays in the disk, is uniform, and keeps strata together", "[kernel][math]") {
    double farthest = 0;
    const auto at = [](f32 x, f32 y) {
        CrtRandom2 u;
        u.x = x;
        u.y = y;
        return crt_concentric_disk(u);
    };
    const f32 last = crt_unit(0xffffffffu), first = crt_unit(0);
    for (u32 i = 0; i < 1u << 16; ++i) {
        const f32 v = crt_unit(i << 16 | i);
        for (const CrtRandom2 p :
             {at(first, v), at(last, v), at(v, first), at(v, last), at(v, v), at(v, 1.0f - v)})
            farthest = std::max(farthest, static_cast<double>(p.x) * p.x + static_cast<double>(p.y) * p.y);
    }
    CHECK(farthest <= 1.0);
    CHECK(farthest > 1 - 1e-5);

    // 16 rings of equal area, 64 sectors.
    Random random(6);
    std::vector<std::uint64_t> bins(16 * 64);
    double largest_jump = 0;
    for (int i = 0; i < 1000000; ++i) {
        const CrtRandom2 u = random.pair();
        const CrtRandom2 p = crt_concentric_disk(u);
        const double r2 = static_cast<double>(p.x) * p.x + static_cast<double>(p.y) * p.y;
        const double turn = (std::atan2(p.y, p.x) + std::numbers::pi) / (2 * std::numbers::pi);
        ++bins[std::min<std::size_t>(15, static_cast<std::size_t>(r2 * 16)) * 64 +
               std::min<std::size_t>(63, static_cast<std::size_t>(turn * 64))];
        // Points 1e-4 apart in the square are at most a few 1e-4 apart in the disk.
        const CrtRandom2 q = at(std::min(u.x + 1e-4f, last), u.y);
        largest_jump = std::max<double>(largest_jump, std::hypot(q.x - p.x, q.y - p.y));
    }
    CHECK(std::abs(chiSquaredDeviate(bins)) < 4.4);
    CHECK(largest_jump < 4e-4);
    CHECK(at(0.5f, 0.5f).x == 0.0f);
    CHECK(at(0.5f, 0.5f).y == 0.0f);
}

TEST_CASE("long sums are exact, in any order", "[kernel][math]") {
    // Samples as a film gets them: floats over 60 binary orders. Their sum in integers of 2^-60 is exact.
    Random random(7);
    std::vector<double> values(200000);
    __int128 exact = 0;
    for (double& v : values) {
        v = randomFloat(random, -30, 29);
        exact += static_cast<__int128>(v * 0x1p60);
    }
    const auto sum = [&] {
        CrtSum s{0, 0};
        for (const double v : values) s = crt_sum_add(s, v);
        return s;
    };
    for (int order = 0; order < 3; ++order) {
        const CrtSum s = sum();
        CHECK((static_cast<__int128>(s.hi * 0x1p60) + static_cast<__int128>(s.lo * 0x1p60) == exact));
        std::shuffle(values.begin(), values.end(), std::mt19937(static_cast<unsigned>(order)));
    }
    // Doubles of full length: an error of some 2^-106 of the sum per addition.
    double magnitude = 0;
    exact = 0;
    values.resize(1000);
    for (double& v : values) {
        v = std::ldexp(static_cast<double>(random.bits() >> 11), -static_cast<int>(random.below(60)));
        exact += static_cast<__int128>(v * 0x1p60);
        magnitude += v;
    }
    const CrtSum s = sum();
    const __int128 error =
        static_cast<__int128>(s.hi * 0x1p60) + static_cast<__int128>(s.lo * 0x1p60) - exact;
    CHECK(std::abs(static_cast<double>(error)) * 0x1p-60 <= 1000 * 0x1p-106 * magnitude);
    // The loss of a plain sum.
    const CrtSum tiny = crt_sum_add(crt_sum_add(crt_sum_add(CrtSum{0, 0}, 1e16), 1.0), -1e16);
    CHECK(tiny.hi + tiny.lo == 1.0);
}
