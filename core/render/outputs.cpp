#include "render/outputs.h"

#include "base/atomic_file.h"
#include "base/log.h"
#include "film/auto_exposure.h"
#include "film/checkpoint.h"
#include "film/resolve.h"
#include "image/image_io.h"
#include "image/image_metadata.h"
#include "scene/light_units.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <utility>

namespace crt {

std::uint32_t requestedAovs(const Scene& scene) {
    std::uint32_t aovs = 0;
    for (const Output& output : scene.outputs) aovs |= output.aovs;
    return aovs;
}

OutputPlan planOutputs(const std::vector<std::string>& files, const Scene& scene) {
    OutputPlan plan;
    std::vector<std::string> names = files;
    if (names.empty() && scene.outputs.empty()) {
        const std::string stem = std::filesystem::path(scene.file).stem().string();
        names = {stem + ".exr", stem + ".png"};
    }
    if (names.empty()) {
        plan.images = scene.outputs;
        for (const Output& output : scene.outputs) names.push_back(output.file);
    } else {
        for (const std::string& file : names) {
            if (std::filesystem::path(file).extension() == kCheckpointExtension) {
                plan.films.push_back(file);
            } else if (const auto format = file == "-" ? OutputFormat::Ppm : formatOfFile(file)) {
                const std::uint32_t aovs = *format == OutputFormat::Exr ? requestedAovs(scene) : 0;
                plan.images.push_back({.file = file, .format = *format, .aovs = aovs, .place = {}});
            } else {
                throw Error(ErrorKind::Usage,
                            fmt::format("the name of the output '{}' does not end in {}, nor in .crtfilm",
                                        file, kImageEnds));
            }
        }
    }
    plan.first = names.front();
    for (const std::string& film : plan.films)
        if (isStandardOutput(film))
            throw Error(ErrorKind::Usage,
                        fmt::format("'{}': a film must be written to a file, because crt reads it again",
                                    film));
    if (std::count_if(names.begin(), names.end(), isStandardOutput) > 1)
        throw Error(ErrorKind::Usage, "only one output can go to standard output");
    std::set<std::string> seen;
    for (const std::string& name : names)
        if (!seen.insert(std::filesystem::path(name).lexically_normal().string()).second)
            throw Error(ErrorKind::Usage, fmt::format("two outputs have the same name '{}'", name));
    return plan;
}

std::string besideOutput(const std::string& output, const char* suffix) {
    if (isStandardOutput(output)) return std::string("stdout") + suffix;
    return std::filesystem::path(output).replace_extension().string() + suffix;
}

std::vector<std::string> denoisedNames(const std::vector<std::string>& images) {
    std::vector<std::string> names;
    for (const std::string& image : images) {
        const std::filesystem::path path(image);
        const std::string end = path.extension().string();
        if (isStandardOutput(image) || (end != ".png" && end != ".exr")) continue;
        names.push_back((path.parent_path() / (path.stem().string() + ".denoised" + end)).string());
    }
    if (names.empty())
        throw Error(ErrorKind::Usage, "--denoise writes beside .png and .exr files, and there is none");
    return names;
}

Image developedImage(const Output& output, const Film& film, const FilmIdentity& identity) {
    if (!identity.record) throw Error(ErrorKind::Internal, "a film without a record cannot be developed");
    const FilmRecord& record = *identity.record;
    const Development& wanted = record.development;
    const bool floats = output.format == OutputFormat::Exr || output.format == OutputFormat::Pfm;
    const Development applied = floats ? wanted.forFloats() : wanted;
    const bool spectral = output.format == OutputFormat::Exr;
    Image image =
        resolveImage(film, applied, output.aovs, spectral ? record.spectral : SpectralChannels{});

    const auto add = [&image](const char* key, std::string value) {
        if (!value.empty()) image.metadata.emplace_back(key, std::move(value));
    };
    add("Software", "crt " CRT_VERSION);
    add("crt/version", identity.version);  // Of the samples; Software is the writer of this file.
    add("crt/sceneHash", identity.scene_hash);
    add("crt/seed", std::to_string(record.seed));
    if (record.complete) add("crt/complete", *record.complete ? "1" : "0");
    add("crt/missingLight", fmt::format("{}", fmt::join(record.missing_light, "; ")));
    add("ImageDescription", record.title);
    add("crt/backend", record.backend);
    add("crt/device", record.device);
    add("DateTime", record.date_utc);  // capDate in EXR, tIME in PNG.
    if (!record.date_utc.empty()) add("utcOffset", "0");
    if (!(applied == wanted)) {
        add(kDisplayExposureKey, fmt::format("{}", wanted.exposure_ev));
        add(kDisplayWhiteBalanceKey, whiteBalanceText(wanted));
    }

    // In all three spaces (1, 1, 1) has Y = 1, and what a white balance makes white keeps its luminance.
    if (record.holdsRadiance())
        image.white_luminance_cd_m2 = luminanceOfUnitY_cd_m2() / std::exp2(applied.exposure_ev);

    const auto& [x0, y0, x1, y1] = record.window;
    if (record.isCropped())
        add("crt/crop", fmt::format("{},{},{},{} of {}x{}", x0, y0, x1, y1, record.width, record.height));
    image.left = x0;
    image.top = y0;
    image.whole_width = static_cast<std::uint32_t>(record.width);
    image.whole_height = static_cast<std::uint32_t>(record.height);
    image.world_to_camera = record.world_to_camera;
    image.world_to_ndc = record.world_to_ndc;
    if (wanted.white && !applied.white) {
        const Vec3d& white = *wanted.white;
        const double sum = white[0] + white[1] + white[2];
        image.adopted_neutral = {white[0] / sum, white[1] / sum};
    }
    return image;
}

void exposeAutomatically(const Film& film, FilmRecord& record) {
    if (!record.holdsRadiance())
        throw Error(ErrorKind::Usage, "--expose auto needs integrator.type path: the other types do not "
                                      "show light");
    const std::optional<double> exposure_ev = autoExposure_ev(film);
    if (!exposure_ev) return;  // A black film has its own warning.
    record.development.exposure_ev = *exposure_ev;
    logInfo("exposed automatically; --set film.exposure_ev={:g} gives the same picture", *exposure_ev);
}

void requireRecord(const std::string& path, const FilmIdentity& identity) {
    if (!identity.record)
        throw Error(ErrorKind::Usage, fmt::format("'{}' was written by an earlier crt, whose films lack "
                                                  "development settings; name its scene: "
                                                  "crt merge --scene SCENE -o IMAGE {}",
                                                  path, path));
}

void writeOutput(const Output& output, const Film& film, const FilmIdentity& identity) {
    writeImage(output.file, output.format, developedImage(output, film, identity));
}

}  // namespace crt
