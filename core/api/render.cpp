#include "render/render.h"
#include "api/border.h"
#include "base/log.h"
#include "base/parallel.h"
#include "base/stopwatch.h"
#include "render/report.h"
#include "render/watch.h"

#include <utility>

namespace crt::v0 {
namespace {

/// A Watch of the interface as one of the rooms.
class Relay : public crt::Watch {
public:
    explicit Relay(v0::Watch* watch) : watch_(watch) {}

    void progress(const ProgressState& state) override {
        if (watch_ == nullptr) return;
        Progress now;
        now.samples = state.samples;
        now.samples_wanted = state.target;
        now.seconds = state.elapsed_seconds;
        now.fraction = state.fraction();
        now.seconds_left = state.secondsLeft();
        now.paths_per_second = state.pathsPerSecond();
        if (state.error && state.error->known()) now.relative_error = state.error->half_width_95;
        watch_->progress(now);
    }
    std::optional<StopRequest> stopRequested() override {
        if (watch_ == nullptr || !watch_->stop()) return std::nullopt;
        return StopRequest{"the caller", 0};
    }

private:
    v0::Watch* const watch_;
};

crt::RenderOptions optionsOf(const RenderOptions& options) {
    crt::RenderOptions o;
    o.backend = options.backend;
    o.integrator.device = options.device;
    o.integrator.threads = options.threads;
    o.integrator.use_cache = options.use_cache;
    if (options.samples > 0) o.spp = options.samples;
    o.samples = options.sample_range;
    o.time_limit_seconds = options.time_limit_seconds;
    o.target_error = options.target_error;
    return o;
}

void refuseContradictions(const RenderOptions& options) {
    const auto refuse = [](const char* sentence) { throw crt::Error(crt::ErrorKind::Usage, sentence); };
    if (options.sample_range && options.samples > 0) refuse("samples and sample_range exclude each other");
    if (options.sample_range && options.sample_range->first >= options.sample_range->second)
        refuse("sample_range is empty: its first sample must be below its end");
    // Also when they are not numbers.
    if (!(options.time_limit_seconds >= 0)) refuse("time_limit_seconds must be 0 or more");
    if (!(options.target_error >= 0 && options.target_error < 1))
        refuse("target_error is relative to the mean luminance, at least 0 and below 1");
}

StopReason reasonOf(crt::StopReason reason) {
    switch (reason) {
        case crt::StopReason::Time: return StopReason::Time;
        case crt::StopReason::Target: return StopReason::Target;
        case crt::StopReason::Interrupted: return StopReason::Watch;
        case crt::StopReason::Samples:
        case crt::StopReason::Failed: break;  // A failure is thrown.
        case crt::StopReason::Overtaken: break;  // A render goes on after it.
    }
    return StopReason::Samples;
}

Film filmOf(crt::Rendered& run) {
    return Film(std::make_unique<Film::Impl>(Film::Impl{{std::move(run.film), std::move(run.identity)}}));
}

EarlierFilm earlierOf(Film& film) {
    auto& [sums, identity] = film.impl().film;
    return {"the earlier film", std::move(sums), std::move(identity)};
}

/// True if a render may continue an earlier one.
bool sameDevices(const crt::RenderOptions& a, const crt::RenderOptions& b) {
    return a.backend == b.backend && a.integrator.device == b.integrator.device &&
           a.integrator.threads == b.integrator.threads && a.integrator.use_cache == b.integrator.use_cache;
}

}  // namespace

/// A scene on the devices that were asked for last.
struct Session::Impl {
    explicit Impl(v0::Scene what) : scene(std::move(what)) {}

    Rendered render(std::optional<EarlierFilm> earlier, const RenderOptions& options, Watch* watch);
    /// The scene as these options want it, on their devices.
    SceneRenderer& devicesFor(const crt::RenderOptions& options);

    v0::Scene scene;
    std::optional<crt::Scene> with_replicates;  ///< Of the scene, which leaves them out, for a target error.
    std::optional<SceneRenderer> devices;      ///< Last: of one of the scenes.
};

SceneRenderer& Session::Impl::devicesFor(const crt::RenderOptions& options) {
    const bool needs_replicates = options.target_error > 0 && replicatesOf(scene.impl().scene) <= 1;
    if (devices && needs_replicates == with_replicates.has_value() &&
        sameDevices(devices->options(), options))
        return *devices;
    devices.reset();
    with_replicates.reset();
    if (needs_replicates) {
        with_replicates = scene.impl().scene;
        requireReplicates(*with_replicates);
    }
    return devices.emplace(with_replicates ? *with_replicates : scene.impl().scene, options);
}

Rendered Session::Impl::render(std::optional<EarlierFilm> earlier, const RenderOptions& options,
                               Watch* watch) {
    return api::acrossBorder(watch, [&] {
        const Stopwatch total;
        refuseContradictions(options);
        const crt::RenderOptions inner = optionsOf(options);
        SceneRenderer& on_devices = devicesFor(inner);
        const SamplingPlan plan =
            planSamples(inner, on_devices.scene(), earlier ? earlier->film.samples : SampleRanges());
        Relay relay(watch);
        crt::Rendered run = resultWithThreads(
            inner.integrator.threads, [&] { return on_devices.render(plan, std::move(earlier), relay); });
        if (run.failure) {
            const v0::Error error(static_cast<ErrorKind>(run.failure->kind()), run.failure->what(), {});
            throw RenderFailed(error, filmOf(run));
        }
        if (options.estimate_error) judgeError(run);
        run.facts.warnings = warningCount();
        run.facts.total_seconds = total.seconds();
        std::string report = reportJson(on_devices.scene(), *run.compiled, run.facts);
        const StopReason stop = reasonOf(run.facts.stop);
        return Rendered{filmOf(run), stop, std::move(report)};
    });
}

Session::Session(const Scene& scene) : impl_(std::make_unique<Impl>(scene)) {}
Session::~Session() = default;
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;

Rendered Session::render(const RenderOptions& options, Watch* watch) {
    return impl_->render(std::nullopt, options, watch);
}

Rendered Session::render(Film earlier, const RenderOptions& options, Watch* watch) {
    return impl_->render(earlierOf(earlier), options, watch);
}

RenderFailed::RenderFailed(const Error& error, Film film)
    : Error(error), film_(std::make_shared<const Film>(std::move(film))) {}
RenderFailed::~RenderFailed() = default;
RenderFailed::RenderFailed(const RenderFailed&) = default;
RenderFailed& RenderFailed::operator=(const RenderFailed&) = default;

Rendered render(const Scene& scene, const RenderOptions& options, Watch* watch) {
    return Session(scene).render(options, watch);
}

Rendered render(const Scene& scene, Film earlier, const RenderOptions& options, Watch* watch) {
    return Session(scene).render(std::move(earlier), options, watch);
}

}  // namespace crt::v0
