#include "compile/point_lights.h"

#include "base/error.h"
#include "base/vec3d.h"
#include "scene/light_units.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace crt {
namespace {

bool isAtInfinity(PointLightType type) {
    return type == PointLightType::Directional || type == PointLightType::Sun;
}

[[noreturn]] void refuse(const PointLight& light, const char* why) {
    throw Error(ErrorKind::Scene, fmt::format("the light '{}' is {} for single precision", light.name, why),
                light.place);
}

}  // namespace

std::vector<const PointLight*> shiningPointLights(const Scene& scene) {
    std::vector<const PointLight*> shining;
    if (scene.integrator.type != IntegratorType::Path) return shining;
    for (const bool suns : {true, false})
        for (const PointLight& light : scene.point_lights)
            if ((light.type == PointLightType::Sun) == suns && light.strength * light.spectrum.max() > 0)
                shining.push_back(&light);
    return shining;
}

kernel::u32 kindOf(PointLightType type) {
    switch (type) {
        case PointLightType::Point: return CRT_LIGHT_POINT;
        case PointLightType::Spot: return CRT_LIGHT_SPOT;
        case PointLightType::Directional: return CRT_LIGHT_DIRECTIONAL;
        case PointLightType::Sun: break;
    }
    return CRT_LIGHT_SUN;
}

kernel::CrtPointLight compilePointLight(const PointLight& light, const FlatScene& flat) {
    kernel::CrtPointLight own{};
    // A distance here is 2^exponent of one in the scene: intensity over its square is to stay what it is.
    const double strength =
        isAtInfinity(light.type) ? light.strength : std::ldexp(light.strength, 2 * flat.scale_exponent);
    own.strength = static_cast<float>(strength);
    const double brightest = strength * light.spectrum.max();
    if (!std::isfinite(own.strength) || !(brightest < std::numeric_limits<float>::max()))
        refuse(light, "too bright");
    if (own.strength < std::numeric_limits<float>::min()) refuse(light, "too dim");
    for (std::size_t k = 0; k < 3; ++k) {
        own.direction[k] = static_cast<float>(light.direction[k]);
        if (isAtInfinity(light.type)) continue;
        own.position[k] =
            static_cast<float>(std::ldexp(light.position[k] - flat.centre[k], flat.scale_exponent));
        constexpr float kMostDistance = 1e15f;  // Its square, and that of what is added to it, are floats.
        if (!(std::abs(own.position[k]) < kMostDistance)) refuse(light, "too far from the scene");
    }
    if (light.type == PointLightType::Sun)
        own.cone = static_cast<float>(oneMinusCos(light.angular_diameter_deg / 2));
    if (light.type == PointLightType::Spot) {
        const double cone = oneMinusCos(light.cone_angle_deg),
                     bright = oneMinusCos(light.cone_angle_deg - light.penumbra_deg);
        constexpr double kSharp = 1e30;
        own.cone = static_cast<float>(cone);
        own.inverse_penumbra =
            static_cast<float>(cone > bright ? std::min(1 / (cone - bright), kSharp) : kSharp);
    }
    return own;
}

double powerOf(const PointLight& light, const kernel::CrtPointLight& compiled, double around) {
    const double strength = compiled.strength;
    switch (light.type) {
        case PointLightType::Point: return 4 * strength;
        case PointLightType::Spot:
            return strength * spotSolidAngle_sr(light.cone_angle_deg, light.penumbra_deg) / std::numbers::pi;
        // Through the sphere's section, a quarter of its area.
        case PointLightType::Directional: return strength * around / (4 * std::numbers::pi);
        case PointLightType::Sun: break;
    }
    return strength * sunProjectedSolidAngle_sr(light.angular_diameter_deg) * around /
           (4 * std::numbers::pi);
}

}  // namespace crt
