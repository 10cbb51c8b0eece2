#include "film/error_estimate.h"

#include "base/parallel.h"
#include "film/error_tail.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace crt {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::infinity();

/// Below it one path makes the estimate. A higher one selects: among images that few paths light, those with
/// more degrees of freedom have met more than their share (decision 0007).
constexpr double kLeastDegreesOfFreedom = 2;

/// Allowance for pixels as bright as the brightest one that no path has met yet: this number of additional
/// squares like its own.
constexpr double kUnseen = 0.5;

/// E[Y⁴]/E[Y²]² is at least E[Y²]/E[Y]² for any distribution of Y ≥ 0 (Lyapunov's inequality), with
/// equality if all paths are either dark or equally bright. It is 3 times that for exponential noise, and
/// 3.9 times that for the tail y^-1/2 of a glossy lobe around a light.
constexpr double kKurtosis = 4;

/// With at least this number of pixels the scatter of variances is measured; with fewer, where a measurement
/// would be noise, replicates are taken as normal.
constexpr double kPixelsToMeasure = 32;

/// True if the variance between replicates is that of the film's mean: all have samples, and about equally
/// many.
bool balanced(const Film& film) {
    std::uint64_t least = std::numeric_limits<std::uint64_t>::max(), most = 0;
    for (std::uint32_t r = 0; r < film.replicates(); ++r) {
        least = std::min(least, film.replicateSamples(r));
        most = std::max(most, film.replicateSamples(r));
    }
    return film.replicates() > 1 && least > 0 && most <= 2 * least;
}

bool belongs(std::uint32_t x, std::uint32_t y, PixelSet which) {
    return which == PixelSet::All || ((x + y) % 2 == 0) == (which == PixelSet::Even);
}

/// Size of the parts that parallelFor() hands out.
constexpr std::size_t kRows = 16;

/// The sum of `add(sum, x, y)` over all pixels: rows by any thread, put together in their order.
template <class Sum, class Add>
Sum sumOverPixels(const Film& film, const Add& add) {
    std::vector<Sum> rows(film.shape().height);
    parallelFor(rows.size(), kRows, [&](std::size_t first, std::size_t end) {
        for (std::size_t y = first; y < end; ++y) {
            Sum sum{};
            for (std::uint32_t x = 0; x < film.shape().width; ++x)
                add(sum, x, static_cast<std::uint32_t>(y));
            rows[y] = sum;
        }
    });
    Sum all{};
    for (const Sum& row : rows) all += row;
    return all;
}

/// A number for each pixel; infinite where it is not known.
class PixelMap {
public:
    template <class Function>
    PixelMap(const Film& film, const Function& function)
        : width_(film.shape().width), height_(film.shape().height) {
        values_.resize(std::size_t{width_} * height_);
        parallelFor(height_, kRows, [&](std::size_t first, std::size_t end) {
            for (auto y = static_cast<std::uint32_t>(first); y < end; ++y)
                for (std::uint32_t x = 0; x < width_; ++x)
                    values_[std::size_t{y} * width_ + x] = function(x, y);
        });
    }
    double at(std::uint32_t x, std::uint32_t y) const { return values_[std::size_t{y} * width_ + x]; }
    /// Of the known values; 0 if there are none.
    double largest() const {
        double largest = 0;
        for (const double value : values_)
            if (std::isfinite(value)) largest = std::max(largest, value);
        return largest;
    }
    void divide(double unit) {
        for (double& value : values_) value /= unit;
    }
    bool known(std::uint32_t x, std::uint32_t y) const { return std::isfinite(at(x, y)); }

    /// Square of a value's deviation from the mean of its k neighbours in the set, times k/(k + 1): the
    /// value's variance, and more where neighbours have other means. With one degree of freedom a pixel's
    /// variance scatters more than those of neighbours differ, so that this is hardly too large.
    double squaredDeviation(std::uint32_t x, std::uint32_t y, PixelSet which) const {
        double sum = 0, count = 0;
        for (std::uint32_t j = y > 0 ? y - 1 : 0; j <= std::min(y + 1, height_ - 1); ++j)
            for (std::uint32_t i = x > 0 ? x - 1 : 0; i <= std::min(x + 1, width_ - 1); ++i) {
                if ((i == x && j == y) || !known(i, j) || !belongs(i, j, which)) continue;
                sum += at(i, j);
                count += 1;
            }
        if (count == 0) return at(x, y) * at(x, y);
        const double deviation = at(x, y) - sum / count;
        return deviation * deviation * count / (count + 1);
    }

private:
    std::uint32_t width_, height_;
    std::vector<double> values_;
};

/// Sums over the pixels of a set, variances in units of the largest, so that no square overflows: a
/// checkpoint may hold any finite sums.
struct VarianceSums {
    double pixels = 0, known = 0, sum = 0, most = 0, squares = 0;
    VarianceSums& operator+=(const VarianceSums& other) {
        pixels += other.pixels;
        known += other.known;
        sum += other.sum;
        most = std::max(most, other.most);
        squares += other.squares;
        return *this;
    }
};

VarianceSums sumsOf(const Film& film, const PixelMap& variances, PixelSet which) {
    return sumOverPixels<VarianceSums>(film, [&](VarianceSums& s, std::uint32_t x, std::uint32_t y) {
        if (!belongs(x, y, which)) return;
        s.pixels += 1;
        if (!variances.known(x, y)) return;
        const double v = variances.at(x, y);
        s.known += 1;
        s.sum += v;
        s.most = std::max(s.most, v);
        s.squares += v * v;
    });
}

/// Variance of the sum S of variances, in their units, as it enters the relative error √S/M, whatever the
/// distribution of samples.
double measuredSpread(const Film& film, const LuminanceVariance& variance, const PixelMap& variances,
                      PixelSet which, const VarianceSums& sums, double largest, double luminance) {
    const auto total = [&](const auto& of) {
        return sumOverPixels<double>(film, [&](double& sum, std::uint32_t x, std::uint32_t y) {
            if (belongs(x, y, which) && variances.known(x, y)) sum += of(x, y);
        });
    };
    if (variance.fromReplicates() && variance.degreesOfFreedom() >= 3)
        return total(
            [&](std::uint32_t x, std::uint32_t y) { return variance.varianceOfVariance(x, y, largest); });
    // Contribution of a pixel to log(√S/M): if a bright path raises both S and M, they partly cancel.
    const PixelMap influence(film, [&](std::uint32_t x, std::uint32_t y) {
        return 0.5 * variances.at(x, y) / sums.sum - film.mean(x, y, 1) / luminance;
    });
    const double between_pixels = 4 * sums.sum * sums.sum * total([&](std::uint32_t x, std::uint32_t y) {
                                      return influence.squaredDeviation(x, y, which);
                                  });
    if (variance.fromReplicates()) return between_pixels;
    // The same from the samples of each pixel, which narrows with their number; how pixels differ does not.
    const double of_samples = total([&](std::uint32_t x, std::uint32_t y) {
        const double v = variances.at(x, y);
        return v * v * kKurtosis * variance.excess(x, y);
    });
    const double of_luminance = sums.sum * largest / (luminance * luminance);
    return std::min(between_pixels, of_samples + 4 * sums.sum * sums.sum * of_luminance);
}

/// The most that a single path adds to the variance of a pixel. Replicates do not tell how many paths
/// contribute, so it is the whole variance of the noisiest pixel. Squares of samples do.
double noisiestPath(const Film& film, const LuminanceVariance& variance, const PixelMap& variances,
                    PixelSet which, const VarianceSums& sums) {
    if (variance.fromReplicates()) return sums.most;
    double most = 0;
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x)
            if (belongs(x, y, which) && variances.known(x, y))
                most = std::max(most, variances.at(x, y) * std::min(variance.excess(x, y), 1.0));
    return most;
}

/// The same for the mean of all pixels, whatever they have in common: from the means of the replicates.
double standardErrorOfMean(const Film& film, PixelSet which, double pixels) {
    const auto n = static_cast<double>(film.samples.count());
    std::vector<double> sums(film.replicates());
    double total = 0, squares = 0;
    for (std::uint32_t r = 0; r < film.replicates(); ++r) {
        sums[r] = sumOverPixels<double>(film, [&](double& sum, std::uint32_t x, std::uint32_t y) {
            if (belongs(x, y, which)) sum += film.replicateSum(x, y, r);
        });
        total += sums[r];
    }
    for (std::uint32_t r = 0; r < film.replicates(); ++r) {
        const auto of_replicate = static_cast<double>(film.replicateSamples(r));
        const double deviation = sums[r] - of_replicate / n * total;
        squares += deviation * deviation / of_replicate;
    }
    return std::sqrt(squares / (film.replicates() - 1) / n) / pixels;
}

/// True if paths that the pixels of the set have not met yet may make their error larger than it seems.
bool missesBrightPaths(const Film& film, const PixelMap& variances, PixelSet which, const VarianceSums& sums,
                       double unit, double degrees_of_freedom) {
    std::vector<NoisyPixel> noisy;
    noisy.reserve(static_cast<std::size_t>(sums.known));
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x)
            if (belongs(x, y, which) && variances.known(x, y))
                noisy.push_back({x, y, variances.at(x, y) * unit});
    return tailIsOpen(errorTail(film, noisy), degrees_of_freedom,
                      sums.known * static_cast<double>(film.samples.count()));
}

}  // namespace

LuminanceVariance::LuminanceVariance(const Film& film)
    : film_(film), from_replicates_(balanced(film)), squares_(firstChannel(film.shape().aovs, kAovSquares)) {
    if (!from_replicates_) {
        // The splats of a pixel come from all samples of the film: its squares do not say how they vary.
        const bool tells = squares_ != 0 && film.splats.empty();
        dof_ = tells ? static_cast<double>(film.samples.count()) - 1 : 0;
        return;
    }
    for (std::uint32_t r = 0; r < film.replicates(); ++r)
        samples_[r] = static_cast<double>(film.replicateSamples(r));
    dof_ = film.replicates() - 1;
}

/// Analysis of variance between replicates with means m_r of n_r samples each: s² = Σ n_r (m_r − m)²/(R
/// − 1), and s²/n for the mean of all n samples. With equal n_r it is the variance of the R means over R.
double LuminanceVariance::betweenReplicates(std::uint32_t x, std::uint32_t y) const {
    const auto n = static_cast<double>(film_.samples.count());
    const double mean = film_.mean(x, y, 1);
    double squares = 0;
    for (std::uint32_t r = 0; r < film_.replicates(); ++r) {
        const double deviation = film_.replicateSum(x, y, r) - samples_[r] * mean;
        squares += deviation * deviation / samples_[r];
    }
    return squares / dof_ / n;
}

double LuminanceVariance::ofColor(std::uint32_t x, std::uint32_t y, const Vec3d& weights) const {
    const auto n = static_cast<double>(film_.samples.count());
    const std::size_t pixel = std::size_t{y} * film_.shape().width + x;
    if (!from_replicates_ || film_.counts[pixel] != film_.samples.count()) return kUnknown;
    double squares = 0;
    for (std::uint32_t r = 0; r < film_.replicates(); ++r) {
        double deviation = 0;
        for (std::uint32_t c = 0; c < 3; ++c)
            deviation +=
                weights[c] * (film_.replicateSumOf(c, x, y, r) - samples_[r] * film_.mean(x, y, c));
        squares += deviation * deviation / samples_[r];
    }
    return squares / dof_ / n;
}

double LuminanceVariance::operator()(std::uint32_t x, std::uint32_t y) const {
    if (!(dof_ >= 1)) return kUnknown;
    const std::size_t pixel = std::size_t{y} * film_.shape().width + x;
    const std::uint64_t n = film_.counts[pixel];
    if (from_replicates_)  // Pixels whose samples or splats were dropped are unknown.
        return n == film_.samples.count() && film_.droppedSplatsOf(pixel) == 0 ? betweenReplicates(x, y)
                                                                              : kUnknown;
    if (n < 2) return kUnknown;
    const double mean = film_.mean(x, y, 1);
    // Rounding can push the difference of nearly equal numbers below zero.
    const double spread = std::max(0.0, film_.mean(x, y, squares_) - mean * mean);
    return spread / static_cast<double>(n - 1);
}

double LuminanceVariance::excess(std::uint32_t x, std::uint32_t y) const {
    const auto n = static_cast<double>(film_.counts[std::size_t{y} * film_.shape().width + x]);
    const double mean = film_.mean(x, y, 1);
    return mean != 0 ? film_.mean(x, y, squares_) / (mean * mean) / n : 0;
}

/// Var k₂ of R values is estimated without bias by (2R k₂² + (R − 1) k₄) / (R (R + 1)) (Kendall and
/// Stuart 1969, 12.16); the variance of the mean is k₂/R.
double LuminanceVariance::varianceOfVariance(std::uint32_t x, std::uint32_t y, double unit) const {
    const double r = dof_ + 1, mean = film_.mean(x, y, 1);
    double squares = 0, fourth_powers = 0;
    for (std::uint32_t i = 0; i < film_.replicates(); ++i) {
        const double d = (film_.replicateSum(x, y, i) / samples_[i] - mean) / std::sqrt(unit);
        squares += d * d;
        fourth_powers += d * d * d * d;
    }
    const double k2 = squares / (r - 1);
    const double k4 =
        (r * (r + 1) * fourth_powers - 3 * (r - 1) * squares * squares) / ((r - 1) * (r - 2) * (r - 3));
    return (2 * r * k2 * k2 + (r - 1) * k4) / (r * (r + 1)) / (r * r);
}

std::optional<ErrorEstimate> estimateError(const Film& film, PixelSet which, const PathFacts& paths) {
    const LuminanceVariance variance(film);
    const double d = variance.degreesOfFreedom();
    PixelMap variances(film, variance);
    const double largest = variances.largest(), unit = largest > 0 ? largest : 1;
    variances.divide(unit);
    const VarianceSums sums = sumsOf(film, variances, which);
    const auto luminance = sumOverPixels<double>(
        film, [&](double& sum, std::uint32_t x, std::uint32_t y) { sum += film.mean(x, y, 1); });
    const double total = sums.sum * unit;
    if (sums.known == 0 || !(luminance > 0) || !std::isfinite(luminance) || !std::isfinite(total))
        return std::nullopt;

    ErrorEstimate e;
    e.knowledge =
        variance.fromReplicates() || paths.independent ? ErrorKnowledge::Known : ErrorKnowledge::Bound;
    e.mean_luminance = luminance / static_cast<double>(film.counts.size());
    if (paths.brightest.rare) e.rare_paths = paths.brightest.luminance / e.mean_luminance;
    e.mean_standard_error = std::sqrt(total / sums.known / sums.pixels);
    e.relative_rmse = std::sqrt(total / sums.known) / e.mean_luminance;
    if (!(total > 0)) {  // Every sample the same: a furnace.
        e.degrees_of_freedom = e.mean_degrees_of_freedom = d * sums.known;
        return e;
    }
    // Normal replicates have Var v = 2 v²/d, whose unbiased estimate is 2 v²/(d + 2); longer tails have
    // more.
    const double normal = 2 * sums.squares / (d + 2);
    double spread = normal;
    if (sums.known >= kPixelsToMeasure)
        spread = std::max(normal, measuredSpread(film, variance, variances, which, sums, unit, luminance) +
                                      (d < 3 ? kUnseen * sums.most * sums.most : 0));
    e.degrees_of_freedom = std::clamp(2 * sums.sum * sums.sum / spread, 1.0, d * sums.known);
    e.mean_degrees_of_freedom = e.degrees_of_freedom;
    if (!film.splats.empty()) {
        e.mean_standard_error = standardErrorOfMean(film, which, sums.pixels);
        e.mean_degrees_of_freedom = d;
    }
    const bool too_few = e.degrees_of_freedom < std::min(kLeastDegreesOfFreedom, d * sums.known);
    // One path as bright as the scene's brightest adds this amount to the sum of variances.
    const double brightest = paths.brightest.luminance / static_cast<double>(film.samples.count()),
                 of_brightest = brightest * brightest;
    const bool met_brightest = total >= kUnmet * of_brightest;
    const auto open_tail = [&] {
        return sums.known >= kPixelsToMeasure &&
               missesBrightPaths(film, variances, which, sums, unit, e.degrees_of_freedom);
    };
    if (e.known() && (too_few || (!met_brightest && (paths.brightest.rare || open_tail()))))
        e.knowledge = ErrorKnowledge::NotYet;
    const double noisiest =
        sums.known >= kPixelsToMeasure ? noisiestPath(film, variance, variances, which, sums) * unit : 0;
    const double rare = paths.brightest.rare ? of_brightest : 0,
                 chance = kUnmet * rare / total, unmet = kUnmet * std::max(noisiest, rare) / total;
    const auto squared = [&](double probability) {
        return e.degrees_of_freedom / stats::chiSquaredQuantile(probability, e.degrees_of_freedom);
    };
    // The upper end counts kUnmet more pixels that are as noisy as the noisiest, or paths as bright as the
    // scene's brightest; the lower end, where such paths are rare, as many fewer.
    e.relative_rmse_95 = {e.relative_rmse * std::sqrt(std::max(0.0, squared(0.975) - chance)),
                          e.relative_rmse * std::sqrt(squared(0.025) + unmet)};
    // The squared error that the image has scatters like the normal part of one degree of freedom a pixel,
    // and the tails' part.
    const double squared_error =
        std::clamp(2 * sums.sum * sums.sum / (d * normal + (spread - normal)), 1.0, sums.known);
    e.half_width_95 =
        e.relative_rmse *
        std::sqrt(stats::fisherQuantile(0.95, squared_error, e.degrees_of_freedom) + unmet);
    return e;
}

stats::Interval ErrorEstimate::meanInterval(double confidence) const {
    if (mean_standard_error == 0) return {mean_luminance, mean_luminance};
    const double half_width =
        stats::studentQuantile(0.5 + 0.5 * confidence, mean_degrees_of_freedom) * mean_standard_error;
    return {mean_luminance - half_width, mean_luminance + half_width};
}

stats::Interval ErrorEstimate::samplesFor(double target, double samples_now) const {
    const double scale =
        half_width_95 / relative_rmse;  // Of the expectation's interval to the half-width's.
    const double least = std::max(1.0, relative_rmse_95.lower * scale / target),
                 most = std::max(1.0, relative_rmse_95.upper * scale / target);
    return {samples_now * least, samples_now * most * most};
}

}  // namespace crt
