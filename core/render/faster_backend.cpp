#include "render/faster_backend.h"

#include "backend/loader.h"
#include "base/log.h"
#include "base/stage.h"
#include "base/stopwatch.h"

#include <algorithm>
#include <exception>
#include <utility>

namespace crt {
namespace {

constexpr double kChunkSeconds = 0.2;  ///< A rate is that of a chunk which takes at least so long.
constexpr double kMostSeconds = 5;     ///< The present backend takes 2 s for what is rendered in them.
constexpr double kFaster = 1.05;       ///< Rates of one backend differ by about as much.

/// Thrown through samples that are not waited for.
struct TrialEnds {};

/// Samples per pixel and second, of a chunk. The first chunk is not counted: a backend may still compile.
double samplesPerSecond(SceneOnDevices& tried, const SamplingPace& pace, Watch& watch) {
    const Stopwatch trial;
    const auto look = [&](double) {
        if (watch.stopRequested() || trial.seconds() > kMostSeconds) throw TrialEnds();
    };
    tried.samples = {pace.next_sample, pace.next_sample};
    double seconds = 0;
    const auto render = [&](std::uint64_t wanted) {
        const std::uint64_t count = std::min(wanted, pace.end_sample - tried.samples.second);
        const Stopwatch chunk;
        tried.film.render({.first_sample = tried.samples.second, .sample_count = count}, look);
        tried.samples.second += count;
        seconds = chunk.seconds();
        return static_cast<double>(count) / std::max(seconds, 1e-9);
    };
    double rate = render(1);
    for (std::uint64_t count = 1; tried.samples.second < pace.end_sample; count *= 4) {
        rate = render(count);
        if (seconds >= kChunkSeconds) break;
    }
    return rate;
}

/// Another backend with the scene, or null with the reason in the log.
std::unique_ptr<SceneOnDevices> openOther(const std::string& name, const Scene& scene, std::uint32_t aovs,
                                          const IntegratorOptions& options) {
    try {
        auto other = std::make_unique<SceneOnDevices>(loadBackend(name), options, scene, aovs);
        other->film.setScene();
        return other;
    } catch (const std::exception& error) {
        logDebug("{} is not tried: {}", name, error.what());
    }
    return nullptr;
}

}  // namespace

SceneOnDevices::SceneOnDevices(LoadedBackend backend, const IntegratorOptions& options, const Scene& scene,
                               std::uint32_t aovs)
    : session(std::move(backend), options),
      compiled(std::make_shared<CompiledScene>(session.compile(scene, aovs))),
      film((session.openDevice(), session.group()), *compiled) {}

std::unique_ptr<SceneOnDevices> findFasterBackend(const Scene& scene, std::uint32_t aovs,
                                                  const IntegratorOptions& options,
                                                  const FasterBackendSearch& search,
                                                  const std::string& present, const SamplingPace& pace,
                                                  Watch& watch) {
    const double pixels = static_cast<double>(pace.pixels) / 1e6;
    std::unique_ptr<SceneOnDevices> best;
    double best_rate = kFaster * pace.samples_per_second;
    for (const std::string& name : search.backends.empty() ? knownBackends() : search.backends) {
        if (name == present || watch.stopRequested()) continue;
        const Stage stage("trying " + name);
        std::unique_ptr<SceneOnDevices> other = openOther(name, scene, aovs, options);
        if (!other) continue;
        double rate = 0;
        try {
            rate = samplesPerSecond(*other, pace, watch);
            logInfo("{} renders {:.3g} million paths per second, {} {:.3g}", other->session.backend().name,
                    rate * pixels, present, pace.samples_per_second * pixels);
        } catch (const TrialEnds&) {
            if (!watch.stopRequested())
                logInfo("{} is slower than {}: two samples take more than {:.0f} s", name, present,
                        kMostSeconds);
        } catch (const std::exception& error) {
            logDebug("{} is not taken: {}", name, error.what());
        }
        if (rate <= best_rate) continue;
        best_rate = rate;
        best = std::move(other);
    }
    return best;
}

}  // namespace crt
