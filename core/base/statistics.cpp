#include "base/statistics.h"

#include "base/error.h"

#include <boost/math/distributions/beta.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>

namespace crt::stats {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

void require(bool holds, const char* sentence) {
    if (!holds) throw Error(ErrorKind::Internal, sentence);
}
void requireProbability(double p, const char* sentence) { require(p > 0 && p < 1, sentence); }

/// The quantile that leaves (1 − confidence)/2 above it.
double upperTail(double confidence) {
    requireProbability(confidence, "a confidence lies between 0 and 1");
    return 0.5 + 0.5 * confidence;
}

/// Above this many degrees of freedom series that Boost's quantiles add up no longer end; the expansions
/// below are right to 1e-13 there.
constexpr double kManyDof = 1e9;

/// Wilson and Hilferty 1931: the cube root of χ²/dof is normal, up to O(1/dof) of its deviation.
double chiSquaredOfManyDof(double z, double dof) {
    const double variance = 2 / (9 * dof);
    return dof * std::pow(1 - variance + z * std::sqrt(variance), 3);
}

/// Abramowitz and Stegun 26.6.16, for Fisher's z = ½ ln F.
double fisherOfManyDof(double z, double numerator_dof, double denominator_dof) {
    const double a = 1 / (numerator_dof - 1), b = 1 / (denominator_dof - 1);
    const double h = 2 / (a + b), lambda = (z * z - 3) / 6;
    return std::exp(2 * (z * std::sqrt(h + lambda) / h - (a - b) * (lambda + 5.0 / 6 - 2 / (3 * h))));
}

/// Two variance/count pairs and their Welch–Satterthwaite degrees of freedom.
double satterthwaite(double variance_of_mean_a, std::uint64_t count_a, double variance_of_mean_b,
                     std::uint64_t count_b) {
    const double sum = variance_of_mean_a + variance_of_mean_b;
    const double na = static_cast<double>(count_a), nb = static_cast<double>(count_b);
    if (sum == 0) return na + nb - 2;
    // As shares of the sum: their squares do not underflow.
    const double share_a = variance_of_mean_a / sum, share_b = variance_of_mean_b / sum;
    return 1 / (share_a * share_a / (na - 1) + share_b * share_b / (nb - 1));
}

}  // namespace

// -------------------------------------------------------------------------------------------- distributions

double normalQuantile(double p) {
    requireProbability(p, "a quantile is asked for a probability between 0 and 1");
    return boost::math::quantile(boost::math::normal{}, p);
}

double studentQuantile(double p, double dof) {
    requireProbability(p, "a quantile is asked for a probability between 0 and 1");
    require(dof > 0, "Student's distribution needs degrees of freedom above 0");
    return boost::math::quantile(boost::math::students_t{dof}, p);
}

double chiSquaredQuantile(double p, double dof) {
    requireProbability(p, "a quantile is asked for a probability between 0 and 1");
    require(dof > 0, "the chi-squared distribution needs degrees of freedom above 0");
    if (dof > kManyDof) return chiSquaredOfManyDof(normalQuantile(p), dof);
    return boost::math::quantile(boost::math::chi_squared{dof}, p);
}

double fisherUpperTail(double x, double numerator_dof, double denominator_dof) {
    require(numerator_dof > 0 && denominator_dof > 0,
            "Fisher's distribution needs degrees of freedom above 0");
    if (std::isnan(x)) return x;
    if (!(x > 0)) return 1;
    if (std::isinf(x)) return 0;
    return boost::math::cdf(
        boost::math::complement(boost::math::fisher_f{numerator_dof, denominator_dof}, x));
}

double fisherQuantile(double p, double numerator_dof, double denominator_dof) {
    requireProbability(p, "a quantile is asked for a probability between 0 and 1");
    require(numerator_dof > 0 && denominator_dof > 0,
            "Fisher's distribution needs degrees of freedom above 0");
    if (std::min(numerator_dof, denominator_dof) > kManyDof)
        return fisherOfManyDof(normalQuantile(p), numerator_dof, denominator_dof);
    return boost::math::quantile(boost::math::fisher_f{numerator_dof, denominator_dof}, p);
}

double normalTwoSided(double z) {
    if (std::isnan(z)) return kNan;
    return std::erfc(std::abs(z) / std::numbers::sqrt2);
}

double studentTwoSided(double t, double dof) {
    require(dof > 0, "Student's distribution needs degrees of freedom above 0");
    if (std::isnan(t)) return kNan;
    if (std::isinf(t)) return 0;
    return 2 * boost::math::cdf(boost::math::complement(boost::math::students_t{dof}, std::abs(t)));
}

// ---------------------------------------------------------------------------------------------------- means

double Summary::standardError() const { return std::sqrt(variance / static_cast<double>(count)); }

Summary summarize(std::span<const double> values) {
    const double n = static_cast<double>(values.size());
    if (values.empty()) return {kNan, kNan, 0};
    const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
    if (values.size() < 2) return {mean, kNan, 1};
    double squares = 0, rest = 0;
    for (const double v : values) {
        squares += (v - mean) * (v - mean);
        rest += v - mean;  // Zero but for the rounding of the mean (Chan, Golub and LeVeque 1983).
    }
    return {mean + rest / n, (squares - rest * rest / n) / (n - 1), values.size()};
}

Interval meanInterval(const Summary& summary, double confidence) {
    const double p = upperTail(confidence);
    require(summary.count >= 2, "the interval of a mean needs two values or more");
    const double half = studentQuantile(p, static_cast<double>(summary.count - 1)) * summary.standardError();
    return {summary.mean - half, summary.mean + half};
}

WelchResult welch(const Summary& a, const Summary& b, double confidence) {
    const double p = upperTail(confidence);
    require(a.count >= 2 && b.count >= 2, "Welch's test needs two values or more on each side");
    const double va = a.variance / static_cast<double>(a.count),
                 vb = b.variance / static_cast<double>(b.count);
    WelchResult result;
    result.difference = a.mean - b.mean;
    result.standard_error = std::sqrt(va + vb);
    if (!std::isfinite(result.difference) || !std::isfinite(result.standard_error)) {
        result.t = result.dof = result.p = kNan;
        result.interval = {kNan, kNan};
        return result;
    }
    result.dof = satterthwaite(va, a.count, vb, b.count);
    result.t = result.difference == 0 ? 0 : result.difference / result.standard_error;
    result.p = studentTwoSided(result.t, result.dof);
    const double half =
        result.standard_error == 0 ? 0 : studentQuantile(p, result.dof) * result.standard_error;
    result.interval = {result.difference - half, result.difference + half};
    return result;
}

// ------------------------------------------------------------------------------------------------- verdicts

const char* verdictName(Verdict verdict) {
    switch (verdict) {
        case Verdict::Pass: return "PASS";
        case Verdict::Fail: return "FAIL";
        case Verdict::Inconclusive: break;
    }
    return "INCONCLUSIVE";
}

Verdict equivalence(const Interval& difference, double delta) {
    require(delta > 0, "equivalence needs a delta above 0");
    if (difference.lower >= -delta && difference.upper <= delta) return Verdict::Pass;
    if (difference.lower > delta || difference.upper < -delta) return Verdict::Fail;
    return Verdict::Inconclusive;
}

std::vector<bool> holm(std::span<const double> p_values, double alpha) {
    requireProbability(alpha, "alpha lies between 0 and 1");
    // NaN has no place in an order, and must not slip through as not rejected.
    require(std::none_of(p_values.begin(), p_values.end(), [](double p) { return std::isnan(p); }),
            "a p-value is NaN");
    std::vector<std::size_t> order(p_values.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t i, std::size_t j) { return p_values[i] < p_values[j]; });
    std::vector<bool> rejected(p_values.size(), false);
    for (std::size_t i = 0; i < order.size(); ++i) {
        if (p_values[order[i]] > alpha / static_cast<double>(order.size() - i)) break;
        rejected[order[i]] = true;
    }
    return rejected;
}

double sidak(double alpha, std::uint64_t tests) {
    requireProbability(alpha, "alpha lies between 0 and 1");
    require(tests > 0, "there is no test to share alpha with");
    return -std::expm1(std::log1p(-alpha) /
                       static_cast<double>(tests));  // With many tests 1 − (…) would lose its digits.
}

double kolmogorovSmirnovUniform(std::span<const double> p_values) {
    require(!p_values.empty(), "the Kolmogorov–Smirnov test needs a value");
    std::vector<double> sorted(p_values.begin(), p_values.end());
    require(std::all_of(sorted.begin(), sorted.end(), [](double p) { return p >= 0 && p <= 1; }),
            "a p-value is not between 0 and 1");
    std::sort(sorted.begin(), sorted.end());
    const double n = static_cast<double>(sorted.size());
    double distance = 0;
    for (std::size_t i = 0; i < sorted.size(); ++i) {
        const double below = static_cast<double>(i) / n, above = static_cast<double>(i + 1) / n;
        distance = std::max({distance, sorted[i] - below, above - sorted[i]});
    }
    const double root = std::sqrt(n);
    const double lambda = root * distance + 1 / (6 * root) + (root * distance - 1) / (4 * n);
    // Two series of the same sum (theta functions); each where it converges in a few terms.
    if (lambda < 1e-3) return 1;
    if (lambda < 1) {
        constexpr double pi = std::numbers::pi;
        double sum = 0;
        for (int k = 1; k <= 9; k += 2) sum += std::exp(-k * k * pi * pi / (8 * lambda * lambda));
        return std::clamp(1 - std::sqrt(2 * pi) / lambda * sum, 0.0, 1.0);
    }
    double sum = 0;
    for (int k = 1; k <= 6; ++k) sum += (k % 2 ? 2 : -2) * std::exp(-2.0 * k * k * lambda * lambda);
    return std::clamp(sum, 0.0, 1.0);
}

Interval clopperPearson(std::uint64_t successes, std::uint64_t trials, double confidence) {
    const double p = upperTail(confidence);
    require(trials > 0 && successes <= trials, "there are more successes than trials, or no trials");
    const double k = static_cast<double>(successes), n = static_cast<double>(trials);
    using boost::math::beta_distribution;
    Interval interval{0, 1};
    if (successes > 0) interval.lower = boost::math::quantile(beta_distribution<>{k, n - k + 1}, 1 - p);
    if (successes < trials) interval.upper = boost::math::quantile(beta_distribution<>{k + 1, n - k}, p);
    return interval;
}

// --------------------------------------------------------------------------------------- bootstrap and fits

namespace {

/// Acceleration: a sixth of the skewness of the jackknife's values (Efron 1987, 6.6).
double acceleration(std::size_t count, const ResampledStatistic& statistic) {
    std::vector<std::size_t> others(count - 1);
    std::vector<double> left_out(count);
    for (std::size_t out = 0; out < count; ++out) {
        for (std::size_t i = 0; i + 1 < count; ++i) others[i] = i < out ? i : i + 1;
        left_out[out] = statistic(others);
    }
    const double mean = std::accumulate(left_out.begin(), left_out.end(), 0.0) / static_cast<double>(count);
    double squares = 0, cubes = 0;
    for (const double v : left_out) {
        squares += (mean - v) * (mean - v);
        cubes += (mean - v) * (mean - v) * (mean - v);
    }
    const double a = cubes / (6 * std::pow(squares, 1.5));
    return std::isfinite(a) ? a : 0;
}

/// Sorted values → quantile, linear between neighbours.
double quantileOf(const std::vector<double>& sorted, double p) {
    const double place = p * static_cast<double>(sorted.size() - 1);
    const auto below = std::min(static_cast<std::size_t>(place), sorted.size() - 2);
    const double t = place - static_cast<double>(below);
    return sorted[below] + t * (sorted[below + 1] - sorted[below]);
}

}  // namespace

Interval bootstrap(std::size_t count, const ResampledStatistic& statistic, std::size_t resamples,
                   double confidence, std::uint64_t seed) {
    const double tail = upperTail(confidence);
    require(count >= 2 && resamples >= 2, "a bootstrap needs two items and two resamples or more");
    require(count < (std::uint64_t{1} << 32), "a bootstrap takes fewer than 2^32 items");
    std::vector<std::size_t> drawn(count);
    std::iota(drawn.begin(), drawn.end(), std::size_t{0});
    const double whole = statistic(drawn);

    // std::uniform_int_distribution differs between libraries; this does not. Its bias is below 2^-32 ·
    // count.
    std::mt19937_64 random(seed);
    std::vector<double> values(resamples);
    for (double& value : values) {
        for (std::size_t& index : drawn) index = static_cast<std::size_t>(((random() >> 32) * count) >> 32);
        value = statistic(drawn);
    }
    if (!std::isfinite(whole) ||
        std::any_of(values.begin(), values.end(), [](double v) { return std::isnan(v); }))
        return {kNan, kNan};
    std::sort(values.begin(), values.end());

    const auto [first, last] = std::equal_range(values.begin(), values.end(), whole);
    const double below = static_cast<double>(first - values.begin()),
                 equal = static_cast<double>(last - first);
    const double part = (below + 0.5 * equal) / static_cast<double>(resamples);
    if (part <= 0 || part >= 1)
        return {std::min(values.front(), whole),
                std::max(values.back(), whole)};  // No bias correction reaches there.
    const double bias = normalQuantile(part), accelerated = acceleration(count, statistic);
    const auto corrected = [&](double z) {
        const double shifted = bias + (bias + z) / (1 - accelerated * (bias + z));
        return quantileOf(values, 0.5 * std::erfc(-shifted / std::numbers::sqrt2));
    };
    const double z = normalQuantile(tail);
    return {corrected(-z), corrected(z)};
}

LineFit weightedLine(std::span<const double> x, std::span<const double> y, std::span<const double> weights,
                     Weights meaning) {
    require(x.size() == y.size() && x.size() == weights.size(), "a line needs as many y and weights as x");
    require(x.size() >= 2, "a line needs two points or more");
    require(std::all_of(weights.begin(), weights.end(), [](double w) { return w > 0; }),
            "the weights of a line are above 0");
    double w = 0, mean_x = 0, mean_y = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        w += weights[i];
        mean_x += weights[i] * x[i];
        mean_y += weights[i] * y[i];
    }
    mean_x /= w;
    mean_y /= w;
    // About the weighted means, where the normal equations are diagonal and well conditioned.
    double xx = 0, xy = 0, yy = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double dx = x[i] - mean_x, dy = y[i] - mean_y;
        xx += weights[i] * dx * dx;
        xy += weights[i] * dx * dy;
        yy += weights[i] * dy * dy;
    }
    require(!(xx == 0), "a line needs two different x");
    LineFit fit;
    fit.slope = xy / xx;
    fit.intercept = mean_y - fit.slope * mean_x;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double residual = (y[i] - mean_y) - fit.slope * (x[i] - mean_x);
        fit.chi_squared += weights[i] * residual * residual;
    }
    fit.dof = static_cast<double>(x.size()) - 2;
    fit.r2 = yy == 0 ? 1 : 1 - fit.chi_squared / yy;
    const double factor = meaning == Weights::InverseVariances ? 1
                          : fit.dof > 0                        ? fit.chi_squared / fit.dof
                                                               : kNan;
    fit.slope_variance = factor / xx;
    fit.intercept_variance = factor * (1 / w + mean_x * mean_x / xx);
    fit.covariance = -factor * mean_x / xx;
    return fit;
}

}  // namespace crt::stats
