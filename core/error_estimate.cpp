#include "error_estimate.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace crt {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::infinity();

bool speaks(std::uint32_t replicate, ReplicateSet which) {
    return which == ReplicateSet::All || (replicate % 2 == 0) == (which == ReplicateSet::Even);
}

}  // namespace

LuminanceVariance::LuminanceVariance(const Film& film, ReplicateSet which) : film_(film) {
    double heard = 0, present = 0;
    if (film.hasReplicates())
        for (std::uint32_t r = 0; r < Film::kReplicates; ++r) {
            const std::uint64_t samples = film.replicateSamples(r);
            present += samples > 0;
            if (samples == 0 || !speaks(r, which)) continue;
            samples_[r] = samples;
            heard_ += static_cast<double>(samples);
            heard += 1;
        }
    from_replicates_ = present >= 2;
    dof_ = from_replicates_ ? heard - 1 : static_cast<double>(film.samples.count()) - 1;
}

/// Analysis of variance between replicates with means m_r of n_r samples each: s² = Σ n_r (m_r − m)²/(k − 1), and s²/n for the mean of all n
/// samples. With equal n_r it is the variance of the k means over k.
double LuminanceVariance::betweenReplicates(std::uint32_t x, std::uint32_t y) const {
    double sum = 0;
    std::array<double, Film::kReplicates> sums{};
    for (std::uint32_t r = 0; r < Film::kReplicates; ++r)
        if (samples_[r] != 0) sum += sums[r] = film_.replicateSum(x, y, r);
    const double mean = sum / heard_;
    double squares = 0;
    for (std::uint32_t r = 0; r < Film::kReplicates; ++r) {
        if (samples_[r] == 0) continue;
        const auto n = static_cast<double>(samples_[r]);
        squares += (sums[r] - n * mean) * (sums[r] - n * mean) / n;
    }
    return squares / dof_ / static_cast<double>(film_.samples.count());
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

std::optional<ErrorEstimate> estimateError(const Film& film, ReplicateSet which, bool independent_samples) {
    const LuminanceVariance variance(film, which);
    // Squares of variances as (squares)·largest², as BLAS's nrm2 adds them up: a checkpoint may hold any finite sums.
    double luminance = 0, variances = 0, largest = 0, squares = 0, known = 0;
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x) {
            luminance += film.mean(x, y, 1);
            const double v = variance(x, y);
            if (std::isinf(v)) continue;
            variances += v;
            if (v > largest) {
                squares = squares * (largest / v) * (largest / v) + 1;
                largest = v;
            } else if (v > 0) {
                squares += (v / largest) * (v / largest);
            }
            known += 1;
        }
    if (known == 0 || !(luminance > 0) || !std::isfinite(luminance) || !std::isfinite(variances)) return std::nullopt;

    ErrorEstimate e;
    const double pixels = static_cast<double>(film.counts.size());
    e.is_bound = !variance.fromReplicates() && !independent_samples;
    e.mean_luminance = luminance / pixels;
    e.mean_standard_error = std::sqrt(variances / known / pixels);
    e.relative_rmse = std::sqrt(variances / known) / e.mean_luminance;
    if (!(variances > 0)) {  // Every sample the same: a furnace.
        e.degrees_of_freedom = variance.degreesOfFreedom() * known;
        return e;
    }
    // A normal sample variance s² of d degrees of freedom has E[s⁴] = σ⁴ (d + 2)/d; so Σσ⁴ is estimated by Σs⁴ · d/(d + 2).
    const double d = variance.degreesOfFreedom();
    const double sum = variances / largest, fourth_powers = squares * d / (d + 2);
    // Never more equivalent pixels than there are, and never less than one: a ratio of estimates knows neither.
    const double equivalent_pixels = std::clamp(sum * sum / fourth_powers, 1.0, known);
    e.degrees_of_freedom = equivalent_pixels * d;
    e.relative_rmse_95 = {e.relative_rmse * std::sqrt(e.degrees_of_freedom / stats::chiSquaredQuantile(0.975, e.degrees_of_freedom)),
                          e.relative_rmse * std::sqrt(e.degrees_of_freedom / stats::chiSquaredQuantile(0.025, e.degrees_of_freedom))};
    e.half_width_95 = e.relative_rmse * std::sqrt(stats::fisherQuantile(0.95, equivalent_pixels, e.degrees_of_freedom));
    return e;
}

stats::Interval ErrorEstimate::meanInterval(double confidence) const {
    if (mean_standard_error == 0) return {mean_luminance, mean_luminance};
    const double half_width = stats::studentQuantile(0.5 + 0.5 * confidence, degrees_of_freedom) * mean_standard_error;
    return {mean_luminance - half_width, mean_luminance + half_width};
}

double ErrorEstimate::samplesFor(double target, double samples_now) const {
    const double ratio = half_width_95 / target;
    return samples_now * std::max(1.0, ratio * ratio);
}

}  // namespace crt
