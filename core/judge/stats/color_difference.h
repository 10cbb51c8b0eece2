/// Colours as they look: CIE L*a*b* and the difference CIEDE2000.
#pragma once

#include "judge/stats/rgb_view.h"

#include <array>
#include <cstdint>

namespace crt::stats {

using Color = std::array<double, 3>;

/// D65 at (0.31271, 0.32902), of luminance 1: the white of all conversions here.
inline constexpr Color kD65White{0.950428545377181, 1.0, 1.088900370798128};
/// Between linear sRGB and XYZ with that white (Rec. 709 primaries).
Color linearSrgbToXyz(const Color& rgb);
Color xyzToLinearSrgb(const Color& xyz);

struct Lab {
    double lightness = 0, a = 0, b = 0;  ///< L* of white is 100.
};
/// CIE 1976.
Lab labFromLinearSrgb(const Color& rgb);

/// CIEDE2000 with k_L = k_C = k_H = 1, as Sharma, Wu and Dalal 2005 give it, whose 34 pairs it reproduces.
/// About 1 can just be seen.
double deltaE2000(const Lab& a, const Lab& b);

struct ColorDifference {
    double mean = 0, max = 0;  ///< NaN when any value of either image is not finite.
};
/// Of the images on a screen whose white is 1: values are clipped to [0, 1] first.
ColorDifference deltaE2000(const RgbView& test, const RgbView& reference);

}  // namespace crt::stats
