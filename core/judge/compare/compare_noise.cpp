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
#include <functional>
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

/// An image without its own noise, with the settings of the other.
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
/// The largest squared differences of a tile that do not count: of fireflies two may fall into one pixel,
/// and then its replicates agree.
constexpr std::size_t kFirefliesOfTile = 2;
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
    bool stated() const { return !a.source.empty() || !b.source.empty(); }
    /// A − B; 0 where that is rounding.
    double difference(std::size_t i) const {
        const double d = a.values[i] - b.values[i];
        return std::abs(d) <= stats::roundingOf(a.values[i], b.values[i]) ? 0 : d;
    }
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

/// Both the stated noise and the symmetry of differences must rule equality out; without the former the
/// latter alone.
ChannelBias biasOf(const View& view, std::size_t channel, double confidence) {
    PixelSums sums_a, sums_b;
    DifferenceSums differences;
    for (std::size_t i = channel; i < view.a.values.size(); i += view.channels()) {
        sums_a.add(view.a.values[i], view.a.variances[i]);
        sums_b.add(view.b.values[i], view.b.variances[i]);
        differences.add(view.difference(i));
    }
    const auto meanOf = [channel](const NoisyImage& image, const PixelSums& sums) {
        return image.fold_means.empty() ? sums.mean(image.dof)
                                        : stats::meanOf(stats::summarize(image.fold_means[channel]));
    };
    Mean a = meanOf(view.a, sums_a), b = meanOf(view.b, sums_b);
    learnVariance(a, b, view.samples_ratio);
    learnVariance(b, a, 1 / view.samples_ratio);
    ChannelBias bias{view.a.channels[channel], a.value, b.value, a.value - b.value, {}, 1};
    bias.p = view.stated() ? stats::carefulEqualityP(a, b) : stats::symmetricP(differences);
    double half = view.stated() ? stats::carefulHalfWidth(a, b, confidence) : 0;
    if (!view.stated() || differences.count >= stats::kFewestForSymmetry) {
        bias.p = std::max(bias.p, stats::symmetricP(differences));
        // Of the differences that are not 0, spread over all pixels.
        const double part = static_cast<double>(differences.count) / static_cast<double>(sums_a.count);
        const double symmetric = stats::symmetricHalfWidth(differences, confidence);
        half = std::max(half, std::isinf(symmetric) ? symmetric : part * symmetric);
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

/// Sum over `pixels` from the variance of their mean, for stats::excessP.
Mean sumOf(const Mean& mean, std::uint64_t pixels, double dof) {
    const auto n = static_cast<double>(pixels);
    return {0, mean.variance * n * n, stats::scatteredDof(mean.dof, dof)};
}

/// By the squared differences of a tile without its largest.
double tileExcessP(std::vector<double>& squares, const Mean& stated) {
    if (squares.size() <= kFirefliesOfTile) return 1;
    std::nth_element(squares.begin(), squares.begin() + kFirefliesOfTile, squares.end(), std::greater<>());
    PixelSums sums;
    for (std::size_t i = kFirefliesOfTile; i < squares.size(); ++i) sums.add(0, squares[i]);
    return stats::excessP(sums, stated);
}

stats::TestFamily testTiles(const View& view, double alpha) {
    const std::vector<PixelSums> tiles_a = tileSums(view, view.a), tiles_b = tileSums(view, view.b);
    std::vector<DifferenceSums> differences(tiles_a.size());
    std::vector<std::vector<double>> squares(tiles_a.size());
    for (std::size_t i = 0; i < view.a.values.size(); ++i) {
        const double difference = view.difference(i);
        differences[view.tileOf(i)].add(difference);
        squares[view.tileOf(i)].push_back(difference * difference);
    }
    std::vector<double> p;
    for (std::size_t i = 0; i < tiles_a.size(); ++i) {
        p.push_back(stats::symmetricP(differences[i]));
        if (!view.stated()) continue;
        const Mean a = guardedMean(view, tiles_a, i, view.a.dof),
                   b = guardedMean(view, tiles_b, i, view.b.dof);
        const double of_mean = std::max(p.back(), stats::carefulEqualityP(a, b));
        const std::uint64_t pixels = tiles_a[i].count;
        const double of_squares = tileExcessP(
            squares[i], stats::summedVariance(sumOf(a, pixels, view.a.dof), sumOf(b, pixels, view.b.dof)));
        // Either may raise the alarm, each at half the level.
        p.back() = std::isnan(of_mean) ? of_mean : std::min(1.0, 2 * std::min(of_mean, of_squares));
    }
    return stats::holmFamily(p, alpha);
}

// ---------------------------------------------------------------------------------------------- colour

/// Differences of colour at equal luminance: A's colour times B's luminance less B's times A's, over the
/// mean of both luminances. Noise of brightness cancels, and where the images differ in their seeds alone
/// what is left is symmetric about 0.
void judgeColour(NoiseComparison& result, const NoisyImage& a, const NoisyImage& b, const Image& image) {
    const std::array<double, 3> weights = luminanceWeights(image);
    const auto luminance = [&weights](const NoisyImage& of, std::size_t pixel) {
        return weights[0] * of.values[3 * pixel] + weights[1] * of.values[3 * pixel + 1] +
               weights[2] * of.values[3 * pixel + 2];
    };
    const std::size_t pixels = a.values.size() / 3;
    double mean = 0;
    for (std::size_t p = 0; p < pixels; ++p) mean += luminance(b, p) / static_cast<double>(pixels);
    for (std::size_t c = 0; c < 3; ++c) {
        DifferenceSums shifts;
        for (std::size_t p = 0; p < pixels; ++p) {
            const double of_a = luminance(a, p), of_b = luminance(b, p),
                         both = std::abs(of_a) + std::abs(of_b);
            if (!(both > 0)) continue;
            const double first = 2 * a.values[3 * p + c] * of_b / both,
                         second = 2 * b.values[3 * p + c] * of_a / both;
            if (std::abs(first - second) > 8 * stats::roundingOf(first, second)) shifts.add(first - second);
        }
        if (shifts.count > 0 && shifts.count < stats::kFewestForSymmetry) {
            result.colours.clear();
            result.colour_unjudged = fmt::format(
                "the images state the noise of luminance alone, and only {} pixels differ in colour, too "
                "few to "
                "judge by their signs",
                shifts.count);
            return;
        }
        const double shift =
            mean != 0 ? shifts.sum / static_cast<double>(pixels) / std::abs(mean) : shifts.sum;
        result.colours.push_back({a.channels[c], shift, stats::symmetricP(shifts)});
    }
}

// ---------------------------------------------------------------------------------------------- pixels

/// Pooled variances of the differences; [pixel][channel].
std::vector<double> pooledVariances(const View& view) {
    const std::size_t channels = view.channels();
    const double dof = std::min(view.a.dof, view.b.dof);
    std::vector<double> all(view.a.variances.size()), plane(all.size() / channels);
    for (std::size_t c = 0; c < channels; ++c) {
        for (std::size_t p = 0; p < plane.size(); ++p)
            plane[p] = view.a.variances[p * channels + c] + view.b.variances[p * channels + c];
        const stats::PooledVariances pooled = stats::pooledVariances(plane, view.width, view.height, dof);
        for (std::size_t p = 0; p < plane.size(); ++p) all[p * channels + c] = pooled.variances[p];
    }
    return all;
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
    const std::vector<double> pooled = pooledVariances(view);
    PixelSums squares, of_a, of_b;
    for (std::size_t i = 0; i < view.a.values.size(); ++i) {
        const double difference = view.difference(i);
        result.z.push_back(difference == 0 ? 0 : difference / std::sqrt(pooled[i]));
        squares.add(0, difference * difference);
        of_a.add(0, view.a.variances[i]);
        of_b.add(0, view.b.variances[i]);
    }
    const auto summed = [](const PixelSums& sums, double dof) {
        return Mean{0, sums.variance, stats::scatteredDof(sums.degreesOfFreedom(dof), dof)};
    };
    Mean a = summed(of_a, view.a.dof), b = summed(of_b, view.b.dof);
    learnVariance(a, b, view.samples_ratio);
    learnVariance(b, a, 1 / view.samples_ratio);
    result.rms_z_p = stats::excessP(squares, stats::summedVariance(a, b));
    const double fewest = std::min(view.a.dof, view.b.dof);
    if (fewest < kFewestPixelDof) {
        result.pixels_untested =
            fmt::format("a variance with {:.3g} degree{} of freedom is too uncertain for one pixel", fewest,
                        fewest == 1 ? "" : "s");
    } else {
        std::vector<double> p;
        for (std::size_t i = 0; i < view.a.values.size(); ++i) p.push_back(pixelP(view, i));
        result.pixels = stats::sidakFamily(p, alpha);
    }
    const double variances = of_a.variance + of_b.variance;
    result.rms_z = squares.variance > 0 ? std::sqrt(squares.variance / variances) : 0;
}

}  // namespace

bool NoiseComparison::anyBeyondNoise() const {
    return rmsBeyondNoise() || tiles.rejected > 0 || pixels.rejected > 0 ||
           std::any_of(channels.begin(), channels.end(), [](const auto& c) { return c.beyondNoise(); }) ||
           std::any_of(colours.begin(), colours.end(), [&](const auto& c) { return beyondNoise(c); });
}

NoiseComparison compareNoise(const Image& a, const Image& b) {
    NoiseComparison result;
    if (result.unknown = sameSeed(a, b); !result.unknown.empty()) return result;
    // Never taken as exact: that it knows its noise in part is no reason to forget it.
    for (const auto& [image, name] : {std::pair{&a, "A"}, {&b, "B"}})
        if (statesNoise(*image) && !noisyImage(*image, NoiseOf::Color) &&
            !noisyImage(*image, NoiseOf::Luminance)) {
            result.unknown = fmt::format(
                "{} lacks the noise of some pixels (they have too few samples, or lost some)",
                name);
            return result;
        }
    NoisyImage colour;
    colour.channels = {"R", "G", "B"};
    Pair pair = commonView(a, b).value_or(Pair{exactly(a, colour), exactly(b, colour)});
    if (!pair.a) pair.a = exactly(a, *pair.b);
    if (!pair.b) pair.b = exactly(b, *pair.a);
    const View view{std::move(*pair.a), std::move(*pair.b), a.width, a.height, samplesRatio(a, b)};
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
    result.stated = view.stated();
    if (result.stated) {
        testPixels(result, view, alpha);
    } else {
        result.pixels_untested = "neither image states its noise";
    }
    if (view.channels() == 1) judgeColour(result, exactly(a, colour), exactly(b, colour), a);
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
        throw Error(ErrorKind::Usage, fmt::format("'{}' does not end in {}", path, kImageEnds), {path});
    if (noise.z.empty())
        throw Error(ErrorKind::Usage,
                    fmt::format("there is no z map to write: {}",
                                noise.unknown.empty() ? noise.pixels_untested : noise.unknown),
                    {path});
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
