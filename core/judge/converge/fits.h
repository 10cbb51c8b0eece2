/// From rows to statements: how fast a configuration converges, what it costs, whether it is right, and how
/// sure all that is.
///
/// Relative to the scene. Errors are of luminance, divided by the mean luminance of the reference (of the
/// replicates, without one; stats/luminance_error.h), so mean squared errors here are relative² and 0.01²
/// is "1 %". The reference's own variance is subtracted from every mean squared error.
///
/// Source of intervals. Rows of one replicate are looks at one progressive render, so only replicates are
/// independent, and so are the folds of a reference. Every interval is the jackknife over both
/// (jackknife.h): leave one out, repeat the whole fit. Positive quantities are treated as logarithms. For
/// means it is Student's interval exactly; for the rest unit_fits.cpp and docs/results/accuracy.md
/// measure the coverage.
///
/// Configurations that render the same bits share the errors of whichever has more of them; times are their
/// own.
///
/// Without a reference the error is the variance between replicates: unbiased for the variance, blind to
/// bias. Deviations from their common mean are not independent; for normal errors intervals come out too
/// short by √((R − 2)/(R − 1)), and are widened by that.
#pragma once

#include "base/statistics.h"
#include "judge/converge/measurement.h"
#include "judge/stats/image_tests.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace crt::converge {

struct FitOptions {
    double confidence = 0.95;            ///< Of every interval that does not decide a verdict.
    double verdict_confidence = 0.999;   ///< Of those that do.
    double equivalence_margin = 0.01;    ///< δ: a relative bias of the image mean that would matter.
    double family_alpha = 1e-3;          ///< Below it a tile's or pixel's adjusted p-value is a difference.
    std::array<double, 2> targets{0.01, 0.001};  ///< Relative RMSE.
};

enum class ErrorSource {
    Reference,          ///< Against the scene's reference.
    BetweenReplicates,  ///< There is none.
};

/// A configuration at N samples per pixel, over the replicates that got there and are not void.
struct Point {
    std::uint64_t samples = 0;
    std::uint32_t replicates = 0;
    Estimate seconds;            ///< The waiting time of a user for N samples: start-up and render.
    Estimate render_seconds;
    Estimate relative_rmse;      ///< 0, or from 0 on, where the reference's own noise hides the error.
    /// 1/(relative MSE × seconds), start-up included. 1/s. NaN where there is no error.
    Estimate efficiency;
    std::optional<Estimate> mean_bias;      ///< Mean luminance over that of the reference, − 1.
    std::optional<Estimate>
        bias_squared;  ///< mean (E I − R)², relative²; may be below 0, which is how it contains it.
    std::optional<Estimate> calibration;    ///< Predicted over actual relative RMSE.
    std::uint32_t covered = 0, predicted = 0;  ///< Replicates whose predicted interval holds the expected
                                               ///< error within its own interval, and those that predicted.
    std::optional<double> relmse, smape, mae, flip_mean, delta_e2000_mean;  ///< Means over replicates.
};

/// render seconds = launch + per_sample · N, by least squares with relative errors.
struct TimeFit {
    double before_first_sample = 0;  ///< Mean over the replicates that timed it, seconds.
    Estimate launch;                 ///< Seconds; may be below 0.
    Estimate per_sample;             ///< c, seconds per sample per pixel.
    double r2 = 0;
    double start() const { return before_first_sample + launch.value; }  ///< t0
};

/// relative MSE = v/N + b², by least squares with relative errors.
struct ErrorFit {
    Estimate variance;     ///< v: relative MSE of one sample per pixel.
    Estimate intercept;    ///< b² of this line. Below 0 where error falls faster than 1/N, as it does with
                           ///< Sobol points on smooth images.
    /// b² without the assumption of 1/N: mean squared error minus variance between replicates, all N
    /// weighted by N². Empty without a reference.
    std::optional<Estimate> bias_squared;
    /// The better of the two: bias_squared where there is one, else the intercept.
    const Estimate& floor() const { return bias_squared ? *bias_squared : intercept; }
    Estimate verdict_floor;          ///< floor() with the verdict's confidence.
    bool flattening = false;         ///< verdict_floor is above 0.
    bool faster_than_inverse = false;  ///< intercept lies below 0 altogether: v/N is not the law here.
};

/// Samples and seconds to a relative RMSE.
struct Target {
    double relative_rmse = 0;
    /// Measured. If not, `samples` and `seconds` are a forecast: they range over all laws that fit, each
    /// with its interval. Empty where a floor forbids it.
    bool reached = false;
    /// Of a forecast: squared error falls with N to a power between these, the steepest that the last four
    /// points allow (−2 at most) and the flattest (−1 at least: no sampler is known to keep more).
    std::optional<std::array<double, 2>> powers;
    bool at_first_point = false;  ///< The fewest samples measured were enough: the figures are upper bounds.
    std::optional<Estimate> samples, seconds;
};

struct Judgement {
    stats::Verdict verdict = stats::Verdict::Inconclusive;
    std::string reason;               ///< One sentence.
    /// Relative bias of the image mean in R, G and B at the most samples, with the verdict's confidence.
    /// Empty without a reference.
    std::optional<std::array<Estimate, 3>> mean_bias;
};

/// All that is said about one configuration.
struct ConfigurationFit {
    Key key;
    /// Others whose rows are the same bit for bit: errors and verdicts are shared.
    std::vector<Key> same_bits;
    std::uint32_t replicates = 0;     ///< In the fits; points may have more.
    std::uint32_t void_rows = 0;
    bool omitted = false;             ///< It was not measured; the judgement's reason says why.
    /// Of the errors. BetweenReplicates, too, where the reference is noisier than a third of the images' own
    /// error and no bias is seen against it.
    ErrorSource source = ErrorSource::BetweenReplicates;
    bool has_reference = false;       ///< The rows that judge bias.
    std::vector<Point> points;        ///< By samples. Those with two replicates at least.
    /// Three points or more with two replicates each; else all below but the judgement is empty.
    bool fitted = false;
    /// Reason why the error is not yet known, in the sense of the error estimate of images: one sentence
    /// without a full stop; empty if it is known. Then what is below has values without bounds, and no
    /// targets.
    std::string unknown_error;
    TimeFit time;
    ErrorFit error;
    Estimate slope_samples;               ///< d log RMSE / d log N, one line through all points
    std::array<double, 2> slope_range{};  ///< Fewest and most samples of those points.
    Estimate slope_seconds;           ///< d log RMSE / d log(t − t0)
    std::vector<Target> targets;      ///< As in FitOptions::targets.
    /// The least error that every fitted configuration of the scene reached: where they can be compared
    /// without looking beyond what was measured.
    Target common;
    /// 1/(e²·N·c) for the common error e, reached with N samples: 1/(v·c) where error falls as 1/√N.
    /// Start-up excluded. 1/s. A lower bound where common.at_first_point.
    Estimate efficiency;
    Judgement judgement;
};

struct Analysis {
    FitOptions options;
    std::vector<ConfigurationFit> fits;  ///< One for each of Run::configurations, in that order.

    const ConfigurationFit* find(const Key& key) const;
};

Analysis analyze(const Run& run, const FitOptions& options = {});

/// The part of a test's result that Configuration::tests takes over; empty if the test had values that are
/// NaN or infinite.
ImageTests imageTestsOf(const stats::GateResult& gate);

/// The reference of a scene, or null when there is none.
const ReferenceInfo* findReference(const Run& run, const std::string& scene);

}  // namespace crt::converge
