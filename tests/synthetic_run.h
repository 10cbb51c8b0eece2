/// Rows of renders that never were, with known variance, bias and cost: progressive means of normal samples,
/// pixel by pixel, so that looks at one replicate are nested exactly as those of a render are; against a
/// reference that is exact, or has noisy folds as `crt reference` makes them.
#pragma once

#include "base/statistics.h"
#include "film/luminance_error.h"
#include "judge/converge/measurement.h"
#include "judge/stats/squared_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace crt::converge {

struct SyntheticRender {
    double variance = 1;    ///< v: of one sample, mean over the pixels, relative to the image mean squared.
    double inequality = 1;  ///< Variance of every eighth pixel over that of the others.
    double bias = 0;        ///< b: of every pixel, alternately up and down, so that the image mean is right.
    double mean_bias = 0;   ///< Of every pixel, the same way.
    double rate = 1;        ///< Variance falls as N^−rate; 1 is independent sampling.
    double turns_at = 1e300;  ///< From this number of samples on it falls as 1/N again.
    double launch_seconds = 0.02, seconds_per_sample = 0.003;
    double before_first_sample = 0.4, start_jitter = 0.02;  ///< Mean, and relative standard deviation.
    /// Of the variance 90 % come from paths as rare as this, of lognormal brightness; 0: normal noise alone.
    double fireflies = 0;
    /// Rows state the brightest of two thousand such paths, as brightestPathOf() looks for it.
    bool brightest_known = true;
    double jitter = 0.02;   ///< Relative standard deviation of the time between two looks.
    double prediction = 1;  ///< Predicted over actual error.
    std::uint32_t replicates = 16, looks = 11, pixels = 64;
    bool has_reference = true;
    /// Of the reference's own pixel, mean over the pixels, with the same inequality; 0: it is exact and has
    /// no folds.
    double reference_variance = 0;
    /// R, G and B of an image whose luminance is 1, and what is added to each of the render's.
    std::array<double, 3> colour{1, 1, 1}, colour_bias{0, 0, 0};
};

/// Of pixel p relative to the mean; 1 on average.
inline double syntheticShare(const SyntheticRender& what, std::uint32_t p) {
    if (what.pixels % 8 != 0) return 1;
    return (p % 8 == 0 ? what.inequality : 1) * 8 / (what.inequality + 7);
}

/// The folds' luminances, [fold][pixel]; empty where the reference is exact.
inline std::vector<std::vector<double>> syntheticFolds(const SyntheticRender& what,
                                                       std::mt19937_64& engine) {
    std::normal_distribution<double> normal;
    std::vector<std::vector<double>> folds(what.has_reference && what.reference_variance > 0 ? 8 : 0);
    for (std::vector<double>& fold : folds)
        for (std::uint32_t p = 0; p < what.pixels; ++p)
            fold.push_back(1 + std::sqrt(8 * what.reference_variance * syntheticShare(what, p)) *
                                   normal(engine));
    return folds;
}

inline double syntheticMean(const std::vector<double>& values) {
    double sum = 0;
    for (const double v : values) sum += v / static_cast<double>(values.size());
    return sum;
}

inline double syntheticDistance(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (std::size_t p = 0; p < a.size(); ++p)
        sum += (a[p] - b[p]) * (a[p] - b[p]) / static_cast<double>(a.size());
    return sum;
}

inline ReferenceInfo syntheticReference(const SyntheticRender& what,
                                        const std::vector<std::vector<double>>& folds) {
    ReferenceInfo info;
    info.scene = "scene";
    info.kind = folds.empty() ? ReferenceKind::Analytic : ReferenceKind::Independent;
    info.mean_luminance = 1;
    info.image_mean = what.colour;
    if (folds.empty()) return info;
    std::vector<double> variances(what.pixels), means;
    for (std::uint32_t p = 0; p < what.pixels; ++p) {
        std::vector<double> values;
        for (const std::vector<double>& fold : folds) values.push_back(fold[p]);
        variances[p] = stats::summarize(values).variance / 8;
    }
    info.mean_variance = syntheticMean(variances);
    info.effective_pixels = stats::effectivePixels(variances, 7);
    for (const std::vector<double>& a : folds) {
        info.fold_mean_luminance.push_back(syntheticMean(a));
        info.fold_distance.emplace_back();
        for (const std::vector<double>& b : folds)
            info.fold_distance.back().push_back(syntheticDistance(a, b));
    }
    const stats::Summary mean = stats::summarize(info.fold_mean_luminance);
    info.mean_luminance = mean.mean;
    info.mean_luminance_standard_error = mean.standardError();
    info.eightfold_spread = std::sqrt(info.mean_variance) / mean.mean;
    for (std::size_t c = 0; c < 3; ++c) {
        info.image_mean[c] = what.colour[c] * mean.mean;
        info.image_mean_standard_error[c] = std::abs(what.colour[c]) * mean.standardError();
    }
    return info;
}

inline ErrorMetrics syntheticMetrics(double mse) {
    ErrorMetrics error;
    error.mse = mse;
    error.rmse = error.relative_rmse = std::sqrt(mse);
    error.relmse = mse;
    error.smape = error.mae = 0.8 * error.rmse;
    error.max_absolute = 3.5 * error.rmse;
    error.flip_mean = 0.5 * error.rmse / (0.1 + error.rmse);
    return error;
}

/// Share of the variance that comes from fireflies; mean square of a lognormal value of mean 1 and σ = 1.
inline constexpr double kRareShare = 0.9;
inline const double kMeanSquare = std::exp(1.0);

/// Sum over this number of samples, of mean 0 and this variance a sample: a Poisson number of lognormal
/// values.
inline double syntheticFireflies(double probability, double variance, double samples,
                                 std::mt19937_64& engine) {
    if (!(probability > 0)) return 0;
    double sum = 0;
    for (int n = std::poisson_distribution<int>(probability * samples)(engine); n > 0; --n)
        sum += std::lognormal_distribution<double>(-0.5, 1)(engine);
    return (sum - probability * samples) * std::sqrt(variance / (probability * kMeanSquare));
}

/// Luminance of the brightest of two thousand fireflies: the quantile of 1 − 1/2000.
inline double syntheticBrightest(const SyntheticRender& what) {
    if (!(what.fireflies > 0) || !what.brightest_known) return 0;
    const double of_values = std::exp(-0.5 + stats::normalQuantile(1 - 1 / 2000.0));
    return of_values * std::sqrt(kRareShare * what.variance / (what.fireflies * kMeanSquare));
}

/// The image mean is 1.
inline std::vector<Row> syntheticRows(const Key& key, const SyntheticRender& what, std::uint64_t seed,
                                      const std::vector<std::vector<double>>& folds = {}) {
    std::mt19937_64 engine(seed);
    std::normal_distribution<double> normal;
    const std::uint32_t replicates = what.replicates, pixels = what.pixels;
    std::vector<double> reference(pixels, folds.empty() ? 1.0 : 0.0);
    for (const std::vector<double>& fold : folds)
        for (std::uint32_t p = 0; p < pixels; ++p)
            reference[p] += fold[p] / static_cast<double>(folds.size());
    std::vector<std::vector<double>> sums(replicates, std::vector<double>(pixels)), images = sums;
    std::vector<double> seconds(replicates, what.launch_seconds);
    std::vector<double> starts;
    std::mt19937_64 clock(seed ^ 0xda942042e4dd58b5u);
    for (std::uint32_t r = 0; r < replicates; ++r)
        starts.push_back(what.before_first_sample * (1 + what.start_jitter * normal(clock)));
    normal.reset();
    std::vector<Row> rows;
    for (std::uint32_t look = 0; look < what.looks; ++look) {
        const std::uint64_t samples = std::uint64_t{1} << look, before = look == 0 ? 0 : samples / 2;
        const auto n = static_cast<double>(samples);
        const double shrink =
            std::pow(std::min(n, what.turns_at),
                     (1 - what.rate) / 2);  // From independent sampling's error to that of `rate`.
        std::vector<double> mean(pixels), variances;
        stats::SquaredNoise noise;
        for (std::uint32_t r = 0; r < replicates; ++r)
            for (std::uint32_t p = 0; p < pixels; ++p) {
                const auto more = static_cast<double>(samples - before);
                const double variance = what.variance * syntheticShare(what, p),
                             rare = what.fireflies > 0 ? kRareShare : 0;
                sums[r][p] += normal(engine) * std::sqrt((1 - rare) * variance * more) +
                              syntheticFireflies(what.fireflies, rare * variance, more, engine);
                images[r][p] =
                    1 + what.mean_bias + (p % 2 == 0 ? what.bias : -what.bias) + shrink * sums[r][p] / n;
                mean[p] += images[r][p] / replicates;
            }
        for (std::uint32_t p = 0; p < pixels; ++p) {
            std::vector<double> values;
            for (std::uint32_t r = 0; r < replicates; ++r) values.push_back(images[r][p]);
            noise.add(values);
            variances.push_back(stats::summarize(values).variance);
        }
        for (std::uint32_t r = 0; r < replicates; ++r) {
            seconds[r] += what.seconds_per_sample * static_cast<double>(samples - before) *
                          (1 + what.jitter * normal(engine));
            Row row;
            row.key = key;
            row.seed = seed + r;
            row.replicate = r;
            row.samples = samples;
            row.render_wall_seconds = seconds[r];
            row.seconds_before_first_sample = starts[r];
            row.paths = samples * pixels;
            row.closest_rays = 5 * row.paths;
            row.shadow_rays = 3 * row.paths;
            // (R − 1)/R · mean (I_r − Ī_r)² = R/(R − 1) · mean (I_r − Ī)²
            row.between_replicates_mse = syntheticDistance(images[r], mean) * replicates / (replicates - 1);
            row.effective_pixels = stats::effectivePixels(variances, replicates - 1);
            row.heavy_tail_values = noise.heavyTailValues();
            row.mean_luminance = syntheticMean(images[r]);
            row.rare_luminance = syntheticBrightest(what);
            const double deviation = std::sqrt(what.variance * std::pow(n, -what.rate));
            row.image_mean_standard_error.emplace();
            for (std::size_t c = 0; c < 3; ++c) {
                row.image_mean[c] = what.colour[c] * row.mean_luminance + what.colour_bias[c];
                (*row.image_mean_standard_error)[c] =
                    std::abs(what.colour[c]) * deviation / std::sqrt(pixels);
            }
            const double predicted = what.prediction * deviation * (1 + 0.05 * normal(engine)),
                         spread = 2 / std::sqrt(2.0 * pixels);
            row.predicted_relative_rmse =
                Estimate{predicted, predicted * (1 - spread), predicted * (1 + spread)};
            if (what.has_reference) row.error = syntheticMetrics(syntheticDistance(images[r], reference));
            for (const std::vector<double>& fold : folds)
                row.fold_mse.push_back(syntheticDistance(images[r], fold));
            if (look + 1 == what.looks) row.stop_reason = "samples";
            rows.push_back(row);
        }
    }
    return rows;
}

/// One scene, one configuration.
inline Run syntheticRun(const SyntheticRender& what, std::uint64_t seed) {
    Run run;
    Configuration configuration;
    configuration.key = {"scene", "backend", ""};
    configuration.width = what.pixels;
    configuration.height = 1;
    run.configurations.push_back(configuration);
    std::mt19937_64 engine(seed ^ 0x9e3779b97f4a7c15u);
    const std::vector<std::vector<double>> folds = syntheticFolds(what, engine);
    if (what.has_reference) run.references.push_back(syntheticReference(what, folds));
    run.rows = syntheticRows(configuration.key, what, seed, folds);
    return run;
}

}  // namespace crt::converge
