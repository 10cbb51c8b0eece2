/// Chooses the number of films that a launch adds to. A launch of few pixels and many samples leaves a GPU
/// partly idle; with its samples divided between slices, each with a separate film, it fills the device. The
/// sums of all slices give the same film (core/film/film.h).
#pragma once

#include <algorithm>
#include <cstdint>

namespace crt::gpu {

inline std::uint64_t divideUp(std::uint64_t a, std::uint64_t b) { return (a + b - 1) / b; }

/// A launch fills the device this number of times: its idle end, half a filling on average, is then short.
inline constexpr std::uint64_t kFillings = 16;
/// The same of a wave, whose passes each end idle.
inline constexpr std::uint64_t kWaveFillings = 64;

/// The number of parts, each with a separate film, into which a launch of `blocks` blocks should divide its
/// samples so that a device that holds `resident_blocks` at once is filled this number of times. At most
/// `most`.
inline std::uint32_t chooseSlices(std::uint64_t blocks, std::uint64_t resident_blocks,
                                  std::uint64_t fillings, std::uint32_t samples, std::uint64_t most) {
    // A thread's paths should outweigh its start and its share of crt_add_slices, unless that leaves the
    // device empty.
    const std::uint64_t least_samples = blocks < resident_blocks ? 1 : 8;
    const std::uint64_t wanted = divideUp(fillings * resident_blocks, std::max<std::uint64_t>(blocks, 1));
    constexpr std::uint64_t kGridRows = 65535;
    return static_cast<std::uint32_t>(
        std::max<std::uint64_t>(1, std::min({wanted, samples / least_samples, most, kGridRows})));
}

/// Bytes that films of slices may take on a device with this memory in total and this much of it free.
inline std::uint64_t sliceBudget(std::uint64_t device_bytes, std::uint64_t free_bytes) {
    constexpr std::uint64_t kMostBytes = std::uint64_t{512} << 20;
    constexpr std::uint64_t kShareOfDevice = 16, kShareOfFree = 2;
    return std::min({kMostBytes, device_bytes / kShareOfDevice, free_bytes / kShareOfFree});
}

}  // namespace crt::gpu
