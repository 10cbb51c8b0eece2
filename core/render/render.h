/// Scene → film: the way that the command line, libcrt and whatever is built on it take together.
#pragma once

#include "backend/integrator.h"
#include "base/error.h"
#include "compile/compile.h"
#include "film/checkpoint.h"
#include "film/film.h"
#include "render/device_film.h"
#include "render/faster_backend.h"
#include "render/report.h"
#include "render/sampling.h"
#include "render/session.h"
#include "render/watch.h"
#include "scene/scene.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace crt {

struct RenderOptions {
    std::string backend = "auto";            ///< A name, a path of a plugin, or "auto".
    IntegratorOptions integrator;

    std::optional<std::uint64_t> spp;        ///< Render until every pixel has the samples [0, spp).
    std::optional<SampleRange> samples;      ///< Exactly these instead.
    double time_limit_seconds = 0;           ///< 0: none. Alone it replaces the scene's number of samples.
    double target_error =
        0;  ///< Stop at this relative error; 0: none. Alone it replaces the scene's number of samples.
    std::function<void()> meanwhile{};  ///< Called on a separate thread once the devices are open, for work
                                        ///< that need not wait for the render. Throws nothing.
    std::uint64_t chunk = 0;  ///< Samples per chunk; 0: so many that a chunk takes at most half a second.
    FasterBackendSearch search{};  ///< Done where no device is named.
    /// Devices that an earlier render with the same options left open, if any: this render takes them, and
    /// leaves those that it has in the end. [owner thread]
    std::shared_ptr<std::optional<Session>> kept_session{};
};

/// A target error is decided on and judged by different replicates, so there must be some: gives the scene
/// two where it leaves that open. Throws crt::Error(Usage) where it cannot have them.
void requireReplicates(Scene& scene);

/// The requested samples that are not `there`, and the conditions for stopping early.
SamplingPlan planSamples(const RenderOptions& options, const Scene& scene, const SampleRanges& there);

/// The film of an earlier run, with its scene.
struct EarlierFilm {
    std::string name;  ///< In messages.
    Film film;
    FilmIdentity identity;
};

/// Saves films while the render goes on.
struct CheckpointPlan {
    double interval_seconds = 0;         ///< 0: never.
    std::function<bool()> possible{};    ///< When set and false, one that is due waits for the next chunk.
    /// Gets the film as it is by then. An exception ends the render.
    std::function<void(const Film&, const FilmIdentity&)> save{};
};

struct Rendered {
    std::shared_ptr<const CompiledScene> compiled;
    Film film;
    FilmIdentity identity;           ///< With a record, whose run is this one.
    RunFacts facts;                  ///< All but the error, the files, the command and the total time.
    std::optional<Error> failure;    ///< The device failed while rendering; the film holds what there was.
};

/// A scene, compiled, on open devices. Renders that follow each other pay for that once. [owner thread]
class SceneRenderer {
public:
    /// Nothing is opened yet. The scene must outlive this. Of `options` what says where and how it is
    /// rendered.
    SceneRenderer(const Scene& scene, const RenderOptions& options);
    ~SceneRenderer();
    SceneRenderer(const SceneRenderer&) = delete;
    SceneRenderer& operator=(const SceneRenderer&) = delete;

    const Scene& scene() const { return scene_; }
    const RenderOptions& options() const { return options_; }

    /// Renders what `plan` (planSamples) says, onto `earlier` where there is one, and warns of what is odd
    /// about the light. No backend is opened when no sample is missing; after a failure or an exception the
    /// devices are closed, and opened again by the next call. Throws crt::Error for everything that goes
    /// wrong before the first sample.
    Rendered render(const SamplingPlan& plan, std::optional<EarlierFilm> earlier, Watch& watch,
                    const CheckpointPlan& checkpoints = {});

private:
    void open(RunFacts& facts);
    void compile();
    void close();
    Rendered rendered(const SamplingPlan& plan, std::optional<EarlierFilm> earlier, Watch& watch,
                      const CheckpointPlan& checkpoints);
    void prepare(RunFacts& facts);
    bool searchesFaster() const;
    SamplingResult sample(SamplingPlan plan, Watch& watch, const CheckpointPlan& checkpoints, Rendered& run);
    void takeOver(std::unique_ptr<SceneOnDevices> faster, Rendered& run);
    void renderSamples(const SamplingPlan& plan, Watch& watch, const CheckpointPlan& checkpoints,
                       Rendered& run);

    const Scene& scene_;
    const RenderOptions options_;
    std::optional<Session> session_;
    std::shared_ptr<CompiledScene> compiled_;
    BrightestPath brightest_path_;  ///< Of `compiled_`.
    bool searched_ = false;         ///< For a faster backend.
    std::optional<DeviceFilm> devices_;  ///< Last: of the devices of the one and the scene of the other.
};

/// Adds the film's error estimate to the facts of the run. It takes as long as adding a film.
void judgeError(Rendered& run);

/// SceneRenderer::render(), once.
Rendered render(const Scene& scene, const RenderOptions& options, const SamplingPlan& plan,
                std::optional<EarlierFilm> earlier, Watch& watch, const CheckpointPlan& checkpoints = {});

}  // namespace crt
