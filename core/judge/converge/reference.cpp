#include "film/error_text.h"
#include "film/resolve.h"
#include "judge/converge/reference.h"

#include "base/atomic_file.h"
#include "base/log.h"
#include "base/statistics.h"
#include "base/stopwatch.h"
#include "base/unit_text.h"
#include "compile/compile.h"
#include "film/luminance_error.h"
#include "image/image_io.h"
#include "judge/converge/files.h"
#include "render/brightest_path.h"
#include "render/light_checks.h"
#include "render/output_guard.h"
#include "render/sampling.h"
#include "render/session.h"
#include "scene/missing_light.h"
#include "scene/yaml/yaml_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

namespace crt::converge {
namespace {

/// Far from the seeds of `crt converge`, which follow the scene's one by one.
constexpr std::uint64_t kReferenceSeedOffset = std::uint64_t{1} << 40;
constexpr const char* kContentKey = "crt/referenceContent";
constexpr const char* kRecordKey = "crt/referenceRecord";  // film_record.h
constexpr const char* kColourKey = "crt/referenceColour";
constexpr const char* kEstimatorKey = "crt/referenceEstimator";

std::string estimatorText(const Scene& scene) {
    return fmt::format("independent samples, {} light sampling, no roulette, seed {}",
                       scene.integrator.nee ? "with" : "no", scene.sampler.seed);
}

std::string metadataOf(const Image& image, const char* key) {
    for (const auto& [name, value] : image.metadata)
        if (name == key) return value;
    return {};
}

/// In what the scene of a reference differs from another, in words, apart from what a reference does not
/// depend on.
std::vector<std::string> differingContent(const Image& reference, const Scene& scene) {
    const std::string text = metadataOf(reference, kRecordKey);
    if (text.empty()) return {};
    const auto withoutSampling = [](FilmRecord record) {
        std::erase_if(record.traits, [](const SceneTrait& trait) {
            return trait.name == "the seed" || trait.name == "the sampler" ||
                   trait.name == "the replicates" || trait.name == "roulette" || trait.name == "nee" ||
                   trait.name == "mis" || trait.name == "the AOVs of first hits";
        });
        return record;
    };
    return differingTraits(withoutSampling(readRecord(text)), withoutSampling(recordOf(scene)));
}

/// Values of three channels of an image, or nothing when one is missing.
std::vector<float> channelsOf(const Image& image, const std::array<std::string, 3>& names) {
    std::array<std::size_t, 3> columns{};
    for (std::size_t c = 0; c < 3; ++c) {
        const auto found = std::find(image.channels.begin(), image.channels.end(), names[c]);
        if (found == image.channels.end()) return {};
        columns[c] = static_cast<std::size_t>(found - image.channels.begin());
    }
    const std::size_t pixels = std::size_t{image.width} * image.height;
    std::vector<float> values(pixels * 3);
    for (std::size_t p = 0; p < pixels; ++p)
        for (std::size_t c = 0; c < 3; ++c)
            values[p * 3 + c] = image.pixels[p * image.channels.size() + columns[c]];
    return values;
}

/// Mean, variance and distances of the folds, from their luminances and colours.
void describeFolds(ReferenceInfo& info, const std::vector<std::vector<float>>& luminances,
                   const std::vector<std::vector<double>>& colours) {
    const std::size_t pixels = luminances.front().size();
    std::vector<double> variances(pixels);
    for (std::size_t p = 0; p < pixels; ++p) {
        std::array<double, kFolds> values{};
        for (std::uint32_t fold = 0; fold < kFolds; ++fold) values[fold] = luminances[fold][p];
        variances[p] = stats::summarize(values).variance / kFolds;
    }
    info.mean_variance = stats::summarize(variances).mean;
    info.effective_pixels = stats::effectivePixels(variances, kFolds - 1);
    for (const std::vector<float>& a : luminances) {
        info.fold_mean_luminance.push_back(stats::meanLuminance(a));
        info.fold_distance.emplace_back();
        for (const std::vector<float>& b : luminances)
            info.fold_distance.back().push_back(stats::meanSquaredDifference(a, b));
    }
    const stats::Summary luminance = stats::summarize(info.fold_mean_luminance);
    info.mean_luminance = luminance.mean;
    info.mean_luminance_standard_error = luminance.standardError();
    info.eightfold_spread = stats::relativeRmse(info.mean_variance, info.mean_luminance);
    for (std::size_t c = 0; c < 3; ++c) {
        std::array<double, kFolds> means{};
        for (std::uint32_t fold = 0; fold < kFolds; ++fold)
            for (std::size_t p = 0; p < pixels; ++p)
                means[fold] += colours[fold][3 * p + c] / static_cast<double>(pixels);
        const stats::Summary summary = stats::summarize(means);
        info.image_mean[c] = summary.mean;
        info.image_mean_standard_error[c] = summary.standardError();
    }
}

/// Samples per fold that fit into the time, from the first ones.
std::uint64_t affordable(double seconds_left, double seconds_per_sample) {
    return static_cast<std::uint64_t>(std::clamp(seconds_left / seconds_per_sample, 1.0, 1e12));
}

}  // namespace

Scene referenceScene(Scene scene, bool same_estimator) {
    scene.sampler.type = SamplerType::Independent;
    scene.sampler.replicates = 1;
    scene.sampler.seed += kReferenceSeedOffset;
    scene.integrator.roulette = false;
    // Nothing but light sampling finds lights without a size: without it they would be gone.
    const bool kept = scene.integrator.nee && !lightsWithoutSize(scene).empty();
    if (!same_estimator && !kept) scene.integrator.nee = !scene.integrator.nee;
    return scene;
}

std::string hashOfContent(const Scene& scene) {
    Scene canonical = scene;
    canonical.sampler = {};
    canonical.integrator.roulette = false;
    canonical.integrator.nee = canonical.integrator.mis = true;
    if (canonical.environment) canonical.environment->light_sampling = false;
    canonical.integrator.accelerator = Accelerator::Bvh;
    // The hash alone: no ray is traced through it.
    return compileScene(canonical, 0, {.accelerator_reach = std::numeric_limits<double>::infinity()}).hash;
}

std::string colourText(const Scene& scene) {
    const auto space = [](ColorSpace s) {
        return s == ColorSpace::LinearSrgb ? "linear sRGB" : s == ColorSpace::AcesCg ? "ACEScg" : "XYZ";
    };
    const Development development = developmentOf(scene).forFloats();
    std::string white = "no white balance";
    if (development.white)
        white = fmt::format("white balance from X : Y : Z = {:.6f} : 1 : {:.6f}", (*development.white)[0],
                            (*development.white)[2]);
    return fmt::format("exposure {} EV, {}, {}", development.exposure_ev, space(development.color_space),
                       white);
}

int makeReference(const ReferenceRequest& request, Watch& watch) {
    const std::optional<MadeReference> made = renderReference(loadScene(request.scene), request, watch);
    if (!made) return watch.stopRequested()->exit_code;
    logInfo("{}: {} samples per pixel in {} eighths, {}, {}", request.output, made->samples, kFolds,
            made->estimator, durationText(made->seconds));
    if (made->error) logInfo("its own {}", errorText(*made->error, made->light_is_missing));
    if (made->error && made->error->relative_rmse > 0.02)
        logWarning(
            "the reference is noisy; its variance is subtracted from errors, but more --time, or "
            "--same-estimator, makes them more reliable");
    return 0;
}

namespace {

/// The eighths and their sum.
struct RenderedFolds {
    Film film;
    std::vector<Image> images;
    PathFacts paths;
};

/// Each eighth has separate samples. The first also finds out how many fit into the time. Nothing when a the
/// Watch asked to stop.
std::optional<RenderedFolds> renderFolds(const Scene& scene, Session& session,
                                         const ReferenceRequest& request, Watch& watch) {
    const CompiledScene compiled = session.compile(scene);
    const FilmShape shape = filmShapeOf(compiled);
    session.openDevice();  // Not in the time that the samples have.
    const WatchedRendering watched(watch);
    ProgressState state;
    state.pixels = std::uint64_t{shape.width} * shape.height;
    const Stopwatch rendering;
    RenderedFolds folds{Film(shape), {}, {true, brightestPathOf(compiled)}};
    std::uint64_t per_fold = request.samples / kFolds;
    for (std::uint32_t fold = 0; fold < kFolds; ++fold) {
        session.group().setScene(compiled);
        const std::uint64_t first = std::uint64_t{fold} << 44;
        std::uint64_t done = 0;
        for (std::uint64_t chunk = 1; per_fold == 0 || done < per_fold;) {
            if (watch.stopRequested()) return std::nullopt;
            const double before = rendering.seconds();
            if (per_fold > 0) chunk = std::min(chunk, per_fold - done);
            session.group().render({.first_sample = first + done, .sample_count = chunk});
            done += chunk;
            const double took = std::max(rendering.seconds() - before, 1e-6);
            state.elapsed_seconds = rendering.seconds();
            state.samples = static_cast<double>(fold * per_fold + done);
            state.target = per_fold * kFolds;
            if (request.samples == 0) state.time_limit_seconds = request.seconds;
            watch.progress(state);
            if (per_fold == 0 && rendering.seconds() > 0.04 * request.seconds)
                per_fold =
                    std::max(done, affordable(request.seconds / kFolds, took / static_cast<double>(chunk)));
            if (took < 0.25) chunk *= 2;
        }
        Film part(shape);
        session.group().readFilm(part);
        if (part.invalidSamples() > 0)
            throw Error(
                ErrorKind::Device,
                fmt::format(
                    "{} samples of the reference were NaN or infinite: it cannot serve as a reference",
                    part.invalidSamples()));
        folds.images.push_back(resolveImage(part, developmentOf(scene).forFloats(), 0));
        folds.film.add(part);
    }
    return folds;
}

/// R, G and B of the mean, then of each eighth.
Image referenceImage(const RenderedFolds& folds, const Scene& scene) {
    const Image mean = resolveImage(folds.film, developmentOf(scene).forFloats(), 0);
    Image file = mean;
    file.pixels.clear();
    file.channels = {"R", "G", "B"};
    for (std::uint32_t fold = 0; fold < kFolds; ++fold)
        for (const char* c : {"R", "G", "B"}) file.channels.push_back(fmt::format("Fold.{}.{}", fold, c));
    const std::size_t pixels = std::size_t{mean.width} * mean.height;
    for (std::size_t p = 0; p < pixels; ++p) {
        for (std::size_t c = 0; c < 3; ++c) file.pixels.push_back(mean.pixels[3 * p + c]);
        for (const Image& fold : folds.images)
            for (std::size_t c = 0; c < 3; ++c) file.pixels.push_back(fold.pixels[3 * p + c]);
    }
    return file;
}

}  // namespace

std::optional<MadeReference> renderReference(Scene scene, const ReferenceRequest& request, Watch& watch) {
    if (!measuresLight(scene.integrator.type))
        throw Error(ErrorKind::Usage,
                    "a view has no noise and needs no reference: integrator.type must be path");
    if (std::filesystem::path(request.output).extension() != ".exr")
        throw Error(ErrorKind::Usage, fmt::format("a reference stores eight parts next to the image, which "
                                                  "only EXR can hold: '{}' should end in .exr",
                                                  request.output));
    if (request.samples > 0 && request.samples < kFolds)
        throw Error(ErrorKind::Usage, fmt::format("--spp must be at least {} for a reference", kFolds));
    refuseOverInputs(scene.files_read, {request.output});
    checkWritable(request.output);
    const Stopwatch rendering;
    const std::string content = hashOfContent(scene), colour = colourText(scene),
                      record = recordText(recordOf(scene));
    const bool sampled = scene.integrator.nee;
    scene = referenceScene(std::move(scene), request.same_estimator);
    if (sampled && scene.integrator.nee && !request.same_estimator)
        logInfo("light sampling stays on, because only it finds point, spot, IES, beam and directional "
                "lights");
    warnOfMissingLight(scene);
    const std::vector<std::string> missing = missingLight(scene);
    Session session(request.backend, request.integrator);
    const std::optional<RenderedFolds> folds = renderFolds(scene, session, request, watch);
    if (!folds) return std::nullopt;
    Image file = referenceImage(*folds, scene);
    file.metadata.emplace_back("Software", "crt " CRT_VERSION);
    file.metadata.emplace_back(kContentKey, content);
    file.metadata.emplace_back(kRecordKey, record);
    file.metadata.emplace_back(kColourKey, colour);
    file.metadata.emplace_back(kEstimatorKey, estimatorText(scene));
    file.metadata.emplace_back("crt/backend", session.backend().name);
    file.metadata.emplace_back("crt/seed", std::to_string(scene.sampler.seed));
    if (!missing.empty())
        file.metadata.emplace_back("crt/missingLight", fmt::format("{}", fmt::join(missing, "; ")));
    writeImage(request.output, OutputFormat::Exr, file);
    const double seconds = rendering.seconds();
    return MadeReference{folds->film.samples.count(), estimatorText(scene), seconds,
                         estimateError(folds->film, PixelSet::All, folds->paths), !missing.empty()};
}

Reference readReference(const std::string& text, const Scene& scene) {
    Reference reference;
    reference.info.scene = scene.file;
    if (const Parsed<double> value = parseNumber(text); value.value) {
        if (!(*value.value > 0))
            throw Error(ErrorKind::Usage,
                        fmt::format("--reference {}: a luminance above 0 is expected", text));
        reference.info.kind = ReferenceKind::Analytic;
        reference.info.estimator = fmt::format("closed form: every pixel has luminance {}", text);
        reference.luminance = {static_cast<float>(*value.value)};
        reference.info.mean_luminance = *value.value;
        reference.info.image_mean.fill(*value.value);
        return reference;
    }
    const Image image = readImage(text);
    const std::string content = metadataOf(image, kContentKey);
    if (content.empty())
        throw Error(ErrorKind::Usage,
                    fmt::format("'{}' is not a reference: make one with 'crt reference {} -o {}'", text,
                                scene.file, text));
    if (content != hashOfContent(scene)) {
        const std::vector<std::string> differences = differingContent(image, scene);
        throw Error(
            ErrorKind::Usage,
            fmt::format("'{}' is a reference for another scene, or for this one with other settings: {}",
                        text,
                        differences.empty() ? "the file does not tell the difference"
                                            : fmt::format("{}", fmt::join(differences, "; "))));
    }
    const std::string colour = metadataOf(image, kColourKey);
    if (colour.empty())
        throw Error(ErrorKind::Usage, fmt::format("'{}' was written by an earlier crt, which did not store "
                                                  "exposure, colour space and white balance: make it again "
                                                  "with 'crt reference'",
                                                  text));
    if (colour != colourText(scene))
        throw Error(ErrorKind::Usage,
                    fmt::format("'{}' is a reference with other colour settings: it has {}; the scene has "
                                "{}", text,
                                colour, colourText(scene)));
    reference.width = image.width;
    reference.height = image.height;
    reference.rgb = channelsOf(image, {"R", "G", "B"});
    const stats::Rgb weights = stats::luminanceWeights(scene.film.color_space);
    reference.luminance = stats::luminances(reference.rgb, weights);
    for (std::uint32_t fold = 0; fold < kFolds; ++fold) {
        const std::vector<float> rgb =
            channelsOf(image, {fmt::format("Fold.{}.R", fold), fmt::format("Fold.{}.G", fold),
                               fmt::format("Fold.{}.B", fold)});
        if (rgb.empty())
            throw Error(ErrorKind::Usage, fmt::format("'{}' is not a reference: it lacks the eight parts",
                                                      text));
        reference.fold_luminance.push_back(stats::luminances(rgb, weights));
        reference.fold_rgb.emplace_back(rgb.begin(), rgb.end());
    }

    ReferenceInfo& info = reference.info;
    info.kind = ReferenceKind::Independent;
    info.file = text;
    info.hash = hashOfFile(text);
    info.estimator = metadataOf(image, kEstimatorKey);
    const Parsed<std::uint64_t> samples = parseUnsigned(metadataOf(image, "crt/spp"));
    info.samples = samples.value.value_or(0);
    describeFolds(info, reference.fold_luminance, reference.fold_rgb);
    return reference;
}

}  // namespace crt::converge
