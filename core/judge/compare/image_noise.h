/// Reads the noise of an image from the channels that it stores next to its colour.
#pragma once

#include "film/film.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace crt {

/// Independent parts that a reference keeps ("Fold.0.R" … "Fold.7.B").
inline constexpr std::size_t kFolds = 8;

/// Values and their variances, pixel by pixel.
struct NoisyImage {
    std::vector<std::string> channels;  ///< R, G, B, or Y alone.
    std::vector<double> values;         ///< [pixel][channel]
    std::vector<double> variances;      ///< Of the values; [pixel][channel]
    double dof = 0;                     ///< Degrees of freedom of each variance.
    std::string source;  ///< "StdError.Y, 3 degrees of freedom a pixel", …: where the variances are from.
    std::vector<std::vector<double>> fold_means;  ///< [channel][fold], over the image; empty without folds.
};

enum class NoiseOf { Color, Luminance };

/// With NoiseOf::Color, from channels StdError.R, .G and .B, Variance.R, .G and .B, or folds. With
/// NoiseOf::Luminance, from OwnVariance.Y, StdError.Y, Variance.Y or folds; the values are then the
/// luminance of R, G and B by the image's primaries. Nothing when there is none of them, or they are not
/// finite.
///
/// StdError and Variance are of the pixel's mean, in the image's exposure. Their degrees of freedom are in
/// the metadata (kErrorDofKey); where they are not, they are taken as one, the fewest that an estimate can
/// have, and `source` says so.
std::optional<NoisyImage> noisyImage(const Image& image, NoiseOf what);

/// Has it channels that state noise, whether they can be used or not? A pixel that lost samples states an
/// infinite one.
bool statesNoise(const Image& image);

/// One sentence when both images name the same seed in their metadata, so that they may share samples; else
/// empty.
std::string sameSeed(const Image& a, const Image& b);

/// Are there channels of eight folds?
bool hasFolds(const Image& image);

/// R, G and B of every pixel without fold `left_out`: the mean of the seven others. Requires hasFolds.
std::vector<float> colorWithoutFold(const Image& image, std::size_t left_out);

/// Weights of R, G and B in luminance, as stats/luminance_error.h defines it: of the image's colour space,
/// or of sRGB when it names none.
std::array<double, 3> luminanceWeights(const Image& image);

}  // namespace crt
