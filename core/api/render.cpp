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
    }
    return StopReason::Samples;
}

Film filmOf(crt::Rendered& run) {
    return Film(std::make_unique<Film::Impl>(Film::Impl{{std::move(run.film), std::move(run.identity)}}));
}

Rendered renderOnto(const Scene& scene, std::optional<EarlierFilm> earlier, const RenderOptions& options,
                    Watch* watch) {
    return api::acrossBorder(watch, [&] {
        const Stopwatch total;
        refuseContradictions(options);
        const crt::RenderOptions inner = optionsOf(options);
        const crt::Scene* what = &scene.impl().scene;
        crt::Scene with_replicates;
        if (inner.target_error > 0 && replicatesOf(*what) <= 1) {
            with_replicates = *what;
            requireReplicates(with_replicates);
            what = &with_replicates;
        }
        const SamplingPlan plan =
            planSamples(inner, *what, earlier ? earlier->film.samples : SampleRanges());
        Relay relay(watch);
        crt::Rendered run = resultWithThreads(inner.integrator.threads, [&] {
            return render(*what, inner, plan, std::move(earlier), relay);
        });
        if (run.failure) {
            const v0::Error error(static_cast<ErrorKind>(run.failure->kind()), run.failure->what(), {});
            throw RenderFailed(error, filmOf(run));
        }
        run.facts.warnings = warningCount();
        run.facts.total_seconds = total.seconds();
        std::string report = reportJson(*what, run.compiled, run.facts);
        const StopReason stop = reasonOf(run.facts.stop);
        return Rendered{filmOf(run), stop, std::move(report)};
    });
}

}  // namespace

RenderFailed::RenderFailed(const Error& error, Film film)
    : Error(error), film_(std::make_shared<const Film>(std::move(film))) {}
RenderFailed::~RenderFailed() = default;
RenderFailed::RenderFailed(const RenderFailed&) = default;
RenderFailed& RenderFailed::operator=(const RenderFailed&) = default;

Rendered render(const Scene& scene, const RenderOptions& options, Watch* watch) {
    return renderOnto(scene, std::nullopt, options, watch);
}

Rendered render(const Scene& scene, Film earlier, const RenderOptions& options, Watch* watch) {
    auto& [film, identity] = earlier.impl().film;
    return renderOnto(scene, EarlierFilm{"the earlier film", std::move(film), std::move(identity)}, options,
                      watch);
}

}  // namespace crt::v0
