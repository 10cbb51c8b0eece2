#include "image/unapplied_tags.h"

#include "spectra/spectra.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>

namespace crt {
namespace {

constexpr double kNoticeable = 0.01;

bool isFactor(float value) { return value != 0 && std::abs(value - 1) > 1e-6f; }

bool areOtherPrimaries(const float (&primaries)[8]) {
    if (std::all_of(std::begin(primaries), std::end(primaries), [](float x) { return x == 0; }))
        return false;
    const std::array<double, 8> srgb = chromaticities(ColorSpace::LinearSrgb);
    return !std::equal(srgb.begin(), srgb.end(), std::begin(primaries),
                       [](double a, float b) { return std::abs(a - b) < kNoticeable; });
}

/// "PRIMARIES/TRANSFER/MATRIX/RANGE" of ITU-T H.273; empty for those of sRGB. RGB has neither matrix nor
/// range.
std::string otherCodePoints(std::uint32_t code_points, PixelUse use) {
    constexpr std::uint32_t kSrgbPrimaries = 1, kSrgbTransfer = 13;
    const std::uint32_t primaries = code_points >> 24, transfer = code_points >> 16 & 255;
    const bool like_srgb =
        primaries == kSrgbPrimaries && (transfer == kSrgbTransfer || use == PixelUse::LinearColors);
    if (code_points == 0 || like_srgb) return {};
    return fmt::format("{}/{}/{}/{}", primaries, transfer, code_points >> 8 & 255, code_points & 255);
}

void addColorSentences(const CrtUnappliedTags& tags, const std::string& path, PixelUse use,
                       std::vector<std::string>& sentences) {
    constexpr double kGammaOfSrgb = 1 / 2.2;
    if (use == PixelUse::EncodedColors && tags.gamma != 0 &&
        std::abs(tags.gamma - kGammaOfSrgb) > kNoticeable)
        sentences.push_back(
            fmt::format("the image '{}' has a gamma (gAMA) of {:g}, which crt ignores: it reads the colours "
                        "as sRGB; convert the image to sRGB",
                        path, tags.gamma));
    const auto ignored = [&](const std::string& what) {
        sentences.push_back(fmt::format(
            "the image '{}' has {}, which crt ignores: it reads the colours as {}, so they differ "
            "from those intended; convert the image to sRGB",
            path, what, use == PixelUse::EncodedColors ? "sRGB" : "linear with the primaries of sRGB"));
    };
    if (areOtherPrimaries(tags.chromaticities))
        ignored(fmt::format("the primaries (cHRM) {:.4g}", fmt::join(tags.chromaticities, " ")));
    if (const std::string points = otherCodePoints(tags.code_points, use); !points.empty())
        ignored(fmt::format("the colour space (cICP) {}", points));
    if (tags.profile[0] != '\0') ignored(fmt::format("the colour profile (ICC) '{}'", tags.profile));
}

}  // namespace

std::vector<std::string> sentencesOf(const CrtUnappliedTags& tags, const std::string& path, PixelUse use) {
    constexpr std::uint32_t kAsStored = 1;
    std::vector<std::string> sentences;
    if (isFactor(tags.exposure))
        sentences.push_back(fmt::format(
            "the image '{}' has EXPOSURE={:g}: its values were multiplied by that, and crt uses them "
            "unchanged; divide them by it to get the original radiance",
            path, tags.exposure));
    if (std::any_of(std::begin(tags.color_correction), std::end(tags.color_correction), isFactor))
        sentences.push_back(fmt::format(
            "the image '{}' has COLORCORR={:g}: its red, green and blue were multiplied by these, and crt "
            "uses them unchanged; divide them by these to get the original radiance",
            path, fmt::join(tags.color_correction, " ")));
    if (use != PixelUse::Numbers) addColorSentences(tags, path, use, sentences);
    if (tags.orientation > kAsStored)
        sentences.push_back(
            fmt::format("the image '{}' is marked as turned or mirrored (EXIF orientation {}), which crt "
                        "ignores: it uses the pixels as they are stored; rotate the pixels themselves "
                        "instead",
                        path, tags.orientation));
    return sentences;
}

}  // namespace crt
