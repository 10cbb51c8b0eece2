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

/// P that squared differences add to this amount or more over the sum of the variances stated for them (a
/// Mean's variance and its degrees of freedom): Fisher's F. So a few pixels that carry the sum are judged as
/// few. It sees what changes up and down alike, and what changes in so few pixels that their signs say
/// nothing. 0 for differences where no variance is stated at all.
///
/// All degrees of freedom must be Satterthwaite's without the correction for the scatter of the estimates
/// (scatteredDof): with it, alarms are ten times as frequent as stated where few pixels carry the noise.
double excessP(const PixelSums& squares, const Mean& stated);
/// From the degrees of freedom of a sum of variances of `dof` each, what they are without that correction.
double scatteredDof(double dof_of_sum, double dof);
/// The variance of a difference of two: they add, with Satterthwaite's degrees of freedom.
Mean summedVariance(const Mean& a, const Mean& b);

/// Sums over the differences of independent pixels. Those that are 0 do not count: they have no sign.
struct DifferenceSums {
    double sum = 0, squares = 0;
    std::uint64_t count = 0;
    void add(double difference);
};
/// P that independent differences, each symmetric about 0, add to this amount or more: at most 3.18 times
/// the normal one, whatever their distributions (Bentkus and Dzindzalieta 2015). Two renders with other
/// seeds and all else the same differ symmetrically, however heavy the tails of their noise. It uses no
/// stated variance. 1 when all are 0.
double symmetricP(const DifferenceSums& differences);
/// Of the interval about the mean of the differences that count, to which symmetricP's test inverts;
/// infinite with too few of them.
double symmetricHalfWidth(const DifferenceSums& differences, double confidence);
/// Below this number of pixels symmetricP has no power at the levels that are used here.
inline constexpr std::uint64_t kFewestForSymmetry = 64;

/// Two differences up to this are equal: without noise, say in the sky, there is no other way to tell
/// rounding from bias.
double roundingOf(double a, double b);

}  // namespace crt::stats
