/// The error of an image, in one place: luminance Y, relative to mean luminance. `crt render`, `converge`,
/// `compare` and the reports all state it so.
///
/// Luminance is the Y of the image's colour space, in the image's exposure. A relative error divides by the
/// absolute value of the reference's mean luminance; against a black reference it is infinite, and 0 only
/// for an image that is the same.
#pragma once

#include "spectra/spectra.h"

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace crt::stats {

using Rgb = std::array<double, 3>;

/// Weights of R, G and B in the film's Y; together 1 for white. For ColorSpace::Xyz (0, 1, 0).
Rgb luminanceWeights(ColorSpace space);
/// The same from CIE xy of red, green, blue and white, as an EXR has them. For AcesCg they differ by some
/// per cent from those above: a film's white, D65, was adapted to that of ACES. Where an image names a
/// ColorSpace, use that.
Rgb luminanceWeights(const std::array<double, 8>& chromaticities);

inline double luminance(const Rgb& rgb, const Rgb& weights) {
    return weights[0] * rgb[0] + weights[1] * rgb[1] + weights[2] * rgb[2];
}

/// Y of every pixel of [pixel][3].
std::vector<float> luminances(std::span<const float> rgb, const Rgb& weights);

/// Mean over the pixels, added up in doubles. NaN of none.
double meanLuminance(std::span<const float> luminances);

/// Mean squared difference of two planes of one size, absolute.
double meanSquaredDifference(std::span<const float> a, std::span<const float> b);

/// √mse / |mean luminance of the reference|. A squared error below 0 (the reference's own variance is
/// subtracted from it) counts as 0.
double relativeRmse(double mse, double reference_mean);

/// (mean − reference) / |reference|: 0 when both are equal.
double relativeBias(double mean, double reference_mean);

/// The unit of a deviation of one colour channel: the channel's own mean in the reference, or mean luminance
/// where that is larger. So a channel that is 0 or below 0, as a saturated colour makes it, counts like any
/// other.
double channelScale(double channel_mean, double mean_luminance);

/// Error of a plane of luminances against a reference.
struct LuminanceError {
    double mean = 0, reference_mean = 0;
    double mse = 0;            ///< mean (Y − Y_reference)², absolute
    double relative_rmse = 0;
    double relative_bias = 0;  ///< Of the mean.
};
LuminanceError luminanceError(std::span<const float> test, std::span<const float> reference);

/// Of how many independent pixels with equal variances the mean variance would be known as well: (Σ σ²)²
/// / Σ σ⁴, from estimates s² of `dof` degrees of freedom each, whose squares are too large by 1 + 2/dof
/// on average. At least 1, at most the number of pixels; that number where all are 0.
double effectivePixels(std::span<const double> variances, double dof);

}  // namespace crt::stats
