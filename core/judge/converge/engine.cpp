// Over 450 lines: one run from its first replicate to its report, step after step.
#include "judge/converge/engine.h"
#include "film/error_text.h"

#include "backend/loader.h"
#include "base/atomic_file.h"
#include "base/error.h"
#include "base/host.h"
#include "base/log.h"
#include "base/stopwatch.h"
#include "base/unit_text.h"
#include "judge/converge/configuration_run.h"
#include "judge/converge/experiment.h"
#include "judge/converge/files.h"
#include "judge/converge/findings.h"
#include "judge/converge/fits.h"
#include "judge/converge/quantity_text.h"
#include "judge/converge/report_maps.h"
#include "judge/converge/variants.h"
#include "scene/missing_light.h"
#include "scene/yaml/yaml_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <thread>

namespace crt::converge {
namespace {

namespace fs = std::filesystem;

/// Part of --time that goes into references where none was given.
constexpr double kReferenceShare = 0.25;
/// Part of --time after which no start-up is paid twice any more.
constexpr double kWarmUpShare = 0.4;

/// Part of a replicate's time that may go into starting the program for it.
constexpr double kStartShare = 0.5;

/// One run from start to report.
class Engine {
public:
    Engine(const ConvergeRequest& request, Watch& watch)
        : request_(request), watch_(watch) {}

    int run() {
        refuseAmbiguity();
        openFolder();
        describeEnvironment();
        loadReferences();
        claimFolder();
        makeReferences();
        if (const auto request = watch_.stopRequested()) return request->exit_code;
        openBackends();
        render();
        return report();
    }

private:
    double elapsed() const { return stopwatch_.seconds(); }
    std::string path(const std::string& name) const { return (fs::path(request_.output) / name).string(); }
    bool stopped() const { return watch_.stopRequested().has_value(); }

    /// Scene, backend and variant identify rows: each of these once.
    void refuseAmbiguity() {
        names_ = namesOfScenes(request_.scenes);
        refuseRepeats(request_.backends, "--backends");
        std::vector<std::string> keys;
        for (const Vary& vary : request_.vary) {
            keys.push_back(vary.path);
            refuseRepeats(vary.values, fmt::format("--vary {}", vary.key));
        }
        refuseRepeats(keys, "--vary");
    }

    void openFolder() {
        makeOutputFolder(request_.output);
        if (fs::exists(path("results.jsonl")) && fs::file_size(path("results.jsonl")) > 0) {
            holds_rows_ = true;
            if (!request_.resume)
                throw Error(
                    ErrorKind::Usage,
                    fmt::format(
                        "'{}' holds an earlier run: add --resume to continue it, or choose another folder",
                        request_.output));
            run_.rows = readResults(path("results.jsonl"));
        }
        log_ = std::make_unique<ResultsLog>(path("results.jsonl"));
    }

    void describeEnvironment() {
        Environment& e = run_.environment;
        const BuildInfo build = buildInfo();
        e.crt_version = CRT_VERSION;
        e.commit = build.commit;
        e.dirty = build.dirty;
        e.compiler = build.compiler;
        e.build_flags = build.flags;
        e.cpu = processorName();
        e.operating_system = operatingSystem();
        e.load_start = loadAverages();
        e.working_directory = fs::current_path().string();
        e.budget_seconds = request_.seconds;
        e.threads = request_.integrator.threads != 0 ? request_.integrator.threads
                                                     : std::thread::hardware_concurrency();
    }

    /// Scenes and the references that are of them. A reference that is of none is a mistake, not something
    /// to be silent about.
    void loadReferences() {
        for (const SceneRequest& scene : request_.scenes)
            scenes_.push_back(loadSmall(scene, {}, request_.resolution));
        references_.resize(scenes_.size());
        for (const std::string& text : request_.references) {
            std::vector<std::string> refusals;
            bool used = false;
            for (std::size_t s = 0; s < scenes_.size(); ++s) try {
                    references_[s] = std::make_unique<Reference>(readReference(text, scenes_[s]));
                    references_[s]->info.scene = names_[s];
                    used = true;
                } catch (const Error& error) {
                    refusals.emplace_back(error.what());
                }
            if (!used) throw Error(ErrorKind::Usage, refusals.front());
        }
    }

    /// Writes the identity of this run for a later --resume; when resuming, checks that it is the same.
    void claimFolder() {
        Experiment experiment{commonProperties(buildInfo(), request_.integrator)};
        for (std::size_t s = 0; s < scenes_.size(); ++s) {
            const std::string reference = !references_[s] ? "made by the run"
                                          : references_[s]->info.hash.empty()
                                              ? references_[s]->info.estimator
                                              : references_[s]->info.hash;
            for (const Variant& variant : variantsOf(request_.vary)) {
                const Scene scene = loadSmall(request_.scenes[s], variant.changes, request_.resolution);
                for (const std::string& backend : request_.backends)
                    experiment.push_back(propertiesOf({names_[s], backend, variant.label}, scene,
                                                      contentOf(s, variant.label, scene), reference));
            }
        }
        if (holds_rows_)
            requireSameExperiment(path("experiment.json"), experiment);
        else
            writeExperiment(path("experiment.json"), experiment);
        if (holds_rows_) sessions_ = readSessions(path("sessions.json"));
        if (holds_rows_ && sessions_.empty())
            run_.notes.push_back(
                "the commands and times of earlier sessions of this run are unknown");
        sessions_.push_back({request_.command, utcNow(), elapsed()});
        keepSession();
    }

    /// So that a session that is killed leaves its command and its time, too.
    void keepSession() {
        sessions_.back().spent_seconds = elapsed();
        writeSessions(path("sessions.json"), sessions_);
    }

    /// Of all sessions.
    void describeSessions() {
        Environment& e = run_.environment;
        e.started = sessions_.front().started;
        for (const SessionOfRun& session : sessions_) {
            e.commands.push_back(session.command);
            e.spent_seconds += session.spent_seconds;
        }
    }

    /// The first backend of those asked for that can run, or nothing.
    std::string runnableBackend() const {
        for (const std::string& name : request_.backends) try {
                probeDevices(loadBackend(name));
                return name;
            } catch (const Error& error) {
                if (error.kind() != ErrorKind::Backend) throw;
            }
        return {};
    }

    /// Without a reference, crt makes one in a quarter of the time. It is of the same estimator, which has
    /// far less noise, and so is blind to a bias that all light sampling shares; what it sees is a bias of
    /// sampler, roulette, seeds and backends.
    void makeReferences() {
        const auto missing =
            static_cast<std::size_t>(std::count(references_.begin(), references_.end(), nullptr));
        const std::string backend = missing > 0 ? runnableBackend() : std::string();
        for (std::size_t s = 0; s < scenes_.size() && !backend.empty(); ++s) {
            if (references_[s] || !measuresLight(scenes_[s].integrator.type)) continue;
            ReferenceRequest request;
            request.backend = backend;
            request.integrator = request_.integrator;
            request.output = path("reference-" + slug(names_[s]) + ".exr");
            request.seconds = kReferenceShare * request_.seconds / static_cast<double>(missing);
            request.same_estimator = true;
            if (holds_rows_ && !fs::exists(request.output))
                throw Error(ErrorKind::Usage, fmt::format("'{}' is missing, against which the rows of this "
                                                          "run were measured: it cannot be resumed",
                                                          request.output));
            std::string went = "a reference was rendered when the run began";
            if (!holds_rows_) {
                const std::optional<MadeReference> made = renderReference(scenes_[s], request, watch_);
                if (!made) return;
                logInfo(
                    "{}: no reference was given; crt made one in {} of the {} of --time: {} samples per "
                    "pixel on {}{}",
                    names_[s], durationText(made->seconds), durationText(request_.seconds), made->samples,
                    backend,
                    made->error ? ", its own " + crt::errorText(*made->error, made->light_is_missing) : "");
                went = fmt::format("crt spent {} of the {} of --time on one", durationText(made->seconds),
                                   durationText(request_.seconds));
            }
            references_[s] = std::make_unique<Reference>(readReference(request.output, scenes_[s]));
            references_[s]->info.scene = names_[s];
            run_.notes.push_back(fmt::format(
                "{}: no reference was given, so {}, made with {} and the scene's own light sampling; a "
                "common bias is invisible against it ('crt reference' makes a more independent one)",
                names_[s], went, backend));
        }
        for (std::size_t s = 0; s < scenes_.size(); ++s) {
            if (const auto lost = missingLight(scenes_[s]); !lost.empty())
                run_.notes.push_back(
                    fmt::format("{}: {}", names_[s], missingLightText(lost, scenes_[s])));
            ReferenceInfo none;
            none.scene = names_[s];
            run_.references.push_back(references_[s] ? references_[s]->info : none);
            if (!references_[s])
                run_.notes.push_back(
                    fmt::format("{}: there is no reference, so errors are the spread between replicates, "
                                "which does not contain a bias",
                                names_[s]));
        }
    }

    /// Hash and colours of what a variant shows. Kept: reckoning it takes as long as compiling the scene.
    const std::string& contentOf(std::size_t s, const std::string& variant, const Scene& scene) {
        std::string& content = contents_[{s, variant}];
        if (content.empty()) content = hashOfContent(scene);
        return content;
    }

    /// A reference judges only what has the same expected image: not a variant with another depth. A number
    /// is taken as it is.
    const Reference* referenceFor(std::size_t s, const Scene& variant, const Key& key) {
        const Reference* reference = references_[s].get();
        if (reference == nullptr || reference->info.kind == ReferenceKind::Analytic) return reference;
        if (contentOf(s, key.variant, variant) == contentOf(s, {}, scenes_[s]) &&
            colourText(variant) == colourText(scenes_[s]))
            return reference;
        run_.notes.push_back(
            fmt::format("{}: '{}' shows another image than the reference, so it is measured without one",
                        key.scene, key.variant));
        return nullptr;
    }

    /// Libraries, drivers and caches are warmed up before any start-up is timed: otherwise the first
    /// configuration would pay for all. Where starts take so long that little time would be left, it is not
    /// done, and reported.
    void warmUp(const Key& key, const ConfigurationRun::LoadScene& load) {
        if (elapsed() < (kReferenceShare + kWarmUpShare) * request_.seconds) {
            ConfigurationRun(key, load, nullptr, request_.integrator).prepare();
            return;
        }
        if (!left_cold_)
            run_.notes.push_back(
                "start-up takes so long that not every configuration was started beforehand: start-up times "
                "cannot be compared");
        left_cold_ = true;
    }

    void openBackends() {
        for (std::size_t s = 0; s < scenes_.size(); ++s)
            for (const std::string& backend : request_.backends)
                for (const Variant& variant : variantsOf(request_.vary)) {
                    Key key{names_[s], backend, variant.label};
                    try {
                        const auto load = [this, s, changes = variant.changes] {
                            return loadSmall(request_.scenes[s], changes, request_.resolution);
                        };
                        const Scene scene = load();
                        const Reference* reference = referenceFor(s, scene, key);
                        warmUp(key, [&scene] { return scene; });
                        runs_.push_back(
                            std::make_unique<ConfigurationRun>(key, load, reference, request_.integrator));
                        runs_.back()->prepare();
                        order_.push_back({key, runs_.back().get(), {}});
                    } catch (const Error& error) {
                        if (error.kind() != ErrorKind::Backend) throw;
                        order_.push_back({key, nullptr, error.what()});
                    }
                }
        if (runs_.empty())
            throw Error(ErrorKind::Backend,
                        fmt::format("none of the backends can run: {}", order_.front().omitted));
        for (const Entry& entry : order_)
            if (!entry.run) logInfo("left out: {}", entry.omitted);
    }

    void render() {
        const WatchedRendering rendering(watch_);
        const auto stop = [this] { return stopped(); };
        // A report takes a little, and so does reading films; the rest is shared by replicates and
        // configurations alike.
        const double for_report = 1 + 0.01 * request_.seconds;
        const double share = std::max(0.0, request_.seconds - elapsed() - for_report) /
                             static_cast<double>(request_.replicates * runs_.size());
        resumeReplicates();
        for (std::uint32_t replicate = 0;; ++replicate) {
            double round = 0;
            for (const auto& run : runs_) round += run->secondsOfLastReplicate();
            if (replicate >= 2 && replicate < request_.replicates &&
                elapsed() + round > 1.05 * request_.seconds) {
                run_.notes.push_back(
                    fmt::format("the time allowed {} of {} replicates", replicate, request_.replicates));
                break;
            }
            if (replicate >= request_.replicates && elapsed() + round + for_report > request_.seconds) break;
            for (const auto& run : runs_) {
                if (run->looks().begin() != run->looks().end() &&
                    run->looks().begin()->second.count(replicate) > 0)
                    continue;
                if (!renderOne(*run, replicate, share, stop)) {
                    run_.notes.push_back(fmt::format(
                        "interrupted after {} rounds of replicates; --resume continues", replicate));
                    return;
                }
            }
            rounds_ = replicate + 1;
        }
    }

    /// Replicates begin with a separate start at a fixed interval: each one, unless starts would take more
    /// than kStartShare of the time.
    std::uint32_t replicatesForAStart(const ConfigurationRun& run, double share) {
        const double starts = std::ceil(run.startSeconds() / std::max(kStartShare * share, 1e-9));
        const auto every = static_cast<std::uint32_t>(std::clamp(starts, 1.0, 1e6));
        if (every >= request_.replicates && run.samplesReached() == 0)
            run_.notes.push_back(fmt::format(
                "{}: starting {} takes so long that it was timed once only: times that include it have no "
                "confidence interval",
                run.key().scene, labelOf(run.key())));
        return every;
    }

    bool renderOne(ConfigurationRun& run, std::uint32_t replicate, double share,
                   const std::function<bool()>& stop) {
        const std::uint32_t every = replicatesForAStart(run, share);
        if (replicate % every == 0) run.restart();
        share = std::max(0.0, share - run.startSeconds() / every);
        const std::uint64_t most = replicate == 0 ? request_.max_samples : run.samplesReached();
        const auto found = [&](const Row& row) {
            run_.rows.push_back(row);
            log_->append(row);
            ProgressState state;
            state.label = fmt::format("replicate {}  {} {} {}", replicate + 1, row.key.scene,
                                      row.key.backend, row.key.variant);
            state.elapsed_seconds = elapsed();
            state.time_limit_seconds = request_.seconds;
            watch_.progress(state);
        };
        const bool done = run.replicate(replicate, most, share, found, stop);
        if (done) writeReplicate(replicateFile(run.key(), replicate), run.stored(replicate));
        keepSession();
        return done;
    }

    std::string replicateFile(const Key& key, std::uint32_t replicate) const {
        return path("replicates/" + replicateFileName(key, replicate));
    }

    /// Replicates that are whole, with a row for each of their looks; the rows of others are dropped, and
    /// rendered again.
    void resumeReplicates() {
        std::vector<Row> kept;
        for (const auto& run : runs_)
            for (std::uint32_t replicate = 0; holds_rows_; ++replicate) {
                std::vector<Row> rows;
                for (const Row& row : run_.rows)
                    if (row.key == run->key() && row.replicate == replicate) rows.push_back(row);
                const std::optional<StoredReplicate> stored =
                    readReplicate(replicateFile(run->key(), replicate), run->pixels());
                if (!stored || !isWhole(*stored, rows, run->samplesReached())) break;
                run->restore(replicate, *stored);
                kept.insert(kept.end(), rows.begin(), rows.end());
            }
        run_.rows = std::move(kept);
    }
    /// `reached`: samples of the replicates before; 0 for the first.
    static bool isWhole(const StoredReplicate& stored, const std::vector<Row>& rows, std::uint64_t reached) {
        if (reached > 0 && stored.looks.back().first != reached) return false;
        return std::all_of(stored.looks.begin(), stored.looks.end(), [&](const auto& look) {
            return std::any_of(rows.begin(), rows.end(),
                               [&](const Row& row) { return row.samples == look.first; });
        });
    }

    int report() {
        for (const Entry& entry : order_) {
            if (!entry.run) {
                Configuration omitted;
                omitted.key = entry.key;
                omitted.omitted = entry.omitted;
                run_.configurations.push_back(std::move(omitted));
                continue;
            }
            fillBetweenReplicates(run_.rows, entry.key, entry.run->looks());
            finish(*entry.run);
            run_.configurations.push_back(entry.run->configuration());
        }
        for (const Row& row : run_.rows) log_->append(row);
        noteReferences();
        run_.environment.finished = utcNow();
        run_.environment.load_end = loadAverages();
        keepSession();
        describeSessions();

        const Analysis analysis = analyze(run_);
        writeCsv(path("results.csv"), run_.rows);
        const std::vector<MapSet> maps = writeMaps(request_.output, run_);
        writeSummary(path("summary.json"), run_, analysis, maps);
        std::vector<std::string> files{"results.jsonl", "results.csv", "summary.json"};
        for (const MapSet& set : maps)
            for (const MapSet::OfConfiguration& of : set.configurations)
                for (const Picture& picture : of.pictures) files.push_back(picture.file);
        writeManifest(path("manifest.json"), run_, files);

        const bool failed = printVerdicts(analysis);
        logInfo("{} rounds of replicates in {}; wrote {}", rounds_, durationText(elapsed()),
                path("summary.json"));
        if (const auto request = watch_.stopRequested()) return request->exit_code;
        return failed ? 7 : 0;
    }

    /// A device that fails now costs the maps of one configuration, not what was measured.
    void finish(ConfigurationRun& run) {
        const Key& key = run.key();
        try {
            run.finish(commonSamples(runs_, key.scene));
        } catch (const Error& error) {
            run_.notes.push_back(
                fmt::format("{}: there are no maps of {}: {}", key.scene, labelOf(key), error.what()));
        }
    }

    /// One line for each configuration that ran, whatever came of it; whether any fails.
    static bool printVerdicts(const Analysis& analysis) {
        bool failed = false;
        for (const ConfigurationFit& fit : analysis.fits) {
            if (!fit.omitted) logInfo("{}", verdictLine(fit));
            failed = failed || (!fit.omitted && fit.judgement.verdict == stats::Verdict::Fail);
        }
        return failed;
    }

    void noteReferences() {
        std::uint64_t most = 0;
        for (const Row& row : run_.rows) most = std::max(most, row.samples);
        for (const ReferenceInfo& info : run_.references)
            if (info.kind == ReferenceKind::Independent && info.samples < 64 * most)
                run_.notes.push_back(
                    fmt::format("the reference of {} has {} samples, less than 64 times the {} measured: "
                                "its variance is subtracted, and widens the bias intervals",
                                info.scene, info.samples, most));
    }

    struct Entry {
        Key key;
        ConfigurationRun* run;
        std::string omitted;
    };
    const ConvergeRequest& request_;
    Watch& watch_;
    const Stopwatch stopwatch_;
    Run run_;
    std::vector<std::string> names_;  ///< Of the scenes, in keys.
    bool holds_rows_ = false;         ///< The folder did, when the run began.
    bool left_cold_ = false;
    std::map<std::pair<std::size_t, std::string>, std::string> contents_;
    std::vector<Scene> scenes_;
    std::vector<std::unique_ptr<Reference>> references_;
    std::vector<std::unique_ptr<ConfigurationRun>> runs_;
    std::vector<Entry> order_;
    std::unique_ptr<ResultsLog> log_;
    std::vector<SessionOfRun> sessions_;  ///< This one last.
    std::uint32_t rounds_ = 0;
};

}  // namespace

int converge(const ConvergeRequest& request, Watch& watch) { return Engine(request, watch).run(); }

}  // namespace crt::converge
