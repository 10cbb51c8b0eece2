/// Rows of renders that never were, with known variance, bias and cost: progressive means of normal samples, pixel by pixel, so that looks at one
/// replicate are nested exactly as those of a render are.
#pragma once

#include "converge/measurement.h"

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace crt::converge {

struct SyntheticRender {
    double variance = 1;            ///< v: of one sample, relative to the image mean squared.
    double bias = 0;                ///< b: of every pixel, alternately up and down, so that the image mean is right.
    double mean_bias = 0;           ///< Of every pixel, the same way.
    double rate = 1;                ///< Variance falls as N^−rate; 1 is independent sampling.
    double launch_seconds = 0.02, seconds_per_sample = 0.003;
    double before_first_sample = 0.4;
    double jitter = 0.02;           ///< Relative standard deviation of the time between two looks.
    double prediction = 1;          ///< Predicted over actual error.
    std::uint32_t replicates = 16, looks = 11, pixels = 64;
    bool has_reference = true;
};

/// The image mean is 1.
inline std::vector<Row> syntheticRows(const Key& key, const SyntheticRender& what, std::uint64_t seed) {
    std::mt19937_64 engine(seed);
    std::normal_distribution<double> normal;
    const std::uint32_t replicates = what.replicates, pixels = what.pixels;
    std::vector<double> sums(std::size_t{replicates} * pixels, 0.0), images(sums.size());
    std::vector<double> seconds(replicates, what.launch_seconds);
    std::vector<Row> rows;
    for (std::uint32_t look = 0; look < what.looks; ++look) {
        const std::uint64_t samples = std::uint64_t{1} << look, before = look == 0 ? 0 : samples / 2;
        const auto n = static_cast<double>(samples);
        const double shrink = std::pow(n, (1 - what.rate) / 2);  // From independent sampling's error to that of `rate`.
        for (std::size_t i = 0; i < sums.size(); ++i) {
            sums[i] += normal(engine) * std::sqrt(what.variance * static_cast<double>(samples - before));
            images[i] = 1 + what.mean_bias + (i % 2 == 0 ? what.bias : -what.bias) + shrink * sums[i] / n;
        }
        for (std::uint32_t r = 0; r < replicates; ++r) {
            seconds[r] += what.seconds_per_sample * static_cast<double>(samples - before) * (1 + what.jitter * normal(engine));
            Row row;
            row.key = key;
            row.seed = seed + r;
            row.replicate = r;
            row.samples = samples;
            row.render_wall_seconds = seconds[r];
            row.seconds_before_first_sample = what.before_first_sample;
            row.paths = samples * pixels;
            row.closest_rays = 5 * row.paths;
            row.shadow_rays = 3 * row.paths;
            double mse = 0, between = 0, mean = 0;
            for (std::uint32_t p = 0; p < pixels; ++p) {
                double others = 0;
                for (std::uint32_t s = 0; s < replicates; ++s)
                    if (s != r) others += images[std::size_t{s} * pixels + p] / (replicates - 1);
                const double value = images[std::size_t{r} * pixels + p];
                mse += (value - 1) * (value - 1) / pixels;
                between += (value - others) * (value - others) / pixels * (replicates - 1) / replicates;
                mean += value / pixels;
            }
            row.between_replicates_mse = between;
            row.image_mean = {mean, mean, mean};
            const double deviation = std::sqrt(what.variance * std::pow(n, -what.rate));
            row.image_mean_standard_error = {deviation / std::sqrt(pixels), deviation / std::sqrt(pixels), deviation / std::sqrt(pixels)};
            const double predicted = what.prediction * deviation * (1 + 0.05 * normal(engine)), spread = 2 / std::sqrt(2.0 * pixels);
            row.predicted_relative_rmse = Estimate{predicted, predicted * (1 - spread), predicted * (1 + spread)};
            if (what.has_reference) {
                ErrorMetrics error;
                error.mse = mse;
                error.rmse = error.relative_rmse = std::sqrt(mse);
                error.relmse = mse;
                error.smape = error.mae = 0.8 * error.rmse;
                error.max_absolute = 3.5 * error.rmse;
                error.flip_mean = 0.5 * error.rmse / (0.1 + error.rmse);
                row.error = error;
            }
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
    if (what.has_reference) {
        ReferenceInfo reference;
        reference.scene = "scene";
        reference.kind = ReferenceKind::Analytic;
        reference.image_mean = {1, 1, 1};
        run.references.push_back(reference);
    }
    run.rows = syntheticRows(configuration.key, what, seed);
    return run;
}

}  // namespace crt::converge
