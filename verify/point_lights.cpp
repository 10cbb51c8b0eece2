// Group E, the part about lights without a surface: points, spots, directional lights and suns.
//
// Over 450 lines: cases, each a scene and its answer, that share nothing with their neighbours.
#include "base/temporary_folder.h"
#include "base/vec3d.h"
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"
#include "verify/shapes.h"

#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <tuple>
#include <utility>
#include <vector>

namespace crt::verify {
namespace {

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

/// ∫ȳ dλ, nm, and what it makes of watts.
constexpr double kLumens_W = 683.002 * 106.857;

std::string listed(const std::vector<double>& values) {
    std::string text;
    for (const double value : values) text += fmt::format("{:.9g}\n", value);
    return text;
}

/// An LM-63 file.
std::string iesFile(const std::vector<double>& vertical, const std::vector<double>& horizontal,
                    const std::vector<double>& candela, const std::string& tilt = "NONE") {
    return fmt::format(
        "IESNA:LM-63-2002\n[TEST] none\nTILT={}\n1 -1 2 {} {} 1 2 0 0 0\n0.5 1 20\n{}{}{}", tilt,
        vertical.size(), horizontal.size(), listed(vertical), listed(horizontal), listed(candela));
}

/// Between the angles of a file that goes all round, in degrees.
double candelaAt(const std::vector<double>& vertical, const std::vector<double>& horizontal,
                 const std::vector<double>& candela, double theta, double phi) {
    const auto before = [](const std::vector<double>& angles, double x) {
        std::size_t i = 0;
        while (i + 2 < angles.size() && angles[i + 1] <= x) ++i;
        return i;
    };
    const std::size_t v = before(vertical, theta), h = before(horizontal, phi);
    const double t = (theta - vertical[v]) / (vertical[v + 1] - vertical[v]),
                 s = (phi - horizontal[h]) / (horizontal[h + 1] - horizontal[h]);
    const auto at = [&](std::size_t column, std::size_t row) {
        return candela[column * vertical.size() + row];
    };
    return (1 - s) * ((1 - t) * at(h, v) + t * at(h, v + 1)) +
           s * ((1 - t) * at(h + 1, v) + t * at(h + 1, v + 1));
}

void iesLamps(Context& context) {
    const TemporaryFolder folder;
    const auto lamp = [&](const std::string& text, const std::string& more) {
        static int number = 0;
        const std::string path = fmt::format("{}/{}.ies", folder.path(), number++);
        std::ofstream(path) << text;
        return fmt::format("{{type: ies, file: '{}', spectrum: 1, {}}}", path, more);
    };
    constexpr double h = 1.5;
    const std::string above = fmt::format("position: [0, {}, 0]", h);
    // One that has no symmetry, hanging: c0 is +z and, counter-clockwise from above, c90 is +x.
    const std::vector<double> vertical{0, 20, 55, 90}, round{0, 80, 190, 250, 360},
        candela{900, 500, 300, 20, 900, 800, 100, 10, 900, 100, 700, 50, 900, 300, 200, 90,
                900, 500, 300, 20};
    const std::string turned = lamp(iesFile(vertical, round, candela), above + ", c0: [0.2, 5, 3]");
    for (const auto& [x, z] :
         {std::pair{0.7, -0.4}, {-0.3, 1.1}, {1.9, 0.2}, {-1.0, -1.3}, {0.01, 0.02}}) {
        const double d2 = h * h + x * x + z * z;
        const double theta = std::atan2(std::hypot(x, z), h) / radians(1);
        const double zero = std::atan2(0.2, 3);  // of +x from +z: the part of c0 across
        const auto phi = [&](double sense) {
            const double angle = sense * (std::atan2(x, z) - zero) / radians(1);
            return std::fmod(angle + 720, 360);
        };
        const auto expected = [&](double sense) {
            return candelaAt(vertical, round, candela, theta, phi(sense)) / kLumens_W * h /
                   (d2 * std::sqrt(d2));
        };
        irradiance(context, fmt::format("a lamp without symmetry, at ({}, {})", x, z),
                   floorUnder(turned, x, z), expected(1), 2e-5,
                   {{expected(-1), "horizontal angles go the other way round"},
                    {expected(1) * 2, "the ballast factor is not applied"}});
    }
    // Columns that a file leaves out by symmetry, and the columns that the file stands for.
    const std::vector<double> q{500, 400, 300, 500, 200, 100, 500, 50, 20};  // 0, 30 and 90 degrees
    const auto column = [&q](std::size_t i) {
        return std::vector<double>{q[3 * i], q[3 * i + 1], q[3 * i + 2]};
    };
    const auto columns = [&](const std::vector<std::size_t>& which) {
        std::vector<double> all;
        for (const std::size_t i : which)
            for (const double value : column(i)) all.push_back(value);
        return all;
    };
    const std::vector<double> three{0, 45, 90};
    const std::vector<double> whole_angles{0, 30, 90, 150, 180, 210, 270, 330, 360};
    const std::vector<double> whole = columns({0, 1, 2, 1, 0, 1, 2, 1, 0});
    const struct {
        const char* name;
        std::vector<double> angles, values;
    } symmetric[] = {{"a quadrant", {0, 30, 90}, columns({0, 1, 2})},
                     {"a half", {0, 30, 90, 150, 180}, columns({0, 1, 2, 1, 0})},
                     {"a half across", {90, 150, 180, 210, 270}, columns({2, 1, 0, 1, 2})}};
    for (const auto& [x, z] : {std::pair{0.7, -0.4}, {-0.8, 0.3}, {-0.2, -0.9}}) {
        const Film expected =
            context.render(floorUnder(lamp(iesFile(three, whole_angles, whole), above), x, z).yaml());
        for (const auto& file : symmetric)
            context.sameBits(
                fmt::format("{}, written out, at ({}, {})", file.name, x, z),
                context.render(
                    floorUnder(lamp(iesFile(three, file.angles, file.values), above), x, z).yaml()),
                expected, "lateral symmetry is taken for another");
    }
    irradiance(context, "beyond the last vertical angle",
               floorUnder(lamp(iesFile({90, 180}, {0}, {100, 100}), above), 0.5, 0), 0, 0);
    irradiance(context, "upside down, it shines there",
               floorUnder(lamp(iesFile({90, 180}, {0}, {100, 100}), above + ", direction: [0, 1, 0]"), 0.5,
                          0),
               100 / kLumens_W * h / std::pow(h * h + 0.25, 1.5), 2e-5);

    // All of it falls on the square: 40 degrees at most.
    const std::vector<double> narrow{0, 10, 40, 90}, sides{0, 90, 360};
    const std::vector<double> aslant{700, 500, 0, 0, 700, 900, 0, 0, 700, 500, 0, 0};
    const std::string text = iesFile(narrow, sides, aslant, "INCLUDE\n1\n2\n0 90\n1 0.9");
    constexpr double kArea = 16;
    for (const auto& [what, key, lumens] :
         {std::tuple{"800 lm asked for", ", luminous_flux_lm: 800", 800.0},
          std::tuple{"10 W of a flat spectrum", ", power_w: 10", 10.0 / 470 * kLumens_W}})
        context.estimate(fmt::format("a lamp of {}", what),
                         squareUnder(lamp(text, fmt::format("position: [0, 2, 0]{}", key))), luminance,
                         lumens / (kLumens_W * kPi * kArea), 0.003,
                         {.samples = 64, .most = 16384});
    // ∫∫ I sin θ dθ dφ, by midpoints.
    double flux = 0;
    constexpr int kSteps = 720;
    for (int i = 0; i < kSteps; ++i)
        for (int k = 0; k < kSteps; ++k) {
            const double theta = (i + 0.5) * 90 / kSteps, phi = (k + 0.5) * 360 / kSteps;
            flux += candelaAt(narrow, sides, aslant, theta, phi) * std::sin(radians(theta)) *
                    radians(90.0 / kSteps) * radians(360.0 / kSteps);
        }
    context.estimate("a lamp as its file has it, halved",
                     squareUnder(lamp(text, "position: [0, 2, 0], scale: 0.5")), luminance,
                     flux / 2 / (kLumens_W * kPi * kArea), 0.003, {.samples = 64, .most = 16384});
}

void beams(Context& context) {
    // Down, aslant; the middle meets the floor at (0.6, 0.3).
    const Vec3d way = Vec3d{0.3, -1, 0.15} * (1 / std::sqrt(0.09 + 1 + 0.0225));
    const double cosine = -way[1];
    const std::string aslant = "type: beam, position: [0, 2, 0], direction: [0.3, -1, 0.15], irradiance: 2";
    // Along x a floor's point is nearer to the axis than it is from the middle.
    const auto off = [&](double x, double z) {
        const Vec3d d{x, -2, z};
        const double along = d[0] * way[0] + d[1] * way[1] + d[2] * way[2];
        return std::sqrt(std::max(0.0, d[0] * d[0] + d[1] * d[1] + d[2] * d[2] - along * along));
    };
    const std::string disk = "{" + aslant + ", radius: 0.25}";
    for (const auto& [x, z] : {std::pair{0.6, 0.3},
                               {0.7, 0.2},
                               {0.6, 0.54},
                               {0.6, 0.56},
                               {0.35, 0.3},
                               {0.33, 0.3},
                               {-0.6, -0.3}}) {
        const bool inside = off(x, z) < 0.25;
        irradiance(context, fmt::format("a disk, at ({}, {}), {}", x, z, inside ? "within" : "out"),
                   floorUnder(disk, x, z), inside ? 2 * cosine : 0, inside ? 1e-5 : 0,
                   {{2, "the cosine is missing"}, {2 * cosine / 5, "it falls off with distance"}});
    }
    irradiance(context, "before it begins",
               floorUnder("{type: beam, position: [0, -1, 0], direction: [0, -1, 0], irradiance: 2, "
                          "radius: 1}",
                          0.2, 0),
               0, 0);
    irradiance(context, "behind a screen",
               floorUnder(disk, 0.6, 0.3).quad("screen", "[[0,1,-1],[1,1,-1],[1,1,1],[0,1,1]]", "white"), 0,
               0);
    irradiance(context, "before a screen",
               floorUnder(disk, 0.6, 0.3).quad("screen", "[[-1,3,-1],[1,3,-1],[1,3,1],[-1,3,1]]", "white"),
               2 * cosine, 1e-5);
    const std::string slit =
        "{type: beam, position: [0.1, 2, 0], direction: [0, -1, 0], up: [0, 0.3, 1], size: [0.04, 0.5], "
        "irradiance: 3}";
    for (const auto& [x, z] : {std::pair{0.1, 0.0}, {0.119, 0.249}, {0.081, -0.249}})
        irradiance(context, fmt::format("a slit, at ({}, {}), within", x, z), floorUnder(slit, x, z), 3,
                   1e-5);
    for (const auto& [x, z] : {std::pair{0.121, 0.0}, {0.1, 0.251}, {0.079, -0.1}})
        irradiance(context, fmt::format("a slit, at ({}, {}), out", x, z), floorUnder(slit, x, z), 0, 0,
                   {{3, "width and height are exchanged"}});
    context.estimate("a disk of 470 W, all of it on the floor",
                     squareUnder("{type: beam, position: [0.1, 1, 0], direction: [0.1, -1, 0.2], "
                                 "radius: 0.7, power_w: 470, spectrum: 1}"),
                     meanRadiance, 1 / (kPi * 16), 0.003, {.samples = 256, .most = 16384});
    context.estimate("a slit of 900 lm of 2700 K, all of it on the floor",
                     squareUnder("{type: beam, position: [0.1, 1, 0], direction: [0.1, -1, 0.2], "
                                 "size: [0.5, 1.3], luminous_flux_lm: 900, spectrum: {blackbody: 2700}}"),
                     luminance, 900 / (kLumens_W * kPi * 16), 0.003, {.samples = 256, .most = 16384});
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
            "the flux that was asked for",
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
            "the sum over the lights", "linearity of light, closed forms", "± 0.3 %", Level::Commit,
            kLit | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_ENVIRONMENT_LIGHT,
            allTogether),
        row("E24", "ies",
            "Lamps of IES files: without symmetry, quadrants and halves, by candelas, lumens and watts",
            "I(θ, φ) cos θ / d², linear in both angles; the flux",
            "bilinear interpolation, ∫∫ I sin θ dθ dφ", "2e-5; same bits; ± 0.3 %", Level::Commit,
            kLit,
            iesLamps),
        row("E25", "beam",
            "Disks and slits of collimated light: within, out, behind screens and before they begin",
            "E cos θ within, 0 without; the flux", "closed forms", "1e-5; ± 0.3 %", Level::Commit, kLit,
            beams),
    };
}

}  // namespace crt::verify
