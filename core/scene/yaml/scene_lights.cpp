#include "scene/yaml/scene_lights.h"

#include "base/vec3d.h"
#include "scene/light_units.h"
#include "scene/yaml/scene_sun.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

namespace crt {
namespace {

void readDirection(const SectionReader& section, PointLight& light) {
    Vec3d way{};
    std::string_view key = "direction";
    bool given = section.read("direction", way);
    if (!given && section.schema().find("target") != nullptr && section.read("target", way)) {
        way = way - light.position;
        key = "target";
        given = true;
    }
    if (!given) return;
    if (const std::optional<Vec3d> unit = unitVector(way))
        light.direction = *unit;
    else
        section.error(key, key == "direction" ? "a direction cannot have length 0"
                                              : "the target is where the light is, or too far away");
}

void readCone(const SectionReader& section, PointLight& light) {
    section.read("cone_angle_deg", light.cone_angle_deg);
    const bool given = section.read("penumbra_deg", light.penumbra_deg);
    if (light.penumbra_deg <= light.cone_angle_deg) return;
    if (given)
        section.error("penumbra_deg", fmt::format("a penumbra of {} degrees is wider than the cone of {}",
                                                  light.penumbra_deg, light.cone_angle_deg));
    light.penumbra_deg = light.cone_angle_deg;
}

/// The part of `wanted` across the direction: where an IES lamp's horizontal angle 0 is, or a slit's height.
std::optional<Vec3d> acrossDirection(const Vec3d& wanted, const Vec3d& direction) {
    constexpr double kParallel = 1e-6;  // Sine of the angle below which what is left is rounding.
    const std::optional<Vec3d> unit = unitVector(wanted);
    if (!unit) return std::nullopt;
    const Vec3d across = *unit - direction * dot(*unit, direction);
    return dot(across, across) > kParallel * kParallel ? unitVector(across) : std::nullopt;
}

/// Of the key, or the first of two defaults that is not along the direction.
Vec3d readAcross(const SectionReader& section, std::string_view key, const Vec3d& usual,
                 const Vec3d& direction) {
    Vec3d wanted{};
    if (section.read(key, wanted)) {
        if (const std::optional<Vec3d> across = acrossDirection(wanted, direction)) return *across;
        section.error(key, fmt::format("'{}' has no part across the direction of the light", key));
    }
    const std::optional<Vec3d> across = acrossDirection(usual, direction);
    return across ? *across : *acrossDirection({0, 0, 1}, direction);
}

void readIes(const SectionReader& section, SceneFiles& files, PointLight& light) {
    readDirection(section, light);
    light.across = readAcross(section, "c0", {1, 0, 0}, light.direction);
    // Something to go on with, where the file is wrong.
    light.ies = std::make_shared<IesProfile>(IesProfile{{0, 180}, {0}, {1, 1}});
    std::string name;
    if (!section.read("file", name)) return;
    const std::optional<std::string> path = files.locate(name, section.place("file"), section.diagnostics());
    if (!path) return;
    files.note(*path);
    try {
        auto profile = std::make_shared<IesProfile>(readPhotometricFile(*path));
        if (luminousFlux_lm(*profile) > 0)
            light.ies = std::move(profile);
        else
            section.error("file", fmt::format("'{}' has no light in any direction", name));
    } catch (const Error& error) {
        if (error.kind() == ErrorKind::Internal) throw;
        section.error("file", sentenceWithPlace(error));
    }
}

void readBeam(const SectionReader& section, PointLight& light) {
    readDirection(section, light);
    std::vector<double> size;
    if (section.read("size", size)) {
        light.radius = 0;
        light.width = size[0];
        light.height = size[1];
    } else {
        section.read("radius", light.radius);
    }
    if (section.has("up") && light.radius > 0)
        section.error("up", "a disk has no height; 'up' needs a slit, which has a 'size'");
    light.across = cross(light.direction, readAcross(section, "up", {0, 1, 0}, light.direction));
}

double beamArea(const PointLight& light) {
    return light.radius > 0 ? std::numbers::pi * light.radius * light.radius : light.width * light.height;
}

/// An IES lamp's brightness is that of its file, but for what the scene says.
void readIesBrightness(const SectionReader& section, PointLight& light) {
    const double lumens = photometric(light.spectrum);
    if (!(lumens > 0))
        return section.error(section.has("spectrum") ? "spectrum" : "file",
                             "this spectrum has no visible light, which candelas measure");
    double scale = 1, amount = 0;
    section.read("scale", scale);
    const double flux_lm = luminousFlux_lm(*light.ies);
    if (section.read("luminous_flux_lm", amount)) scale = amount / flux_lm;
    if (section.read("power_w", amount))
        scale = amount * lumens / (integralOverWavelengths(light.spectrum) * flux_lm);
    light.strength =
        scale * *std::max_element(light.ies->candela.begin(), light.ies->candela.end()) / lumens;
}

/// Quantities of a light's amounts: `flux_sr` is radiant flux over radiant intensity.
double unitOf(const PointLight& light, std::string_view key) {
    const double flux_sr = light.type == PointLightType::Spot
                               ? spotSolidAngle_sr(light.cone_angle_deg, light.penumbra_deg)
                               : 4 * std::numbers::pi;
    if (light.type == PointLightType::Beam)
        return (key == "power_w" ? integralOverWavelengths(light.spectrum) : photometric(light.spectrum)) *
               (key == "illuminance_lx" ? 1 : beamArea(light));
    if (key == "power_w") return flux_sr * integralOverWavelengths(light.spectrum);
    if (key == "luminous_flux_lm") return flux_sr * photometric(light.spectrum);
    if (key == "luminous_intensity_cd" || light.type == PointLightType::Directional)
        return photometric(light.spectrum);
    return photometric(light.spectrum) * sunProjectedSolidAngle_sr(light.angular_diameter_deg);
}

/// Spectrum and strength, by whichever key says how bright the light is.
void readBrightness(const SectionReader& section, SpectrumReader& spectra, PointLight& light) {
    light.spectrum = illuminantSpectrum("D65").value();
    for (const char* key : {"radiant_intensity", "irradiance", "radiance"})
        if (section.schema().find(key) != nullptr)
            if (std::optional<Spectrum> spectrum = spectra.read(section, key, SpectrumUse::Emission)) {
                light.spectrum = *std::move(spectrum);
                return;
            }
    const std::size_t errors = section.diagnostics().count();
    if (std::optional<Spectrum> spectrum = spectra.read(section, "spectrum", SpectrumUse::Emission))
        light.spectrum = *std::move(spectrum);
    if (section.diagnostics().count() != errors) return;
    if (light.type == PointLightType::Ies) return readIesBrightness(section, light);
    for (const char* key : {"power_w", "luminous_flux_lm", "luminous_intensity_cd", "illuminance_lx"}) {
        double amount = 0;
        if (section.schema().find(key) == nullptr || !section.read(key, amount)) continue;
        const double unit = unitOf(light, key);
        if (!(unit > 0))
            section.error(section.has("spectrum") ? "spectrum" : key,
                          fmt::format("this spectrum has no light that '{}' measures", key));
        else
            light.strength = amount / unit;
    }
}

/// True if the light is specified by an amount that spreads over square metres, such as lumens.
bool spreadsOverArea(const SectionReader& section, const PointLight& light) {
    const bool is_beam = light.type == PointLightType::Beam;
    return shinesFromPoint(light.type) ||
           (is_beam && (section.has("power_w") || section.has("luminous_flux_lm")));
}

/// Distances stay in the scene's units: what a square metre gets is given to the square of as many units.
void countInUnits(const SectionReader& section, const Scene& scene, PointLight& light) {
    const double metres = scene.metres_per_unit.value_or(1);
    if (metres != 1 && spreadsOverArea(section, light)) light.strength /= metres * metres;
}

/// Light that nothing finds would be missing from the image without a word.
void checkFound(const SectionReader& section, const PointLight& light,
                const IntegratorSettings& integrator) {
    if (integrator.nee || integrator.type != IntegratorType::Path || light.type == PointLightType::Sun)
        return;
    section.diagnostics().error(
        section.place(),
        fmt::format("only light sampling finds {}, and 'integrator.nee' is false", section.subject()),
        "set 'integrator.nee: true', or use an emitting surface");
}

}  // namespace

void readLights(const YamlNode& list, Diagnostics& out, SceneFiles& files, SpectrumReader& spectra,
                Scene& scene) {
    for (std::size_t i = 0; i < list.items.size(); ++i) {
        const YamlNode& node = *list.items[i];
        const YamlEntry* name = node.find("name");
        const std::string subject = name != nullptr && name->value->kind == YamlKind::Scalar
                                        ? fmt::format("light '{}'", name->value->text)
                                        : fmt::format("light {}", i);
        const std::optional<SectionReader> section = openVariant(out, node, node.place, "light", subject);
        if (!section) continue;
        PointLight light;
        light.place = node.place.resolved();
        light.name = fmt::format("light {}", i);
        section->read("name", light.name);
        const std::string kind = variantWord(section->schema());
        for (const auto& [type, word] : kPointLightNames)
            if (kind == word) light.type = type;
        if (section->schema().find("position") != nullptr) section->read("position", light.position);
        if (light.type == PointLightType::Spot || light.type == PointLightType::Directional)
            readDirection(*section, light);
        if (light.type == PointLightType::Spot) readCone(*section, light);
        if (light.type == PointLightType::Ies) readIes(*section, files, light);
        if (light.type == PointLightType::Beam) readBeam(*section, light);
        if (light.type == PointLightType::Sun) {
            section->read("angular_diameter_deg", light.angular_diameter_deg);
            if (const std::optional<Vec3d> sun = readTowardsSun(*section, light.angular_diameter_deg))
                light.direction = *sun * -1;
        }
        readBrightness(*section, spectra, light);
        countInUnits(*section, scene, light);
        checkFound(*section, light, scene.integrator);
        scene.point_lights.push_back(std::move(light));
    }
}

}  // namespace crt
