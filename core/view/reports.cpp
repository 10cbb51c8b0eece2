#include "view/reports.h"

#include "backend/loader.h"
#include "base/error.h"
#include "base/temporary_folder.h"
#include "film/checkpoint.h"
#include "film/error_estimate.h"
#include "image/image_io.h"
#include "render/outputs.h"
#include "scene/aov.h"
#include "spectra/spectra.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <fstream>
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
              {"preview", snapshot.divisor > 1},
              {"samples", film.counts[pixel]},
              {"rgb", multiply(xyzToRgb(ColorSpace::LinearSrgb), xyz)},
              {"xyz", xyz}};
    const double variance = LuminanceVariance(film)(i, j);
    if (std::isfinite(variance)) json["luminance_error"] = std::sqrt(variance);
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

std::string exrOf(const Snapshot& snapshot) {
    if (snapshot.divisor > 1)
        throw Error(ErrorKind::Usage, "the picture is still a small one: in a moment it is whole");
    Scene scene = *snapshot.seen->read;
    scene.camera = snapshot.seen->camera;
    const Film& film = *snapshot.film;
    constexpr double kNobodyTraces = std::numeric_limits<double>::infinity();
    const std::uint32_t aovs = film.shape().aovs & kAovsOfFirstHits;
    FilmIdentity identity{.scene_hash = compileScene(scene, aovs, {.accelerator_reach = kNobodyTraces}).hash,
                          .version = CRT_VERSION,
                          .record = recordOf(scene)};
    identity.record->paths = snapshot.seen->paths;
    identity.record->complete = snapshot.complete;
    identity.record->date_utc = dateUtc();
    const TemporaryFolder folder;
    const std::string path = folder / "image.exr";
    writeOutput({.file = path, .format = OutputFormat::Exr, .aovs = aovs | kAovError, .place = {}}, film,
                identity);
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
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
