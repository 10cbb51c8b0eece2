/// Tags of an image file that would change its pixels and that crt does not apply.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace crt {

/// 0: the file does not have the tag.
struct UnappliedTags {
    double gamma = 0;               ///< PNG (gAMA): the exponent of its encoding.
    double exposure = 0;            ///< Radiance HDR (EXPOSURE): what its pixels were multiplied by.
    std::uint32_t orientation = 0;  ///< JPEG and PNG (EXIF): 1 is as the pixels lie.
};

/// A sentence for each of them that would change the picture. `encoded`: codes are read as sRGB, which a
/// gamma contradicts.
std::vector<std::string> sentencesOf(const UnappliedTags& tags, const std::string& path, bool encoded);

}  // namespace crt
