/// Headers of EXR and PNG files, walked before their libraries see them: both allocate what a damaged file says, up to gigabytes for each attribute or
/// chunk, and learn only then that the file ends. Part of the image module (image_module.h).
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace crt::image {

/// One sentence, "its attribute 'x' …", for whoever named the file.
struct DamagedHeader : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Throws DamagedHeader unless attributes have the sizes that their types say and lie within the file, and its pixels may.
void checkExrHeader(const std::string& path);
/// Throws DamagedHeader unless every chunk lies within the file.
void checkPngHeader(const std::string& path);
/// Throws DamagedHeader when the file cannot hold as many pixels.
void checkPixels(const std::string& path, std::uint64_t width, std::uint64_t height, std::uint64_t channels);
/// Throws DamagedHeader when one strip of rows would take more than a gigabyte and more than the image: OpenEXR and OpenImageIO allocate whole
/// strips, the latter of 64 rows where the format has none, however few rows the image has.
void checkRows(std::uint64_t width, std::uint64_t height, std::uint64_t bytes_a_pixel, std::uint64_t rows_a_strip = 64);

}  // namespace crt::image
