/// What a film knows of its own error, without a reference: the spread between its replicates (layout.h: CRT_REPLICATES), which is unbiased for any
/// sampler; or, where there are none or only one has samples yet, the spread between samples, unbiased for independent ones and an upper estimate
/// for a Sobol sequence. All of it is about luminance Y; none of it sees a bias that all samples share.
#pragma once

#include "film.h"
#include "stats/statistics.h"

#include <array>
#include <cstdint>

namespace crt {

/// Which replicates speak. A verdict must not hear those that decided when to stop.
enum class ReplicateSet { All, Even, Odd };

/// Variance of the pixels' means of Y.
class LuminanceVariance {
public:
    explicit LuminanceVariance(const Film& film, ReplicateSet which = ReplicateSet::All);
    /// Of one pixel; infinite where it is not known: one sample says nothing about its own error, and zero would claim perfection.
    double operator()(std::uint32_t x, std::uint32_t y) const;
    /// Degrees of freedom of one pixel's estimate.
    double degreesOfFreedom() const { return dof_; }
    /// Whether it is the spread between replicates; else between samples.
    bool fromReplicates() const { return from_replicates_; }

private:
    double betweenReplicates(std::uint32_t x, std::uint32_t y) const;

    const Film& film_;
    bool from_replicates_;
    std::array<std::uint64_t, Film::kReplicates> samples_{};  ///< Of each replicate that speaks; 0 for the others.
    double heard_ = 0;    ///< Samples of the replicates that speak.
    double dof_ = 0;
};

/// Relative to the image's mean luminance. Pixels are independent of each other, each with a scramble of its own; replicate means are taken as
/// normal, which heavy tails (fireflies) violate.
struct ErrorEstimate {
    double mean_luminance = 0;
    double mean_standard_error = 0;    ///< Of mean_luminance.
    double relative_rmse = 0;          ///< √(mean of the pixels' variances) / mean luminance: expected root mean square error over the pixels.
    stats::Interval relative_rmse_95;  ///< Of that expectation: χ², degrees of freedom after Satterthwaite 1946.
    /// With probability 95 % the root mean square error that this image really has is at most this: √(F₀.₉₅ · mean variance) / mean. For one pixel
    /// it is Student's half-width t₀.₉₇₅ · standard error, for many it tends to relative_rmse.
    double half_width_95 = 0;
    double degrees_of_freedom = 0;     ///< Of the mean's variance.
    bool is_bound = true;              ///< Of one Sobol sequence, as far as is known: the true error is smaller.

    /// Student's interval of the image's mean luminance.
    stats::Interval meanInterval(double confidence) const;
    /// Samples per pixel until half_width_95 is `target`, if the error falls as 1/√N, which a Sobol sequence beats.
    double samplesFor(double target, double samples_now) const;
};

/// Nothing where nothing is known: too few samples, or no light found yet. With `independent_samples` the spread between samples is no mere bound.
std::optional<ErrorEstimate> estimateError(const Film& film, ReplicateSet which = ReplicateSet::All, bool independent_samples = false);

}  // namespace crt
