#include "scene/scene_limits.h"

#include "base/error.h"
#include "base/log.h"
#include "base/unit_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

namespace crt {
namespace {

/// A light, and its name in messages.
struct Light {
    double radiance;  ///< At its brightest wavelength; intensity or irradiance where it has no surface.
    std::string name;
    SourcePlace place;
    const char* quantity = "radiance";
};

/// All that shine, those of a mesh (Ke of its MTL) once for each object that has it.
std::vector<Light> lightsOf(const Scene& scene) {
    std::vector<Light> lights;
    const auto add = [&](double radiance, std::string name, const SourcePlace& place) {
        if (radiance > 0) lights.push_back({radiance, std::move(name), place});
    };
    std::map<std::uint32_t, std::set<std::int32_t>> emissions_of;  // By mesh, which many objects may share.
    for (const Object& object : scene.objects) {
        if (object.emission >= 0)
            add(scene.emissions[static_cast<std::size_t>(object.emission)].radiance.max(),
                fmt::format("'{}'", object.name), object.place);
        const std::vector<std::int32_t>& by_triangle = scene.meshes[object.mesh].emission;
        const auto [known, first] = emissions_of.try_emplace(object.mesh);
        if (first) known->second.insert(by_triangle.begin(), by_triangle.end());
        for (const std::int32_t emission : known->second) {
            if (emission < 0) continue;
            add(scene.emissions[static_cast<std::size_t>(emission)].radiance.max(),
                fmt::format("a material (Ke) of '{}'", object.name), object.place);
        }
    }
    for (const Material& material : scene.materials)
        if (material.emission >= 0)
            add(scene.emissions[static_cast<std::size_t>(material.emission)].radiance.max(),
                fmt::format("material '{}'", material.name), material.place);
    for (const PointLight& light : scene.point_lights)
        if (const double brightest = light.strength * light.spectrum.max(); brightest > 0)
            lights.push_back({brightest, fmt::format("'{}'", light.name), light.place,
                              light.type == PointLightType::Sun           ? "radiance"
                              : light.type == PointLightType::Directional ||
                                      light.type == PointLightType::Beam
                                  ? "irradiance"
                                                                          : "radiant intensity"});
    if (scene.environment) add(scene.environment->radiance.max(), "the environment", {scene.file});
    return lights;
}

[[noreturn]] void refuse(const Light& light, const std::string& sentence) {
    throw Error(ErrorKind::Scene,
                fmt::format("{}: error: {}; multiply all lights by one factor, and the image by its inverse",
                            light.place.text(), sentence),
                light.place);
}

}  // namespace

ExpansionLimit::ExpansionLimit(std::uint64_t input_bytes) : bytes_(1'500'000'000 + 50 * input_bytes) {
    const char* const text = std::getenv("CRT_SCENE_MEMORY");
    if (text == nullptr || *text == '\0') return;
    double size = 0;
    const std::string_view all(text);
    const auto [end, problem] = std::from_chars(all.data(), all.data() + all.size(), size);
    const std::string_view unit = all.substr(static_cast<std::size_t>(end - all.data()));
    const double factor = unit == "MB" ? 1e6 : unit == "GB" ? 1e9 : unit == "TB" ? 1e12 : 0;
    if (problem != std::errc() || !(size > 0) || factor == 0 || size * factor > 1e18)
        throw Error(ErrorKind::Usage,
                    fmt::format("CRT_SCENE_MEMORY is '{}'; expected a size such as 20GB", all));
    bytes_ = static_cast<std::uint64_t>(size * factor);
}

std::string ExpansionLimit::refusal(std::uint64_t count, const std::string& things,
                                    std::uint64_t bytes_each) const {
    const double needed = static_cast<double>(count) * static_cast<double>(bytes_each);
    if (needed <= static_cast<double>(bytes_)) return {};
    return fmt::format(
        "expanded, the scene has {} {}, which need {} of memory, and the limit for its files is {}; set "
        "CRT_SCENE_MEMORY={}GB to allow it",
        count, things, bytesText(needed), bytesText(static_cast<double>(bytes_)), std::ceil(needed / 1e9));
}

void checkRadiance(const Scene& scene) {
    const std::vector<Light> lights = lightsOf(scene);
    if (lights.empty()) return;
    const auto [dimmest, brightest] =
        std::minmax_element(lights.begin(), lights.end(),
                            [](const Light& a, const Light& b) { return a.radiance < b.radiance; });
    if (!(brightest->radiance <= kMostRadiance))
        refuse(*brightest,
               fmt::format("the {} of {} reaches {:g}, and the largest value in single precision is {:g}",
                           brightest->quantity, brightest->name, brightest->radiance, kMostRadiance));
    if (brightest->radiance < kLeastRadiance)
        refuse(
            *brightest,
            fmt::format(
                "the brightest light is {}, with a {} of {:g}, and the smallest value in single precision "
                "is {:g}",
                brightest->name, brightest->quantity, brightest->radiance, kLeastRadiance));
    if (dimmest->radiance < static_cast<double>(std::numeric_limits<float>::min()))
        logWarning("{}: {} has a {} of {:g}, too small for single precision: it does not shine",
                   dimmest->place.text(), dimmest->name, dimmest->quantity, dimmest->radiance);
}

}  // namespace crt
