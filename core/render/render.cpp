#include "render/render.h"

#include "backend/loader.h"
#include "base/listener.h"
#include "base/log.h"
#include "base/memory_reserve.h"
#include "base/stage.h"
#include "base/stopwatch.h"
#include "render/brightest_path.h"
#include "render/light_checks.h"
#include "render/outputs.h"
#include "scene/missing_light.h"

#include <algorithm>
#include <limits>
#include <new>
#include <thread>
#include <utility>

namespace crt {
namespace {

/// Memory for a film's writer, besides the packed film, which may be as large as the film itself.
constexpr std::size_t kWriterBytes = std::size_t{16} << 20;

/// An empty film, or what an earlier run of the same scene left; then `identity` names its version too.
Film openFilm(std::optional<EarlierFilm> there, const CompiledScene& compiled, FilmIdentity& identity) {
    Film film(filmShapeOf(compiled));
    if (!there) return film;
    const FilmIdentity& found = there->identity;
    requireSameScene(there->name, found, identity);
    film.add(there->film);
    identity.version = joinVersions(found.version, identity.version);
    if (found.record) identity.record->addRun(*found.record);
    logInfo("resuming '{}' after {} samples per pixel", there->name, film.samples.count());
    return film;
}

/// A plugin may leave out what is only for humans.
std::string textOrEmpty(const char* text) { return text != nullptr ? text : ""; }

/// The driver of a device, which only the list of devices contains.
std::string driverOf(const std::vector<CrtDevice>& devices, const std::string& device_name) {
    for (const CrtDevice& device : devices)
        if (arrayText(device.name) == device_name) return arrayText(device.driver);
    return {};
}

/// Takes over what the backend says about itself. Its absence is no reason to lose a render.
void askForReport(Session& session, RunFacts& facts) {
    try {
        facts.backend = session.report();
    } catch (const Error& error) {
        logWarning("the backend gave no report: {}", error.what());
    }
    facts.devices = session.group().shares();
}

/// User, host and date of the render. A film that was complete before this run is written without any
/// backend.
void describeRun(FilmIdentity& identity, const RunFacts& facts) {
    if (facts.backend_name.empty()) return;
    FilmRecord run;
    run.backend = facts.backend_name + " " + facts.backend_version;
    run.device = arrayText(facts.backend.device);
    run.date_utc = dateUtc();
    identity.record->addRun(run);
}

void nameBackend(const Session& session, RunFacts& facts) {
    const LoadedBackend& backend = session.backend();
    facts.backend_name = backend.name;
    facts.backend_path = backend.path;
    facts.backend_version = textOrEmpty(backend.table->version);
    facts.backend_build = textOrEmpty(backend.table->build);
}

/// Waits for them, and says who they are.
void openDevices(Session& session, RunFacts& facts) {
    const Stage stage("opening the device");
    const Stopwatch opening;
    session.openDevice();
    facts.open_seconds += opening.seconds();
    nameBackend(session, facts);
}

/// True if the film has all requested samples. With nothing but a time to go by, the end of the time is the
/// end of the work.
bool isComplete(const RunFacts& facts) {
    return facts.stop == StopReason::Samples || facts.stop == StopReason::Target ||
           (facts.stop == StopReason::Time && facts.target_samples == 0);
}

/// Facts about the film, except its error.
void judge(const Film& film, const Scene& scene, RunFacts& facts) {
    facts.samples = film.samples;
    facts.invalid_samples = film.invalidSamples();
    facts.dropped_splats = film.droppedSplats();
    warnOfBlackFilm(film, scene);
    warnOfLargeUnits(film, scene);
    if (facts.invalid_samples > 0)
        logWarning("{} samples were NaN or infinite and were left out", facts.invalid_samples);
    if (facts.dropped_splats > 0)
        logWarning("{} splats were NaN, infinite or more than 2^31 times the power of the scene's lights, "
                   "and were left out",
                   facts.dropped_splats);
    if (!film.splats.empty() && film.replicates() == 1)
        logWarning("the error of the image is unknown: samples add to other pixels than their own, and "
                   "sampler.replicates is 1; with 2 or more it is estimated");
}

}  // namespace

void requireReplicates(Scene& scene) {
    if (replicatesOf(scene) > 1) return;
    if (!measuresLight(scene.integrator.type))
        throw Error(ErrorKind::Usage, "--target-error needs integrator.type path: the other types have no "
                                      "noise");
    if (scene.sampler.type == SamplerType::Sobol)
        throw Error(ErrorKind::Usage,
                    "--target-error needs at least 2 replicates; add --set sampler.replicates=2");
    scene.sampler.replicates = 2;
}

SamplingPlan planSamples(const RenderOptions& options, const Scene& scene, const SampleRanges& there) {
    SamplingPlan plan;
    plan.time_limit_seconds = options.time_limit_seconds;
    plan.target_error = options.target_error;
    plan.light_is_missing = !missingLight(scene).empty();
    plan.chunk = options.chunk;
    if (options.samples) {
        // An exact range says exactly which samples are new; those that the checkpoint has already would
        // count twice.
        SampleRanges together = there;
        together.add(*options.samples);
        plan.ranges = {*options.samples};
        plan.target = together.count();
        return plan;
    }
    const bool endless = !options.spp && (options.time_limit_seconds > 0 || options.target_error > 0);
    plan.ranges =
        missingSamples({0, endless ? kEndlessSamples : options.spp.value_or(scene.sampler.samples)}, there);
    if (endless) return plan;
    plan.target = there.count();
    for (const auto& [first, end] : plan.ranges) plan.target += end - first;
    return plan;
}

SceneRenderer::SceneRenderer(const Scene& scene, const RenderOptions& options)
    : scene_(scene), options_(options) {}

SceneRenderer::~SceneRenderer() {
    devices_.reset();
    if (options_.kept_session && session_) *options_.kept_session = std::move(session_);
}

void SceneRenderer::close() {
    devices_.reset();
    session_.reset();
}

/// Begins to open the devices, which takes as long as compiling a scene.
void SceneRenderer::open(RunFacts& facts) {
    if (session_) return;
    compiled_.reset();  // Perhaps without an accelerator.
    const Stage stage("opening the backend");
    const Stopwatch opening;
    if (options_.kept_session && *options_.kept_session) {
        session_ = std::exchange(*options_.kept_session, std::nullopt);
        return;
    }
    session_.emplace(options_.backend, options_.integrator);
    facts.open_seconds = opening.seconds();
    session_->beginOpeningDevice();
}

/// The data that rendering needs: one flat blob, and the mask of its features. Nothing is built for a
/// backend that brings it, nor where none will render.
void SceneRenderer::compile() {
    if (compiled_) return;
    constexpr double kNobodyTraces = std::numeric_limits<double>::infinity();
    const std::uint32_t aovs = requestedAovs(scene_);
    compiled_ = std::make_shared<CompiledScene>(
        session_ ? session_->compile(scene_, aovs)
                 : compileScene(scene_, aovs, {.accelerator_reach = kNobodyTraces}));
    const Stopwatch looking;
    // Of paths from the camera to their own pixel; splats are none.
    if (!splats(scene_.integrator.type)) brightest_path_ = brightestPathOf(*compiled_);
    logDebug("the brightest paths have a luminance of {:.3g}{} ({:.3f} s)", brightest_path_.luminance,
             brightest_path_.rare ? ", and are rare" : "", looking.seconds());
    logDebug("scene {} needs {}", compiled_->hash, featureNames(compiled_->header().features));
    warnOfIdleLamps(scene_);
    warnOfMissingLight(scene_);
}

/// The scene, with an empty film, onto devices that are open.
void SceneRenderer::prepare(RunFacts& facts) {
    const std::string& backend = session_->backend().name;
    std::optional<Stage> stage(std::in_place, "preparing the scene for " + backend);
    const Stopwatch preparing;
    if (!devices_) devices_.emplace(session_->group(), *compiled_);
    devices_->setScene([&](double done) {
        stage->setAmount(1);
        stage->at(done);
    });
    facts.prepare_seconds = preparing.seconds();
    stage.reset();
    askForReport(*session_, facts);
    facts.driver = driverOf(session_->devices(), facts.devices.front().name);
    logInfo("{} on {}", backend, arrayText(facts.backend.device));
}

bool SceneRenderer::searchesFaster() const {
    const bool may_choose = options_.backend == "auto" || !options_.search.backends.empty();
    return may_choose && options_.integrator.device.empty() && !searched_;
}

/// The devices of a faster backend, which have the scene and a few samples, instead of the present ones.
void SceneRenderer::takeOver(std::unique_ptr<SceneOnDevices> faster, Rendered& run) {
    RunFacts& facts = run.facts;
    describeRun(run.identity, facts);  // Of the samples so far.
    devices_.reset();
    session_.emplace(std::move(faster->session));
    compiled_ = std::move(faster->compiled);
    devices_.emplace(std::move(faster->film));
    nameBackend(*session_, facts);
    askForReport(*session_, facts);
    facts.driver = driverOf(session_->devices(), facts.devices.front().name);
    logInfo("{} goes on", facts.backend_name);
}

/// sampleFilm(), on a faster backend from where one is found.
SamplingResult SceneRenderer::sample(SamplingPlan plan, Watch& watch, const CheckpointPlan& checkpoints,
                                     Rendered& run) {
    const auto checkpoint = [&] {
        describeRun(run.identity, run.facts);
        checkpoints.save(run.film, run.identity);
    };
    const FasterBackendSearch& search = options_.search;
    std::unique_ptr<SceneOnDevices> faster;
    if (searchesFaster())
        plan.overtaken = [&](const SamplingPace& pace) {
            if (searched_ || pace.seconds < search.after_seconds ||
                pace.seconds_left < search.least_seconds_left ||
                pace.samples_per_second < search.least_samples_per_second)
                return false;
            searched_ = true;
            faster = findFasterBackend(scene_, requestedAovs(scene_), options_.integrator, search,
                                       session_->backend().name, pace, watch);
            return faster != nullptr;
        };
    const SamplingResult before = sampleFilm(*devices_, run.film, plan, watch, checkpoint);
    if (before.stop != StopReason::Overtaken) return before;

    SampleRanges there = run.film.samples;
    there.add(faster->samples);
    std::vector<SampleRange> left;
    for (const SampleRange& range : plan.ranges)
        for (const SampleRange& missing : missingSamples(range, there)) left.push_back(missing);
    plan.ranges = std::move(left);
    plan.overtaken = {};
    if (plan.time_limit_seconds > 0)
        plan.time_limit_seconds = std::max(plan.time_limit_seconds - before.seconds, 1e-3);
    plan.on_devices = faster->samples;
    takeOver(std::move(faster), run);
    SamplingResult result = sampleFilm(*devices_, run.film, plan, watch, checkpoint);
    result.rendered += before.rendered;
    result.chunks += before.chunks;
    result.seconds += before.seconds;
    return result;
}

/// CompiledScene → Film, by a backend.
void SceneRenderer::renderSamples(const SamplingPlan& plan, Watch& watch, const CheckpointPlan& checkpoints,
                                   Rendered& run) {
    RunFacts& facts = run.facts;
    openDevices(*session_, facts);
    std::jthread beside;
    if (options_.meanwhile)
        beside = std::jthread([&meanwhile = options_.meanwhile, listener = currentListener()] {
            const ListenerScope scope(listener);
            meanwhile();
        });
    prepare(facts);
    SamplingPlan sampling = plan;
    sampling.paths = run.identity.record->paths;
    sampling.checkpoint_interval_seconds = checkpoints.interval_seconds;
    sampling.checkpoint_possible = checkpoints.possible;
    SamplingResult result;
    {
        // To write the film afterwards.
        const MemoryReserve reserve(run.film.shape().bytes() + kWriterBytes);
        const WatchedRendering rendering(watch);
        result = sample(sampling, watch, checkpoints, run);
    }
    // A device that failed is not asked again; what it said before the first sample stands.
    if (result.stop != StopReason::Failed) askForReport(*session_, facts);
    facts.devices = session_->group().shares();
    facts.film_bands = devices_->bands();
    facts.stop = result.stop;
    facts.gave_up = result.gave_up;
    facts.request = result.request;
    facts.rendered_samples = result.rendered;
    facts.chunks = result.chunks;
    facts.sampling_seconds = result.seconds;
    run.failure = result.failure;
}

Rendered SceneRenderer::render(const SamplingPlan& plan, std::optional<EarlierFilm> earlier, Watch& watch,
                                const CheckpointPlan& checkpoints) {
    try {
        Rendered run = rendered(plan, std::move(earlier), watch, checkpoints);
        if (run.failure || run.facts.gave_up) close();
        return run;
    } catch (...) {
        close();  // They may be lost.
        throw;
    }
}

Rendered SceneRenderer::rendered(const SamplingPlan& plan, std::optional<EarlierFilm> earlier, Watch& watch,
                                  const CheckpointPlan& checkpoints) {
    dateUtc();  // Refuses now a SOURCE_DATE_EPOCH that is none.
    RunFacts facts;
    facts.target_samples = plan.target;
    facts.target_error = plan.target_error;
    const bool has_work = !plan.ranges.empty();
    if (has_work) open(facts);
    compile();
    FilmIdentity identity{.scene_hash = compiled_->hash, .version = CRT_VERSION, .record = recordOf(scene_)};
    identity.record->paths.brightest = brightest_path_;
    Film film = openFilm(std::move(earlier), *compiled_, identity);
    facts.resumed_samples = film.samples.count();
    Rendered run{compiled_, std::move(film), std::move(identity), std::move(facts), std::nullopt};
    if (has_work)
        renderSamples(plan, watch, checkpoints, run);
    else
        watch.renderingEnds();
    describeRun(run.identity, run.facts);
    run.identity.record->complete = isComplete(run.facts);
    judge(run.film, scene_, run.facts);
    return run;
}

void judgeError(Rendered& run) {
    const PathFacts& paths = run.identity.record->paths;
    const auto estimate = [&](PixelSet pixels) { return estimateError(run.film, pixels, paths); };
    try {
        run.facts.error = estimate(PixelSet::All);
        if (run.facts.target_error > 0) {
            run.facts.even_pixels = estimate(PixelSet::Even);
            run.facts.odd_pixels = estimate(PixelSet::Odd);
        }
    } catch (const std::bad_alloc&) {  // The film matters more than its error.
        logWarning("out of memory on the host: the error of the image is unknown");
    }
}

Rendered render(const Scene& scene, const RenderOptions& options, const SamplingPlan& plan,
                std::optional<EarlierFilm> earlier, Watch& watch, const CheckpointPlan& checkpoints) {
    return SceneRenderer(scene, options).render(plan, std::move(earlier), watch, checkpoints);
}

}  // namespace crt
