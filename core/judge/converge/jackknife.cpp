#include "judge/converge/jackknife.h"

#include "base/statistics.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>

namespace crt::converge {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A part of the variance of a statistic, and its degrees of freedom.
struct Component {
    double variance = 0, dof = 0;
};

/// The statistic on a scale, with parts of one sample left out while the others are whole.
class Parts {
public:
    Parts(const SampleCounts& counts, const Statistic& statistic, Scale scale)
        : errors_(allOf(counts.errors)), times_(allOf(counts.times)), statistic_(statistic), scale_(scale) {}

    double whole() const { return onScale({errors_, times_, 0}); }
    double withUnmet() const { return onScale({errors_, times_, 0, true}); }

    Component errors(double whole) const {
        return of(errors_, whole, [&](Indices rest) { return onScale({rest, times_, 0}); });
    }
    Component times(double whole) const {
        return of(times_, whole, [&](Indices rest) { return onScale({errors_, rest, 0}); });
    }
    Component folds(std::size_t count, double whole) const {
        std::vector<double> pseudo_values;
        for (std::size_t k = 0; k < count; ++k)
            pseudo_values.push_back(pseudoValue(count, whole, onScale({errors_, times_, k + 1})));
        return spreadOf(pseudo_values);
    }

private:
    double onScale(const Resample& resample) const {
        const double value = statistic_(resample);
        return scale_ == Scale::Logarithmic ? std::log(value) : value;
    }
    static double pseudoValue(std::size_t count, double whole, double without) {
        return static_cast<double>(count) * whole - static_cast<double>(count - 1) * without;
    }
    static Component spreadOf(const std::vector<double>& pseudo_values) {
        const bool known = std::all_of(pseudo_values.begin(), pseudo_values.end(),
                                       [](double v) { return std::isfinite(v); });
        if (pseudo_values.size() < 2 || !known) return {kInfinity, 1};
        const stats::Summary summary = stats::summarize(pseudo_values);
        return {summary.variance / static_cast<double>(summary.count),
                static_cast<double>(summary.count - 1)};
    }
    static Component of(const std::vector<std::size_t>& all, double whole,
                        const std::function<double(Indices)>& value) {
        constexpr std::size_t kMostGroups = 256;
        const std::size_t groups = std::min(all.size(), kMostGroups);
        if (groups < 2) return {kInfinity, 1};
        std::vector<double> pseudo_values;
        for (std::size_t left_out = 0; left_out < groups; ++left_out) {
            std::vector<std::size_t> rest;
            std::copy_if(all.begin(), all.end(), std::back_inserter(rest),
                         [&](std::size_t r) { return r % groups != left_out; });
            pseudo_values.push_back(pseudoValue(groups, whole, value(rest)));
        }
        return spreadOf(pseudo_values);
    }

    std::vector<std::size_t> errors_, times_;
    const Statistic& statistic_;
    Scale scale_;
};

/// Satterthwaite 1946.
Component sumOf(const std::vector<Component>& components) {
    Component sum;
    double squares = 0;
    for (const Component& c : components) {
        sum.variance += c.variance;
        squares += c.variance * c.variance / c.dof;
        sum.dof += c.dof;
    }
    if (std::isfinite(sum.variance) && squares > 0) sum.dof = sum.variance * sum.variance / squares;
    return sum;
}

}  // namespace

std::vector<std::size_t> allOf(std::size_t count) {
    std::vector<std::size_t> all(count);
    std::iota(all.begin(), all.end(), std::size_t{0});
    return all;
}

Estimate jackknife(const SampleCounts& counts, const Statistic& statistic, Scale scale, double confidence) {
    const Parts parts(counts, statistic, scale);
    const double whole = parts.whole();
    if (!std::isfinite(whole)) return {kNaN, kNaN, kNaN};
    std::vector<Component> components;
    if (counts.errors > 0) {
        Component errors = parts.errors(whole);
        // 0 · ∞ is a NaN, which has no bounds either.
        errors.variance *= counts.widening * counts.widening;
        components.push_back(errors);
    }
    if (counts.times > 0) components.push_back(parts.times(whole));
    if (counts.folds > 0) components.push_back(parts.folds(counts.folds, whole));
    const Component sum = sumOf(components);
    const auto back = [&](double value) { return scale == Scale::Logarithmic ? std::exp(value) : value; };
    if (!std::isfinite(sum.variance)) return {back(whole), back(-kInfinity), kInfinity};
    const double quantile = sum.variance > 0 ? stats::studentQuantile(0.5 + 0.5 * confidence, sum.dof) : 0;
    const double of_unmet = counts.unmet ? parts.withUnmet() - whole : 0;
    const double half = std::hypot(quantile * std::sqrt(sum.variance), of_unmet);
    if (!std::isfinite(half)) return {back(whole), back(-kInfinity), kInfinity};
    return {back(whole), back(whole - half), back(whole + half)};
}

double foldError(const SampleCounts& counts, const Statistic& statistic) {
    if (counts.folds == 0) return 0;
    const Parts parts(counts, statistic, Scale::Linear);
    return std::sqrt(parts.folds(counts.folds, parts.whole()).variance);
}

}  // namespace crt::converge
