#include "render/job.h"

#include "base/atomic_file.h"
#include "base/log.h"
#include "base/stage.h"
#include "base/stopwatch.h"
#include "base/unit_text.h"
#include "film/checkpoint.h"
#include "film/checkpoint_writer.h"
#include "film/error_text.h"
#include "image/open_module.h"
#include "render/output_guard.h"
#include "render/outputs.h"
#include "render/report.h"

#include <fmt/format.h>

#include <filesystem>
#include <set>
#include <utility>

namespace crt {
namespace {

constexpr const char* kReportExtension = ".report.json";

/// The files that this job writes or may have to write.
struct Files {
    OutputPlan outputs;
    std::string checkpoint;          ///< Path of a checkpoint if one is written.
    bool checkpoint_wanted = false;  ///< Also when nothing stops the render short.
    std::string saved;               ///< The path that was finally written.
    std::string resume;              ///< Empty: start from nothing.
    std::string report;              ///< Empty: none.
    std::vector<std::string> denoised;  ///< Of the images; empty: they are not denoised.
    FilmGuard films;                 ///< Files that exist in places where films will be written.
};

std::vector<std::string> imageNames(const OutputPlan& plan) {
    std::vector<std::string> names;
    for (const Output& image : plan.images) names.push_back(image.file);
    return names;
}

OutputPlan outputsOf(const Job& job, const Scene& scene) {
    OutputPlan plan = planOutputs(job.outputs, scene);
    if (!job.output_name) return plan;
    for (Output& image : plan.images) image.file = job.output_name(image.file);
    for (std::string& film : plan.films) film = job.output_name(film);
    plan.first = job.output_name(plan.first);
    return plan;
}

/// Names them, and finds out now what cannot be written: it must not take an hour to learn that a directory
/// is missing.
Files planFiles(const Job& job, const Scene& scene) {
    Files files;
    files.outputs = outputsOf(job, scene);
    if (job.outputs.empty()) refuseForeignPlaces(files.outputs.images, scene.file, job.overwrite);
    files.checkpoint = !job.checkpoint_file.empty() ? job.checkpoint_file
                       : !job.resume_file.empty()   ? job.resume_file
                                                  : besideOutput(files.outputs.first, kCheckpointExtension);
    files.checkpoint_wanted =
        // A run that was resumed once is likely to be resumed again.
        job.resume || !job.checkpoint_file.empty() || job.denoise;
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
    std::error_code absent;
    if (job.resume_where_possible && std::filesystem::exists(files.checkpoint, absent))
        files.resume = files.checkpoint;
    files.report = job.report_file ? *job.report_file : besideOutput(files.outputs.first, kReportExtension);

    if (job.denoise) files.denoised = denoisedNames(imageNames(files.outputs));
    std::vector<std::string> written = imageNames(files.outputs), films = files.outputs.films;
    written.insert(written.end(), files.denoised.begin(), files.denoised.end());
    if (!files.report.empty()) written.push_back(files.report);
    // The last; crt chose its name, unless it is also one of the others.
    films.push_back(files.checkpoint);
    refuseOverInputs(scene.files_read, written, films);
    for (std::size_t i = 0; i < films.size(); ++i) {
        const std::string& film = films[i];
        const bool wanted = i + 1 < films.size() || files.checkpoint_wanted;
        if (files.resume.empty() || film != files.resume)
            files.films.look(film, wanted, job.overwrite);
        else
            files.films.goOnFrom(film);
    }

    for (const Output& image : files.outputs.images) checkWritable(image.file);
    for (const std::string& image : files.denoised) checkWritable(image);
    for (const std::string& film : files.outputs.films) checkWritable(film);
    checkWritable(files.checkpoint);
    if (!files.report.empty()) checkWritable(files.report);
    return files;
}

/// The film of an earlier run.
std::optional<EarlierFilm> readEarlierFilm(const Files& files) {
    if (files.resume.empty()) return std::nullopt;
    const Stage stage("reading " + files.resume);
    auto [film, identity] = readCheckpoint(files.resume);
    return EarlierFilm{files.resume, std::move(film), std::move(identity)};
}

/// The first error while writing: one output that fails must not keep the others from being written.
class FirstFailure {
public:
    explicit FirstFailure(std::optional<Error> earlier) : first_(std::move(earlier)) {}

    template <class Write>
    void attempt(const Write& write) {
        try {
            write();
        } catch (const Error& error) {
            // The caller reports the first one; the others have only this line.
            note(error);
        } catch (const std::exception& error) {  // Out of memory, or no thread.
            note(Error(ErrorKind::Output, fmt::format("cannot write an output: {}", error.what())));
        }
    }
    const std::optional<Error>& get() const { return first_; }

private:
    void note(const Error& error) {
        if (first_)
            logMessage(LogLevel::Error, error.what());
        else
            first_ = error;
    }

    std::optional<Error> first_;
};

/// The path that was written: an existing larger film stays.
std::string writeFilm(FilmGuard& films, const std::string& name, const Film& film,
                      const FilmIdentity& identity) {
    const std::string place = films.placeFor(name, film.samples.count());
    writeCheckpoint(place, film, identity);
    if (place == name) films.written(name);
    return place;
}

/// Film → images and checkpoints; their names go to facts.outputs.
void writeFiles(Files& files, const Film& film, const FilmIdentity& identity, RunFacts& facts,
                FirstFailure& failure) {
    const Stopwatch writing;
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

std::string summary(const RunFacts& facts, const Film& film, bool light_is_missing) {
    std::string text = fmt::format("{} samples per pixel", facts.samples.count());
    if (facts.resumed_samples > 0) text += fmt::format(", {} of them resumed", facts.resumed_samples);
    if (facts.rendered_samples > 0 && facts.sampling_seconds > 0) {
        const double paths =
            static_cast<double>(facts.rendered_samples) * static_cast<double>(film.counts.size());
        text += fmt::format(", {}, {}", durationText(facts.sampling_seconds),
                            rateText(paths / facts.sampling_seconds, "paths/s"));
    }
    if (facts.error) text += ", " + errorText(*facts.error, light_is_missing);
    return text;
}

/// Reports that the target error was reached, or else the samples that it, or 1 %, would still take, if
/// known.
void tellTarget(const RunFacts& facts) {
    const double target = facts.target_error > 0 ? facts.target_error : 0.01;
    const auto half_width = [](const std::optional<ErrorEstimate>& error) {
        return error ? percentText(error->half_width_95) : std::string("none");
    };
    if (facts.stop == StopReason::Target)
        logInfo("target error {:.3g} % reached: 95 % half-width {}, even pixels {}, odd pixels {}",
                target * 100, half_width(facts.error), half_width(facts.even_pixels),
                half_width(facts.odd_pixels));
    else if (!facts.error->known() && facts.error->rare_paths > 0)
        logInfo("the error is not yet known: surfaces mirror a light or scatter it into a narrow lobe, "
                "single paths may carry {:.2g} times the mean luminance, and too few of them were sampled",
                facts.error->rare_paths);
    else if (facts.target_error > 0 && !facts.error->known())
        logInfo("it is unknown whether the target error is reached: too few paths carry the light");
    if (!facts.error->known() || facts.error->half_width_95 <= target || facts.rendered_samples == 0) return;
    const auto samples = static_cast<double>(facts.samples.count());
    const stats::Interval needed = facts.error->samplesFor(target, samples);
    const stats::Interval more{needed.lower - samples, needed.upper - samples};
    const double each = facts.sampling_seconds / static_cast<double>(facts.rendered_samples);
    logInfo("{:.3g} % would take {} more samples per pixel, {} to {}", target * 100, sampleCountText(more),
            durationText(more.lower * each), durationText(more.upper * each));
}

}  // namespace

std::string reportOf(const Job& job, const Scene& scene) {
    return besideOutput(outputsOf(job, scene).first, kReportExtension);
}

Scene loadScene(const SceneRequest& request) {
    const Stage stage("reading " + request.file);
    Scene scene = loadScene(request.file, request.overrides);
    if (request.seed) scene.sampler.seed = *request.seed;
    if (request.crop) {
        const auto& [x0, y0, x1, y1] = *request.crop;
        if (x0 < 0 || y0 < 0 || x0 >= x1 || y0 >= y1 || x1 > scene.film.width || y1 > scene.film.height)
            throw Error(ErrorKind::Usage,
                        fmt::format("--crop {},{},{},{} is not a rectangle within the film of {} x {} "
                                    "pixels",
                                    x0, y0, x1, y1, scene.film.width, scene.film.height));
        scene.film.crop = *request.crop;
    }
    return scene;
}

int runJob(const Job& job, Watch& watch) {
    const Stopwatch total;

    // The scene and its outputs.
    Scene scene = loadScene(job.scene);
    if (job.expose_automatically && !measuresLight(scene.integrator.type))
        throw Error(ErrorKind::Usage, "--expose auto needs integrator.type path: the other types do not "
                                      "show light");
    if (job.target_error > 0) requireReplicates(scene);
    Files files = planFiles(job, scene);

    // The existing samples and the missing ones.
    std::optional<EarlierFilm> earlier = readEarlierFilm(files);
    const SamplingPlan plan =
        planSamples(job, scene, earlier ? earlier->film.samples : SampleRanges());
    if (plan.target > 0) files.films.requireRoom(plan.target);

    // Samples, from a backend into the film, and into checkpoints meanwhile.
    CheckpointWriter checkpoint([&files](const Film& copy, const FilmIdentity& of) {
        writeFilm(files.films, files.checkpoint, copy, of);
    });
    CheckpointPlan checkpoints{.possible = [&] { return checkpoint.idle(); },
                               .save = [&](const Film& film, const FilmIdentity& identity) {
                                   checkpoint.save(film, identity);
                               }};
    if (files.checkpoint_wanted) checkpoints.interval_seconds = job.checkpoint_interval_seconds;
    RenderOptions options = job;
    // Not earlier: a driver that is being opened would wait for the same lock of the loader.
    options.meanwhile = [&files] {
        for (const Output& image : files.outputs.images) prepareToWrite(image.format);
    };
    Rendered run = render(scene, options, plan, std::move(earlier), watch, checkpoints);
    checkpoint.finish();
    judgeError(run);

    // Images, and the report of how they came about.
    RunFacts& facts = run.facts;
    facts.command = job.command;
    facts.frame = job.frame;
    FirstFailure failure(run.failure);
    if (job.expose_automatically && run.film.samples.count() > 0)
        exposeAutomatically(run.film, *run.identity.record);
    if (run.film.samples.count() > 0) writeFiles(files, run.film, run.identity, facts, failure);
    facts.warnings = warningCount();
    facts.total_seconds = total.seconds();
    facts.failure = failure.get() ? failure.get()->what() : "";
    facts.exit_code = failure.get()                             ? failure.get()->exitCode()
                      : facts.stop == StopReason::Interrupted ? facts.request.exit_code
                                                              : 0;
    if (!files.report.empty())
        failure.attempt([&] {
            writeReport(files.report, reportJson(scene, *run.compiled, facts));
            facts.outputs.push_back(files.report);
        });

    logInfo("{}", summary(facts, run.film, plan.light_is_missing));
    if (facts.error) tellTarget(facts);
    if (!facts.outputs.empty()) logInfo("wrote {}", fmt::join(facts.outputs, ", "));
    if (failure.get()) throw *failure.get();
    if (job.denoise && facts.exit_code == 0) job.denoise(files.saved, files.denoised);
    if (facts.stop == StopReason::Interrupted && run.film.samples.count() == 0)
        logInfo("stopped by {} before all pixels had a sample: there is no image", facts.request.cause);
    else if (facts.stop == StopReason::Interrupted)
        logInfo("stopped by {}; the same command with --resume {} continues from here", facts.request.cause,
                files.saved);
    return facts.exit_code;
}

}  // namespace crt
