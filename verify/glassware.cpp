// Group G, the part about what glass can be beside smooth, whole and clear: rough, thin, absorbing, and a
// coat on a diffuse base.
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"

#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace crt::verify {
namespace {

constexpr double kIndex = 1.5;
constexpr const char* kInterface = "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]";

/// An eye at `distance` from the origin and `degrees` from the vertical, above or below.
std::string eyeFacing(double degrees, double side, double distance = 1) {
    return fmt::format("{{position: [{:.17g}, {:.17g}, 0], target: [0, 0, 0], up: [0, 0, 1], fov: 0.001}}",
                       distance * std::sin(degrees * kDegree),
                       side * distance * std::cos(degrees * kDegree));
}

std::string roughGlass(double ior, double roughness) {
    return fmt::format("{{type: rough_dielectric, ior: {}, roughness: {}}}", ior, roughness);
}

/// The radiance towards an eye at `cosine` under uniform light 1: refracted light is compressed by n².
double seen(double cosine, double eta, double roughness) {
    const ScatteredShares shares = roughDielectricShares(cosine, eta, roughness);
    return shares.reflected + shares.transmitted / (eta * eta);
}

std::vector<Mistake> mistakesOfRoughGlass(double cosine, double eta, double roughness) {
    const ScatteredShares once = microfacetShares(cosine, eta, roughness);
    return {{once.reflected + once.transmitted / (eta * eta), "what the microfacets lose is not given back"},
            {once.reflected + (1 - once.reflected) / (eta * eta), "all that they lose is transmitted"},
            {1, "radiance is not scaled by n² in refraction"},
            {seen(cosine, eta, std::sqrt(roughness)), "the width of GGX is the roughness, not its square"}};
}

void roughGlassFurnace(Context& context) {
    for (const double roughness : {0.1, 0.5, 1.0})
        for (const double degrees : {0.0, 60.0, 85.0})
            for (const double side : {1.0, -1.0}) {
                const double cosine = std::cos(degrees * kDegree), eta = side > 0 ? kIndex : 1 / kIndex;
                context.estimate(fmt::format("roughness {}, seen from {}° {}", roughness, degrees,
                                             side > 0 ? "outside" : "inside"),
                                 Stage(eyeFacing(degrees, side))
                                     .set("environment", "{radiance: 1}")
                                     .material("glass", roughGlass(kIndex, roughness))
                                     .quad("glass", kInterface, "glass")
                                     .yaml(),
                                 meanRadiance, seen(cosine, eta, roughness), 0.002,
                                 {.samples = 256, .most = 65536},
                                 mistakesOfRoughGlass(cosine, eta, roughness));
            }
    // However rough, clear glass in light from everywhere cannot be seen.
    for (const char* ior : {"1.5", "{glass: SF10}"})
        for (const double roughness : {0.1, 0.3, 0.5, 0.7, 1.0}) {
            const bool always = *ior == '1' && (roughness == 0.3 || roughness == 1);
            if (!always && !context.atLeast(Level::Merge)) continue;
            context.estimate(fmt::format("a clear cube, ior {}, roughness {}", ior, roughness),
                             Stage("{position: [0.2, 3, 4], target: [0.5, 0.5, 0.5], fov: 12}",
                                   "{max_depth: 400, roulette: false}")
                                 .set("environment", "{radiance: 1}")
                                 .set("film", "{resolution: [8, 8]}")
                                 .material("glass", fmt::format("{{type: rough_dielectric, ior: {}, "
                                                                "roughness: {}}}",
                                                                ior, roughness))
                                 .box("cube", {0, 0, 0}, {1, 1, 1}, "glass")
                                 .yaml(),
                             meanRadiance, 1, 0.003, {.samples = 64, .most = 16384});
        }
    // Lamps all around, on both sides: light sampling and scattered rays share the work, or one does it
    // alone.
    for (const char* integrator :
         {"{max_depth: 1, roulette: false}", "{max_depth: 1, roulette: false, nee: false}"})
        for (const double roughness : {0.5, 1.0}) {
            const double cosine = std::cos(30 * kDegree);
            context.estimate(
                fmt::format("in a glowing room, roughness {}, {}", roughness, integrator),
                Stage(eyeFacing(30, 1, 0.5), integrator)
                    .material("glass", roughGlass(kIndex, roughness))
                    .material("black", "{type: diffuse, reflectance: 0}")
                    .quad("glass", kInterface, "glass")
                    .mesh("room",
                          "[[-2,-1,-2],[2,-1,-2],[-2,1,-2],[2,1,-2],[-2,-1,2],[2,-1,2],[-2,1,2],[2,1,2]]",
                          "[[0,1,3,2],[4,6,7,5],[2,3,7,6],[0,4,5,1],[0,2,6,4],[1,5,7,3]]", "black",
                          "1, two_sided: true")
                    .yaml(),
                meanRadiance, seen(cosine, kIndex, roughness), 0.002, {.samples = 256, .most = 16384},
                mistakesOfRoughGlass(cosine, kIndex, roughness));
        }
}

void roughGlassLimits(Context& context) {
    const auto cube = [](const std::string& glass) {
        Stage stage("{position: [0.2, 3, 4], target: [0.5, 0.5, 0.5], fov: 15}",
                    "{max_depth: 8, roulette: false}");
        stage.set("environment", "{radiance: 1}").set("film", "{resolution: [8, 8]}");
        if (!glass.empty()) stage.material("glass", glass).box("cube", {0, 0, 0}, {1, 1, 1}, "glass");
        return stage.yaml();
    };
    const Film empty = context.render(cube(""));
    const Film one = context.render(cube(roughGlass(1, 0.5)));
    context.sameBits("n = 1, and the empty scene", one, empty,
                     "an index of 1 is a surface that bends or loses light");
    context.sameBits("roughness 0.03", context.render(cube(roughGlass(kIndex, 0.03))),
                     context.render(cube("{type: dielectric, ior: 1.5}")),
                     "what is too smooth for microfacets is not the smooth dielectric");
    // Just above the limit: as much is reflected as by the smooth surface.
    for (const double degrees : {0.0, 60.0, 80.0})
        context.estimate(
            fmt::format("roughness 0.033, reflected at {}°", degrees),
            Stage(eyeFacing(degrees, 1))
                .set("environment", "{radiance: 1}")
                .material("glass", roughGlass(kIndex, 0.033))
                .material("black", "{type: diffuse, reflectance: 0}")
                .quad("glass", kInterface, "glass")
                .quad("bottom", "[[-900,-1,-900],[-900,-1,900],[900,-1,900],[900,-1,-900]]", "black")
                .yaml(),
            meanRadiance, fresnelDielectric(std::cos(degrees * kDegree), kIndex), 0.002,
            {.samples = 1024, .most = 65536});
}

/// Where all light is of wavelengths at which the index is the same, those at which it is not must not show:
/// through two surfaces and back, by choices between wavelengths at each.
void roughDispersion(Context& context) {
    const auto scene = [](const char* ior, double roughness) {
        return Stage("{position: [0.2, 3, 4], target: [0.5, 0.5, 0.5], fov: 14}",
                     "{max_depth: 6, roulette: false}")
            .set("environment",
                 "{radiance: {table: {nm: [400, 401, 510, 511], value: [0, 1, 1, 0]}, outside: zero}}")
            .material("glass",
                      fmt::format("{{type: rough_dielectric, ior: {}, roughness: {}}}", ior, roughness))
            .box("cube", {0, 0, 0}, {1, 1, 1}, "glass")
            .yaml();
    };
    for (const double roughness : {0.1, 0.4})
        context.estimate(
            fmt::format("roughness {}: dispersive over plain", roughness),
            {scene("{table: {nm: [360, 520, 560, 830], value: [1.8, 1.8, 1.5, 1.5]}}", roughness),
             scene("1.8", roughness)},
            [](const std::vector<Film>& f) { return radiance(f[0]) / radiance(f[1]); }, 1, 0.005,
            {.samples = 256, .most = 65536},
            {{4, "one wavelength is taken for all four, and counted four times"}});
}

void pane(Context& context) {
    const auto reflecting = [](double degrees, double ior) {
        return Stage(eyeFacing(degrees, 1))
            .set("environment", "{radiance: 1}")
            .material("pane", fmt::format("{{type: thin_dielectric, ior: {}}}", ior))
            .material("black", "{type: diffuse, reflectance: 0}")
            .quad("pane", kInterface, "pane")
            .quad("bottom", "[[-900,-1,-900],[-900,-1,900],[900,-1,900],[900,-1,-900]]", "black")
            .yaml();
    };
    const Effort effort{.samples = 1024, .most = 65536};
    for (const double ior : {1.5, 1 / 1.5})
        for (const double degrees : {0.0, 40.0, 70.0}) {
            const double cosine = std::cos(degrees * kDegree), r = fresnelDielectric(cosine, ior);
            context.estimate(fmt::format("n = {:.3g}, reflected at {}°", ior, degrees),
                             reflecting(degrees, ior), meanRadiance, 1 - paneTransmittance(cosine, ior),
                             0.001, effort,
                             {{r, "only the front of the pane reflects"},
                              {2 * r / (1 + r), "light loses its polarisation between the sides"}});
        }
    // A lamp that a bent ray would miss, seen through the pane from either side.
    const double x = std::sin(50 * kDegree), y = std::cos(50 * kDegree), r = fresnelDielectric(y, kIndex);
    for (const double side : {1.0, -1.0})
        context.estimate(
            fmt::format("through it at 50°, from {}", side > 0 ? "above" : "below"),
            Stage(eyeFacing(50, side), "{max_depth: 0}")
                .material("pane", "{type: thin_dielectric, ior: 1.5}")
                .material("black", "{type: diffuse, reflectance: 0}")
                .quad("pane", kInterface, "pane")
                .quad("lamp",
                      fmt::format("[[{0:.17g},{2:.17g},-0.001],[{1:.17g},{2:.17g},-0.001],[{1:.17g},"
                                  "{2:.17g},0.001],[{0:.17g},{2:.17g},0.001]]",
                                  -x - 0.001, -x + 0.001, -side * y),
                      "black", "1, two_sided: true")
                .yaml(),
            meanRadiance, paneTransmittance(y, kIndex), 0.001, effort,
            {{0, "a pane bends what passes, or stops it"},
             {(1 - r) / (1 + r), "light loses its polarisation between the sides"},
             {(1 - r) * (1 - r), "light reflected to and fro inside the pane is missing"}});
    // All of the light is somewhere.
    context.relative(
        "in light from everywhere",
        radiance(context.render(Stage(eyeFacing(60, 1))
                                    .set("environment", "{radiance: 1}")
                                    .material("pane", "{type: thin_dielectric, ior: 1.5}")
                                    .quad("pane", kInterface, "pane")
                                    .yaml(),
                                {.samples = 64})) /
            radiance(context.render(Stage(eyeFacing(60, 1)).set("environment", "{radiance: 1}").yaml(),
                                    {.samples = 64})),
        1, 2e-6);
}

void plasticFurnace(Context& context) {
    const auto floor = [](double degrees, double distance, const char* integrator, double base,
                          double roughness) {
        return Stage(eyeFacing(degrees, 1, distance), integrator)
            .material("it",
                      fmt::format("{{type: plastic, reflectance: {}, roughness: {}}}", base, roughness))
            .quad("it", kInterface, "it");
    };
    const auto mistakes = [](double cosine, double base, double roughness) {
        const double coat = microfacetShares(cosine, kIndex, roughness).reflected;
        return std::vector<Mistake>{
            {base, "there is no coat"},
            {coat + (1 - coat) * base, "what the coat sends back from below is not scattered again"},
            {coat, "there is no base"}};
    };
    for (const double base : {0.5, 1.0})
        for (const double roughness : {0.0, 0.3, 1.0})
            for (const double degrees : {0.0, 60.0, 85.0}) {
                const double cosine = std::cos(degrees * kDegree);
                context.relative(
                    fmt::format("base {}, roughness {}, seen from {}°", base, roughness, degrees),
                    radiance(context.render(floor(degrees, 1, kDirect, base, roughness)
                                                .set("environment", "{radiance: 1}")
                                                .yaml(),
                                            {.samples = 1u << 12})),
                    plasticAlbedo(cosine, base, kIndex, roughness), 2e-3, mistakes(cosine, base, roughness));
            }
    // The base is lit by light sampling and by scattered rays, the coat's delta by the latter alone.
    for (const char* integrator :
         {"{max_depth: 1, roulette: false}", "{max_depth: 1, roulette: false, nee: false}"})
        for (const double roughness : {0.0, 0.5}) {
            const double cosine = std::cos(60 * kDegree);
            context.estimate(
                fmt::format("in a glowing room, roughness {}, {}", roughness, integrator),
                floor(60, 0.5, integrator, 0.5, roughness)
                    .material("black", "{type: diffuse, reflectance: 0}")
                    .mesh("room",
                          "[[-2,0,-2],[2,0,-2],[-2,1,-2],[2,1,-2],[-2,0,2],[2,0,2],[-2,1,2],[2,1,2]]",
                          "[[0,1,3,2],[4,6,7,5],[2,3,7,6],[0,2,6,4],[1,5,7,3]]", "black",
                          "1, two_sided: true")
                    .yaml(),
                meanRadiance, plasticAlbedo(cosine, 0.5, kIndex, roughness), 0.002,
                {.samples = 256, .most = 16384}, mistakes(cosine, 0.5, roughness));
        }
    context.sameBits("an index of 1 is Lambert's law",
                     context.render(Stage(eyeFacing(30, 1))
                                        .set("environment", "{radiance: 1}")
                                        .material("it", "{type: plastic, reflectance: 0.5, ior: 1}")
                                        .quad("it", kInterface, "it")
                                        .yaml()),
                     context.render(Stage(eyeFacing(30, 1))
                                        .set("environment", "{radiance: 1}")
                                        .material("it", "{type: diffuse, reflectance: 0.5}")
                                        .quad("it", kInterface, "it")
                                        .yaml()),
                     "a coat of index 1 is there");
}

void absorbingSlab(Context& context) {
    // A slab of thickness 0.5 before a lamp. Seen straight on: T = (1 − R)² A / (1 − R² A²), A =
    // exp(−σ d).
    const auto slab = [](const std::string& glass, const char* camera) {
        return Stage(camera, "{max_depth: 64, roulette: false}")
            .material("glass", glass)
            .material("black", "{type: diffuse, reflectance: 0}")
            .box("slab", {-10, -10, -0.25}, {10, 10, 0.25}, "glass");
    };
    constexpr const char* outside = "{position: [0, 0, 5], target: [0, 0, 0], fov: 0.001}";
    constexpr const char* inside = "{position: [0, 0, 0.05], target: [0, 0, -5], fov: 0.001}";
    constexpr const char* lamp = "[[-9,-9,-3],[9,-9,-3],[9,9,-3],[-9,9,-3]]";
    const double r = fresnelDielectric(1, kIndex);
    const Effort effort{.samples = 1024, .most = 65536};
    for (const double sigma : {0.0, 0.7, 3.0}) {
        const double a = std::exp(-0.5 * sigma), through = (1 - r) * (1 - r) * a / (1 - r * r * a * a);
        context.estimate(fmt::format("absorption {}: transmitted", sigma),
                         slab(fmt::format("{{type: dielectric, ior: 1.5, absorption: {}}}", sigma), outside)
                             .quad("lamp", lamp, "black", "1")
                             .yaml(),
                         meanRadiance, through, 0.001, effort,
                         {{(1 - r) / (1 + r), "nothing is absorbed"},
                          {(1 - r) * (1 - r) * a * a, "it is absorbed twice"},
                          {(1 - r) * (1 - r) * a, "light reflected to and fro inside is missing"}});
        // An index of 1: the law alone, without variance. From the inside, a part of the way.
        const std::string clear = fmt::format("{{type: dielectric, ior: 1, absorption: {}}}", sigma);
        for (const char* camera : {outside, inside}) {
            const double length = camera == outside ? 0.5 : 0.3;
            context.relative(
                fmt::format("absorption {}, index 1, length {}", sigma, length),
                radiance(context.render(slab(clear, camera).quad("lamp", lamp, "black", "1").yaml())) /
                    radiance(context.render(
                        Stage(camera, "{max_depth: 0}")
                            .material("black", "{type: diffuse, reflectance: 0}")
                            .quad("lamp", lamp, "black", "1")
                            .yaml())),
                std::exp(-length * sigma), 1e-5);
        }
        context.estimate(
            fmt::format("absorption {}, rough glass of index 1.5, light all around", sigma),
            {slab(fmt::format("{{type: rough_dielectric, ior: 1.5, roughness: 0.03, absorption: {}}}",
                              sigma),
                  outside)
                 .set("environment", "{radiance: 1}")
                 .yaml(),
             slab(fmt::format("{{type: dielectric, ior: 1.5, absorption: {}}}", sigma), outside)
                 .set("environment", "{radiance: 1}")
                 .yaml()},
            [](const std::vector<Film>& f) { return radiance(f[0]) / radiance(f[1]); }, 1, 0.002, effort);
    }
    // Things inside: a white floor in the slab, 0.25 deep, lit from above by a lamp inside it and by none
    // else. Light sampling and scattered rays cross the same.
    const auto pool = [&](double sigma, const char* integrator) {
        return Stage("{position: [0, 0, 5], target: [0, 0, 0], fov: 0.001}", integrator)
            .material("water", fmt::format("{{type: dielectric, ior: 1, absorption: {}}}", sigma))
            .material("white", "{type: diffuse, reflectance: 1}")
            .material("black", "{type: diffuse, reflectance: 0}")
            .box("pool", {-10, -10, -1}, {10, 10, 1}, "water")
            .quad("floor", "[[-9,-9,0],[9,-9,0],[9,9,0],[-9,9,0]]", "white")
            .quad("lamp", "[[0.2,-0.001,0.5],[0.2,0.001,0.5],[0.202,0.001,0.5],[0.202,-0.001,0.5]]", "black",
                  "1e6, two_sided: true")
            .yaml();
    };
    const double away = std::hypot(0.201, 0.5);
    context.estimate(
        "under water, by a small lamp: absorbing over clear",
        {pool(2, "{max_depth: 2, roulette: false}"), pool(0, "{max_depth: 2, roulette: false}")},
        [](const std::vector<Film>& f) { return radiance(f[0]) / radiance(f[1]); },
        std::exp(-2 * (1 + away)), 0.002, effort,
        {{std::exp(-2.0), "a shadow ray is not absorbed"},
         {std::exp(-2 * away), "what leads to the floor is not absorbed"}});
    // Mirrored by a glass cube that stands in water, to a lamp in the water: all of the way is absorbed.
    const auto mirrored = [](double sigma) {
        return Stage("{position: [-3, 3, 0], target: [0, 0, 0], fov: 0.001}",
                     "{max_depth: 2, roulette: false}")
            .material("water", fmt::format("{{type: dielectric, ior: 1, absorption: {}}}", sigma))
            .material("glass", "{type: dielectric, ior: 2.5, absorption: 5}")
            .material("black", "{type: diffuse, reflectance: 0}")
            .box("pool", {-2, -2, -2}, {2, 2, 2}, "water")
            .box("cube", {-1, -1, -1}, {1, 0, 1}, "glass")
            .quad("lamp", "[[0.8,1.2,-0.3],[1.2,0.8,-0.3],[1.2,0.8,0.3],[0.8,1.2,0.3]]", "black",
                  "1, two_sided: true")
            .yaml();
    };
    const double to_cube = std::sqrt(8.0), to_lamp = std::sqrt(2.0);
    context.estimate("mirrored under water by a glass cube: absorbing over clear",
                     {mirrored(0.7), mirrored(0)},
                     [](const std::vector<Film>& f) { return radiance(f[0]) / radiance(f[1]); },
                     std::exp(-0.7 * (to_cube + to_lamp)), 0.002, effort,
                     {{std::exp(-0.7 * to_cube), "what is mirrored forgets what it was in"}});
    // Through a body that stands in water and out of it again, to a lamp in the water.
    const auto through = [](double sigma, double inner) {
        return Stage("{position: [0.1, 5, 0], target: [0.1, 0, 0], up: [0, 0, 1], fov: 0.001}",
                     "{max_depth: 4, roulette: false}")
            .material("water", fmt::format("{{type: dielectric, ior: 1, absorption: {}}}", sigma))
            .material("jelly", fmt::format("{{type: dielectric, ior: 1, absorption: {}}}", inner))
            .material("black", "{type: diffuse, reflectance: 0}")
            .box("pool", {-2, -2, -2}, {2, 2, 2}, "water")
            .box("cube", {-1, 0, -1}, {1, 0.5, 1}, "jelly")
            .quad("lamp", "[[-1,-1,-1],[-1,-1,1],[1,-1,1],[1,-1,-1]]", "black", "1")
            .yaml();
    };
    context.estimate(
        "through a body in water to a lamp in the water: absorbing over clear",
        {through(0.7, 1.5), through(0, 0)},
        [](const std::vector<Film>& f) { return radiance(f[0]) / radiance(f[1]); },
        std::exp(-0.7 * (1.5 + 1) - 1.5 * 0.5), 0.002, effort,
        {{std::exp(-0.7 * 1.5 - 1.5 * 0.5), "behind the inner body there is nothing"},
         {std::exp(-0.7 * 3 - 1.5 * 0.5), "the inner body absorbs as the outer one does, too"}});
}

}  // namespace

std::vector<Case> glasswareCases() {
    constexpr std::uint64_t light = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT;
    constexpr std::uint64_t sky = CRT_FEATURE_ENVIRONMENT;
    constexpr std::uint64_t rough = CRT_FEATURE_ROUGH_DIELECTRIC;
    return {
        row("G13", "rough-glass",
            "Rough glass of roughness .1, .5 and 1 in a constant "
            "environment, at 0°, 60° and 85° from both "
            "sides; in a glowing room, with and without light sampling; clear cubes of roughness .1 to 1",
            "the shares of light that GGX reflects and refracts once, by quadrature in double, and what is "
            "lost given back; n² in refraction; a clear cube cannot be seen",
            "Walter et al. (2007); Heitz (2014); Kulla and Conty (2017); conservation of energy",
            "± 0.2 %; ± 0.3 %", Level::Commit,
            sky | light | CRT_FEATURE_NEE | CRT_FEATURE_DISPERSION | CRT_FEATURE_TABLE | rough,
            roughGlassFurnace),
        row("G14", "rough-glass-limits", "Rough glass of index 1; of a roughness that goes to 0",
            "nothing, to the bit; the smooth dielectric, to the bit; Fresnel's reflectance",
            "Fresnel's equations", "same bits; ± 0.2 %", Level::Commit, sky | light | rough,
            roughGlassLimits),
        row("G15", "rough-dispersion",
            "A cube of rough glass whose index changes only where there is no light, over one of constant "
            "index",
            "1", "light of one wavelength knows of no other", "± 0.5 %", Level::Commit,
            sky | rough | CRT_FEATURE_DISPERSION | CRT_FEATURE_TABLE, roughDispersion),
        row("G16", "pane", "A thin pane: what it reflects, and a small lamp seen through it",
            "T = (1 − R)/(1 + R) of each polarisation straight on, the rest mirrored",
            "geometric series of internal reflections (Stokes 1862)", "± 0.1 %", Level::Commit,
            sky | light | CRT_FEATURE_THIN_DIELECTRIC, pane),
        row("G17", "plastic",
            "A diffuse base of albedo .5 and 1 under a smooth and a rough coat in a constant environment, "
            "at 0°, 60° and 85°; and in a glowing room, with and without light sampling",
            "what the coat mirrors once, and the series of rounds between it and the base; 1 for a white "
            "base",
            "quadrature in double; conservation of energy", "2e-3", Level::Commit,
            sky | light | CRT_FEATURE_NEE | CRT_FEATURE_PLASTIC | CRT_FEATURE_TABLE, plasticFurnace),
        row("G18", "absorption",
            "An absorbing slab before a lamp, from outside and inside; a floor and a lamp under water, and "
            "a "
            "lamp mirrored there by a glass cube",
            "(1 − R)² A / (1 − R² A²) and A = exp(−σ d)", "Beer and Lambert; geometric series",
            "± 0.1 %; 1e-5", Level::Commit,
            sky | light | CRT_FEATURE_NEE | CRT_FEATURE_DIELECTRIC | CRT_FEATURE_MEDIA | rough,
            absorbingSlab),
    };
}

}  // namespace crt::verify
