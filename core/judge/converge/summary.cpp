// summary.json: fits, verdicts, references, stages and environment.
#include "base/atomic_file.h"
#include "film/luminance_error.h"
#include "judge/converge/files.h"
#include "judge/converge/findings.h"
#include "judge/converge/json_parts.h"

#include <algorithm>
#include <cmath>

namespace crt::converge {

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
Json number(const std::optional<double>& value) { return value ? number(*value) : Json(nullptr); }
Json numbers(const std::array<double, 3>& values) {
    return Json::array({number(values[0]), number(values[1]), number(values[2])});
}
Json interval(const Estimate& e) {
    return Json{{"value", number(e.value)}, {"low", number(e.low)}, {"high", number(e.high)}};
}
Json interval(const std::optional<Estimate>& e) { return e ? interval(*e) : Json(nullptr); }

void writeWhole(const std::string& path, const std::string& text) {
    AtomicFile file(path);
    file.write(text.data(), text.size());
    file.commit();
}

Json referenceJson(const ReferenceInfo& r) {
    return {{"scene", r.scene},
            {"kind", referenceKindName(r.kind)},
            {"file", r.file},
            {"hash", r.hash},
            {"samples_per_pixel", r.samples},
            {"estimator", r.estimator},
            {"mean_luminance", number(r.mean_luminance)},
            {"mean_luminance_standard_error", number(r.mean_luminance_standard_error)},
            {"image_mean", numbers(r.image_mean)},
            {"image_mean_standard_error", numbers(r.image_mean_standard_error)},
            {"mean_variance", number(r.mean_variance)},
            {"relative_error", r.kind == ReferenceKind::None || !(r.mean_variance > 0)
                                   ? Json(nullptr)
                                   : number(stats::relativeRmse(r.mean_variance, r.mean_luminance))},
            {"effective_pixels", number(r.effective_pixels)},
            {"eightfold_spread", number(r.eightfold_spread)}};
}

Json environmentJson(const Environment& e) {
    return {{"crt_version", e.crt_version},
            {"commit", e.commit},
            {"dirty", e.dirty},
            {"compiler", e.compiler},
            {"build_flags", e.build_flags},
            {"cpu", e.cpu},
            {"operating_system", e.operating_system},
            {"threads", e.threads},
            {"load_start", e.load_start},
            {"load_end", e.load_end},
            {"working_directory", e.working_directory},
            {"commands", e.commands},
            {"started", e.started},
            {"finished", e.finished},
            {"budget_seconds", number(e.budget_seconds)},
            {"spent_seconds", number(e.spent_seconds)}};
}

namespace {

Json keyJson(const Key& key) {
    return {{"scene", key.scene}, {"backend", key.backend}, {"variant", key.variant}};
}

Json pointJson(const Point& p) {
    return {{"samples_per_pixel", p.samples},
            {"replicates", p.replicates},
            {"seconds", interval(p.seconds)},
            {"render_seconds", interval(p.render_seconds)},
            {"relative_rmse", interval(p.relative_rmse)},
            {"efficiency_per_second", interval(p.efficiency)},
            {"relative_mean_bias", interval(p.mean_bias)},
            {"relative_bias_squared", interval(p.bias_squared)},
            {"predicted_over_actual_error", interval(p.calibration)},
            {"predictions", p.predicted},
            {"predictions_that_hold", p.covered},
            {"relmse", number(p.relmse)},
            {"smape", number(p.smape)},
            {"mae", number(p.mae)},
            {"flip_mean", number(p.flip_mean)},
            {"delta_e2000_mean", number(p.delta_e2000_mean)}};
}

Json targetJson(const Target& t) {
    return {
        {"relative_rmse", t.relative_rmse},
        {"reached", t.reached},
        {"at_first_point", t.at_first_point},
        {"powers", t.powers ? Json::array({number((*t.powers)[0]), number((*t.powers)[1])}) : Json(nullptr)},
        {"samples_per_pixel", interval(t.samples)},
        {"seconds", interval(t.seconds)}};
}

Json fitJson(const ConfigurationFit& fit) {
    Json json = keyJson(fit.key);
    json["omitted"] = fit.omitted;
    json["replicates"] = fit.replicates;
    json["void_rows"] = fit.void_rows;
    json["unknown_error"] = fit.unknown_error.empty() ? Json(nullptr) : Json(fit.unknown_error);
    json["error_source"] = fit.source == ErrorSource::Reference ? "reference" : "between replicates";
    json["same_bits_as"] = Json::array();
    for (const Key& key : fit.same_bits) json["same_bits_as"].push_back(key.backend);
    json["verdict"] = stats::verdictName(fit.judgement.verdict);
    json["verdict_reason"] = fit.judgement.reason;
    json["relative_mean_bias_rgb"] = nullptr;
    if (const auto& bias = fit.judgement.mean_bias)
        json["relative_mean_bias_rgb"] =
            Json::array({interval((*bias)[0]), interval((*bias)[1]), interval((*bias)[2])});
    if (fit.fitted) {
        json["time"] = {{"before_first_sample_seconds", number(fit.time.before_first_sample)},
                        {"launch_seconds", interval(fit.time.launch)},
                        {"seconds_per_sample", interval(fit.time.per_sample)},
                        {"r2", number(fit.time.r2)}};
        json["error"] = {{"variance_of_one_sample", interval(fit.error.variance)},
                         {"fitted_bias_squared", interval(fit.error.intercept)},
                         {"bias_squared", interval(fit.error.bias_squared)},
                         {"floor", interval(fit.error.floor())},
                         {"flattening", fit.error.flattening},
                         {"faster_than_inverse", fit.error.faster_than_inverse}};
        json["slope_against_samples"] = interval(fit.slope_samples);
        json["slope_samples_per_pixel"] =
            Json::array({number(fit.slope_range[0]), number(fit.slope_range[1])});
        json["slope_against_seconds"] = interval(fit.slope_seconds);
        json["common_error"] = targetJson(fit.common);
        json["efficiency_per_second"] = interval(fit.efficiency);
        json["targets"] = Json::array();
        for (const Target& target : fit.targets) json["targets"].push_back(targetJson(target));
    }
    json["points"] = Json::array();
    for (const Point& point : fit.points) json["points"].push_back(pointJson(point));
    return json;
}

Json featuresJson(const std::vector<Feature>& features) {
    Json json = Json::array();
    for (const Feature& feature : features)
        json.push_back({{"what", feature.name}, {"why", feature.reason}});
    return json;
}

Json stagesJson(const StageSeconds& s) {
    return {{"parse", number(s.parse)},
            {"build", number(s.build)},
            {"compile", number(s.compile)},
            {"upload", number(s.upload)},
            {"first_sample", number(s.first_sample)},
            {"render_wall", number(s.render_wall)},
            {"render_device", number(s.render_device)},
            {"write", number(s.write)}};
}

Json testsJson(const ImageTests& t) {
    return {{"smallest_tile_p", number(t.smallest_tile_p)},
            {"tile_p_uniformity", number(t.tile_p_uniformity)},
            {"smallest_pixel_p", number(t.smallest_pixel_p)},
            {"largest_share", number(t.largest_share)},
            {"heavy_tails", t.heavy_tails}};
}

Json configurationJson(const Configuration& c) {
    Json json = keyJson(c.key);
    json["omitted"] = c.omitted.empty() ? Json(nullptr) : Json(c.omitted);
    if (!c.omitted.empty()) return json;
    json["device"] = c.device;
    json["driver"] = c.driver;
    json["kernel"] = c.kernel;
    json["threads"] = c.threads;
    json["scene_file"] = c.scene_file;
    json["scene_hash"] = c.scene_hash;
    json["width"] = c.width;
    json["height"] = c.height;
    json["kept"] = featuresJson(c.kept);
    json["left_out"] = featuresJson(c.left_out);
    json["stage_seconds"] = stagesJson(c.stages);
    json["image_tests"] = testsJson(c.tests);
    return json;
}

const char* toneName(Tone tone) {
    switch (tone) {
        case Tone::Good: return "good";
        case Tone::Warning: return "warning";
        case Tone::Bad: return "bad";
        case Tone::Neutral: break;
    }
    return "neutral";
}

/// `invalid_samples` is 0 where all were numbers, but their squared error is none.
Json voidRowsJson(const Run& run, const std::string& scene) {
    Json json = Json::array();
    for (const Row& row : run.rows) {
        if (row.key.scene != scene || !row.isVoid()) continue;
        json.push_back({{"backend", row.key.backend},
                        {"variant", row.key.variant},
                        {"replicate", row.replicate},
                        {"samples_per_pixel", row.samples},
                        {"invalid_samples", row.invalid_samples}});
    }
    return json;
}

Json picturesJson(const std::vector<Picture>& pictures) {
    Json json = Json::array();
    for (const Picture& picture : pictures)
        json.push_back({{"title", picture.title},
                        {"file", picture.file},
                        {"width", picture.width},
                        {"height", picture.height}});
    return json;
}

Json mapsJson(const MapSet& set) {
    Json configurations = Json::array(), scales = Json::array();
    for (const MapSet::OfConfiguration& of : set.configurations)
        configurations.push_back({{"backend", of.key.backend},
                                  {"variant", of.key.variant},
                                  {"samples_per_pixel", of.samples},
                                  {"pictures", picturesJson(of.pictures)}});
    for (const ColourKey& key : set.keys)
        scales.push_back(
            {{"title", key.title}, {"low", key.low}, {"high", key.high}, {"colours", key.colours}});
    return {{"left_out", set.left_out.empty() ? Json(nullptr) : Json(set.left_out)},
            {"configurations", std::move(configurations)},
            {"scales", std::move(scales)}};
}

Json sceneJson(const Run& run, const Analysis& analysis, const std::vector<MapSet>& maps,
               const std::string& scene) {
    Json json{{"scene", scene}, {"findings", Json::array()}};
    for (const Finding& finding : findingsOfScene(run, analysis, scene))
        json["findings"].push_back({{"tone", toneName(finding.tone)}, {"text", finding.text}});
    json["void_rows"] = voidRowsJson(run, scene);
    json["maps"] = nullptr;
    for (const MapSet& set : maps)
        if (set.scene == scene) json["maps"] = mapsJson(set);
    return json;
}

std::uint32_t replicatesOf(const Run& run) {
    std::uint32_t replicates = 0;
    for (const Row& row : run.rows) replicates = std::max(replicates, row.replicate + 1);
    return replicates;
}

}  // namespace

void writeSummary(const std::string& path, const Run& run, const Analysis& analysis,
                  const std::vector<MapSet>& maps) {
    Json json;
    json["format"] = "crt converge summary 1";
    json["environment"] = environmentJson(run.environment);
    json["options"] = {{"confidence", analysis.options.confidence},
                       {"verdict_confidence", analysis.options.verdict_confidence},
                       {"equivalence_margin", analysis.options.equivalence_margin},
                       {"family_alpha", analysis.options.family_alpha},
                       {"targets", analysis.options.targets}};
    json["replicates"] = replicatesOf(run);
    json["notes"] = run.notes;
    json["references"] = Json::array();
    for (const ReferenceInfo& reference : run.references)
        json["references"].push_back(referenceJson(reference));
    json["configurations"] = Json::array();
    for (const Configuration& configuration : run.configurations)
        json["configurations"].push_back(configurationJson(configuration));
    json["scenes"] = Json::array();
    for (const std::string& scene : scenesOf(run))
        json["scenes"].push_back(sceneJson(run, analysis, maps, scene));
    json["fits"] = Json::array();
    for (const ConfigurationFit& fit : analysis.fits) json["fits"].push_back(fitJson(fit));
    writeWhole(path, json.dump(1, ' ', false, Json::error_handler_t::replace) + '\n');
}

}  // namespace crt::converge
