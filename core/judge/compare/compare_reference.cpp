#include "judge/compare/compare_reference.h"

#include "base/error.h"
#include "base/statistics.h"
#include "film/luminance_error.h"
#include "image/image_metadata.h"
#include "judge/compare/perceived_difference.h"
#include "judge/compare/image_noise.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace crt {
namespace {

/// R, G and B of every pixel as they are in the file.
std::vector<float> colorValues(const Image& image) {
    std::vector<float> values;
    for (std::size_t p = 0; p < std::size_t{image.width} * image.height; ++p)
        for (const char* name : {"R", "G", "B"}) {
            const auto found = std::find(image.channels.begin(), image.channels.end(), name);
            if (found == image.channels.end())
                throw Error(ErrorKind::Usage,
                            "only images with channels R, G and B have an error against a reference");
            values.push_back(image.pixels[p * image.channels.size() +
                                          static_cast<std::size_t>(found - image.channels.begin())]);
        }
    return values;
}

/// Jackknife: √((k − 1)/k · Σ (e₋ᵢ − ē)²) over the k references that lack one fold each (Efron
/// and Stein 1981).
double jackknifeError(const std::vector<double>& values) {
    const stats::Summary s = stats::summarize(values);
    const double k = static_cast<double>(values.size());
    return std::sqrt((k - 1) / k * (k - 1) * s.variance);
}

struct NamedMetric {
    SpreadMetric ReferenceError::*to;
    double stats::ErrorMetrics::*from;
};
constexpr std::array<NamedMetric, 8> kMetrics{
    {{&ReferenceError::rmse, &stats::ErrorMetrics::rmse},
     {&ReferenceError::rmse_over_mean, &stats::ErrorMetrics::relative_rmse},
     {&ReferenceError::relmse, &stats::ErrorMetrics::relmse},
     {&ReferenceError::smape, &stats::ErrorMetrics::smape},
     {&ReferenceError::mae, &stats::ErrorMetrics::mae},
     {&ReferenceError::p99_absolute, &stats::ErrorMetrics::p99_absolute},
     {&ReferenceError::max_absolute, &stats::ErrorMetrics::max_absolute},
     {&ReferenceError::mean_ratio, &stats::ErrorMetrics::mean_ratio}}};

/// FLIP against eight more references of this many pixels takes seconds; beyond, its spread is left out.
constexpr std::size_t kMostPixelsForFlipSpread = 1 << 16;

/// Colours in the file's space for errors, in sRGB for perceived differences.
struct Colors {
    std::vector<float> values, luminances;
    std::optional<std::vector<float>> srgb;
};

ReferenceError errorAgainst(const Colors& test, const Colors& reference,
                            const std::vector<Colors>& without_fold, std::uint32_t width,
                            std::uint32_t height, bool display_referred) {
    ReferenceError error;
    error.metrics = stats::errorMetrics(test.values, reference.values);
    const bool comparable = test.srgb && reference.srgb && error.metrics.valid();
    const auto nan = std::numeric_limits<double>::quiet_NaN();
    PerceivedDifference seen{nan, !display_referred, nan, nan};
    if (comparable) seen = perceivedDifference(*test.srgb, *reference.srgb, width, height, display_referred);
    for (const NamedMetric& m : kMetrics) (error.*m.to).value = error.metrics.*m.from;
    const auto relativeRmse = [&](const Colors& r) {
        return stats::luminanceError(test.luminances, r.luminances).relative_rmse;
    };
    error.relative_rmse.value = error.metrics.valid() ? relativeRmse(reference) : nan;
    error.flip.value = seen.flip_mean;
    error.delta_e_mean.value = seen.delta_e_mean;
    error.delta_e_max.value = seen.delta_e_max;
    if (without_fold.empty() || !error.metrics.valid()) return error;

    std::vector<double> relative;
    for (const Colors& r : without_fold) relative.push_back(relativeRmse(r));
    error.relative_rmse.spread = jackknifeError(relative);
    std::vector<stats::ErrorMetrics> left_out;
    for (const Colors& r : without_fold) left_out.push_back(stats::errorMetrics(test.values, r.values));
    for (const NamedMetric& m : kMetrics) {
        std::vector<double> values;
        for (const stats::ErrorMetrics& e : left_out) values.push_back(e.*m.from);
        (error.*m.to).spread = jackknifeError(values);
    }
    if (!comparable || std::size_t{width} * height > kMostPixelsForFlipSpread) return error;
    std::vector<double> flips, means, largest;
    for (const Colors& r : without_fold) {
        const PerceivedDifference l =
            perceivedDifference(*test.srgb, *r.srgb, width, height, display_referred);
        flips.push_back(l.flip_mean);
        means.push_back(l.delta_e_mean);
        largest.push_back(l.delta_e_max);
    }
    error.flip.spread = jackknifeError(flips);
    error.delta_e_mean.spread = jackknifeError(means);
    error.delta_e_max.spread = jackknifeError(largest);
    return error;
}

/// `like` names the primaries where the image does not.
Colors colorsOf(const Image& image, const Image& like) {
    const Image& named = image.chromaticities ? image : like;
    Colors colors{colorValues(image), {}, linearSrgb(image, named.chromaticities)};
    colors.luminances = stats::luminances(colors.values, luminanceWeights(named));
    return colors;
}

std::vector<Colors> colorsWithoutFolds(const Image& reference, const Image& like) {
    std::vector<Colors> colors;
    if (!hasFolds(reference)) return colors;
    for (std::size_t k = 0; k < kFolds; ++k) {
        Image rest;
        rest.width = reference.width;
        rest.height = reference.height;
        rest.channels = {"R", "G", "B"};
        rest.chromaticities = reference.chromaticities;
        rest.pixels = colorWithoutFold(reference, k);
        colors.push_back(colorsOf(rest, like));
    }
    return colors;
}

}  // namespace

ReferenceComparison compareWithReference(const Image& a, const Image& b, const Image& reference,
                                         bool display_referred) {
    for (const Image* image : {&a, &b})
        if (image->width != reference.width || image->height != reference.height)
            throw Error(
                ErrorKind::Usage,
                fmt::format(
                    "the reference has {} x {} pixels and an image {} x {}; render one of them again",
                    reference.width, reference.height, image->width, image->height));
    ReferenceComparison result;
    const ColorConditions of_reference = colorConditions(reference);
    for (const auto& [image, name] : {std::pair{&a, "A"}, {&b, "B"}}) {
        const ColorConditions of_image = colorConditions(*image);
        if (const std::string conflict = conflictOf(of_image, name, of_reference, "R"); !conflict.empty())
            throw Error(
                ErrorKind::Usage,
                fmt::format("{}; R, the reference, must be rendered again as {} was", conflict, name));
        for (std::string& note : unknownConditions(of_image, name, of_reference, "R"))
            result.notes.push_back(std::move(note));
    }
    const Colors colors = colorsOf(reference, a.chromaticities ? a : b);
    const std::vector<Colors> without_fold = colorsWithoutFolds(reference, a.chromaticities ? a : b);
    std::optional<double> variance;
    if (const std::optional<NoisyImage> noisy = noisyImage(reference, NoiseOf::Luminance)) {
        variance = stats::summarize(noisy->variances).mean;
        result.reference_rms_error = std::sqrt(*variance) / std::abs(stats::summarize(noisy->values).mean);
        result.reference_noise_source = noisy->source;
    }
    for (std::size_t i = 0; i < 2; ++i) {
        const Image& image = i == 0 ? a : b;
        ReferenceError& error = result.errors[i];
        const Colors own = colorsOf(image, reference.chromaticities ? reference : i == 0 ? b : a);
        error = errorAgainst(own, colors, without_fold, reference.width, reference.height, display_referred);
        if (const std::string same = sameSeed(image, reference); !same.empty())
            error.warnings.push_back("the reference may hold the same samples: " + same);
        if (!error.metrics.valid()) continue;
        if (variance) {
            const stats::LuminanceError of_luminance =
                stats::luminanceError(own.luminances, colors.luminances);
            const double left = of_luminance.mse - *variance;
            error.within_reference_noise = left <= 0;
            if (left > 0)
                error.corrected_relative_rmse = stats::relativeRmse(left, of_luminance.reference_mean);
        }
    }
    return result;
}

}  // namespace crt
