#include "judge/stats/pooled_tests.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace crt::stats {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// c = 1/(4 P(Z ≥ √2)): no smaller one holds for all sums.
constexpr double kTailFactor = 3.1787;

/// Of the difference of two means.
double differenceDof(const Mean& a, const Mean& b) {
    constexpr double kEnoughForWelch = 8;
    const double variance = a.variance + b.variance;
    const double fewest = std::min(a.variance > 0 ? a.dof : kInfinite, b.variance > 0 ? b.dof : kInfinite);
    if (fewest < kEnoughForWelch || variance == 0) return fewest;
    const double share_a = a.variance / variance, share_b = b.variance / variance;
    const double inverse = share_a * share_a / a.dof + share_b * share_b / b.dof;
    return inverse > 0 ? 1 / inverse : kInfinite;
}

}  // namespace

double roundingOf(double a, double b) { return 0x1p-20 * std::max(std::abs(a), std::abs(b)); }

void PixelSums::add(double pixel_value, double pixel_variance) {
    value += pixel_value;
    variance += pixel_variance;
    variance_squares += pixel_variance * pixel_variance;
    ++count;
}

void PixelSums::add(const PixelSums& other) {
    value += other.value;
    variance += other.variance;
    variance_squares += other.variance_squares;
    count += other.count;
}

double PixelSums::degreesOfFreedom(double dof) const {
    const double pixels = static_cast<double>(count);
    if (std::isinf(dof) || !(variance_squares > 0)) return dof * pixels;
    const double equivalent = variance * variance / variance_squares * (dof + 2) / dof;
    return dof * std::clamp(equivalent, 1.0, pixels);
}

Mean PixelSums::mean(double dof) const {
    const double n = static_cast<double>(count);
    return {value / n, variance / (n * n), degreesOfFreedom(dof)};
}

double carefulEqualityP(const Mean& a, const Mean& b) {
    const double difference = a.value - b.value, variance = a.variance + b.variance;
    if (!std::isfinite(difference) || !std::isfinite(variance))
        return std::numeric_limits<double>::quiet_NaN();
    if (std::abs(difference) <= roundingOf(a.value, b.value)) return 1;
    if (variance == 0) return 0;
    const double t = difference / std::sqrt(variance), dof = differenceDof(a, b);
    return std::isinf(dof) ? normalTwoSided(t) : studentTwoSided(t, dof);
}

double carefulHalfWidth(const Mean& a, const Mean& b, double confidence) {
    const double variance = a.variance + b.variance, tail = 0.5 + 0.5 * confidence;
    if (variance == 0) return roundingOf(a.value, b.value);
    const double dof = differenceDof(a, b);
    const double quantile = std::isinf(dof) ? normalQuantile(tail) : studentQuantile(tail, dof);
    return std::max(roundingOf(a.value, b.value), quantile * std::sqrt(variance));
}

Mean summedVariance(const Mean& a, const Mean& b) {
    const double variance = a.variance + b.variance;
    if (!(variance > 0)) return {0, 0, kInfinite};
    const double share_a = a.variance / variance, share_b = b.variance / variance;
    const double inverse = share_a * share_a / a.dof + share_b * share_b / b.dof;
    return {0, variance, inverse > 0 ? 1 / inverse : kInfinite};
}

double excessP(const PixelSums& squares, const Mean& stated) {
    if (std::isnan(squares.variance) || std::isnan(stated.variance))
        return std::numeric_limits<double>::quiet_NaN();
    if (!(squares.variance > 0)) return 1;
    if (!(stated.variance > 0)) return 0;
    constexpr double kAsManyAsKnown = 1e9;  // A variance that is known has infinitely many.
    return fisherUpperTail(squares.variance / stated.variance, scatteredDof(squares.degreesOfFreedom(1), 1),
                           std::min(stated.dof, kAsManyAsKnown));
}

double scatteredDof(double dof_of_sum, double dof) {
    return std::isinf(dof) ? dof_of_sum : std::max(dof, dof_of_sum * dof / (dof + 2));
}

void DifferenceSums::add(double difference) {
    if (difference == 0) return;
    sum += difference;
    squares += difference * difference;
    ++count;
}

double symmetricP(const DifferenceSums& d) {
    if (std::isnan(d.sum) || std::isnan(d.squares)) return std::numeric_limits<double>::quiet_NaN();
    return d.squares > 0 ? std::min(1.0, kTailFactor * normalTwoSided(d.sum / std::sqrt(d.squares))) : 1.0;
}

/// With mean m, n values and S = Σ (d − m)², the test of a shift δ rejects when n (m − δ) > q √(S
/// + n (m − δ)²).
double symmetricHalfWidth(const DifferenceSums& d, double confidence) {
    const double n = static_cast<double>(d.count),
                 q = normalQuantile(1 - 0.5 * (1 - confidence) / kTailFactor);
    if (n <= q * q) return kInfinite;
    const double about_mean = std::max(0.0, d.squares - d.sum * d.sum / n);
    return q * std::sqrt(about_mean / (n * (n - q * q)));
}

}  // namespace crt::stats
