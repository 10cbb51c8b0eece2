#include "scene_limits.h"

#include "error.h"
#include "log.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace crt {
namespace {

/// A light, and how to speak of it.
struct Light {
    double radiance;  ///< At its brightest wavelength.
    std::string name;
    SourcePlace place;
};

/// All that shine, those of a mesh (Ke of its MTL) once for each object that has it.
std::vector<Light> lightsOf(const Scene& scene) {
    std::vector<Light> lights;
    const auto add = [&](double radiance, std::string name, const SourcePlace& place) {
        if (radiance > 0) lights.push_back({radiance, std::move(name), place});
    };
    for (const Object& object : scene.objects) {
        if (object.emission >= 0)
            add(scene.emissions[static_cast<std::size_t>(object.emission)].radiance.max(), fmt::format("'{}'", object.name), object.place);
        std::vector<bool> seen(scene.emissions.size(), false);
        for (const std::int32_t emission : scene.meshes[object.mesh].emission) {
            if (emission < 0 || seen[static_cast<std::size_t>(emission)]) continue;
            seen[static_cast<std::size_t>(emission)] = true;
            add(scene.emissions[static_cast<std::size_t>(emission)].radiance.max(), fmt::format("a material (Ke) of '{}'", object.name), object.place);
        }
    }
    if (scene.environment) add(scene.environment->radiance.max(), "the environment", {scene.file});
    return lights;
}

std::string at(const SourcePlace& place) {
    return place.line > 0 ? fmt::format("{}:{}:{}", place.file, place.line, place.column) : place.file;
}

[[noreturn]] void refuse(const Light& light, const std::string& sentence) {
    throw Error(ErrorKind::Scene, fmt::format("{}: error: {}; multiply all lights by one factor, and the image by its inverse", at(light.place), sentence),
                light.place);
}

}  // namespace

void checkRadiance(const Scene& scene) {
    const std::vector<Light> lights = lightsOf(scene);
    if (lights.empty()) return;
    const auto [dimmest, brightest] = std::minmax_element(lights.begin(), lights.end(), [](const Light& a, const Light& b) { return a.radiance < b.radiance; });
    if (!(brightest->radiance <= kMostRadiance))
        refuse(*brightest, fmt::format("the radiance of {} reaches {:g}, and single precision carries light up to {:g}", brightest->name,
                                       brightest->radiance, kMostRadiance));
    if (brightest->radiance < kLeastRadiance)
        refuse(*brightest, fmt::format("{} is the brightest light, of radiance {:g}, and single precision carries light from {:g}", brightest->name,
                                       brightest->radiance, kLeastRadiance));
    if (dimmest->radiance < static_cast<double>(std::numeric_limits<float>::min()))
        logWarning("{}: {} has a radiance of {:g}, below single precision: it does not shine", at(dimmest->place), dimmest->name, dimmest->radiance);
}

}  // namespace crt
