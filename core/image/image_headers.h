/// Headers of EXR and PNG files, walked before their libraries see them: both allocate what a damaged file
/// says, up to gigabytes for each attribute or chunk, and learn only then that the file ends. Part of the
/// image module (image_module.h).
#pragma once

#include "image/image_module.h"

#include <cstdint>
#include <stdexcept>
#include <string>

namespace crt::image {

/// One sentence, "its attribute 'x' …", to follow the name of the file.
struct DamagedHeader : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Throws DamagedHeader unless attributes have the sizes that their types say and lie within the file, and
/// its pixels may.
void checkExrHeader(const std::string& path);
/// Throws DamagedHeader unless every chunk lies within the file, and its pixels may.
void checkPngHeader(const std::string& path);
/// The tags in the chunks of a PNG that checkPngHeader() has checked.
CrtUnappliedTags tagsOfPng(const std::string& path);
/// Throws DamagedHeader when there are no pixels, or decoded they would take more than `most_bytes`.
void checkMemory(std::uint64_t width, std::uint64_t height, std::uint64_t bytes_a_pixel,
                 std::uint64_t most_bytes);
/// Rows that OpenImageIO reads at a time, into memory for as many however few the image has. (It takes no
/// fewer; left alone, it takes 256.)
inline constexpr std::uint64_t kStripRows = 64;
/// Throws DamagedHeader if this number of rows would take more than a gigabyte, and more than the image.
void checkRows(std::uint64_t width, std::uint64_t height, std::uint64_t bytes_a_pixel);

/// Throws DamagedHeader if a file holds far more channels than are read: OpenEXR decodes all of them.
void checkChannels(std::uint64_t pixels, std::uint64_t bytes_a_pixel, std::uint64_t channels,
                   std::uint64_t bytes_read_a_pixel);

}  // namespace crt::image
