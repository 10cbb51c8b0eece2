/// Squared deviations of replicates from the means of their pixels: the accuracy of their mean, and a test
/// for tails heavier than those of normal noise.
#pragma once

#include <optional>
#include <span>

namespace crt::stats {

class SquaredNoise {
public:
    /// The values of one pixel, one for each replicate: the same number for every pixel, two at least.
    void add(std::span<const double> values);

    /// Degrees of freedom (Satterthwaite 1946) of the sum S of all squares: 2 S²/Var S, with Σ d⁴ for
    /// Var S, for any distribution: of normal noise two thirds of its number of values. One half more
    /// of the largest fourth power stands for unmet values of that size. Infinite without noise.
    double degreesOfFreedom() const;
    /// Kurtosis b₂ within pixels, in standard errors above that of normal noise (Fisher 1930, Proc.
    /// R. Soc. A 130), for any variances of the pixels: in normal noise, b₂ and variance are independent.
    /// 0 with fewer than four replicates, and without noise.
    double kurtosisZ() const;
    /// degreesOfFreedom() where the kurtosis is more than three standard errors above that of normal noise.
    std::optional<double> heavyTailValues() const;

private:
    double replicates_ = 0, squares_ = 0, fourth_powers_ = 0, largest_ = 0;
    double weights_ = 0, squared_weights_ = 0;  ///< Σ q² and Σ q⁴ of the pixels' sums of squares q.
};

}  // namespace crt::stats
