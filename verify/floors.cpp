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

/// The material `it` in light 1 from everywhere, and an eye on the origin at an angle to +y.
Stage seenInSky(const std::string& material, double degrees) {
    Stage stage(eyeAt({std::sin(degrees * kDegree), std::cos(degrees * kDegree), 0}, "[0, 0, 1]"));
    stage.material("it", material).set("environment", "{radiance: 1}");
    return stage;
}

}  // namespace

std::string floorOf(const std::string& material, double degrees) {
    return seenInSky(material, degrees).quad("it", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "it").yaml();
}

std::string checkeredSquare(const std::string& material, double height, double half_side) {
    return fmt::format(
        "mesh: {{positions: [[-{1},{0},-{1}],[-{1},{0},{1}],[{1},{0},{1}],[{1},{0},-{1}]], uvs: "
        "[[-1.5,-1.5],[-1.5,2.5],[2.5,2.5],[2.5,-1.5]], faces: [[0,1,2,3]]}}, material: {2}",
        height, half_side, material);
}

std::string checkeredFloor(const std::string& material, double degrees) {
    return seenInSky(material, degrees).object(checkeredSquare("it", 0, 2)).yaml();
}

double inBeam(Context& context, const std::string& material, const Vec3d& view, const Vec3d& light) {
    const auto seen = [&](const std::string& of) {
        return radiance(context.render(floorInBeam(of, view, light), {.samples = 16}));
    };
    return seen(material) / seen("{type: diffuse, reflectance: 1}") * light[2] / std::numbers::pi;
}

}  // namespace crt::verify
