#include "compare_noise.h"

#include "error.h"
#include "image_io.h"
#include "image_noise.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace crt {
namespace {

using stats::Mean;

/// The pair's common view: colour where both know the noise of it, else luminance, else what one of them knows and the other exact.
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
        const auto found = std::find(image.channels.begin(), image.channels.end(), std::array{"R", "G", "B"}[c]);
        at[c] = static_cast<std::size_t>(found - image.channels.begin());
    }
    for (std::size_t p = 0; p < std::size_t{image.width} * image.height; ++p) {
        const float* pixel = &image.pixels[p * image.channels.size()];
        if (like.channels.size() == 1) {
            exact.values.push_back(weights[0] * pixel[at[0]] + weights[1] * pixel[at[1]] + weights[2] * pixel[at[2]]);
        } else {
            for (const std::size_t place : at) exact.values.push_back(pixel[place]);
        }
    }
    exact.variances.assign(exact.values.size(), 0.0);
    exact.dof = std::numeric_limits<double>::infinity();
    return exact;
}

/// Mean over some pixels of one channel. Variances of independent pixels add, and so does what is known of them (Satterthwaite 1946).
class MeanOfPixels {
public:
    void add(double value, double variance) {
        sum_ += value;
        variances_ += variance;
        squares_ += variance * variance;
        ++count_;
    }
    Mean mean(double dof_of_each) const {
        const double n = static_cast<double>(count_);
        const double dof = squares_ > 0 ? dof_of_each * variances_ * variances_ / squares_ : dof_of_each;
        return {sum_ / n, variances_ / (n * n), dof};
    }

private:
    double sum_ = 0, variances_ = 0, squares_ = 0;
    std::size_t count_ = 0;
};

Mean imageMean(const NoisyImage& image, std::size_t channel) {
    if (!image.fold_means.empty()) return stats::meanOf(stats::summarize(image.fold_means[channel]));
    MeanOfPixels mean;
    for (std::size_t i = channel; i < image.values.size(); i += image.channels.size()) mean.add(image.values[i], image.variances[i]);
    return mean.mean(image.dof);
}

std::vector<Mean> tileMeans(const NoisyImage& image, std::uint32_t width, std::uint32_t across, std::uint32_t down) {
    const std::size_t channels = image.channels.size();
    std::vector<MeanOfPixels> sums(std::size_t{across} * down * channels);
    for (std::size_t i = 0; i < image.values.size(); ++i) {
        const std::size_t pixel = i / channels, x = pixel % width, y = pixel / width;
        const std::size_t tile = y / stats::kTileSide * across + x / stats::kTileSide;
        sums[tile * channels + i % channels].add(image.values[i], image.variances[i]);
    }
    std::vector<Mean> means;
    for (const MeanOfPixels& sum : sums) means.push_back(sum.mean(image.dof));
    return means;
}

ChannelBias biasOf(const std::string& name, const Mean& a, const Mean& b, double confidence) {
    ChannelBias bias{name, a.value, b.value, a.value - b.value, {}, stats::equalityP(a, b)};
    const double variance = a.variance + b.variance;
    double half = 0;
    if (variance > 0) {
        const double inverse_dof = (a.variance * a.variance / a.dof + b.variance * b.variance / b.dof) / (variance * variance);
        const double tail = 0.5 + 0.5 * confidence;
        half = std::sqrt(variance) * (inverse_dof > 0 ? stats::studentQuantile(tail, 1 / inverse_dof) : stats::normalQuantile(tail));
    }
    bias.interval = {bias.difference - half, bias.difference + half};
    return bias;
}

}  // namespace

NoiseComparison compareNoise(const Image& a, const Image& b) {
    NoiseComparison result;
    if (result.unknown = sameSeed(a, b); !result.unknown.empty()) return result;
    std::optional<Pair> pair = commonView(a, b);
    if (!pair) {
        result.unknown = "neither image says how large its noise is (render with output AOV 'variance' or 'error')";
        return result;
    }
    if (!pair->a) pair->a = exactly(a, *pair->b);
    if (!pair->b) pair->b = exactly(b, *pair->a);
    const NoisyImage &na = *pair->a, &nb = *pair->b;
    if (!std::all_of(na.values.begin(), na.values.end(), [](double v) { return std::isfinite(v); }) ||
        !std::all_of(nb.values.begin(), nb.values.end(), [](double v) { return std::isfinite(v); })) {
        result.unknown = "a value is not finite";
        return result;
    }
    result.source_a = na.source;
    result.source_b = nb.source;

    const std::size_t channels = na.channels.size();
    const double alpha = 1 - result.confidence;
    for (std::size_t c = 0; c < channels; ++c)
        result.channels.push_back(biasOf(na.channels[c], imageMean(na, c), imageMean(nb, c), result.confidence));

    result.tiles_across = (a.width + stats::kTileSide - 1) / stats::kTileSide;
    const std::uint32_t tiles_down = (a.height + stats::kTileSide - 1) / stats::kTileSide;
    const std::vector<Mean> tiles_a = tileMeans(na, a.width, result.tiles_across, tiles_down);
    const std::vector<Mean> tiles_b = tileMeans(nb, a.width, result.tiles_across, tiles_down);
    std::vector<double> p(tiles_a.size());
    for (std::size_t i = 0; i < p.size(); ++i) p[i] = stats::equalityP(tiles_a[i], tiles_b[i]);
    result.tiles = stats::holmFamily(p, alpha);

    p.resize(na.values.size());
    double squares = 0;
    std::size_t noisy = 0;
    for (std::size_t i = 0; i < p.size(); ++i) {
        p[i] = stats::equalityP({na.values[i], na.variances[i], na.dof}, {nb.values[i], nb.variances[i], nb.dof});
        const double difference = na.values[i] - nb.values[i], variance = na.variances[i] + nb.variances[i];
        result.z.push_back(p[i] == 1 && variance == 0 ? 0 : difference / std::sqrt(variance));
        if (variance > 0) {
            squares += difference * difference / variance;
            ++noisy;
        }
    }
    result.pixels = stats::sidakFamily(p, alpha);
    result.rms_z = noisy > 0 ? std::sqrt(squares / static_cast<double>(noisy)) : 0;
    return result;
}

// -------------------------------------------------------------------------------------------------------------------------- z map

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

void writeZMap(const std::string& path, const NoiseComparison& noise, std::uint32_t width, std::uint32_t height) {
    const std::optional<OutputFormat> format = formatOfFile(path);
    if (!format) throw Error(ErrorKind::Usage, fmt::format("the extension of '{}' is none of .exr, .pfm, .png, .ppm", path), {path});
    if (noise.z.empty()) throw Error(ErrorKind::Usage, fmt::format("there is no z map to write: {}", noise.unknown), {path});
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
        for (std::size_t c = 0; c < 3; ++c) image.pixels.push_back(static_cast<float>(noise.z[p * channels + (channels == 3 ? c : 0)]));
    writeImage(path, *format, image);
}

}  // namespace crt
