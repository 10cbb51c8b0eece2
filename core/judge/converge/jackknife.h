/// Intervals of anything that is reckoned from replicates, by leaving parts of them out (Tukey 1958; Miller
/// 1974).
///
/// Three samples are independent of each other: the replicates that errors are known from, those that times
/// are known from, and the folds of the reference. Each is left out one by one, the variances add up, and
/// Student's degrees of freedom are those of Satterthwaite 1946.
#pragma once

#include "judge/converge/measurement.h"

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace crt::converge {

using Indices = std::span<const std::size_t>;

/// Data of a statistic: some of the replicates, and the reference whole or without one fold.
struct Resample {
    Indices errors, times;
    std::size_t reference_part = 0;  ///< 0: all folds; k + 1: without fold k.
    bool unmet = false;  ///< With the squared error of paths that may be missing (Measure::unmet()).
};
using Statistic = std::function<double(const Resample&)>;

/// Number of each to leave out. 0: the statistic does not depend on them.
struct SampleCounts {
    std::size_t errors = 0, times = 0, folds = 0;
    /// Of the standard error that replicates of errors cause; infinite where nothing is known of it.
    double widening = 1;
    bool unmet = false;  ///< Paths may be missing. The half width includes their effect, in quadrature.
};

enum class Scale { Linear, Logarithmic };

/// Without bounds (low −∞ or, on the logarithmic scale, 0; high ∞) where the statistic is not finite
/// on some part, or one of the samples is a single one. NaN altogether where it is not finite on all. Of
/// very many replicates whole groups are left out (Wolter, Introduction to Variance Estimation, 4.2): the
/// time would grow with their square.
Estimate jackknife(const SampleCounts& counts, const Statistic& statistic, Scale scale, double confidence);

/// Standard error of the same on a linear scale that the folds alone cause; 0 without folds, infinite where
/// unknown.
double foldError(const SampleCounts& counts, const Statistic& statistic);

/// 0, 1 … count − 1
std::vector<std::size_t> allOf(std::size_t count);

}  // namespace crt::converge
