#include "base/atomic_file.h"
#include "base/log.h"
#include "base/unit_text.h"
#include "cli/arguments.h"
#include "cli/commands.h"
#include "cli/shared_options.h"
#include "film/checkpoint.h"
#include "film/error_estimate.h"
#include "film/error_text.h"
#include "render/light_checks.h"
#include "render/output_guard.h"
#include "render/outputs.h"
#include "scene/yaml/scene_schema.h"
#include "scene/yaml/yaml_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace crt {
namespace {

/// Images of films, with other exposure, white balance, colour space or crop window than the scene's, and
/// without a backend or the scene. Films of disjoint samples are added up first.
struct DevelopArguments {
    std::vector<std::string> films;
    std::vector<std::string> outputs;
    std::vector<SceneOverride> changes;  ///< Keys of `film` that no sample depends on; others are refused.
    std::optional<std::array<int, 4>> crop;  ///< Of the whole film; x0, y0, x1, y1, half open.
    bool expose_automatically = false;       ///< By the film, instead of the scene's exposure.
    std::vector<std::string> aovs;           ///< Of EXR files; empty: those of the scene. "none": none.
};

constexpr std::array<const char*, 6> kDevelopmentKeys{
    "film.exposure_ev", "film.white_balance", "film.color_space",
    "film.crop",        "film.apply_to_float", "film.view"};

bool isSceneKey(std::string_view path) {
    const std::string_view first = path.substr(0, path.find('.'));
    const KeySchema* key = schemaSection("").find(first);
    if (key == nullptr) return false;
    if (key->shape != ValueShape::One || key->kind != ValueKind::Section || first.size() == path.size())
        return true;
    const std::string_view rest = path.substr(first.size() + 1);
    return schemaSection(key->section).find(rest.substr(0, rest.find('.'))) != nullptr;
}

/// Refuses what the samples of a film have decided already, and what is no key at all.
void requireDevelopmentKey(const std::string& path) {
    if (std::find(kDevelopmentKeys.begin(), kDevelopmentKeys.end(), path) != kDevelopmentKeys.end()) return;
    const std::string offer = fmt::format("crt develop changes {}", fmt::join(kDevelopmentKeys, ", "));
    if (isSceneKey(path))
        throw Error(
            ErrorKind::Usage,
            fmt::format(
                "--set {}: changing '{}' needs a new render ('crt render'), because the samples depend on "
                "it; {}",
                path, path, offer));
    const std::vector<std::string> keys(kDevelopmentKeys.begin(), kDevelopmentKeys.end());
    const bool short_form = std::find(keys.begin(), keys.end(), "film." + path) != keys.end();
    const std::string hint =
        short_form ? fmt::format("did you mean 'film.{}'?", path) : didYouMean(path, keys);
    throw Error(ErrorKind::Usage,
                fmt::format("--set {}: there is no key '{}'; {}", path, path, hint.empty() ? offer : hint));
}

/// The name in `film.white_balance=lamp`; empty for other forms of a spectrum.
std::string nameIn(std::string value) {
    const auto strip = [&value](const char* characters) {
        const std::size_t first = value.find_first_not_of(characters),
                          last = value.find_last_not_of(characters);
        value = first == std::string::npos ? "" : value.substr(first, last - first + 1);
    };
    strip(" \t");
    strip("'\"");
    const bool plain = value.find_first_of("{}[]:,# ") == std::string::npos;
    return plain && value != "null" && !looksLikeNumber(value) ? value : std::string();
}

/// The white that a name says: a light of the film's scene, or an illuminant (nothing: let the reader find
/// it).
std::optional<Vec3d> namedWhite(const FilmRecord& record, const std::string& name) {
    if (const auto found = record.whites.find(name); found != record.whites.end()) return found->second;
    if (name.empty() || illuminantSpectrum(name)) return std::nullopt;
    std::vector<std::string> known = illuminantNames();
    for (const auto& [light, white] : record.whites) known.push_back(light);
    const std::string hint = didYouMean(name, known);
    throw Error(ErrorKind::Usage,
                fmt::format("--set film.white_balance: the film contains no light '{}'; {}", name,
                            hint.empty() ? fmt::format("it knows {}", fmt::join(known, ", ")) : hint));
}

void setWindow(FilmRecord& record, const std::array<int, 4>& window) {
    const auto& [x0, y0, x1, y1] = window;
    const auto& [left, top, right, bottom] = record.window;
    if (x0 < left || y0 < top || x1 > right || y1 > bottom || x0 >= x1 || y0 >= y1)
        throw Error(
            ErrorKind::Usage,
            fmt::format(
                "the crop window {},{},{},{} is not a rectangle within {},{},{},{}, the part of {} × {} "
                "pixels that the film holds",
                x0, y0, x1, y1, left, top, right, bottom, record.width, record.height));
    record.window = window;
}

/// Changes the record as the scene's `film` section would be. The scene's own reader reads the values.
void applyChanges(FilmRecord& record, const DevelopArguments& arguments) {
    std::vector<SceneOverride> to_read;
    std::optional<Vec3d> white;
    for (const SceneOverride& change : arguments.changes) {
        if (change.path != "film.white_balance") {
            to_read.push_back(change);
            continue;
        }
        white = namedWhite(record, nameIn(change.value));
        std::erase_if(to_read,
                      [](const SceneOverride& earlier) { return earlier.path == "film.white_balance"; });
        if (!white) to_read.push_back(change);
    }
    const std::string film =
        fmt::format("crt: 1\nfilm: {{resolution: [{}, {}]}}\n", record.width, record.height);
    const Scene scene = parseScene(film, arguments.films.front(), ".", to_read);
    const Development read = developmentOf(scene);
    Development& development = record.development;
    for (const SceneOverride& change : to_read) {
        if (change.path == "film.exposure_ev") development.exposure_ev = read.exposure_ev;
        if (change.path == "film.white_balance") development.white = read.white;
        if (change.path == "film.color_space") development.color_space = read.color_space;
        if (change.path == "film.apply_to_float") development.apply_to_float = read.apply_to_float;
        if (change.path == "film.view") development.view = read.view;
        if (change.path == "film.crop" && scene.film.crop[2] > 0) setWindow(record, scene.film.crop);
    }
    if (white) development.white = white;
    if (arguments.crop) setWindow(record, *arguments.crop);
}

/// The bits of --aovs.
std::uint32_t aovsNamed(const std::vector<std::string>& names) {
    if (names == std::vector<std::string>{"none"}) return 0;
    std::uint32_t aovs = 0;
    for (const std::string& name : names) {
        const std::uint32_t bit = aovNamed(name);
        if (bit == 0) {
            const std::string hint = didYouMean(name, aovNames());
            throw Error(
                ErrorKind::Usage,
                fmt::format("--aovs: there is no AOV '{}'; {}", name,
                            hint.empty() ? fmt::format("there are {}", fmt::join(aovNames(), ", ")) : hint));
        }
        aovs |= bit;
    }
    return aovs;
}

/// Refusals that are possible before the films, which may be large, are read.
OutputPlan planDevelopment(const DevelopArguments& arguments) {
    OutputPlan plan = planOutputs(arguments.outputs, Scene{});
    if (!plan.films.empty())
        throw Error(ErrorKind::Usage,
                    fmt::format("'{}': crt develop makes images; 'crt merge' adds films to one",
                                plan.films.front()));
    const bool has_exr = std::any_of(plan.images.begin(), plan.images.end(),
                                     [](const Output& o) { return o.format == OutputFormat::Exr; });
    if (!arguments.aovs.empty() && !has_exr)
        throw Error(ErrorKind::Usage,
                    "--aovs: only .exr files can hold AOVs, and no output is one");
    for (const SceneOverride& change : arguments.changes) requireDevelopmentKey(change.path);
    const std::uint32_t aovs = aovsNamed(arguments.aovs);
    for (Output& image : plan.images)
        if (image.format == OutputFormat::Exr) image.aovs = aovs;
    std::vector<std::string> images;
    for (const Output& image : plan.images) images.push_back(image.file);
    refuseOverInputs(arguments.films, images);
    for (const std::string& image : images) checkWritable(image);
    return plan;
}

int develop(const DevelopArguments& arguments) {
    OutputPlan plan = planDevelopment(arguments);
    auto [film, identity] = mergeCheckpoints(arguments.films);
    requireRecord(arguments.films.front(), identity);
    FilmRecord& record = *identity.record;
    const std::array<int, 4> held = record.window;
    applyChanges(record, arguments);
    if (record.window != held)
        film = cropped(film, {record.window[0] - held[0], record.window[1] - held[1],
                              record.window[2] - held[0], record.window[3] - held[1]});
    if (arguments.expose_automatically) exposeAutomatically(film, record);

    for (Output& image : plan.images) {
        if (image.format == OutputFormat::Exr && arguments.aovs.empty()) image.aovs = record.aovs;
        writeOutput(image, film, identity);
    }
    if (film.samples.count() > 0 && isBlack(film))
        logWarning("the image is black: no path met a light while the film was rendered");
    const std::optional<ErrorEstimate> error =
        estimateError(film, PixelSet::All, record.paths);
    logInfo("{} × {} pixels, {} samples per pixel{}", film.shape().width, film.shape().height,
            film.samples.count(), error ? ", " + errorText(*error, !record.missing_light.empty()) : "");
    logInfo("wrote {}", fmt::join(arguments.outputs, ", "));
    return 0;
}

constexpr const char* kDevelopNotes =
            "\nA film (.crtfilm, from -o or --checkpoint) holds every sample's sum, so exposure, white "
            "balance, colour space and crop can be\n"
            "chosen after the render. No backend is opened and no scene is read. PNG and PPM get exposure "
            "and white balance; EXR and PFM\n"
            "hold the radiance of the scene unless film.apply_to_float is true. Several films of disjoint "
            "samples are added up, as by merge.\n"
            "\nKeys of --set:\n"
            "  film.exposure_ev=1.5                 stops\n"
            "  film.white_balance=lamp              a named light of the scene, an illuminant (A, D50, D65, "
            "F2, F7, F11),\n"
            "                                       a spectrum such as {blackbody: 3200}, or null for none\n"
            "  film.color_space=acescg              srgb, acescg or xyz\n"
            "  film.view=agx                        none, filmic or agx: brighter than white in PNG, JPEG "
            "and PPM\n"
            "  film.crop=[0,0,256,256]              the same as --crop 0,0,256,256\n"
            "  film.apply_to_float=true             exposure and white balance in EXR and PFM too\n"
            "\nExamples:\n"
            "  crt scene.yaml -o scene.crtfilm                                       render once\n"
            "  crt develop scene.crtfilm -o a.png --set film.exposure_ev=1           one stop brighter\n"
            "  crt develop scene.crtfilm -o a.png --expose auto                      "
            "exposed automatically\n"
            "  crt develop scene.crtfilm -o b.png --set film.white_balance=D50\n"
            "  crt develop scene.crtfilm -o c.exr -o c.png --crop 100,50,300,250\n"
            "  crt develop scene.crtfilm -o d.exr --aovs albedo,normal,error,samples\n"
            "  crt develop a.crtfilm b.crtfilm -o both.exr                           "
            "two halves of the samples\n";

}  // namespace

Command developCommand() {
    const auto to = std::make_shared<DevelopArguments>();
    return {
        .name = "develop",
        .summary = "make images from a film, with a new exposure, white balance, colour space or crop",
        .arguments = {{.name = "FILM",
                       .help = "films (.crtfilm) of one scene",
                       .read = [to](const std::string& text) { to->films.push_back(text); },
                       .completion = completeFilm(),
                       .repeatable = true}},
        .groups = {{"Options",
                    {{.names = "-o,--output",
                      .placeholder = "FILE",
                      .help = ".exr .png .jpg .ppm or .pfm; -.png for a pipe; repeatable",
                      .read = [to](const std::string& text) { to->outputs.push_back(text); },
                      .completion = completeImage(),
                      .repeatable = true,
                      .required = true},
                     {.names = "--set",
                      .placeholder = "KEY=VALUE",
                      .help = "change a development setting, e.g. film.exposure_ev=1; repeatable",
                      .read = [to](const std::string& text) { to->changes.push_back(parseOverride(text)); },
                      .completion = completeSetting({"film"}),
                      .repeatable = true},
                     exposeOption(to->expose_automatically),
                     {.names = "--crop",
                      .placeholder = "X0,Y0,X1,Y1",
                      .help = "only these pixels of the film, X1 and Y1 excluded",
                      .read = [to](const std::string& text) { to->crop = parseRectangle(text, "--crop"); }},
                     {.names = "--aovs",
                      .placeholder = "A,B",
                      .help = "AOVs to write to .exr files (default: those of the scene), or none",
                      .read = [to](const std::string& text) { to->aovs = parseList(text, "--aovs"); }},
                     quietOption("only warnings and errors")}}},
        .notes = kDevelopNotes,
        .run = [to](const std::string&) { return develop(*to); }};
}

}  // namespace crt
