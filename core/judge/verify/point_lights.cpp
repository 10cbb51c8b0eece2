// Group E, the part about lights without a surface: points, spots, directional lights and suns.
#include "judge/verify/context.h"
#include "judge/verify/references.h"
#include "judge/verify/scenes.h"

#include "kernel/features.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace crt::verify {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::uint64_t kLit = CRT_FEATURE_DIFFUSE | CRT_FEATURE_NEE | CRT_FEATURE_POINT_LIGHT;

double radians(double degrees) { return degrees * (kPi / 180); }

/// A white floor at y = 0, seen at (x, 0, z) from aside and above, with `lights`, the items of a list.
Stage floorUnder(const std::string& lights, double x, double z, const std::string& integrator = kDirect) {
    return Stage(fmt::format("{{position: [{}, 2, {}], target: [{}, 0, {}], fov: 0.0001}}", x + 2, z, x, z),
                 integrator)
        .set("lights", "[" + lights + "]")
        .material("white", "{type: diffuse, reflectance: 1}")
        .quad("floor", "[[-4,0,-4.1],[-4,0,3.9],[4,0,3.9],[4,0,-4.1]]", "white");
}

/// A film of radiance 1, of the same wavelengths: over it the noise of wavelengths is gone.
Film ofRadianceOne(Context& context, std::uint64_t samples) {
    return context.render(
        Stage("{position: [0, 0, 0], target: [0, 0, 1], fov: 1}").set("environment", "{radiance: 1}").yaml(),
        {.samples = samples});
}

/// The worst pixel of a scene against an irradiance.
void irradiance(Context& context, const std::string& what, const Stage& stage, double expected,
                double tolerance, const std::vector<Mistake>& mistakes = {}) {
    const Film film = context.render(stage.yaml(), {.samples = 16});
    if (expected == 0) return context.relative(what, radiance(film), 0, 0, mistakes);
    const double ratio = worstRatio(film, ofRadianceOne(context, 16), expected / kPi);
    context.relative(what, ratio * expected, expected, tolerance, mistakes);
}

/// The square [−2, 2]² of the floor, seen from straight above, so that all pixels show equal areas.
std::string squareUnder(const std::string& light) {
    return Stage(fmt::format("{{position: [0, 8, 0], target: [0, 0, 0], up: [0, 0, 1], fov: {:.17g}}}",
                             2 * std::atan(0.25) * 180 / kPi))
        .set("film", "{resolution: [16, 16]}")
        .set("lights", "[" + light + "]")
        .material("white", "{type: diffuse, reflectance: 1}")
        .quad("floor", "[[-4,0,-4.1],[-4,0,3.9],[4,0,3.9],[4,0,-4.1]]", "white")
        .yaml();
}

void pointAndSpot(Context& context) {
    constexpr double h = 1.5, x = 0.7, z = -0.4;
    const double d2 = h * h + x * x + z * z;
    const std::string point = fmt::format("{{type: point, position: [0, {}, 0], radiant_intensity: 3}}", h);
    const double expected = 3 * h / (d2 * std::sqrt(d2));
    irradiance(context, "a point", floorUnder(point, x, z), expected, 1e-5,
               {{3 / d2, "the cosine is missing"},
                {3 * h / d2, "intensity is divided by the distance, not its square"},
                {expected / 4, "lengths are scaled at load, and the intensity is not"}});
    irradiance(context, "by light sampling alone",
               floorUnder(point, x, z, "{max_depth: 1, roulette: false, mis: false}"), expected, 1e-5);
    irradiance(context, "with a BVH",
               floorUnder(point, x, z, "{max_depth: 1, roulette: false, accelerator: bvh}"), expected, 1e-5);
    const char* const screen = "[[0,1,-1],[1,1,-1],[1,1,1],[0,1,1]]";
    irradiance(context, "behind a screen", floorUnder(point, x, z).quad("screen", screen, "white"), 0, 0);
    irradiance(context, "before a screen",
               floorUnder(point, x, z).quad("screen", "[[-1,2,-1],[1,2,-1],[1,2,1],[-1,2,1]]", "white"),
               expected, 1e-5);
    irradiance(context, "put on a ceiling",
               floorUnder(point, x, z)
                   .quad("ceiling", "[[-1,1.5,-1],[0.2,1.5,-1],[0.2,1.5,1],[-1,1.5,1]]", "white"),
               expected, 1e-5, {{0, "the surface that a light is put on hides it"}});
    irradiance(context, "below the floor",
               floorUnder("{type: point, position: [0, -1, 0], radiant_intensity: 3}", x, z), 0, 0);

    // A spot, aside its axis by 10, 29 and 40 degrees: in full light, in the penumbra from 23 to 35, and
    // out.
    for (const double aside : {10.0, 29.0, 40.0}) {
        const double s = 2 * std::tan(radians(aside)), distance2 = 4 + s * s;
        const double c = std::cos(radians(aside)), edge = std::cos(radians(35)),
                     full = std::cos(radians(23));
        const double t = std::clamp((c - edge) / (full - edge), 0.0, 1.0);
        const double falloff = 3 * t * t - 2 * t * t * t;
        irradiance(context, fmt::format("a spot, {} degrees aside", aside),
                   floorUnder("{type: spot, position: [0, 2, 0], target: [0, 0, 0], cone_angle_deg: 35, "
                              "penumbra_deg: 12, radiant_intensity: 3}",
                              s, 0),
                   // The penumbra is 0.1 of a cosine wide, and the film shows directions 3e-6 apart.
                   3 * falloff * c / distance2, aside == 29 ? 5e-5 : 1e-5,
                   {{3 * t * c / distance2, "the penumbra is a ramp of the cosine, not Hermite's cubic"}});
    }
    irradiance(context, "a spot without penumbra",
               floorUnder("{type: spot, position: [0.1, 2, 0], direction: [0, -1, 0], cone_angle_deg: 20, "
                          "penumbra_deg: 0, radiant_intensity: 3}",
                          0.1, 0.2),
               3 * 2 / std::pow(4.04, 1.5), 1e-5);
}

void fluxes(Context& context) {
    // A flat spectrum of 470 W from 360 to 830 nm has 1 W in a nanometre.
    constexpr double kArea = 16;
    context.estimate("a spot of 470 W, all of it on the floor",
                     squareUnder("{type: spot, position: [0.1, 2, 0], direction: [0.1, -1, -0.05], "
                                 "cone_angle_deg: 35, penumbra_deg: 12, power_w: 470, spectrum: 1}"),
                     meanRadiance, 1 / (kPi * kArea), 0.002, {.samples = 64, .most = 4096},
                     {{1 / (kPi * kArea) * (1 - std::cos(radians(29))) / (1 - std::cos(radians(35))),
                       "the flux is taken for that of a cone without penumbra"}});
    // Y of the film is over ∫ȳ dλ = 106.857 nm (CIE 1931, by nanometres).
    const double lumens = 683.002 * 106.857 * kPi * kArea;
    context.estimate("a spot of 800 lm of 2700 K, all of it on the floor",
                     squareUnder("{type: spot, position: [0.1, 2, 0], direction: [0.1, -1, -0.05], "
                                 "cone_angle_deg: 35, penumbra_deg: 0, luminous_flux_lm: 800, "
                                 "spectrum: {blackbody: 2700}}"),
                     luminance, 800 / lumens, 0.003, {.samples = 256, .most = 16384});
    // The square fills 4 asin(a² / (a² + h²)) sr as seen from a point at height h over its middle.
    context.estimate("a point of 1000 lm",
                     squareUnder("{type: point, position: [0, 1, 0], luminous_flux_lm: 1000}"), luminance,
                     1000 / (4 * kPi) * 4 * std::asin(4.0 / 5) / lumens, 0.003,
                     {.samples = 64, .most = 16384});
    context.estimate(
        "a point of 100 cd", squareUnder("{type: point, position: [0, 1, 0], luminous_intensity_cd: 100}"),
        luminance, 100 * 4 * std::asin(4.0 / 5) / lumens, 0.003, {.samples = 64, .most = 16384});
    context.estimate("a directional light of 500 lx, 60 degrees aside",
                     squareUnder("{type: directional, direction: [1, -0.57735026918962576, 0], "
                                 "illuminance_lx: 500, spectrum: {illuminant: A}}"),
                     luminance, 250 * kArea / lumens, 0.003, {.samples = 64, .most = 16384});
    context.estimate(
        "a sun of 500 lx, 60 degrees aside",
        squareUnder("{type: sun, direction: [1, -0.57735026918962576, 0], illuminance_lx: 500}"), luminance,
        250 * kArea / lumens, 0.003, {.samples = 64, .most = 16384});
    context.refused(
        "a point with 'nee: false'",
        floorUnder("{type: point, position: [0, 1, 0], power_w: 1}", 0, 0, "{nee: false}").yaml(),
        "found by light sampling alone");
}

void directionalAndSun(Context& context) {
    const std::string direction = "[0.6, -0.8, 0]";
    const std::string way = fmt::format("{{type: directional, direction: {}, irradiance: 3}}", direction);
    irradiance(context, "a directional light", floorUnder(way, 0.1, 0.2), 2.4, 1e-5,
               {{3, "the cosine is missing"}});
    const char* const screen = "[[-1,1,-1],[0,1,-1],[0,1,1],[-1,1,1]]";
    irradiance(context, "in the shadow of a screen",
               floorUnder(way, 0.7, 0.2).quad("screen", screen, "white"), 0, 0,
               {{2.4,
                 "shadow rays that leave the scene meet nothing: are only those triangles tested that "
                 "can come between two points of it?"}});
    irradiance(context, "beside that shadow", floorUnder(way, 0.8, 0.2).quad("screen", screen, "white"), 2.4,
               1e-5);

    // ∫ cos dω over a disk above the horizon: π sin² of its radius times the cosine of its middle.
    for (const double diameter : {0.53, 20.0}) {
        const double e = kPi * std::pow(std::sin(radians(diameter / 2)), 2) * 0.8;
        const auto under = [&](const char* integrator) {
            return floorUnder(
                       fmt::format("{{type: sun, direction: {}, radiance: 1, angular_diameter_deg: {}}}",
                                   direction, diameter),
                       0.1, 0.2, integrator)
                .yaml();
        };
        const std::vector<Mistake> mistakes = {
            {2 * e / kPi, "the sun counts twice: by light sampling, and in full by rays that miss"},
            {e / 0.8 / kPi, "the cosine is missing"}};
        context.estimate(fmt::format("a sun {} degrees wide", diameter), under(kDirect), meanRadiance,
                         e / kPi, 0.002, {.samples = 256, .most = 16384}, mistakes);
        context.estimate(fmt::format("{} degrees, light sampling alone", diameter),
                         under("{max_depth: 1, roulette: false, mis: false}"), meanRadiance, e / kPi, 0.002,
                         {.samples = 256, .most = 16384}, mistakes);
        if (diameter < 1) continue;
        context.estimate(fmt::format("{} degrees, found by chance", diameter),
                         under("{max_depth: 1, roulette: false, nee: false}"), meanRadiance, e / kPi, 0.01,
                         {.samples = 4096, .most = 65536}, mistakes);
    }

    // Penumbra: a screen at height 1 whose edge hides all of a sun at the zenith but a segment of its disk.
    const double radius = std::tan(radians(0.265));
    for (const double t : {0.0, 0.4}) {
        const double share = (std::acos(t) - t * std::sqrt(1 - t * t)) / kPi;
        const double e = kPi * std::pow(std::sin(radians(0.265)), 2) * share;
        const std::string edge = fmt::format("{:.9f}", 0.3 - t * radius);
        context.estimate(
            fmt::format("in the penumbra, {} radii in", t),
            floorUnder("{type: sun, direction: [0, -1, 0], radiance: 1000}", 0.3, 0.2)
                .quad("screen", fmt::format("[[{0},1,-1],[2,1,-1],[2,1,1],[{0},1,1]]", edge), "white")
                .set("camera", "{position: [-1.7, 2, 0.2], target: [0.3, 0, 0.2], fov: 0.0001}")
                .yaml(),
            meanRadiance, 1000 * e / kPi, 0.005, {.samples = 1024, .most = 65536});
    }

    // A camera sees the disk, and darkness beside it.
    for (const auto& [aside, bright] : {std::pair{0.26, 1.0}, {0.27, 0.0}}) {
        const Film film =
            context.render(Stage(fmt::format("{{position: [0, 0, 0], target: [0, {:.17g}, 1], fov: 0.001}}",
                                             std::tan(radians(aside))))
                               .set("lights", "[{type: sun, direction: [0, 0, -1], radiance: 7}]")
                               .yaml(),
                           {.samples = 16});
        context.relative(fmt::format("seen {} degrees from its middle", aside),
                         bright > 0 ? worstRatio(film, ofRadianceOne(context, 16), 7) : radiance(film),
                         bright, 2e-6);
    }
}

/// Lights of every kind over one floor, chosen by power; each brings what it brings alone.
void allTogether(Context& context) {
    constexpr double x = 0.3, z = 0.2;
    struct One {
        const char* light;
        double irradiance;
    };
    const double d2 = 1 + x * x + z * z, near2 = 0.01 + x * x + z * z;
    const double sine = std::sin(radians(10));
    const One ones[] = {
        {"{type: point, position: [0, 1, 0], radiant_intensity: 1}", 1 / (d2 * std::sqrt(d2))},
        {"{type: point, position: [0, 0.1, 0], radiant_intensity: 0.01}",
         0.001 / (near2 * std::sqrt(near2))},
        {"{type: point, position: [0.3, 5, 0.2], radiant_intensity: 5}", 0.2},
        {"{type: spot, position: [0.3, 2, 0.2], target: [0.3, 0, 0.2], radiant_intensity: 2}", 0.5},
        {"{type: spot, position: [-3, 2, 0.2], direction: [0, -1, 0], radiant_intensity: 9}", 0},
        {"{type: directional, direction: [0.6, -0.8, 0], irradiance: 0.5}", 0.4},
        {"{type: sun, direction: [0, -1, 0], radiance: 4, angular_diameter_deg: 20}", 4 * kPi * sine * sine},
    };
    std::string list;
    double sum = 0;
    for (const One& one : ones) {
        list += list.empty() ? one.light : std::string(", ") + one.light;
        sum += one.irradiance;
    }
    const std::vector<Vec3d> lamp = {{0.8, 0.5, -0.2}, {1.2, 0.5, -0.2}, {1.2, 0.5, 0.2}, {0.8, 0.5, 0.2}};
    const double from_lamp = polygonFormFactor({x, 0, z}, {0, 1, 0}, lamp);
    const double others = 2 * from_lamp + 0.2 * (1 - from_lamp);  // The lamp hides its part of the sky.
    for (const char* const integrator : {kDirect, "{max_depth: 1, roulette: false, mis: false}",
                                         "{max_depth: 1, roulette: false, accelerator: bvh}"}) {
        const std::string yaml =
            floorUnder(list, x, z, integrator)
                .set("camera", "{position: [0.3, 2, 2.2], target: [0.3, 0, 0.2], fov: 0.0001}")
                .set("environment", "{radiance: 0.2, light_sampling: true}")
                .material("black", "{type: diffuse, reflectance: 0}")
                .quad("lamp", "[[0.8,0.5,-0.2],[1.2,0.5,-0.2],[1.2,0.5,0.2],[0.8,0.5,0.2]]", "black", "2")
                .yaml();
        context.estimate(fmt::format("all kinds at once, {}", integrator), yaml, meanRadiance,
                         sum / kPi + others, 0.003, {.samples = 1024, .most = 65536},
                         {{sum / kPi, "emitter and environment are lost beside lights without a surface"},
                          {others, "lights without a surface are lost"}});
    }
}

}  // namespace

std::vector<Case> pointLightCases() {
    return {
        row("E16", "point-spot",
            "A floor under a point and a spot: beside, behind and before screens, on a ceiling, in the "
            "penumbra",
            "I cos θ / d², of a spot times Hermite's cubic of the cosine", "definition; pbrt-v4",
            "1e-5; in the penumbra 5e-5", Level::Commit, kLit, pointAndSpot),
        row("E17", "light-units",
            "Points, spots, directional lights and suns by watts, lumens, candelas and lux, caught by a "
            "floor",
            "the flux that was asked for; a spot with 'nee: false' is refused",
            "area times irradiance; solid angle of a square", "± 0.2 %, ± 0.3 %", Level::Commit, kLit,
            fluxes),
        row("E18", "sun",
            "Directional light and shadow; suns of 0.53 and 20 degrees, by light sampling, alone, and by "
            "chance; their penumbra and their disk",
            "E cos θ; L π sin² α cos θ; the share of a circle's segment; L", "closed forms",
            "1e-5; ± 0.2 %, ± 1 %; ± 0.5 %; 2e-6", Level::Commit, kLit, directionalAndSun),
        row("E19", "all-lights",
            "Seven lights without a surface, a lamp and a sampled environment over one floor, chosen by "
            "power",
            "the sum of what each brings", "linearity of light, closed forms", "± 0.3 %", Level::Commit,
            kLit | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_ENVIRONMENT_LIGHT,
            allTogether),
    };
}

}  // namespace crt::verify
