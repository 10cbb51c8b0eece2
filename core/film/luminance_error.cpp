#include "film/luminance_error.h"

#include "base/error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace crt::stats {
namespace {

double determinant(const Rgb& u, const Rgb& v, const Rgb& w) {
    return u[0] * (v[1] * w[2] - v[2] * w[1]) - v[0] * (u[1] * w[2] - u[2] * w[1]) +
           w[0] * (u[1] * v[2] - u[2] * v[1]);
}

/// x / |scale|, where 0 of anything is 0.
double relativeTo(double x, double scale) { return x == 0 ? 0 : x / std::abs(scale); }

}  // namespace

// The weights w satisfy w · M = (0, 1, 0) with M = XYZ → RGB. Column c of Mᵀ is row c of M, so Cramer's
// rule replaces one row of M by (0, 1, 0).
Rgb luminanceWeights(ColorSpace space) {
    const Matrix3d m = xyzToRgb(space);
    const Rgb &r = m[0], &g = m[1], &b = m[2], y{0, 1, 0};
    const double all = determinant(r, g, b);
    return {determinant(y, g, b) / all, determinant(r, y, b) / all, determinant(r, g, y) / all};
}

// Each primary's share of the white's luminance, without a division by its own y, which may be 0.
Rgb luminanceWeights(const std::array<double, 8>& c) {
    const auto point = [&c](std::size_t i) {
        return Rgb{c[2 * i], c[2 * i + 1], 1 - c[2 * i] - c[2 * i + 1]};
    };
    const Rgb r = point(0), g = point(1), b = point(2), white = point(3);
    const double all = determinant(r, g, b) * white[1];
    return {determinant(white, g, b) / all * r[1], determinant(r, white, b) / all * g[1],
            determinant(r, g, white) / all * b[1]};
}

std::vector<float> luminances(std::span<const float> rgb, const Rgb& weights) {
    std::vector<float> values(rgb.size() / 3);
    for (std::size_t p = 0; p < values.size(); ++p)
        values[p] = static_cast<float>(luminance({rgb[3 * p], rgb[3 * p + 1], rgb[3 * p + 2]}, weights));
    return values;
}

double meanLuminance(std::span<const float> luminances) {
    if (luminances.empty()) return std::numeric_limits<double>::quiet_NaN();
    const double sum = std::accumulate(luminances.begin(), luminances.end(), 0.0);
    return sum / static_cast<double>(luminances.size());
}

double meanSquaredDifference(std::span<const float> a, std::span<const float> b) {
    if (a.size() != b.size() || a.empty())
        throw Error(ErrorKind::Internal, "an error needs two images of the same size");
    double squares = 0;
    for (std::size_t p = 0; p < a.size(); ++p) {
        const double difference = static_cast<double>(a[p]) - b[p];
        squares += difference * difference;
    }
    return squares / static_cast<double>(a.size());
}

double relativeRmse(double mse, double reference_mean) {
    return std::isnan(mse) ? mse : relativeTo(std::sqrt(std::max(mse, 0.0)), reference_mean);
}

double relativeBias(double mean, double reference_mean) {
    return relativeTo(mean - reference_mean, reference_mean);
}

double channelScale(double channel_mean, double mean_luminance) {
    return std::max(std::abs(channel_mean), std::abs(mean_luminance));
}

LuminanceError luminanceError(std::span<const float> test, std::span<const float> reference) {
    LuminanceError error;
    error.mean = meanLuminance(test);
    error.reference_mean = meanLuminance(reference);
    error.mse = meanSquaredDifference(test, reference);
    error.relative_rmse = relativeRmse(error.mse, error.reference_mean);
    error.relative_bias = relativeBias(error.mean, error.reference_mean);
    return error;
}

double effectivePixels(std::span<const double> variances, double dof) {
    const auto pixels = static_cast<double>(variances.size());
    double sum = 0, squares = 0;
    for (const double v : variances) {
        sum += v;
        squares += v * v;
    }
    if (!(squares > 0)) return pixels;
    return std::clamp(sum * sum / squares * (1 + 2 / dof), 1.0, std::max(1.0, pixels));
}

}  // namespace crt::stats
