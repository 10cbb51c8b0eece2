/// Statistics of error: intervals, tests and fits, in doubles and without state. Everything random takes a
/// seed, so every answer repeats.
///
/// A confidence is the part of repeats whose interval covers the truth (0.95), an alpha the part of repeats
/// that may raise a false alarm (0.05). Distribution functions are Boost.Math's; the rest is written here,
/// as the cited papers have it. An invalid argument (a confidence of 1, fewer values than a formula needs)
/// throws crt::Error(Internal): it is the caller's bug. NaN among data is not dropped: it makes the answer
/// NaN.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace crt::stats {

struct Interval {
    double lower = 0, upper = 0;
    bool contains(double value) const { return lower <= value && value <= upper; }
    double center() const { return 0.5 * (lower + upper); }
    double halfWidth() const { return 0.5 * (upper - lower); }
};

// -------------------------------------------------------------------------------------------- distributions

/// z with P(Z ≤ z) = p, Z standard normal; 0 < p < 1.
double normalQuantile(double p);
/// t with P(T ≤ t) = p, T Student with `dof` > 0 degrees of freedom, which need not be whole.
double studentQuantile(double p, double dof);
/// x with P(X ≤ x) = p, X χ² with `dof` degrees of freedom.
double chiSquaredQuantile(double p, double dof);
/// x with P(X ≤ x) = p, X Fisher's F, the ratio of two χ²/dof.
double fisherQuantile(double p, double numerator_dof, double denominator_dof);
/// P(X ≥ x), X Fisher's F.
double fisherUpperTail(double x, double numerator_dof, double denominator_dof);
/// P(|Z| ≥ |z|).
double normalTwoSided(double z);
/// P(|T| ≥ |t|).
double studentTwoSided(double t, double dof);

// ---------------------------------------------------------------------------------------------------- means

/// Mean and spread of independent, equally distributed values: of replicates, never of the pixels of one
/// image.
struct Summary {
    double mean = 0;
    double variance = 0;      ///< Of one value, unbiased: divided by count − 1. NaN below two values.
    std::uint64_t count = 0;
    /// √(variance / count), of the mean.
    double standardError() const;
};
/// Two passes, so that a small spread about a large mean survives. Of no values the mean is NaN.
Summary summarize(std::span<const double> values);

/// Student's interval of the mean, count − 1 degrees of freedom; needs two values.
Interval meanInterval(const Summary& summary, double confidence);

struct WelchResult {
    double difference = 0;    ///< mean a − mean b
    Interval interval;        ///< Of the difference.
    double standard_error = 0;
    double t = 0;  ///< difference / standard error; 0 when both are 0, infinite when only the latter is.
    double dof = 0;           ///< Welch 1947, Satterthwaite 1946.
    double p = 1;             ///< Two-sided: P of a |t| this large when the means are equal.
};
/// Difference of two means whose variances may differ. Two values or more in each.
WelchResult welch(const Summary& a, const Summary& b, double confidence);

// ------------------------------------------------------------------------------------------------- verdicts

enum class Verdict { Pass, Fail, Inconclusive };
/// "PASS", "FAIL", "INCONCLUSIVE"
const char* verdictName(Verdict verdict);

/// Equivalence within ±delta (Schuirmann 1987, two one-sided tests): Pass when the whole interval of the
/// difference lies within, Fail when all of it lies outside, else Inconclusive: more samples are needed. NaN
/// is Inconclusive. With an interval of confidence c, a difference of delta or more passes at most (1 −
/// c)/2 of the time, and one below delta fails as rarely.
Verdict equivalence(const Interval& difference, double delta);

/// Rejects hypotheses such that the probability that any true one does is at most alpha, however they depend
/// on each other (Holm 1979). In the order given.
std::vector<bool> holm(std::span<const double> p_values, double alpha);

/// Alpha of each of `tests` independent tests of which, all hypotheses true, any raises a false alarm with
/// probability `alpha` (Šidák 1967): 1 − (1 − alpha)^(1/tests).
double sidak(double alpha, std::uint64_t tests);

/// Probability that independent p-values, uniform when nothing is wrong, lie as far from uniform as these,
/// or farther (Kolmogorov 1933, corrected for finite counts as in Vrbik 2018: within 0.0031 of the exact
/// probability from 8 values on, and below 0.1 never less than it). Needs a value; all in [0, 1].
double kolmogorovSmirnovUniform(std::span<const double> p_values);

/// Of a probability, from successes among trials: never covers less than `confidence` (Clopper and Pearson
/// 1934).
Interval clopperPearson(std::uint64_t successes, std::uint64_t trials, double confidence);

// --------------------------------------------------------------------------------------- bootstrap and fits

/// A number from a sample of `count` items, given as indices into them, some of them repeated.
using ResampledStatistic = std::function<double(std::span<const std::size_t>)>;

/// Interval of any statistic of `count` independent items, by resampling them: bias-corrected and
/// accelerated (Efron 1987). `resamples` of 1000 or more for 95 %. Covers less than it says with few items:
/// where 95 % is asked, 16 exponential values have 90 %, 64 have 93 % (measured, unit_statistics.cpp).
Interval bootstrap(std::size_t count, const ResampledStatistic& statistic, std::size_t resamples,
                   double confidence, std::uint64_t seed);

enum class Weights {
    Relative,  ///< 1/variance up to an unknown factor, which is taken from the scatter about the line.
    InverseVariances,  ///< 1/variance, as it is; the scatter only enters chi_squared.
};

/// y = intercept + slope·x.
struct LineFit {
    double intercept = 0, slope = 0;
    double intercept_variance = 0, slope_variance = 0;
    double covariance = 0;    ///< Of intercept and slope.
    double r2 = 0;            ///< Part of the weighted variance of y about its mean that the line explains.
    double chi_squared = 0;   ///< Σ w (y − line)²
    double dof = 0;           ///< Points − 2.

    double at(double x) const { return intercept + slope * x; }
    double varianceAt(double x) const {
        return intercept_variance + x * (2 * covariance + x * slope_variance);
    }
};
/// Weighted least squares. Two different x at least; with Weights::Relative variances need three points and
/// are NaN with two.
LineFit weightedLine(std::span<const double> x, std::span<const double> y, std::span<const double> weights,
                     Weights meaning = Weights::Relative);

}  // namespace crt::stats
