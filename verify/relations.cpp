// Group M: relations between images. Those that hold exactly, M01 to M19, require the same bits and cost
// little; they need no reference.
#include "verify/context.h"
#include "verify/shapes.h"
#include "verify/variants.h"

#include "base/temporary_folder.h"
#include "kernel/dialect/features.h"
#include "kernel/dialect/layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace crt::verify {
namespace {

constexpr std::uint64_t kLitRoom = CRT_FEATURE_BVH | CRT_FEATURE_INDEPENDENT | CRT_FEATURE_DIFFUSE |
                                   CRT_FEATURE_CONDUCTOR | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE;

void scaling(Context& context) {
    const Scene scene = litRoom(24, 1);
    const Film here = context.render(scene, samples(4, kAovNormal | kAovPrimitive));
    for (const int m : {-40, -7, -1, 1, 13, 40})
        context.sameBits(
            fmt::format("times 2^{}", m), here,
            context.render(moved(scene, std::ldexp(1.0, m), {}), samples(4, kAovNormal | kAovPrimitive)),
            "an absolute length survives somewhere: an epsilon, a smallest distance, a clamp");
}

void translation(Context& context) {
    const Scene scene = litRoom(24, 1);
    const Film here = context.render(scene, samples(4, kAllAovs));
    // Vertices are multiples of 2⁻⁴ up to 1: with shifts of up to 2²⁷ that are whole, sums are exact
    // in double, and in an OBJ's decimal digits.
    for (const double t : {1.0, 1e2, 1e4, 1e6, 1e8}) {
        const Vec3d shift{t, std::round(0.7 * t), -std::round(0.3 * t)};
        context.sameBits(fmt::format("by {:g} of its size", t), here,
                         context.render(moved(scene, 1, shift), samples(4, kAllAovs)),
                         "coordinates are rounded to float before the scene is moved to its centre");
    }
}

void permutation(Context& context) {
    // Sums of three products round by their order, so that bits need not agree.
    const auto permuted = [](Scene scene) {
        const auto turn = [](const Vec3d& p) { return Vec3d{p[2], p[0], p[1]}; };
        scene.camera.position = turn(scene.camera.position);
        scene.camera.target = turn(scene.camera.target);
        scene.camera.up = turn(scene.camera.up);
        for (Mesh& mesh : scene.meshes)
            for (Vec3d& p : mesh.positions) p = turn(p);
        return scene;
    };
    std::vector<double> ratios;
    for (std::uint64_t seed = 1; seed <= 8; ++seed)
        ratios.push_back(radiance(context.render(permuted(litRoom(32, seed)), samples(64))) /
                         radiance(context.render(litRoom(32, seed), samples(64))));
    context.equivalent("x, y, z → z, x, y", ratios, 1, 0.01);
}

void triangleOrder(Context& context) {
    const Scene scene = litRoom(24, 1);
    Scene reversed = scene;
    for (std::size_t i = 0; i + 1 < reversed.meshes.size(); ++i)
        std::reverse(reversed.meshes[i].triangles.begin(), reversed.meshes[i].triangles.end());
    context.sameBits("triangles of every mesh but the lamp's backwards", context.render(scene, samples(4)),
                     context.render(reversed, samples(4)),
                     "what is hit depends on the order of testing, beyond ties");
}

void objectOrder(Context& context) {
    const Scene scene = litRoom(24, 1);
    Scene reversed = scene;
    std::reverse(reversed.objects.begin(), reversed.objects.end());
    context.sameBits("objects backwards", context.render(scene, samples(4)),
                     context.render(reversed, samples(4)),
                     "what is hit depends on the order of testing, beyond ties");
}

void vertexOrder(Context& context) {
    const Scene scene = litRoom(24, 1);
    Scene renamed = scene;
    for (Mesh& mesh : renamed.meshes) {
        const auto last = static_cast<std::uint32_t>(mesh.positions.size() - 1);
        std::reverse(mesh.positions.begin(), mesh.positions.end());
        for (auto& t : mesh.triangles)
            for (std::uint32_t& v : t) v = last - v;
    }
    context.sameBits("vertices numbered backwards", context.render(scene, samples(4, kAllAovs)),
                     context.render(renamed, samples(4, kAllAovs)),
                     "an index of a vertex reaches the image");
}

void keyOrder(Context& context) {
    const std::string a = R"(crt: 1
camera: {position: [0, 1, -3], target: [0, 0, 0], fov: 40}
film: {resolution: [16, 16]}
integrator: {max_depth: 3, nee: false}
environment: {radiance: 0.5}
materials: {red: {type: diffuse, reflectance: 0.4}, blue: {type: mirror, reflectance: 0.6}}
objects:
  - {name: a, mesh: {positions: [[-1,0,-1],[-1,0,1],[1,0,1],[1,0,-1]], faces: [[0,1,2,3]]}, material: red}
  - {name: b, mesh: {positions: [[0,0,0],[0,1,0],[1,0,0]], faces: [[0,1,2]]}, material: blue}
)";
    const std::string b = R"(crt: 1
objects:
  - {material: red, mesh: {faces: [[0,1,2,3]], positions: [[-1,0,-1],[-1,0,1],[1,0,1],[1,0,-1]]}, name: a}
  - {mesh: {faces: [[0,1,2]], positions: [[0,0,0],[0,1,0],[1,0,0]]}, name: b, material: blue}
materials: {blue: {reflectance: 0.6, type: mirror}, red: {reflectance: 0.4, type: diffuse}}
environment: {radiance: 0.5}
integrator: {nee: false, max_depth: 3}
film: {resolution: [16, 16]}
camera: {fov: 40, target: [0, 0, 0], position: [0, 1, -3]}
)";
    context.sameBits("every mapping in another order", context.render(a, samples(4)),
                     context.render(b, samples(4)), "the order of keys reaches the image");
}

void doubledEmission(Context& context) {
    const Scene scene = litRoom(24, 1);
    Scene doubled = scene;
    for (Emission& e : doubled.emissions)
        for (double& v : e.radiance.values) v *= 2;
    Film one = context.render(scene, samples(4));
    const Film two = context.render(doubled, samples(4));
    for (double& sum : one.sums) sum *= 2;
    context.sameBits("the lamp twice as bright: every sum doubled", one, two,
                     "light is clamped, compressed or offset somewhere, or roulette looks at radiance");
}

void darkLight(Context& context) {
    const Scene scene = litRoom(24, 1);
    Scene more = scene;
    more.emissions.push_back({constantSpectrum(0), false});
    more.objects[2].emission = static_cast<std::int32_t>(more.emissions.size() - 1);
    context.sameBits("a block that emits 0", context.render(scene, samples(4)),
                     context.render(more, samples(4)),
                     "a light without power takes part in the choice of lights");
}

void hiddenObject(Context& context) {
    const Scene scene = litRoom(24, 1);
    Scene more = scene;
    addObject(more, boxMesh({0.3125, 0.0625, 0.3125}, {0.4375, 0.3125, 0.4375}),
              diffuse(0));  // within the mirror block
    context.sameBits("a black box inside the mirror block", context.render(scene, samples(4, kAllAovs)),
                     context.render(more, samples(4, kAllAovs)), "what no path can meet reaches the image");
}

void splitting(Context& context) {
    forEachVariant(context, 24, [](Context& c, const Variant& v) {
        const Film whole = c.render(v.scene, samples(4));
        for (const auto& [threads, tile] : {std::pair{1u, 1u}, {2u, 5u}, {7u, 16u}})
            c.sameBits(fmt::format("{}: {} threads, tiles of {}", v.name, threads, tile), whole,
                       c.render(v.scene, {.samples = 4, .threads = threads, .tile_size = tile}),
                       "pixels share state, or are summed in the order of the threads");
        if ((v.needs & CRT_FEATURE_SPLAT) != 0) return;  // Fewer samples splat onto a window.
        Film crops = whole;
        for (const auto& [x0, y0, x1, y1] :
             {std::array{0, 0, 10, 24}, std::array{10, 0, 24, 7}, std::array{10, 7, 24, 24}}) {
            Scene cropped = v.scene;
            cropped.film.crop = {x0, y0, x1, y1};
            const Film part = c.render(cropped, samples(4));
            const std::size_t row = 2u * whole.shape().channels * static_cast<std::size_t>(x1 - x0);
            for (int y = y0; y < y1; ++y)
                std::copy_n(
                    part.sums.begin() + static_cast<std::ptrdiff_t>(row * static_cast<std::size_t>(y - y0)),
                    row,
                    crops.sums.begin() + static_cast<std::ptrdiff_t>(2u * whole.shape().channels *
                                                                     static_cast<std::size_t>(y * 24 + x0)));
        }
        c.sameBits(fmt::format("{}: from three crops", v.name), whole, crops,
                   "random numbers depend on the pixel's place in the crop instead of in the film");
    });
}

void ranges(Context& context) {
    forEachVariant(context, 24, [](Context& c, const Variant& v) {
        const auto part = [&](std::uint64_t first, std::uint64_t count) {
            return c.render(v.scene, {.samples = count, .first_sample = first, .aovs = kAllAovs});
        };
        const Film whole = part(0, 12);
        Film merged = part(7, 5);
        merged.add(part(0, 2));
        merged.add(part(2, 5));
        c.sameBits(fmt::format("{}: samples 7 to 12, 0 to 2 and 2 to 7", v.name), whole, merged,
                   "a sample depends on those before it, or sums on their order");
    });
}

void resuming(Context& context) {
    context.notApplicable("killed and resumed",
                          "asked of the program from outside: 'test_kill_then_resume_gives_the_same_bits' "
                          "and 'test_ctrl_c_then_resume_gives_the_same_bits', "
                          "tests/cli/test_cli.py; M12 asks the same of the film");
}

void twice(Context& context) {
    forEachVariant(context, 24, [](Context& c, const Variant& v) {
        c.sameBits(v.name, c.render(v.scene, samples(8, kAllAovs)), c.render(v.scene, samples(8, kAllAovs)),
                   "sums depend on the order of the threads, or state survives a render");
    });
}

void meshForms(Context& context) {
    // Vertices that no short decimal hits; far away, where 17 digits are needed.
    const Mesh ball = [] {
        Mesh mesh = icosphere(1, 0.7, {0, 0, 0});
        for (Vec3d& p : mesh.positions) p = p + Vec3d{1e5 / 3, 0.1, -1e5 / 7};
        return mesh;
    }();
    std::string obj, positions, faces;
    for (const Vec3d& p : ball.positions) {
        obj += fmt::format("v {:.17g} {:.17g} {:.17g}\n", p[0], p[1], p[2]);
        positions += fmt::format("[{:.17g}, {:.17g}, {:.17g}], ", p[0], p[1], p[2]);
    }
    for (const auto& t : ball.triangles) {
        obj += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
        faces += fmt::format("[{}, {}, {}], ", t[0], t[1], t[2]);
    }
    const TemporaryFolder folder;
    const std::string file = folder.write("ball.obj", obj);
    const auto scene = [&](const std::string& mesh, const std::string& more) {
        return fmt::format(
            "crt: 1\ncamera: {{position: [{0}, 1, {1}], target: [{0}, 0, {2}], fov: 40}}\nfilm: "
            "{{resolution: [24, 24]}}\nintegrator: {{max_depth: "
            "3, nee: false}}\n"
            "environment: {{radiance: 1}}\nmaterials: {{m: {{type: diffuse, reflectance: "
            "0.5}}}}\nobjects:\n  - {{name: a, {3}, material: m{4}}}\n",
            1e5 / 3, -1e5 / 7 - 3, -1e5 / 7, mesh, more);
    };
    const std::string in_scene = fmt::format("mesh: {{positions: [{}], faces: [{}]}}", positions, faces);
    const Film film = context.render(scene(in_scene, ""), samples(4, kAllAovs));
    context.sameBits("in an OBJ with 17 digits", film,
                     context.render(scene(fmt::format("obj: '{}'", file), ""), samples(4, kAllAovs)),
                     "an OBJ's coordinates are read as float, or rounded twice");
    context.sameBits(
        "placed by a transform that does nothing", film,
        context.render(scene(in_scene, ", transform: [{translate: [0, 0, 0]}]"), samples(4, kAllAovs)),
        "an identity rounds");
}

void unusedThings(Context& context) {
    const Scene scene = litRoom(24, 1);
    Scene more = scene;
    more.materials.push_back(glass(1.5));
    more.meshes.push_back(icosphere(1, 5, {9, 9, 9}));
    more.emissions.push_back({constantSpectrum(7), true});
    context.sameBits("a material, a mesh and an emission that no object has",
                     context.render(scene, samples(4, kAllAovs)), context.render(more, samples(4, kAllAovs)),
                     "what is not used reaches the image");
}

/// True if the lean kernel differed from the full one.
bool prunes(Context& c, const std::string& name, const Scene& scene, std::uint32_t aovs) {
    const Film lean = c.render(scene, {.samples = 4, .aovs = aovs, .kernel = CRT_KERNEL_LEAN_ONLY});
    const std::uint64_t left = c.report().kernel_features;
    c.sameBits(name, lean, c.render(scene, {.samples = 4, .aovs = aovs, .kernel = CRT_KERNEL_FULL}),
               "leaving out what a scene does not need changes what is left: is a feature's test not the "
               "scene's, or its mask wrong?");
    return left != c.report().kernel_features;
}

void pruning(Context& context) {
    bool any = false;
    // A compiler takes seconds for each of them. The suite of conformance asks the same of other scenes.
    forEachVariant(
        context, 24, [](Context& c, const Variant& v) { prunes(c, v.name, v.scene, kAllAovs); },
        context.byLevel(12, 1, 1));
    // Backends that compile a few kernels ahead need nearly everything for the rooms above; these need
    // little.
    for (const Accelerator accelerator : {Accelerator::None, Accelerator::Bvh}) {
        Scene scene = litRoom(24, 1);
        scene.objects.erase(scene.objects.begin() + 1);  // the mirror
        scene.integrator.accelerator = accelerator;
        any |= prunes(context,
                      accelerator == Accelerator::None ? "diffuse walls, no tree" : "diffuse walls, a tree",
                      scene, 0);
    }
    if (!any)
        context.notApplicable("a kernel that leaves something out",
                              "the backend ran the full kernel each time, so that nothing but one kernel "
                              "was compared with itself");
}

void sideOutputs(Context& context) {
    forEachVariant(context, 24, [](Context& c, const Variant& v) {
        const Film plain = c.render(v.scene, samples(4)), with = c.render(v.scene, samples(4, kAllAovs));
        std::uint64_t differing = 0;
        for (std::uint32_t y = 0; y < 24; ++y)
            for (std::uint32_t x = 0; x < 24; ++x)
                for (std::uint32_t channel = 0; channel < CRT_CHANNELS_BASE; ++channel)
                    differing += plain.mean(x, y, channel) != with.mean(x, y, channel);
        c.holds(fmt::format("{}: with and without AOVs", v.name), differing == 0, "same bits",
                "AOVs take random numbers, or change what is traced",
                fmt::format("{} values differ", differing));
    });
}

void deeperThanPaths(Context& context) {
    // Two mirrors that meet at a right angle return light after two reflections, three after three.
    Scene scene = emptyScene(24, 1, {2, 1.5, 1}, {0, 0, 0}, 0.4);
    scene.environment = Environment{constantSpectrum(1)};
    Mesh corner;
    addQuad(corner, {0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0});
    addQuad(corner, {0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1});
    addQuad(corner, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0});
    addObject(scene, std::move(corner), mirror(0.5));
    const auto at = [&](int depth) {
        scene.integrator.max_depth = depth;
        return context.render(scene, samples(8));
    };
    const Film ended = at(3);
    for (const int depth : {4, 64, 1000000})
        context.sameBits(fmt::format("depth {} as 3", depth), ended, at(depth),
                         "paths go on after they have left the scene, or the depth counts otherwise");
    context.holds("depth 2 gives a different image", radiance(at(2)) != radiance(ended), "other bits",
                  "the question is empty: no path has three reflections");
}

}  // namespace

std::vector<Case> exactRelationCases() {
    const auto relation = [](const char* id, const char* case_name, const char* title, const char* source,
                             std::uint64_t needs, void (*run)(Context&),
                             const char* expected = "the same image", const char* tolerance = "same bits") {
        return row(id, case_name, title, expected, source, tolerance, Level::Commit, needs, run);
    };
    return {
        relation("M01", "same-scaled", "A lit room times 2^m, m up to ±40", "powers of two round nothing",
                 kLitRoom, scaling),
        relation("M02", "same-moved", "A lit room moved by up to 1e8 of its size, representably",
                 "sums that are exact round nothing", kLitRoom, translation),
        relation("M03", "same-permuted", "Axes permuted, with the camera",
                 "sums of three products round by their order: equal in the mean", kLitRoom, permutation,
                 "the same mean", "± 1 %"),
        relation("M04", "triangle-order", "Triangles in another order", "docs/architecture.md, Same bits",
                 kLitRoom, triangleOrder),
        relation("M05", "object-order", "Objects in another order", "docs/architecture.md, Same bits",
                 kLitRoom, objectOrder),
        relation("M06", "vertex-order", "Vertices numbered otherwise", "names are not geometry", kLitRoom,
                 vertexOrder),
        relation("M07", "key-order", "Keys of the scene file in another order",
                 "YAML mappings have no order", 0, keyOrder),
        relation("M08", "doubled-emission", "The lamp twice as bright",
                 "light is linear, and powers of two round nothing", kLitRoom, doubledEmission,
                 "every pixel doubled"),
        relation("M09", "dark-light", "A light without power added", "it brings nothing", kLitRoom,
                 darkLight),
        relation("M10", "hidden-object", "A black object added where no path comes", "it takes nothing",
                 kLitRoom, hiddenObject),
        relation("M11", "splitting", "Threads, tiles, crops", "docs/architecture.md, Same bits", 0,
                 splitting),
        relation("M12", "sample-ranges", "Sample ranges in pieces, out of order",
                 "docs/architecture.md, Film", 0, ranges),
        relation("M13", "resuming", "Killed and resumed", "docs/architecture.md, Film", 0, resuming),
        relation("M14", "twice", "The same seed twice", "docs/architecture.md, Same bits", 0, twice),
        relation("M15", "mesh-forms",
                 "A mesh in the scene, in an OBJ, placed by the identity; far from the origin",
                 "it is the same mesh", 0, meshForms),
        relation("M16", "unused-things", "Materials, meshes and emissions that are not used",
                 "they are not used", kLitRoom, unusedThings),
        relation("M17", "pruning", "The kernel made for the scene, and the one that has everything",
                 "docs/architecture.md, Same bits", 0, pruning),
        relation("M18", "side-outputs", "With and without AOVs", "they only look", CRT_FEATURE_AOV,
                 sideOutputs),
        relation("M19", "deeper-than-paths", "Depths beyond the longest path", "paths have ended",
                 CRT_FEATURE_CONDUCTOR | CRT_FEATURE_ENVIRONMENT, deeperThanPaths),
    };
}

}  // namespace crt::verify
