#include "scene/yaml/scene_environment.h"

#include "base/vec3d.h"
#include "scene/light_units.h"
#include "scene/scene_limits.h"
#include "scene/yaml/scene_sun.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <utility>

namespace crt {
namespace {

/// Around `up`: ahead is -z, or y where z is up, turned counter-clockwise.
Axes axesAround(const Vec3d& up, double rotation_deg) {
    constexpr double kUpright = 0.9;
    const Vec3d towards = std::abs(up[2]) < kUpright ? Vec3d{0, 0, -1} : Vec3d{0, 1, 0};
    const Vec3d flat = towards - up * dot(towards, up);
    const Vec3d ahead = flat * (1 / length(flat)), right = cross(ahead, up);
    const double angle = rotation_deg * (std::numbers::pi / 180), c = std::cos(angle), s = std::sin(angle);
    return {right * c + ahead * s, up, ahead * c + right * -s};
}

bool readUp(const SectionReader& section, Vec3d& up) {
    if (!section.read("up", up)) return true;
    const std::optional<Vec3d> unit = unitVector(up);
    if (!unit) {
        section.error("up", "a direction cannot have length 0");
        return false;
    }
    up = *unit;
    return true;
}

bool readImage(const SectionReader& section, SceneFiles& files, Environment& environment) {
    EnvironmentImage image;
    std::string name;
    double rotation_deg = 0;
    Vec3d up{0, 1, 0};
    section.read("scale", image.scale);
    section.read("rotation_deg", rotation_deg);
    if (!readUp(section, up) || !section.read("image", name)) return false;
    const std::optional<std::string> path =
        files.locateBeside(name, section.place("image"), section.diagnostics());
    if (!path) return false;
    files.note(*path);
    image.file = *path;
    image.axes = axesAround(up, rotation_deg);
    image.place = section.place("image").resolved();
    environment.radiance = illuminantSpectrum("D65").value();
    environment.image = std::move(image);
    return true;
}

/// The keys that both kinds of sky have. False, with an error, when they are wrong.
template <class Sky>
bool readSunAndRows(const SectionReader& section, Sky& sky) {
    const std::size_t errors = section.diagnostics().count();
    if (section.read("rows", sky.rows) && sky.rows % 2 != 0)
        section.error("rows", "the horizon lies between two rows, so their number is even");
    const std::optional<Vec3d> sun = readTowardsSun(section, 0);
    Vec3d up{0, 1, 0};
    if (!sun || !readUp(section, up) || section.diagnostics().count() != errors) return false;
    sky.towards_sun = *sun;
    sky.axes = axesAround(up, 0);
    if (dot(*sun, up) > 0) return true;
    section.error("direction", "the sun of this sky is below the horizon");
    return false;
}

bool readSky(const SectionReader& section, SpectrumReader& spectra, Environment& environment) {
    CieSky sky;
    const std::size_t errors = section.diagnostics().count();
    section.read("type", sky.type);
    environment.radiance = illuminantSpectrum("D65").value();
    if (std::optional<Spectrum> spectrum = spectra.read(section, "spectrum", SpectrumUse::Emission))
        environment.radiance = *std::move(spectrum);
    if (!readSunAndRows(section, sky) || section.diagnostics().count() != errors) return false;
    const double unit = photometric(environment.radiance);
    double amount = 0;
    sky.horizontal = section.read("horizontal_illuminance_lx", amount);
    if (!sky.horizontal && !section.read("zenith_luminance_cd_m2", amount)) return false;
    if (!(unit > 0)) {
        section.error("spectrum", "this spectrum has no visible light");
        return false;
    }
    sky.amount = amount / unit;
    if (const double brightest = sky.amount * environment.radiance.max(); brightest > kMostRadiance)
        section.error(sky.horizontal ? "horizontal_illuminance_lx" : "zenith_luminance_cd_m2",
                      fmt::format("the radiance of this sky reaches {:g}, and radiance goes up to {:g}",
                                  brightest, kMostRadiance));
    environment.sky = sky;
    return true;
}

/// The sun of a clear sky, as disks on each other that darken it towards its limb.
void addSun(const SectionReader& section, const ClearSky& sky, const ClearSkyModel& model,
            std::vector<PointLight>& lights) {
    constexpr std::size_t kDisks = 8;
    double scale = 1, diameter_deg = kSkySunDiameter_deg;
    section.read("sun_scale", scale);
    section.read("sun_diameter_deg", diameter_deg);
    // A sun of another size has the same irradiance.
    scale *= sunProjectedSolidAngle_sr(kSkySunDiameter_deg) / sunProjectedSolidAngle_sr(diameter_deg);
    for (const SunDisk& disk : model.sunDisks(kDisks)) {
        PointLight light;
        light.name = fmt::format("the sun of the clear sky, disk {}", lights.size() + 1);
        light.type = PointLightType::Sun;
        light.place = section.place().resolved();
        light.direction = sky.towards_sun * -1;
        light.spectrum = skySpectrum(disk.radiance);
        light.strength = scale;
        light.angular_diameter_deg = diameter_deg * disk.diameter;
        if (const double brightest = scale * light.spectrum.max(); brightest > kMostRadiance)
            section.error("sun_scale",
                          fmt::format("the radiance of this sun reaches {:g}, and radiance goes "
                                      "up to {:g}",
                                      brightest, kMostRadiance));
        if (scale * light.spectrum.max() > 0) lights.push_back(std::move(light));
    }
}

bool readClearSky(const SectionReader& section, SpectrumReader& spectra, Environment& environment,
                  std::vector<PointLight>& lights) {
    ClearSky sky;
    const std::size_t errors = section.diagnostics().count();
    section.read("turbidity", sky.turbidity);
    section.read("scale", sky.scale);
    Spectrum ground = constantSpectrum(kUsualGroundAlbedo);
    if (std::optional<Spectrum> albedo = spectra.read(section, "ground_albedo", SpectrumUse::Reflectance))
        ground = *std::move(albedo);
    sky.ground_albedo = skyValues(ground);
    if (!readSunAndRows(section, sky) || section.diagnostics().count() != errors) return false;
    const ClearSkyModel model = sky.model();
    SkyValues mean = model.horizontalIrradiance();
    for (double& value : mean) value *= sky.scale / std::numbers::pi;
    environment.radiance = skySpectrum(mean);
    if (sky.scale > 0) environment.clear_sky = sky;
    addSun(section, sky, model, lights);
    return section.diagnostics().count() == errors;
}

}  // namespace

std::optional<Environment> readEnvironment(const SectionReader& section, SpectrumReader& spectra,
                                           SceneFiles& files, std::vector<PointLight>& lights) {
    Environment environment;
    environment.light_sampling = true;
    if (section.has("image")) {
        if (!readImage(section, files, environment)) return std::nullopt;
    } else if (section.has("sky")) {
        const std::optional<SectionReader> sky = section.section("sky", "the sky");
        if (!readSky(*sky, spectra, environment)) return std::nullopt;
    } else if (section.has("clear_sky")) {
        const std::optional<SectionReader> sky = section.section("clear_sky", "the clear sky");
        if (!readClearSky(*sky, spectra, environment, lights)) return std::nullopt;
    } else {
        std::optional<Spectrum> radiance = spectra.read(section, "radiance", SpectrumUse::Emission);
        if (!radiance) return std::nullopt;
        environment.radiance = *std::move(radiance);
        environment.light_sampling = Environment{}.light_sampling;
    }
    section.read("light_sampling", environment.light_sampling);
    return environment;
}

}  // namespace crt
