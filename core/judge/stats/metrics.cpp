#include "judge/stats/metrics.h"

#include "base/error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace crt::stats {
namespace {

NotFinite countNotFinite(std::span<const float> values) {
    NotFinite found;
    for (const float v : values) {
        found.nan += std::isnan(v);
        found.infinite += std::isinf(v);
    }
    return found;
}

double meanOf(std::span<const float> values) {
    double sum = 0;
    for (const float v : values) sum += v;
    return sum / static_cast<double>(values.size());
}

}  // namespace

ErrorMetrics errorMetrics(std::span<const float> test, std::span<const float> reference) {
    if (test.size() != reference.size())
        throw Error(ErrorKind::Internal, "an error needs as many values as its reference has");
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    ErrorMetrics m{test.size(),
                   countNotFinite(test),
                   countNotFinite(reference),
                   nan,
                   nan,
                   nan,
                   nan,
                   nan,
                   nan,
                   nan,
                   nan,
                   nan,
                   nan,
                   nan};
    if (!m.valid()) return m;

    m.test_mean = meanOf(test);
    m.reference_mean = meanOf(reference);
    m.mean_ratio = m.test_mean / m.reference_mean;
    const double epsilon = 1e-2 * m.reference_mean;
    double squares = 0, relative = 0, symmetric = 0, absolute = 0;
    std::vector<float> differences(test.size());  // As floats: only their order is asked for.
    for (std::size_t i = 0; i < test.size(); ++i) {
        const double x = test[i], y = reference[i], difference = std::abs(x - y);
        differences[i] = static_cast<float>(difference);
        if (difference == 0) continue;  // Adds nothing, and keeps 0/0 out where both are black.
        squares += difference * difference;
        relative += difference * difference / (y * y + epsilon * epsilon);
        symmetric += 2 * difference / (std::abs(x) + std::abs(y));
        absolute += difference;
    }
    const double n = static_cast<double>(test.size());
    m.mse = squares / n;
    m.rmse = std::sqrt(m.mse);
    m.relative_rmse = squares == 0 ? 0.0 : m.rmse / std::abs(m.reference_mean);
    m.relmse = relative / n;
    m.smape = symmetric / n;
    m.mae = absolute / n;
    m.max_absolute = *std::max_element(differences.begin(), differences.end());
    const auto place = differences.begin() + static_cast<std::ptrdiff_t>(std::ceil(0.99 * n)) - 1;
    std::nth_element(differences.begin(), place, differences.end());
    m.p99_absolute = *place;
    return m;
}

}  // namespace crt::stats
