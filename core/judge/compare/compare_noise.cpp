#include "judge/compare/compare_noise.h"

#include "base/error.h"
#include "film/pooled_variance.h"
#include "image/image_io.h"
#include "judge/compare/image_noise.h"
#include "judge/stats/pooled_tests.h"
#include "scene/yaml/yaml_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace crt {
namespace {

using stats::Mean;

/// The pair's common view: colour where both know the noise of it, else luminance, else what one of them
/// knows and the other exact.
struct Pair {
    std::optional<NoisyImage> a, b;
};
std::optional<Pair> commonView(const Image& a, const Image& b) {
    for (const NoiseOf what : {NoiseOf::Color, NoiseOf::Luminance})
        if (Pair pair{noisyImage(a, what), noisyImage(b, what)}; pair.a && pair.b) return pair;
    for (const NoiseOf what : {NoiseOf::Color, NoiseOf::Luminance})
        if (Pair pair{noisyImage(a, what), noisyImage(b, what)}; pair.a || pair.b) return pair;
    return std::nullopt;
}

/// An image without noise of its own, as the other is seen.
NoisyImage exactly(const Image& image, const NoisyImage& like) {
    NoisyImage exact;
    exact.channels = like.channels;
    const std::array<double, 3> weights = luminanceWeights(image);
    std::array<std::size_t, 3> at{};
    for (std::size_t c = 0; c < 3; ++c) {
        const auto found =
            std::find(image.channels.begin(), image.channels.end(), std::array{"R", "G", "B"}[c]);
        at[c] = static_cast<std::size_t>(found - image.channels.begin());
    }
    for (std::size_t p = 0; p < std::size_t{image.width} * image.height; ++p) {
        const float* pixel = &image.pixels[p * image.channels.size()];
        if (like.channels.size() == 1) {
            exact.values.push_back(weights[0] * pixel[at[0]] + weights[1] * pixel[at[1]] +
                                   weights[2] * pixel[at[2]]);
        } else {
            for (const std::size_t place : at) exact.values.push_back(pixel[place]);
        }
    }
    exact.variances.assign(exact.values.size(), 0.0);
    exact.dof = std::numeric_limits<double>::infinity();
    return exact;
}

using stats::DifferenceSums;
using stats::PixelSums;

/// Tiles about a tile, and pixels about a pixel, whose stated variances stand beside its own.
constexpr std::uint32_t kTileWindow = 2, kPixelWindow = stats::kPooledRadius;
/// Below it two replicates or four agree by chance, exactly where samples are counted, and then a pixel
/// seems to have no noise.
constexpr double kFewestPixelDof = 7;

/// Two images seen alike, and where their tiles lie.
struct View {
    NoisyImage a, b;
    std::uint32_t width = 0, height = 0;
    /// A's samples over B's; 1 where one does not say, or is a reference, which is rendered in another way.
    double samples_ratio = 1;

    std::size_t channels() const { return a.channels.size(); }
    std::uint32_t across() const { return (width + stats::kTileSide - 1) / stats::kTileSide; }
    std::uint32_t down() const { return (height + stats::kTileSide - 1) / stats::kTileSide; }
    /// Index of tile and channel in which value `i` lies.
    std::size_t tileOf(std::size_t i) const {
        const std::size_t pixel = i / channels(), x = pixel % width, y = pixel / width;
        return (y / stats::kTileSide * across() + x / stats::kTileSide) * channels() + i % channels();
    }
};

/// Calls body with the index of each place within `radius` of (x, y).
template <class Body>
void forWindow(std::uint32_t x, std::uint32_t y, std::uint32_t width, std::uint32_t height,
               std::uint32_t radius, Body&& body) {
    for (std::uint32_t v = y > radius ? y - radius : 0; v < std::min(height, y + radius + 1); ++v)
        for (std::uint32_t u = x > radius ? x - radius : 0; u < std::min(width, x + radius + 1); ++u)
            body(std::size_t{v} * width + u);
}

// ------------------------------------------------------------------------------------------------ mean

/// By the metadata of two renders; see View::samples_ratio.
double samplesRatio(const Image& a, const Image& b) {
    const auto samples = [](const Image& image) {
        return parseNumber(metadataValue(image, "crt/spp")).value.value_or(0);
    };
    const double of_a = samples(a), of_b = samples(b);
    return of_a > 0 && of_b > 0 && !hasFolds(a) && !hasFolds(b) ? of_a / of_b : 1;
}

/// The mean of `ratio` times the other's samples has at least the variance that follows from the other's:
/// with fewer samples it may have met none of the rare paths that carry much of the light, and then does not
/// know of their noise.
void learnVariance(Mean& mean, const Mean& other, double ratio) {
    if (!(ratio < 1) || !(other.variance / ratio > mean.variance)) return;
    mean.variance = other.variance / ratio;
    mean.dof = other.dof;
}

/// Both the stated noise and the symmetry of differences must rule equality out.
ChannelBias biasOf(const View& view, std::size_t channel, double confidence) {
    PixelSums sums_a, sums_b;
    DifferenceSums differences;
    for (std::size_t i = channel; i < view.a.values.size(); i += view.channels()) {
        sums_a.add(view.a.values[i], view.a.variances[i]);
        sums_b.add(view.b.values[i], view.b.variances[i]);
        differences.add(view.a.values[i] - view.b.values[i]);
    }
    const auto meanOf = [channel](const NoisyImage& image, const PixelSums& sums) {
        return image.fold_means.empty() ? sums.mean(image.dof)
                                        : stats::meanOf(stats::summarize(image.fold_means[channel]));
    };
    Mean a = meanOf(view.a, sums_a), b = meanOf(view.b, sums_b);
    learnVariance(a, b, view.samples_ratio);
    learnVariance(b, a, 1 / view.samples_ratio);
    ChannelBias bias{view.a.channels[channel], a.value, b.value, a.value - b.value, {}, 1};
    bias.p = stats::carefulEqualityP(a, b);
    double half = stats::carefulHalfWidth(a, b, confidence);
    if (differences.count >= stats::kFewestForSymmetry) {
        bias.p = std::max(bias.p, stats::symmetricP(differences));
        half = std::max(half, stats::symmetricHalfWidth(differences, confidence));
    }
    bias.interval = {bias.difference - half, bias.difference + half};
    return bias;
}

// ----------------------------------------------------------------------------------------------- tiles

std::vector<PixelSums> tileSums(const View& view, const NoisyImage& image) {
    std::vector<PixelSums> sums(std::size_t{view.across()} * view.down() * view.channels());
    for (std::size_t i = 0; i < image.values.size(); ++i)
        sums[view.tileOf(i)].add(image.values[i], image.variances[i]);
    return sums;
}

/// Mean of a tile, with the larger of two variances: its own, and that of a tile of average pixels of the
/// tiles about it. Where light comes by rare paths that no sample of the tile has met, its own is too small.
Mean guardedMean(const View& view, const std::vector<PixelSums>& tiles, std::size_t tile_and_channel,
                 double dof) {
    const std::size_t channels = view.channels(), tile = tile_and_channel / channels;
    const PixelSums& own = tiles[tile_and_channel];
    PixelSums window;
    forWindow(static_cast<std::uint32_t>(tile % view.across()),
              static_cast<std::uint32_t>(tile / view.across()), view.across(), view.down(), kTileWindow,
              [&](std::size_t other) { window.add(tiles[other * channels + tile_and_channel % channels]); });
    Mean mean = own.mean(dof);
    const double around =
        window.variance / static_cast<double>(window.count) / static_cast<double>(own.count);
    if (around > mean.variance) {
        mean.variance = around;
        mean.dof = window.degreesOfFreedom(dof);
    }
    return mean;
}

stats::TestFamily testTiles(const View& view, double alpha) {
    const std::vector<PixelSums> tiles_a = tileSums(view, view.a), tiles_b = tileSums(view, view.b);
    std::vector<DifferenceSums> differences(tiles_a.size());
    for (std::size_t i = 0; i < view.a.values.size(); ++i)
        differences[view.tileOf(i)].add(view.a.values[i] - view.b.values[i]);
    std::vector<double> p;
    for (std::size_t i = 0; i < tiles_a.size(); ++i)
        p.push_back(std::max(stats::symmetricP(differences[i]),
                             stats::carefulEqualityP(guardedMean(view, tiles_a, i, view.a.dof),
                                                     guardedMean(view, tiles_b, i, view.b.dof))));
    return stats::holmFamily(p, alpha);
}

// ---------------------------------------------------------------------------------------------- pixels

/// Means of the variances about each pixel; [pixel][channel].
std::vector<double> variancesAround(const View& view, const NoisyImage& image) {
    const std::size_t channels = view.channels();
    std::vector<double> around(image.variances.size()), plane(image.variances.size() / channels);
    for (std::size_t c = 0; c < channels; ++c) {
        for (std::size_t p = 0; p < plane.size(); ++p) plane[p] = image.variances[p * channels + c];
        const std::vector<double> means = stats::windowMeans(plane, view.width, view.height, kPixelWindow);
        for (std::size_t p = 0; p < plane.size(); ++p) around[p * channels + c] = means[p];
    }
    return around;
}

/// One value with the mean variance of the pixels about it, and the degrees of freedom of all of them.
Mean pooledPixel(const View& view, const NoisyImage& image, std::size_t i) {
    const std::size_t channels = view.channels(), pixel = i / channels;
    PixelSums window;
    forWindow(static_cast<std::uint32_t>(pixel % view.width), static_cast<std::uint32_t>(pixel / view.width),
              view.width, view.height, kPixelWindow,
              [&](std::size_t other) { window.add(0, image.variances[other * channels + i % channels]); });
    return {image.values[i], window.variance / static_cast<double>(window.count),
            window.degreesOfFreedom(image.dof)};
}

/// By its own variance, with the few degrees of freedom that this has, and by those about it: one's own may
/// be 0 by chance.
double pixelP(const View& view, std::size_t i) {
    const NoisyImage &a = view.a, &b = view.b;
    const double own =
        stats::carefulEqualityP({a.values[i], a.variances[i], a.dof}, {b.values[i], b.variances[i], b.dof});
    constexpr double kNotWorthPooling = 0.01;
    if (std::isnan(own) || own > kNotWorthPooling) return own;
    const Mean around_a = pooledPixel(view, a, i), around_b = pooledPixel(view, b, i);
    // Replicates that agree, up to rounding, amid noise do so by chance: nothing is known of this pixel.
    constexpr double kRounding = 1e-6;
    const auto agrees = [i](const NoisyImage& image, const Mean& around) {
        return image.variances[i] < kRounding * around.variance;
    };
    if (agrees(a, around_a) || agrees(b, around_b)) return 1;
    return std::max(own, stats::carefulEqualityP(around_a, around_b));
}

/// Fills z, rms_z and the pixels' tests.
void testPixels(NoiseComparison& result, const View& view, double alpha) {
    const std::vector<double> around_a = variancesAround(view, view.a),
                              around_b = variancesAround(view, view.b);
    double squares = 0, variances = 0;
    for (std::size_t i = 0; i < view.a.values.size(); ++i) {
        const Mean a{view.a.values[i], view.a.variances[i], view.a.dof},
            b{view.b.values[i], view.b.variances[i], view.b.dof};
        const double difference = a.value - b.value, own = a.variance + b.variance;
        const double variance = std::max(own, around_a[i] + around_b[i]);
        result.z.push_back(
            variance == 0 && stats::carefulEqualityP(a, b) == 1 ? 0 : difference / std::sqrt(variance));
        if (own > 0) squares += difference * difference;
        variances += own;
    }
    const double fewest = std::min(view.a.dof, view.b.dof);
    if (fewest < kFewestPixelDof) {
        result.pixels_untested =
            fmt::format("a variance of {:.3g} degrees of freedom says too little of one pixel", fewest);
    } else {
        std::vector<double> p;
        for (std::size_t i = 0; i < view.a.values.size(); ++i) p.push_back(pixelP(view, i));
        result.pixels = stats::sidakFamily(p, alpha);
    }
    result.rms_z = variances > 0 ? std::sqrt(squares / variances) : 0;
}

}  // namespace

NoiseComparison compareNoise(const Image& a, const Image& b) {
    NoiseComparison result;
    if (result.unknown = sameSeed(a, b); !result.unknown.empty()) return result;
    // Never taken as exact: that it knows its noise in part is no reason to forget it.
    for (const auto& [image, name] : {std::pair{&a, "A"}, {&b, "B"}})
        if (statesNoise(*image) && !noisyImage(*image, NoiseOf::Color) &&
            !noisyImage(*image, NoiseOf::Luminance)) {
            result.unknown = fmt::format(
                "{} does not know the noise of all its pixels (they have too few samples, or lost some)",
                name);
            return result;
        }
    std::optional<Pair> pair = commonView(a, b);
    if (!pair) {
        result.unknown =
            "neither image says how large its noise is (render with output AOV 'variance' or 'error')";
        return result;
    }
    if (!pair->a) pair->a = exactly(a, *pair->b);
    if (!pair->b) pair->b = exactly(b, *pair->a);
    const View view{std::move(*pair->a), std::move(*pair->b), a.width, a.height, samplesRatio(a, b)};
    const auto finite = [](const NoisyImage& image) {
        return std::all_of(image.values.begin(), image.values.end(),
                           [](double v) { return std::isfinite(v); });
    };
    if (!finite(view.a) || !finite(view.b)) {
        result.unknown = "a value is not finite";
        return result;
    }
    result.source_a = view.a.source;
    result.source_b = view.b.source;
    for (std::size_t c = 0; c < view.channels(); ++c)
        result.channels.push_back(biasOf(view, c, result.confidence));
    result.tiles_across = view.across();
    const double alpha = 1 - result.confidence;
    result.tiles = testTiles(view, alpha);
    testPixels(result, view, alpha);
    return result;
}

// ---------------------------------------------------------------------------------------------------- z map

Image zMap(const NoiseComparison& noise, std::uint32_t width, std::uint32_t height) {
    constexpr double kFull = 5;
    Image image;
    image.width = width;
    image.height = height;
    image.channels = {"R", "G", "B"};
    const std::size_t channels = noise.channels.size();
    for (std::size_t p = 0; p < std::size_t{width} * height; ++p) {
        double z = 0;
        for (std::size_t c = 0; c < channels; ++c)
            if (const double v = noise.z[p * channels + c]; std::abs(v) > std::abs(z)) z = v;
        const auto faded = static_cast<float>(1 - std::min(1.0, std::abs(z) / kFull));
        if (std::isinf(z)) {
            image.pixels.insert(image.pixels.end(), {0, 0, 0});
        } else if (z > 0) {
            image.pixels.insert(image.pixels.end(), {1, faded, faded});
        } else {
            image.pixels.insert(image.pixels.end(), {faded, faded, 1});
        }
    }
    return image;
}

void writeZMap(const std::string& path, const NoiseComparison& noise, std::uint32_t width,
               std::uint32_t height) {
    const std::optional<OutputFormat> format = formatOfFile(path);
    if (!format)
        throw Error(ErrorKind::Usage,
                    fmt::format("the extension of '{}' is none of .exr, .pfm, .png, .ppm", path), {path});
    if (noise.z.empty())
        throw Error(ErrorKind::Usage, fmt::format("there is no z map to write: {}", noise.unknown), {path});
    if (*format != OutputFormat::Exr && *format != OutputFormat::Pfm) {
        writeImage(path, *format, zMap(noise, width, height));
        return;
    }
    Image image;
    image.width = width;
    image.height = height;
    image.channels = {"R", "G", "B"};
    const std::size_t channels = noise.channels.size();
    for (std::size_t p = 0; p < std::size_t{width} * height; ++p)
        for (std::size_t c = 0; c < 3; ++c)
            image.pixels.push_back(static_cast<float>(noise.z[p * channels + (channels == 3 ? c : 0)]));
    writeImage(path, *format, image);
}

}  // namespace crt
