// Group A: scenes whose radiance is known in closed form, or by deterministic quadrature.
//
// Over 450 lines: cases, each a scene and its answer, that share nothing with their neighbours.
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"

#include "base/vec3d.h"
#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <optional>
#include <random>
#include <set>
#include <utility>

namespace crt::verify {
namespace {

Cube furnace(double albedo, int depth, bool nee = false) {
    Cube cube;
    cube.reflectance = fmt::format("{}", albedo);
    cube.integrator = fmt::format("{{max_depth: {}, roulette: false, nee: {}}}", depth, nee);
    return cube;
}

void whiteFurnace(Context& context) {
    // Every path brings the same radiance whatever its directions and wavelengths, so the image at depth k
    // is the image at depth 0, the emitted radiance alone, times the closed form: no statistics, only
    // rounding. 2e-6 is 16 roundings of a sum of up to 65 terms.
    for (const double albedo : {0.5, 0.8}) {
        const Film emitted = context.render(yaml(furnace(albedo, 0)), {.samples = 4});
        for (const int depth : {1, 2, 8, 64}) {
            const double expected = furnaceRadiance(albedo, depth);
            const double measured =
                expected *
                worstRatio(context.render(yaml(furnace(albedo, depth)), {.samples = 4}), emitted, expected);
            context.relative(fmt::format("albedo {}, depth {}: the worst pixel", albedo, depth), measured,
                             expected, 2e-6,
                             {{furnaceRadiance(albedo, depth - 1),
                               "one scattering event too few: is the depth counted from 1?"},
                              {furnaceRadiance(albedo, depth + 1),
                               "one scattering event too many: is the depth counted from -1?"},
                              {furnaceRadiance(albedo * kPi, depth),
                               "every surface is 3.1416 times too bright: is a division by pi missing?"},
                              {furnaceRadiance(albedo / kPi, depth),
                               "every surface reflects 3.1416 times too little: is it divided by pi twice?"},
                              {1, "walls emit but do not reflect"}});
        }
    }
    context.estimate(
        "with light sampling, albedo 0.5, depth 8", yaml(furnace(0.5, 8, true)), meanRadiance,
        furnaceRadiance(0.5, 8), 0.002, {.samples = 64, .most = 4096},
        {{furnaceRadiance(0.5, 8) + 1, "emission is counted twice: by light sampling and by what is hit"}});
}

std::vector<Mistake> squareMistakes(double x) {
    // From (x, 0, 0) towards (u, 1, v): cosines at floor and lamp are both 1/r, the geometry factor 1/r⁴.
    const auto integral = [x](double power) {
        return rectangleIntegral(
                   [=](double u, double v) { return std::pow(1 + (u - x) * (u - x) + v * v, -power / 2); },
                   -0.5, 0.5, -0.5, 0.5) /
               kPi;
    };
    const double right = squareFormFactor(x, 0.5);
    return {{integral(3),
             "one of the two cosines is missing: the light's irradiance is not weighted by the angle at "
             "which it arrives on the floor, "
             "or leaves the lamp"},
            {integral(2), "both cosines are missing"},
            {integral(5), "a cosine is applied twice"},
            {right * kPi,
             "the floor is 3.1416 times too bright: is the division of Lambert's law by pi missing?"},
            {right / kPi, "the floor is 3.1416 times too dark: is Lambert's law divided by pi twice?"},
            {right * 2,
             "the lamp is counted twice: are light sampling and chance hits not weighted against each "
             "other, or both halves of the quad "
             "taken as the whole?"},
            {right / 2,
             "half of the lamp is missing: is one of its two triangles never sampled, or its area halved?"}};
}

void squareLight(Context& context) {
    const auto probe = [&](double x, double half_side, double delta) {
        context.estimate(fmt::format("light of side {:g}, receiver at offset {:g}", 2 * half_side, x),
                         squareOverFloor(x, kDirect, half_side), meanRadiance,
                         squareFormFactor(x, half_side), delta, {.samples = 256, .most = 16384},
                         half_side == 0.5 ? squareMistakes(x) : std::vector<Mistake>{});
    };
    for (const double x : {0.0, 1.0, 2.0}) probe(x, 0.5, 0.001);
    probe(20, 0.5, 0.005);
    probe(0, 1, 0.001);
}

/// Least distance of the points of the segment a b from the plane of the triangle: a cheap bound that keeps
/// triangles off the eye.
double distanceToPlane(const Vec3d& a, const Vec3d& b, const std::vector<Vec3d>& triangle) {
    const Vec3d normal = cross(triangle[1] - triangle[0], triangle[2] - triangle[0]);
    const double at_a = dot(normal, a - triangle[0]) / length(normal),
                 at_b = dot(normal, b - triangle[0]) / length(normal);
    return at_a * at_b <= 0 ? 0 : std::min(std::abs(at_a), std::abs(at_b));
}

/// Spectra with a step of .8 within a nanometre, and their complement.
constexpr const char* kSpiky =
    "{table: {nm: [360, 449, 450, 499, 500, 588, 589, 590, 650, 830], value: [0.1, 0.1, 0.9, 0.9, 0.1, 0.1, "
    "0.9, 0.1, 0.5, 0.5]}, outside: clamp}";
constexpr const char* kSpikyComplement =
    "{table: {nm: [360, 449, 450, 499, 500, 588, 589, 590, 650, 830], value: [0.9, 0.9, 0.1, 0.1, 0.9, 0.9, "
    "0.1, 0.9, 0.5, 0.5]}, outside: clamp}";

std::string table(const std::function<double(double)>& value_at) {
    std::string nm, value;
    for (int i = kWavelengthMin_nm; i <= kWavelengthMax_nm; ++i) {
        nm += fmt::format("{}{}", nm.empty() ? "" : ",", i);
        value += fmt::format("{}{:.17g}", value.empty() ? "" : ",", value_at(i));
    }
    return fmt::format("{{table: {{nm: [{}], value: [{}]}}, outside: clamp}}", nm, value);
}

void kirchhoff(Context& context) {
    // Walls of emissivity 1 − ρ(λ) radiate as a black body once light has been to and fro often enough;
    // at .9^181 what is missing is 5e-9. The same seed gives the same wavelengths, so each pixel is the
    // black one's.
    const auto room = [](const std::string& reflectance, const std::string& radiance, int depth) {
        Cube cube = furnace(0, depth);
        cube.reflectance = reflectance;
        cube.radiance = radiance;
        return yaml(cube);
    };
    const Film unit = context.render(room("0", "1", 0), {.samples = 64});
    context.relative("reflectance with steps of 0.8, emissivity its complement: the worst pixel",
                     worstRatio(context.render(room(kSpiky, kSpikyComplement, 180), {.samples = 64}), unit),
                     1, 1e-5);
    for (const double temperature : {2856.0, 5778.0}) {
        const auto planck = [=](double nm) { return planck_W_m3_sr(nm, temperature) * 1e-9; };
        // Slow in wavelength, so that the product of two linear interpolations is that of the product to
        // 1e-6.
        const auto reflectance = [](double nm) { return 0.5 + 0.4 * std::sin(nm / 40); };
        const Film black = context.render(
            room("0", fmt::format("{{blackbody: {}, normalise: false}}", temperature), 0), {.samples = 64});
        const Film grey =
            context.render(room(table(reflectance),
                                table([&](double nm) { return (1 - reflectance(nm)) * planck(nm); }), 180),
                           {.samples = 64});
        context.relative(fmt::format("{} K: a grey room against a black one: the worst pixel", temperature),
                         worstRatio(grey, black), 1, 1e-5);
        const Spectrum tabulated = blackbodySpectrum(temperature, false);
        for (const int nm : {400, 550, 700})
            context.relative(fmt::format("Planck's law at {} K and {} nm", temperature, nm),
                             tabulated[static_cast<std::size_t>(nm - kWavelengthMin_nm)], planck(nm), 1e-12);
    }
    // Wien: 2897.771955 µm·K.
    const Spectrum sun = blackbodySpectrum(5778, false);
    const auto peak =
        static_cast<double>(std::max_element(sun.values.begin(), sun.values.end()) - sun.values.begin()) +
        kWavelengthMin_nm;
    context.absolute("peak of 5778 K, nm", peak, 2897771.955 / 5778, 0.6);
}

void randomTriangles(Context& context) {
    // Each alone over the floor, one after another; some dip below it and are cut off by the horizon.
    // Equivalence must hold for every one, so the number of tests does not make passing easier. The effort
    // keeps growing, so that a right renderer fails as rarely as with one triangle alone.
    std::mt19937_64 random(20241);
    std::uniform_real_distribution<double> sideways(-2, 2), upward(-0.3, 2);
    const int count = context.atLeast(Level::Merge) ? 100 : 8;
    std::optional<Outcome> worst;
    for (int i = 0; i < count;) {
        std::vector<Vec3d> corners;
        for (int v = 0; v < 3; ++v) corners.push_back({sideways(random), upward(random), sideways(random)});
        const double expected = polygonFormFactor({0, 0, 0}, {0, 1, 0}, corners);
        // Not between eye and receiver, and no sliver that is too thin to test anything.
        const double off =
            std::min({std::abs(corners[0][1]), std::abs(corners[1][1]), std::abs(corners[2][1])});
        if (expected < 0.01 || off < 0.05 || distanceToPlane({0, 0, 0}, {0.02, 0.05, 0}, corners) < 0.05)
            continue;
        ++i;
        std::string positions;
        for (const Vec3d& c : corners)
            positions +=
                fmt::format("{}[{:.17g},{:.17g},{:.17g}]", positions.empty() ? "" : ",", c[0], c[1], c[2]);
        const std::string scene =
            Stage("{position: [0.02, 0.05, 0], target: [0, 0, 0], fov: 0.01}")
                .material("floor", "{type: diffuse, reflectance: 1}")
                .material("black", "{type: diffuse, reflectance: 0}")
                .quad("floor", "[[-4,0,-4],[-4,0,4],[4,0,4],[4,0,-4]]", "floor")
                .mesh("lamp", "[" + positions + "]", "[[0,1,2]]", "black", "1, two_sided: true")
                .yaml();
        const Quantity quantity{fmt::format("the worst of {} triangles, number {}", count, i),
                                [](const std::vector<Film>& f) { return radiance(f.front()); }, expected};
        const Outcome o =
            context.estimated({quantity}, {scene}, 0.003, {.samples = 256, .most = 65536}, {}).front();
        const auto badness = [](const Outcome& x) {
            return std::pair(x.verdict, std::abs(*x.measured / *x.expected - 1));
        };
        if (!worst || badness(o) >= badness(*worst)) worst = o;
    }
    context.add(*worst);
}

void mirrorWall(Context& context) {
    // The mirror adds the image of the lamp behind it. The same seed gives the same direct light, so the
    // difference is the image alone; only scattered rays find it, which must not be weighted against light
    // sampling that cannot.
    const auto image = [](double x, const std::string& integrator, bool mirror) {
        std::string yaml = squareOverFloor(0, integrator);
        yaml.replace(yaml.find("materials: {"), 12, "materials: {mirror: {type: mirror, reflectance: 1}, ");
        // The scene's extent is the same with and without, so that rounding is, too.
        const std::string corners =
            fmt::format("[[{0},0,-40],[{0},0,40],[{0},80,40],[{0},80,-40]]", mirror ? x : 40);
        return yaml +
               fmt::format(
                   "  - {{name: mirror, mesh: {{positions: {}, faces: [[0,1,2,3]]}}, material: mirror}}\n",
                   corners);
    };
    const auto ask = [&](double x, double delta, const Effort& effort) {
        const double expected = squareFormFactor(2 * x, 0.5);
        context.estimate(fmt::format("image of the lamp in a mirror at {:g}", x),
                         {image(x, "{max_depth: 2, roulette: false}", true),
                          image(x, "{max_depth: 2, roulette: false}", false)},
                         [](const std::vector<Film>& f) { return radiance(f[0]) - radiance(f[1]); },
                         expected, delta, effort,
                         {{expected / 2,
                           "half of the image is missing: is what a mirror shows weighted against light "
                           "sampling, which cannot find it?"}});
    };
    const double lamp = squareFormFactor(0, 0.5), both = lamp + squareFormFactor(4, 0.5);
    context.estimate("lamp and image together, mirror at 2",
                     image(2, "{max_depth: 2, roulette: false}", true), meanRadiance, both, 0.003,
                     {.samples = 1024, .most = 16384}, {{lamp, "the image is missing"}});
    ask(0.75, 0.01, {.samples = 4096, .most = 65536});
    if (context.atLeast(Level::Merge)) ask(0.75, 0.003, {.samples = 16384, .most = 262144});
    if (context.atLeast(Level::Merge)) ask(2, 0.02, {.samples = 16384, .most = 262144});
    if (context.atLeast(Level::Nightly)) ask(2, 0.003, {.samples = 262144, .most = 8388608});
}

void parallelMirrors(Context& context) {
    constexpr double reflectance = 0.8, distance = 0.75;
    const auto scene = [](int depth) {
        return Stage("{position: [0, 0.5, 3], target: [0, 0, 0], fov: 0.01}",
                     fmt::format("{{max_depth: {}, roulette: false}}", depth))
            .material("floor", "{type: diffuse, reflectance: 1}")
            .material("black", "{type: diffuse, reflectance: 0}")
            .material("mirror", "{type: mirror, reflectance: 0.8}")
            .quad("floor", "[[-0.75,0,-40],[-0.75,0,40],[0.75,0,40],[0.75,0,-40]]", "floor")
            .quad("lamp", "[[-0.5,1,-0.5],[0.5,1,-0.5],[0.5,1,0.5],[-0.5,1,0.5]]", "black", "1")
            .quad("left", "[[-0.75,0,-40],[-0.75,80,-40],[-0.75,80,40],[-0.75,0,40]]", "mirror")
            .quad("right", "[[0.75,0,-40],[0.75,0,40],[0.75,80,40],[0.75,80,-40]]", "mirror")
            .yaml();
    };
    // The image after n reflections is 2·distance·n to either side.
    const auto upTo = [&](int reflections) {
        double sum = squareFormFactor(0, 0.5);
        for (int n = 1; n <= reflections; ++n)
            sum += 2 * std::pow(reflectance, n) * squareFormFactor(2 * distance * n, 0.5);
        return sum;
    };
    for (const int depth : {1, 2, 3, 64}) {
        const int reflections = std::min(depth - 1, 60);
        context.estimate(
            fmt::format("depth {}: up to {} reflections", depth, reflections), scene(depth), meanRadiance,
            upTo(reflections), 0.005, {.samples = 1024, .most = 65536},
            {{upTo(reflections + 1), "one reflection too many: is the depth counted from -1?"},
             {upTo(std::max(reflections - 1, 0)), "one reflection too few: is the depth counted from 1?"}});
    }
}

/// Nyström solution of the radiosity equation of the unit cube with a glowing ceiling, reflectance ½, E =
/// 1: graded Gauss–Legendre panels with the singularity subtracted, six discretisations agreeing to 1e-6,
/// and an independent Monte Carlo of 4·10⁶ walks agreeing within its error.
struct CubeProbe {
    const char* where;
    const char* camera;
    std::array<int, 4> commit_depths;  ///< Tested on every commit; the others from level merge on.
    double at_depth_1, at_depth_2, at_depth_3, at_depth_5, at_depth_10, at_infinity;
};
constexpr CubeProbe kCubeProbes[] = {
    {"floor centre", kFloorCentre, {1, 2, 3, 10}, .1197282, .1544164, .176954, .192400, .197441, .197603},
    {"floor at (¼, ¼)", kFloorQuarter, {2, 3}, .1039213, .1351554, .157127, .172343, .177369, .177532},
    {"wall centre", kWallCentre, {2, 10}, .0950679, .1358782, .156819, .172439, .177485, .177647},
    {"ceiling centre", kCeilingCentre, {2}, 1, 1.052071, 1.070769, 1.086594, 1.091644, 1.091807},
};

void glowingCeiling(Context& context) {
    const auto scene = [](const char* camera, const std::string& integrator) {
        Cube cube;
        cube.emitting = "ceiling";
        cube.camera = camera;
        cube.integrator = integrator;
        return yaml(cube);
    };
    for (const CubeProbe& p : kCubeProbes) {
        const std::pair<int, double> depths[] = {{1, p.at_depth_1},   {2, p.at_depth_2},
                                                 {3, p.at_depth_3},   {5, p.at_depth_5},
                                                 {10, p.at_depth_10}, {64, p.at_infinity}};
        for (const auto& [depth, expected] : depths) {
            if (!context.atLeast(Level::Merge) &&
                std::find(p.commit_depths.begin(), p.commit_depths.end(), depth) == p.commit_depths.end())
                continue;
            context.estimate(fmt::format("{}, depth {}", p.where, depth),
                             scene(p.camera, fmt::format("{{max_depth: {}, roulette: false}}", depth)),
                             meanRadiance, expected, 0.002, {.samples = 1024, .most = 16384});
        }
    }
    context.estimate("floor centre, depth 5, without light sampling",
                     scene(kFloorCentre, "{max_depth: 5, roulette: false, nee: false}"), meanRadiance,
                     kCubeProbes[0].at_depth_5, 0.003, {.samples = 2048, .most = 65536});
    context.estimate("floor centre, any depth, with roulette from the first event on",
                     scene(kFloorCentre, "{max_depth: 64, roulette_depth: 1}"), meanRadiance,
                     kCubeProbes[0].at_infinity, 0.003, {.samples = 2048, .most = 65536},
                     {{kCubeProbes[0].at_depth_1,
                       "only direct light: are survivors of roulette not divided by their probability?"}});
}

void energyBalance(Context& context) {
    // A room of six colours with a lamp flush in its ceiling. Seen from the centre with a field of view of
    // 90°, a wall fills the film, and pixels are equal areas of it. The walls absorb (1 − ρ)/ρ times
    // the light that they reflect.
    struct Wall {
        const char* name;
        const char* corners;
        const char* target;
        double albedo;
    };
    constexpr Wall walls[] = {
        {"floor", "[[0,0,0],[0,0,1],[1,0,1],[1,0,0]]",
         "{position: [0.5,0.5,0.5], target: [0.5,0,0.5], up: [0,0,1], fov: 90}", 0.7},
        {"left", "[[0,0,0],[0,1,0],[0,1,1],[0,0,1]]",
         "{position: [0.5,0.5,0.5], target: [0,0.5,0.5], fov: 90}", 0.6},
        {"right", "[[1,0,0],[1,0,1],[1,1,1],[1,1,0]]",
         "{position: [0.5,0.5,0.5], target: [1,0.5,0.5], fov: 90}", 0.3},
        {"back", "[[0,0,1],[0,1,1],[1,1,1],[1,0,1]]",
         "{position: [0.5,0.5,0.5], target: [0.5,0.5,1], fov: 90}", 0.8},
        {"front", "[[0,0,0],[1,0,0],[1,1,0],[0,1,0]]",
         "{position: [0.5,0.5,0.5], target: [0.5,0.5,0], fov: 90}", 0.5},
    };
    constexpr const char* ceiling = "{position: [0.5,0.5,0.5], target: [0.5,1,0.5], up: [0,0,1], fov: 90}";
    constexpr double ceiling_albedo = 0.75, lamp_albedo = 0.2;
    const auto scene = [&](const char* camera) {
        Stage stage(camera, "{max_depth: 100, roulette: false}");
        stage.set("film", "{resolution: [10, 10]}");
        for (const Wall& w : walls)
            stage.material(w.name, fmt::format("{{type: diffuse, reflectance: {}}}", w.albedo))
                .quad(w.name, w.corners, w.name);
        stage.material("ceiling", "{type: diffuse, reflectance: 0.75}")
            .material("lamp", "{type: diffuse, reflectance: 0.2}");
        stage.quad("lamp", "[[0.3,1,0.3],[0.7,1,0.3],[0.7,1,0.7],[0.3,1,0.7]]", "lamp", "1");
        stage.quad("ceiling1", "[[0,1,0],[1,1,0],[1,1,0.3],[0,1,0.3]]", "ceiling")
            .quad("ceiling2", "[[0,1,0.7],[1,1,0.7],[1,1,1],[0,1,1]]", "ceiling");
        stage.quad("ceiling3", "[[0,1,0.3],[0.3,1,0.3],[0.3,1,0.7],[0,1,0.7]]", "ceiling")
            .quad("ceiling4", "[[0.7,1,0.3],[1,1,0.3],[1,1,0.7],[0.7,1,0.7]]", "ceiling");
        return stage.yaml();
    };
    std::vector<std::string> scenes;
    for (const Wall& w : walls) scenes.push_back(scene(w.target));
    scenes.push_back(scene(ceiling));
    const auto absorbed = [&](const std::vector<Film>& films) {
        double sum = 0;
        for (std::size_t i = 0; i < std::size(walls); ++i)
            sum += radiance(films[i]) * (1 - walls[i].albedo) / walls[i].albedo;
        for (std::uint32_t y = 0; y < 10; ++y)
            for (std::uint32_t x = 0; x < 10; ++x) {
                const bool lamp = x >= 3 && x < 7 && y >= 3 && y < 7;
                const double albedo = lamp ? lamp_albedo : ceiling_albedo;
                sum += (radiance(films.back(), x, y) - (lamp ? 1 : 0)) * (1 - albedo) / albedo / 100;
            }
        return kPi * sum;
    };
    context.estimate("flux absorbed by walls and lamp", scenes, absorbed, kPi * 0.4 * 0.4, 0.003,
                     {.samples = 128, .most = 1024});
}

void lambertianBody(Context& context) {
    // No part of a convex body lights another: radiance ρ·L everywhere. The same seed gives the same
    // wavelengths, so each pixel is ρ times the empty scene's.
    const auto scene = [](double albedo, double fov, bool body, const std::string& integrator) {
        Stage stage(fmt::format("{{position: [3, 2.5, 4], target: [0.5, 0.5, 0.5], fov: {}}}", fov),
                    integrator);
        stage.set("environment", "{radiance: 1}").set("film", "{resolution: [8, 8]}");
        if (body)
            stage.material("body", fmt::format("{{type: diffuse, reflectance: {}}}", albedo))
                .box("body", {0, 0, 0}, {1, 1, 1}, "body");
        return stage.yaml();
    };
    const std::string once = "{max_depth: 1, roulette: false, nee: false}";
    for (const double fov : {5.0, 40.0}) {
        const Film empty = context.render(scene(0, fov, false, once), {.samples = 16});
        if (fov == 5.0)
            context.relative(
                "albedo 0.5, a film full of it: the worst pixel",
                0.5 * worstRatio(context.render(scene(0.5, fov, true, once), {.samples = 16}), empty, 0.5),
                0.5, 2e-6,
                {{0.5 * kPi, "3.1416 times too bright: is the division of Lambert's law by pi missing?"}});
        context.relative(fmt::format("albedo 1, field of view {}°, vanishes: the worst pixel", fov),
                         worstRatio(context.render(scene(1, fov, true, once), {.samples = 16}), empty), 1,
                         2e-6);
    }
}

void halfOccluder(Context& context) {
    const std::string scene =
        squareOverFloor(0, kDirect) +
        "  - {name: occluder, mesh: {positions: [[0,0.5,-1],[3,0.5,-1],[3,0.5,1],[0,0.5,1]], faces: "
        "[[0,1,2,3]]}, material: lamp}\n";
    const double whole = squareFormFactor(0, 0.5);
    context.estimate("the half of the lamp that is seen", scene, meanRadiance, whole / 2, 0.002,
                     {.samples = 1024, .most = 65536},
                     {{whole, "the occluder casts no shadow: do shadow rays see it?"},
                      {0, "the occluder hides all of the lamp, not half"}});
}

void quarterOfTheFilm(Context& context) {
    // Seen with 90° from distance 1 the film shows [−1, 1]².
    const auto scene = [](const char* corners, const char* film) {
        return Stage("{position: [0,0,0], target: [0,0,1], up: [0,1,0], fov: 90}", "{max_depth: 0}")
            .set("film", film)
            .material("black", "{type: diffuse, reflectance: 0}")
            .quad("lamp", corners, "black", "1, two_sided: true")
            .yaml();
    };
    context.estimate(
        "centred, over pixels cut in half",
        scene("[[-0.5,-0.5,1],[0.5,-0.5,1],[0.5,0.5,1],[-0.5,0.5,1]]", "{resolution: [10, 10]}"),
        meanRadiance, 0.25, 0.0005, {.samples = 1024, .most = 65536});
    // Image right is view × up = −x here, and up is +y: the lamp at x in [−1, 0], y in [0, 1] fills the
    // upper right quarter of whole pixels.
    const Film film = context.render(scene("[[-1,0,1],[0,0,1],[0,1,1],[-1,1,1]]", "{resolution: [4, 4]}"),
                                     {.samples = 4096});
    double inside = 0, outside = 0;
    for (std::uint32_t y = 0; y < 4; ++y)
        for (std::uint32_t x = 0; x < 4; ++x) (x >= 2 && y < 2 ? inside : outside) += radiance(film, x, y);
    context.relative("upper right quarter: mean of its pixels", inside / 4, 1, 1e-3,
                     {{0, "the lamp is somewhere else: is the image mirrored or upside down?"}});
    context.relative("the other pixels", outside, 0, 0,
                     {{1, "light beside the lamp's pixels: is the pixel grid shifted by half a pixel?"}});
}

/// A closed dome around the origin of 16 bands of latitude, each of 16 flat facets and of one radiance, that
/// of 1 + y/2 + y²/4 in its middle.
class BandedSky {
public:
    static double radianceAt(double height) { return 1 + height / 2 + height * height / 4; }
    static double radianceOf(int band) { return radianceAt(std::cos((band + 0.5) * kPi / kBands)); }

    void addTo(Stage& stage) const {
        for (int band = 0; band < kBands; ++band) {
            std::string positions, faces;
            for (int side = 0; side < kSides; ++side) {
                for (const Vec3d& v : facet(band, side))
                    positions += fmt::format("{}[{:.9g},{:.9g},{:.9g}]", positions.empty() ? "" : ",", v[0],
                                             v[1], v[2]);
                faces += fmt::format("{}[{},{},{},{}]", side == 0 ? "" : ",", 4 * side, 4 * side + 1,
                                     4 * side + 2, 4 * side + 3);
            }
            stage.mesh(fmt::format("band{}", band), "[" + positions + "]", "[" + faces + "]", "black",
                       fmt::format("{:.17g}, two_sided: true", radianceOf(band)));
        }
    }
    /// Irradiance over π at the origin.
    double irradiance(const Vec3d& normal) const {
        double sum = 0;
        for (int band = 0; band < kBands; ++band)
            for (int side = 0; side < kSides; ++side)
                sum += radianceOf(band) * polygonFormFactor({0, 0, 0}, normal, facet(band, side));
        return sum;
    }

private:
    static constexpr int kBands = 16, kSides = 16;

    static std::vector<Vec3d> facet(int band, int side) {
        const auto at = [](int row, int column) {
            const double polar = row * kPi / kBands, azimuth = 2 * kPi * (column % kSides) / kSides;
            return Vec3d{10 * std::sin(polar) * std::cos(azimuth), 10 * std::cos(polar),
                         10 * std::sin(polar) * std::sin(azimuth)};
        };
        return {at(band, side), at(band, side + 1), at(band + 1, side + 1), at(band + 1, side)};
    }
};

void directionalSky(Context& context) {
    // A sky that varies, as a dome of lamps. A furnace is blind to wrong directions, this is not.
    const BandedSky sky;
    struct Facing {
        const char* name;
        Vec3d normal;
        const char* eye;
        const char* receiver;
        double limit;  ///< ½/π ∫ (1 + y/2 + y²/4) cos⁺ dω
    };
    constexpr const char* level = "[[-0.1,0,-0.1],[-0.1,0,0.1],[0.1,0,0.1],[0.1,0,-0.1]]";
    for (const Facing& f : {Facing{"up", {0, 1, 0}, "[0.2, 0.5, 0.1]", level, 0.7291666667},
                            {"down", {0, -1, 0}, "[0.2, -0.5, 0.1]", level, 0.3958333333},
                            {"sideways",
                             {1, 0, 0},
                             "[0.5, 0.2, 0.1]",
                             "[[0,-0.1,-0.1],[0,0.1,-0.1],[0,0.1,0.1],[0,-0.1,0.1]]",
                             0.53125}}) {
        const double expected = 0.5 * sky.irradiance(f.normal);
        context.relative(fmt::format("{}: bands against the integral over the hemisphere", f.name), expected,
                         f.limit, 0.005);
        for (const bool nee : {false, true}) {
            Stage stage(fmt::format("{{position: {}, target: [0, 0, 0], up: [0, 0, 1], fov: 0.01}}", f.eye),
                        fmt::format("{{max_depth: 1, roulette: false, nee: {}}}", nee));
            stage.material("grey", "{type: diffuse, reflectance: 0.5}")
                .material("black", "{type: diffuse, reflectance: 0}")
                .quad("receiver", f.receiver, "grey");
            sky.addTo(stage);
            context.estimate(fmt::format("{}{}", f.name, nee ? ", with light sampling" : ""), stage.yaml(),
                             meanRadiance, expected, 0.001, {.samples = 1024, .most = 16384},
                             {{0.5, "the sky's mean: is every direction given the same radiance?"}});
        }
    }
}

}  // namespace

std::vector<Case> closedFormCases() {
    return {
        {.id = "A01",
         .name = "furnace",
         .title = "A closed box whose walls emit 1 and reflect 0.5 or 0.8, at depths 1, 2, 8 and 64",
         .expected = "E (1 − ρ^(k+1)) / (1 − ρ) in every pixel",
         .source = "geometric series",
         .tolerance = "2e-6 without light sampling, which has no variance; ± 0.2 % with it",
         .level = Level::Commit,
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT,
         .run = whiteFurnace},
        {.id = "A03",
         .name = "square-light",
         .title = "Unit square light at height 1 over a white floor, seen at offsets 0, 1, 2 and 20",
         .expected = "the form factor: 0.2394564705, 0.0843536644, 0.0139237174, 1.982807681e-6",
         .source = "rectangle formula (Howell B-3), and Lambert's polygon formula to 12 digits",
         .tolerance = "± 0.1 %; ± 0.5 % at 20",
         .level = Level::Commit,
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE,
         .run = squareLight},
        {.id = "A02",
         .name = "kirchhoff",
         .title = "A closed box of emissivity 1 − ρ(λ) with steps in ρ, and one at 2856 K and 5778 K",
         .expected = "the black body's radiance, whatever the reflectance",
         .source = "Kirchhoff's law, Planck's law (CODATA 2018)",
         .tolerance = "1e-5 in every pixel; peak ± 0.6 nm",
         .level = Level::Commit,
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT,
         .run = kirchhoff},
        {.id = "A04",
         .name = "triangle-lights",
         .title =
             "Random triangles of light over a floor point, some cut by the horizon (8; 100 from level "
             "merge on)",
         .expected = "Lambert's polygon formula for each",
         .source = "Lambert, Photometria, 1760",
         .tolerance = "± 0.3 % for every one",
         .level = Level::Commit,
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE,
         .run = randomTriangles},
        {.id = "A05",
         .name = "mirror-wall",
         .title = "A03 beside a perfect mirror: the light that comes by the mirror",
         .expected = "the form factor of the lamp's image; for a mirror "
                     "at 2 0.001141273786, with the lamp 0.2405977442",
         .source = "images, rectangle formula",
         .tolerance = "± 1 % (mirror at 0.75), ± 0.3 % from level merge on; mirror at 2 with the lamp "
                      "± 0.3 %, alone ± 2 % at level merge, ± 0.3 % at level nightly",
         .level = Level::Commit,
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE | CRT_FEATURE_CONDUCTOR,
         .run = mirrorWall},
        {.id = "A06",
         .name = "parallel-mirrors",
         .title = "Lamp and receiver between two parallel mirrors of reflectance 0.8, depths 1, 2, 3 and 64",
         .expected = "Σ Rⁿ F(images after n reflections), n below the depth",
         .source = "images, rectangle formula",
         .tolerance = "± 0.5 %",
         .level = Level::Commit,
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE | CRT_FEATURE_CONDUCTOR,
         .run = parallelMirrors},
        {.id = "A07",
         .name = "unit-cube",
         .title = "Unit cube of reflectance ½ under a glowing ceiling: four probes, depths 1 to 64 (nine "
                  "of the 24 at level commit)",
         .expected = "radiosity at each depth, e.g. 0.1544164 at the floor's centre after 2 events, "
                     "0.197603 in the end",
         .source = "Nyström solution of the radiosity equation, six discretisations agreeing to 1e-6",
         .tolerance = "± 0.2 %; ± 0.3 % without light sampling and with roulette",
         .level = Level::Commit,
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE,
         .run = glowingCeiling},
        {.id = "A08",
         .name = "energy-balance",
         .title = "A room of six colours with a lamp in its ceiling: the flux that the walls absorb",
         .expected = "the flux that the lamp emits, π·L·A",
         .source = "conservation of energy",
         .tolerance = "± 0.3 %",
         .level = Level::Merge,
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE,
         .run = energyBalance},
        {.id = "A09",
         .name = "lambertian-body",
         .title = "A convex diffuse body in a constant environment",
         .expected = "albedo times the environment; with albedo 1 it cannot be seen",
         .source = "Lambert's law",
         .tolerance = "2e-6 in every pixel",
         .level = Level::Commit,
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_ENVIRONMENT,
         .run = lambertianBody},
        {.id = "A16",
         .name = "half-occluder",
         .title = "A03 with an occluder whose edge passes between receiver and lamp's centre",
         .expected = "half of A03",
         .source = "symmetry",
         .tolerance = "± 0.2 %",
         .level = Level::Commit,
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE,
         .run = halfOccluder},
        {.id = "A17",
         .name = "quarter-film",
         .title = "A lamp that covers half of the film's width and height, centred and in a corner",
         .expected = "a quarter of its radiance; in the corner, whole pixels of it and nothing beside",
         .source = "area",
         .tolerance = "± 0.05 %; exactly 0 beside it",
         .level = Level::Commit,
         .needs = CRT_FEATURE_AREA_LIGHT,
         .run = quarterOfTheFilm},
        {.id = "A18",
         .name = "directional-sky",
         .title = "Albedo ½ under a sky of 1 + y/2 + y²/4, made of 16 bands of lamps, facing up, down and "
                  "sideways",
         .expected = "0.7291666667, 0.3958333333, 0.53125 but for the bands",
         .source = "integral over the hemisphere; Lambert's polygon formula for the bands",
         .tolerance = "± 0.1 %; bands ± 0.5 %",
         .level = Level::Commit,
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE,
         .run = directionalSky},
    };
}

}  // namespace crt::verify
