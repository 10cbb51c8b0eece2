#include "converge/engine.h"

#include "arguments.h"
#include "atomic_file.h"
#include "converge/contestant.h"
#include "converge/files.h"
#include "converge/fits.h"
#include "converge/report_html.h"
#include "host.h"
#include "interrupt.h"
#include "log.h"
#include "yaml_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
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
using Clock = std::chrono::steady_clock;

const std::map<std::string, std::string>& shortNames() {
    static const std::map<std::string, std::string> names{{"sampler", "sampler.type"},          {"replicates", "sampler.replicates"},
                                                          {"nee", "integrator.nee"},            {"roulette", "integrator.roulette"},
                                                          {"depth", "integrator.max_depth"},    {"accelerator", "integrator.accelerator"},
                                                          {"filter", "film.filter"}};
    return names;
}

/// All combinations of what varies, as label and changes of the scene.
struct Variant {
    std::string label;
    std::vector<SceneOverride> changes;
};
std::vector<Variant> variantsOf(const std::vector<Vary>& vary) {
    std::vector<Variant> variants{{}};
    for (const Vary& v : vary) {
        std::vector<Variant> longer;
        for (const Variant& variant : variants)
            for (const std::string& value : v.values) {
                Variant next = variant;
                next.label += fmt::format("{}{}={}", next.label.empty() ? "" : " ", v.key, value);
                next.changes.push_back({v.path, value});
                longer.push_back(std::move(next));
            }
        variants = std::move(longer);
    }
    return variants;
}

std::string nameOf(const std::string& file) { return fs::path(file).stem().string(); }

/// The scene, smaller where nobody asked for a size: error against time does not need 2 million pixels.
Scene loadSmall(SceneRequest request, const std::vector<SceneOverride>& changes, int resolution) {
    request.overrides.insert(request.overrides.end(), changes.begin(), changes.end());
    Scene scene = loadScene(request);
    const bool sized = std::any_of(request.overrides.begin(), request.overrides.end(), [](const SceneOverride& o) { return o.path == "film.resolution"; });
    const int longer = std::max(scene.film.width, scene.film.height);
    const bool cropped = scene.film.crop != std::array<int, 4>{0, 0, 0, 0};
    if (resolution <= 0 || sized || cropped || longer <= resolution) return scene;
    const auto scaled = [&](int side) { return std::max(1, static_cast<int>(std::lround(static_cast<double>(side) * resolution / longer))); };
    request.overrides.push_back({"film.resolution", fmt::format("[{},{}]", scaled(scene.film.width), scaled(scene.film.height))});
    return loadScene(request);
}

/// One run from start to report.
class Engine {
public:
    explicit Engine(const ConvergeRequest& request) : request_(request), start_(Clock::now()) {}

    int run() {
        openFolder();
        describeEnvironment();
        loadReferences();
        openContestants();
        const InterruptGuard interrupt;
        render();
        return report();
    }

private:
    double elapsed() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
    std::string path(const std::string& name) const { return (fs::path(request_.output) / name).string(); }

    void openFolder() {
        std::error_code error;
        fs::create_directories(request_.output, error);
        if (error) throw Error(ErrorKind::Output, fmt::format("cannot make the folder '{}': {}", request_.output, error.message()));
        if (fs::exists(path("results.jsonl"))) {
            if (!request_.resume)
                throw Error(ErrorKind::Usage, fmt::format("'{}' holds an earlier run: add --resume to go on with it, or choose another folder", request_.output));
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
        e.started = utcNow();
        e.commands = {request_.command};
        e.budget_seconds = request_.seconds;
        e.threads = request_.integrator.threads != 0 ? request_.integrator.threads : std::thread::hardware_concurrency();
    }

    /// Scenes and the references that are of them. A reference that is of none is a mistake, not something to be silent about.
    void loadReferences() {
        for (const SceneRequest& scene : request_.scenes) scenes_.push_back(loadSmall(scene, {}, request_.resolution));
        references_.resize(scenes_.size());
        for (const std::string& text : request_.references) {
            std::vector<std::string> refusals;
            bool used = false;
            for (std::size_t s = 0; s < scenes_.size(); ++s) try {
                    references_[s] = std::make_unique<Reference>(readReference(text, scenes_[s]));
                    references_[s]->info.scene = nameOf(scenes_[s].file);
                    used = true;
                } catch (const Error& error) {
                    refusals.emplace_back(error.what());
                }
            if (!used) throw Error(ErrorKind::Usage, refusals.front());
        }
        for (std::size_t s = 0; s < scenes_.size(); ++s) {
            if (references_[s]) {
                run_.references.push_back(references_[s]->info);
                continue;
            }
            ReferenceInfo none;
            none.scene = nameOf(scenes_[s].file);
            run_.references.push_back(none);
            run_.notes.push_back(fmt::format("{}: no reference was given, so errors are the spread between replicates, which no bias shows in; "
                                             "'crt reference' makes one",
                                             none.scene));
        }
    }

    void openContestants() {
        for (std::size_t s = 0; s < scenes_.size(); ++s)
            for (const std::string& backend : request_.backends)
                for (const Variant& variant : variantsOf(request_.vary)) {
                    Key key{nameOf(scenes_[s].file), backend, variant.label};
                    try {
                        Scene scene = loadSmall(request_.scenes[s], variant.changes, request_.resolution);
                        contestants_.push_back(std::make_unique<Contestant>(key, std::move(scene), references_[s].get(), request_.integrator));
                        order_.push_back({key, contestants_.back().get(), {}});
                    } catch (const Error& error) {
                        if (error.kind() != ErrorKind::Backend) throw;
                        order_.push_back({key, nullptr, error.what()});
                    }
                }
        if (contestants_.empty()) throw Error(ErrorKind::Backend, fmt::format("none of the backends can run: {}", order_.front().omitted));
        for (const Entry& entry : order_)
            if (!entry.contestant) logInfo("left out: {}", entry.omitted);
    }

    void render() {
        Progress progress(request_.progress);
        const auto stop = [] { return InterruptGuard::signalReceived() != 0; };
        // A report takes a little, and so does reading films; the rest is shared by replicates and configurations alike.
        const double for_report = 1 + 0.01 * request_.seconds;
        const double share = std::max(0.0, request_.seconds - elapsed() - for_report) / static_cast<double>(request_.replicates * contestants_.size());
        resumeReplicates();
        for (std::uint32_t replicate = 0;; ++replicate) {
            double round = 0;
            for (const auto& contestant : contestants_) round += contestant->secondsOfLastReplicate();
            if (replicate >= 2 && replicate < request_.replicates && elapsed() + round > 1.05 * request_.seconds) {
                run_.notes.push_back(fmt::format("the time allowed {} of {} replicates", replicate, request_.replicates));
                break;
            }
            if (replicate >= request_.replicates && elapsed() + round + for_report > request_.seconds) break;
            for (const auto& contestant : contestants_) {
                if (contestant->looks().begin() != contestant->looks().end() && contestant->looks().begin()->second.count(replicate) > 0) continue;
                if (!renderOne(*contestant, replicate, share, progress, stop)) {
                    run_.notes.push_back(fmt::format("interrupted after {} rounds of replicates; --resume goes on", replicate));
                    return;
                }
            }
            rounds_ = replicate + 1;
        }
    }

    bool renderOne(Contestant& contestant, std::uint32_t replicate, double share, Progress& progress, const std::function<bool()>& stop) {
        const std::uint64_t most = replicate == 0 ? request_.max_samples : contestant.samplesReached();
        const auto found = [&](const Row& row) {
            run_.rows.push_back(row);
            log_->append(row);
            ProgressState state;
            state.label = fmt::format("replicate {}  {} {} {}", replicate + 1, row.key.scene, row.key.backend, row.key.variant);
            state.elapsed_seconds = elapsed();
            state.time_limit_seconds = request_.seconds;
            progress.update(state);
        };
        const bool done = contestant.replicate(replicate, most, share, found, stop);
        if (done) saveLooks(contestant, replicate);
        return done;
    }

    // Replicates on disk, so that a run can go on: the luminances of every look, which the spread between replicates needs.
    std::string looksFile(const Key& key, std::uint32_t replicate) const {
        std::string name = fmt::format("{}-{}-{}-{}.looks", key.scene, key.backend, key.variant, replicate);
        std::replace_if(name.begin(), name.end(), [](char c) { return c == ' ' || c == '/' || c == '='; }, '_');
        return path("replicates/" + name);
    }
    void saveLooks(Contestant& contestant, std::uint32_t replicate) {
        const std::string name = looksFile(contestant.key(), replicate);
        checkWritable(name);
        AtomicFile file(name);
        for (const auto& [samples, planes] : contestant.looks()) {
            const auto plane = planes.find(replicate);
            if (plane == planes.end()) continue;
            const std::uint64_t header[2] = {samples, plane->second.size()};
            file.write(header, sizeof header);
            file.write(plane->second.data(), plane->second.size() * sizeof(float));
        }
        file.commit();
    }
    void resumeReplicates() {
        std::vector<Row> kept;
        for (const auto& contestant : contestants_)
            for (std::uint32_t replicate = 0; readLooks(*contestant, replicate); ++replicate)
                for (const Row& row : run_.rows)
                    if (row.key == contestant->key() && row.replicate == replicate) kept.push_back(row);
        run_.rows = std::move(kept);
    }
    bool readLooks(Contestant& contestant, std::uint32_t replicate) {
        std::ifstream file(looksFile(contestant.key(), replicate), std::ios::binary);
        if (!request_.resume || !file) return false;
        std::uint64_t header[2];
        while (file.read(reinterpret_cast<char*>(header), sizeof header)) {
            if (header[1] > (std::uint64_t{1} << 28)) return false;
            LookPlane plane(header[1]);
            if (!file.read(reinterpret_cast<char*>(plane.data()), static_cast<std::streamsize>(plane.size() * sizeof(float)))) return false;
            contestant.looks()[header[0]][replicate] = std::move(plane);
            contestant.setSamplesReached(std::max(contestant.samplesReached(), header[0]));
        }
        return true;
    }

    int report() {
        for (const Entry& entry : order_) {
            if (!entry.contestant) {
                Configuration omitted;
                omitted.key = entry.key;
                omitted.omitted = entry.omitted;
                run_.configurations.push_back(std::move(omitted));
                continue;
            }
            fillBetweenReplicates(run_.rows, entry.key, entry.contestant->looks());
            entry.contestant->finish();
            run_.configurations.push_back(entry.contestant->configuration());
        }
        for (const Row& row : run_.rows) log_->append(row);
        noteReferences();
        run_.environment.finished = utcNow();
        run_.environment.load_end = loadAverages();
        run_.environment.spent_seconds = elapsed();

        const Analysis analysis = analyze(run_);
        writeCsv(path("results.csv"), run_.rows);
        writeSummary(path("summary.json"), run_, analysis);
        std::vector<std::string> files = writeReport(request_.output, run_, analysis);
        files.insert(files.end(), {"results.jsonl", "results.csv", "summary.json"});
        writeManifest(path("manifest.json"), run_, files);

        bool failed = false;
        for (const ConfigurationFit& fit : analysis.fits) {
            if (fit.points.empty()) continue;
            failed = failed || fit.judgement.verdict == stats::Verdict::Fail;
            logInfo("{} {} {}: error {} at {} spp, slope {:.3f} ({:.3f} to {:.3f}), {}: {}", fit.key.scene, fit.key.backend, fit.key.variant,
                    percentText(fit.points.back().relative_rmse.value), fit.points.back().samples, fit.slope_samples.value, fit.slope_samples.low,
                    fit.slope_samples.high, stats::verdictName(fit.judgement.verdict), fit.judgement.reason);
        }
        logInfo("{} rounds of replicates in {}; wrote {}", rounds_, durationText(elapsed()), path("report.html"));
        if (InterruptGuard::signalReceived() != 0) return 128 + InterruptGuard::signalReceived();
        return failed ? 7 : 0;
    }

    void noteReferences() {
        std::uint64_t most = 0;
        for (const Row& row : run_.rows) most = std::max(most, row.samples);
        for (const ReferenceInfo& info : run_.references)
            if (info.kind == ReferenceKind::Independent && info.samples < 64 * most)
                run_.notes.push_back(fmt::format("the reference of {} has {} samples, less than 64 times the {} measured: its variance is subtracted, and "
                                                 "widens what is said about bias",
                                                 info.scene, info.samples, most));
    }

    struct Entry {
        Key key;
        Contestant* contestant;
        std::string omitted;
    };
    const ConvergeRequest& request_;
    Clock::time_point start_;
    Run run_;
    std::vector<Scene> scenes_;
    std::vector<std::unique_ptr<Reference>> references_;
    std::vector<std::unique_ptr<Contestant>> contestants_;
    std::vector<Entry> order_;
    std::unique_ptr<ResultsLog> log_;
    std::uint32_t rounds_ = 0;
};

}  // namespace

Vary parseVary(const std::string& text) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
        throw Error(ErrorKind::Usage, fmt::format("--vary takes KEY=VALUE,VALUE such as sampler=sobol,independent, not '{}'", text));
    Vary vary;
    vary.key = text.substr(0, equals);
    const auto found = shortNames().find(vary.key);
    if (found == shortNames().end() && vary.key.find('.') == std::string::npos) {
        std::vector<std::string> names;
        for (const auto& [name, path] : shortNames()) names.push_back(name);
        const std::string hint = didYouMean(vary.key, names);
        throw Error(ErrorKind::Usage, fmt::format("--vary knows {} and keys of the scene such as film.filter, not '{}'{}", fmt::join(names, ", "), vary.key,
                                                  hint.empty() ? "" : "; " + hint));
    }
    vary.path = found != shortNames().end() ? found->second : vary.key;
    vary.values = parseList(text.substr(equals + 1), "--vary");
    return vary;
}

int converge(const ConvergeRequest& request) { return Engine(request).run(); }

}  // namespace crt::converge
