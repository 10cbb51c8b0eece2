#include "judge/stats/image_tests.h"

#include "base/error.h"
#include "judge/stats/pooled_tests.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace crt::stats {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TestFamily familyOf(std::span<const double> p_values, double alpha) {
    TestFamily family;
    family.tests = p_values.size();
    family.alpha = alpha;
    if (p_values.empty()) return family;
    if (const auto bad =
            std::find_if(p_values.begin(), p_values.end(), [](double p) { return std::isnan(p); });
        bad != p_values.end()) {
        family.smallest_p = kNan;
        family.worst = static_cast<std::size_t>(bad - p_values.begin());
        return family;
    }
    const auto worst = std::min_element(p_values.begin(), p_values.end());
    family.smallest_p = *worst;
    family.worst = static_cast<std::size_t>(worst - p_values.begin());
    return family;
}

GateResult::Channel compareMeans(const Summary& a, const Summary& b, const GateOptions& options) {
    GateResult::Channel channel;
    channel.difference = welch(a, b, options.confidence);
    const double scale = std::abs(b.mean);
    const Interval& interval = channel.difference.interval;
    if (scale == 0) {  // Nothing is relative to black; only black is equal to it.
        channel.relative = channel.difference.difference == 0
                               ? 0
                               : std::copysign(std::numeric_limits<double>::infinity(), a.mean);
        channel.relative_interval = channel.relative == 0 ? Interval{0, 0} : Interval{kNan, kNan};
        channel.verdict = channel.relative == 0 && a.variance == 0 ? Verdict::Pass
                          : interval.contains(0)                   ? Verdict::Inconclusive
                                                                   : Verdict::Fail;
        return channel;
    }
    channel.relative = channel.difference.difference / scale;
    channel.relative_interval = {interval.lower / scale, interval.upper / scale};
    channel.verdict = equivalence(channel.relative_interval, options.delta);
    return channel;
}

/// Of replicates of one distribution, n and m of them, all of one side lie on one side of all others in 2 of
/// C(n + m, n) orders (the extreme of Wilcoxon's rank sum test, 1945).
bool areSeparated(const std::vector<double>& a, const std::vector<double>& b, double delta, double alpha) {
    const double n = static_cast<double>(a.size()), m = static_cast<double>(b.size());
    const double log_orders = std::lgamma(n + m + 1) - std::lgamma(n + 1) - std::lgamma(m + 1);
    if (2 * std::exp(-log_orders) > alpha) return false;
    const auto [lowest_a, highest_a] = std::minmax_element(a.begin(), a.end());
    const auto [lowest_b, highest_b] = std::minmax_element(b.begin(), b.end());
    return *lowest_a > *highest_b + delta * std::abs(*highest_b) ||
           *highest_a < *lowest_b - delta * std::abs(*lowest_b);
}

/// Two-sided P that the farthest of `count` normal values, before it is known which, carries this share of
/// the sum of their squares (Grubbs 1950, by Student's distribution).
double outlierP(double share, std::uint64_t count) {
    if (count < 3) return 1;
    const double n = static_cast<double>(count), rest = (n - 1) - n * share;
    if (!(rest > 0)) return 0;
    return studentTwoSided(std::sqrt(n * (n - 2) * share / rest), n - 2);
}

/// Tiles of the middle channel (Y of XYZ, G of RGB) alone, since channels share their noise; and those with
/// noise alone.
double tileUniformity(const Replicates& a, const Replicates& b, const std::vector<double>& tile_p) {
    const std::uint32_t channels = a.channels(), middle = channels / 2;
    std::vector<double> p;
    for (std::size_t tile = 0; tile < a.tiles(); ++tile)
        if (a.tileMean(tile, middle).variance + b.tileMean(tile, middle).variance > 0)
            p.push_back(tile_p[tile * channels + middle]);
    return p.empty() ? 1 : kolmogorovSmirnovUniform(p);
}

/// Differences of the pixels' means in a tile.
DifferenceSums tileDifferences(const Replicates& a, const Replicates& b, std::size_t tile,
                               std::uint32_t channel) {
    const std::size_t x0 = tile % a.tilesAcross() * kTileSide, y0 = tile / a.tilesAcross() * kTileSide;
    DifferenceSums sums;
    for (std::size_t y = y0; y < std::min<std::size_t>(a.height(), y0 + kTileSide); ++y)
        for (std::size_t x = x0; x < std::min<std::size_t>(a.width(), x0 + kTileSide); ++x) {
            const std::size_t pixel = y * a.width() + x;
            sums.add(a.pixel(pixel, channel).mean - b.pixel(pixel, channel).mean);
        }
    return sums;
}

void judge(GateResult& result, const GateOptions& options) {
    bool fails = false, undecided = false;
    const auto because = [&result](bool& flag, std::string reason) {
        flag = true;
        result.reasons.push_back(std::move(reason));
    };
    for (std::size_t c = 0; c < result.channels.size(); ++c) {
        const std::string name =
            c < options.channel_names.size() ? options.channel_names[c] : std::to_string(c);
        if (result.channels[c].verdict == Verdict::Fail)
            because(fails, fmt::format("the means of channel {} differ by more than delta", name));
        if (result.channels[c].verdict == Verdict::Inconclusive)
            because(undecided,
                    fmt::format("the interval of channel {} reaches beyond delta: more samples are needed",
                                name));
    }
    if (result.tiles.rejected > 0)
        because(fails, fmt::format("{} of {} tile tests differ", result.tiles.rejected, result.tiles.tests));
    if (result.pixels.rejected > 0)
        because(fails,
                fmt::format("{} of {} pixel tests differ", result.pixels.rejected, result.pixels.tests));
    // A few values that carry the answer make intervals too short and too long alike: only ranks, which no
    // tail moves, can be trusted.
    if (result.largest.isHeavyTailed(options.largest_share)) {
        fails = std::any_of(result.channels.begin(), result.channels.end(),
                            [](const GateResult::Channel& channel) { return channel.separated; });
        because(undecided,
                fmt::format("one value carries {:.1f} % of the squared error, more than normal noise "
                            "allows: more samples are needed",
                            100 * result.largest.share));
    }
    result.verdict = fails ? Verdict::Fail : undecided ? Verdict::Inconclusive : Verdict::Pass;
}

}  // namespace

Mean meanOf(const Summary& s) {
    const double n = static_cast<double>(s.count);
    return {s.mean, s.variance / n, n - 1};
}

double equalityP(const Mean& a, const Mean& b) {
    const double difference = a.value - b.value, variance = a.variance + b.variance;
    if (!std::isfinite(difference) || !std::isfinite(variance)) return kNan;
    if (std::abs(difference) <= 0x1p-20 * std::max(std::abs(a.value), std::abs(b.value))) return 1;
    if (variance == 0) return 0;
    const double t = difference / std::sqrt(variance), share_a = a.variance / variance,
                 share_b = b.variance / variance;
    const double inverse_dof = share_a * share_a / a.dof +
                               share_b * share_b / b.dof;  // Welch–Satterthwaite; 0 when both are known.
    return inverse_dof > 0 ? studentTwoSided(t, 1 / inverse_dof) : normalTwoSided(t);
}

TestFamily holmFamily(std::span<const double> p_values, double alpha) {
    TestFamily family = familyOf(p_values, alpha);
    if (family.tests == 0 || std::isnan(family.smallest_p)) return family;
    const std::vector<bool> rejected = holm(p_values, alpha);
    family.rejected = static_cast<std::uint64_t>(std::count(rejected.begin(), rejected.end(), true));
    family.smallest_p = std::min(1.0, family.smallest_p * static_cast<double>(family.tests));
    return family;
}

TestFamily sidakFamily(std::span<const double> p_values, double alpha) {
    TestFamily family = familyOf(p_values, alpha);
    if (family.tests == 0 || std::isnan(family.smallest_p)) return family;
    const double limit = sidak(alpha, family.tests);
    family.rejected = static_cast<std::uint64_t>(
        std::count_if(p_values.begin(), p_values.end(), [&](double p) { return p < limit; }));
    family.smallest_p =
        family.smallest_p >= 1
            ? 1
            : -std::expm1(static_cast<double>(family.tests) * std::log1p(-family.smallest_p));
    return family;
}

// ----------------------------------------------------------------------------------------------- replicates

Replicates::Replicates(std::uint32_t width, std::uint32_t height, std::uint32_t channels)
    : width_(width),
      height_(height),
      channels_(channels),
      pixels_(std::size_t{width} * height * channels),
      image_means_(channels),
      tile_means_(tiles() * channels) {}

void Replicates::add(std::span<const double> image) {
    if (image.size() != pixels_.size())
        throw Error(ErrorKind::Internal, "a replicate differs in size from the earlier ones");
    ++count_;
    const double n = static_cast<double>(count_);
    std::vector<double> tile_sums(tile_means_.size(), 0.0), image_sums(channels_, 0.0);
    std::vector<std::uint32_t> tile_pixels(tiles(), 0);
    for (std::uint32_t y = 0; y < height_; ++y)
        for (std::uint32_t x = 0; x < width_; ++x) {
            const std::size_t pixel = std::size_t{y} * width_ + x;
            const std::size_t tile = std::size_t{y / kTileSide} * tilesAcross() + x / kTileSide;
            ++tile_pixels[tile];
            for (std::uint32_t c = 0; c < channels_; ++c) {
                const double v = image[pixel * channels_ + c];
                not_finite_ += !std::isfinite(v);
                Moments& m = pixels_[pixel * channels_ + c];
                const double step = v - m.mean;
                m.mean += step / n;
                m.squares += step * (v - m.mean);
                m.lowest = count_ == 1 ? v : std::min(m.lowest, v);
                m.highest = count_ == 1 ? v : std::max(m.highest, v);
                tile_sums[tile * channels_ + c] += v;
                image_sums[c] += v;
            }
        }
    for (std::size_t i = 0; i < tile_sums.size(); ++i)
        tile_means_[i].push_back(tile_sums[i] / tile_pixels[i / channels_]);
    for (std::uint32_t c = 0; c < channels_; ++c)
        image_means_[c].push_back(image_sums[c] / (static_cast<double>(width_) * height_));
}

Summary Replicates::imageMean(std::uint32_t channel) const { return summarize(image_means_[channel]); }
Summary Replicates::tileMean(std::size_t tile, std::uint32_t channel) const {
    return summarize(tile_means_[tile * channels_ + channel]);
}

Summary Replicates::pixel(std::size_t pixel, std::uint32_t channel) const {
    const Moments& m = pixels_[pixel * channels_ + channel];
    return {m.mean, count_ < 2 ? kNan : m.squares / static_cast<double>(count_ - 1), count_};
}

LargestValue Replicates::largestValue() const {
    const auto farthestSquare = [](const Moments& m) {
        const double farthest = std::max(m.highest - m.mean, m.mean - m.lowest);
        return farthest * farthest;
    };
    double sum = 0, largest = 0, of_its_pixel = 0;
    for (const Moments& m : pixels_) {
        sum += m.squares;
        if (!(farthestSquare(m) > largest)) continue;
        largest = farthestSquare(m);
        of_its_pixel = m.squares;
    }
    if (!(sum > 0)) return {};
    const auto able = std::count_if(pixels_.begin(), pixels_.end(),
                                    [largest](const Moments& m) { return m.squares >= largest; });
    const double values = static_cast<double>(able) * static_cast<double>(count_);
    return {largest / sum, std::min(1.0, values * outlierP(largest / of_its_pixel, count_))};
}

GateResult gate(const Replicates& a, const Replicates& b, const GateOptions& options) {
    if (a.width() != b.width() || a.height() != b.height() || a.channels() != b.channels() ||
        a.count() < 2 || b.count() < 2)
        throw Error(ErrorKind::Internal,
                    "the test needs two sets of images of the same size, with two replicates or more in "
                    "each");
    GateResult result;
    result.not_finite = a.notFinite() + b.notFinite();
    if (result.not_finite > 0) {
        result.reasons.push_back(
            fmt::format("{} values are NaN or infinite: the test is void", result.not_finite));
        return result;
    }
    const double alpha = 1 - options.confidence;
    const std::uint32_t channels = a.channels();
    for (std::uint32_t c = 0; c < channels; ++c) {
        result.channels.push_back(compareMeans(a.imageMean(c), b.imageMean(c), options));
        result.channels.back().separated =
            areSeparated(a.imageMeans(c), b.imageMeans(c), options.delta, alpha / channels);
    }

    // A few replicates agree by chance, exactly where samples are counted: then there seems to be no noise.
    const bool few = std::min(a.count(), b.count()) < kFewestForPixels;
    std::vector<double> p;
    for (std::size_t tile = 0; tile < a.tiles(); ++tile)
        for (std::uint32_t c = 0; c < channels; ++c) {
            p.push_back(equalityP(meanOf(a.tileMean(tile, c)), meanOf(b.tileMean(tile, c))));
            if (few) p.back() = std::max(p.back(), symmetricP(tileDifferences(a, b, tile, c)));
        }
    result.tiles = holmFamily(p, alpha);
    result.tile_uniformity_p = tileUniformity(a, b, p);

    p.clear();
    for (std::size_t pixel = 0; !few && pixel < std::size_t{a.width()} * a.height(); ++pixel)
        for (std::uint32_t c = 0; c < channels; ++c)
            p.push_back(equalityP(meanOf(a.pixel(pixel, c)), meanOf(b.pixel(pixel, c))));
    result.pixels = sidakFamily(p, alpha);

    const LargestValue of_a = a.largestValue(), of_b = b.largestValue();
    const bool heavy_a = of_a.isHeavyTailed(options.largest_share),
               heavy_b = of_b.isHeavyTailed(options.largest_share);
    result.largest = (heavy_a == heavy_b ? of_a.share >= of_b.share : heavy_a) ? of_a : of_b;
    judge(result, options);
    return result;
}

}  // namespace crt::stats
