/// Truevision TGA, within bounds. Part of the image module (image_module.h). Not by OpenImageIO: the format
/// is two pages, and these lines are fuzzed.
#pragma once

#include "image/module_support.h"

#include <cstdint>
#include <string>

namespace crt::image {

/// True if the file begins as a TGA does. The format has no signature: its kind, depth and colour map must
/// agree. Ask after all formats that have one.
bool beginsAsTga(const char* path);

/// Fills in *info, and with a buffer of `buffer_bytes` the pixels, too. Returns why not; empty when all is
/// well. A file that ends early, or whose runs do not fit, is refused.
std::string readTga(const char* path, TexelPart part, CrtTexelsInfo* info, unsigned char* buffer,
                    std::uint64_t buffer_bytes);

}  // namespace crt::image
