#include "verify/floors.h"

#include "verify/references.h"
#include "verify/scenes.h"
#include "verify/shapes.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace crt::verify {
namespace {

std::string floorInBeam(const std::string& material, const Vec3d& view, const Vec3d& light) {
    return Stage(eyeAt({view[1], view[2], view[0]}, "[0.6, 0.3, 0.1]"))
        .material("it", material)
        .quad("it", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "it")
        .set("lights", fmt::format("[{{type: directional, direction: {}, irradiance: 1}}]",
                                   point({-light[1], -light[2], -light[0]})))
        .yaml();
}

}  // namespace

std::string floorOf(const std::string& material, double degrees) {
    return Stage(eyeAt({std::sin(degrees * kDegree), std::cos(degrees * kDegree), 0}, "[0, 0, 1]"))
        .material("it", material)
        .quad("it", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "it")
        .set("environment", "{radiance: 1}")
        .yaml();
}

double inBeam(Context& context, const std::string& material, const Vec3d& view, const Vec3d& light) {
    const auto seen = [&](const std::string& of) {
        return radiance(context.render(floorInBeam(of, view, light), {.samples = 16}));
    };
    return seen(material) / seen("{type: diffuse, reflectance: 1}") * light[2] / std::numbers::pi;
}

}  // namespace crt::verify
