/// The pattern that the backend `fake` renders, so that a test can predict a film without a kernel.
#pragma once

#include <cstdint>

namespace crt::fake {

/// Channels of the film, as in kernel/dialect/layout.h.
enum Channel : std::uint32_t { kX = 0, kY = 1, kZ = 2, kYSquared = 3 };

/// A multiple of 2^-24 in [0,1), different for every argument: sums of fewer than 2^29 of them are exact in
/// a double.
inline double noise(std::uint64_t seed, std::uint32_t x, std::uint32_t y, std::uint64_t sample,
                    std::uint32_t channel) {
    std::uint64_t h = seed;
    for (const std::uint64_t v : {std::uint64_t{x}, std::uint64_t{y}, sample, std::uint64_t{channel}}) {
        // The finaliser of splitmix64 (Steele, Lea and Flood 2014).
        h += v + 0x9e3779b97f4a7c15ull;
        h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9ull;
        h = (h ^ (h >> 27)) * 0x94d049bb133111ebull;
        h ^= h >> 31;
    }
    return static_cast<double>(h >> 40) * 0x1p-24;
}

/// The value of one sample. `x` and `y` are pixels of the whole film, so that a crop shows a part of the
/// same picture.
inline double sampleValue(std::uint64_t seed, std::uint32_t x, std::uint32_t y, std::uint64_t sample,
                          std::uint32_t channel) {
    if (channel == kYSquared) {
        const double luminance = noise(seed, x, y, sample, kY);
        return luminance * luminance;
    }
    return noise(seed, x, y, sample, channel);
}

inline std::uint32_t primitiveAt(std::uint32_t x, std::uint32_t y) {
    return x == y ? 0xffffffffu : x + 1000 * y;
}

/// Samples that are not a number, and so neither summed nor counted, under CRT_FAKE_FAULT=nan.
inline bool isInvalid(std::uint32_t x, std::uint32_t y, std::uint64_t sample) {
    return (x + 3 * std::uint64_t{y} + sample) % 7 == 0;
}

}  // namespace crt::fake
