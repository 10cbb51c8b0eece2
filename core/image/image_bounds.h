/// Limits on what the header of an image file may say, asked before anything is allocated. Part of the image
/// modules (image_module.h).
#pragma once

#include <cstdint>
#include <stdexcept>

namespace crt::image {

/// One sentence, "its attribute 'x' …", to follow the name of the file.
struct DamagedHeader : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// The most bytes that one byte of Deflate expands to: two bits repeat 258 bytes.
constexpr double kDeflateBytesAByte = 1032;

/// Throws DamagedHeader when pixels of `bytes` do not come out of a file that holds `most_bytes` at most.
void requireRoom(std::uint64_t width, std::uint64_t height, double bytes, double most_bytes);
/// Throws DamagedHeader when there are no pixels, or decoded they would take more than `most_bytes`.
void checkMemory(std::uint64_t width, std::uint64_t height, std::uint64_t bytes_a_pixel,
                 std::uint64_t most_bytes);
/// Rows that OpenImageIO reads at a time, into memory for as many however few the image has. (It takes no
/// fewer; left alone, it takes 256.)
inline constexpr std::uint64_t kStripRows = 64;
/// Throws DamagedHeader if this number of rows would take more than a gigabyte, and more than the image.
void checkRows(std::uint64_t width, std::uint64_t height, std::uint64_t bytes_a_pixel);
/// Throws DamagedHeader if a file holds far more channels than are read: all of them are decoded.
void checkChannels(std::uint64_t pixels, std::uint64_t bytes_a_pixel, std::uint64_t channels,
                   std::uint64_t bytes_read_a_pixel);

}  // namespace crt::image
