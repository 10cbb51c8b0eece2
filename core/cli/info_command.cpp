#include "backend/sdk/gpu_schedule.h"
#include "base/stage.h"
#include "base/standard_output.h"
#include "base/unit_text.h"
#include "base/words.h"
#include "cli/commands.h"
#include "cli/row.h"
#include "cli/shared_options.h"
#include "cli/stage_progress.h"
#include "compile/compile.h"
#include "film/checkpoint.h"
#include "film/error_text.h"
#include "image/image_io.h"
#include "image/image_metadata.h"
#include "image/texels.h"
#include "kernel/dialect/features.h"
#include "render/job.h"
#include "render/outputs.h"
#include "scene/import/import.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace crt {
namespace {

const char* name(MaterialType type) {
    for (const auto& [known, word] : kMaterialNames)
        if (known == type) return word;
    for (const auto& [known, word] : kComposedNames)
        if (known == type) return word;
    return "";
}

const char* name(PixelFilter filter) {
    switch (filter) {
        case PixelFilter::Box: return "box";
        case PixelFilter::Gaussian: return "gaussian";
        case PixelFilter::BlackmanHarris: break;
    }
    return "Blackman-Harris";
}

const char* name(SamplerType type) {
    switch (type) {
        case SamplerType::Sobol: return "sobol";
        case SamplerType::Independent: return "independent";
        case SamplerType::XorShift: break;
    }
    return "xorshift";
}

std::string vectorText(const Vec3d& v) { return fmt::format("({:g}, {:g}, {:g})", v[0], v[1], v[2]); }

std::string cameraText(const Camera& camera) {
    const auto degrees = [](double tangent) { return 2 * std::atan(tangent) * 57.29577951308232; };
    std::string text = fmt::format("at {} looking at {}, field of view {:.1f} x {:.1f} degrees",
                                   vectorText(camera.position), vectorText(camera.target),
                                   degrees(camera.tan_half_width), degrees(camera.tan_half_height));
    if (camera.aperture_radius > 0) text += fmt::format(", lens of radius {:g}", camera.aperture_radius);
    return text;
}

std::string filmText(const Scene& scene) {
    std::string text = fmt::format("{} x {} pixels, {} filter", scene.film.width, scene.film.height,
                                   name(scene.film.filter));
    const auto& [x0, y0, x1, y1] = scene.film.crop;
    if (x1 > x0) text += fmt::format(", cropped to [{}, {}) x [{}, {})", x0, x1, y0, y1);
    if (const std::string spectral = spectralText(spectralChannelsOf(scene)); !spectral.empty())
        text += "\n" + spectral;
    return text;
}

std::string materialsText(const Scene& scene) {
    constexpr std::size_t kShown = 100;
    std::string text;
    for (std::size_t i = 0; i < std::min(kShown, scene.materials.size()); ++i)
        text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", scene.materials[i].name,
                            name(scene.materials[i].type));
    if (scene.materials.size() > kShown)
        text += fmt::format(" and {} more", scene.materials.size() - kShown);
    return text.empty() ? "none" : text;
}

std::string texturesText(const CompiledScene& compiled) {
    if ((compiled.header().features & CRT_FEATURE_TEXTURE) == 0) return "none";
    if (compiled.images == 0) return "no images";
    return fmt::format("{}, {} of texels", counted(compiled.images, "image", "images"),
                       bytesText(static_cast<double>(compiled.texel_bytes)));
}

std::string lightsText(const Scene& scene, const CompiledScene& compiled) {
    std::string text;
    if (compiled.emitters > 0)
        text = counted(compiled.emitters, "emitting triangle or parallelogram",
                       "emitting triangles or parallelograms");
    const auto add = [&text](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
    for (const auto& [type, word] : kPointLightNames) {
        const auto count = std::count_if(scene.point_lights.begin(), scene.point_lights.end(),
                                         [t = type](const PointLight& light) { return light.type == t; });
        if (count > 0)
            add(counted(static_cast<std::size_t>(count), fmt::format("{} light", word).c_str(),
                        fmt::format("{} lights", word).c_str()));
    }
    if (scene.environment)
        add(scene.environment->image ? fmt::format("environment of {}", scene.environment->image->file)
            : scene.environment->sky ? fmt::format("CIE sky of type {}", scene.environment->sky->type)
            : scene.environment->clear_sky
                ? fmt::format("clear sky of turbidity {}", scene.environment->clear_sky->turbidity)
                : "constant environment");
    return text.empty() ? "none: every image will be black" : text;
}

std::string acceleratorText(const CompiledScene& compiled) {
    if (compiled.header().features & CRT_FEATURE_BVH)
        return fmt::format("BVH, {}", counted(compiled.nodes, "node of four", "nodes of four"));
    if (compiled.header().features & CRT_FEATURE_AABB)
        return fmt::format("a box around each of {}", counted(compiled.objects, "object", "objects"));
    if (compiled.shapes > 0) return "a loop over all triangles and shapes";
    return compiled.triangles == 0 ? "none: the scene has no surfaces" : "a loop over all triangles";
}

std::string scheduleText(const Scene& scene, const CompiledScene& compiled) {
    return wantsWavefront(compiled.header().features, static_cast<std::uint32_t>(scene.integrator.max_depth))
               ? "cuda uses separate kernels for tracing and shading, with paths sorted by material "
                 "(--kernel lean)"
               : "one kernel traces and shades each whole path";
}

void showScene(const SceneRequest& what, bool verbose) {
    std::optional<StageProgress> progress(std::in_place, ProgressMode::Auto);
    const Scene scene = loadScene(what);
    const CompiledScene compiled = compileScene(scene, requestedAovs(scene));
    progress.reset();
    printOut("{}{}\n", what.file, scene.title.empty() ? "" : ": " + printable(scene.title));
    printRow("film", filmText(scene));
    printRow("camera", cameraText(scene.camera));
    printRow(
        "geometry",
        counted(compiled.objects, "object", "objects") + ", " +
            counted(compiled.triangles, "triangle", "triangles") +
            (compiled.shapes > 0 ? ", " + counted(compiled.shapes, "shape", "shapes") : "") +
            (compiled.instances > 0
                 ? fmt::format(", {} of meshes of {}", counted(compiled.instances, "instance", "instances"),
                               counted(compiled.instanced_triangles, "triangle", "triangles"))
                 : ""));
    printRow("materials", materialsText(scene));
    printRow("textures", texturesText(compiled));
    printRow("lights", lightsText(scene, compiled));
    printRow("sampler", fmt::format("{}, seed {}, {} samples per pixel", name(scene.sampler.type),
                                    scene.sampler.seed, scene.sampler.samples));
    printRow("accelerator", acceleratorText(compiled));
    printRow("schedule", scheduleText(scene, compiled));
    printRow("needs", featureNames(compiled.header().features));
    std::string left_out;
    for (const auto& [thing, why] : compiled.left_out)
        left_out += fmt::format("{}{}: {}", left_out.empty() ? "" : "\n", thing, why);
    printRow("left out", left_out.empty() ? "nothing"
                         : verbose        ? left_out
                                          : counted(compiled.left_out.size(), "feature", "features") +
                                                " of the kernel; --verbose lists them");
    printRow("scene blob", bytesText(static_cast<double>(compiled.size_bytes)));
    printRow("scene hash", compiled.hash);
    printRow("times", fmt::format("{} to read, {} to compile (including {} for the accelerator)",
                                  durationText(scene.parse_seconds), durationText(compiled.compile_seconds),
                                  durationText(compiled.build_seconds)));
}

std::string aovText(std::uint32_t aovs) {
    std::string text;
    for (const AovRow& row : kAovRows)
        if ((aovs & row.aov) != 0 && !row.name.empty())
            text += fmt::format("{}{}", text.empty() ? "" : ", ", row.name);
    return text.empty() ? "none" : text;
}

std::string developmentText(const Development& development) {
    const char* const space = development.color_space == ColorSpace::LinearSrgb ? "linear sRGB"
                              : development.color_space == ColorSpace::AcesCg   ? "ACEScg"
                                                                                : "XYZ";
    const std::string view =
        development.view == ViewTransform::None
            ? std::string()
            : fmt::format(", view {}", kViewTransformNames[static_cast<std::size_t>(development.view)]);
    return fmt::format("{}, exposure {:+g} EV, white balance {}{}{}", space, development.exposure_ev,
                       development.white ? "of " + whiteBalanceText(development) : "none",
                       development.apply_to_float ? ", in files of floats too" : "", view);
}

void showRecord(const FilmRecord& record) {
    const auto optional_row = [](const char* name, const std::string& value) {
        if (!value.empty()) printRow(name, value);
    };
    optional_row("title", record.title);
    if (record.isCropped())
        printRow("window",
                 fmt::format("[{}, {}) x [{}, {}) of {} x {} pixels", record.window[0], record.window[2],
                             record.window[1], record.window[3], record.width, record.height));
    optional_row("spectral", spectralText(record.spectral));
    printRow("developed in", developmentText(record.development));
    std::vector<std::string> lights;
    for (const auto& [name, white] : record.whites) lights.push_back(name);
    optional_row("lights", fmt::format("{}", fmt::join(lights, ", ")));
    optional_row("missing", fmt::format("{}", fmt::join(record.missing_light, "; ")));
    if (record.paths.brightest.rare)
        printRow("rare paths", fmt::format("of a luminance of {:.3g}", record.paths.brightest.luminance));
    printRow("seed", std::to_string(record.seed));
    optional_row("rendered by", record.backend);
    optional_row("on", record.device);
    optional_row("at", record.date_utc.empty() ? "" : record.date_utc + " UTC");
}

void showFilm(const std::string& file) {
    const auto [film, identity] = readCheckpoint(file);
    const std::optional<ErrorEstimate> error = estimateError(
        film, PixelSet::All, identity.record ? identity.record->paths : PathFacts{});
    printOut("{}: {}\n", file,
             identity.record && identity.record->complete == true ? "film" : "partial render");
    printRow("film", fmt::format("{} x {} pixels", film.shape().width, film.shape().height));
    printRow("aovs", aovText(film.shape().aovs));
    printRow("samples", fmt::format("{} per pixel: {}", film.samples.count(), film.samples.text()));
    printRow("invalid", counted(film.invalidSamples(), "sample", "samples"));
    if (!film.splats.empty()) printRow("dropped", counted(film.droppedSplats(), "splat", "splats"));
    const bool light_is_missing = identity.record && !identity.record->missing_light.empty();
    const bool lacks_replicates = !film.splats.empty() && film.replicates() == 1;
    printRow("error", error              ? errorText(*error, light_is_missing).substr(6)
                      : lacks_replicates ? "unknown: samples add to other pixels, without replicates"
                                         : "unknown");
    if (identity.record) showRecord(*identity.record);
    printRow("scene hash", identity.scene_hash);
    printRow("written by", fmt::format("crt {}, bits version {}", identity.version, identity.bits_version));
}

void showImage(const std::string& file) {
    const Image image = readImage(file);
    printOut("{}: image\n", file);
    printRow("size", fmt::format("{} x {} pixels", image.width, image.height));
    printRow("channels", fmt::format("{}", fmt::join(image.channels, ", ")));
    if (!image.integer_channels.empty())
        printRow("integers", fmt::format("{}", fmt::join(image.integer_channels, ", ")));
    for (const auto& [key, value] : image.metadata)
        printRow(key.c_str(), key == kWhiteLuminanceKey ? value + " cd/m² at (1, 1, 1)" : value);
}

/// True for images that crt reads as textures and does not write.
bool isTexture(const std::string& file) {
    const std::string extension = extensionOf(file);
    return extension == ".hdr" || extension == ".jpg" || extension == ".jpeg" || extension == ".tga";
}

void showTexture(const std::string& file) {
    const TexelsInfo info = texelsInfo(file);
    printOut("{}: image\n", file);
    printRow("size", fmt::format("{} x {} pixels", info.width, info.height));
    printRow("channels", info.channels == 1 ? "grey" : "red, green, blue");
}

/// Describes a scene, a film or an image, by the extension of its name.
int showInfo(const SceneRequest& what, bool verbose) {
    if (std::filesystem::path(what.file).extension() == kCheckpointExtension) {
        showFilm(what.file);
    } else if (formatOfFile(what.file)) {
        showImage(what.file);
    } else if (isTexture(what.file)) {
        showTexture(what.file);
    } else {
        showScene(what, verbose);
    }
    return 0;
}

}  // namespace

Command infoCommand() {
    struct State {
        SceneRequest request;
        bool verbose = false;
    };
    const auto state = std::make_shared<State>();
    OptionGroup options{"Options"};
    addSceneChanges(options, state->request);
    options.options.push_back({.names = "-v,--verbose",
                               .placeholder = {},
                               .help = "list the features that the kernel leaves out for this scene, and "
                                       "why",
                               .read = [state](const std::string&) { state->verbose = true; }});
    return {
        .name = "info",
        .summary = "describe a scene, a .crtfilm or an image",
        .arguments = {{.name = "FILE",
                       .help = "scene (- for standard input), film or image",
                       .read = [state](const std::string& text) { state->request.file = text; },
                       .completion = completeFile({"yaml", "yml", "crtfilm", "exr", "png", "ppm", "pfm"})}},
        .groups = {std::move(options)},
        .run = [state](const std::string&) { return showInfo(state->request, state->verbose); }};
}

}  // namespace crt
