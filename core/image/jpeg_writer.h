/// JPEG files by libjpeg. Part of the image module (image_module.h).
#pragma once

#include "image/image_module.h"

#include <cstdint>
#include <string>

namespace crt::image {

/// Writes 8-bit RGB that is encoded as sRGB, with quality 95 and colours in full resolution. Metadata become
/// comments, "name: text", as many as one marker holds each. Returns a sentence where it fails, else
/// nothing.
std::string writeJpeg(const char* path, std::uint32_t width, std::uint32_t height, const std::uint8_t* rgb,
                      const CrtImageText* metadata, std::uint32_t metadata_count);

}  // namespace crt::image
