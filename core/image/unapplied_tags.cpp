#include "image/unapplied_tags.h"

#include <fmt/format.h>

#include <cmath>

namespace crt {

std::vector<std::string> sentencesOf(const UnappliedTags& tags, const std::string& path, bool encoded) {
    constexpr double kGammaOfSrgb = 1 / 2.2, kNoticeable = 0.01;
    constexpr std::uint32_t kAsStored = 1;
    std::vector<std::string> sentences;
    if (tags.exposure != 0 && std::abs(tags.exposure - 1) > 1e-6)
        sentences.push_back(fmt::format(
            "the image '{}' has EXPOSURE={:g}: its values were multiplied by that, and crt uses them "
            "unchanged; divide them by it to get the original radiance",
            path, tags.exposure));
    if (encoded && tags.gamma != 0 && std::abs(tags.gamma - kGammaOfSrgb) > kNoticeable)
        sentences.push_back(
            fmt::format("the image '{}' has a gamma (gAMA) of {:g}, which crt ignores: it reads the colours "
                        "as sRGB; convert the image to sRGB",
                        path, tags.gamma));
    if (tags.orientation > kAsStored)
        sentences.push_back(
            fmt::format("the image '{}' is marked as turned or mirrored (EXIF orientation {}), which crt "
                        "ignores: it uses the pixels as they are stored; rotate the pixels themselves "
                        "instead",
                        path, tags.orientation));
    return sentences;
}

}  // namespace crt
