/// Compares the errors of two images against a noisy reference.
#pragma once

#include "film/film.h"
#include "judge/stats/metrics.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace crt {

/// A metric, and its standard error from the choice of reference: by leaving out one eighth of it at a time
/// (jackknife).
struct SpreadMetric {
    double value = 0;
    std::optional<double> spread;
};

/// One image against the reference.
struct ReferenceError {
    stats::ErrorMetrics metrics{};
    SpreadMetric relative_rmse;  ///< The error as crt states it everywhere: of luminance, relative to R's
                                 ///< mean luminance.
    SpreadMetric rmse, rmse_over_mean, relmse, smape, mae, p99_absolute, max_absolute, mean_ratio,
        delta_e_mean, delta_e_max, flip;
    /// relative_rmse with the reference's variance taken out of its square: what the error would be against
    /// a reference without noise. Nothing while its variance is unknown, or when the error is within it.
    std::optional<double> corrected_relative_rmse;
    bool within_reference_noise = false;
    std::vector<std::string> warnings;      ///< Reasons not to trust it: one sentence each.
};

struct ReferenceComparison {
    /// √ mean variance of the reference's luminance / its mean luminance.
    std::optional<double> reference_rms_error;
    std::vector<std::string> notes;  ///< Assumptions, one sentence each, without a full stop.
    std::string reference_noise_source;
    std::array<ReferenceError, 2> errors;        ///< Of a and of b.
};

/// The images are called A, B and R. Throws crt::Error(Usage) when sizes differ, R, G and B are missing, or
/// R has another exposure, white balance or colour space: those are differences, and no errors.
ReferenceComparison compareWithReference(const Image& a, const Image& b, const Image& reference,
                                         bool display_referred);

}  // namespace crt
