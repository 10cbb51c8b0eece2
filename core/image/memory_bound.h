/// Limits the memory that the pixels of an image may take. In a header, for crt and its image module.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>

namespace crt {

/// Reason why an image's pixels, of `bytes_a_pixel` each, are too large for `most_bytes`, which is half of
/// the free memory; empty if they are not.
inline std::string refusalForMemory(std::uint64_t width, std::uint64_t height, std::uint64_t bytes_a_pixel,
                                    std::uint64_t most_bytes) {
    constexpr double kGigabyte = 1e9;
    const double bytes =
        static_cast<double>(width) * static_cast<double>(height) * static_cast<double>(bytes_a_pixel);
    if (bytes <= static_cast<double>(most_bytes)) return {};
    return fmt::format(
        "its {} x {} pixels take {:.2f} GB of memory, and at most {:.2f} GB, half of what is free, may be "
        "used "
        "for them; make the image smaller, or free memory",
        width, height, bytes / kGigabyte, static_cast<double>(most_bytes) / kGigabyte);
}

}  // namespace crt
