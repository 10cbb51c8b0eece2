#include "view/reports.h"

#include "backend/loader.h"
#include "base/error.h"
#include "base/temporary_folder.h"
#include "film/checkpoint.h"
#include "film/error_estimate.h"
#include "image/image_io.h"
#include "render/outputs.h"
#include "scene/aov.h"
#include "scene/light_units.h"
#include "spectra/spectra.h"
#include "view/null_listener.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>

namespace crt {
namespace {

using Json = nlohmann::ordered_json;

std::string textOf(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json spectrumJson(const Film& film, const SpectralChannels& channels, std::uint32_t x, std::uint32_t y) {
    Json json;
    const std::uint32_t first = film.shape().firstSpectral();
    for (std::uint32_t bin = 0; bin < channels.bins.count; ++bin) {
        json["wavelengths_nm"].push_back(channels.bins.centre_nm(bin));
        json["radiance"].push_back(film.mean(x, y, first + bin));
    }
    for (std::uint32_t r = 0; r < channels.responses.size(); ++r)
        json["responses"].push_back(
            {{"name", channels.responses[r]}, {"value", film.mean(x, y, first + channels.bins.count + r)}});
    return json;
}

}  // namespace

std::string pixelJson(const Snapshot& snapshot, std::uint32_t x, std::uint32_t y) {
    const SeenScene& seen = *snapshot.seen;
    if (x >= seen.width || y >= seen.height)
        throw Error(ErrorKind::Usage, fmt::format("pixel {},{} lies outside the film of {} × {}", x, y,
                                                  seen.width, seen.height));
    const Film& film = *snapshot.film;
    const std::uint32_t i = std::min(x / snapshot.divisor, film.shape().width - 1);
    const std::uint32_t j = std::min(y / snapshot.divisor, film.shape().height - 1);
    const std::size_t pixel = std::size_t{j} * film.shape().width + i;
    const Vec3d xyz{film.mean(i, j, 0), film.mean(i, j, 1), film.mean(i, j, 2)};
    Json json{{"x", x},
              {"y", y},
              {"run", snapshot.run},
              {"preview", snapshot.divisor > 1},
              {"samples", film.counts[pixel]},
              {"rgb", multiply(xyzToRgb(ColorSpace::LinearSrgb), xyz)},
              {"xyz", xyz},
              {"unit", "W·m⁻²·sr⁻¹·nm⁻¹"},
              {"luminance_cd_m2", luminanceOfUnitY_cd_m2() * xyz[1]}};
    const double variance = LuminanceVariance(film)(i, j);
    if (std::isfinite(variance))
        json["luminance_error_cd_m2"] = luminanceOfUnitY_cd_m2() * std::sqrt(variance);
    if (!film.primitives.empty() && film.primitives[pixel] != CRT_NONE) {
        const PrimitiveName name = seen.names->of(film.primitives[pixel]);
        json["primitive"] = film.primitives[pixel];
        json["object"] = name.object;
        json["material"] = name.material;
    }
    if (const std::uint32_t depth = firstChannel(film.shape().aovs, kAovDepth))
        json["depth"] = film.mean(i, j, depth);
    if (const SpectralChannels channels = spectralChannelsOf(*seen.read); channels.count() > 0)
        json["spectrum"] = spectrumJson(film, channels, i, j);
    return textOf(json);
}

std::optional<double> depthAt(const Snapshot& snapshot, double x, double y) {
    const Film& film = *snapshot.film;
    const std::uint32_t channel = firstChannel(film.shape().aovs, kAovDepth);
    if (channel == 0) return std::nullopt;
    const auto at = [](double part, std::uint32_t pixels) {
        return static_cast<std::uint32_t>(std::clamp(part * pixels, 0.0, pixels - 1.0));
    };
    const double depth = film.mean(at(x, film.shape().width), at(y, film.shape().height), channel);
    return depth > 0 && std::isfinite(depth) ? std::optional(depth) : std::nullopt;
}

namespace {

std::uint32_t savedAovs(const Film& film) { return film.shape().aovs & kAovsOfFirstHits; }

FilmIdentity identityOf(const Snapshot& snapshot) {
    Scene scene = *snapshot.seen->read;
    scene.camera = snapshot.seen->camera;
    constexpr double kNobodyTraces = std::numeric_limits<double>::infinity();
    const std::uint32_t aovs = savedAovs(*snapshot.film);
    FilmIdentity identity{.scene_hash = compileScene(scene, aovs, {.accelerator_reach = kNobodyTraces}).hash,
                          .version = CRT_VERSION,
                          .record = recordOf(scene)};
    identity.record->paths = snapshot.seen->paths;
    identity.record->complete = snapshot.complete;
    identity.record->date_utc = dateUtc();
    return identity;
}

/// The bytes of a file that `write` writes.
std::string bytesFrom(const std::string& name, const std::function<void(const std::string& path)>& write) {
    const TemporaryFolder folder;
    const std::string path = folder / name;
    write(path);
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

void requireWhole(const Snapshot& snapshot) {
    if (snapshot.divisor > 1)
        throw Error(ErrorKind::Usage, "the image is still a small preview: try again in a moment");
}

/// "room_64spp.png"
std::string fileName(const Snapshot& snapshot, const std::string& stem, const std::string& ending) {
    return fmt::format("{}_{}spp{}", stem, snapshot.film->samples.count(), ending);
}

/// A picture of planes as a file has it: with what its colours stand for, as the bar is not in it.
Image imageOf(const Picture& picture) {
    Image image;
    image.width = picture.width;
    image.height = picture.height;
    image.channels = {"R", "G", "B"};
    for (std::size_t i = 0; i < picture.rgba.size(); ++i)
        if (i % 4 != 3) image.pixels.push_back(static_cast<float>(srgbToLinear(picture.rgba[i] / 255.0)));
    image.metadata.emplace_back("crt/shown", picture.plane);
    image.metadata.emplace_back("crt/legend", picture.legend);
    for (const ColourScale& scale : picture.scales)
        image.metadata.emplace_back("crt/scale" + (scale.name.empty() ? "" : "/" + scale.name),
                                    fmt::format("{:.6g} to {:.6g}{}{}", scale.low, scale.high,
                                                scale.unit.empty() ? "" : " " + scale.unit,
                                                scale.logarithmic ? ", logarithmic" : ""));
    return image;
}

}  // namespace

SavedFile exrOf(const Snapshot& snapshot, const std::string& stem) {
    requireWhole(snapshot);
    const std::uint32_t aovs = savedAovs(*snapshot.film) | kAovError;
    const auto write = [&](const std::string& path) {
        writeOutput({.file = path, .format = OutputFormat::Exr, .aovs = aovs, .place = {}}, *snapshot.film,
                    identityOf(snapshot));
    };
    return {fileName(snapshot, stem, ".exr"), bytesFrom("image.exr", write)};
}

SavedFile pngOf(const Snapshot& snapshot, const Display& display, const std::string& stem) {
    requireWhole(snapshot);
    const bool colours = display.plane == "image";
    const auto write = [&](const std::string& path) {
        const NullListener silent;  // About a temporary file.
        if (!colours) return writeImage(path, OutputFormat::Png, imageOf(pictureOf(snapshot, display)));
        FilmIdentity identity = identityOf(snapshot);
        identity.record->development = developmentFor(display, *snapshot.seen->read);
        writeOutput({.file = path, .format = OutputFormat::Png, .aovs = 0, .place = {}}, *snapshot.film,
                    identity);
    };
    return {fileName(snapshot, stem, (colours ? "" : "_" + display.plane) + ".png"),
            bytesFrom("image.png", write)};
}

std::string devicesJson() {
    Json backends = Json::array();
    for (const BackendStatus& status : listBackends()) {
        Json devices = Json::array();
        for (const CrtDevice& device : status.devices)
            devices.push_back({{"index", device.index}, {"name", arrayText(device.name)}});
        backends.push_back({{"name", status.name}, {"reason", status.reason}, {"devices", devices}});
    }
    return textOf(backends);
}

}  // namespace crt
