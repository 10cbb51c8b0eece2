#include "render/job.h"

#include "backend/loader.h"
#include "base/atomic_file.h"
#include "base/log.h"
#include "base/stage.h"
#include "base/unit_text.h"
#include "compile/compile.h"
#include "film/checkpoint.h"
#include "film/checkpoint_writer.h"
#include "film/error_text.h"
#include "film/resolve.h"
#include "render/light_checks.h"
#include "render/output_guard.h"
#include "render/outputs.h"
#include "render/report.h"
#include "render/sampling.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>

namespace crt {
namespace {

class Stopwatch {
public:
    double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// The files that this job writes or may have to write.
struct Files {
    OutputPlan outputs;
    std::string checkpoint;          ///< Where a checkpoint goes if one is written.
    bool checkpoint_wanted = false;  ///< Also when nothing stops the render short.
    std::string saved;               ///< Where it was written in the end.
    std::string resume;              ///< Empty: start from nothing.
    std::string report;              ///< Empty: none.
    FilmGuard films;                 ///< What lies where films will be written.
};

std::vector<std::string> imageNames(const OutputPlan& plan) {
    std::vector<std::string> names;
    for (const Output& image : plan.images) names.push_back(image.file);
    return names;
}

/// Names them, and finds out now what cannot be written: nobody should learn after an hour that a directory
/// is missing.
Files planFiles(const Job& job, const Scene& scene) {
    Files files;
    files.outputs = planOutputs(job.outputs, scene);
    files.checkpoint = !job.checkpoint_file.empty() ? job.checkpoint_file
                       : !job.resume_file.empty()   ? job.resume_file
                                                  : besideOutput(files.outputs.first, kCheckpointExtension);
    files.checkpoint_wanted =
        job.resume || !job.checkpoint_file.empty();  // Who resumes once will want to resume again.
    if (job.resume) {
        files.resume = !job.resume_file.empty() ? job.resume_file : files.checkpoint;
        std::error_code unreadable;
        if (!std::filesystem::exists(files.resume, unreadable)) {
            if (!job.resume_file.empty())
                throw Error(ErrorKind::Usage,
                            fmt::format("there is no checkpoint '{}' to resume", files.resume));
            // A batch job that is started again and again with one command line begins somewhere.
            logInfo("no checkpoint '{}' yet: starting from the first sample", files.resume);
            files.resume.clear();
        }
    }
    files.report = job.report_file ? *job.report_file : besideOutput(files.outputs.first, ".report.json");

    dateUtc();  // Refuses a SOURCE_DATE_EPOCH that is none.
    std::vector<std::string> written = imageNames(files.outputs), films = files.outputs.films;
    if (!files.report.empty()) written.push_back(files.report);
    // The last; crt chose its name, unless it is also one of the others.
    films.push_back(files.checkpoint);
    refuseOverInputs(scene.files_read, written, films);
    for (std::size_t i = 0; i < films.size(); ++i) {
        const std::string& film = films[i];
        const bool wanted = i + 1 < films.size() || files.checkpoint_wanted;
        if (files.resume.empty() || film != files.resume) files.films.look(film, wanted, job.overwrite);
    }

    for (const Output& image : files.outputs.images) checkWritable(image.file);
    for (const std::string& film : files.outputs.films) checkWritable(film);
    checkWritable(files.checkpoint);
    if (!files.report.empty()) checkWritable(files.report);
    return files;
}

/// A target error is decided on and judged by different replicates, so there must be some. Independent
/// samples are the same with them.
void requireReplicates(Scene& scene) {
    if (replicatesOf(scene) > 1) return;
    if (scene.integrator.type != IntegratorType::Path)
        throw Error(ErrorKind::Usage, "--target-error is for integrator.type path: the views have no noise");
    if (scene.sampler.type == SamplerType::Sobol)
        throw Error(ErrorKind::Usage,
                    "--target-error needs the replicates that sampler.replicates: 1 leaves out; add --set "
                    "sampler.replicates=2");
    scene.sampler.replicates = 2;
}

/// What an earlier run left, with what it was rendered from.
using EarlierFilm = std::optional<std::pair<Film, FilmIdentity>>;

EarlierFilm readEarlierFilm(const Files& files) {
    if (files.resume.empty()) return std::nullopt;
    const Stage stage("reading " + files.resume);
    return readCheckpoint(files.resume);
}

/// An empty film, or what an earlier run of the same scene left; then `identity` names its version too.
Film openFilm(const Files& files, const EarlierFilm& there, const CompiledScene& compiled,
              FilmIdentity& identity) {
    Film film({compiled.width, compiled.height, compiled.channels, compiled.aovs});
    if (!there) return film;
    const auto& [earlier, found] = *there;
    requireSameScene(files.resume, found, identity);
    film.add(earlier);
    identity.version = joinVersions(found.version, identity.version);
    if (found.record) identity.record->addRun(*found.record);
    logInfo("resuming '{}' after {} samples per pixel", files.resume, film.samples.count());
    return film;
}

/// Which of the samples asked for are not there, and when to stop before they are all there.
SamplingPlan planSamples(const Job& job, const Scene& scene, const SampleRanges& there, const Files& files) {
    SamplingPlan plan;
    plan.time_limit_seconds = job.time_limit_seconds;
    plan.target_error = job.target_error;
    plan.independent_samples = scene.sampler.type != SamplerType::Sobol;
    plan.chunk = job.chunk;
    if (files.checkpoint_wanted) plan.checkpoint_interval_seconds = job.checkpoint_interval_seconds;
    if (job.samples) {
        // An exact range says exactly which samples are new; those that the checkpoint has already would
        // count twice.
        SampleRanges together = there;
        together.add(*job.samples);
        plan.ranges = {*job.samples};
        plan.target = together.count();
        return plan;
    }
    const bool endless = !job.spp && (job.time_limit_seconds > 0 || job.target_error > 0);
    plan.ranges =
        missingSamples({0, endless ? kEndlessSamples : job.spp.value_or(scene.sampler.samples)}, there);
    if (endless) return plan;
    plan.target = there.count();
    for (const auto& [first, end] : plan.ranges) plan.target += end - first;
    return plan;
}

/// A plugin may leave out what is only for humans.
std::string textOrEmpty(const char* text) { return text != nullptr ? text : ""; }

/// The driver behind a device, which only the list of devices tells.
std::string driverOf(const std::vector<CrtDevice>& devices, const std::string& device_name) {
    for (const CrtDevice& device : devices)
        if (arrayText(device.name) == device_name) return arrayText(device.driver);
    return {};
}

/// Takes over what the backend says about itself. Being without it is a pity, but no reason to lose a
/// render.
void askForReport(Integrator& integrator, RunFacts& facts) {
    try {
        facts.backend = integrator.report();
    } catch (const Error& error) {
        logWarning("no report from the backend: {}", error.what());
    }
}

/// The backend that is asked for, when it has something to do.
std::optional<LoadedBackend> openBackendFor(const Job& job, const SamplingPlan& plan, RunFacts& facts) {
    if (plan.ranges.empty()) return std::nullopt;
    const Stage stage("opening the backend");
    const Stopwatch opening;
    const LoadedBackend backend = openBackend(job.backend);
    facts.open_seconds = opening.seconds();
    return backend;
}

/// Nothing is built for a backend that brings it, nor where none will render.
CompileOptions compileOptionsFor(const std::optional<LoadedBackend>& backend) {
    constexpr double kNobodyTraces = std::numeric_limits<double>::infinity();
    return backend ? compileOptionsFor(*backend) : CompileOptions{.accelerator_reach = kNobodyTraces};
}

/// CompiledScene → Film, by a backend. Returns what failed while sampling, if anything did; the film holds
/// what there is.
std::optional<Error> renderSamples(const Job& job, const LoadedBackend& backend,
                                   const CompiledScene& compiled, const SamplingPlan& plan, Film& film,
                                   Watch& watch, const std::function<void()>& save_checkpoint,
                                   RunFacts& facts) {
    std::optional<Stage> stage(std::in_place, "opening the device");
    const Stopwatch opening;
    const std::vector<CrtDevice> devices =
        probeDevices(backend);  // Says better than a failing create() why there is none.
    Integrator integrator(backend, job.integrator);
    facts.open_seconds += opening.seconds();
    facts.backend_name = backend.name;
    facts.backend_path = backend.path;
    facts.backend_version = textOrEmpty(backend.table->version);
    facts.backend_build = textOrEmpty(backend.table->build);

    stage.emplace("preparing the scene for " + backend.name);
    const Stopwatch preparing;
    integrator.setScene(compiled, [&](double done) {
        stage->setAmount(1);
        stage->at(done);
    });
    facts.prepare_seconds = preparing.seconds();
    stage.reset();
    askForReport(integrator, facts);
    facts.driver = driverOf(devices, arrayText(facts.backend.device));
    logInfo("{} on {}", backend.name, arrayText(facts.backend.device));

    SamplingResult result;
    {
        const WatchedRendering rendering(watch);
        result = sampleFilm(integrator, film, plan, watch, save_checkpoint);
    }
    // A device that failed is not asked again; what it said before the first sample stands.
    if (result.stop != StopReason::Failed) askForReport(integrator, facts);
    facts.stop = result.stop;
    facts.request = result.request;
    facts.rendered_samples = result.rendered;
    facts.chunks = result.chunks;
    facts.sampling_seconds = result.seconds;
    return result.failure;
}

/// What went wrong while writing, the first of it: one output that fails must not keep the others from being
/// written.
class FirstFailure {
public:
    explicit FirstFailure(std::optional<Error> earlier) : first_(std::move(earlier)) {}

    template <class Write>
    void attempt(const Write& write) {
        try {
            write();
        } catch (const Error& error) {
            // The first is reported by whoever catches it in the end; the others have only this line.
            if (first_) {
                logMessage(LogLevel::Error, error.what());
            } else {
                first_ = error;
            }
        }
    }
    const std::optional<Error>& get() const { return first_; }

private:
    std::optional<Error> first_;
};

/// Who renders, and when. A film that was complete before this run is written without any backend.
void describeRun(FilmIdentity& identity, const RunFacts& facts) {
    if (facts.backend_name.empty()) return;
    FilmRecord run;
    run.backend = facts.backend_name + " " + facts.backend_version;
    run.device = arrayText(facts.backend.device);
    run.date_utc = dateUtc();
    identity.record->addRun(run);
}

/// Where it was written: a larger film that lies there stays.
std::string writeFilm(FilmGuard& films, const std::string& name, const Film& film,
                      const FilmIdentity& identity) {
    const std::string place = films.placeFor(name, film.samples.count());
    writeCheckpoint(place, film, identity);
    if (place == name) films.written(name);
    return place;
}

/// Film → images and checkpoints; their names go to facts.outputs.
void writeFiles(Files& files, const Film& film, FilmIdentity& identity, RunFacts& facts,
                FirstFailure& failure) {
    const Stopwatch writing;
    // With nothing but a time to go by, the end of the time is the end of the work.
    const bool complete = facts.stop == StopReason::Samples || facts.stop == StopReason::Target ||
                          (facts.stop == StopReason::Time && facts.target_samples == 0);
    describeRun(identity, facts);
    identity.record->complete = complete;

    std::set<std::string> films(files.outputs.films.begin(), files.outputs.films.end());
    const bool stopped_short = facts.stop == StopReason::Interrupted || facts.stop == StopReason::Failed;
    if (files.checkpoint_wanted || stopped_short) films.insert(files.checkpoint);
    const auto attemptFilm = [&](const std::string& name) {
        failure.attempt([&] {
            const std::string place = writeFilm(files.films, name, film, identity);
            facts.outputs.push_back(place);
            if (name == files.checkpoint) files.saved = place;
        });
    };
    for (const std::string& name : films)
        attemptFilm(name);  // First: everything else can be made from a film.
    for (const Output& output : files.outputs.images)
        failure.attempt([&] {
            writeOutput(output, film, identity);
            facts.outputs.push_back(output.file);
        });
    // Hours of work must not be lost because one image could not be written.
    const bool image_failed = failure.get() && failure.get()->kind() == ErrorKind::Output;
    if (image_failed && films.count(files.checkpoint) == 0) attemptFilm(files.checkpoint);
    facts.write_seconds = writing.seconds();
}

void writeReport(const std::string& path, const std::string& text) {
    AtomicFile file(path);
    file.write(text.data(), text.size());
    file.commit();
}

std::string summary(const RunFacts& facts, const Film& film) {
    std::string text = fmt::format("{} samples per pixel", facts.samples.count());
    if (facts.resumed_samples > 0) text += fmt::format(", {} of them resumed", facts.resumed_samples);
    if (facts.rendered_samples > 0 && facts.sampling_seconds > 0) {
        const double paths =
            static_cast<double>(facts.rendered_samples) * static_cast<double>(film.counts.size());
        text += fmt::format(", {}, {}", durationText(facts.sampling_seconds),
                            rateText(paths / facts.sampling_seconds, "paths/s"));
    }
    if (facts.error) text += ", " + errorText(*facts.error);
    return text;
}

/// How the target error was reached; else what it, or 1 %, would still take, where that is known.
void tellTarget(const RunFacts& facts) {
    const double target = facts.target_error > 0 ? facts.target_error : 0.01;
    const auto half_width = [](const std::optional<ErrorEstimate>& error) {
        return error ? percentText(error->half_width_95) : std::string("none");
    };
    if (facts.stop == StopReason::Target)
        logInfo(
            "target error {:.3g} % reached: 95 % half-width {}, of the even pixels {}, of the odd ones {}",
            target * 100, half_width(facts.error), half_width(facts.deciding), half_width(facts.judging));
    else if (facts.target_error > 0 && !facts.error->known())
        logInfo("whether the target error is reached cannot be told: too few paths carry the light");
    if (!facts.error->known() || facts.error->half_width_95 <= target || facts.rendered_samples == 0) return;
    const auto samples = static_cast<double>(facts.samples.count());
    const stats::Interval needed = facts.error->samplesFor(target, samples);
    const stats::Interval more{needed.lower - samples, needed.upper - samples};
    const double each = facts.sampling_seconds / static_cast<double>(facts.rendered_samples);
    logInfo("{:.3g} % would take {} samples per pixel more, {} to {}", target * 100, sampleCountText(more),
            durationText(more.lower * each), durationText(more.upper * each));
}

}  // namespace

Scene loadScene(const SceneRequest& request) {
    const Stage stage("reading " + request.file);
    Scene scene = loadScene(request.file, request.overrides);
    if (request.seed) scene.sampler.seed = *request.seed;
    if (request.crop) {
        const auto& [x0, y0, x1, y1] = *request.crop;
        if (x0 < 0 || y0 < 0 || x0 >= x1 || y0 >= y1 || x1 > scene.film.width || y1 > scene.film.height)
            throw Error(ErrorKind::Usage,
                        fmt::format("--crop {},{},{},{} is no rectangle within the film of {} x {} pixels",
                                    x0, y0, x1, y1, scene.film.width, scene.film.height));
        scene.film.crop = *request.crop;
    }
    return scene;
}

int runJob(const Job& job, Watch& watch) {
    const Stopwatch total;
    RunFacts facts;
    facts.command = job.command;

    // What is to be seen, and where it is to be written.
    Scene scene = loadScene(job.scene);
    if (job.target_error > 0) requireReplicates(scene);
    Files files = planFiles(job, scene);

    // What is there already, and what is missing.
    EarlierFilm earlier = readEarlierFilm(files);
    SamplingPlan plan = planSamples(job, scene, earlier ? earlier->first.samples : SampleRanges(), files);
    facts.target_samples = plan.target;
    if (plan.target > 0) files.films.requireRoom(plan.target);
    const std::optional<LoadedBackend> backend = openBackendFor(job, plan, facts);

    // What it takes to see it: one flat blob, and the mask of what it needs.
    const CompiledScene compiled = compileScene(scene, requestedAovs(scene), compileOptionsFor(backend));
    FilmIdentity identity{.scene_hash = compiled.hash, .version = CRT_VERSION, .record = recordOf(scene)};
    logDebug("scene {} needs {}", compiled.hash, featureNames(compiled.features));
    warnOfIdleLamps(scene);

    Film film = openFilm(files, earlier, compiled, identity);
    earlier.reset();
    facts.resumed_samples = film.samples.count();
    CheckpointWriter checkpoint([&files](const Film& copy, const FilmIdentity& of) {
        writeFilm(files.films, files.checkpoint, copy, of);
    });
    const auto saveCheckpoint = [&] {
        describeRun(identity, facts);
        checkpoint.save(film, identity);
    };
    plan.checkpoint_possible = [&] { return checkpoint.idle(); };

    // Samples, from a backend into the film. None is opened when none is missing.
    FirstFailure failure(
        backend ? renderSamples(job, *backend, compiled, plan, film, watch, saveCheckpoint, facts)
                : std::nullopt);
    if (!backend) watch.renderingEnds();
    checkpoint.finish();
    facts.samples = film.samples;
    facts.invalid_samples = film.invalidSamples();
    const bool independent = scene.sampler.type != SamplerType::Sobol;
    facts.error = estimateError(film, PixelSet::All, independent);
    facts.target_error = job.target_error;
    if (job.target_error > 0) {
        facts.deciding = estimateError(film, PixelSet::Even, independent);
        facts.judging = estimateError(film, PixelSet::Odd, independent);
    }
    warnOfBlackFilm(film, scene);
    if (facts.invalid_samples > 0)
        logWarning("{} samples were no numbers (NaN or infinite) and were left out", facts.invalid_samples);

    // Images, and the report of how they came about.
    if (film.samples.count() > 0) writeFiles(files, film, identity, facts, failure);
    facts.warnings = warningCount();
    facts.total_seconds = total.seconds();
    facts.failure = failure.get() ? failure.get()->what() : "";
    facts.exit_code = failure.get()                             ? failure.get()->exitCode()
                      : facts.stop == StopReason::Interrupted ? facts.request.exit_code
                                                              : 0;
    if (!files.report.empty())
        failure.attempt([&] { writeReport(files.report, reportJson(scene, compiled, facts)); });

    logInfo("{}", summary(facts, film));
    if (facts.error) tellTarget(facts);
    if (!facts.outputs.empty()) logInfo("wrote {}", fmt::join(facts.outputs, ", "));
    if (failure.get()) throw *failure.get();
    if (facts.stop == StopReason::Interrupted)
        logInfo("stopped by {}; the same command with --resume {} goes on from here", facts.request.cause,
                files.saved);
    return facts.exit_code;
}

}  // namespace crt
