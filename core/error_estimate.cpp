#include "error_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace crt {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::infinity();

/// Below it an image of many pixels owes its variance to so few paths that intervals do not cover what they claim (docs/results/calibration.md).
constexpr double kLeastDegreesOfFreedom = 50;

/// From so many pixels on the scatter of variances is measured; of fewer, where a measurement would be noise, replicates are taken as normal.
constexpr double kPixelsToMeasure = 32;

/// Whether the variance between replicates is that of the film's mean: all have samples, and about equally many.
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

/// The pixels' variances v in units of the largest, so that no square overflows: a checkpoint may hold any finite sums.
class VarianceMap {
public:
    VarianceMap(const Film& film, const LuminanceVariance& variance) : width_(film.shape().width), height_(film.shape().height) {
        values_.reserve(std::size_t{width_} * height_);
        for (std::uint32_t y = 0; y < height_; ++y)
            for (std::uint32_t x = 0; x < width_; ++x) {
                values_.push_back(variance(x, y));
                if (std::isfinite(values_.back())) largest_ = std::max(largest_, values_.back());
            }
        if (largest_ > 0)
            for (double& v : values_) v /= largest_;
    }
    double largest() const { return largest_; }
    double at(std::uint32_t x, std::uint32_t y) const { return values_[std::size_t{y} * width_ + x]; }
    bool known(std::uint32_t x, std::uint32_t y) const { return std::isfinite(at(x, y)); }

    /// Square of a variance's deviation from the mean of its k neighbours, times k/(k + 1): its own variance, and more where neighbours
    /// differ. With one degree of freedom a pixel scatters more than its neighbours differ, so that this is hardly too large, and never more than v².
    double squaredDeviation(std::uint32_t x, std::uint32_t y) const {
        double sum = 0, count = 0;
        for (std::uint32_t j = y > 0 ? y - 1 : 0; j <= std::min(y + 1, height_ - 1); ++j)
            for (std::uint32_t i = x > 0 ? x - 1 : 0; i <= std::min(x + 1, width_ - 1); ++i) {
                if ((i == x && j == y) || !known(i, j)) continue;
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
    double largest_ = 0;
};

}  // namespace

LuminanceVariance::LuminanceVariance(const Film& film) : film_(film), from_replicates_(balanced(film)) {
    if (!from_replicates_) {
        dof_ = static_cast<double>(film.samples.count()) - 1;
        return;
    }
    for (std::uint32_t r = 0; r < film.replicates(); ++r) samples_[r] = static_cast<double>(film.replicateSamples(r));
    dof_ = film.replicates() - 1;
}

/// Analysis of variance between replicates with means m_r of n_r samples each: s² = Σ n_r (m_r − m)²/(R − 1), and s²/n for the mean of all n
/// samples. With equal n_r it is the variance of the R means over R.
double LuminanceVariance::betweenReplicates(std::uint32_t x, std::uint32_t y) const {
    const auto n = static_cast<double>(film_.samples.count());
    const double mean = film_.sum(x, y, 1) / n;
    double squares = 0;
    for (std::uint32_t r = 0; r < film_.replicates(); ++r) {
        const double deviation = film_.replicateSum(x, y, r) - samples_[r] * mean;
        squares += deviation * deviation / samples_[r];
    }
    return squares / dof_ / n;
}

double LuminanceVariance::operator()(std::uint32_t x, std::uint32_t y) const {
    if (!(dof_ >= 1)) return kUnknown;
    const std::uint64_t n = film_.counts[std::size_t{y} * film_.shape().width + x];
    if (from_replicates_) return n == film_.samples.count() ? betweenReplicates(x, y) : kUnknown;  // Whose samples were dropped is not known.
    if (n < 2) return kUnknown;
    const double mean = film_.mean(x, y, 1);
    // Rounding can push the difference of nearly equal numbers below zero.
    const double spread = std::max(0.0, film_.mean(x, y, 3) - mean * mean);
    return spread / static_cast<double>(n - 1);
}

/// Var k₂ of R values is estimated without bias by (2R k₂² + (R − 1) k₄) / (R (R + 1)) (Kendall and Stuart 1969, 12.16); the variance of the mean is k₂/R.
double LuminanceVariance::varianceOfVariance(std::uint32_t x, std::uint32_t y) const {
    const double r = dof_ + 1, mean = film_.mean(x, y, 1);
    double squares = 0, fourth_powers = 0;
    for (std::uint32_t i = 0; i < film_.replicates(); ++i) {
        const double d = film_.replicateSum(x, y, i) / samples_[i] - mean;
        squares += d * d;
        fourth_powers += d * d * d * d;
    }
    const double k2 = squares / (r - 1);
    const double k4 = (r * (r + 1) * fourth_powers - 3 * (r - 1) * squares * squares) / ((r - 1) * (r - 2) * (r - 3));
    return (2 * r * k2 * k2 + (r - 1) * k4) / (r * (r + 1)) / (r * r);
}

std::optional<ErrorEstimate> estimateError(const Film& film, PixelSet which, bool independent_samples) {
    const LuminanceVariance variance(film);
    const VarianceMap map(film, variance);
    const double d = variance.degreesOfFreedom();
    const bool by_moments = variance.fromReplicates() && d >= 3;
    double luminance = 0, pixels = 0, known = 0, sum = 0, squares = 0, spread = 0;
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x) {
            luminance += film.mean(x, y, 1);
            if (!belongs(x, y, which)) continue;
            pixels += 1;
            if (!map.known(x, y)) continue;
            known += 1;
            sum += map.at(x, y);
            squares += map.at(x, y) * map.at(x, y);
            if (map.largest() > 0) spread += by_moments ? variance.varianceOfVariance(x, y) / map.largest() / map.largest() : map.squaredDeviation(x, y);
        }
    const double variances = sum * map.largest();
    if (known == 0 || !(luminance > 0) || !std::isfinite(luminance) || !std::isfinite(variances)) return std::nullopt;

    ErrorEstimate e;
    e.knowledge = variance.fromReplicates() || independent_samples ? ErrorKnowledge::Known : ErrorKnowledge::Bound;
    e.mean_luminance = luminance / static_cast<double>(film.counts.size());
    e.mean_standard_error = std::sqrt(variances / known / pixels);
    e.relative_rmse = std::sqrt(variances / known) / e.mean_luminance;
    if (!(variances > 0)) {  // Every sample the same: a furnace.
        e.degrees_of_freedom = d * known;
        return e;
    }
    // Normal replicates have Var v = 2 v²/d, whose unbiased estimate is 2 v²/(d + 2); longer tails have more. No variance exceeds the mean square.
    const double normal = 2 * squares / (d + 2);
    const double measured = known < kPixelsToMeasure ? normal : std::clamp(spread, normal, std::max(squares, normal));
    e.degrees_of_freedom = std::clamp(2 * sum * sum / measured, 1.0, d * known);
    const double least = std::min(kLeastDegreesOfFreedom, d > 1 ? d : kLeastDegreesOfFreedom);
    if (e.known() && e.degrees_of_freedom < least) e.knowledge = ErrorKnowledge::NotYet;
    e.relative_rmse_95 = {e.relative_rmse * std::sqrt(e.degrees_of_freedom / stats::chiSquaredQuantile(0.975, e.degrees_of_freedom)),
                          e.relative_rmse * std::sqrt(e.degrees_of_freedom / stats::chiSquaredQuantile(0.025, e.degrees_of_freedom))};
    // The squared error that the image has scatters like the normal part of one degree of freedom a pixel, and the tails' part.
    const double squared_error = std::clamp(2 * sum * sum / (d * normal + (measured - normal)), 1.0, known);
    e.half_width_95 = e.relative_rmse * std::sqrt(stats::fisherQuantile(0.95, squared_error, e.degrees_of_freedom));
    return e;
}

stats::Interval ErrorEstimate::meanInterval(double confidence) const {
    if (mean_standard_error == 0) return {mean_luminance, mean_luminance};
    const double half_width = stats::studentQuantile(0.5 + 0.5 * confidence, degrees_of_freedom) * mean_standard_error;
    return {mean_luminance - half_width, mean_luminance + half_width};
}

stats::Interval ErrorEstimate::samplesFor(double target, double samples_now) const {
    const double scale = half_width_95 / relative_rmse;  // Of the expectation's interval to the half-width's.
    const double least = std::max(1.0, relative_rmse_95.lower * scale / target), most = std::max(1.0, relative_rmse_95.upper * scale / target);
    return {samples_now * least, samples_now * most * most};
}

}  // namespace crt
