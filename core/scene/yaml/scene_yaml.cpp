// Over 450 lines: the top of a scene, its settings, and the ways to its text.
#include "scene/yaml/scene_yaml.h"
#include "image/image_io.h"

#include "base/input_file.h"
#include "base/log.h"
#include "base/stopwatch.h"
#include "scene/import/import.h"
#include "scene/length_unit.h"
#include "scene/scene_limits.h"
#include "scene/yaml/composed_text.h"
#include "scene/yaml/scene_environment.h"
#include "scene/yaml/scene_include.h"
#include "scene/yaml/scene_lights.h"
#include "scene/yaml/scene_objects.h"
#include "scene/yaml/scene_override.h"
#include "scene/yaml/scene_reader.h"
#include "scene/yaml/scene_schema.h"
#include "scene/yaml/scene_spectra.h"
#include "scene/yaml/scene_spectral_film.h"
#include "scene/yaml/yaml_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <deque>
#include <filesystem>
#include <numbers>
#include <string_view>

namespace crt {
namespace {

// ---- Sections -------------------------------------------------------------------------------------------

void readFilm(const SectionReader& section, SpectrumReader& spectra, FilmSettings& film) {
    constexpr std::int64_t kMaxPixels = std::int64_t{1} << 31;  // Pixels are numbered in 32 bits.
    std::vector<int> size;
    if (section.read("resolution", size)) {
        const std::int64_t pixels = std::int64_t{size[0]} * size[1];
        if (pixels > kMaxPixels)
            section.error("resolution", fmt::format("{} x {} are {} pixels; a film has at most 2^31",
                                                    size[0], size[1], pixels));
        film.width = size[0];
        film.height = size[1];
    }
    std::vector<int> crop;
    if (section.read("crop", crop)) {
        if (crop[0] >= crop[2] || crop[1] >= crop[3])
            section.error("crop", "this window is empty; crop is [x0, y0, x1, y1) with x0 < x1 and y0 < y1");
        else if (crop[2] > film.width || crop[3] > film.height)
            section.error("crop", fmt::format("this window goes beyond the film of {} x {} pixels",
                                              film.width, film.height));
        std::copy(crop.begin(), crop.end(), film.crop.begin());
    }

    double radius = 0;
    bool radius_given = false;
    if (const YamlEntry* filter = section.find("filter");
        filter != nullptr && filter->value->kind == YamlKind::Map) {
        const std::optional<SectionReader> details = section.section("filter", "the filter");
        details->readEnum("type", film.filter);
        radius_given = details->read("radius", radius);
        details->read("sigma", film.filter_sigma);
        if (details->has("sigma") && film.filter != PixelFilter::Gaussian)
            details->error("sigma", "only a gaussian filter has a sigma");
    } else {
        section.readEnum("filter", film.filter);
    }
    constexpr double kSmoothRadius =
        1.5;  // Pixels; a narrower window cuts a bell off while it is still high.
    film.filter_radius = radius_given                      ? radius
                         : film.filter == PixelFilter::Box ? FilmSettings{}.filter_radius
                                                           : kSmoothRadius;

    section.readEnum("color_space", film.color_space);
    film.white_balance = spectra.read(section, "white_balance", SpectrumUse::White);
    if (film.white_balance && !(spectrumToXyz(*film.white_balance)[1] > 0))
        section.error("white_balance", "this spectrum has no luminance, so it has no white");
    section.read("exposure_ev", film.exposure_ev);
    section.read("apply_to_float", film.apply_to_float);
    section.readEnum("view", film.view);
    film.spectral = readSpectralFilm(section, spectra);
}

double length(const Vec3d& v) { return std::hypot(v[0], v[1], v[2]); }

/// Finds what leaves the view without a direction or the picture without an up.
void checkView(const SectionReader& section, const Camera& camera) {
    constexpr double kParallel = 1e-9;  // Sine of the angle below which up × view is only rounding.
    const Vec3d view{camera.target[0] - camera.position[0], camera.target[1] - camera.position[1],
                     camera.target[2] - camera.position[2]};
    const double view_length = length(view), up_length = length(camera.up);
    const std::string_view aim = section.has("target") ? "target" : "position";
    if (view_length == 0)
        return section.error(aim, "position and target are the same point, so the camera has no direction");
    if (!std::isfinite(view_length))
        return section.error(aim, "position and target are too far apart for a double");
    if (up_length == 0) return section.error("up", "up has length 0");
    if (!std::isfinite(up_length)) return section.error("up", "up is too long for a double");
    Vec3d v = view, u = camera.up;
    for (std::size_t i = 0; i < 3; ++i) v[i] /= view_length, u[i] /= up_length;
    const Vec3d side{v[1] * u[2] - v[2] * u[1], v[2] * u[0] - v[0] * u[2], v[0] * u[1] - v[1] * u[0]};
    if (length(side) < kParallel)
        section.error(section.has("up") ? "up" : aim,
                      "up is parallel to the view, so the rotation of the image is undefined",
                      section.has("up") ? "" : "set 'up', which is [0, 1, 0] when left out");
}

/// The image plane from the angle across its shorter side.
void setFieldOfView(Camera& camera, const FilmSettings& film, double tan_shorter) {
    const double aspect = static_cast<double>(film.width) / film.height;
    camera.tan_half_width = tan_shorter * std::max(aspect, 1.0);
    camera.tan_half_height = tan_shorter * std::max(1 / aspect, 1.0);
}

/// `errors_before` is the count before the section was opened: a misspelt position makes no second error of
/// the view.
void readCamera(const SectionReader& section, std::size_t errors_before, const FilmSettings& film,
                Camera& camera) {
    camera.place = section.place().resolved();
    for (const auto& [key, value] :
         {std::pair{"position", &camera.position}, {"target", &camera.target}, {"up", &camera.up}})
        section.read(key, *value);
    if (section.diagnostics().count() == errors_before) checkView(section, camera);

    double fov = 0, focal_length = 0;
    std::vector<double> sensor;
    if (section.read("fov", fov)) setFieldOfView(camera, film, std::tan(fov * (std::numbers::pi / 360)));
    const bool have_focal_length = section.read("focal_length", focal_length),
               have_sensor = section.read("sensor", sensor);
    if (have_focal_length && have_sensor) {
        camera.tan_half_width = sensor[0] / (2 * focal_length);
        camera.tan_half_height = sensor[1] / (2 * focal_length);
        if (!std::isfinite(camera.tan_half_width) || !std::isfinite(camera.tan_half_height) ||
            camera.tan_half_width == 0 || camera.tan_half_height == 0)
            section.error("sensor", "sensor and focal_length give no field of view");
        constexpr double kSquareEnough = 1e-3;
        const double pixel_aspect = sensor[0] / sensor[1] * film.height / film.width;
        if (std::abs(pixel_aspect - 1) > kSquareEnough) {
            logWarning("{}: sensor and resolution have different proportions: pixels are {:.4g} times as "
                       "wide as high",
                       section.place("sensor").resolved().text(), pixel_aspect);
        }
    }
    section.read("aperture_radius", camera.aperture_radius);
    section.read("focus_distance", camera.focus_distance);
}

void readIntegrator(const SectionReader& section, IntegratorSettings& settings) {
    section.readEnum("type", settings.type);
    section.read("max_depth", settings.max_depth);
    section.read("roulette_depth", settings.roulette_depth);
    section.read("roulette", settings.roulette);
    section.read("nee", settings.nee);
    section.read("mis", settings.mis);
    section.readEnum("accelerator", settings.accelerator);
}

void readSampler(const SectionReader& section, SamplerSettings& settings) {
    section.readEnum("type", settings.type);
    section.read("seed", settings.seed);
    section.read("samples", settings.samples);
    if (section.read("replicates", settings.replicates) &&
        !std::has_single_bit(static_cast<unsigned>(settings.replicates)))
        section.error("replicates",
                      fmt::format("{} replicates are not available: use 2, 4, 8 or 16, or 1 for a single "
                                  "sequence",
                                  settings.replicates));
}

void readOutput(const SectionReader& section, std::vector<Output>& outputs) {
    Output output;
    output.place = section.place().resolved();
    const bool named = section.read("file", output.file);
    if (named &&
        std::any_of(outputs.begin(), outputs.end(), [&](const Output& o) { return o.file == output.file; }))
        section.error("file", fmt::format("'{}' is written twice", output.file));

    bool format_known = section.readEnum("format", output.format);
    if (named && !section.has("format")) {
        const std::optional<OutputFormat> format = formatOfFile(output.file);
        format_known = format.has_value();
        if (format_known) {
            output.format = *format;
        } else {
            std::string extension = std::filesystem::path(output.file).extension().string();
            if (!extension.empty()) extension.erase(0, 1);
            section.error("file",
                          fmt::format("'{}' does not end in {}; add 'format'", output.file, kImageEnds),
                          didYouMean(extension, section.schema().find("format")->choices));
        }
    }

    if (const YamlNode* list = section.list("aovs")) {
        const KeySchema& key = *section.schema().find("aovs");
        for (const YamlNodePtr& item : list->items) {
            std::size_t choice = 0;
            if (readChoice(section.diagnostics(), *item, item->place, key, "an item of 'aovs'", choice))
                output.aovs |= aovNamed(key.choices[choice]);
        }
        if (!list->items.empty() && format_known && output.format != OutputFormat::Exr)
            section.error("aovs", "only exr files can hold AOVs");
    }
    outputs.push_back(std::move(output));
}

void readScene(const YamlNode& root, Diagnostics& out, SceneFiles& files, GltfFiles& gltf,
               std::unique_ptr<LoadedMesh> model_mesh, Scene& scene) {
    const SectionReader top(out, root, root.place, schemaSection(""), "the scene");
    if (root.kind != YamlKind::Map) return;
    int version = 1;
    top.read("crt", version);
    top.read("title", scene.title);
    if (std::size_t unit = 0; top.readEnum("unit", unit)) scene.metres_per_unit = kLengthUnits[unit].metres;

    SpectrumReader spectra(out, files, top.map("spectra"));
    if (const auto section = top.section("film", "film")) readFilm(*section, spectra, scene.film);
    const std::size_t errors_before = out.count();
    const auto camera = top.section("camera", "camera");
    setFieldOfView(scene.camera, scene.film,
                   std::min(scene.camera.tan_half_width, scene.camera.tan_half_height));
    if (camera) readCamera(*camera, errors_before, scene.film, scene.camera);
    if (const auto section = top.section("integrator", "integrator"))
        readIntegrator(*section, scene.integrator);
    if (const auto section = top.section("sampler", "sampler")) readSampler(*section, scene.sampler);

    TextureReader textures(out, files, spectra, gltf, scene);
    MaterialReader materials(out, spectra, textures, scene);
    SceneRoom room{.limit = ExpansionLimit(scene.input_bytes)};
    MeshReader meshes(out, files, textures, gltf, materials, room, scene);
    if (model_mesh) meshes.offer(std::move(model_mesh));
    if (const YamlNode* map = top.map("materials")) materials.read(*map);
    if (const YamlNode* list = top.list("objects"))
        ObjectReader(out, materials, meshes, room, scene).read(*list);
    if (const YamlNode* list = top.list("lights")) readLights(*list, out, files, spectra, scene);
    if (const auto section = top.section("environment", "environment"))
        scene.environment = readEnvironment(*section, spectra, files, scene.point_lights);
    if (const YamlNode* list = top.list("outputs"))
        for (std::size_t i = 0; i < list->items.size(); ++i)
            readOutput(SectionReader(out, *list->items[i], list->items[i]->place, schemaSection("output"),
                                     fmt::format("output {}", i)),
                       scene.outputs);

    spectra.finish();
    scene.whites = spectra.whites();
    if (!out.failed()) materials.finish();
}

/// `path` is the file of the scene; empty for text of another origin. `composed` may be null.
Scene parse(const std::string& yaml, const std::string& name, const std::string& path,
            const std::vector<SceneOverride>& overrides, std::string* composed, SceneFiles files,
            GltfFiles gltf = {}, std::unique_ptr<LoadedMesh> model_mesh = {}) {
    const Stopwatch reading;
    Scene scene;
    scene.file = name;
    scene.input_bytes = yaml.size();
    std::deque<YamlSource> override_sources;  // Places point to them: they must not move.
    Diagnostics out;
    SceneIncludes includes(out, files);
    if (YamlNodePtr root = includes.read(name, yaml, path)) {
        applyOverrides(root, overrides, override_sources, out);
        readScene(*root, out, files, gltf, std::move(model_mesh), scene);
        if (composed != nullptr && !out.failed()) *composed = composedText(*root, files);
    }
    out.throwIfFailed();
    checkRadiance(scene);
    scene.files_read = files.read();
    std::error_code unknown;
    for (const std::string& file : scene.files_read)
        if (file != name || isModel(name)) scene.input_bytes += std::filesystem::file_size(file, unknown);
    // A scene of a program, which may still put meshes into it.
    if (scene.files_read.empty()) scene.input_bytes = 0;
    scene.parse_seconds = reading.seconds();
    return scene;
}

constexpr std::string_view kStandardInput = "-";

/// The name of the scene in messages and outputs.
std::string nameOf(const std::string& path) { return path == kStandardInput ? "stdin" : path; }

[[noreturn]] void cannotRead(const std::string& path, std::string_view why) {
    throw Error(ErrorKind::Scene, fmt::format("{}: error: {}", path, why), {path, 0, 0});
}

/// The whole text: of a file, or of standard input for "-".
std::string readSceneText(const std::string& path) {
    try {
        return path == kStandardInput ? readStandardInput(kMostSceneBytes)
                                      : readInput(path, kMostSceneBytes);
    } catch (const InputRefused& refused) {
        const std::string why = refused.what();
        const bool large = why.starts_with("has "), pipe = why.starts_with("is a pipe");
        cannotRead(nameOf(path), (path == kStandardInput      ? "standard input "
                                  : why.starts_with("cannot") ? ""
                                                              : "this ") +
                                     why +
                                     (large  ? "; put large meshes into OBJ files"
                                      : pipe ? "; write '-' for standard input"
                                             : ""));
    }
}

}  // namespace

SceneOverride parseOverride(const std::string& text) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0)
        throw Error(
            ErrorKind::Usage,
            fmt::format("--set {}: expected KEY.PATH=VALUE, such as film.resolution=[128,128]", text));
    return {text.substr(0, equals), text.substr(equals + 1)};
}

Scene loadScene(const std::string& path, const std::vector<SceneOverride>& overrides,
                std::string* composed) {
    if (isModel(path)) {
        const Stopwatch reading;
        GltfFiles gltf;
        ImportedModel model = importModel(gltf, path);
        SceneFiles files(std::filesystem::path(path).parent_path().string());
        files.note(path);
        Scene scene = parse(model.scene, path, {}, overrides, composed, std::move(files), std::move(gltf),
                            std::move(model.mesh));
        scene.parse_seconds = reading.seconds();
        return scene;
    }
    const std::string other = otherRendererOf(path);
    if (!other.empty() && std::filesystem::exists(path))
        throw Error(ErrorKind::Scene,
                    fmt::format("{}: error: this is a scene of {}; {}", path, other, importHint(path)),
                    {path});
    if (const std::string format = unreadFormatOf(path); !format.empty() && std::filesystem::exists(path))
        throw Error(ErrorKind::Scene,
                    fmt::format("{}: error: this is a file of {}, and crt reads .yaml, {}; export it as "
                                ".glb or .obj",
                                path, format, kModelEnds),
                    {path});
    const std::string text = readSceneText(path);
    SceneFiles files(std::filesystem::path(path).parent_path().string());
    if (path != kStandardInput) files.note(path);
    const std::string file = path == kStandardInput ? std::string() : path;
    Scene scene = parse(text, nameOf(path), file, overrides, composed, std::move(files));
    if (scene.files_read.empty()) scene.input_bytes = text.size();
    return scene;
}

Scene parseScene(const std::string& yaml, const std::string& name, const std::string& directory,
                 const std::vector<SceneOverride>& overrides, std::string* composed) {
    return parse(yaml, name, {}, overrides, composed, SceneFiles(directory));
}

}  // namespace crt
