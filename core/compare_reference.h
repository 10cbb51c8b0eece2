/// How far two images are from a reference, which has noise of its own.
#pragma once

#include "film.h"
#include "stats/metrics.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace crt {

/// A metric, and its standard error from the choice of reference: by leaving out one eighth of it at a time (jackknife).
struct SpreadMetric {
    double value = 0;
    std::optional<double> spread;
};

/// One image against the reference.
struct ReferenceError {
    stats::ErrorMetrics metrics{};
    SpreadMetric rmse, relative_rmse, relmse, smape, mae, p99_absolute, max_absolute, mean_ratio, delta_e_mean, delta_e_max, flip;
    /// √(mse − reference variance) / mean R: what the error would be against a reference without noise. Nothing while its variance is unknown, or
    /// when the error is within it.
    std::optional<double> corrected_relative_rmse;
    bool within_reference_noise = false;
    std::vector<std::string> warnings;      ///< Why not to trust it: one sentence each.
};

struct ReferenceComparison {
    std::optional<double> reference_rms_error;   ///< √ mean variance of the reference's values / their mean.
    bool reference_noise_of_color = false;       ///< Of R, G and B; else of luminance, and then no error can be corrected.
    std::string reference_noise_source;
    std::array<ReferenceError, 2> errors;        ///< Of a and of b.
};

/// Throws crt::Error(Usage) when sizes differ or R, G and B are missing.
ReferenceComparison compareWithReference(const Image& a, const Image& b, const Image& reference, bool display_referred);

}  // namespace crt
