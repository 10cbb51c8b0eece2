#include "scene/missing_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

namespace crt {
namespace {

/// Ways in which surfaces send light on in single directions alone.
struct SingleDirections {
    bool glass = false, panes = false, metal = false, coats = false;
    bool bodies = false;    ///< Glass, smooth or rough, behind which one looks through two surfaces.
    bool scatters = false;  ///< Something else reflects light to all sides.
};

/// Below it a rough surface is taken for smooth: √CRT_ALPHA_MIN of kernel/materials/microfacet.h.
constexpr double kSmooth = 0.0316;

bool isSmooth(const Material& material) {
    return !material.hasVaryingRoughness() && material.roughness < kSmooth;
}

bool isSmooth(const Clearcoat& coat) {
    return coat.roughness_texture == kNoTexture && coat.roughness < kSmooth;
}

void note(const Scene& scene, std::int32_t index, SingleDirections& found) {
    const Material& material = scene.materials[static_cast<std::size_t>(index)];
    switch (material.type) {
        case MaterialType::Mix:
        case MaterialType::TwoSided:
            for (const std::int32_t part : material.parts) note(scene, part, found);
            return;
        case MaterialType::Dielectric: found.glass = found.bodies = true; break;
        case MaterialType::RoughDielectric:
            found.bodies = true;
            (isSmooth(material) ? found.glass : found.scatters) = true;
            break;
        case MaterialType::ThinDielectric: found.panes = true; break;
        case MaterialType::RoughConductor: (isSmooth(material) ? found.metal : found.scatters) = true; break;
        case MaterialType::Plastic:
            found.scatters = true;
            if (isSmooth(material) && material.eta.max() != 1) found.coats = true;
            break;
        default: (scattersLobe(material.type) ? found.scatters : found.metal) = true;
    }
    if (material.clearcoat) (isSmooth(*material.clearcoat) ? found.coats : found.scatters) = true;
}

SingleDirections singleDirectionsOf(const Scene& scene) {
    std::vector<bool> used(scene.materials.size());
    const auto mark = [&used](std::int32_t material) {
        if (material >= 0) used[static_cast<std::size_t>(material)] = true;
    };
    for (const Object& object : scene.objects) {
        const Mesh& mesh = scene.meshes[object.mesh];
        if (mesh.material.empty() || object.shape) mark(object.material);
        for (const std::int32_t material : mesh.material) mark(material);
    }
    SingleDirections found;
    for (std::size_t i = 0; i < used.size(); ++i)
        if (used[i]) note(scene, static_cast<std::int32_t>(i), found);
    return found;
}

/// "point, spot and ies".
std::string kindsOf(const std::vector<const PointLight*>& lights) {
    std::vector<std::string> kinds;
    for (const auto& [type, name] : kPointLightNames)
        if (std::any_of(lights.begin(), lights.end(),
                        [type = type](const PointLight* light) { return light->type == type; }))
            kinds.emplace_back(name);
    std::string text = kinds.front();
    for (std::size_t i = 1; i < kinds.size(); ++i)
        text += (i + 1 < kinds.size() ? ", " : " and ") + kinds[i];
    return text;
}

}  // namespace

std::vector<const PointLight*> lightsWithoutSize(const Scene& scene) {
    std::vector<const PointLight*> lights;
    for (const PointLight& light : scene.point_lights)
        if (light.type != PointLightType::Sun && light.strength > 0 && light.spectrum.max() > 0)
            lights.push_back(&light);
    return lights;
}

std::vector<std::string> missingLight(const Scene& scene) {
    std::vector<std::string> missing;
    // With a depth of 0 the scene shows no illuminated surfaces.
    if (!measuresLight(scene.integrator.type) || scene.integrator.max_depth == 0) return missing;
    const SingleDirections found = singleDirectionsOf(scene);
    if (const std::vector<const PointLight*> lights = lightsWithoutSize(scene); !lights.empty()) {
        const std::string of = fmt::format("light of {} lights", kindsOf(lights));
        for (const auto& [there, way] : {std::pair{found.glass, "smooth glass refracts or reflects"},
                                         {found.panes, "panes reflect"},
                                         {found.metal, "mirrors and smooth metals reflect"},
                                         {found.coats, "smooth coats reflect"}})
            if (there) missing.push_back(fmt::format("{} that {}", of, way));
    }
    // Into a body, out of it, and a scattering behind it.
    if (found.bodies && found.scatters && scene.integrator.max_depth < 3)
        missing.push_back(
            fmt::format("reflections by surfaces behind a glass body, for which 'max_depth: {}' is too "
                        "small",
                        scene.integrator.max_depth));
    return missing;
}

std::string missingLightText(const std::vector<std::string>& missing, const Scene& scene) {
    const char* remedy = lightsWithoutSize(scene).empty()
                             ? "raise 'max_depth'"
                             : "use an emitting sphere or disk instead of such a light, or a 'sun'";
    return fmt::format(
        "the image lacks {}: more samples do not add it, and the stated error does not include it; {}",
        fmt::join(missing, "; "), remedy);
}

}  // namespace crt
