/// Metadata of an image file about the origin of its values, under names that writers and comparisons share.
#pragma once

#include "image/development.h"
#include "image/image.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace crt {

inline constexpr const char* kExposureKey =
    "crt/exposure";  ///< Stops: values were multiplied by 2 to this power.
inline constexpr const char* kWhiteBalanceKey =
    "crt/whiteBalance";  ///< "none", or "x,y": chromaticity of the light that became white.
/// OpenEXR's standard attribute: luminance of the colour (1, 1, 1), in cd/m².
inline constexpr const char* kWhiteLuminanceKey = "whiteLuminance";
/// Colour space of the pixels, by the names of the Color Interop Forum
/// (https://github.com/AcademySoftwareFoundation/ColorInterop).
inline constexpr const char* kColorInteropIdKey = "colorInteropID";
inline constexpr const char* kDisplaySrgbId = "srgb_rec709_display";
inline constexpr const char* kViewKey = "crt/view";  ///< Of kViewTransformNames, where it is not "none".
/// The settings of display formats, in files of floats that got neither: as the two above.
inline constexpr const char* kDisplayExposureKey = "crt/displayExposure";
inline constexpr const char* kDisplayWhiteBalanceKey = "crt/displayWhiteBalance";
/// Student's 95 % half-width of each pixel: StdError.Y times the quantile of its degrees of freedom.
inline constexpr const char* kHalfWidthChannel = "HalfWidth95.Y";
/// The unbiased variance of each pixel by itself, which sums over pixels need: StdError.Y, Variance.Y and
/// HalfWidth95.Y are pooled with those about it (film/pooled_variance.h), and too large on average.
inline constexpr const char* kOwnVarianceChannel = "OwnVariance.Y";
/// Of OwnVariance.Y in one pixel; in files of others, of StdError.Y or Variance.Y.
inline constexpr const char* kErrorDofKey = "crt/errorDegreesOfFreedom";

/// Value of kWhiteBalanceKey.
std::string whiteBalanceText(const Development& development);

/// By kErrorDofKey. Nothing without it, or when it is no number of 1 or more.
std::optional<double> errorDegreesOfFreedom(const Image& image);

/// Space of the image's primaries; sRGB when it names none. Nothing when they are those of another space.
std::optional<ColorSpace> colorSpaceOf(const Image& image);

/// Settings other than light that determine an image's values.
struct ColorConditions {
    std::optional<double> exposure_ev;                    ///< Nothing: the file does not say.
    std::optional<std::string> white_balance;  ///< As in kWhiteBalanceKey; nothing: the file does not say.
    std::optional<std::array<double, 8>> chromaticities;  ///< Nothing: the file does not say.
    std::string view;                                     ///< As in kViewKey; empty: none.
};
ColorConditions colorConditions(const Image& image);

/// Reason why values under the two settings cannot be compared, one sentence without a full stop, in which
/// `a` and `b` name them: other exposure, white balance, colour
/// space or view transform. Empty when both say the same, or
/// nothing.
std::string conflictOf(const ColorConditions& conditions_a, const std::string& a,
                       const ColorConditions& conditions_b, const std::string& b);

/// Settings that only one of them states and that are not the default (0 stops, no white balance, sRGB), one
/// sentence each: the other is assumed to be equal.
std::vector<std::string> unknownConditions(const ColorConditions& conditions_a, const std::string& a,
                                           const ColorConditions& conditions_b, const std::string& b);

}  // namespace crt
