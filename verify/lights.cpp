// Group E: lights that are bright, dim, tiny, near, edge-on, many, or nothing.
//
// Over 450 lines: cases, each a scene and its answer, that share nothing with their neighbours.
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"

#include "compile/distributions.h"
#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace crt::verify {
namespace {

constexpr std::uint64_t kDirectLight = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE;

/// A sum of `film` over `factor` times that of `unit`, of all pixels' X, Y and Z the ratio that is farthest
/// from 1. NaN when any is.
double worstFactor(const Film& film, const Film& unit, double factor) {
    double worst = 1;
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x)
            for (std::uint32_t c = 0; c < 3; ++c)
                worst = fartherFrom(1, worst, film.sum(x, y, c) / (unit.sum(x, y, c) * factor));
    return worst;
}

void brightness(Context& context) {
    const Film unit = context.render(squareOverFloor(0, kDirect), {.samples = 64});
    const auto with = [&](const std::string& radiance) {
        return context.render(squareOverFloor(0, kDirect, 0.5, radiance), {.samples = 64});
    };
    for (const int m : {-80, -30, 10, 30, 80})
        context.relative(
            fmt::format("radiance 2^{}: the worst of all sums", m),
            worstFactor(with(fmt::format("{:.17g}", std::ldexp(1.0, m))), unit, std::ldexp(1.0, m)), 1, 0,
            {});
    for (const int m : {-24, -10, 10, 24})
        context.relative(fmt::format("radiance 1e{}: the worst of all sums", m),
                         worstFactor(with(fmt::format("1e{}", m)), unit, std::pow(10.0, m)), 1, 1e-6);
}

/// Two floors far apart, each under its own lamp; the eye is on the one at x.
std::string twoLamps(double x, const std::string& left, const std::string& right) {
    Stage stage(fmt::format("{{position: [{0}, 0.5, 3], target: [{0}, 0, 0], fov: 0.01}}", x), kDirect);
    stage.material("floor", "{type: diffuse, reflectance: 1}")
        .material("black", "{type: diffuse, reflectance: 0}");
    stage.quad("floor", "[[-40,0,-40],[-40,0,40],[40,0,40],[40,0,-40]]", "floor");
    stage.quad("screen", "[[0,0,-20],[0,20,-20],[0,20,20],[0,0,20]]", "black");
    stage.quad("left", "[[-2.5,1,-0.5],[-1.5,1,-0.5],[-1.5,1,0.5],[-2.5,1,0.5]]", "black", left);
    stage.quad("right", "[[1.5,1,-0.5],[2.5,1,-0.5],[2.5,1,0.5],[1.5,1,0.5]]", "black", right);
    return stage.yaml();
}

void brightAndDim(Context& context) {
    // A screen keeps their light apart; both are chosen among, by power.
    const double f = squareFormFactor(0, 0.5);
    context.estimate("under the lamp of 1e+10, beside one of 1e-10", twoLamps(2, "1e-10", "1e10"),
                     meanRadiance, 1e10 * f, 0.001, {.samples = 1024, .most = 16384});
    context.estimate(
        "two equal lamps, one of them hidden", twoLamps(2, "1", "1"), meanRadiance, f, 0.003,
        {.samples = 1024, .most = 65536},
        {{2 * f,
          "light sampling forgets that it chose between two lamps: its pdf is not divided by their number"},
         {f / 2, "the probability of choosing a lamp is applied twice"}});
}

void hopelesslyDim(Context& context) {
    const double f = squareFormFactor(0, 0.5);
    // The dim lamp is chosen by light sampling once in 2³² times: the scattered rays that meet it must
    // count in full.
    context.estimate("under the lamp of 1e-10, beside one of 1e+10", twoLamps(-2, "1e-10", "1e10"),
                     meanRadiance, 1e-10 * f, 0.01, {.samples = 4096, .most = 65536},
                     {{0, "the dim lamp is never sampled, and scattered rays that meet it do not count"}});
}

void secondMoment(Context& context) {
    const Film unit = context.render(squareOverFloor(0, kDirect), {.samples = 64, .squares = true});
    const Film bright =
        context.render(squareOverFloor(0, kDirect, 0.5, "1e20"), {.samples = 64, .squares = true});
    context.relative(
        "variance of a path at radiance 1e20, over 1e40 times that at 1",
        pathVariance(bright, 0, 0) / pathVariance(unit, 0, 0) / 1e40, 1, 1e-5,
        {{std::numeric_limits<double>::infinity(), "the second moment, 1e40, is kept in single precision"}});
}

void tinyLight(Context& context) {
    for (const double half : {5e-3, 5e-4, 5e-5, 5e-6})
        context.estimate(fmt::format("half side {:g}", half), squareOverFloor(0, kDirect, half),
                         meanRadiance, squareFormFactor(0, half), 0.003, {.samples = 256, .most = 16384});
}

void edgeOn(Context& context) {
    // The receiver is not on the floor's diagonal, from which positions are drawn away by a few parts in a
    // million (surface.h).
    const auto scene = [](const char* lamp, const char* radiance) {
        return Stage("{position: [0, 0.5, 3], target: [0, 0, 0], fov: 0.000001}", kDirect)
            .material("floor", "{type: diffuse, reflectance: 1}")
            .material("black", "{type: diffuse, reflectance: 0}")
            .quad("floor", "[[-40,0,-41],[-40,0,39],[40,0,39],[40,0,-41]]", "floor")
            .quad("lamp", lamp, "black", radiance)
            .yaml();
    };
    const auto dark = [&](const char* what, const std::string& yaml, const char* physics) {
        const Film film = context.render(yaml, {.samples = 4096});
        context.relative(what, radiance(film), 0, 0, {{radiance(film), physics}});
    };
    dark("its plane passes through the receiver",
         scene("[[1,0,-1],[1,0,1],[2,0,1],[2,0,-1]]", "1, two_sided: true"),
         "light arrives along a surface, where the cosine is 0");
    dark("it looks away", scene("[[-0.5,1,-0.5],[-0.5,1,0.5],[0.5,1,0.5],[0.5,1,-0.5]]", "1"),
         "a one-sided lamp shines from its back");
    dark("it is below the floor",
         scene("[[-0.5,-1,-0.5],[0.5,-1,-0.5],[0.5,-1,0.5],[-0.5,-1,0.5]]", "1, two_sided: true"),
         "light comes through the floor");
    // Upright above the receiver, seen exactly edge-on but for the width of the eye's needle, which sees it
    // from a little to either side.
    context.absolute(
        "upright, seen edge-on",
        radiance(context.render(scene("[[0,1,-0.5],[0,2,-0.5],[0,2,0.5],[0,1,0.5]]", "1, two_sided: true"),
                                {.samples = 4096})),
        0, 1e-6);
}

void nearLight(Context& context) {
    // A floor that the lamp nearly touches: 1/r² must not spoil it, and in the limit the lamp is all there
    // is to be seen.
    for (const double height : {1e-1, 1e-2, 1e-3, 1e-4, 2e-5}) {
        const auto scene =
            Stage(fmt::format("{{position: [0.7, {0}, 0], target: [0, 0, 0], fov: 0.0001}}", height / 2),
                  kDirect)
                .material("floor", "{type: diffuse, reflectance: 1}")
                .material("black", "{type: diffuse, reflectance: 0}")
                .quad("floor", "[[-1,0,-1],[-1,0,1],[1,0,1],[1,0,-1]]", "floor")
                .quad("lamp",
                      fmt::format("[[-0.5,{0},-0.5],[0.5,{0},-0.5],[0.5,{0},0.5],[-0.5,{0},0.5]]", height),
                      "black", "1")
                .yaml();
        const double expected = squareFormFactor(0, 0.5 / height);
        context.estimate(fmt::format("receiver {} below the lamp", height), scene, meanRadiance, expected,
                         0.005, {.samples = 1024, .most = 16384},
                         {{0, "the lamp is closer than the distance that rays are moved off surfaces"}});
    }
    context.notApplicable("receiver 1e-6 below the lamp",
                          "below the clearance by which rays leave surfaces (docs/decisions/0004): gaps "
                          "down to 1e-5 of a surface's size are seen");
}

/// A03 with its lamp cut into n × n squares of two triangles.
Scene tiledLamp(const Context& context, int n) {
    Scene scene = context.scene(squareOverFloor(0, kDirect));
    Mesh& lamp = scene.meshes[scene.objects.back().mesh];
    lamp.positions.clear();
    lamp.triangles.clear();
    for (int z = 0; z <= n; ++z)
        for (int x = 0; x <= n; ++x)
            lamp.positions.push_back(
                {-0.5 + static_cast<double>(x) / n, 1, -0.5 + static_cast<double>(z) / n});
    const auto at = [n](int x, int z) { return static_cast<std::uint32_t>(z * (n + 1) + x); };
    for (int z = 0; z < n; ++z)
        for (int x = 0; x < n; ++x) {
            lamp.triangles.push_back({at(x, z), at(x + 1, z), at(x + 1, z + 1)});
            lamp.triangles.push_back({at(x, z), at(x + 1, z + 1), at(x, z + 1)});
        }
    return scene;
}

void tiledLight(Context& context) {
    for (const int n : {1, 2, 23, 230, 708}) {
        if (n > 23 && !context.atLeast(Level::Merge)) continue;
        if (n > 230 && !context.atLeast(Level::Nightly)) continue;
        const Scene scene = tiledLamp(context, n);
        std::vector<double> replicates;
        for (std::uint64_t seed = 1; seed <= 16; ++seed)
            replicates.push_back(radiance(context.render(scene, {.samples = 4096, .seed = seed})));
        context.equivalent(fmt::format("{} triangles", 2 * n * n), replicates, squareFormFactor(0, 0.5),
                           0.001);
    }
}

void choosingAmongMany(Context& context) {
    // Shares of 2³² that lights of equal power get, in the table that every backend reads.
    for (const std::size_t lights : {std::size_t{10}, std::size_t{1000}, std::size_t{10000000}}) {
        const std::vector<std::uint64_t> first = choiceTable(std::vector<double>(lights, 0.37));
        double worst = 1;
        for (std::size_t i = 0; i < lights; ++i) {
            const double share = static_cast<double>(first[i + 1] - first[i]) * std::ldexp(1.0, -32) *
                                 static_cast<double>(lights);
            worst = fartherFrom(1, worst, share);
        }
        // Whole numbers of 2³²: with 1e7 lights 429.5 each. The pdf is the share as it is, so this costs
        // noise, never truth.
        context.relative(fmt::format("{} lights: the most unequal share", lights), worst, 1, 0.005);
        context.relative(fmt::format("{} lights: shares add up to 2³²", lights),
                         static_cast<double>(first.back()), std::ldexp(1.0, 32), 0);
    }
    const std::vector<std::uint64_t> first = choiceTable({1e20, 1});
    context.holds("powers 1e20 : 1: the weak one can be chosen", first[2] > first[1],
        "at least once in 2³²",
                  "a light that is never chosen loses what only light sampling finds");
}

void emissiveSpecular(Context& context) {
    // The furnace of mirrors and of glass: emission belongs to the surface, whatever it does to light, and
    // counts once each time it is met.
    for (const double albedo : {0.5, 0.9}) {
        Cube cube;
        cube.integrator = "{max_depth: 30, roulette: false}";
        std::string mirrors = yaml(cube);
        mirrors.replace(mirrors.find("{type: diffuse, reflectance: 0.5}"), 33,
                        fmt::format("{{type: mirror, reflectance: {}}}", albedo));
        cube.integrator = "{max_depth: 0}";
        const Film unit = context.render(yaml(cube), {.samples = 16});
        const double expected = furnaceRadiance(albedo, 30);
        context.relative(fmt::format("box of glowing mirrors of reflectance {}", albedo),
                         radiance(context.render(mirrors, {.samples = 16})) / radiance(unit), expected, 2e-6,
                         {{1, "mirrors that glow do not reflect"},
                          {expected - 1, "mirrors that reflect do not glow"},
                          {2 * expected, "emission is counted twice"}});
    }
    // A pane of index 1 that glows on both sides adds its emission to what is behind it.
    const auto pane = [](int depth, bool there) {
        Stage stage("{position: [0, 0, 3], target: [0, 0, 0], fov: 1}",
                    fmt::format("{{max_depth: {}, roulette: false}}", depth));
        stage.set("environment", "{radiance: 1}").material("air", "{type: dielectric, ior: 1}");
        if (there)
            stage.quad("pane", "[[-9,-9,0],[9,-9,0],[9,9,0],[-9,9,0]]", "air", "0.5, two_sided: true");
        return stage.yaml();
    };
    context.relative("glowing pane of index 1",
                     radiance(context.render(pane(4, true), {.samples = 16})) /
                         radiance(context.render(pane(4, false), {.samples = 16})),
                     1.5, 2e-6, {{1, "glass that glows does not glow"}, {2, "emission is counted twice"}});
}

void noLight(Context& context) {
    const auto with = [](const char* radiance) { return squareOverFloor(0, kDirect, 0.5, radiance); };
    std::string none = with("1");
    none.replace(none.find(", emission: {radiance: 1}"), 25, "");
    context.relative("no lamp", radiance(context.render(none, {.samples = 16})), 0, 0);
    context.relative("a lamp of radiance 0", radiance(context.render(with("0"), {.samples = 16})), 0, 0);
}

void techniquesAgree(Context& context) {
    // Lamps from tiny to all-surrounding: light sampling, scattering and both must agree, and both together
    // must not be noisier than the better one.
    for (const double half : {0.05, 0.5, 5.0}) {
        const std::string both = squareOverFloor(0, kDirect, half),
                          scattering =
                              squareOverFloor(0, "{max_depth: 1, roulette: false, nee: false}", half);
        if (half > 0.1 || context.atLeast(Level::Merge))
            context.estimate(fmt::format("half side {}: light found by chance", half), scattering,
                             meanRadiance, squareFormFactor(0, half), half > 0.1 ? 0.005 : 0.01,
                             {.samples = 4096, .most = 65536},
                             {{squareFormFactor(0, half) / 2,
                               "what is found by chance is weighted although nothing competes"}});
        context.estimate(fmt::format("half side {}: both techniques", half), both, meanRadiance,
                         squareFormFactor(0, half), 0.002, {.samples = 1024, .most = 16384});
        // Independent numbers, so that the pixel's own variance is right.
        const auto variance = [&](std::string text) {
            text += "sampler: {type: independent}\n";
            return pathVariance(context.render(text, {.samples = 16384, .squares = true}));
        };
        // Veach's bound for two techniques of one sample each (1997, theorem 9.2): the better one's and
        // μ²/2 more. It matters where chance alone has hardly any noise; elsewhere 1.1.
        const double ratio = variance(both) / variance(scattering);
        const double bound = half > 1 ? 1.5 : 1.1;
        context.holds(fmt::format("half side {}: variance of both over that of chance alone", half),
                      ratio <= bound, fmt::format("≤ {}", bound),
                      "combining two techniques makes more noise than one of them: are the weights wrong?",
                      fmt::format("{:.4g}", ratio));
    }
}

void hiddenLamps(Context& context) {
    // Light that comes round corners: a lamp behind a door that is ajar, and a lamp within glass. With and
    // without light sampling the mean is one.
    const auto ajar = [](bool nee) {
        Cube cube;
        cube.reflectance = "0.7";
        cube.emitting = "ceiling";
        cube.camera = kFloorQuarter;
        cube.integrator = fmt::format("{{max_depth: 8, roulette: false, nee: {}}}", nee);
        return yaml(cube) +
               "  - {name: door, mesh: {positions: [[0,0.7,0],[0.85,0.7,0],[0.85,0.7,1],[0,0.7,1]], faces: "
               "[[0,1,2,3]]}, material: wall}\n";
    };
    const auto in_glass = [](bool nee) {
        return Stage("{position: [0.5, 0.9, 0.1], target: [0.5, 0, 0.5], fov: 0.01}",
                     fmt::format("{{max_depth: 8, roulette: false, nee: {}}}", nee))
            .material("wall", "{type: diffuse, reflectance: 0.7}")
            .material("glass", "{type: dielectric, ior: 1.5}")
            .quad("floor", "[[-1,0,-1],[-1,0,2],[2,0,2],[2,0,-1]]", "wall")
            .box("shell", {0.2, 0.2, 0.2}, {0.8, 0.5, 0.8}, "glass")
            .box("lamp", {0.3, 0.3, 0.3}, {0.7, 0.4, 0.7}, "wall, emission: {radiance: 1}")
            .yaml();
    };
    const JointMeasure ratio = [](const std::vector<Film>& f) { return radiance(f[0]) / radiance(f[1]); };
    context.estimate("behind a door: with over without light sampling", {ajar(true), ajar(false)}, ratio, 1,
                     0.01, {.samples = 4096, .most = 65536});
    context.estimate(
        "a lamp within glass: with over without light sampling", {in_glass(true), in_glass(false)}, ratio, 1,
        0.01, {.samples = 1024, .most = 65536},
        {{2, "a caustic is counted by light sampling, too: do shadow rays pass through glass?"}});
}

void enormousPdf(Context& context) {
    // A lamp of side 2e-12 at distance 1: its pdf per steradian is 2.5e23, and the square of that is beyond
    // single precision.
    const double half = 1e-12;
    context.estimate("half side 1e-12", squareOverFloor(0, kDirect, half), meanRadiance,
                     squareFormFactor(0, half), 0.003, {.samples = 256, .most = 4096},
                     {{0, "the lamp is lost: does its pdf, or the square of it, overflow?"}});
}

/// A floor in a black room with a square opening in its ceiling, at height 1 over the camera's point.
Stage roomWithOpening(const std::string& floor, bool light_sampling, const std::string& integrator) {
    return Stage("{position: [0.02, 0.05, 0], target: [0, 0, 0], fov: 0.01}", integrator)
        .set("environment", fmt::format("{{radiance: 1, light_sampling: {}}}", light_sampling))
        .material("floor", floor)
        .material("black", "{type: diffuse, reflectance: 0}")
        .quad("floor", "[[-4,0,-4],[-4,0,4],[4,0,4],[4,0,-4]]", "floor")
        .quad("west", "[[-4,0,-4],[-4,1,-4],[-4,1,4],[-4,0,4]]", "black")
        .quad("east", "[[4,0,-4],[4,0,4],[4,1,4],[4,1,-4]]", "black")
        .quad("north", "[[-4,0,-4],[4,0,-4],[4,1,-4],[-4,1,-4]]", "black")
        .quad("south", "[[-4,0,4],[-4,1,4],[4,1,4],[4,0,4]]", "black")
        .quad("ceiling_west", "[[-4,1,-4],[-0.5,1,-4],[-0.5,1,4],[-4,1,4]]", "black")
        .quad("ceiling_east", "[[0.5,1,-4],[4,1,-4],[4,1,4],[0.5,1,4]]", "black")
        .quad("ceiling_north", "[[-0.5,1,-4],[0.5,1,-4],[0.5,1,-0.5],[-0.5,1,-0.5]]", "black")
        .quad("ceiling_south", "[[-0.5,1,0.5],[0.5,1,0.5],[0.5,1,4],[-0.5,1,4]]", "black");
}

/// A grey floor, its edge 4 away, under a sky of radiance 1; seen from height 1 towards `target`.
std::string greyFloorUnderSky(const char* target, bool light_sampling) {
    return Stage(fmt::format("{{position: [0, 1, 0.5], target: {}, fov: 10}}", target))
        .set("environment", fmt::format("{{radiance: 1, light_sampling: {}}}", light_sampling))
        .material("grey", "{type: diffuse, reflectance: 0.5}")
        .quad("floor", "[[-4,0,-4],[-4,0,4],[4,0,4],[4,0,-4]]", "grey")
        .yaml();
}

void environmentLight(Context& context) {
    const std::string white = "{type: diffuse, reflectance: 1}";
    const double opening = squareFormFactor(0, 0.5);
    const std::vector<Mistake> mistakes = {
        {opening * 2, "the environment counts twice: by light sampling, and in full by rays that miss"},
        {opening / 2, "light sampling takes its share from rays that miss, and brings none itself"},
        {1, "shadow rays that leave the scene meet nothing: are only those triangles tested that can come "
            "between two points of it?"}};
    for (const bool sampled : {true, false})
        context.estimate(sampled ? "by light sampling and scattering" : "by scattering alone",
                         roomWithOpening(white, sampled, kDirect).yaml(), meanRadiance, opening, 0.002,
                         {.samples = 1024, .most = 65536}, mistakes);
    context.estimate(
        "the same with a BVH",
        roomWithOpening(white, true, "{max_depth: 1, roulette: false, accelerator: bvh}").yaml(),
        meanRadiance, opening, 0.002, {.samples = 1024, .most = 65536}, mistakes);

    // With a lamp inside, light sampling chooses between the two.
    const std::vector<Vec3d> lamp = {{0.8, 0.5, -0.2}, {1.2, 0.5, -0.2}, {1.2, 0.5, 0.2}, {0.8, 0.5, 0.2}};
    const double both = opening + 2 * polygonFormFactor({0, 0, 0}, {0, 1, 0}, lamp);
    const std::string lit = roomWithOpening(white, true, kDirect)
                                .quad("lamp", "[[0.8,0.5,-0.2],[1.2,0.5,-0.2],[1.2,0.5,0.2],[0.8,0.5,0.2]]",
                                      "black", "2")
                                .yaml();
    context.estimate("opening and lamp", lit, meanRadiance, both, 0.003, {.samples = 1024, .most = 65536},
                     {{opening, "the lamp is lost"}});

    // Open sky: light sampling and scattering draw from one density, so that each path brings albedo times
    // the environment.
    for (const bool sampled : {true, false}) {
        const Film film = context.render(greyFloorUnderSky("[0, 0, 0]", sampled), {.samples = 16});
        const Film empty = context.render(greyFloorUnderSky("[0, 2, 0]", false), {.samples = 16});
        context.relative(
            fmt::format("an open sky, {}: the worst pixel", sampled ? "sampled" : "by scattering alone"),
            worstRatio(film, empty, 0.5), 1, 2e-6);
    }

    if (!context.atLeast(Level::Merge)) return;
    const JointMeasure ratio = [](const std::vector<Film>& f) { return radiance(f[0]) / radiance(f[1]); };
    const std::string metal = "{type: rough_conductor, eta: 0.2, k: 3, roughness: 0.6}";
    const std::string integrator = "{max_depth: 3, roulette: false}";
    context.estimate("a floor of rough metal: with over without light sampling",
                     {roomWithOpening(metal, true, integrator).yaml(),
                      roomWithOpening(metal, false, integrator).yaml()},
                     ratio, 1, 0.005, {.samples = 1024, .most = 65536});
}

}  // namespace

std::vector<Case> lightCases() {
    return {
        row("E01", "brightness", "A03 with a radiance of 2^±80 and 1e±24", "every sum scaled alike",
            "linearity of light", "exactly; 1e-6", Level::Commit, kDirectLight, brightness),
        row("E02", "bright-and-dim",
            "Under a lamp of 1e+10 beside one of 1e-10, a screen between them; two equal ones, one hidden",
            "the floor as under its lamp alone", "rectangle formula", "± 0.1 %; ± 0.3 %", Level::Merge,
            kDirectLight, brightAndDim),
        row("E03", "second-moment", "Radiance 1e20: a second moment of 1e40",
            "1e40 times the variance at radiance 1", "scaling", "1e-5", Level::Commit, kDirectLight,
            secondMoment),
        row("E04", "tiny-light", "Lamps of half side 5e-3 to 5e-6 at distance 1",
            "the form factor, e.g. 3.18309885123e-9 for 5e-5", "rectangle formula", "± 0.3 %",
            Level::Commit,
            kDirectLight, tinyLight),
        row("E05", "edge-on", "A lamp in the receiver's plane, turned away, below the floor, seen edge-on",
            "nothing", "cosines that are 0", "exactly; seen edge-on ± 1e-6", Level::Commit, kDirectLight,
            edgeOn),
        row("E06", "near-light", "A floor 0.1 to 2e-5 below a lamp of side 1",
            "the form factor, in the limit 1", "rectangle formula", "± 0.5 %", Level::Commit, kDirectLight,
            nearLight),
        row("E07", "tiled-light",
            "The lamp of A03 as 2, 8 and 1058 triangles; 105800 at level merge, 1002528 at level nightly",
            "0.2394564705 always", "rectangle formula", "± 0.1 %", Level::Commit,
            kDirectLight | CRT_FEATURE_BVH, tiledLight),
        row("E08", "many-lights",
            "The choice of light sampling among up to 1e7 lights "
            "of equal power, and between powers of 1e20 : 1",
            "equal shares; the weak light at least once in 2³²", "arithmetic", "0.5 %", Level::Commit, 0,
            choosingAmongMany),
        row("E09", "hopelessly-dim", "Under a lamp of 1e-10 beside one of 1e+10, chosen by power",
            "the floor as under its lamp alone", "rectangle formula", "± 1 %", Level::Merge, kDirectLight,
            hopelesslyDim),
        row("E10", "emissive-specular", "Mirrors that glow, glass that glows",
            "E (1 − R^(k+1)) / (1 − R); the pane's emission once", "geometric series", "2e-6",
            Level::Commit,
            CRT_FEATURE_CONDUCTOR | CRT_FEATURE_DIELECTRIC | CRT_FEATURE_AREA_LIGHT |
                CRT_FEATURE_ENVIRONMENT,
            emissiveSpecular),
        row("E11", "no-light", "No lamp; radiance 0", "black", "docs/scene.md", "exactly", Level::Commit,
            kDirectLight, noLight),
        row("E12", "techniques",
            "Lamps of half side 0.05, 0.5 and 5, by light sampling with scattering and by scattering alone",
            "the form factor, and no more noise by both than by one", "rectangle formula; Veach's bound",
            "± 0.2 %, by chance ± 0.5 % (± 1 %); variance ≤ 1.1", Level::Commit,
            kDirectLight | CRT_FEATURE_INDEPENDENT, techniquesAgree),
        row("E13", "hidden-lamps",
            "A lamp behind an almost closed door, and one within glass: with and without light sampling",
            "the same mean", "both are unbiased", "ratio 1 ± 1 %", Level::Merge,
            kDirectLight | CRT_FEATURE_DIELECTRIC, hiddenLamps),
        row("E14", "enormous-pdf", "A lamp of half side 1e-12 at distance 1", "1.2732395447e-24",
            "rectangle formula", "± 0.3 %", Level::Commit, kDirectLight, enormousPdf),
        row("E15", "environment-light",
            "A floor under a square opening in a black ceiling, the environment sampled as a light or not; "
            "with a lamp beside it; under an open sky; of rough metal",
            "the opening's form factor, and the lamp's; half of the sky in every pixel; ratio 1",
            "rectangle formula, Lambert's polygon formula", "± 0.2 %, ± 0.3 %; 2e-6; ± 0.5 %",
            Level::Commit,
            kDirectLight | CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_ROUGH_CONDUCTOR, environmentLight),
    };
}

}  // namespace crt::verify
