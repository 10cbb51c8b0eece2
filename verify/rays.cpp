// Group D: rays and traversal. Rays are those of cameras, known beforehand (probes.h); what they must meet
// is known by topology or by arithmetic in double.
#include "verify/probes.h"

#include "kernel/dialect/features.h"
#include "kernel/dialect/layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace crt::verify {
namespace {

constexpr std::uint64_t kRaysNeed = CRT_FEATURE_BVH | CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_INDEPENDENT;

void aimedRays(Context& context) {
    for (const Aim aim : {Aim::Vertex, Aim::Edge, Aim::Face}) {
        const std::uint64_t rays = context.byLevel(16000, 200000, 10000000),
                            per_vertex = aim == Aim::Face ? 16 : 1;
        rareFailures(context, fmt::format("rays at {}", name(aim)),
                     collect(rays,
                             [&](std::uint64_t seed) {
                                 return missesOfAimedRays(context, aim, kPlaces[0], 64, seed, per_vertex);
                             }),
                     1e-6,
                     "rays slip through where triangles meet: is the sign of the edge functions not the "
                     "same from both sides, or a candidate culled?");
    }
}

/// A wall across the view at z = 1, cut into `cells`² squares, whose edges and boxes' faces lie in the
/// planes of constant x and y through the origin.
Mesh wall(int cells) {
    Mesh mesh;
    const auto at = [&](int i) { return 2.0 * i / cells - 1; };
    for (int i = 0; i < cells; ++i)
        for (int j = 0; j < cells; ++j)
            addQuad(mesh, {at(i), at(j), 1}, {at(i + 1), at(j), 1}, {at(i + 1), at(j + 1), 1},
                    {at(i), at(j + 1), 1});
    return mesh;
}

/// x, y, z → the same, turned so that the first axis becomes `axis`; with `back`, looking the other way.
Scene turned(Scene scene, int axis, bool back) {
    const auto turn = [&](const Vec3d& p) {
        Vec3d q;
        for (std::size_t k = 0; k < 3; ++k)
            q[(k + static_cast<std::size_t>(axis)) % 3] = back ? -p[k] : p[k];
        return q;
    };
    scene.camera.position = turn(scene.camera.position);
    scene.camera.target = turn(scene.camera.target);
    scene.camera.up = turn(scene.camera.up);
    for (Mesh& mesh : scene.meshes)
        for (Vec3d& p : mesh.positions) p = turn(p);
    return scene;
}

/// Rays from the origin, spread over ±`width` in x and ±`height` in y, at a wall that nothing can miss.
Tally missesOfWall(Context& context, double width, double height, int axis, bool back) {
    Scene scene = emptyScene(64, 1, {0, 0, 0}, {0, 0, 1}, 0);
    scene.camera.up = {0, 1, 0};
    scene.camera.tan_half_width = width;
    scene.camera.tan_half_height = height;
    scene.integrator.max_depth = 0;
    scene.environment = Environment{constantSpectrum(1)};
    addObject(scene, wall(16), diffuse(0));
    const Film film = context.render(turned(std::move(scene), axis, back), samples(4));
    Tally tally{film.counts.size() * 4, 0};
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x) tally.failures += radiance(film, x, y) > 0;
    return tally;
}

void raysInFaces(Context& context) {
    const std::string physics =
        "a box is culled that the ray runs along: 0·∞ in the "
        "slab test, a clamped reciprocal, or the sign of −0";
    for (const auto& [what, width, height] : {std::tuple{"rays in the plane of the boxes' faces", 0.5, 0.0},
                                              {"rays in two such planes, along an axis", 0.0, 0.0}}) {
        Tally all;
        for (int axis = 0; axis < 3; ++axis)
            for (const bool back : {false, true}) all += missesOfWall(context, width, height, axis, back);
        rareFailures(context, what, all, 1e-6, physics);
    }
}

void nearlyParallelRays(Context& context) {
    for (const double tiny : {1e-10, 1e-20, 1e-38, 1e-42}) {
        Tally all;
        for (int axis = 0; axis < 3; ++axis) {
            all += missesOfWall(context, tiny, tiny, axis, axis == 1);
            all += missesOfWall(context, 0.5, tiny, axis, axis == 2);
        }
        rareFailures(context, fmt::format("components of {:g}", tiny), all, 1e-6,
                     "a box is culled whose reciprocal direction overflows or is flushed to zero");
    }
}

void grazingRays(Context& context) {
    for (int exponent = 1; exponent <= 7; ++exponent) {
        const double angle = std::pow(10.0, -exponent);
        Scene scene =
            emptyScene(64, 1, {0, 0.5 * std::sin(angle), 0.5 * std::cos(angle)}, {0, 0, 0}, 0.2 * angle);
        scene.camera.up = {0, 1, 0};
        scene.camera.tan_half_width = 0.3;
        scene.integrator.max_depth = 1;
        scene.environment = Environment{constantSpectrum(1000)};
        Mesh floor;  // of 100 × 100 cells, in the plane y = 0 exactly
        for (int i = 0; i < 100; ++i)
            for (int j = 0; j < 100; ++j) {
                const double x0 = i / 64.0 - 0.75, x1 = (i + 1) / 64.0 - 0.75, z0 = j / 64.0 - 0.75,
                             z1 = (j + 1) / 64.0 - 0.75;
                addQuad(floor, {x0, 0, z0}, {x0, 0, z1}, {x1, 0, z1}, {x1, 0, z0});
            }
        addObject(scene, std::move(floor), mirror(1), 1, true);
        const Film film = context.render(scene, samples(1, kAovDepth | kAovPrimitive));
        Tally wrong;
        double farthest = 0;
        for (std::uint32_t y = 0; y < 64; ++y)
            for (std::uint32_t x = 0; x < 64; ++x) {
                if (film.primitives[64 * y + x] == CRT_NONE) continue;
                ++wrong.rays;
                // The sky after one reflection: a ray that met the floor again brings at most 2.
                wrong.failures += radiance(film, x, y) < 100;
                farthest =
                    fartherFrom(0, farthest, film.mean(x, y, firstChannel(film.shape().aovs, kAovDepth)));
            }
        rareFailures(context, fmt::format("reflected at {:g} rad", angle), wrong, 1e-5,
                     "a grazing ray meets the plane that it leaves");
        context.holds(fmt::format("distances at {:g} rad", angle), farthest <= 0.5 + 0.82 * std::sqrt(2.0),
                      "within the floor",
                      "a false hit far away: the distance is divided by a determinant that is rounding",
                      fmt::format("farthest {:g}", farthest));
    }
}

void startsOnSurfaces(Context& context) {
    // Segments are open at both ends: what a ray starts on, it does not meet.
    for (const auto& [what, eye] : {std::pair{"in a face", Vec3d{0.03, 0, 0.02}},
                                    {"on an edge", Vec3d{0.03, 0, 0}},
                                    {"on a vertex", Vec3d{0, 0, 0}}})
        for (const double side : {1.0, -1.0}) {
            Scene scene = emptyScene(32, 1, eye, eye + Vec3d{0.1, side, 0.2}, 0.5);
            scene.integrator.max_depth = 0;
            Mesh floor;
            for (int i = -4; i < 4; ++i)
                for (int j = -4; j < 4; ++j) {
                    const double x = i / 4.0, z = j / 4.0;
                    addQuad(floor, {x, 0, z}, {x, 0, z + 0.25}, {x + 0.25, 0, z + 0.25}, {x + 0.25, 0, z});
                }
            addObject(scene, std::move(floor), diffuse(0), 1, true);
            scene.environment = Environment{constantSpectrum(1000)};
            const Film film = context.render(scene, samples(4));
            std::uint64_t met = 0;
            for (std::uint32_t y = 0; y < 32; ++y)
                for (std::uint32_t x = 0; x < 32; ++x) met += radiance(film, x, y) < 500;
            context.holds(fmt::format("camera {}, looking {}", what, side > 0 ? "up" : "down"), met == 0,
                          "the surface is not met", "distance 0 counts as a hit",
                          fmt::format("{} of 1024 pixels see it", met));
        }
}

const char* const kTriangle =
    "crt: 1\ncamera: {{position: [0, 0, -3], target: [0, 0, 0], fov: 40}}\nfilm: {{resolution: [4, "
    "4]}}\nenvironment: {{radiance: 1}}\n"
    "materials: {{m: {{type: diffuse, reflectance: 0.5}}}}\n"
    "objects: [{{material: m, mesh: {{positions: [[0, 0, 0], "
    "[1, 0, 0], [0, {}, 0]], faces: [[0, 1, 2]]}}}}]\n";

void farVertex(Context& context) {
    const Film film = context.render(fmt::format(fmt::runtime(kTriangle), "1e30"));
    context.holds("a vertex at 1e30", film.invalidSamples() == 0, "accepted, finite", "an overflow");
}

/// Triangles of 10^least to 10^most, of all shapes, within ±1, a third of them in planes of constant x, y
/// or z.
Mesh soup(Dice& dice, int count, double least = -2.5, double most = -0.5) {
    Mesh mesh;
    for (int i = 0; i < count; ++i) {
        const Vec3d p = dice.inBox(0.9);
        const double size = std::pow(10.0, dice.uniform(least, most));
        Vec3d a = dice.direction() * size,
              b = dice.direction() * (size * std::pow(10.0, dice.uniform(-3, 0)));
        if (i % 3 == 0) a[static_cast<std::size_t>(i / 3 % 3)] = b[static_cast<std::size_t>(i / 3 % 3)] = 0;
        addTriangle(mesh, p, p + a, p + b);
    }
    return mesh;
}

constexpr std::uint32_t kFirstHit = kAovNormal | kAovDepth | kAovPrimitive;

void occlusionAndClosest(Context& context) {
    // Light sampling tests if any surface lies between; scattering finds the nearest surface. Where either
    // alone brings light, both must bring the same.
    const int count = context.atLeast(Level::Merge) ? 12 : 2;
    for (int i = 0; i < count; ++i) {
        Dice dice(static_cast<std::uint64_t>(i) + 1);
        Scene scene = emptyScene(32, static_cast<std::uint64_t>(i), {0, 0, -3}, {0, 0, 0}, 0.4);
        scene.integrator.max_depth = 1;
        addObject(scene, soup(dice, 400, -1, -0.4), diffuse(1));
        Mesh lamp;
        addQuad(lamp, {-2, 2, -2}, {2, 2, -2}, {2, 2, 2}, {-2, 2, 2});
        addObject(scene, std::move(lamp), diffuse(0), 1);
        Scene light_sampling = scene;
        light_sampling.integrator.nee = true;
        const auto ratios = [&](std::uint64_t samples) {
            std::vector<double> ratio;
            for (std::uint64_t seed = 1; seed <= 16; ++seed) {
                const double by_scattering =
                    radiance(context.render(scene, {.samples = samples, .seed = seed}));
                ratio.push_back(
                    radiance(context.render(light_sampling, {.samples = samples, .seed = seed})) /
                    by_scattering);
            }
            return ratio;
        };
        const std::uint64_t samples = context.byLevel(64, 512, 4096);
        context.equivalent(fmt::format("400 triangles, scene {}: light sampling over scattering", i), ratios,
                           1, static_cast<double>(context.byLevel(40, 20, 5)) * 1e-3,
                           {.samples = samples, .most = 16 * samples});
    }
}

void bruteForceAndTree(Context& context) {
    Dice dice(9);
    const std::pair<const char*, Mesh> meshes[] = {{"60 triangles", soup(dice, 60)},
                                                   {"2000 triangles", soup(dice, 2000)},
                                                   {"sphere of 1280", icosphere(3, 0.9, {0, 0, 0})},
                                                   {"wall in the axes' planes", wall(16)}};
    for (const auto& [what, mesh] : meshes)
        for (const double distance : {0.05, 3.0, 1e4}) {
            Scene scene =
                emptyScene(context.atLeast(Level::Merge) ? 320 : 64, 3, Vec3d{0.1, 0.2, -1} * distance,
                           {0, 0, 0}, distance > 1 ? 1 / distance : 1);
            scene.integrator.max_depth = 0;
            addObject(scene, mesh, diffuse(0.5));
            const Film tree = context.render(scene, samples(1, kFirstHit));
            scene.integrator.accelerator = Accelerator::None;
            context.sameBits(
                fmt::format("{}, from {:g} away", what, distance),
                context.render(scene, samples(1, kFirstHit)), tree,
                "the tree loses a triangle, finds another one, or a tie is decided by the order of testing");
        }
}

void deepTree(Context& context) {
    // Each the size of the last times ½, or a little less, about one point; in the end all alike.
    for (const auto& [what, ratio] : {std::pair{"ratio ½", 0.5}, {"ratio 0.999", 0.999}}) {
        Scene scene = emptyScene(64, 1, {0, 0, -1}, {0, 0, 0}, 0.6);
        scene.integrator.max_depth = 0;
        Mesh nest;
        const int count = static_cast<int>(context.byLevel(1 << 12, 1 << 16, 1 << 20));
        for (int i = 0; i < count; ++i) {
            // Not to nothing: what has no area is left out.
            const double s = std::max(std::pow(ratio, i), 1e-12);
            addTriangle(nest, {-s, -s, s}, {s, -s, s}, {0, s, s});
        }
        addObject(scene, std::move(nest), diffuse(0.5));
        const Film tree = context.render(scene, samples(1, kFirstHit));
        std::uint64_t seen = 0;
        for (const std::uint32_t id : tree.primitives) seen += id != CRT_NONE;
        context.holds(fmt::format("{} nested triangles, {}: rendered", count, what), seen > 500,
                      "to its end", "the tree is deeper than the stack of its traversal",
                      fmt::format("{} of 4096 rays hit", seen));
        if (count > 1 << 12) continue;
        scene.integrator.accelerator = Accelerator::None;
        context.sameBits(fmt::format("{} nested triangles, {}: as without a tree", count, what),
                         context.render(scene, samples(1, kFirstHit)), tree,
                         "the tree is deeper than the stack of its traversal");
    }
}

}  // namespace

std::vector<Case> rayCases() {
    return {
        row("D01", "aimed-rays",
            "Rays at the vertices, edges and faces of crumpled sheets that cover the film",
            "none slips through", "topology", "rate of misses ≤ 1e-6 each", Level::Commit, kRaysNeed,
            aimedRays),
        row("D02", "rays-in-faces", "Rays in the planes of boxes' faces, along all axes, components of ±0",
            "every ray meets the wall", "geometry", "rate of misses ≤ 1e-6", Level::Commit, kRaysNeed,
            raysInFaces),
        row("D03", "nearly-parallel", "Directions with components of 1e-10, 1e-20, 1e-38 and 1e-42",
            "every ray meets the wall", "geometry", "rate of misses ≤ 1e-6", Level::Commit, kRaysNeed,
            nearlyParallelRays),
        row("D04", "grazing", "Rays at 1e-1 … 1e-7 rad to a mirror of 100 × 100 cells",
            "reflected to the sky, from a point of the floor", "geometry", "rate of false hits ≤ 1e-5",
            Level::Commit, kRaysNeed | CRT_FEATURE_CONDUCTOR | CRT_FEATURE_AOV, grazingRays),
        row("D05", "starts-on-surfaces", "A camera in a face, on an edge, on a vertex",
            "segments are open: the surface is not met", "docs/decisions/0004-ray-offsets.md",
            "none of 1024 pixels", Level::Commit, kRaysNeed | CRT_FEATURE_AREA_LIGHT, startsOnSurfaces),
        row("D07", "far-vertex", "A triangle with a vertex at 1e30", "rendered, finite", "docs/scene.md",
            "finite", Level::Commit, 0, farVertex),
        row("D08", "occlusion-and-closest", "Light sampling and chance hits in a thicket",
            "the same radiance", "both estimate the same integral",
            "± 4 %; ± 2 % at level merge, ± 0.5 % at level nightly", Level::Commit,
            CRT_FEATURE_BVH | CRT_FEATURE_NEE | CRT_FEATURE_AREA_LIGHT, occlusionAndClosest),
        row("D09", "brute-force-and-tree",
            "First hits with and without a tree, from inside, outside and far away", "the same",
            "a tree only culls", "same bits, with depth, normal and primitive", Level::Commit,
            CRT_FEATURE_BVH | CRT_FEATURE_BRUTE_FORCE | CRT_FEATURE_AOV, bruteForceAndTree),
        row("D10", "deep-tree", "2^20 nested triangles (2^12 on commits)",
            "rendered to its end, and as without a tree", "a tree only culls", "same bits", Level::Commit,
            CRT_FEATURE_BVH | CRT_FEATURE_BRUTE_FORCE | CRT_FEATURE_AOV, deepTree),
    };
}

}  // namespace crt::verify
