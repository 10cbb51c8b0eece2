#include "film/pooled_variance.h"

#include "base/statistics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace crt::stats {
namespace {

/// E[1/max(χ²/dof, 1)]: by what the square of a deviation over the larger of its own variance and the true
/// one is too small. 0.849 for one degree of freedom. Midpoint rule over the quantiles.
double meanOfScores(double dof) {
    constexpr int kPoints = 1000;
    double sum = 0;
    for (int i = 0; i < kPoints; ++i)
        sum += 1 / std::max(1.0, chiSquaredQuantile((i + 0.5) / kPoints, dof) / dof);
    return sum / kPoints;
}

}  // namespace

std::vector<double> windowMeans(std::span<const double> values, std::uint32_t width, std::uint32_t height,
                                std::uint32_t radius) {
    // Along rows, then along columns: a mean over the square is a mean of means, every row being cut alike.
    const auto along = [radius](std::span<const double> from, std::vector<double>& to, std::size_t first,
                                std::size_t step, std::uint32_t count) {
        for (std::uint32_t i = 0; i < count; ++i) {
            const std::uint32_t begin = i > radius ? i - radius : 0, end = std::min(count, i + radius + 1);
            double sum = 0;
            for (std::uint32_t j = begin; j < end; ++j) sum += from[first + j * step];
            to[first + i * step] = sum / (end - begin);
        }
    };
    std::vector<double> rows(values.size()), means(values.size());
    for (std::uint32_t y = 0; y < height; ++y) along(values, rows, std::size_t{y} * width, 1, width);
    for (std::uint32_t x = 0; x < width; ++x) along(rows, means, x, width, height);
    return means;
}

PooledVariances pooledVariances(std::span<const double> own, std::uint32_t width, std::uint32_t height,
                                double dof) {
    double largest = 0;  // In units of which no square overflows.
    for (const double v : own)
        if (std::isfinite(v)) largest = std::max(largest, v);
    const double unit = largest > 0 ? largest : 1;
    const auto means = [&](const auto& of) {
        std::vector<double> values(own.size());
        for (std::size_t i = 0; i < own.size(); ++i)
            values[i] = std::isfinite(own[i]) ? of(own[i] / unit) : 0;
        return windowMeans(values, width, height, kPooledRadius);
    };
    const std::vector<double> known = means([](double) { return 1.0; });
    const std::vector<double> sums = means([](double v) { return v; });
    const std::vector<double> squares = means([](double v) { return v * v; });
    const auto across = [](std::size_t at, std::uint32_t size) {
        const std::size_t begin = at > kPooledRadius ? at - kPooledRadius : 0;
        return static_cast<double>(std::min<std::size_t>(at + kPooledRadius + 1, size) - begin);
    };
    const double scores = dof >= 1 ? meanOfScores(dof) : 1;
    PooledVariances pooled;
    pooled.variances.assign(own.begin(), own.end());
    pooled.degrees_of_freedom.assign(own.size(), dof);
    for (std::size_t i = 0; i < own.size(); ++i) {
        if (!std::isfinite(own[i])) continue;
        const double pixels = across(i % width, width) * across(i / width, height);
        const double correction = 1 - (1 - scores) * (1 - 1 / (pixels * known[i]));  // 1 without neighbours.
        pooled.variances[i] = std::max(own[i], sums[i] / known[i] * unit) * correction;
        if (!(squares[i] > 0)) continue;
        // The estimates' squares are too large by 1 + 2/dof on average.
        const double equal = pixels * sums[i] * sums[i] / squares[i] * (1 + 2 / dof);
        pooled.degrees_of_freedom[i] = dof * std::clamp(equal, 1.0, std::max(1.0, pixels * known[i]));
    }
    return pooled;
}

std::vector<double> variancesWithoutZeros(std::vector<double> variances, std::uint32_t width,
                                          std::uint32_t height) {
    struct Level {
        std::uint32_t across, down;
        std::vector<double> sums, pixels;  ///< Of a block; infinite variances are in neither.
    };
    Level level{width, height, variances, std::vector<double>(variances.size(), 1)};
    for (std::size_t i = 0; i < variances.size(); ++i)
        if (!std::isfinite(variances[i])) level.sums[i] = level.pixels[i] = 0;
    constexpr unsigned kFirst = 3;  // Blocks of 8 × 8.
    for (unsigned shift = 1; level.across * level.down > 1; ++shift) {
        Level next{(level.across + 1) / 2, (level.down + 1) / 2, {}, {}};
        next.sums.resize(std::size_t{next.across} * next.down);
        next.pixels.resize(next.sums.size());
        for (std::uint32_t y = 0; y < level.down; ++y)
            for (std::uint32_t x = 0; x < level.across; ++x) {
                const std::size_t from = std::size_t{y} * level.across + x;
                const std::size_t to = std::size_t{y / 2} * next.across + x / 2;
                next.sums[to] += level.sums[from];
                next.pixels[to] += level.pixels[from];
            }
        level = std::move(next);
        if (shift < kFirst && level.across * level.down > 1) continue;
        bool zeros = false;
        for (std::size_t i = 0; i < variances.size(); ++i) {
            if (variances[i] != 0) continue;
            const std::size_t block = (i / width >> shift) * level.across + (i % width >> shift);
            if (level.sums[block] > 0) variances[i] = level.sums[block] / level.pixels[block];
            else zeros = true;
        }
        if (!zeros) break;
    }
    return variances;
}

}  // namespace crt::stats
