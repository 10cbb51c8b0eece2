/// `auto` begins a render on the first backend of a list that has a device. Once a long render has gone on
/// for a while, the others render a few samples, too, and the fastest goes on. The image does not show it: a
/// sample has the same value on every backend.
#pragma once

#include "compile/compile.h"
#include "film/film.h"
#include "render/device_film.h"
#include "render/sampling.h"
#include "render/session.h"
#include "render/watch.h"
#include "scene/scene.h"

#include <memory>
#include <string>
#include <vector>

namespace crt {

/// When other backends are tried. To open one, and to compile its kernel, may take some seconds.
struct FasterBackendSearch {
    double after_seconds = 10;   ///< Of the render. By then the Embree backend has its lean kernel.
    double least_seconds_left = 120;
    double least_samples_per_second = 1;  ///< Of a pixel. Larger images are not rendered twice to try.
    std::vector<std::string> backends{};  ///< Names or paths; empty: knownBackends(), for `auto` alone.
};

/// A backend with a scene on its devices.
struct SceneOnDevices {
    SceneOnDevices(LoadedBackend backend, const IntegratorOptions& options, const Scene& scene,
                   std::uint32_t aovs);

    Session session;
    std::shared_ptr<CompiledScene> compiled;
    DeviceFilm film;
    SampleRange samples{0, 0};  ///< In the film already.
};

/// Renders a few of the samples that come next on every other backend that can run here, and says how fast
/// each is. Returns the fastest, or null where none is faster than the present one by more than measuring
/// errs.
std::unique_ptr<SceneOnDevices> findFasterBackend(const Scene& scene, std::uint32_t aovs,
                                                  const IntegratorOptions& options,
                                                  const FasterBackendSearch& search,
                                                  const std::string& present, const SamplingPace& pace,
                                                  Watch& watch);

}  // namespace crt
