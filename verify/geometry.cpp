// Group C: degenerate and awkward geometry. Furnaces show it: where every surface brings the same radiance,
// a ray that leaks, or meets a wrong surface, is visible.
//
// Over 450 lines: cases, each a scene and its answer, that share nothing with their neighbours.
#include "verify/probes.h"
#include "verify/references.h"

#include "base/log.h"
#include "kernel/dialect/features.h"
#include "kernel/dialect/layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace crt::verify {
namespace {

constexpr std::uint32_t kFirstHit = kAovNormal | kAovDepth | kAovPrimitive;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

template <class Use>
void forEachPixel(const Film& film, Use use) {
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x) use(x, y);
}

std::uint64_t litPixels(const Film& film) {
    std::uint64_t lit = 0;
    forEachPixel(film, [&](std::uint32_t x, std::uint32_t y) { lit += radiance(film, x, y) > 0; });
    return lit;
}

/// Largest |radiance of a pixel of `film` / (factor · that of `unit`) − 1|; NaN when any pixel's is.
double worstDeviation(const Film& film, const Film& unit, double factor) {
    double worst = 0;
    forEachPixel(film, [&](std::uint32_t x, std::uint32_t y) {
        worst = fartherFrom(0, worst, std::abs(radiance(film, x, y) / radiance(unit, x, y) / factor - 1));
    });
    return worst;
}

void withoutArea(Context& context) {
    const Scene scene = litRoom(24, 1);
    const Film clean = context.render(scene, samples(4));
    const auto with = [&](const char* what, const Vec3d& a, const Vec3d& b, const Vec3d& c,
                          double radiance_of_it) {
        Scene more = scene;
        Mesh mesh;
        addTriangle(mesh, a, b, c);
        addObject(more, std::move(mesh), diffuse(0.5), radiance_of_it);
        const int warnings = warningCount();
        context.sameBits(
            what, clean, context.render(more, samples(4)),
            "a triangle without area is hit, sampled as a light, or decides where the scene's centre is");
        context.holds(fmt::format("{}: said", what), warningCount() > warnings, "a warning",
                      "triangles are left out silently");
    };
    with("a point", {0.5, 0.5, 0.5}, {0.5, 0.5, 0.5}, {0.5, 0.5, 0.5}, 0);
    with("two corners alike", {0.1, 0.2, 0.3}, {0.8, 0.7, 0.1}, {0.8, 0.7, 0.1}, 0);
    with("three corners on a line", {0.1, 0.2, 0.3}, {0.3, 0.4, 0.5}, {0.7, 0.8, 0.9}, 0);
    with("on a line and emitting", {0.1, 0.2, 0.3}, {0.3, 0.4, 0.5}, {0.7, 0.8, 0.9}, 100);
    with("a point far outside", {100, 50, 20}, {100, 50, 20}, {100, 50, 20}, 0);
}

/// A view of a floor of slivers. Every other one is of the thick end of the sliver whose coordinates are
/// smallest, so near and so narrow that single precision tells the sides of the thinnest apart and rays meet
/// it.
Scene sliverView(std::uint64_t film_index, const Vec3d& eye, const Vec3d& thick_end, double thickness) {
    if (film_index % 2 == 0) return emptyScene(64, film_index, eye, {0, 0, 0}, 0.5);
    const Vec3d near = thick_end + (eye - thick_end) * 0.03125;
    // Two steps of single-precision directions a pixel are the least that crt does not warn of.
    const double narrowest = 32 * 0x1p-22;
    return emptyScene(64, film_index, near, thick_end,
                      std::clamp(8 * thickness / length(near - thick_end), narrowest, 0.5));
}

void slivers(Context& context) {
    for (int exponent = 3; exponent <= 8; ++exponent) {
        // A floor of slivers, each from one side to the other; the last ones thinner than a ulp is wide.
        const double thickness = std::pow(10.0, -exponent);
        Dice dice(static_cast<std::uint64_t>(exponent));
        Tally hits;
        const std::uint64_t films = context.byLevel(4, 60, 250);
        for (std::uint64_t film_index = 0; film_index < films; ++film_index) {
            // Between two lines of points in a plane that is no axis'.
            const auto point = [&](double x, double z) {
                return roundToFloat({x, 0.25 * x - 0.125 * z, z});
            };
            Scene scene = sliverView(film_index, {0.1, 0.02 + dice.uniform(), 0.3},
                                     point(0.8, 0.47 * thickness), thickness);
            scene.integrator.max_depth = 0;
            Mesh mesh;
            for (int i = 0; i < 200; ++i) {
                const double z = -0.9 + i * 0.009;
                addTriangle(mesh, point(-0.9, z), point(0.9, z + thickness), point(0.9, z));
            }
            const std::vector<Vec3d> corners = mesh.positions;
            addObject(scene, std::move(mesh), diffuse(0));
            const Film film = context.render(scene, samples(1, kFirstHit));
            forEachPixel(film, [&](std::uint32_t x, std::uint32_t y) {
                const std::uint32_t id = film.primitives[static_cast<std::size_t>(y) * 64 + x];
                if (id == CRT_NONE) return;
                ++hits.rays;
                // The hit's distance lies between those of the sphere around its triangle.
                const Vec3d &a = corners[3 * id], &b = corners[3 * id + 1];
                const double radius = 0.51 * length(b - a),
                             centre = length((a + b) * 0.5 - scene.camera.position);
                const double off =
                    std::abs(film.mean(x, y, firstChannel(film.shape().aovs, kAovDepth)) - centre) - radius;
                hits.failures += !(off <= 1e-5);
            });
        }
        const std::string what = fmt::format("1 : 1e{}", exponent);
        context.holds(what + ", rays that hit", hits.rays >= 20, "20 or more",
                      "slivers are lost: is a determinant taken for zero?",
                      fmt::format("{} rays", hits.rays));
        if (hits.rays > 0)
            rareFailures(context, what, hits, 1e-6,
                         "a false hit far off the triangle: its distance is a quotient of roundings");
    }
}

void duplicates(Context& context) {
    const auto stack = [&](std::uint64_t copies) {
        Scene scene = emptyScene(32, 1, {0.1, 0.2, -2}, {0, 0, 0}, 0.3);
        scene.integrator.max_depth = 1;
        scene.environment = Environment{constantSpectrum(1)};
        Mesh mesh;
        for (std::uint64_t i = 0; i < copies; ++i)
            addQuad(mesh, {-0.5, -0.5, 0}, {-0.5, 0.5, 0}, {0.5, 0.5, 0.25}, {0.5, -0.5, 0.25});
        addObject(scene, std::move(mesh), diffuse(0.5));
        return context.render(scene, samples(2, kFirstHit));
    };
    const Film one = stack(1);
    for (const std::uint64_t copies :
         {std::uint64_t{2}, std::uint64_t{100}, context.byLevel(1000, 10000, 100000)})
        context.sameBits(fmt::format("{} copies", copies), one, stack(copies),
                         "of equally near triangles not the first in the author's order is hit");
}

void coplanar(Context& context) {
    for (const int ulps : {0, 1, 4, 32}) {
        // Two squares of different radiance, the second nearer by this number of ulps of a coordinate in
        // [½, 1).
        Scene scene = emptyScene(64, 1, {0.1, 0.2, -1}, {0, 0, 0.6}, 0.2);
        scene.integrator.max_depth = 0;
        for (const int k : {0, 1}) {
            Mesh mesh;
            const double z = 0.75 - k * ulps * 0x1p-24;
            addQuad(mesh, {-0.9, -0.9, z}, {-0.9, 0.9, z}, {0.9, 0.9, z}, {0.9, -0.9, z});
            addObject(scene, std::move(mesh), diffuse(0), k == 0 ? 1 : 2, true);
        }
        addAnchors(scene, {0, 0, 0}, 0.95);
        const Film film = context.render(scene, samples(1, kAovPrimitive));
        std::uint64_t nearer = 0, first = 0;
        for (const std::uint32_t id : film.primitives) (id < 2 ? first : nearer) += 1;
        const std::string note = fmt::format("the first: {}, the nearer: {} of 4096", first, nearer);
        if (ulps == 0)
            context.holds("in one plane", nearer == 0, "the first in the author's order",
                          "ties are decided by the order of testing", note);
        else if (ulps == 32)
            context.holds("32 ulp apart", first == 0, "always the nearer one",
                          "the error of distances is larger than that of the triangle test", note);
        else
            context.holds(fmt::format("{} ulp apart", ulps), first + nearer == 4096, "one of the two",
                          "neither is hit", note);
    }
}

/// A room whose walls and contents all emit 1 and reflect ½.
Scene evenRoom(std::uint64_t seed) {
    Scene scene = emptyScene(24, seed, {0.1, 0.15, 0.2}, {0.6, 0.3, 0.7}, 0.9);
    scene.integrator.max_depth = 16;
    addObject(scene, boxMesh({0, 0, 0}, {1, 1, 1}, true), diffuse(0.5), 1, true);
    return scene;
}

void touching(Context& context) {
    const auto ask = [&](const char* what, const Mesh& mesh) {
        double worst = 0;
        const std::uint64_t seeds = context.byLevel(2, 16, 64);
        for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
            Scene scene = evenRoom(seed);
            addObject(scene, mesh, diffuse(0.5), 1, true);
            Scene dark = scene;
            dark.integrator.max_depth = 0;
            worst = fartherFrom(0, worst,
                                worstDeviation(context.render(scene, samples(16)),
                                               context.render(dark, samples(16)), furnaceRadiance(0.5, 16)));
        }
        context.absolute(
            fmt::format("{}: the worst pixel", what), worst, 0, 2e-6,
            {{0.01, "light leaks where two surfaces touch: a ray's offset carries it through both"}});
    };
    ask("a sphere that touches the floor", icosphere(3, 0.25, {0.5, 0.25, 0.5}));
    ask("a box that stands on the floor, in a corner", boxMesh({0.5, 0, 0.5}, {1, 0.5, 1}));
    ask("two boxes with a face in common", [] {
        Mesh both = boxMesh({0.4, 0, 0.4}, {0.6, 0.3, 0.6});
        const Mesh second = boxMesh({0.4, 0.3, 0.4}, {0.6, 0.5, 0.6});
        for (const auto& t : second.triangles)
            addTriangle(both, second.positions[t[0]], second.positions[t[1]], second.positions[t[2]]);
        return both;
    }());
}

void thinWalls(Context& context) {
    // 1e-5 of the size is what layers are promised to be seen at (B06).
    for (const double thickness : {1e-3, 1e-4, 1e-5}) {
        Scene scene = emptyScene(32, 1, {0.3, 0.4, 0.2}, {0.6, 0.5, 0.9}, 1);
        scene.integrator.max_depth = 32;
        scene.environment = Environment{constantSpectrum(1)};
        addObject(scene, boxMesh({0, 0, 0}, {1, 1, 1}, true), diffuse(0.9));
        addObject(
            scene,
            boxMesh({-thickness, -thickness, -thickness}, {1 + thickness, 1 + thickness, 1 + thickness}),
            diffuse(0.9));
        const std::uint64_t n = context.byLevel(16, 256, 4096);
        const std::uint64_t lit = litPixels(context.render(scene, samples(n)));
        context.holds(fmt::format("walls of {:g}", thickness), lit == 0, "inside exactly 0",
                      "light comes through the wall, or through a corner",
                      fmt::format("{} of 1024 pixels lit, {} paths of 32 bounces", lit, 1024 * n));
    }
}

void lightTightBox(Context& context) {
    Tally tally;
    const std::uint64_t n = context.byLevel(64, 1024, 16384), films = context.byLevel(2, 8, 60);
    for (std::uint64_t seed = 1; seed <= films; ++seed) {
        Dice dice(seed);
        Scene scene = emptyScene(32, seed, {0.5, 0.5, 0.5}, Vec3d{0.5, 0.5, 0.5} + dice.direction(), 1);
        scene.integrator.max_depth = 16;
        scene.environment = Environment{constantSpectrum(1)};
        // In an odd pose, so that no coordinate is round.
        const Vec3d z = dice.direction(), x = unit(cross(z, dice.direction())), y = cross(z, x);
        Mesh box = boxMesh({0, 0, 0}, {1, 1, 1}, true);
        const auto turn = [&](const Vec3d& p) { return x * p[0] + y * p[1] + z * p[2]; };
        for (Vec3d& p : box.positions) p = turn(p);
        scene.camera.position = turn(scene.camera.position);
        scene.camera.target = scene.camera.position + dice.direction();
        addObject(scene, std::move(box), diffuse(1));
        tally.rays += 1024 * n;
        tally.failures += litPixels(context.render(scene, samples(n)));
    }
    rareFailures(context, "paths of 16 bounces in a white box under a bright sky", tally, 7.7e-9,
                 "a path leaves a closed room");
}

void cracks(Context& context) {
    // Two squares side by side in a plane; where they meet, one has a vertex in the middle of the other's
    // edge. Rays at a stretch of 1e-4 around it.
    const auto leaks = [&](double gap, double middle) {
        Scene scene = emptyScene(64, 1, {0.5, 0, -0.75}, {0.5, 0, 0.25}, 5e-5);
        scene.integrator.max_depth = 0;
        scene.environment = Environment{constantSpectrum(1)};
        Mesh mesh;
        addQuad(mesh, {0, -1, 0.25}, {0, 1, 0.25}, {0.5, 1, 0.25}, {0.5, -1, 0.25});
        const Vec3d t{0.5 + gap, middle, 0.25};
        addTriangle(mesh, {0.5, -1, 0.25}, t, {1, -1, 0.25});
        addTriangle(mesh, t, {0.5, 1, 0.25}, {1, 1, 0.25});
        addTriangle(mesh, t, {1, 1, 0.25}, {1, -1, 0.25});
        addObject(scene, std::move(mesh), diffuse(0));
        addAnchors(scene, {0, 0, 0}, 1.5);
        const std::uint64_t n = context.byLevel(64, 1024, 4096);
        const Film film = context.render(scene, samples(n));
        return std::pair{radiance(film), static_cast<double>(film.counts.size() * n)};
    };
    context.holds("a vertex exactly on the other's edge", leaks(0, 0.125).first == 0, "no leak",
                  "rays slip through where no gap is");
    // Four ulps at ½ wide at the middle vertex, as seen over a film 1e-4 · 1 wide.
    for (const double ulps : {4.0, 64.0}) {
        const double gap = ulps * 0x1p-24, expected = gap / 1e-4;
        const auto [rate, rays] = leaks(gap, 0);
        context.absolute(
            fmt::format("a crack of {} ulp: share of rays that pass", ulps), rate, expected,
            0.25 * expected + 5 * std::sqrt(expected / rays),
            {{0, "a real crack is closed: are triangles enlarged, or edges tested with a tolerance?"}});
    }
}

void nonManifold(Context& context) {
    Mesh mesh;
    const Vec3d a{0.5, 0.2, 0.5}, b{0.5, 0.8, 0.5};
    for (const Vec3d& c :
         {Vec3d{0.8, 0.5, 0.5}, Vec3d{0.35, 0.5, 0.75}, Vec3d{0.35, 0.5, 0.25}, Vec3d{0.6, 0.5, 0.8}})
        addTriangle(mesh, a, b, c);
    for (int i = 0; i < 48; ++i) {  // a Möbius strip
        const auto rim = [&](int k, double side) {
            const double phi = k * 2 * 3.14159265358979 / 48, half = phi / 2;
            return Vec3d{0.5 + (0.2 + side * 0.08 * std::cos(half)) * std::cos(phi),
                         0.3 + side * 0.08 * std::sin(half),
                         0.5 + (0.2 + side * 0.08 * std::cos(half)) * std::sin(phi)};
        };
        addQuad(mesh, rim(i, -1), rim(i + 1, -1), rim(i + 1, 1), rim(i, 1));
    }
    Scene scene = evenRoom(1);
    addObject(scene, mesh, diffuse(0.5), 1, true);
    Scene dark = scene;
    dark.integrator.max_depth = 0;
    context.absolute("edges of four faces and a Möbius strip, Lambertian: the worst pixel",
                     worstDeviation(context.render(scene, samples(8)), context.render(dark, samples(8)),
                                    furnaceRadiance(0.5, 16)),
                     0, 2e-6, {{0.01, "a surface that is not closed loses light"}});
    // Of glass, inside and outside have no meaning: finite, and no more than n⁴ of what the walls give.
    Scene open = evenRoom(1);
    addObject(open, std::move(mesh), glass(1.5));
    const Film film = context.render(open, samples(64));
    double brightest = 0;
    forEachPixel(film, [&](std::uint32_t x, std::uint32_t y) {
        brightest = fartherFrom(0, brightest, radiance(film, x, y));
    });
    context.holds("the same of glass, which is open", film.invalidSamples() == 0 && std::isfinite(brightest),
                  "finite, to its end", "a path without end, or NaN",
                  fmt::format("brightest pixel {:.3g}", brightest));
}

/// A block in the lit room, its faces turned round or not.
Scene blockIn(const Material& material, bool inwards, std::uint64_t seed) {
    Scene scene = litRoom(24, seed);
    scene.integrator.max_depth = 8;
    addObject(scene, boxMesh({0.1, 0.4, 0.1}, {0.35, 0.7, 0.4}, inwards), material);
    return scene;
}

std::vector<double> ratiosOfBlocks(Context& context, const Material& a, const Material& b,
                                   std::uint64_t count) {
    std::vector<double> all;
    for (std::uint64_t seed = 1; seed <= 8; ++seed)
        all.push_back(radiance(context.render(blockIn(b, true, seed), samples(count))) /
                      radiance(context.render(blockIn(a, false, seed), samples(count))));
    return all;
}

void flippedNormals(Context& context) {
    context.equivalent("a diffuse block turned inside out",
                       ratiosOfBlocks(context, diffuse(0.7), diffuse(0.7), 16), 1, 0.001);
    context.equivalent("a glass block turned inside out, of index 1/1.5",
                       ratiosOfBlocks(context, glass(1.5), glass(1 / 1.5), 16), 1, 0.001);
}

/// A sphere of 20 faces under an even sky, with the normals `normal_of` (a vertex' unit position).
Scene smoothBall(Vec3d (*normal_of)(const Vec3d&), double albedo) {
    Scene scene = emptyScene(48, 1, {0.2, 0.3, -3}, {0, 0, 0}, 0.4);
    scene.integrator.max_depth = 1;
    scene.environment = Environment{constantSpectrum(1)};
    Mesh ball = icosphere(0, 1, {0, 0, 0});
    if (normal_of != nullptr) {
        for (const Vec3d& p : ball.positions) ball.normals.push_back(normal_of(unit(p)));
        ball.normal_index = ball.triangles;
    }
    addObject(scene, std::move(ball), diffuse(albedo));
    return scene;
}

void shadingNormals(Context& context) {
    // Up to 37° off on this ball; then tilted by up to 89°.
    const auto radial = +[](const Vec3d& p) { return p; };
    const auto tilted = +[](const Vec3d& p) {
        return unit(p * std::cos(89 * 3.14159265 / 180) +
                    unit(cross(p, {0.3, 0.5, 0.7})) * std::sin(89 * 3.14159265 / 180));
    };
    for (const auto& [what, normals] :
         {std::pair{"20 faces, smooth", radial}, {"20 faces, normals tilted by 89 degrees", tilted}}) {
        const Film film = context.render(smoothBall(normals, 0.8), samples(64, kAovPrimitive)),
                   white = context.render(smoothBall(nullptr, 1), samples(64));
        double brightest = 0;
        forEachPixel(film, [&](std::uint32_t x, std::uint32_t y) {
            if (film.primitives[static_cast<std::size_t>(y) * 48 + x] == CRT_NONE) return;
            brightest = fartherFrom(0, brightest, radiance(film, x, y) / radiance(white, x, y));
        });
        // A pixel at the rim sees the sky as well.
        const double whole = radiance(film) / radiance(white);
        context.holds(fmt::format("{}: energy", what),
                      brightest <= 1 + 1e-6 && whole < 1 && film.invalidSamples() == 0,
                      "no pixel brighter than the sky", "a shading normal makes light",
                      fmt::format("brightest {:.6f}, mean {:.4f} of the sky", brightest, whole));
    }
    // Inside its outline a pixel brings at most its reflectance.
    const auto inside = [&](Scene scene) {
        scene.camera.tan_half_width = scene.camera.tan_half_height = 0.15;
        return context.render(scene, samples(64));
    };
    const Film film = inside(smoothBall(radial, 0.8)), sky = inside(smoothBall(nullptr, 1));
    double brightest = 0;
    forEachPixel(film, [&](std::uint32_t x, std::uint32_t y) {
        brightest = fartherFrom(0, brightest, radiance(film, x, y) / radiance(sky, x, y));
    });
    context.holds("20 faces, smooth: no more than the reflectance", brightest <= 0.8 * (1 + 1e-6),
                  "≤ 0.8 in every pixel", "a shading normal makes light",
                  fmt::format("brightest {:.6f}", brightest));
}

void oddNormals(Context& context) {
    const auto ball = [&](Vec3d (*normal_of)(const Vec3d&)) {
        return context.render(smoothBall(normal_of, 0.8), samples(4));
    };
    const Film flat = ball(nullptr), smooth = ball([](const Vec3d& p) { return p; });
    const std::string physics =
        "a shading normal is used as it came: not normalised, not checked, or on the wrong side";
    context.sameBits("zero: as flat", flat, ball([](const Vec3d&) { return Vec3d{0, 0, 0}; }), physics);
    context.sameBits("NaN: as flat", flat, ball([](const Vec3d&) { return Vec3d{kNone, 0, 1}; }), physics);
    context.sameBits("eight times as long: as of unit length", smooth,
                     ball([](const Vec3d& p) { return p * 8; }), physics);
    context.sameBits("on the other side: turned round", smooth, ball([](const Vec3d& p) { return p * -1; }),
                     physics);
}

void insideOut(Context& context) {
    Scene scene = evenRoom(1);
    scene.meshes[0] = boxMesh({0, 0, 0}, {1, 1, 1}, false);
    Scene dark = scene;
    dark.integrator.max_depth = 0;
    context.absolute("inside a box whose faces look outwards: the worst pixel",
                     worstDeviation(context.render(scene, samples(8)), context.render(dark, samples(8)),
                                    furnaceRadiance(0.5, 16)),
                     0, 2e-6, {{0.5, "a Lambertian surface reflects on its front alone"}});
}

void mirrorFunnel(Context& context) {
    // Four mirrors that meet in a point, 1 : 1000; a thousand bounces.
    Scene scene = emptyScene(24, 1, {0.0003, 0.0002, -1}, {0, 0, 1}, 0.002);
    scene.integrator.max_depth = 1000;
    scene.environment = Environment{constantSpectrum(1)};
    Mesh funnel;
    const Vec3d tip{0, 0, 1},
        r[4] = {{-1e-3, -1e-3, 0}, {1e-3, -1e-3, 0}, {1e-3, 1e-3, 0}, {-1e-3, 1e-3, 0}};
    for (std::size_t i = 0; i < 4; ++i) addTriangle(funnel, r[i], r[(i + 1) % 4], tip);
    addObject(scene, std::move(funnel), mirror(1));
    Scene sky = scene;
    sky.integrator.max_depth = 0;
    sky.meshes[0].positions.assign(12, {0, 0, 0});
    sky.camera = scene.camera;
    const Film film = context.render(scene, samples(16)), all = context.render(sky, samples(16));
    double brightest = 0;
    forEachPixel(film, [&](std::uint32_t x, std::uint32_t y) {
        brightest = fartherFrom(0, brightest, radiance(film, x, y) / radiance(all, x, y));
    });
    context.holds(
        "a funnel of mirrors, 1000 bounces", brightest <= 1 + 1e-4, "ends; no pixel brighter than the sky",
        "reflection makes light",
        fmt::format("brightest {:.7f}, mean {:.4f} of the sky", brightest, radiance(film) / radiance(all)));
}

void manyTriangles(Context& context) {
    const std::uint64_t count = context.byLevel(20000, 200000, 10000000);
    Dice dice(15);
    Scene scene = emptyScene(32, 1, {0.1, 0.2, -2.5}, {0, 0, 0}, 0.45);
    scene.integrator.max_depth = 0;
    Mesh mesh;
    const double size = 0.5 / std::sqrt(static_cast<double>(count));
    for (std::uint64_t i = 0; i < count; ++i) {
        const Vec3d p = dice.inBox(0.9);
        addTriangle(mesh, p, p + dice.direction() * size, p + dice.direction() * size);
    }
    addObject(scene, std::move(mesh), diffuse(0.5));
    const CompiledScene compiled = compileScene(scene, 0);
    context.absolute(fmt::format("{} triangles: bytes of the compiled scene per triangle", count),
                     static_cast<double>(compiled.size_bytes) / static_cast<double>(count), 130, 40,
                     {{400, "memory grows faster than the scene"}});
    const Film tree = context.render(scene, samples(1, kFirstHit));
    scene.integrator.accelerator = Accelerator::None;
    context.sameBits(fmt::format("{} triangles, 1024 rays: as without a tree", count),
                     context.render(scene, samples(1, kFirstHit)), tree, "the tree loses a triangle");
}

void fewTriangles(Context& context) {
    for (const int count : {0, 1, 2, 3, 4, 5}) {
        Dice dice(static_cast<std::uint64_t>(count));
        Scene scene = emptyScene(48, 1, {0.1, 0.2, -2.5}, {0, 0, 0}, 0.45);
        scene.integrator.max_depth = 3;
        scene.environment = Environment{constantSpectrum(1)};
        Mesh mesh;
        for (int i = 0; i < count; ++i) addTriangle(mesh, dice.inBox(0.9), dice.inBox(0.9), dice.inBox(0.9));
        addObject(scene, std::move(mesh), diffuse(0.5));
        const Film tree = context.render(scene, samples(2, kFirstHit));
        scene.integrator.accelerator = Accelerator::None;
        context.sameBits(fmt::format("{} triangles", count), context.render(scene, samples(2, kFirstHit)),
                         tree, "a tree of one leaf, or of none, is no tree");
    }
}

}  // namespace

std::vector<Case> geometryCases() {
    constexpr std::uint64_t kFurnace = CRT_FEATURE_BVH | CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT;
    constexpr std::uint64_t kSky = CRT_FEATURE_BVH | CRT_FEATURE_DIFFUSE | CRT_FEATURE_ENVIRONMENT;
    constexpr std::uint64_t kHits = CRT_FEATURE_BVH | CRT_FEATURE_AOV;
    return {
        row("C01", "without-area", "Triangles without area: points, lines, emitting ones, far outside",
            "the image without them, and a warning", "they cannot be seen", "same bits", Level::Commit,
            kFurnace | CRT_FEATURE_NEE, withoutArea),
        row("C02", "slivers", "Triangles of 1 : 1e3 … 1 : 1e8", "hits lie on their triangle",
            "geometry; Embree's issue 387", "rate of false hits ≤ 1e-6, off by more than 1e-5",
            Level::Commit, kHits, slivers),
        row("C03", "duplicates", "A quad 2, 100 and up to 100,000 times",
            "the image of one; the first in the author's order is hit", "docs/architecture.md, Same bits",
            "same bits, with primitives", Level::Commit, kHits | CRT_FEATURE_DIFFUSE, duplicates),
        row("C04", "coplanar", "Squares in one plane, and 1, 4 and 32 ulp apart",
            "the first; from 32 ulp on always the nearer", "docs/architecture.md, Same bits", "every ray",
            Level::Commit, kHits | CRT_FEATURE_AREA_LIGHT, coplanar),
        row("C05", "touching",
            "A sphere on the floor, a box in a corner, boxes with a face in common, in a furnace",
            "E (1 − ρ^(k+1)) / (1 − ρ)", "geometric series", "2e-6", Level::Commit, kFurnace,
            touching),
        row("C06", "thin-walls", "A bright sky around walls of 1e-3, 1e-4 and 1e-5", "inside exactly 0",
            "the room is closed", "exactly", Level::Commit, kSky, thinWalls),
        row("C07", "light-tight-box",
            "A white box in odd poses under a bright sky; 1e9 paths at level nightly",
            "no light inside", "the room is closed", "rate of leaks ≤ 7.7e-9", Level::Commit, kSky,
            lightTightBox),
        row("C08", "cracks", "A vertex on another triangle's edge, exactly and 4 and 64 ulp off it",
            "no leak; as much as the crack is wide", "area of the crack", "± 25 %", Level::Commit, kSky,
            cracks),
        row("C09", "non-manifold",
            "Edges of four faces, a Möbius strip, in a furnace; the same as open glass",
            "E (1 − ρ^(k+1)) / (1 − ρ); finite", "geometric series", "2e-6", Level::Commit,
            kFurnace | CRT_FEATURE_DIELECTRIC, nonManifold),
        row("C10", "flipped-normals", "A diffuse block turned inside out; a glass one, of the inverse index",
            "the same image in the mean", "Lambertian surfaces have two sides; n to 1/n", "± 0.1 %",
            Level::Commit, kFurnace | CRT_FEATURE_NEE | CRT_FEATURE_DIELECTRIC, flippedNormals),
        row("C11", "shading-normals", "A smooth ball of 20 faces; normals tilted by 89 degrees",
            "no more light than the sky's, or than reflectance allows", "energy", "1e-6", Level::Commit,
            kSky | CRT_FEATURE_SMOOTH_NORMALS | CRT_FEATURE_AOV, shadingNormals),
        row("C12", "odd-normals", "Shading normals that are zero, NaN, too long, on the other side",
            "flat, flat, normalised, turned round", "docs/scene.md", "same bits", Level::Commit,
            kSky | CRT_FEATURE_SMOOTH_NORMALS, oddNormals),
        row("C13", "inside-out", "A furnace seen through the back of its faces",
            "E (1 − ρ^(k+1)) / (1 − ρ)",
            "Lambertian surfaces have two sides", "2e-6", Level::Commit, kFurnace, insideOut),
        row("C14", "mirror-funnel", "A needle of mirrors, 1 : 1000, 1000 bounces",
            "ends; no pixel brighter than the sky", "energy", "1e-4", Level::Commit,
            CRT_FEATURE_BVH | CRT_FEATURE_CONDUCTOR | CRT_FEATURE_ENVIRONMENT, mirrorFunnel),
        row("C15", "many-triangles", "10^7 random triangles (20,000 on commits)",
            "some 130 bytes each; first hits as without a tree", "a tree only culls",
            "same bits; ± 40 bytes per triangle", Level::Commit, kHits | CRT_FEATURE_BRUTE_FORCE,
            manyTriangles),
        row("C16", "few-triangles", "0 to 5 triangles with a tree", "the image without one",
            "a tree only culls", "same bits", Level::Commit,
            kSky | CRT_FEATURE_AOV | CRT_FEATURE_BRUTE_FORCE, fewTriangles),
    };
}

}  // namespace crt::verify
