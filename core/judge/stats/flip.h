/// FLIP: the difference that a person sees who flips between two images on a screen (Andersson et al. 2020,
/// "FLIP: A Difference Evaluator for Alternating Images", and 2021, "Visualizing Errors in Rendered High
/// Dynamic Range Images"). 0 is no difference, 1 the largest there is.
///
/// Written from the papers, in doubles. The authors' program works in floats; where it settles what the
/// papers leave open (border, D65, black medians) this agrees with it (unit_flip.cpp).
#pragma once

#include "judge/stats/rgb_view.h"

#include <vector>

namespace crt::stats {

/// A monitor 0.7 m wide with 3840 pixels, seen from 0.7 m: 67.02 pixels a degree.
inline constexpr double kFlipPixelsPerDegree = 67.020643276582255;

struct FlipResult {
    std::vector<float> error;  ///< Of every pixel, in [0, 1].
    double mean = 0;           ///< NaN when a value of either image is, or when HDR exposures are undefined.
    /// HDR: range of exposures, in stops, that the reference asks for, and how many of them were looked at.
    /// LDR: 0, 0, 1.
    double start_exposure = 0, stop_exposure = 0;
    int exposures = 1;
};

/// Images as shown: values outside [0, 1] are clipped. Sizes are equal.
FlipResult flipLdr(const RgbView& test, const RgbView& reference,
                   double pixels_per_degree = kFlipPixelsPerDegree);

/// Scene radiance: the largest error over all exposures between those that bring the reference's brightest
/// pixel and its median to 0.85 of the screen's white through the ACES tone curve (Narkowicz 2015). A black
/// reference has no exposure: the mean is NaN.
FlipResult flipHdr(const RgbView& test, const RgbView& reference,
                   double pixels_per_degree = kFlipPixelsPerDegree);

}  // namespace crt::stats
