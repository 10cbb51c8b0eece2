/// Differences of two images whose pixels state their own variances, each with few degrees of freedom (three
/// where a film keeps four replicates). One such variance says little, many together say much. Noise is not
/// taken as normal where that would raise alarms: fireflies are common.
#pragma once

#include "judge/stats/image_tests.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace crt::stats {

/// Sums over some pixels of one channel of one image: values, and stated variances of them.
struct PixelSums {
    double value = 0, variance = 0;
    double variance_squares = 0;  ///< Σ variance²
    std::uint64_t count = 0;

    void add(double pixel_value, double pixel_variance);
    void add(const PixelSums& other);
    /// Degrees of freedom of the summed variance when each pixel's has `dof` (Satterthwaite 1946). An
    /// estimate s² of d degrees of freedom has E[s⁴] = σ⁴ (d + 2)/d, which is taken out; never below
    /// `dof`, never above count · dof.
    double degreesOfFreedom(double dof) const;
    /// The pixels' mean with its variance: independent pixels' variances add.
    Mean mean(double dof) const;
};

/// Two-sided P that two means are equal, for normal noise, never below the true one: Welch's where both
/// variances have eight degrees of freedom or more, else Student's with the fewer of both (Mickey and Brown
/// 1966). Differences of rounding have P 1, as in equalityP.
double carefulEqualityP(const Mean& a, const Mean& b);
/// Of the interval that carefulEqualityP's test inverts to.
double carefulHalfWidth(const Mean& a, const Mean& b, double confidence);

/// Sums over the differences of independent pixels.
struct DifferenceSums {
    double sum = 0, squares = 0;
    std::uint64_t count = 0;
    void add(double difference);
};
/// P that independent differences, each symmetric about 0, add to so much or more: at most 3.18 times the
/// normal one, whatever their distributions (Bentkus and Dzindzalieta 2015). Two renders with other seeds
/// and all else the same differ symmetrically, however heavy the tails of their noise. It uses no stated
/// variance. 1 when all are 0.
double symmetricP(const DifferenceSums& differences);
/// Of the interval about the mean difference that symmetricP's test inverts to; infinite with too few
/// pixels.
double symmetricHalfWidth(const DifferenceSums& differences, double confidence);
/// Below so many pixels symmetricP has no power at the levels that are used here.
inline constexpr std::uint64_t kFewestForSymmetry = 64;

}  // namespace crt::stats
