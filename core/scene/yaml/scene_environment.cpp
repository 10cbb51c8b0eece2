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

bool readSky(const SectionReader& section, SpectrumReader& spectra, Environment& environment) {
    CieSky sky;
    const std::size_t errors = section.diagnostics().count();
    section.read("type", sky.type);
    if (section.read("rows", sky.rows) && sky.rows % 2 != 0)
        section.error("rows", "the horizon lies between two rows, so their number is even");
    environment.radiance = illuminantSpectrum("D65").value();
    if (std::optional<Spectrum> spectrum = spectra.read(section, "spectrum", SpectrumUse::Emission))
        environment.radiance = *std::move(spectrum);
    const std::optional<Vec3d> sun = readTowardsSun(section, 0);
    Vec3d up{0, 1, 0};
    if (!sun || !readUp(section, up) || section.diagnostics().count() != errors) return false;
    sky.towards_sun = *sun;
    if (!(dot(*sun, up) > 0)) {
        section.error("direction", "the sun of this sky is below the horizon");
        return false;
    }
    sky.axes = axesAround(up, 0);
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

}  // namespace

std::optional<Environment> readEnvironment(const SectionReader& section, SpectrumReader& spectra,
                                           SceneFiles& files) {
    Environment environment;
    environment.light_sampling = true;
    if (section.has("image")) {
        if (!readImage(section, files, environment)) return std::nullopt;
    } else if (section.has("sky")) {
        const std::optional<SectionReader> sky = section.section("sky", "the sky");
        if (!readSky(*sky, spectra, environment)) return std::nullopt;
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
