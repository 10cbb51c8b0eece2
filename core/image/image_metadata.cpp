#include "image/image_metadata.h"

#include "base/error.h"
#include "base/words.h"
#include "image/image_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

namespace crt {
namespace {

constexpr const char* kNoWhiteBalance = "none";

std::optional<double> numberOf(const Image& image, const char* key) {
    const std::string text = metadataValue(image, key);
    if (text.empty()) return std::nullopt;
    return parseNumber(text).value;
}

bool alike(const std::array<double, 8>& a, const std::array<double, 8>& b) {
    constexpr double kRoundedToFloat = 1e-6;
    return std::equal(a.begin(), a.end(), b.begin(),
                      [](double u, double v) { return std::abs(u - v) <= kRoundedToFloat; });
}

struct NamedSpace {
    ColorSpace space;
    const char* name;
};
constexpr std::array<NamedSpace, 3> kSpaces{
    {{ColorSpace::LinearSrgb, "sRGB"}, {ColorSpace::AcesCg, "ACEScg"}, {ColorSpace::Xyz, "XYZ"}}};

std::string spaceText(const std::array<double, 8>& primaries) {
    for (const NamedSpace& s : kSpaces)
        if (alike(primaries, chromaticities(s.space))) return s.name;
    return fmt::format("the one with the primaries {:.4g}", fmt::join(primaries, " "));
}

std::string exposureText(double ev) { return fmt::format("{:+g} EV", ev); }
std::string balanceText(const std::string& balance) {
    return balance == kNoWhiteBalance ? balance : "of " + balance;
}

/// "0.447574,0.407443"; files may round it.
bool sameBalance(const std::string& a, const std::string& b) {
    if (a == b) return true;
    std::array<double, 2> x{}, y{};
    const auto parse = [](const std::string& text, double& first, double& second) {
        return std::sscanf(text.c_str(), "%lf,%lf", &first, &second) == 2;
    };
    constexpr double kRounding = 2e-5;
    return parse(a, x[0], y[0]) && parse(b, x[1], y[1]) && std::abs(x[0] - x[1]) <= kRounding &&
           std::abs(y[0] - y[1]) <= kRounding;
}

}  // namespace

std::string whiteBalanceText(const Development& development) {
    if (!development.white) return kNoWhiteBalance;
    const Vec3d& white = *development.white;
    const double sum = white[0] + white[1] + white[2];
    return fmt::format("{:.6f},{:.6f}", white[0] / sum, white[1] / sum);
}

std::optional<double> errorDegreesOfFreedom(const Image& image) {
    const std::optional<double> dof = numberOf(image, kErrorDofKey);
    return dof && *dof >= 1 ? dof : std::nullopt;
}

std::optional<ColorSpace> colorSpaceOf(const Image& image) {
    if (!image.chromaticities) return ColorSpace::LinearSrgb;
    for (const NamedSpace& s : kSpaces)
        if (alike(*image.chromaticities, chromaticities(s.space))) return s.space;
    return std::nullopt;
}

ColorConditions colorConditions(const Image& image) {
    const std::string balance = metadataValue(image, kWhiteBalanceKey);
    return {numberOf(image, kExposureKey), balance.empty() ? std::nullopt : std::optional(balance),
            image.chromaticities, metadataValue(image, kViewKey)};
}

std::string conflictOf(const ColorConditions& of_a, const std::string& a, const ColorConditions& of_b,
                       const std::string& b) {
    const auto say = [&](const char* what, const std::string& is_a, const std::string& is_b) {
        return fmt::format("{} and {} differ in {}: {} and {}", a, b, what, is_a, is_b);
    };
    // Exposures of one image differ by rounding of text at most; what deserves a warning is what can be seen
    // in floats.
    if (of_a.exposure_ev && of_b.exposure_ev && std::abs(*of_a.exposure_ev - *of_b.exposure_ev) > 1e-7)
        return say("exposure", exposureText(*of_a.exposure_ev), exposureText(*of_b.exposure_ev));
    if (of_a.white_balance && of_b.white_balance && !sameBalance(*of_a.white_balance, *of_b.white_balance))
        return say("white balance", balanceText(*of_a.white_balance), balanceText(*of_b.white_balance));
    if (of_a.chromaticities && of_b.chromaticities && !alike(*of_a.chromaticities, *of_b.chromaticities))
        return say("colour space", spaceText(*of_a.chromaticities), spaceText(*of_b.chromaticities));
    const auto viewText = [](const std::string& view) { return view.empty() ? std::string("none") : view; };
    if (of_a.view != of_b.view) return say("view transform", viewText(of_a.view), viewText(of_b.view));
    return {};
}

std::vector<std::string> unknownConditions(const ColorConditions& of_a, const std::string& a,
                                           const ColorConditions& of_b, const std::string& b) {
    std::vector<std::string> sentences;
    const auto one = [&](const ColorConditions& known, const std::string& says,
                         const ColorConditions& unknown, const std::string& silent) {
        const auto add = [&](const char* what, const std::string& value) {
            sentences.push_back(fmt::format("{} does not state its {}; crt assumes that of {}: {}", silent,
                                            what, says, value));
        };
        if (known.exposure_ev && !unknown.exposure_ev && *known.exposure_ev != 0)
            add("exposure", exposureText(*known.exposure_ev));
        if (known.white_balance && !unknown.white_balance && *known.white_balance != kNoWhiteBalance)
            add("white balance", balanceText(*known.white_balance));
        if (known.chromaticities && !unknown.chromaticities &&
            !alike(*known.chromaticities, chromaticities(ColorSpace::LinearSrgb)))
            add("colour space", spaceText(*known.chromaticities));
    };
    one(of_a, a, of_b, b);
    one(of_b, b, of_a, a);
    return sentences;
}

}  // namespace crt
