/// Are two estimators' images equal? Means over the image by equivalence, tiles and pixels by tests that
/// count how many they are, and a guard that knows when too few samples carry the answer for any of it to be
/// trusted.
#pragma once

#include "base/statistics.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace crt::stats {

/// A mean that knows its error.
struct Mean {
    double value = 0;
    double variance = 0;  ///< Of the mean.
    double dof = 0;       ///< Of the variance; infinite where it is known.
};
Mean meanOf(const Summary& summary);

/// Welch's two-sided P that two means are equal. Differences of 2^-20 of the value or less are rounding, and
/// P is 1: without noise, say in the sky, there is no other way to tell them from bias. NaN when a mean or
/// variance is not finite.
double equalityP(const Mean& a, const Mean& b);

/// Many tests of which none should fail.
struct TestFamily {
    std::uint64_t tests = 0, rejected = 0;
    double smallest_p = 1;     ///< Adjusted for their number; NaN when any is.
    std::size_t worst = 0;     ///< Index of the smallest.
    double alpha = 0;          ///< That any fails when nothing is wrong.
};
/// Adjusted and rejected by Holm's steps: however the tests depend on each other.
TestFamily holmFamily(std::span<const double> p_values, double alpha);
/// By Šidák's one limit. Exact for independent tests; on the safe side where they agree with each other,
/// as channels do.
TestFamily sidakFamily(std::span<const double> p_values, double alpha);

/// Side of a square of pixels that are tested together.
inline constexpr std::uint32_t kTileSide = 8;

/// The value that lies farthest from its mean, among all values of all replicates.
struct LargestValue {
    /// Of Σ (I − Ī)², over all pixels, channels and replicates; 0 without any spread.
    double share = 0;
    /// That normal noise carries as much in one value: Grubbs' test (1950) of the value among the replicates
    /// of its own pixel, whatever the variances of the pixels, times the number of values that could carry
    /// as much. 1 with two replicates, which cannot tell.
    double normal_p = 1;

    /// Few lit pixels carry large shares of normal noise, too; heavy tails carry more than that.
    bool isHeavyTailed(double largest_share) const {
        constexpr double kNotNormal = 0.01;
        return share > largest_share && normal_p < kNotNormal;
    }
};

/// Independent images of one scene by one estimator (other seeds, all else the same), reduced as they come
/// to what tests need.
class Replicates {
public:
    Replicates(std::uint32_t width, std::uint32_t height, std::uint32_t channels);
    /// [height][width][channels]. Values that are not finite are counted, and void the gate.
    void add(std::span<const double> image);

    std::uint32_t width() const { return width_; }
    std::uint32_t height() const { return height_; }
    std::uint32_t channels() const { return channels_; }
    std::uint32_t tilesAcross() const { return (width_ + kTileSide - 1) / kTileSide; }
    std::uint32_t tilesDown() const { return (height_ + kTileSide - 1) / kTileSide; }
    std::size_t tiles() const { return std::size_t{tilesAcross()} * tilesDown(); }
    std::uint64_t count() const { return count_; }
    std::uint64_t notFinite() const { return not_finite_; }

    Summary imageMean(std::uint32_t channel) const;
    /// Tiles in reading order; those at the right and lower border may be smaller.
    Summary tileMean(std::size_t tile, std::uint32_t channel) const;
    Summary pixel(std::size_t pixel, std::uint32_t channel) const;
    /// [replicate]
    const std::vector<double>& imageMeans(std::uint32_t channel) const { return image_means_[channel]; }
    LargestValue largestValue() const;

private:
    struct Moments {
        double mean = 0, squares = 0, lowest = 0, highest = 0;
    };
    std::uint32_t width_, height_, channels_;
    std::uint64_t count_ = 0, not_finite_ = 0;
    std::vector<Moments> pixels_;                 ///< [height][width][channels], Welford 1962
    std::vector<std::vector<double>> image_means_;  ///< [channel][replicate]
    std::vector<std::vector<double>> tile_means_;   ///< [tile · channels + channel][replicate]
};

/// Single pixels are tested with this number of replicates of each or more. With fewer, tiles must differ by
/// the signs of their pixels' differences too (pooled_tests.h).
inline constexpr std::uint64_t kFewestForPixels = 8;

struct GateOptions {
    double delta = 0.01;          ///< Means that differ by less, relative to b's, are equivalent.
    double confidence =
        0.999;  ///< Of each channel mean's interval; 1 − confidence is alpha of tiles and of pixels.
    double largest_share = 0.05;  ///< Of the squared error that one value may carry, or what normal noise
                                  ///< carries if that is more.
    std::vector<std::string> channel_names;  ///< For the reasons; numbers where there are too few.
};

struct GateResult {
    struct Channel {
        WelchResult difference;      ///< a − b, absolute
        double relative =
            0;  ///< To b's mean, whose own error is left out: it would move the interval by parts of itself.
        Interval relative_interval;
        Verdict verdict = Verdict::Inconclusive;
        /// Every replicate's mean differs from every one of the other's by more than delta, the same way;
        /// and the probability of this by chance, for any distribution, is at most 1 − confidence.
        bool separated = false;
    };
    std::vector<Channel> channels;
    TestFamily tiles, pixels;        ///< Over channels too: `worst` is place · channels + channel.
    /// P that the tiles' p-values (of the middle channel, if there is noise) are uniform; for information,
    /// not for the verdict.
    double tile_uniformity_p = 1;
    /// Of a or b: whichever is heavy-tailed, or has the larger share.
    LargestValue largest;
    std::uint64_t not_finite = 0;
    Verdict verdict = Verdict::Inconclusive;
    std::vector<std::string> reasons;  ///< Reasons for a verdict other than Pass, one sentence each.
};
/// Pass: all channels' means are equivalent, no tile and no pixel differs, and no single value decides.
/// Fail: a mean, tile or pixel differs for certain; where the noise has heavy tails, a mean by the ranks of
/// the replicates alone. Else Inconclusive, and so is anything with a value that is no number.
GateResult gate(const Replicates& a, const Replicates& b, const GateOptions& options = {});

}  // namespace crt::stats
