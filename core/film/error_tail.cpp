#include "film/error_tail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace crt {
namespace {

constexpr std::size_t kNoisiest = 256, kTail = 10;

/// A pixel is carried by one path if its standard error is at least this share of its difference from the
/// pixels around it. Exactly 1 for one path on a background without noise.
constexpr double kOnePath = 0.5;

/// Of the largest variance: below it a difference between replicates is rounding.
constexpr double kRounding = 1e-12;

/// A tail that would have less of the variance after ten times as many paths decides nothing.
constexpr double kMorePaths = 10, kShare = 0.1;

/// Below it the sum of variances has no mean.
constexpr double kDivergent = 1;
/// An estimate with more degrees of freedom has met the end of its tail, wherever that is. Of images of a
/// point light in a glossy ball, those with two to ten state half their error (decision 0058).
constexpr double kMetOften = 10;

/// Fewer paths than these show too little of the tail: an index that is not clearly above 1 then counts as
/// divergent, however many degrees of freedom there are.
constexpr double kFewPaths = 65536, kNearlyDivergent = 1.3;

/// Median of the pixels about one.
double background(const Film& film, std::uint32_t x, std::uint32_t y) {
    std::vector<double> values;
    for (std::uint32_t j = y > 0 ? y - 1 : 0; j <= std::min(y + 1, film.shape().height - 1); ++j)
        for (std::uint32_t i = x > 0 ? x - 1 : 0; i <= std::min(x + 1, film.shape().width - 1); ++i)
            if (i != x || j != y) values.push_back(film.mean(i, j, 1));
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
}

bool onePathCarries(const Film& film, const NoisyPixel& p) {
    return std::sqrt(p.variance) >= kOnePath * std::abs(film.mean(p.x, p.y, 1) - background(film, p.x, p.y));
}

}  // namespace

ErrorTail errorTail(const Film& film, std::span<NoisyPixel> pixels) {
    double sum = 0;
    for (const NoisyPixel& p : pixels) sum += p.variance;
    // Places decide between equal variances, so that the order is the same everywhere.
    const auto noisier = [](const NoisyPixel& a, const NoisyPixel& b) {
        return a.variance != b.variance ? a.variance > b.variance
                                        : std::pair(a.y, a.x) < std::pair(b.y, b.x);
    };
    const auto end = pixels.begin() + static_cast<std::ptrdiff_t>(std::min(kNoisiest, pixels.size()));
    std::partial_sort(pixels.begin(), end, pixels.end(), noisier);

    std::array<double, kTail + 1> tail{};  // One more: where the tail begins.
    std::size_t count = 0;
    for (auto p = pixels.begin(); p != end && count < tail.size(); ++p) {
        if (!(p->variance > kRounding * pixels.front().variance)) break;
        if (onePathCarries(film, *p)) tail[count++] = p->variance;
    }
    ErrorTail result{std::numeric_limits<double>::infinity(), 0};
    if (count < 2) return result;
    double logs = 0;
    for (std::size_t i = 0; i + 1 < count; ++i) {
        logs += std::log(tail[i] / tail[count - 1]);
        result.share += tail[i] / sum;
    }
    result.index = static_cast<double>(count - 1) / logs;
    return result;
}

bool tailIsOpen(const ErrorTail& tail, double degrees_of_freedom, double paths) {
    // The largest of n draws grows as n^(1/α), while the variance of all others grows as n.
    if (tail.share * std::pow(kMorePaths, 1 / tail.index - 1) < kShare) return false;
    return (tail.index < kDivergent && degrees_of_freedom < kMetOften) ||
           (tail.index < kNearlyDivergent && paths < kFewPaths);
}

}  // namespace crt
