#include "render/report.h"

#include "backend/loader.h"
#include "base/host.h"
#include "scene/light_units.h"
#include "scene/missing_light.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <thread>

namespace crt {
namespace {

using Json = nlohmann::ordered_json;  // In the order written here: the report is read by people too.

/// JSON has no infinity and no NaN; what is unknown is null.
Json knownOrNull(double value) { return std::isfinite(value) && value >= 0 ? Json(value) : Json(nullptr); }

Json perSecond(double count, double seconds) { return seconds > 0 ? Json(count / seconds) : Json(nullptr); }

const char* stopName(StopReason reason) {
    switch (reason) {
        case StopReason::Samples: return "samples";
        case StopReason::Time: return "time";
        case StopReason::Target: return "target error";
        case StopReason::Interrupted: return "interrupted";
        case StopReason::Failed:
        case StopReason::Overtaken: break;
    }
    return "failed";
}

const char* knowledgeName(ErrorKnowledge knowledge) {
    switch (knowledge) {
        case ErrorKnowledge::Known: return "known";
        case ErrorKnowledge::Bound: return "upper bound";
        case ErrorKnowledge::NotYet: break;
    }
    return "not yet known";
}

/// The error estimate of the image (docs/error.md), relative to its mean luminance.
Json estimateJson(const std::optional<ErrorEstimate>& error) {
    if (!error) return nullptr;
    Json json{{"knowledge", knowledgeName(error->knowledge)},
              {"mean_luminance", error->mean_luminance},
              {"mean_luminance_cd_m2", error->mean_luminance * luminanceOfUnitY_cd_m2()},
              {"degrees_of_freedom", error->degrees_of_freedom}};
    if (error->rare_paths > 0) json["rare_paths"] = error->rare_paths;
    // A number that cannot be trusted must not be read as one that can.
    if (error->knowledge == ErrorKnowledge::NotYet) return json;
    const stats::Interval mean = error->meanInterval(0.95);
    json["relative_rmse"] = error->relative_rmse;
    json["relative_rmse_95"] = {error->relative_rmse_95.lower, error->relative_rmse_95.upper};
    json["half_width_95"] = error->half_width_95;
    json["mean_luminance_standard_error"] = error->mean_standard_error;
    json["mean_luminance_95"] = {mean.lower, mean.upper};
    json["mean_luminance_95_cd_m2"] = {mean.lower * luminanceOfUnitY_cd_m2(),
                                       mean.upper * luminanceOfUnitY_cd_m2()};
    return json;
}

Json errorJson(const RunFacts& facts) {
    Json json = estimateJson(facts.error);
    if (!facts.error) return json;
    if (facts.error->known()) {
        const auto samples = static_cast<double>(facts.samples.count());
        const double target = facts.target_error > 0 ? facts.target_error : 0.01;
        const stats::Interval needed = facts.error->samplesFor(target, samples);
        const double each = facts.rendered_samples > 0
                                ? facts.sampling_seconds / static_cast<double>(facts.rendered_samples)
                                : std::nan("");
        json["to_target"] = {
            {"half_width_95", target},
            {"more_samples", {std::ceil(needed.lower - samples), std::ceil(needed.upper - samples)}},
            {"more_seconds",
             {knownOrNull((needed.lower - samples) * each), knownOrNull((needed.upper - samples) * each)}}};
    }
    if (facts.target_error > 0)
        json["judged"] = {{"even_pixels", estimateJson(facts.even_pixels)},
                          {"odd_pixels", estimateJson(facts.odd_pixels)}};
    return json;
}

}  // namespace

std::vector<std::string> featureList(std::uint64_t mask) {
    std::vector<std::string> names;
    const std::string all = featureNames(mask);  // "bvh, diffuse"
    for (std::size_t begin = 0; begin < all.size();) {
        const std::size_t end = std::min(all.find(", ", begin), all.size());
        names.push_back(all.substr(begin, end - begin));
        begin = end + 2;
    }
    return names;
}

std::string reportJson(const Scene& scene, const CompiledScene& compiled, const RunFacts& facts) {
    const CrtBackendReport& b = facts.backend;
    const double rays = static_cast<double>(b.closest_rays) + static_cast<double>(b.shadow_rays);
    // A device that can time itself says what the kernel cost; the wall clock has the launches and the
    // reading on top.
    const double render_seconds = b.render_seconds > 0 ? b.render_seconds : facts.sampling_seconds;

    Json report;
    report["crt"] = {{"version", CRT_VERSION}, {"command", facts.command}, {"finished", utcNow()}};
    if (!facts.frame.empty()) report["crt"]["request"] = facts.frame;
    report["host"] = {{"cpu", processorName()},
                      {"os", operatingSystem()},
                      {"threads", std::thread::hardware_concurrency()}};
    report["backend"] = {{"name", facts.backend_name},
                         {"version", facts.backend_version},
                         {"build", facts.backend_build},
                         {"path", facts.backend_path},
                         {"device", arrayText(b.device)},
                         {"driver", facts.driver},
                         {"kernel", arrayText(b.kernel)},
                         {"kernel_features", featureList(b.kernel_features)},
                         {"kernel_from_cache", b.kernel_from_cache != 0},
                         {"registers", b.registers},
                         {"spill_bytes", b.spill_bytes}};

    Json devices = Json::array();
    for (const DeviceShare& device : facts.devices)
        devices.push_back({{"device", device.selector},
                           {"name", device.name},
                           {"samples", device.samples},
                           {"seconds", device.seconds},
                           {"failure", device.failure.empty() ? Json(nullptr) : Json(device.failure)}});
    report["devices"] = std::move(devices);

    Json files = Json::array();
    for (const std::string& file : scene.files_read) files.push_back(file);
    report["scene"] = {{"file", scene.file},
                       {"title", scene.title},
                       {"hash", compiled.hash},
                       {"files_read", std::move(files)},
                       {"width", compiled.header().width},
                       {"height", compiled.header().height},
                       {"objects", compiled.objects},
                       {"triangles", compiled.triangles},
                       {"shapes", compiled.shapes},
                       {"instances", compiled.instances},
                       {"instanced_triangles", compiled.instanced_triangles},
                       {"emitters", compiled.emitters},
                       {"nodes", compiled.nodes},
                       {"images", compiled.images},
                       {"seed", scene.sampler.seed}};

    Json left_out = Json::array();
    for (const auto& [what, why] : compiled.left_out) left_out.push_back({{"what", what}, {"why", why}});
    report["features"] = {{"mask", fmt::format("{:#x}", compiled.header().features)},
                          {"kept", featureList(compiled.header().features)},
                          {"left_out", std::move(left_out)}};

    // parse, build, compile, open, prepare, sampling, write and other make up the total. The others are
    // parts of these, or ran beside them: kernel_compile, cache and upload of prepare, and render of
    // sampling.
    const double build = compiled.build_seconds + b.build_seconds;
    const double prepare = facts.prepare_seconds - b.build_seconds;
    const double told = scene.parse_seconds + build + compiled.compile_seconds + facts.open_seconds +
                        prepare + facts.sampling_seconds + facts.write_seconds;
    report["seconds"] = {{"parse", scene.parse_seconds},
                         {"build", build},
                         {"compile", compiled.compile_seconds},
                         {"open", facts.open_seconds},
                         {"prepare", prepare},
                         {"kernel_compile", b.compile_seconds},
                         {"cache", b.cache_seconds},
                         {"upload", b.upload_seconds},
                         {"render", render_seconds},
                         {"sampling", facts.sampling_seconds},
                         {"write", facts.write_seconds},
                         {"other", facts.total_seconds - told},
                         {"total", facts.total_seconds}};

    Json ranges = Json::array();
    for (const auto& [first, end] : facts.samples.ranges()) ranges.push_back({first, end});
    report["samples"] = {{"target", facts.target_samples > 0 ? Json(facts.target_samples) : Json(nullptr)},
                         {"per_pixel", facts.samples.count()},
                         {"resumed", facts.resumed_samples},
                         {"rendered", facts.rendered_samples},
                         {"ranges", std::move(ranges)},
                         {"chunks", facts.chunks},
                         {"invalid", facts.invalid_samples},
                         {"dropped_splats", facts.dropped_splats}};
    report["rays"] = {{"paths", b.paths}, {"closest", b.closest_rays}, {"shadow", b.shadow_rays}};
    report["speed"] = {{"mpaths_per_second", perSecond(static_cast<double>(b.paths) * 1e-6, render_seconds)},
                       {"mrays_per_second", perSecond(rays * 1e-6, render_seconds)}};
    report["memory"] = {{"scene_bytes", compiled.size_bytes},
                        {"texel_bytes", compiled.texel_bytes},
                        {"host_peak_bytes", peakHostMemory()},
                        {"device_peak_bytes", b.peak_memory_bytes},
                        {"film_bands", facts.film_bands}};
    report["error"] = errorJson(facts);
    report["missing_light"] = missingLight(scene);
    report["warnings"] = facts.warnings;

    Json outputs = Json::array();
    for (const std::string& file : facts.outputs) outputs.push_back(file);
    report["outputs"] = std::move(outputs);
    report["stop"] = {
        {"reason", stopName(facts.stop)},
        {"signal", facts.stop == StopReason::Interrupted ? Json(facts.request.cause) : Json(nullptr)},
        {"failure", facts.failure.empty() ? Json(nullptr) : Json(facts.failure)},
        {"exit_code", facts.exit_code}};
    // File names and command lines are bytes, not necessarily UTF-8; a report with a replacement character
    // beats none.
    return report.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace crt
