// Seeds are independent: no two of them give one set of random numbers to a film, however their pixels are
// exchanged. A set is known by its keys, of which each names one scrambled sequence; the keys of a seed are
// a bijection of the pixels, so that one key alone tells where in the other seed's film it would be.
#include "kernel_test.h"

#include <algorithm>
#include <functional>
#include <string>

using namespace kernel_test;

namespace {

struct Words {
    u32 first, second;
    bool operator==(const Words&) const = default;
};

/// A way to make the keys of a film's pixels from a seed, and where in the film a key is.
struct Definition {
    std::function<Words(std::uint64_t seed)> words;
    std::function<u32(Words, u32 pixel)> key;
    std::function<u32(Words, u32 key)> pixel;
};

Words wordsOf(std::uint64_t seed) {
    const CrtSeed s = crt_seed(static_cast<u32>(seed), static_cast<u32>(seed >> 32));
    return {s.first, s.second};
}

/// crt's keys of the first sequence.
u32 keyOf(Words seed, u32 pixel) { return crt_pixel_key({0, 0, seed.first, seed.second}, pixel, 0); }
u32 pixelOf(Words seed, u32 key) { return unhash(unhash(key) - seed.second) ^ seed.first; }

/// One word alone, before the hash: what crt had, and what these tests are to find.
Words oneWordOf(std::uint64_t seed) {
    const u32 low = static_cast<u32>(seed), high = static_cast<u32>(seed >> 32);
    return {crt_hash(low ^ crt_hash(high ^ crt_hash(0x632be5abu))), 0};
}
u32 oneWordKey(Words seed, u32 pixel) { return crt_hash(pixel ^ seed.first); }
u32 oneWordPixel(Words seed, u32 key) { return unhash(key) ^ seed.first; }

/// 0 … 9999, and 64-bit seeds that differ in their high words alone.
std::vector<std::uint64_t> manySeeds() {
    std::vector<std::uint64_t> seeds;
    for (std::uint64_t i = 0; i < 10000; ++i) seeds.push_back(i);
    for (std::uint64_t i = 1; i <= 1000; ++i)
        for (const std::uint64_t low : {0ull, 7ull, 0x9e3779b9ull}) seeds.push_back(i << 32 | low);
    return seeds;
}

/// Pairs of seeds whose films of 2^log2_pixels pixels have the same keys, in any order. Of keys that have
/// nothing to do with each other one in 2^(32 − log2_pixels) is in the other film by chance; four of eight
/// are in one pair of 2^30 or less.
template <class Pixel, class Key>
std::uint64_t pairsThatShare(const std::vector<std::uint64_t>& seeds, u32 log2_pixels,
                             Words (*words)(std::uint64_t), Key key, Pixel pixel) {
    constexpr u32 kProbes = 8, kShared = 4;
    std::vector<Words> of_seed;
    for (const std::uint64_t seed : seeds) of_seed.push_back(words(seed));
    std::uint64_t pairs = 0;
    for (const Words& a : of_seed) {
        u32 keys[kProbes];
        for (u32 i = 0; i < kProbes; ++i) keys[i] = key(a, i * ((1u << log2_pixels) / kProbes) + i);
        for (const Words& b : of_seed) {
            if (&b == &a) break;
            u32 shared = 0;
            for (u32 i = 0; i < kProbes && shared + kProbes - i >= kShared; ++i)
                shared += pixel(b, keys[i]) >> log2_pixels == 0;
            pairs += shared >= kShared;
        }
    }
    return pairs;
}

/// Number of the sorted numbers that are in both.
std::size_t common(const std::vector<u32>& a, const std::vector<u32>& b) {
    std::vector<u32> both;
    std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(both));
    return both.size();
}

}  // namespace

TEST_CASE("no two of 13,000 seeds give the same random numbers to a film of 2^21 pixels",
          "[kernel][sampler]") {
    const std::vector<std::uint64_t> seeds = manySeeds();
    // The sampler's keys are these.
    Random random(31);
    for (int i = 0; i < 1000; ++i) {
        const std::uint64_t seed = i < 500 ? random.bits() : seeds[random.below(13000)];
        const u32 pixel = static_cast<u32>(random.bits());
        const CrtSampler s = crt_sampler_begin(
            CRT_SAMPLER_SOBOL, 0, crt_seed(static_cast<u32>(seed), static_cast<u32>(seed >> 32)), pixel, 5);
        CHECK(s.pixel_key == keyOf(wordsOf(seed), pixel));
        CHECK(pixelOf(wordsOf(seed), s.pixel_key) == pixel);
    }
    CHECK(pairsThatShare(seeds, 21, wordsOf, keyOf, pixelOf) == 0);
    // With one word the test finds the pairs that gave one mean: of 10,000 seeds some 24,000 pairs, 178 and
    // 804 among them.
    CHECK(pairsThatShare({178, 804}, 20, oneWordOf, oneWordKey, oneWordPixel) == 1);
    CHECK(pairsThatShare(std::vector(seeds.begin(), seeds.begin() + 10000), 21, oneWordOf, oneWordKey,
                         oneWordPixel) > 20000);
}

TEST_CASE("a seed's two words are a bijection of its 64 bits", "[kernel][sampler]") {
    const auto seedOf = [](Words w) {
        w.first ^= crt_hash(w.second + 0xc2b2ae35u);
        const u32 high = w.second ^ crt_hash(w.first + 0x85ebca6bu);
        return std::uint64_t{high} << 32 | (w.first ^ crt_hash(high + 0x9e3779b9u));
    };
    Random random(32);
    for (const std::uint64_t seed : manySeeds()) REQUIRE(seedOf(wordsOf(seed)) == seed);
    for (int i = 0; i < 100000; ++i) {
        const std::uint64_t seed = random.bits();
        REQUIRE(seedOf(wordsOf(seed)) == seed);
    }
}

TEST_CASE("no replicate of one seed is a replicate of another", "[kernel][sampler]") {
    // Sequences shift the second word by multiples of a constant: seeds whose second words differ by one of
    // those, and whose first words differ in the pixels' bits alone, would share all but one of theirs.
    std::vector<Words> words;
    for (const std::uint64_t seed : manySeeds()) words.push_back(wordsOf(seed));
    std::sort(words.begin(), words.end(),
              [](const Words& a, const Words& b) { return a.second < b.second; });
    std::uint64_t shared = 0;
    for (u32 step = 0; step < CRT_REPLICATES_MAX; ++step)
        for (const Words& w : words) {
            const u32 wanted = w.second + step * 0x9e3779b9u;
            const auto at = std::lower_bound(words.begin(), words.end(), wanted,
                                             [](const Words& a, u32 v) { return a.second < v; });
            for (auto other = at; other != words.end() && other->second == wanted; ++other)
                shared += !(*other == w) && (other->first ^ w.first) >> 21 == 0;
        }
    CHECK(shared == 0);
}

TEST_CASE("xorshift's streams of two seeds meet by chance alone", "[kernel][sampler]") {
    // 2^20 of 2^32 each: 256 keys in common by chance, and 256 states of other keys, with a standard
    // deviation of 23. With one word, seeds 178 and 804 had all.
    const auto states = [](std::uint64_t seed) {
        std::vector<u32> found(1u << 20);
        for (u32 pixel = 0; pixel < found.size(); ++pixel)
            found[pixel] =
                crt_sampler_begin(CRT_SAMPLER_XORSHIFT, 0,
                                  crt_seed(static_cast<u32>(seed), static_cast<u32>(seed >> 32)), pixel, 3)
                    .b0;
        std::sort(found.begin(), found.end());
        return found;
    };
    for (const auto& [a, b] :
         {std::pair<std::uint64_t, std::uint64_t>{178, 804}, {0, 1}, {7, 7 + (std::uint64_t{1} << 32)}}) {
        CAPTURE(a, b);
        CHECK(common(states(a), states(b)) < 640);
    }
}
