// kernel/sampling/sampler.h: Philox against its authors' known answers, Sobol against its definition, and
// of all three samplers what an integrator counts on: uniform, never 0 or 1, and no dimension, pixel,
// sample or seed that knows of another.
#include "kernel_test.h"

#include <algorithm>
#include <functional>
#include <set>
#include <string>

using namespace kernel_test;

namespace {

constexpr u32 kKinds[] = {CRT_SAMPLER_SOBOL, CRT_SAMPLER_INDEPENDENT, CRT_SAMPLER_XORSHIFT};
const char* const kNames[] = {"sobol", "independent", "xorshift"};

CrtSampler begin(u32 kind, std::uint64_t seed, u32 pixel, u64 sample) {
    return crt_sampler_begin(kind, 0, crt_seed(static_cast<u32>(seed), static_cast<u32>(seed >> 32)), pixel,
                             sample);
}

CrtRandom2 draw2(u32 kind, std::uint64_t seed, u32 pixel, u64 sample, u32 dimension) {
    CrtSampler s = begin(kind, seed, pixel, sample);
    return crt_sample_2d(&s, dimension);
}

f32 draw1(u32 kind, std::uint64_t seed, u32 pixel, u64 sample, u32 dimension) {
    CrtSampler s = begin(kind, seed, pixel, sample);
    return crt_sample_1d(&s, dimension);
}

/// Correlation of two equally long series, times √n: a standard normal deviate when they are independent.
double correlation(const std::vector<double>& a, const std::vector<double>& b) {
    const auto n = static_cast<double>(a.size());
    double ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        ma += a[i] / n;
        mb += b[i] / n;
    }
    for (std::size_t i = 0; i < a.size(); ++i) {
        aa += (a[i] - ma) * (a[i] - ma);
        bb += (b[i] - mb) * (b[i] - mb);
        ab += (a[i] - ma) * (b[i] - mb);
    }
    return ab / std::sqrt(aa * bb) * std::sqrt(n);
}

/// 2^m points of the square from sample index `first`, a multiple of 2^m: does every elementary interval
/// hold exactly one?
bool isNet(u32 m, std::uint64_t seed, u32 pixel, u64 first, u32 dimension) {
    std::vector<CrtRandom2> points;
    for (u64 i = 0; i < (u64{1} << m); ++i)
        points.push_back(draw2(CRT_SAMPLER_SOBOL, seed, pixel, first + i, dimension));
    for (u32 a = 0; a <= m; ++a) {
        std::vector<bool> taken(points.size());
        for (const CrtRandom2& p : points) {
            const auto column =
                static_cast<std::size_t>(std::ldexp(static_cast<double>(p.x), static_cast<int>(a)));
            const auto row =
                static_cast<std::size_t>(std::ldexp(static_cast<double>(p.y), static_cast<int>(m - a)));
            const std::size_t cell = column << (m - a) | row;
            if (taken[cell]) return false;
            taken[cell] = true;
        }
    }
    return true;
}

}  // namespace

TEST_CASE("Philox 4x32-10 gives its authors' known answers", "[kernel][sampler]") {
    // Random123 1.14.0, tests/kat_vectors: counter, key, answer.
    const struct {
        u32 counter[4], key[2], answer[4];
    } known[] = {
        {{0, 0, 0, 0}, {0, 0}, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
        {{0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff},
         {0xffffffff, 0xffffffff},
         {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}},
        {{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344},
         {0xa4093822, 0x299f31d0},
         {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}},
    };
    for (const auto& k : known) {
        const CrtPhilox r =
            crt_philox(k.counter[0], k.counter[1], k.counter[2], k.counter[3], k.key[0], k.key[1]);
        CHECK(r.x0 == k.answer[0]);
        CHECK(r.x1 == k.answer[1]);
        CHECK(r.x2 == k.answer[2]);
        CHECK(r.x3 == k.answer[3]);
    }
}

TEST_CASE("the independent sampler is Philox of (pixel, sample, dimension) under the seed",
          "[kernel][sampler]") {
    const u32 pixel = 123456, seed_low = 7, seed_high = 9;
    const u64 sample = 0x500000003;
    CrtSampler s =
        crt_sampler_begin(CRT_SAMPLER_INDEPENDENT, 0, crt_seed(seed_low, seed_high), pixel, sample);
    // In any order, and again: nothing is used up.
    for (const u32 dimension : {0u, 1u, 6u, 7u, 6u, 0u, 4000000000u, 1u}) {
        const CrtPhilox r = crt_philox(pixel, 3, 5, dimension / 2, seed_low, seed_high);
        const CrtRandom2 u = crt_sample_2d(&s, dimension);
        CHECK(u.x == crt_unit(dimension % 2 ? r.x2 : r.x0));
        CHECK(u.y == crt_unit(dimension % 2 ? r.x3 : r.x1));
        CHECK(crt_sample_bits(&s, dimension) == (dimension % 2 ? r.x2 : r.x0));
    }
}

TEST_CASE("Sobol's second dimension is the Sobol sequence", "[kernel][sampler]") {
    // Direction numbers from the primitive polynomial x + 1 (Sobol' 1967): v₁ = ½, vᵢ = vᵢ₋₁ ⊕
    // vᵢ₋₁/2.
    u32 direction[32];
    direction[0] = 1u << 31;
    for (int i = 1; i < 32; ++i) direction[i] = direction[i - 1] ^ (direction[i - 1] >> 1);
    Random random(11);
    std::uint64_t wrong = 0;
    for (u32 n = 0; n < 200000; ++n) {
        const u32 index = n < 100000 ? n : static_cast<u32>(random.bits());
        u32 value = 0;
        for (int i = 0; i < 32; ++i)
            if (index >> i & 1) value ^= direction[i];
        wrong += crt_reverse_bits(crt_sobol1_reversed(index)) != value;
    }
    CHECK(wrong == 0);
}

TEST_CASE("Owen scrambling flips each bit by the bits above it alone", "[kernel][sampler]") {
    // On reversed numbers: the low k bits of the result are a bijection of the low k bits of the argument.
    Random random(12);
    for (int i = 0; i < 50; ++i) {
        const u32 seed = static_cast<u32>(random.bits());
        std::set<u32> images;
        for (u32 x = 0; x < 256; ++x) {
            const u32 y = crt_owen_reversed(x, seed) & 255u;
            images.insert(y);
            CHECK((crt_owen_reversed(x | static_cast<u32>(random.bits()) << 8, seed) & 255u) == y);
        }
        CHECK(images.size() == 256);
    }
}

TEST_CASE("Sobol points fill every elementary interval, in every dimension, pixel, seed and aligned range",
          "[kernel][sampler]") {
    Random random(13);
    std::uint64_t nets = 0;
    for (int i = 0; i < 150; ++i) {
        const std::uint64_t seed = i < 3 ? static_cast<std::uint64_t>(i) : random.bits();
        const u32 pixel = i < 20 ? static_cast<u32>(i) : static_cast<u32>(random.bits());
        const u32 dimension = static_cast<u32>(i < 40 ? i : random.bits());
        for (u32 m = 0; m <= 8; ++m) {
            const u64 first = (i % 3 == 0 ? 0 : random.bits() >> (i % 3 == 1 ? 40 : 4)) >> m << m;
            nets += isNet(m, seed, pixel, first, dimension);
        }
    }
    CHECK(nets == 150 * 9);
    CHECK(isNet(14, 0, 0, 0, 0));
    CHECK(isNet(14, 5, 77, u64{1} << 40, 5));
    // One dimension alone is as stratified as the pair's first.
    CHECK(draw1(CRT_SAMPLER_SOBOL, 3, 4, 5, 6) == draw2(CRT_SAMPLER_SOBOL, 3, 4, 5, 6).x);
}

TEST_CASE("Sobol integrates a smooth function far better than chance", "[kernel][sampler]") {
    // x²·sin(πy) over the square is 2/(3π). Of 1024 points, independent ones err by .34/32 (rms), Owen's
    // nets by some 100 times less.
    Mean squared;
    for (u32 pixel = 0; pixel < 200; ++pixel) {
        double sum = 0;
        for (u64 i = 0; i < 1024; ++i) {
            const CrtRandom2 u = draw2(CRT_SAMPLER_SOBOL, 1, pixel, i, 2);
            sum += static_cast<double>(u.x) * u.x * std::sin(3.14159265358979323846 * u.y);
        }
        const double error = sum / 1024 - 2 / (3 * 3.14159265358979323846);
        squared.add(error * error);
    }
    CHECK(std::sqrt(squared.mean()) < 2e-4);
}

TEST_CASE("Sobol numbers of two dimensions are stratified together", "[kernel][sampler]") {
    // 16 x y z w over the cube is 1; of 1024 independent points the estimate errs by 1.47/32 (rms). Of two
    // nets that know nothing of each other it errs by .78/32: (4 x y - 1)(4 z w - 1) has a variance of
    // (7/9)².
    const auto error = [](u32 first, u32 second) {
        Mean squared;
        for (u32 pixel = 0; pixel < 100; ++pixel) {
            double sum = 0;
            for (u64 i = 0; i < 1024; ++i) {
                const CrtRandom2 u = draw2(CRT_SAMPLER_SOBOL, 1, pixel, i, first);
                const CrtRandom2 v = draw2(CRT_SAMPLER_SOBOL, 1, pixel, i, second);
                sum += 16.0 * u.x * u.y * v.x * v.y;
            }
            squared.add((sum / 1024 - 1) * (sum / 1024 - 1));
        }
        return 32 * std::sqrt(squared.mean());
    };
    CHECK(error(1000, 1001) > 0.6);  // far along the path
    const auto vertex = [](u32 depth, u32 dimension) { return crt_vertex_dimension(depth) + dimension; };
    const u32 together[][2] = {
        {CRT_DIM_FILM, vertex(0, CRT_DIM_LIGHT)},
        {CRT_DIM_FILM, vertex(0, CRT_DIM_BSDF)},
        {CRT_DIM_FILM, CRT_DIM_LENS},
        {vertex(0, CRT_DIM_LIGHT), vertex(0, CRT_DIM_BSDF)},
        {vertex(0, CRT_DIM_BSDF), vertex(0, CRT_DIM_CHOICE)},
        {vertex(0, CRT_DIM_BSDF), vertex(1, CRT_DIM_LIGHT)},
        {vertex(0, CRT_DIM_BSDF), vertex(1, CRT_DIM_BSDF)},
        {vertex(1, CRT_DIM_BSDF), vertex(2, CRT_DIM_LIGHT)},
        {vertex(2, CRT_DIM_BSDF), vertex(3, CRT_DIM_LIGHT)},
    };
    for (const auto& [first, second] : together) {
        INFO(first << " and " << second);
        CHECK(error(first, second) < 0.78 / 2);
    }
}

TEST_CASE("each bit of a shuffled index depends on bits from there on", "[kernel][sampler]") {
    CrtSampler s = begin(CRT_SAMPLER_SOBOL, 0, 0, 0);
    for (u32 dimension = 0; dimension < CRT_SHUFFLED_DIMENSIONS; ++dimension)
        for (u32 bit = 0; bit < 32; ++bit) {
            s.index = 1u << bit;
            const u32 column = crt_shuffled_index(&s, dimension, 0);
            INFO(dimension << ", bit " << bit);
            CHECK(column >> bit == 1);  // the bit itself, and none above
        }
}

TEST_CASE("numbers lie strictly between 0 and 1", "[kernel][sampler]") {
    CHECK(crt_unit(0) == 0x1p-24f);
    CHECK(crt_unit(0xffffffffu) == 1 - 0x1p-24f);
    CHECK(crt_unit(0x1ff) == crt_unit(0));
    CHECK(crt_unit(0x200) == 0x1p-24f + 0x1p-23f);
    for (const u32 kind : kKinds) {
        f32 lowest = 1, highest = 0;
        for (u32 i = 0; i < 200000; ++i) {
            CrtSampler s = begin(kind, 1, i, i);
            for (u32 d = 0; d < 3; ++d) {
                const CrtRandom2 u = crt_sample_2d(&s, d);
                lowest = std::min({lowest, u.x, u.y});
                highest = std::max({highest, u.x, u.y});
            }
        }
        INFO(kNames[kind]);
        CHECK(lowest > 0);
        CHECK(highest < 1);
        CHECK(lowest < 1e-5);
        CHECK(highest > 1 - 1e-5);
    }
}

TEST_CASE("each number is uniform over pixels, samples, seeds and dimensions", "[kernel][sampler]") {
    const std::pair<const char*, std::function<CrtRandom2(u32, u32)>> walks[] = {
        {"pixels", [](u32 kind, u32 i) { return draw2(kind, 0, i, 0, 0); }},
        {"rows", [](u32 kind, u32 i) { return draw2(kind, 0, i * 1024, 5, 1); }},
        {"seeds", [](u32 kind, u32 i) { return draw2(kind, i, 0, 0, 0); }},
        {"high halves of seeds",
         [](u32 kind, u32 i) { return draw2(kind, static_cast<std::uint64_t>(i) << 32, 9, 1, 0); }},
        {"high halves of samples",
         [](u32 kind, u32 i) { return draw2(kind, 0, 3, static_cast<u64>(i) << 32, 0); }},
    };
    for (const u32 kind : kKinds)
        for (const auto& [what, draw] : walks) {
            std::vector<std::uint64_t> square(32 * 32), fine(4096);
            Mean x, xx;
            for (u32 i = 0; i < 200000; ++i) {
                const CrtRandom2 u = draw(kind, i);
                ++square[static_cast<std::size_t>(u.x * 32) * 32 + static_cast<std::size_t>(u.y * 32)];
                ++fine[static_cast<std::size_t>(u.x * 4096)];
                x.add(u.x);
                xx.add((u.x - 0.5) * (u.x - 0.5));
            }
            INFO(kNames[kind] << " over " << what);
            CHECK(std::abs(chiSquaredDeviate(square)) < 4.4);
            CHECK(std::abs(chiSquaredDeviate(fine)) < 4.4);
            CHECK(std::abs(x.deviate(0.5)) < 4.4);
            CHECK(std::abs(xx.deviate(1.0 / 12)) < 4.4);
        }
    // Samples of one pixel: those of a low-discrepancy sequence are too even for chi-squared by intent.
    for (const u32 kind : {CRT_SAMPLER_INDEPENDENT, CRT_SAMPLER_XORSHIFT}) {
        std::vector<std::uint64_t> square(32 * 32);
        for (u64 i = 0; i < 200000; ++i) {
            const CrtRandom2 u = draw2(kind, 0, 0, i, 0);
            ++square[static_cast<std::size_t>(u.x * 32) * 32 + static_cast<std::size_t>(u.y * 32)];
        }
        INFO(kNames[kind]);
        CHECK(std::abs(chiSquaredDeviate(square)) < 4.4);
    }
    // Dimensions of one sample.
    for (const u32 kind : kKinds) {
        CrtSampler s = begin(kind, 0, 0, 0);
        std::vector<std::uint64_t> square(32 * 32);
        for (u32 d = 0; d < 200000; ++d) {
            const CrtRandom2 u = crt_sample_2d(&s, d);
            ++square[static_cast<std::size_t>(u.x * 32) * 32 + static_cast<std::size_t>(u.y * 32)];
        }
        INFO(kNames[kind]);
        CHECK(std::abs(chiSquaredDeviate(square)) < 4.4);
    }
}

TEST_CASE("dimensions know nothing of each other", "[kernel][sampler]") {
    constexpr u32 kDimensions = 20, kSamples = 4096;
    for (const u32 kind : kKinds) {
        std::vector<std::vector<double>> series(2 * kDimensions);
        for (u32 i = 0; i < kSamples; ++i) {
            CrtSampler s = begin(kind, 42, 17, i);
            for (u32 d = 0; d < kDimensions; ++d) {
                const CrtRandom2 u = crt_sample_2d(&s, d);
                series[2 * d].push_back(u.x);
                series[2 * d + 1].push_back(u.y);
            }
        }
        double worst = 0;
        for (std::size_t a = 0; a < series.size(); ++a)
            for (std::size_t b = 0; b < a; ++b)
                worst = std::max(worst, std::abs(correlation(series[a], series[b])));
        INFO(kNames[kind]);
        CHECK(worst < 4.8);  // of 780 pairs
    }
}

TEST_CASE("neighbouring pixels, samples and seeds know nothing of each other", "[kernel][sampler]") {
    constexpr u32 kCount = 100000;
    const std::pair<const char*, std::function<f32(u32, u32, u32)>> neighbours[] = {
        {"pixels", [](u32 kind, u32 i, u32 step) { return draw1(kind, 0, i * 2 + step, 0, 0); }},
        {"rows of 512", [](u32 kind, u32 i, u32 step) { return draw1(kind, 0, i + 512 * step, 3, 0); }},
        {"seeds", [](u32 kind, u32 i, u32 step) { return draw1(kind, i * 2 + step, 5, 0, 0); }},
        {"seeds, seen by one pixel after another",
         [](u32 kind, u32 i, u32 step) { return draw1(kind, step, i, 0, 0); }},
        {"seeds in the high half",
         [](u32 kind, u32 i, u32 step) {
             return draw1(kind, static_cast<std::uint64_t>(step) << 32, i, 0, 0);
         }},
        {"2^32 samples apart",
         [](u32 kind, u32 i, u32 step) { return draw1(kind, 0, 8, i + (static_cast<u64>(step) << 32), 0); }},
    };
    for (const u32 kind : kKinds)
        for (const auto& [what, draw] : neighbours) {
            std::vector<double> a, b;
            for (u32 i = 0; i < kCount; ++i) {
                a.push_back(draw(kind, i, 0));
                b.push_back(draw(kind, i, 1));
            }
            INFO(kNames[kind] << ": " << what);
            CHECK(std::abs(correlation(a, b)) < 4.4);
        }
    // One sample and the next. Sobol's are anticorrelated: stratified.
    for (const u32 kind : {CRT_SAMPLER_INDEPENDENT, CRT_SAMPLER_XORSHIFT}) {
        std::vector<double> a, b;
        for (u32 i = 0; i < kCount; ++i) {
            a.push_back(draw1(kind, 0, 8, 2 * i, 0));
            b.push_back(draw1(kind, 0, 8, 2 * i + 1, 0));
        }
        INFO(kNames[kind]);
        CHECK(std::abs(correlation(a, b)) < 4.4);
    }
}

TEST_CASE("whatever names a number changes it", "[kernel][sampler]") {
    for (const u32 kind : kKinds) {
        INFO(kNames[kind]);
        std::uint64_t equal = 0;
        for (u32 bit = 0; bit < 64; ++bit) {
            const std::uint64_t flip = std::uint64_t{1} << bit;
            for (u32 d = 0; d < 8; ++d) {
                const f32 x = draw1(kind, 77, 1000, 55, d);
                equal += draw1(kind, 77 ^ flip, 1000, 55, d) == x;
                equal += draw1(kind, 77, 1000, 55 ^ flip, d) == x;
                if (bit < 32) equal += draw1(kind, 77, 1000 ^ static_cast<u32>(flip), 55, d) == x;
            }
        }
        CHECK(equal == 0);  // one of 8 million by chance
    }
}

TEST_CASE("xorshift is well seeded and never stuck", "[kernel][sampler]") {
    // Its hash reaches 0, the one state that xorshift never leaves, where the low half of the index meets
    // this value.
    const u32 key = crt_pixel_key(crt_seed(6, 7), 5, 0);
    const u32 low = key ^ unhash(0u - crt_hash(key + 0x85ebca6bu));
    CHECK(crt_hash(crt_hash(low ^ key) + crt_hash(key + 0x85ebca6bu)) == 0);
    CrtSampler stuck = crt_sampler_begin(CRT_SAMPLER_XORSHIFT, 0, crt_seed(6, 7), 5, low);
    CHECK(stuck.b0 == 0x6c078965u);
    CHECK(stuck.b0 != 0);
    CHECK(crt_sample_1d(&stuck, 0) != crt_sample_1d(&stuck, 0));
    // Marsaglia 2003, "Xorshift RNGs": from y = 2463534242 by 13, 17, 5 follows 723471715.
    CrtSampler s = crt_sampler_begin(CRT_SAMPLER_XORSHIFT, 0, crt_seed(0, 0), 0, 0);
    s.b0 = 2463534242u;
    CHECK(crt_xorshift(&s) == 723471715u);
    // Seeds 1 … 1024 used as they are have a mean of .03; hashed, ½ ± 1/√(12n).
    Mean first;
    for (u32 i = 0; i < 1024; ++i) first.add(draw1(CRT_SAMPLER_XORSHIFT, 0, i, 0, 0));
    CHECK(std::abs(first.deviate(0.5)) < 4.4);
}

TEST_CASE("bits are reversed", "[kernel][sampler]") {
    for (u32 i = 0; i < 32; ++i) CHECK(crt_reverse_bits(1u << i) == 1u << (31 - i));
    CHECK(crt_reverse_bits(0x12345678u) == 0x1e6a2c48u);
    CHECK(crt_mulhi(0xffffffffu, 0xffffffffu) == 0xfffffffeu);
}
