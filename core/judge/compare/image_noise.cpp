#include "judge/compare/image_noise.h"

#include "base/statistics.h"
#include "film/luminance_error.h"
#include "image/image_io.h"
#include "image/image_metadata.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace crt {
namespace {

constexpr double kUnstatedDof = 1;
constexpr std::array<const char*, 3> kColor{"R", "G", "B"};

using Places = std::vector<std::size_t>;  // Of channels, in the order asked for.

std::optional<Places> placesOf(const Image& image, const std::vector<std::string>& names) {
    Places places;
    for (const std::string& name : names) {
        const auto found = std::find(image.channels.begin(), image.channels.end(), name);
        if (found == image.channels.end()) return std::nullopt;
        places.push_back(static_cast<std::size_t>(found - image.channels.begin()));
    }
    return places;
}

std::vector<std::string> colorNames(const std::string& prefix) {
    std::vector<std::string> names;
    for (const char* c : kColor) names.push_back(prefix + c);
    return names;
}

/// [fold][R, G, B]
std::optional<std::vector<Places>> foldPlaces(const Image& image) {
    std::vector<Places> folds;
    for (std::size_t k = 0; k < kFolds; ++k) {
        std::optional<Places> places = placesOf(image, colorNames(fmt::format("Fold.{}.", k)));
        if (!places) return std::nullopt;
        folds.push_back(std::move(*places));
    }
    return folds;
}

std::size_t pixelsOf(const Image& image) { return std::size_t{image.width} * image.height; }

/// R, G, B → the values of a NoisyImage: themselves, or their luminance.
struct Reduction {
    NoiseOf what;
    std::array<double, 3> weights;
    std::size_t channels() const { return what == NoiseOf::Color ? 3 : 1; }
    double operator()(const float* pixel, const Places& rgb, std::size_t channel) const {
        if (what == NoiseOf::Color) return pixel[rgb[channel]];
        return weights[0] * pixel[rgb[0]] + weights[1] * pixel[rgb[1]] + weights[2] * pixel[rgb[2]];
    }
};

/// Variance of the mean of eight, from their spread.
void addFolds(NoisyImage& noisy, const Image& image, const std::vector<Places>& folds,
              const Reduction& reduce) {
    noisy.dof = kFolds - 1;
    noisy.source = fmt::format("{} folds", kFolds);
    noisy.fold_means.assign(reduce.channels(), std::vector<double>(kFolds, 0.0));
    std::array<double, kFolds> values;
    for (std::size_t p = 0; p < pixelsOf(image); ++p)
        for (std::size_t c = 0; c < reduce.channels(); ++c) {
            for (std::size_t k = 0; k < kFolds; ++k) {
                values[k] = reduce(&image.pixels[p * image.channels.size()], folds[k], c);
                noisy.fold_means[c][k] += values[k] / static_cast<double>(pixelsOf(image));
            }
            noisy.variances.push_back(stats::summarize(values).variance / kFolds);
        }
}

/// From channels that hold it: "OwnVariance.", "StdError." squared, or "Variance.".
bool addStated(NoisyImage& noisy, const Image& image, NoiseOf what) {
    for (const char* kind : {"OwnVariance.", "StdError.", "Variance."}) {
        const std::string prefix = kind;
        const std::vector<std::string> names =
            what == NoiseOf::Color ? colorNames(prefix) : std::vector<std::string>{prefix + "Y"};
        const std::optional<Places> places = placesOf(image, names);
        if (!places) continue;
        for (std::size_t p = 0; p < pixelsOf(image); ++p)
            for (const std::size_t place : *places) {
                const double v = image.pixels[p * image.channels.size() + place];
                noisy.variances.push_back(prefix == "StdError." ? v * v : v);
            }
        const std::optional<double> stated = errorDegreesOfFreedom(image);
        noisy.dof = stated.value_or(kUnstatedDof);
        const std::string channels = what == NoiseOf::Color ? prefix + "R, G, B" : names.front();
        noisy.source =
            stated ? fmt::format("{}, {:.6g} degree{} of freedom per pixel", channels, *stated,
                                 *stated == 1 ? "" : "s")
                   : fmt::format("{}, degrees of freedom not stated, taken as {}", channels, kUnstatedDof);
        return true;
    }
    return false;
}

}  // namespace

std::optional<NoisyImage> noisyImage(const Image& image, NoiseOf what) {
    const std::optional<Places> rgb = placesOf(image, colorNames(""));
    if (!rgb) return std::nullopt;
    const Reduction reduce{what, luminanceWeights(image)};
    NoisyImage noisy;
    noisy.channels = what == NoiseOf::Color ? colorNames("") : std::vector<std::string>{"Y"};
    for (std::size_t p = 0; p < pixelsOf(image); ++p)
        for (std::size_t c = 0; c < reduce.channels(); ++c)
            noisy.values.push_back(reduce(&image.pixels[p * image.channels.size()], *rgb, c));
    if (const auto folds = foldPlaces(image)) {
        addFolds(noisy, image, *folds, reduce);
    } else if (!addStated(noisy, image, what)) {
        return std::nullopt;
    }
    const auto known = [](double v) { return std::isfinite(v) && v >= 0; };
    if (!std::all_of(noisy.variances.begin(), noisy.variances.end(), known)) return std::nullopt;
    if (!std::all_of(noisy.values.begin(), noisy.values.end(), [](double v) { return std::isfinite(v); }))
        return std::nullopt;
    return noisy;
}

bool statesNoise(const Image& image) {
    return std::any_of(image.channels.begin(), image.channels.end(), [](const std::string& name) {
        return name.rfind("StdError.", 0) == 0 || name.rfind("Variance.", 0) == 0 ||
               name.rfind("Fold.", 0) == 0;
    });
}

std::string sameSeed(const Image& a, const Image& b) {
    const std::string seed = metadataValue(a, "crt/seed");
    if (seed.empty() || seed != metadataValue(b, "crt/seed")) return {};
    return fmt::format("both have seed {}, so their noise is not independent", seed);
}

bool hasFolds(const Image& image) { return foldPlaces(image).has_value(); }

std::vector<float> colorWithoutFold(const Image& image, std::size_t left_out) {
    const std::vector<Places> folds = foldPlaces(image).value();
    std::vector<float> values;
    values.reserve(3 * pixelsOf(image));
    for (std::size_t p = 0; p < pixelsOf(image); ++p)
        for (std::size_t c = 0; c < 3; ++c) {
            double sum = 0;
            for (std::size_t k = 0; k < kFolds; ++k)
                if (k != left_out) sum += image.pixels[p * image.channels.size() + folds[k][c]];
            values.push_back(static_cast<float>(sum / (kFolds - 1)));
        }
    return values;
}

std::array<double, 3> luminanceWeights(const Image& image) {
    if (const std::optional<ColorSpace> space = colorSpaceOf(image)) return stats::luminanceWeights(*space);
    return stats::luminanceWeights(*image.chromaticities);
}

}  // namespace crt
