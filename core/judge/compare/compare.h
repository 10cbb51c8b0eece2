/// Image against image: are they the same bits, and if not, where and by how much.
#pragma once

#include "film/film.h"
#include "judge/compare/perceived_difference.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace crt {

struct CompareOptions {
    /// 0: the images are the same only when every compared value has the same bits (so −0 differs from +0,
    /// and a NaN equals itself). Above 0: when the root mean square difference is at most this share of the
    /// second image's mean value, and all values are finite.
    double tolerance = 0;
    /// Compare every channel, the integer ones too, instead of R, G and B. Metrics stay those of the colour.
    bool all_channels = false;
    /// The values are what a screen shows, as those of PNG files are, and not radiances: chooses the kind of
    /// FLIP.
    bool display_referred = false;
};

/// Where two images first differ, in reading order.
struct Difference {
    std::uint32_t x = 0, y = 0;
    std::string channel;
    double first = 0, second = 0;
    std::optional<std::uint64_t>
        ulps;  ///< Floats between the two; nothing when one is no number or they are integers.
};

/// The second image is the reference; the images are called A and B. Metrics run over the colour values: R,
/// G and B of every pixel, or every float channel when the images have no R, G and B.
struct CompareResult {
    bool same = false;
    double tolerance = 0;
    /// Reason why the images cannot be compared (size, channels or colour settings differ); empty if they
    /// can. Then everything below is zero.
    std::string mismatch;
    /// Assumptions of the comparison, one sentence each, without a full stop.
    std::vector<std::string> notes;
    std::uint32_t width = 0, height = 0;
    std::vector<std::string> channels;        ///< Compared bit by bit.

    std::uint64_t differing_pixels = 0;       ///< With any bit of a compared channel different.
    std::optional<Difference> first_difference;
    std::array<std::uint64_t, 2> not_finite{0,
                                            0};  ///< Colour values of each image that are NaN or infinite.

    bool metrics_valid =
        false;  ///< False when a colour value is NaN or infinite: no average means anything then.
    double max_absolute = 0;                  ///< max |a − b|
    std::uint64_t max_ulp = 0;                ///< Most floats between two values.
    double p99_absolute = 0;  ///< The smallest |a − b| that 99 % of the values do not exceed.
    double mse = 0;                           ///< mean (a − b)²
    double rmse = 0;                          ///< √mse
    double rmse_over_mean = 0;                ///< rmse / mean b, of colour values; infinite against black.
    double relmse = 0;                        ///< mean (a − b)² / (b² + ε²), ε = mean(b)/100
    double mae = 0;                           ///< mean |a − b|
    double smape = 0;                         ///< mean 2|a − b| / (|a| + |b|), in [0,2]
    std::array<double, 2> mean{0, 0};
    double mean_ratio = 1;  ///< mean a / mean b; NaN when both are black, infinite when only b is.
    /// The error as crt states it everywhere (stats/luminance_error.h): of luminance, relative to b's mean
    /// luminance. With R, G and B only.
    std::optional<double> relative_rmse;
    /// When both have R, G and B of primaries that span colours, and metrics are valid.
    std::optional<PerceivedDifference> perceived;
    std::vector<std::string> other_channels;  ///< In one image only; they do not matter unless all_channels.
};

/// Has it channels R, G and B?
bool hasColor(const Image& image);

CompareResult compareImages(const Image& a, const Image& b, const CompareOptions& options = {});

/// a − b of R, G and B.
Image differenceImage(const Image& a, const Image& b);
/// The same to look at: black where all bits agree, else from blue (10⁻⁷ of the mean of b, about one
/// rounding) over green (10⁻⁴) to red (10⁻¹ and more) by the largest difference of the pixel; magenta
/// where a value is not finite. Linear sRGB.
Image falseColorDifference(const Image& a, const Image& b);
/// Writes the difference: as values to .exr and .pfm, in false colour to .png, .jpg and .ppm. Throws
/// crt::Error(Usage) for another extension or images that do not match, crt::Error(Output) when it cannot be
/// written.
void writeDifference(const std::string& path, const Image& a, const Image& b);

}  // namespace crt
