/// JPEG by libjpeg-turbo, within bounds. Part of the image module (image_module.h). Not by OpenImageIO,
/// whose reader hands the metadata of a file to parsers that did not stand fuzzing (docs/decisions/0005):
/// here they are skipped.
#pragma once

#include "image/image_module.h"

#include <cstdint>
#include <string>

namespace crt::image {

/// Fills in *info, and with a buffer of `buffer_bytes` the pixels, too. Returns why not; empty when all is
/// well. A file that ends early, or whose data are damaged, is refused.
std::string readJpeg(const char* path, CrtTexelsInfo* info, unsigned char* buffer,
                     std::uint64_t buffer_bytes);

}  // namespace crt::image
