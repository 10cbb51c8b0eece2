// Group F: stiff transport. The condition number of L = E / (1 − ρ) is ρ / (1 − ρ): what a rounding
// or a bias does grows with it.
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"

#include "film/error_estimate.h"
#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace crt::verify {
namespace {

constexpr std::uint64_t kDiffuseLight = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT;

std::string furnace(double albedo, const std::string& integrator,
                    const std::string& film = "{resolution: [2, 2]}") {
    Cube cube;
    cube.reflectance = fmt::format("{}", albedo);
    cube.integrator = integrator;
    cube.film = film;
    return yaml(cube);
}

/// The furnace at `albedo` and `depth`: exact but for rounding, which the condition number multiplies.
void stiffFurnace(Context& context, double albedo, int depth) {
    const std::string integrator = "{{max_depth: {}, roulette: false, nee: false}}";
    const Film emitted =
        context.render(furnace(albedo, fmt::format(fmt::runtime(integrator), 0)), {.samples = 1});
    const Film film =
        context.render(furnace(albedo, fmt::format(fmt::runtime(integrator), depth)), {.samples = 1});
    const double condition = albedo / (1 - albedo), expected = furnaceRadiance(albedo, depth);
    const double tolerance = 4 * condition * std::ldexp(1.0, -24) + depth * std::ldexp(1.0, -25);
    const double measured = expected * worstRatio(film, emitted, expected);
    context.relative(fmt::format("albedo {}, {} events: the worst pixel", albedo, depth), measured, expected,
                     tolerance,
                     {{furnaceRadiance(albedo, std::min(depth, 255)),
                       "paths end after 255 events: is the depth kept in 8 bits?"},
                      {furnaceRadiance(albedo, std::min(depth, 65535)),
                       "paths end after 65535 events: is the depth kept in 16 bits?"}});
    context.relative("rays of a path", static_cast<double>(context.report().closest_rays) / 4, depth + 1.0,
                     0, {{0, "paths end before their depth: does something leak out of the box?"}});
}

/// The same, ended by roulette: the error of 1 % costs 1/(1 − ρ) times the paths that it should.
void stiffRoulette(Context& context, double albedo, const Effort& effort) {
    context.estimate(fmt::format("albedo {}, ended by roulette alone", albedo),
                     furnace(albedo, "{max_depth: 1000000000, nee: false}"), meanRadiance, 1 / (1 - albedo),
                     0.01, effort, {{2 / (1 - albedo), "survivors of roulette weigh too much"}});
}

void albedo9(Context& context) {
    stiffFurnace(context, 0.9, 65);
    stiffRoulette(context, 0.9, {.samples = 256, .most = 4096});
}
void albedo99(Context& context) {
    stiffFurnace(context, 0.99, 687);
    if (context.atLeast(Level::Merge)) stiffRoulette(context, 0.99, {.samples = 256, .most = 4096});
}
void albedo999(Context& context) {
    stiffFurnace(context, 0.999, 6904);
    if (context.atLeast(Level::Merge)) stiffRoulette(context, 0.999, {.samples = 256, .most = 4096});
}
void albedo9999(Context& context) {
    stiffFurnace(context, 0.9999, 69074);
    if (context.atLeast(Level::Nightly)) stiffRoulette(context, 0.9999, {.samples = 1024, .most = 16384});
}

void depths(Context& context) {
    const Film emitted =
        context.render(furnace(0.5, "{max_depth: 0, roulette: false, nee: false}"), {.samples = 4});
    for (const int depth : {0, 1, 2, 10000}) {
        const Film film = context.render(
            furnace(0.5, fmt::format("{{max_depth: {}, roulette: false, nee: false}}", depth)),
            {.samples = 4});
        context.relative(fmt::format("depth {}", depth), radiance(film) / radiance(emitted),
                         furnaceRadiance(0.5, depth), 2e-6);
    }
    const Film endless =
        context.render(furnace(0.5, "{max_depth: 1000000000, nee: false}"), {.samples = 64});
    context.holds("depth 1000000000, ended by roulette: the mean exists",
                  luminance(endless) > luminance(emitted), "brighter than what is emitted", "");
}

void pathsThatNeverEnd(Context& context) {
    // A box of perfect mirrors: throughput is 1 for ever, so that only the depth ends the path, and the time
    // is linear in it.
    Cube cube;
    const auto mirrors = [&](int depth) {
        cube.emitting = "none";
        cube.film = "{resolution: [2, 2]}";
        cube.integrator = fmt::format("{{max_depth: {}}}", depth);
        std::string text = yaml(cube);
        text.replace(text.find("{type: diffuse, reflectance: 0.5}"), 33, "{type: mirror, reflectance: 1}");
        return text;
    };
    for (const int depth : {10, 1000, 100000}) {
        context.render(mirrors(depth), {.samples = 4});
        context.relative(fmt::format("mirror box: rays of a path at depth {}", depth),
                         static_cast<double>(context.report().closest_rays) / 16, depth + 1.0, 0);
    }
    // A right-angled prism of n = 1.5 sends back what enters through its hypotenuse: 45° is beyond the
    // critical angle. The lamp fills the half space of the eye; what left through the legs would be black.
    const auto prism = [](int depth, bool glass) {
        Stage stage("{position: [0, 0, 5], target: [0.05, 0.02, 0], fov: 0.1}",
                    fmt::format("{{max_depth: {}, roulette: false}}", depth));
        stage.material("black", "{type: diffuse, reflectance: 0}")
            .material("glass", "{type: dielectric, ior: 1.5}");
        if (glass)
            stage.mesh("prism", "[[-1,-1,0],[1,-1,0],[0,-1,-1],[-1,1,0],[1,1,0],[0,1,-1]]",
                       "[[0,2,1],[3,4,5],[0,1,4,3],[1,2,5,4],[2,0,3,5]]", "glass");
        stage.quad("lamp",
                   glass ? "[[-90,-90,6],[-90,90,6],[90,90,6],[90,-90,6]]"
                         : "[[-90,-90,-1],[90,-90,-1],[90,90,-1],[-90,90,-1]]",
                   "black", "1");
        return stage.yaml();
    };
    const Film lamp = context.render(prism(0, false), {.samples = 64});
    context.relative(
        "retroreflecting prism",
        radiance(context.render(prism(200, true), {.samples = 64})) / radiance(lamp), 1, 1e-5,
        {{0.04,
          "only the hypotenuse reflects: light leaves through the legs, where it is totally reflected"}});
}

void deepDimensions(Context& context) {
    // Past any table of dimensions Sobol points must still be as good as independent numbers, and not the
    // first ones again.
    const auto room = [](const char* sampler) {
        Cube cube;
        cube.reflectance = "0.999";
        cube.emitting = "ceiling";
        cube.integrator = "{max_depth: 1000, roulette: false, nee: false}";
        cube.more = fmt::format("sampler: {{type: {}}}\n", sampler);
        return yaml(cube);
    };
    for (const char* other : {"independent", "xorshift"})
        context.estimate(fmt::format("a room of albedo 0.999 at depth 1000: sobol over {}", other),
                         {room("sobol"), room(other)},
                         [](const std::vector<Film>& f) { return radiance(f[0]) / radiance(f[1]); }, 1, 0.01,
                         {.samples = 16, .most = 1024}, {});
}

void rouletteDepths(Context& context) {
    for (const int start : {0, 1, 4, 16, 1000}) {
        Cube cube;
        cube.emitting = "ceiling";
        cube.camera = kFloorCentre;
        cube.integrator = fmt::format("{{max_depth: 64, roulette_depth: {}}}", start);
        context.estimate(fmt::format("unit cube, roulette from event {} on", start), yaml(cube),
                         meanRadiance, .197603, 0.005, {.samples = 1024, .most = 16384});
    }
}

void slits(Context& context) {
    // A floor point under a long slit of width w at height 1, lit by the environment, which only scattered
    // rays find: the share of a path's variance is 1/p − 1. Walls close the space under the plates, whose
    // rims, 100 away, would let in 8.5e-5.
    const auto scene = [](double width) {
        return Stage("{position: [0, 0.3, 0.6], target: [0, 0, 0], fov: 0.001}", kDirect)
            .set("environment", "{radiance: 1}")
            .set("sampler", "{type: independent}")
            .material("white", "{type: diffuse, reflectance: 1}")
            .material("black", "{type: diffuse, reflectance: 0}")
            .quad("floor", "[[-100,0,-100],[-100,0,100],[100,0,100],[100,0,-100]]", "white")
            .quad("left", fmt::format("[[-100,1,-100],[{0},1,-100],[{0},1,100],[-100,1,100]]", -width / 2),
                  "black")
            .quad("right", fmt::format("[[{0},1,-100],[100,1,-100],[100,1,100],[{0},1,100]]", width / 2),
                  "black")
            .mesh("walls",
                  "[[-100,0,-100],[100,0,-100],[100,0,100],[-100,0,100],[-100,1,-100],[100,1,-100],[100,1,"
                  "100],[-100,1,100]]",
                  "[[0,1,5,4],[1,2,6,5],[2,3,7,6],[3,0,4,7]]", "black")
            .yaml();
    };
    // Y² is of the whole colour, so that wavelengths add their own, constant, share: E[w²] of the empty
    // environment.
    const std::string sky = Stage("{position: [0,0,0], target: [0,0,1], fov: 1}")
                                .set("environment", "{radiance: 1}")
                                .set("sampler", "{type: independent}")
                                .yaml();
    const Film sky_film = context.render(sky, {.samples = 65536, .squares = true});
    const double second = sky_film.mean(0, 0, firstChannel(sky_film.shape().aovs, kAovSquares));
    struct Slit {
        double width;
        Level level;
        Effort effort;
    };
    for (const Slit& s : {Slit{0.1, Level::Commit, {.samples = 16384, .most = 65536}},
                          {0.01, Level::Merge, {.samples = 65536, .most = 524288}},
                          {0.001, Level::Nightly, {.samples = 4194304, .most = 8388608}}}) {
        if (!context.atLeast(s.level)) continue;
        const double h = s.width / 2;
        // The plates end at 100, and so does the slit.
        const double p = polygonFormFactor({0, 0, 0}, {0, 1, 0},
                                           {{-h, 1, -100}, {h, 1, -100}, {h, 1, 100}, {-h, 1, 100}});
        context.estimate(fmt::format("slit of width {}", s.width), scene(s.width), meanRadiance, p, 0.02,
                         s.effort);
        const Film film =
            context.render(scene(s.width), {.samples = s.effort.samples, .seed = 99, .squares = true});
        context.relative(fmt::format("slit of width {}: variance of a path", s.width), pathVariance(film),
                         p * second - p * p, 0.1);
    }
}

void rareEvent(Context& context) {
    // One path in a million finds the lamp, and brings a million. Before the first has, the error must be
    // unknown, not zero.
    const double side = std::sqrt(1e-6 * std::numbers::pi);
    const std::string scene =
        squareOverFloor(0, "{max_depth: 1, roulette: false, nee: false}", side / 2, "1e6");
    const Film none = context.render(scene, {.samples = 16, .seed = 5});
    context.holds("no hit among 256 paths: the error is unknown", radiance(none) > 0 || !estimateError(none),
                  "no estimate",
                  "a black image claims to be exact: a render bounded by its error stops at once");
    if (!context.atLeast(Level::Merge)) return;
    // With hits, the estimate of the error must cover the error.
    const Film some = context.render(scene, {.samples = 1u << 22, .seed = 5});
    const double expected = 1e6 * squareFormFactor(0, side / 2), l = radiance(some);
    const auto error = estimateError(some);
    const double estimated = error ? error->mean_standard_error / error->mean_luminance : 0;
    context.holds("with some 67 hits the error estimate covers the error",
                  std::abs(l / expected - 1) < 5 * estimated, "within 5 standard errors",
                  "the error estimate is too small for rare events",
                  fmt::format("measured {:.4g} of {:.4g}, estimated error {:.3g}", l, expected, estimated));
}

Case furnaceCase(const char* id, const char* name, double albedo, int depth, const char* roulette,
                 void (*run)(Context&)) {
    const double condition = albedo / (1 - albedo);
    return {
        .id = id,
        .name = name,
        .title = fmt::format("A01 at albedo {}: {} scattering events", albedo, depth),
        .expected = fmt::format("{:.9g}; every path of {} rays", furnaceRadiance(albedo, depth), depth + 1),
        .source = "geometric series",
        .tolerance = fmt::format("{:.2g}: 4·cond·2⁻²⁴ + k·2⁻²⁵, condition {:.0f}; "
                                  "with roulette ± 1 % {}",
                                 4 * condition * std::ldexp(1.0, -24) + depth * std::ldexp(1.0, -25),
                                 condition, roulette),
        .level = Level::Commit,
        .needs = kDiffuseLight,
        .run = run};
}

}  // namespace

std::vector<Case> stiffCases() {
    return {
        furnaceCase("F01", "albedo-0.9", 0.9, 65, "", albedo9),
        furnaceCase("F02", "albedo-0.99", 0.99, 687, "from level merge on", albedo99),
        furnaceCase("F03", "albedo-0.999", 0.999, 6904, "from level merge on", albedo999),
        furnaceCase("F04", "albedo-0.9999", 0.9999, 69074, "at level nightly", albedo9999),
        {.id = "F05",
         .name = "depths",
         .title = "Depths 0, 1, 2, 10000 and 10⁹",
         .expected = "the furnace's series",
         .source = "geometric series; docs/scene.md",
         .tolerance = "2e-6",
         .level = Level::Commit,
         .needs = kDiffuseLight,
         .run = depths},
        {.id = "F06",
         .name = "endless-paths",
         .title = "A box of perfect mirrors, and a retroreflecting prism",
         .expected = "paths end at the depth, exactly; the prism sends back all light",
         .source = "throughput 1 for ever; total internal reflection at 45°",
         .tolerance = "exactly; 1e-5",
         .level = Level::Commit,
         .needs = CRT_FEATURE_CONDUCTOR | CRT_FEATURE_DIELECTRIC | CRT_FEATURE_AREA_LIGHT,
         .run = pathsThatNeverEnd},
        {.id = "F07",
         .name = "deep-dimensions",
         .title = "1000 events, 4000 dimensions: Sobol points against independent numbers and xorshift",
         .expected = "the same mean",
         .source = "both are unbiased",
         .tolerance = "ratio 1 ± 1 %",
         .level = Level::Merge,
         .needs = kDiffuseLight,
         .run = deepDimensions},
        {.id = "F08",
         .name = "roulette-depths",
         .title = "Roulette from event 0, 1, 4, 16 or 1000 on",
         .expected = "0.197603 in the unit cube wherever it starts",
         .source = "as A07; docs/scene.md",
         .tolerance = "± 0.5 %",
         .level = Level::Merge,
         .needs = kDiffuseLight | CRT_FEATURE_NEE,
         .run = rouletteDepths},
        {.id = "F09",
         .name = "slit",
         .title =
             "Light through a slit of width 0.1 (0.01 from level merge on, 0.001 at level nightly) that "
             "only chance finds",
         .expected = "its form factor p, and a variance of p·E[w²] − p² a path",
         .source = "Lambert's formula; Bernoulli's variance",
         .tolerance = "± 2 %; variance 10 %",
         .level = Level::Commit,
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_INDEPENDENT,
         .run = slits},
        {.id = "F10",
         .name = "rare-event",
         .title = "A lamp that one path in a million finds",
         .expected = "no error estimate before it is found; afterwards one that covers the error",
         .source = "a sample without the event says nothing about it",
         .tolerance = "5 standard errors",
         .level = Level::Commit,
         .needs = kDiffuseLight,
         .run = rareEvent},
    };
}

}  // namespace crt::verify
