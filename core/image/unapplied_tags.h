/// Tags of an image file that would change its pixels and that crt does not apply.
#pragma once

#include "image/image_module.h"

#include <string>
#include <vector>

namespace crt {

/// The use of an image's pixels.
enum class PixelUse {
    Numbers,        ///< Numbers and normals, which have no colour.
    LinearColors,   ///< Colours proportional to light, or fractions of it.
    EncodedColors,  ///< Colours whose codes are read as sRGB.
};

/// A sentence for each of them that would change the picture.
std::vector<std::string> sentencesOf(const CrtUnappliedTags& tags, const std::string& path, PixelUse use);

}  // namespace crt
