/// Pixels of PNG files by libdeflate, in half the time that libpng takes with zlib. Part of the image module
/// (image_module.h). Reads only files that are sound and of the common kinds; what is wrong with any other
/// one, and what its pixels are, libpng says (docs/decisions/0020).
#pragma once

#include "image/image_module.h"

#include <cstdint>
#include <string>

namespace crt::image {

/// Fills in the `buffer_bytes` of `buffer`, which are those that *info says. False where the file is left to
/// libpng; the buffer then holds anything. The file's header was checked (checkPngHeader), and libpng has
/// read its chunks up to the pixels.
bool readPng(const std::string& path, const CrtTexelsInfo& info, unsigned char* buffer,
             std::uint64_t buffer_bytes);

}  // namespace crt::image
