#include "film/resolve.h"
#include "judge/compare/compare_backends.h"

#include "backend/loader.h"
#include "base/error.h"
#include "base/stopwatch.h"
#include "base/unit_text.h"
#include "compile/compile.h"
#include "film/film.h"
#include "render/session.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cmath>

namespace crt {
namespace {

using stats::Verdict;
constexpr std::uint32_t kColors = 3;  // X, Y, Z
const std::vector<std::string> kColorNames{"X", "Y", "Z"};

/// One bar over all renders.
class SharedProgress {
public:
    SharedProgress(Watch& watch, std::uint64_t samples, std::uint64_t pixels)
        : watch_(watch), rendering_(watch) {
        state_.target = samples;
        state_.pixels = pixels;
    }
    /// Where a render of `samples` stands. [any thread, one render at a time]
    void show(double done, std::uint64_t samples) {
        ProgressState now = state_;
        now.samples =
            static_cast<double>(finished_) + std::clamp(done, 0.0, 1.0) * static_cast<double>(samples);
        now.elapsed_seconds = seconds();
        watch_.progress(now);
    }
    void finish(std::uint64_t samples) {
        finished_ += samples;
        show(0, 0);
    }
    double seconds() const { return stopwatch_.seconds(); }

private:
    Watch& watch_;
    WatchedRendering rendering_;
    ProgressState state_;
    std::uint64_t finished_ = 0;
    Stopwatch stopwatch_;
};

/// A backend with its device, and what it renders of one scene with any seed.
class SeededRenderer {
public:
    SeededRenderer(const std::string& name, const Scene& scene, SharedProgress& progress)
        : session_(loadBackend(name)), scene_(scene), progress_(progress) {
        session_.openDevice();
    }

    Film render(std::uint64_t seed, std::uint64_t samples) {
        scene_.sampler.seed = seed;
        const Film film = renderFilm(session_, scene_, {.samples = samples},
                                     [this, samples](double done) { progress_.show(done, samples); });
        invalid_ += film.invalidSamples();
        progress_.finish(samples);
        return film;
    }

    std::uint64_t invalidSamples() const { return invalid_; }
    std::string device() { return arrayText(session_.report().device); }

private:
    Session session_;
    Scene scene_;
    SharedProgress& progress_;
    std::uint64_t invalid_ = 0;
};

std::vector<double> colorsOf(const Film& film) {
    std::vector<double> values;
    values.reserve(film.counts.size() * kColors);
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x)
            for (std::uint32_t c = 0; c < kColors; ++c) values.push_back(film.mean(x, y, c));
    return values;
}

/// What one backend rendered.
struct Renders {
    Image same_seed;
    stats::Replicates replicates;
    std::string device;
    std::uint64_t invalid_samples;
};

/// Seed number `index` of those that follow a scene's: the finaliser of splitmix64 (Steele, Lea and Flood
/// 2014) gives each number another one, and neighbours nothing in common, in case a backend only adds seed
/// and pixel.
std::uint64_t seedAfter(std::uint64_t seed, std::uint64_t index) {
    std::uint64_t h = seed + (index + 1) * 0x9e3779b97f4a7c15ull;
    h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9ull;
    h = (h ^ (h >> 27)) * 0x94d049bb133111ebull;
    return h ^ (h >> 31);
}

/// With the scene's seed, and then with as many others as there are replicates, no two backends with the
/// same.
Renders renderAll(SeededRenderer& renderer, const Scene& scene, const BackendComparison& plan,
                  std::size_t backend) {
    Renders renders{
        resolveImage(renderer.render(plan.seed, plan.samples), developmentOf(scene).forFloats(), 0),
        {plan.width, plan.height, kColors},
        {},
        0};
    for (std::uint64_t r = 0; r < plan.replicates; ++r)
        renders.replicates.add(
            colorsOf(renderer.render(seedAfter(plan.seed, backend * plan.replicates + r), plan.samples)));
    renders.device = renderer.device();
    renders.invalid_samples = renderer.invalidSamples();
    return renders;
}

/// Half-widths shrink as 1/√samples. With half of delta as half-width, what is equal passes with a
/// probability of nearly the confidence.
std::uint64_t samplesNeeded(const stats::GateResult& result, double delta, std::uint64_t samples) {
    double widest = 0;
    for (const auto& channel : result.channels)
        if (channel.verdict == Verdict::Inconclusive)
            widest = std::max(widest, channel.relative_interval.halfWidth());
    const double needed = std::pow(widest / (0.5 * delta), 2) * static_cast<double>(samples);
    if (!(needed > static_cast<double>(samples)) || !(needed < 1e12)) return 0;
    return std::bit_ceil(static_cast<std::uint64_t>(std::ceil(needed)));
}

void judge(BackendAgainst& against, const Renders& a, const Renders& b, const stats::GateOptions& gate,
           std::uint64_t samples) {
    against.device = a.device;
    against.same_seed = compareImages(a.same_seed, b.same_seed);
    against.other_seeds = stats::gate(a.replicates, b.replicates, gate);
    against.invalid_samples = a.invalid_samples + b.invalid_samples;
    against.verdict = against.other_seeds.verdict;
    if (against.invalid_samples >
        0) {  // They were left out of the film, and their values are unknown.
        against.verdict = Verdict::Inconclusive;
        against.other_seeds.reasons.push_back(
            fmt::format("{} samples were no numbers: nothing can be said", against.invalid_samples));
    } else if (against.verdict == Verdict::Inconclusive) {
        against.samples_needed = samplesNeeded(against.other_seeds, gate.delta, samples);
    }
}

}  // namespace

bool BackendComparison::passes() const {
    return std::all_of(backends.begin(), backends.end(),
                       [](const BackendAgainst& b) { return b.verdict == Verdict::Pass; });
}

BackendComparison compareBackends(const Scene& scene, const BackendComparisonOptions& options,
                                  Watch& watch) {
    if (options.backends.size() < 2)
        throw Error(ErrorKind::Usage, "--backends needs two names or more, such as cuda,embree");
    if (options.replicates < 2)
        throw Error(ErrorKind::Usage,
                    "--replicates needs two or more: one says nothing about its own error");
    BackendComparison result;
    const CompiledScene compiled = compileScene(scene, 0);
    result.reference = options.backends.back();
    result.scene_file = scene.file;
    result.width = compiled.header().width;
    result.height = compiled.header().height;
    result.seed = scene.sampler.seed;
    result.replicates = options.replicates;
    result.gate = options.gate;
    result.gate.channel_names = kColorNames;
    result.samples = options.samples;
    if (result.samples == 0) {
        const std::uint64_t all = static_cast<std::uint64_t>(scene.sampler.samples);
        result.samples = std::bit_ceil((all + options.replicates - 1) / options.replicates);
    }
    const std::uint64_t renders = options.backends.size() * (1 + std::uint64_t{options.replicates});
    SharedProgress progress(watch, renders * result.samples, std::uint64_t{result.width} * result.height);

    // All are opened first: a missing one must be reported at once, not after a minute.
    std::vector<SeededRenderer> renderers;
    renderers.reserve(options.backends.size());
    for (const std::string& name : options.backends) renderers.emplace_back(name, scene, progress);

    const std::size_t last = renderers.size() - 1;
    const Renders reference = renderAll(renderers[last], scene, result, last);
    result.reference_device = reference.device;
    for (std::size_t i = 0; i < last; ++i) {
        BackendAgainst& against = result.backends.emplace_back();
        against.backend = options.backends[i];
        judge(against, renderAll(renderers[i], scene, result, i), reference, result.gate, result.samples);
    }
    result.seconds = progress.seconds();
    return result;
}

// ----------------------------------------------------------------------------------------------------- text

namespace {

std::string familyText(const stats::TestFamily& family, const std::string& place) {
    std::string text = fmt::format("{} of {} tests differ", family.rejected, family.tests);
    return text + (family.rejected > 0 ? fmt::format(", most at {}", place)
                                       : fmt::format(" (smallest adjusted p {:.2g})", family.smallest_p));
}

std::string placeText(const stats::TestFamily& family, std::uint32_t across, std::uint32_t side) {
    const std::size_t place = family.worst / kColors;
    return fmt::format("pixel {},{} {} (adjusted p {:.1g})", place % across * side, place / across * side,
                       kColorNames[family.worst % kColors], family.smallest_p);
}

std::string againstText(const BackendComparison& all, const BackendAgainst& b) {
    std::string text =
        fmt::format("{} against {}: {}", b.backend, all.reference, stats::verdictName(b.verdict));
    const auto line = [&text](const std::string& name, const std::string& value) {
        text += fmt::format("\n  {:<18}{}", name, value);
    };
    line("devices", fmt::format("{}; {}", b.device, all.reference_device));
    const std::uint64_t pixels = std::uint64_t{all.width} * all.height;
    line(fmt::format("seed {}", all.seed),
         fmt::format("{}: {} of {} pixels differ", b.same_seed.same ? "same bits" : "OTHER BITS",
                     b.same_seed.differing_pixels, pixels));
    if (b.same_seed.first_difference) {
        const Difference& d = *b.same_seed.first_difference;
        line("first difference",
             fmt::format("pixel {},{} channel {}: {:.9g} and {:.9g}{}", d.x, d.y, d.channel, d.first,
                         d.second, d.ulps ? fmt::format(" ({} ulp)", *d.ulps) : ""));
        line("", b.same_seed.relative_rmse
                     ? fmt::format("error {:.3g} % (RMSE of luminance), at most {} ulp",
                                   100 * *b.same_seed.relative_rmse, b.same_seed.max_ulp)
                     : "values are not finite: there is no error to measure");
    }
    line("other seeds",
         fmt::format("{} renders of {} samples per pixel by each", all.replicates, all.samples));
    const stats::GateResult& g = b.other_seeds;
    for (std::size_t c = 0; c < g.channels.size(); ++c) {
        const auto& channel = g.channels[c];
        const stats::Interval& interval = channel.relative_interval;
        line(fmt::format("mean {}", kColorNames[c]),
             fmt::format("{:+.3f} %, {:g} % interval [{:+.3f}, {:+.3f}] %, ±{:g} % allowed: {}",
                         100 * channel.relative, 100 * all.gate.confidence, 100 * interval.lower,
                         100 * interval.upper, 100 * all.gate.delta, stats::verdictName(channel.verdict)));
    }
    if (!g.channels.empty()) {
        const std::uint32_t across = (all.width + stats::kTileSide - 1) / stats::kTileSide;
        line("tiles of 8x8",
             familyText(g.tiles, placeText(g.tiles, across, stats::kTileSide)) +
                 fmt::format("; their p-values are uniform with p {:.2g}", g.tile_uniformity_p));
        line("pixels", g.pixels.tests > 0 ? familyText(g.pixels, placeText(g.pixels, all.width, 1))
                                          : fmt::format("not tested: that needs --replicates {} or more",
                                                        stats::kFewestForPixels));
        line("largest value", fmt::format("carries {:.2g} % of the squared error ({:g} % allowed)",
                                          100 * g.largest.share, 100 * all.gate.largest_share));
    }
    for (const std::string& reason : g.reasons) line("because", reason);
    if (b.samples_needed > 0)
        line("to decide",
             fmt::format("about --spp {} if they are equal (now {})", b.samples_needed, all.samples));
    return text;
}

nlohmann::ordered_json familyJson(const stats::TestFamily& family) {
    return {{"tests", family.tests},
            {"rejected", family.rejected},
            {"smallest_adjusted_p", family.smallest_p},
            {"alpha", family.alpha}};
}

nlohmann::ordered_json againstJson(const BackendAgainst& b) {
    const stats::GateResult& g = b.other_seeds;
    nlohmann::ordered_json json{{"backend", b.backend},
                                {"device", b.device},
                                {"verdict", stats::verdictName(b.verdict)},
                                {"reasons", g.reasons}};
    json["same_seed"] = {
        {"same_bits", b.same_seed.same},
        {"differing_pixels", b.same_seed.differing_pixels},
        {"max_ulp", b.same_seed.max_ulp},
        {"relative_rmse", b.same_seed.relative_rmse ? nlohmann::ordered_json(*b.same_seed.relative_rmse)
                                                    : nlohmann::ordered_json(nullptr)}};
    json["means"] = nlohmann::ordered_json::array();
    for (std::size_t c = 0; c < g.channels.size(); ++c)
        json["means"].push_back(
            {{"channel", kColorNames[c]},
             {"relative_difference", g.channels[c].relative},
             {"interval", {g.channels[c].relative_interval.lower, g.channels[c].relative_interval.upper}},
             {"p", g.channels[c].difference.p},
             {"verdict", stats::verdictName(g.channels[c].verdict)}});
    json["tiles"] = familyJson(g.tiles);
    json["tile_p_uniformity"] = g.tile_uniformity_p;
    json["pixels"] = familyJson(g.pixels);
    json["largest_share"] = g.largest.share;
    json["invalid_samples"] = b.invalid_samples;
    json["samples_needed"] =
        b.samples_needed > 0 ? nlohmann::ordered_json(b.samples_needed) : nlohmann::ordered_json(nullptr);
    return json;
}

}  // namespace

std::string backendComparisonText(const BackendComparison& all) {
    std::string text = fmt::format("{}, {} x {} pixels, {}", all.scene_file, all.width, all.height,
                                   durationText(all.seconds));
    for (const BackendAgainst& b : all.backends) text += fmt::format("\n{}", againstText(all, b));
    return text;
}

std::string backendComparisonJson(const BackendComparison& all) {
    nlohmann::ordered_json json{{"scene", all.scene_file},
                                {"width", all.width},
                                {"height", all.height},
                                {"reference", all.reference},
                                {"reference_device", all.reference_device},
                                {"seed", all.seed},
                                {"samples", all.samples},
                                {"replicates", all.replicates},
                                {"delta", all.gate.delta},
                                {"confidence", all.gate.confidence},
                                {"seconds", all.seconds},
                                {"passes", all.passes()},
                                {"backends", nlohmann::ordered_json::array()}};
    for (const BackendAgainst& b : all.backends) json["backends"].push_back(againstJson(b));
    return json.dump(2);
}

}  // namespace crt
