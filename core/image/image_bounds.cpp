#include "image/image_bounds.h"

#include "image/memory_bound.h"

#include <fmt/format.h>

#include <algorithm>

namespace crt::image {

void requireRoom(std::uint64_t width, std::uint64_t height, double bytes, double most_bytes) {
    if (bytes > most_bytes)
        throw DamagedHeader(fmt::format(
            "its header says {} x {} pixels, more than a file of its size can hold", width, height));
}

void checkMemory(std::uint64_t width, std::uint64_t height, std::uint64_t bytes_a_pixel,
                 std::uint64_t most_bytes) {
    if (width == 0 || height == 0) throw DamagedHeader("its header says that it has no pixels");
    const std::string why = refusalForMemory(width, height, bytes_a_pixel, most_bytes);
    if (!why.empty()) throw DamagedHeader(why);
}

void checkRows(std::uint64_t width, std::uint64_t height, std::uint64_t bytes_a_pixel) {
    constexpr double kMostBytes =
        1 << 30;  // 64 rows of 65,535 pixels, the widest film, with 64 channels of floats
    const double row_bytes = static_cast<double>(width) * static_cast<double>(bytes_a_pixel);
    if (row_bytes * static_cast<double>(kStripRows) >
        std::max(kMostBytes, row_bytes * static_cast<double>(height)))
        throw DamagedHeader(fmt::format("its rows of {} pixels are longer than can be read", width));
}

void checkChannels(std::uint64_t pixels, std::uint64_t bytes_a_pixel, std::uint64_t channels,
                   std::uint64_t bytes_read_a_pixel) {
    constexpr std::uint64_t kMostTimes = 64, kAlwaysBytes = std::uint64_t{1} << 30;
    if (bytes_a_pixel > kMostTimes * bytes_read_a_pixel && bytes_a_pixel * pixels > kAlwaysBytes)
        throw DamagedHeader(
            fmt::format("it has {} channels, and all of them are decoded to read some; above {} GiB of "
                        "pixels it may hold {} times what is read; write the channels that are needed into "
                        "a separate file",
                        channels, kAlwaysBytes >> 30, kMostTimes));
}

}  // namespace crt::image
