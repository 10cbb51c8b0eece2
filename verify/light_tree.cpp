// Group E, the part about many lights, which are chosen by a tree.
#include "base/vec3d.h"
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"
#include "verify/shapes.h"

#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace crt::verify {
namespace {

constexpr std::uint64_t kManyLamps =
    CRT_FEATURE_DIFFUSE | CRT_FEATURE_NEE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_LIGHT_TREE;

/// Sixty lamps, twenty points and a directional light over a floor: what each brings, added up.
void manyLights(Context& context) {
    Dice dice(26);
    constexpr double x = 0.2, z = -0.3;
    constexpr const char* kChance = "{max_depth: 1, roulette: false, nee: false}";
    for (const char* const integrator : {kDirect, "{max_depth: 1, roulette: false, mis: false}", kChance}) {
        const bool chance = integrator == kChance;
        std::string points = "{type: directional, direction: [0.3, -1, 0.2], irradiance: 0.5}";
        double sum = 0.5 / std::sqrt(1.13), brightest = 0;
        std::vector<std::pair<std::string, double>> lamps;
        std::vector<std::vector<Vec3d>> quads;
        for (int i = 0; i < 60; ++i) {
            // In a layer, so that none hides another; of all sizes, and turned away a little or wholly.
            const Vec3d at{-1.75 + 0.5 * (i % 8), 1 + 0.001 * i, -1.75 + 0.5 * (i / 8)};
            const double side = chance ? 0.2 : std::pow(10, dice.uniform(-2.5, -0.8));
            const Vec3d a = unit(Vec3d{1, dice.uniform(-0.3, 0.3), 0}) * side,
                        b = unit(Vec3d{0, dice.uniform(-0.3, 0.3), 1}) * side;
            const double power = std::pow(10, dice.uniform(-1, 1)), radiance = power / (side * side);
            const bool up = i % 7 == 0;
            const std::vector<Vec3d> quad = up ? std::vector<Vec3d>{at, at + b, at + a + b, at + a}
                                               : std::vector<Vec3d>{at, at + a, at + a + b, at + b};
            quads.push_back(quad);
            const bool both = i % 14 == 0;
            const double brings =
                up && !both ? 0 : kPi * radiance * polygonFormFactor({x, 0, z}, {0, 1, 0}, quad);
            sum += brings;
            brightest = std::max(brightest, brings);
            lamps.emplace_back(both ? ", two_sided: true" : "", radiance);
        }
        for (int i = 0; i < 20 && !chance; ++i) {
            const Vec3d at{dice.uniform(-2, 2), 0.75 + 0.01 * i, dice.uniform(-2, 2)};
            const double intensity = std::pow(10, dice.uniform(-1, 0.5));
            points += fmt::format(", {{type: point, position: [{}, {}, {}], radiant_intensity: {}}}", at[0],
                                  at[1], at[2], intensity);
            const Vec3d d = at - Vec3d{x, 0, z};
            sum += intensity * d[1] / std::pow(dot(d, d), 1.5);
        }
        if (chance) sum -= 0.5 / std::sqrt(1.13);
        // From below the lamps, so that they do not hide the floor.
        Stage stage(
            fmt::format("{{position: [{}, 0.5, {}], target: [{}, 0, {}], fov: 0.0001}}", x + 0.4, z, x, z),
            integrator);
        if (!chance) stage.set("lights", "[" + points + "]");
        stage.material("white", "{type: diffuse, reflectance: 1}")
            .material("black", "{type: diffuse, reflectance: 0}")
            .quad("floor", "[[-4,0,-4.1],[-4,0,3.9],[4,0,3.9],[4,0,-4.1]]", "white");
        for (std::size_t i = 0; i < quads.size(); ++i) {
            std::string corners;
            for (const Vec3d& v : quads[i])
                corners +=
                    fmt::format("{}[{:.9g}, {:.9g}, {:.9g}]", corners.empty() ? "" : ", ", v[0], v[1], v[2]);
            stage.quad(fmt::format("lamp {}", i), "[" + corners + "]", "black",
                       fmt::format("{:.9g}{}", lamps[i].second, lamps[i].first));
        }
        context.estimate(fmt::format("many lights, {}", integrator), stage.yaml(), meanRadiance, sum / kPi,
                         0.004, {.samples = 1024, .most = 65536},
                         {{(sum - brightest) / kPi, "the brightest lamp is never chosen"}});
    }
}

/// Adds a lamp of radiance 1 that spans a and b from `corner`, its front on the side of a × b.
void tile(Stage& stage, const Vec3d& corner, const Vec3d& a, const Vec3d& b) {
    stage.quad("tile",
               fmt::format("[{}, {}, {}, {}]", point(corner), point(corner + a), point(corner + a + b),
                           point(corner + b)),
               "black", "1");
}

/// A floor in a room whose walls and ceiling glow evenly, as eighty lamps. As many lie below the floor and
/// face its plane: they do not light it, and the tree excludes them by the floor's normal.
std::string tiledRoom(const std::string& material, const std::string& integrator, bool lamps_below) {
    Stage stage(eyeAt({0.3, 0.4, 0.1}, "[0.2, 0.1, 1]"), integrator);
    stage.material("it", material)
        .material("black", "{type: diffuse, reflectance: 0}")
        .quad("floor", "[[-0.5,0,-0.5],[-0.5,0,0.5],[0.5,0,0.5],[0.5,0,-0.5]]", "it");
    for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 4; ++k) {
            const double x = i - 2, h = 0.25 * k, z = k - 2;
            tile(stage, {x, 1, z}, {1, 0, 0}, {0, 0, 1});
            tile(stage, {-2, h, x}, {0, 0.25, 0}, {0, 0, 1});
            tile(stage, {2, h, x}, {0, 0, 1}, {0, 0.25, 0});
            tile(stage, {x, h, -2}, {1, 0, 0}, {0, 0.25, 0});
            tile(stage, {x, h, 2}, {0, 0.25, 0}, {1, 0, 0});
        }
    for (int i = 0; i < 80 && lamps_below; ++i)
        tile(stage, {-1 + 0.2 * (i % 10), -0.1, -1 + 0.25 * (i / 10)}, {0, 0, 0.2}, {0.18, 0, 0});
    return stage.yaml();
}

void glossUnderMany(Context& context) {
    struct Floor {
        const char* material;
        double albedo;
        bool sharp = false;  // light sampling alone takes 262,144 samples
    };
    const double cosine = unit({0.3, 0.4, 0.1})[1];
    for (const Floor& floor : {Floor{"{type: rough_conductor, eta: 1, k: 1e6, roughness: 0.4}", 1, true},
                               {"{type: rough_conductor, eta: 0.2, k: 3, roughness: 0.7}",
                                roughConductorAlbedo(cosine, 0.2, 3, 0.7)},
                               {"{type: plastic, reflectance: 1, roughness: 0.5}", 1},
                               {"{type: diffuse, reflectance: 0.5}", 0.5}})
        for (const auto& [technique, integrator] : kDirectTechniques)
            for (const bool lamps_below : {true, false}) {
                // Scattered rays alone choose no lamp, and the lamps below only matter to the tree.
                const std::string_view by = technique;
                const bool chooses = lamps_below && by != "scattered rays";
                const bool quick = !floor.sharp || by != "light sampling";
                if (!(chooses && quick) && !context.atLeast(Level::Merge)) continue;
                context.estimate(
                    fmt::format("{}, {} lamps below, {}", floor.material, lamps_below ? 80 : 0, technique),
                    tiledRoom(floor.material, integrator, lamps_below), meanRadiance, floor.albedo, 0.003,
                    {.samples = 256, .most = 262144});
            }
}

}  // namespace

std::vector<Case> lightTreeCases() {
    return {
        row("E26", "light-tree",
            "Sixty lamps, twenty points and a directional light over a floor: with light sampling, with it "
            "alone, and by chance",
            "the sum over the lights", "linearity of light, closed forms", "± 0.4 %", Level::Commit,
            kManyLamps | CRT_FEATURE_POINT_LIGHT, manyLights),
        row("E27", "light-tree-gloss",
            "Metal, plastic and a Lambertian floor in a room of eighty glowing tiles, with eighty lamps "
            "below the floor; by light sampling, scattered rays and both",
            "1 for lossless materials; else their albedo",
            "conservation of energy; Heitz (2014); Kulla and Conty (2017)", "± 0.3 %", Level::Commit,
            kManyLamps | CRT_FEATURE_ROUGH_CONDUCTOR | CRT_FEATURE_PLASTIC, glossUnderMany),
    };
}

}  // namespace crt::verify
