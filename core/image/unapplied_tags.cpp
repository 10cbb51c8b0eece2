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
            "the image '{}' says EXPOSURE={:g}: its numbers were multiplied by that, and crt uses them as "
            "they are; divide by it to have the light that was there",
            path, tags.exposure));
    if (encoded && tags.gamma != 0 && std::abs(tags.gamma - kGammaOfSrgb) > kNoticeable)
        sentences.push_back(
            fmt::format("the image '{}' says a gamma (gAMA) of {:g}, which crt ignores: it reads the "
                        "colours as sRGB; convert the image to sRGB to have what the gamma says",
                        path, tags.gamma));
    if (tags.orientation > kAsStored)
        sentences.push_back(
            fmt::format("the image '{}' is marked as turned or mirrored (EXIF orientation {}), which crt "
                        "ignores: it uses the pixels as they are stored; turn the pixels themselves to have "
                        "what the mark says",
                        path, tags.orientation));
    return sentences;
}

}  // namespace crt
