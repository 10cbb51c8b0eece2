#include "compile/point_lights.h"

#include "base/error.h"
#include "base/vec3d.h"
#include "scene/light_units.h"

#include <fmt/format.h>

#include <algorithm>
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

double greatestOf(const IesProfile& profile) {
    return *std::max_element(profile.candela.begin(), profile.candela.end());
}

std::vector<float> radians(const std::vector<double>& degrees) {
    std::vector<float> all;
    for (const double angle : degrees) all.push_back(static_cast<float>(angle * (std::numbers::pi / 180)));
    return all;
}

kernel::CrtLightForm formOf(const PointLight& light, const FlatScene& flat, BlobWriter& blob) {
    kernel::CrtLightForm form{};
    // Seen from where the light comes from, horizontal angles go counter-clockwise.
    const Vec3d along = cross(light.across, light.direction);
    for (std::size_t k = 0; k < 3; ++k) {
        form.u[k] = static_cast<float>(light.across[k]);
        form.v[k] = static_cast<float>(along[k]);
    }
    if (light.type == PointLightType::Ies) {
        form.vertical = blob.append(radians(light.ies->vertical_deg));
        form.horizontal = blob.append(radians(light.ies->horizontal_deg));
        std::vector<float> shares;
        for (const double candela : light.ies->candela)
            shares.push_back(static_cast<float>(candela / greatestOf(*light.ies)));
        form.shares = blob.append(shares);
        return form;
    }
    const bool disk = light.radius > 0;
    form.half_u =
        static_cast<float>(std::ldexp(disk ? light.radius : light.width / 2, flat.scale_exponent));
    form.half_v =
        static_cast<float>(std::ldexp(disk ? light.radius : light.height / 2, flat.scale_exponent));
    constexpr float kMost = 1e15f;  // Its square is a float.
    constexpr float kLeast = 1e-15f;
    for (const float half : {form.half_u, form.half_v})
        if (!(half > kLeast && half < kMost)) refuse(light, half < kMost ? "too narrow" : "too wide");
    return form;
}

}  // namespace

std::vector<const PointLight*> shiningPointLights(const Scene& scene) {
    std::vector<const PointLight*> shining;
    if (!measuresLight(scene.integrator.type)) return shining;
    for (const bool suns : {true, false})
        for (const PointLight& light : scene.point_lights)
            if ((light.type == PointLightType::Sun) == suns && light.strength * light.spectrum.max() > 0)
                shining.push_back(&light);
    return shining;
}

kernel::u32 kindOf(const PointLight& light) {
    switch (light.type) {
        case PointLightType::Point: return CRT_LIGHT_POINT;
        case PointLightType::Spot: return CRT_LIGHT_SPOT;
        case PointLightType::Directional: return CRT_LIGHT_DIRECTIONAL;
        case PointLightType::Ies: return CRT_LIGHT_IES;
        case PointLightType::Beam: return light.radius > 0 ? CRT_LIGHT_DISK_BEAM : CRT_LIGHT_SLIT_BEAM;
        case PointLightType::Sun: break;
    }
    return CRT_LIGHT_SUN;
}

kernel::CrtPointLight compilePointLight(const PointLight& light, const FlatScene& flat) {
    kernel::CrtPointLight own{};
    // A distance here is 2^exponent of one in the scene: intensity over its square is to stay what it is.
    const double strength =
        shinesFromPoint(light.type) ? std::ldexp(light.strength, 2 * flat.scale_exponent) : light.strength;
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

void appendForms(const Scene& scene, const FlatScene& flat, BlobWriter& blob,
                 std::vector<kernel::CrtPointLight>& compiled) {
    const std::vector<const PointLight*> lights = shiningPointLights(scene);
    for (std::size_t i = 0; i < lights.size(); ++i)
        if (lights[i]->type == PointLightType::Ies || lights[i]->type == PointLightType::Beam)
            compiled[i].form =
                blob.append(std::vector<kernel::CrtLightForm>{formOf(*lights[i], flat, blob)});
}

double powerOf(const PointLight& light, const kernel::CrtPointLight& compiled, double around,
               int scale_exponent) {
    const double strength = compiled.strength;
    switch (light.type) {
        case PointLightType::Point: return 4 * strength;
        case PointLightType::Spot:
            return strength * spotSolidAngle_sr(light.cone_angle_deg, light.penumbra_deg) / std::numbers::pi;
        case PointLightType::Ies:
            return strength * luminousFlux_lm(*light.ies) / greatestOf(*light.ies) / std::numbers::pi;
        case PointLightType::Beam:
            return std::ldexp(strength * (light.radius > 0 ? light.radius * light.radius
                                                           : light.width * light.height / std::numbers::pi),
                              2 * scale_exponent);
        // Through the sphere's section, a quarter of its area.
        case PointLightType::Directional: return strength * around / (4 * std::numbers::pi);
        case PointLightType::Sun: break;
    }
    return strength * sunProjectedSolidAngle_sr(light.angular_diameter_deg) * around /
           (4 * std::numbers::pi);
}

}  // namespace crt
