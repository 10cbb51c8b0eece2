/// The orientation of an image that a camera stored. Part of the image module (image_module.h).
#pragma once

#include <cstdint>
#include <string_view>

namespace crt::image {

/// The orientation that a block of EXIF says, 1 (as the pixels lie) to 8; 0 where it says none, or the block
/// is damaged. `exif`: from the mark of its byte order on.
std::uint32_t exifOrientation(std::string_view exif);

}  // namespace crt::image
