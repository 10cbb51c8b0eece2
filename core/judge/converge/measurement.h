/// The measurements of `crt converge`: the contract between the engine that renders and the files, fits and
/// report made of it.
///
/// A *configuration* is a scene × backend × variant. Each is rendered R times with independent seeds
/// (*replicates*); a replicate is ONE progressive render, looked at after N = 1, 2, 4 … samples per pixel,
/// each look being a Row. So rows of one replicate are nested, not independent, and intervals come from the
/// spread between replicates.
///
/// Times are in seconds, radiances in the scene's units, errors relative to the image mean where the name
/// says `relative`. A missing measurement is an empty optional, never 0: a CPU backend has no device time, a
/// scene without a reference has no error against one.
#pragma once

#include "film/film.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

namespace crt::converge {

/// Names a configuration. `variant` is the text of what `--vary` chose, e.g. "sampler=sobol nee=true"; empty
/// when nothing was varied.
struct Key {
    std::string scene, backend, variant;
    bool operator==(const Key&) const = default;
    bool operator<(const Key& other) const {
        return std::tie(scene, backend, variant) < std::tie(other.scene, other.backend, other.variant);
    }
};

/// An estimate between the ends of its two-sided interval: 95 % unless the member says otherwise.
struct Estimate {
    double value = 0, low = 0, high = 0;
};

/// Image against reference, over the luminances of all pixels (stats/luminance_error.h).
struct ErrorMetrics {
    double mse = 0;            ///< mean (I − R)²
    double rmse = 0;           ///< √mse
    double relative_rmse = 0;  ///< rmse / mean R
    double relmse = 0;         ///< mean (I − R)² / (R² + ε²), ε = mean(R)/100
    double smape = 0;          ///< mean 2|I − R| / (|I| + |R|)
    double mae = 0;            ///< mean |I − R|
    double max_absolute = 0;   ///< max |I − R|
    std::optional<double> flip_mean;         ///< Andersson et al. 2020, in [0, 1].
    std::optional<double> delta_e2000_mean;  ///< CIEDE2000.
};

/// One replicate after `samples` samples per pixel. One line of results.jsonl.
struct Row {
    Key key;
    std::uint64_t seed = 0;
    std::uint32_t replicate = 0;  ///< 0 … R − 1 within the configuration.
    std::uint64_t samples = 0;    ///< Per pixel, since the replicate began.

    double render_wall_seconds =
        0;  ///< Since the first chunk of this replicate, reading the film for looks left out.
    std::optional<double> render_device_seconds;       ///< The same by the device's clock.
    /// Parse, build, compile, upload and the first sample, with libraries loaded and kernels in the cache:
    /// every start was tried once before it was timed, so that it does not matter who is listed first. Of a
    /// start made for this replicate; empty if it had no separate start.
    std::optional<double> seconds_before_first_sample;
    std::uint64_t paths = 0;                           ///< Since the replicate began, as the two below.
    std::uint64_t closest_rays = 0, shadow_rays = 0;

    std::optional<ErrorMetrics> error;                 ///< Against the scene's reference.
    /// Mean squared difference from each fold of the reference alone, absolute; empty where it has none.
    /// With ReferenceInfo::fold_distance it says what the error would be against any of the folds.
    std::vector<double> fold_mse;
    /// (R − 1)/R · mean (I_r − Ī_r)², Ī_r the mean of the configuration's other R − 1 replicates
    /// at the same N. Its mean over replicates is their sample variance: unbiased for the variance of one
    /// image, blind to bias. It stands in for the error where there is no reference, and where there is one,
    /// mean(error->mse − between_replicates_mse) estimates bias². Known when all replicates have reached
    /// N.
    std::optional<double> between_replicates_mse;
    /// stats::effectivePixels of that variance; known with it.
    std::optional<double> effective_pixels;
    /// stats::SquaredNoise::heavyTailValues() of all replicates. Known with between_replicates_mse.
    std::optional<double> heavy_tail_values;
    std::optional<Estimate>
        predicted_relative_rmse;  ///< The error that the image states, from its own scrambles.

    /// Luminance that one of the scene's brightest paths adds to a sample where such paths are rare
    /// (film/path_facts.h), in the unit of mean_luminance; 0 where they are not.
    double rare_luminance = 0;
    double mean_luminance = 0;
    /// R, G, B. Against a closed form, all three are mean luminance.
    std::array<double, 3> image_mean{0, 0, 0};
    std::optional<std::array<double, 3>> image_mean_standard_error; ///< As the image itself predicts it.
    std::uint64_t invalid_samples = 0;                 ///< NaN or infinite. Any makes the row void.
    std::optional<double> cpu_clock_mhz, load_average; ///< At the moment of the look.
    std::string stop_reason;  ///< On the replicate's last row: "samples", "time", "target", "interrupted",
                              ///< "failed: …".

    bool isVoid() const { return invalid_samples > 0 || (error && !std::isfinite(error->mse)); }
};

/// Where the time of one configuration goes, seconds on the wall clock; medians over its replicates from
/// `first_sample` on.
struct StageSeconds {
    double parse = 0;         ///< Scene file and what it names.
    double build = 0;         ///< Scene → CompiledScene, acceleration structure.
    double compile = 0;       ///< Kernel compilation, or loading it from the cache.
    double upload = 0;
    double first_sample = 0;  ///< From all of the above being done to the first sample finished.
    double render_wall = 0;   ///< To the last sample of one replicate, the first excepted.
    std::optional<double> render_device;  ///< Part of render_wall.
    double write = 0;
};

/// A part of the kernel or program and why it is in, or what it would have been for.
struct Feature {
    std::string name, reason;
};

/// Tests of the images against the reference that need pixels: what stats::gate() finds at the most samples.
struct ImageTests {
    std::optional<double> smallest_tile_p;   ///< Welch on 8×8 tiles, smallest p after Holm's adjustment.
    std::optional<double> tile_p_uniformity;  ///< Kolmogorov–Smirnov p: are the tiles' p-values uniform?
                                              ///< (Jung et al. 2020); shown, not judged by.
    std::optional<double> smallest_pixel_p;  ///< Of all pixels and channels, Šidák-adjusted.
    std::optional<double> largest_share;     ///< Part of the squared spread of all replicates, or of the
                                             ///< reference's eighths, that one value carries.
    bool heavy_tails = false;  ///< It is above 0.05, and more than normal noise carries in one value.
};

/// One float per pixel, row-major, top row first.
struct Plane {
    std::uint32_t width = 0, height = 0;
    std::vector<float> values;
    bool empty() const { return values.empty(); }
};

/// Pictures of a configuration at `samples` samples per pixel; empty ones were not made.
struct Maps {
    std::uint64_t samples = 0;
    Image image;           ///< R, G, B.
    Plane error;           ///< |I − R| / mean R, root mean square over the channels.
    Plane standard_error;  ///< The image's own estimate, in the same unit.
    Plane z;               ///< (I − R) / pooled standard error of both, luminance; signed.
    Plane flip;            ///< In [0, 1].
};

/// Properties that are constant over the rows of a configuration.
struct Configuration {
    Key key;
    std::string device, driver,
        kernel;  ///< As the backend reports them; `kernel` e.g. "lean, 41 registers, from cache".
    std::uint32_t threads = 0;            ///< 0 when the device decides.
    std::string scene_file, scene_hash;   ///< Hash: 32 hex digits of the compiled scene (compile.h).
    std::uint32_t width = 0, height = 0;  ///< Pixels.
    std::vector<Feature> kept, left_out;
    StageSeconds stages;
    ImageTests tests;
    Maps maps;
    std::string omitted;  ///< Reason why it was not measured (backend not available …); empty if it was.
                          ///< Then only `key` is filled.
};

enum class ReferenceKind {
    Analytic,     ///< A closed form.
    Quadrature,   ///< Deterministic, by a separate program.
    Independent,  ///< A render with another seed, sampler and estimator.
    None,         ///< Errors are between replicates.
};

/// The reference of the errors of one scene.
struct ReferenceInfo {
    std::string scene;
    ReferenceKind kind = ReferenceKind::None;
    std::string file, hash;           ///< Hash: XXH3-128 of the file.
    std::uint64_t samples = 0;        ///< Per pixel; 0 for what has no samples.
    std::string estimator;            ///< "independent sampler, no light sampling, no roulette, seed 77"
    double mean_luminance = 0;        ///< The denominator of relative errors.
    double mean_luminance_standard_error = 0;
    std::array<double, 3> image_mean{0, 0, 0};           ///< R, G, B.
    std::array<double, 3> image_mean_standard_error{0, 0, 0};
    /// Mean over pixels of the variance of the reference's luminance: it is subtracted from errors.
    double mean_variance = 0;
    /// Relative RMSE between eighths of the reference, divided by √8: its own relative error.
    double eightfold_spread = 0;
    /// The noise estimate of the folds (eighths); empty without folds.
    std::vector<double> fold_mean_luminance;
    /// Mean squared difference of the luminances of two folds, absolute.
    std::vector<std::vector<double>> fold_distance;
    std::optional<double> effective_pixels;  ///< stats::effectivePixels of the reference's variance.
};

/// Place and circumstances of the run.
struct Environment {
    std::string crt_version, commit;
    bool dirty = false;               ///< The tree had changes that the commit does not.
    std::string compiler, build_flags;
    std::string cpu, operating_system;
    std::uint32_t threads = 0;
    std::string load_start, load_end; ///< 1, 5 and 15 minutes.
    std::string working_directory;
    std::vector<std::string>
        commands;  ///< As typed, quoted for a shell; more than one when the run was resumed.
    std::string started, finished;         ///< UTC, ISO 8601.
    double budget_seconds = 0;             ///< --time; 0 when there was none.
    double spent_seconds = 0;              ///< Of all sessions.
};

/// Everything that a report is made of.
struct Run {
    Environment environment;
    std::vector<ReferenceInfo> references;      ///< One for each scene at most.
    std::vector<Configuration> configurations;  ///< In the order asked for.
    std::vector<Row> rows;                      ///< In the order rendered.
    std::vector<std::string> notes;  ///< One sentence each, shown under the findings: what the engine had to
                                     ///< leave out or cut short.
};

}  // namespace crt::converge
