// Group G, the part about surfaces that are rougher in one direction than in the other: they lose no light,
// and the tangent places their highlights.
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"
#include "verify/shapes.h"

#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

namespace crt::verify {
namespace {

void furnace(Context& context) {
    // Its tangent is the axis x, turned away from the view.
    const auto floor = [](double degrees, double turn, const std::string& metal, double roughness,
                          double anisotropy) {
        return Stage(eyeAt({std::sin(degrees * kDegree), std::cos(degrees * kDegree), 0}, "[0, 0, 1]"))
            .material("it", fmt::format("{{type: rough_conductor, {}, roughness: {:g}, "
                                        "roughness_anisotropy: {:g}, anisotropy_rotation_deg: {:g}}}",
                                        metal, roughness, anisotropy, turn))
            .quad("it", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "it")
            .set("environment", "{radiance: 1}")
            .yaml();
    };
    const auto view = [](double degrees, double turn) {
        return Vec3d{std::sin(degrees * kDegree) * std::cos(turn * kDegree),
                     -std::sin(degrees * kDegree) * std::sin(turn * kDegree), std::cos(degrees * kDegree)};
    };
    const Render how{.samples = 1u << 12};
    for (const auto& [roughness, anisotropy] :
         {std::pair{0.3, 0.9}, std::pair{1.0, 0.5}, std::pair{1.0, 0.9}})
        for (const double degrees : {0.0, 60.0, 85.0})
            for (const double turn : {0.0, 50.0, 90.0}) {
                if (degrees == 0 && turn != 0) continue;
                const std::string what =
                    fmt::format("roughness {}, anisotropy {}, seen from {}°, {}° from the tangent",
                                roughness, anisotropy, degrees, turn);
                context.relative(
                    fmt::format("perfect metal, {}", what),
                    radiance(context.render(floor(degrees, turn, "eta: 1, k: 1e6", roughness, anisotropy),
                                            how)),
                    1, 2e-3);
            }
    // The absorption of metals depends on the losses of their microfacets, at every azimuth.
    for (const double turn : {0.0, 90.0}) {
        const double wide = 0.8, narrow = 0.75;
        const Vec3d along = view(70, turn), across = view(70, 90 - turn);
        context.relative(
            fmt::format("n = 0.2, k = 3, roughness {}, anisotropy {}, {}° from the tangent", wide, narrow,
                        turn),
            radiance(context.render(floor(70, turn, "eta: 0.2, k: 3", wide, narrow), how)),
            brushedAlbedo(along, 0.2, 3, wide, narrow), 2e-3,
            {{brushedAlbedo(across, 0.2, 3, wide, narrow), "along and across are exchanged"},
             {roughConductorAlbedo(along[2], 0.2, 3, wide), "the surface is isotropic"}});
    }
    if (!context.atLeast(Level::Merge)) return;
    // Clear glass cannot be seen.
    Stage stage("{position: [0.2, 3, 4], target: [0.5, 0.5, 0.5], fov: 12}",
                "{max_depth: 400, roulette: false}");
    stage.set("environment", "{radiance: 1}")
        .set("film", "{resolution: [8, 8]}")
        .material("it", "{type: rough_dielectric, ior: 1.5, roughness: 0.6, roughness_anisotropy: 0.8, "
                        "anisotropy_rotation_deg: 30}")
        .box("cube", {0, 0, 0}, {1, 1, 1}, "it");
    context.estimate("brushed glass, a cube", stage.yaml(), meanRadiance, 1, 3e-3,
                     {.samples = 64, .most = 16384});
}

/// An object that passes through the origin, by its keys, and where its tangent should be there.
struct Sheet {
    const char* what;
    std::string object;
    Vec3d normal, tangent;
};

std::string meshOf(const char* positions) {
    return fmt::format("mesh: {{positions: {}, faces: [[0,1,2,3]]}}", positions);
}

/// A shape of radius 1 whose place q lies at the origin.
std::string shapeAt(const char* shape, const Vec3d& q) {
    return fmt::format("{}, transform: [{{translate: {}}}]", shape, point(q * -1));
}

void highlight(Context& context) {
    const double r = std::sqrt(0.5);
    const Vec3d ball = unit({0.5, 0.3, 0.6}), round{0.6, 0.8, 0};
    const Sheet sheets[] = {
        {"a floor", meshOf("[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]"), {0, 1, 0}, {1, 0, 0}},
        {"a wall that faces x", meshOf("[[0,-2,-2],[0,2,-2],[0,2,2],[0,-2,2]]"), {1, 0, 0}, {0, 0, -1}},
        {"a slope", meshOf("[[-2,2,-2],[-2,-2,2],[2,-2,2],[2,2,-2]]"), {0, r, r}, {1, 0, 0}},
        // u grows with x and z, v as well: where it stays, z falls by half of what x grows.
        {"a floor with coordinates",
         meshOf("[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]], uvs: [[-4,-6],[-2,2],[4,6],[2,-2]]"),
         {0, 1, 0},
         unit({2, 0, -1})},
        {"a floor with mirrored coordinates",
         meshOf("[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]], uvs: [[-2,2],[2,2],[2,-2],[-2,-2]]"),
         {0, 1, 0},
         {0, 0, 1}},
        {"a floor with the same coordinates everywhere",
         meshOf("[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]], uvs: [[1,1],[1,1],[1,1],[1,1]]"),
         {0, 1, 0},
         {1, 0, 0}},
        // On shapes u goes around the axis z, and on a disk along its x.
        {"a ball", shapeAt("sphere: {radius: 1}", ball), ball, unit({-ball[1], ball[0], 0})},
        {"a cylinder",
         shapeAt("cylinder: {radius: 1, from_z: -1, to_z: 1}", round),
         round,
         {-round[1], round[0], 0}},
        {"a disk that faces x",
         "disk: {radius: 1}, transform: [{rotate: {axis: [0, 1, 0], angle_deg: 90}}, "
         "{translate: [0, 0.3, 0.2]}]",
         {1, 0, 0},
         {0, 0, -1}},
    };
    const double roughness = 0.5, anisotropy = 0.7;
    const double along = 0.25 * std::sqrt(2 / 1.09), across = 0.3 * along;
    // In the frame of tangent, bitangent and normal.
    struct Beam {
        Vec3d light;
        double expected, turned;
    };
    const Vec3d view = unit({0.2, 0.3, 1});
    std::vector<Beam> beams;
    for (const double azimuth : {20.0, 75.0, 150.0}) {
        const Vec3d m = unit({0.7 * along * std::cos(azimuth * kDegree),
                              0.7 * across * std::sin(azimuth * kDegree), 1});
        const Vec3d light = m * (2 * dot(m, view)) - view;
        const auto quarter = [](const Vec3d& v) { return Vec3d{-v[1], v[0], v[2]}; };
        beams.push_back({light, brushedReflection(view, light, roughness, anisotropy),
                         brushedReflection(quarter(view), quarter(light), roughness, anisotropy)});
    }
    for (const Sheet& sheet : sheets)
        for (const double turn : {0.0, 30.0}) {
            const Vec3d bitangent = cross(sheet.normal, sheet.tangent);
            const Vec3d x = sheet.tangent * std::cos(turn * kDegree) + bitangent * std::sin(turn * kDegree);
            const Vec3d y = cross(sheet.normal, x);
            const auto place = [&](const Vec3d& v) { return x * v[0] + y * v[1] + sheet.normal * v[2]; };
            double worst = 0, of_worst = 1, turned = 0;
            for (const Beam& beam : beams) {
                const double measured = radiance(context.render(
                    Stage(eyeAt(place(view), "[0.6, 0.3, 0.1]"))
                        .material("it",
                                  fmt::format("{{type: rough_conductor, eta: 1, k: 1e6, roughness: {:g}, "
                                              "roughness_anisotropy: {:g}, anisotropy_rotation_deg: {:g}}}",
                                              roughness, anisotropy, turn))
                        .object(sheet.object + ", material: it")
                        .set("lights", fmt::format("[{{type: directional, direction: {}, irradiance: 1}}]",
                                                   point(place(beam.light) * -1)))
                        .yaml(),
                    {.samples = 16}));
                if (std::abs(measured / beam.expected - 1) < worst) continue;
                worst = std::abs(measured / beam.expected - 1);
                of_worst = measured / beam.expected;
                turned = beam.turned / beam.expected;
            }
            context.relative(fmt::format("{}, turned by {}°: the worst of three beams", sheet.what, turn),
                             of_worst, 1, 2e-3, {{turned, "along and across are exchanged"}});
        }
}

}  // namespace

std::vector<Case> anisotropyCases() {
    constexpr std::uint64_t metal = CRT_FEATURE_ANISOTROPY | CRT_FEATURE_ROUGH_CONDUCTOR;
    return {
        row("G30", "anisotropic-furnace",
            "Brushed metal at 0°, 60° and 85° and three azimuths in a constant environment; from "
            "level merge on a cube of brushed glass",
            "1 for perfect metal and for glass; else quadrature over the normals, what is lost given back",
            "conservation of energy; Heitz (2014); Kulla and Conty (2017)", "± 0.2 %, ± 0.3 %",
            Level::Commit, CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_ROUGH_DIELECTRIC | metal, furnace),
        row("G31", "anisotropic-highlight",
            "Six sheets of brushed metal, with and without texture coordinates, a ball, a cylinder and a "
            "disk, lit by a beam from three directions about the highlight",
            "D G₂ / (4 cos θ_o), about the tangent that docs/scene.md names", "Heitz (2014); OpenPBR 1.1",
            "± 0.2 %", Level::Commit,
            CRT_FEATURE_POINT_LIGHT | CRT_FEATURE_NEE | CRT_FEATURE_SHAPES | metal,
            highlight),
    };
}

}  // namespace crt::verify
