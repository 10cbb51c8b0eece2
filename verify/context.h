/// The context of a case: the backend under test, renders of scenes given as YAML, and the checks that turn
/// figures into outcomes.
#pragma once

#include "backend/integrator.h"
#include "backend/loader.h"
#include "film/film.h"
#include "render/session.h"
#include "render/watch.h"
#include "scene/yaml/scene_yaml.h"
#include "verify/case.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace crt::verify {

/// The settings of a render.
struct Render {
    std::uint64_t samples = 16;
    std::uint64_t first_sample = 0;
    std::optional<std::uint64_t> seed{};  ///< Instead of the scene's.
    std::uint32_t aovs = 0;
    CrtKernelChoice kernel = CRT_KERNEL_LEAN;  ///< LEAN: as the suite is asked to, which is lean by default.
    unsigned threads = 0;
    unsigned tile_size = 0;
    bool squares = false;  ///< One sequence, whose film has the variance of its paths (pathVariance).
};

inline Render samples(std::uint64_t count, std::uint32_t aovs = 0) {
    return {.samples = count, .aovs = aovs};
}

/// A value that a known mistake would give instead of the right one. A failing check names the mistake whose
/// value it found.
struct Mistake {
    double value;
    std::string physics;
};

/// The number of samples that an estimate may take. It begins with `samples` a pixel and seed, and goes on
/// with two or four times as many while it is inconclusive.
struct Effort {
    std::uint64_t samples = 64;
    std::uint64_t most = 4096;
    int seeds = 16;
};

/// A number that is made of a film: the mean radiance, one pixel.
using Measure = std::function<double(const Film&)>;
/// A number that is made of the films of several scenes, rendered with the same seed: a ratio, a difference.
using JointMeasure = std::function<double(const std::vector<Film>&)>;

/// One of several numbers that are made of the same films, and what it should be.
struct Quantity {
    std::string what;
    JointMeasure measure;
    double expected;
};

/// The run is to end in the middle of a case. Nothing that went wrong: cases must not take it for an error.
struct Stopped {
    StopRequest request;
};

class Context {
public:
    /// Throws Stopped out of every render from when `watch` asks for an end.
    Context(const LoadedBackend& backend, const IntegratorOptions& options, Level level, Watch& watch);

    const LoadedBackend& backend() const { return backend_; }
    Level level() const { return level_; }
    /// True if this run includes the questions that are reserved for `level`.
    bool atLeast(Level level) const { return level_ >= level; }
    /// A number for each level: on every commit, before a merge, at night.
    std::uint64_t byLevel(std::uint64_t commit, std::uint64_t merge, std::uint64_t nightly) const {
        return atLeast(Level::Nightly) ? nightly : atLeast(Level::Merge) ? merge : commit;
    }

    // Rendering. Samples that are NaN or infinite fail the case.
    Scene scene(const std::string& yaml, const std::vector<SceneOverride>& overrides = {}) const;
    Film render(const std::string& yaml, const Render& how = {});
    Film render(const Scene& scene, const Render& how = {});
    /// The same for cases that ask for samples that are no numbers.
    Film renderRaw(const Scene& scene, const Render& how = {});

    /// Rays and paths of the last render.
    const CrtBackendReport& report() const { return report_; }

    // Checks. Each adds an outcome.
    /// |measured − expected| ≤ relative · |expected|; where 0 is expected, exactly 0.
    void relative(const std::string& what, double measured, double expected, double tolerance,
                  const std::vector<Mistake>& mistakes = {});
    void absolute(const std::string& what, double measured, double expected, double tolerance,
                  const std::vector<Mistake>& mistakes = {});
    /// Equivalence: the 99.9 % Student interval of the mean of `replicates` lies within ±delta · expected.
    void equivalent(const std::string& what, const std::vector<double>& replicates, double expected,
                    double delta, const std::vector<Mistake>& mistakes = {});
    /// The same of the values of `replicatesOf`, for a number of samples that grows as far as needed.
    void equivalent(const std::string& what,
                    const std::function<std::vector<double>(std::uint64_t samples)>& replicatesOf,
                    double expected, double delta, const Effort& effort);
    /// The same of `measure` over the films of several seeds, with as many samples as it takes. A scene that
    /// does not name a number of replicates gets one sequence.
    void estimate(const std::string& what, const std::string& yaml, const Measure& measure, double expected,
                  double delta, const Effort& effort = {}, const std::vector<Mistake>& mistakes = {});
    void estimate(const std::string& what, const std::vector<std::string>& scenes,
                  const JointMeasure& measure, double expected, double delta, const Effort& effort = {},
                  const std::vector<Mistake>& mistakes = {});
    /// Several numbers of the same films, which are rendered once. Goes on until it can tell of each.
    void estimate(const std::vector<Quantity>& quantities, const std::vector<std::string>& scenes,
                  double delta, const Effort& effort = {}, const std::vector<Mistake>& mistakes = {});
    /// The outcomes of an estimate, for cases that keep only the worst of many.
    std::vector<Outcome> estimated(const std::vector<Quantity>& quantities,
                                   const std::vector<std::string>& scenes, double delta,
                                   const Effort& effort, const std::vector<Mistake>& mistakes);
    /// The upper end of the 99.9 % Clopper–Pearson interval of the rate of failures is at most `bound`.
    void rate(const std::string& what, std::uint64_t failures, std::uint64_t trials, double bound,
              const std::string& physics);
    /// Every channel of every pixel the same, as the floats that are written.
    void sameBits(const std::string& what, const Film& a, const Film& b, const std::string& physics);
    /// A yes or no.
    void holds(const std::string& what, bool true_, const std::string& tolerance, const std::string& physics,
               const std::string& note = {});
    void notApplicable(const std::string& what, const std::string& reason);
    void add(Outcome outcome);

    /// Outcomes so far; the runner takes them.
    std::vector<Outcome> take();

private:
    Session& sessionFor(const Render& how);
    void stopIfAsked() const;

    const LoadedBackend& backend_;
    IntegratorOptions options_;
    Level level_;
    Watch& watch_;
    std::unique_ptr<Session> usual_, unusual_;  ///< With the run's options; with a case's own.
    CrtBackendReport report_{};
    std::vector<Outcome> outcomes_;
};

/// Radiance of one pixel for light without colour: (X + Y + Z) over what radiance 1 gives. Over the
/// wavelengths of a path that sum varies less than each of X, Y and Z.
double radiance(const Film& film, std::uint32_t x, std::uint32_t y);
/// Mean over all pixels.
double radiance(const Film& film);
/// The same by a name that is no overload, as a Measure.
inline double meanRadiance(const Film& film) { return radiance(film); }
/// Mean over all pixels of a bin of a spectral film, or of a response, which follow the bins.
double meanOfBin(const Film& film, std::uint32_t bin);
/// Of `a` and `b` the one that is farther from `target`; NaN when either is, which std::max would lose.
double fartherFrom(double target, double a, double b);
/// Y of a pixel of `film` over `factor` times that of the same pixel of `unit`, of all pixels the ratio that
/// is farthest from 1. NaN when any pixel's is.
double worstRatio(const Film& film, const Film& unit, double factor = 1);
/// Variance of Y of one path of a pixel, from the film's second moment: right for independent samples.
double pathVariance(const Film& film, std::uint32_t x, std::uint32_t y);
/// Mean over all pixels.
double pathVariance(const Film& film);
/// Mean X, Y and Z over all pixels.
Vec3d meanXyz(const Film& film);
/// Mean of Y over all pixels.
double luminance(const Film& film);

}  // namespace crt::verify
