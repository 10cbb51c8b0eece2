/// Estimates the error of a film without a reference: from the spread between its replicates (layout.h:
/// CRT_REPLICATES_MAX), which is unbiased for any sampler; or, without replicates, from the spread between
/// samples, unbiased for independent ones and an upper bound for a Sobol sequence. A film with splats needs
/// replicates: each splat belongs to the replicate of its sample. All of it is about luminance Y. None of it
/// sees a bias that all samples share.
#pragma once

#include "base/statistics.h"
#include "film/film.h"
#include "film/path_facts.h"

#include <array>
#include <cstdint>

namespace crt {

/// The pixels of the estimate. Those of one colour of a checkerboard are independent of those of the other:
/// the even pixels make a decision, and the odd ones measure its error.
enum class PixelSet { All, Even, Odd };

/// Variance of the pixels' means of Y.
class LuminanceVariance {
public:
    explicit LuminanceVariance(const Film& film);
    /// Of one pixel; infinite where it is not known: one sample says nothing about its own error, and zero
    /// would claim perfection.
    double operator()(std::uint32_t x, std::uint32_t y) const;
    /// The same of weights · (X, Y, Z), of films with kAovColorError.
    double ofColor(std::uint32_t x, std::uint32_t y, const Vec3d& weights) const;
    /// Degrees of freedom of one pixel's estimate.
    double degreesOfFreedom() const { return dof_; }
    /// True if it is the spread between replicates, false if between samples.
    bool fromReplicates() const { return from_replicates_; }
    /// Variance of operator() itself, over unit² so that nothing overflows, by unbiased k-statistics:
    /// whatever the distribution of replicates. Needs four.
    double varianceOfVariance(std::uint32_t x, std::uint32_t y, double unit = 1) const;
    /// E[Y²]/E[Y]²/n of a pixel's n samples. Needs the squares.
    double excess(std::uint32_t x, std::uint32_t y) const;

private:
    double betweenReplicates(std::uint32_t x, std::uint32_t y) const;

    const Film& film_;
    bool from_replicates_;
    std::uint32_t squares_;             ///< Channel of Y²; 0: the film has none.
    std::array<double, 16> samples_{};  ///< Of each replicate.
    double dof_ = 0;
};

/// The estimate of an error.
enum class ErrorKnowledge {
    Known,   ///< Estimated, with an interval.
    Bound,   ///< Of one Sobol sequence: the true error is smaller, by an unknown factor.
    NotYet,  ///< So few paths carry the noise, or brighter ones than those that were met are so likely
             ///< (error_tail.h, path_facts.h), that neither the estimate nor an interval can be
             ///< trusted.
};

/// Relative to the image's mean luminance. Pixels are independent of each other, each with a separate
/// scramble. Those of films with splats have samples in common: the error of their mean comes from the means
/// of the replicates.
struct ErrorEstimate {
    ErrorKnowledge knowledge = ErrorKnowledge::Bound;
    double mean_luminance = 0;
    double mean_standard_error = 0;  ///< Of mean_luminance.
    double relative_rmse = 0;  ///< √(mean of the pixels' variances) / mean luminance: expected root mean
                               ///< square error over the pixels.
    stats::Interval relative_rmse_95;  ///< Of that expectation: χ² with degrees_of_freedom.
    /// With probability 95 % the root mean square error that this image really has is at most this:
    /// √(F₀.₉₅ · mean variance) / mean. For one pixel it is Student's half-width t₀.₉₇₅ ·
    /// standard error, for many it tends to relative_rmse.
    double half_width_95 = 0;
    /// Of the mean's variance S: 2 S² / Var S (Satterthwaite 1946), where Var S is measured and not taken
    /// from the normal distribution.
    double degrees_of_freedom = 0;
    double mean_degrees_of_freedom = 0;  ///< Of mean_standard_error.
    /// Luminance of the scene's rare brightest paths over the mean luminance; 0 if it has none.
    double rare_paths = 0;

    bool known() const { return knowledge == ErrorKnowledge::Known; }
    /// Student's interval of the image's mean luminance.
    stats::Interval meanInterval(double confidence) const;
    /// Samples per pixel until half_width_95 is `target`: between a rate of 1/N, which Sobol points reach on
    /// smooth images, from the lower end of the error's interval, and 1/√N from its upper end.
    stats::Interval samplesFor(double target, double samples_now) const;
};

/// Nothing where nothing is known: too few samples, replicates that are not about equally full (nor squares
/// in the film, or splats beside them), or no light found yet.
std::optional<ErrorEstimate> estimateError(const Film& film, PixelSet which = PixelSet::All,
                                           const PathFacts& paths = {});

}  // namespace crt
