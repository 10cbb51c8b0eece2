#include "judge/stats/squared_noise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace crt::stats {

void SquaredNoise::add(std::span<const double> values) {
    replicates_ = static_cast<double>(values.size());
    const double mean = std::accumulate(values.begin(), values.end(), 0.0) / replicates_;
    double of_pixel = 0;
    for (const double value : values) {
        const double square = (value - mean) * (value - mean);
        of_pixel += square;
        fourth_powers_ += square * square;
        largest_ = std::max(largest_, square);
    }
    squares_ += of_pixel;
    weights_ += of_pixel * of_pixel;
    squared_weights_ += std::pow(of_pixel, 4);
}

double SquaredNoise::degreesOfFreedom() const {
    if (!(squares_ > 0)) return std::numeric_limits<double>::infinity();
    return 2 * squares_ * squares_ / (fourth_powers_ + 0.5 * largest_ * largest_);
}

double SquaredNoise::kurtosisZ() const {
    const double n = replicates_;
    if (n < 4 || !(squared_weights_ > 0)) return 0;
    const double b2 = n * fourth_powers_ / weights_, mean = 3 * (n - 1) / (n + 1);
    const double variance = 24 * n * (n - 2) * (n - 3) / ((n + 1) * (n + 1) * (n + 3) * (n + 5));
    return (b2 - mean) / std::sqrt(variance * squared_weights_) * weights_;
}

std::optional<double> SquaredNoise::heavyTailValues() const {
    constexpr double kNotNormal = 3;
    return kurtosisZ() > kNotNormal ? std::optional(degreesOfFreedom()) : std::nullopt;
}

}  // namespace crt::stats
