// Rays that leave a surface meet neither it nor the world behind the wall. These tests are about clearances:
// they do not depend on how rays are traced, which unit_kernel_rays.cpp asks bit by bit.
#include "kernel_test.h"

#include <algorithm>

using namespace kernel_test;
using crt::Accelerator;
using crt::Mesh;
using crt::Vec3d;
using crt::verify::addTriangle;

namespace {

crt::Matrix4d placed(const Vec3d& scale, const Vec3d& axis, double angle, const Vec3d& shift) {
    const Vec3d a = unit(axis);
    const double c = std::cos(angle), s = std::sin(angle);
    crt::Matrix4d m{};
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            const double skew = i == j ? 0 : ((j + 3 - i) % 3 == 1 ? -a[3 - i - j] : a[3 - i - j]);
            m[4 * i + j] = ((i == j ? c : 0) + (1 - c) * a[i] * a[j] + s * skew) * scale[j];
        }
        m[4 * i + 3] = shift[i];
    }
    m[15] = 1;
    return m;
}

/// A closed box whose six faces are separate quads, facing inwards, the ceiling alight; and, where asked
/// for, a triangle far away, or, outside of it but near (`far` below 0), a small one: then walls are large
/// against what is there, and come in pieces.
crt::Scene room(const Vec3d& scale, const Vec3d& axis, double angle, double far) {
    const Vec3d corners[6][4] = {
        {{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}}, {{0, 1, 0}, {1, 1, 0}, {1, 1, 1}, {0, 1, 1}},
        {{0, 0, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}}, {{1, 0, 0}, {1, 0, 1}, {1, 1, 1}, {1, 1, 0}},
        {{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}}, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}};
    crt::Scene scene;
    scene.camera.position = {0.5, 0.5, 0.2};
    scene.camera.target = {0.5, 0.5, 1};
    scene.integrator.accelerator = Accelerator::None;
    scene.emissions.push_back({crt::constantSpectrum(1), false});
    for (int face = 0; face < 6; ++face) {
        Mesh mesh;
        mesh.positions.assign(corners[face], corners[face] + 4);
        mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
        scene.meshes.push_back(mesh);
        crt::Object object;
        object.mesh = static_cast<std::uint32_t>(face);
        object.transforms = {placed(scale, axis, angle, {0, 0, 0})};
        object.emission = face == 1 ? 0 : -1;
        scene.objects.push_back(object);
    }
    if (far != 0) {
        Mesh mesh;
        const double size = far > 0 ? 1 : 0.0625;
        addTriangle(mesh, {far, 0.3 * far, -0.6 * far}, {far + size, 0.3 * far, -0.6 * far},
                    {far, 0.3 * far + size, -0.6 * far});
        scene.meshes.push_back(mesh);
        scene.objects.emplace_back();
        scene.objects.back().mesh = 6;
        if (far < 0) scene.objects.back().transforms = {placed({1, 1, 1}, axis, angle, {0, 0, 0})};
    }
    return scene;
}

struct Walk {
    std::uint64_t vertices = 0, escapes = 0, self_hits = 0, self_shadows = 0, dark = 0, lit = 0;
};

/// Diffuse bounces from wall to wall, and at each a shadow ray to the ceiling, from `share` of the
/// clearance.
Walk walkIn(const crt::CompiledScene& compiled, std::uint64_t vertices, Random& random, f32 share = 1) {
    const CrtContext ctx = contextOf(compiled);
    const auto* triangles = arrayOf<CrtTriangle>(compiled, ctx.scene->triangles);
    const auto* primitives = arrayOf<CrtPrimitive>(compiled, ctx.scene->primitives);
    const auto object_of = [&](const CrtHit& h) {
        return h.slot == CRT_NONE ? CRT_NONE : primitives[h.id].object;
    };
    u32 walls = 0;
    while (walls < ctx.scene->triangle_count && primitives[walls].object < 6) ++walls;
    Walk walk;
    CrtHit hit = crt_no_hit(CRT_INFINITY);
    vec3 wo = make_vec3(0, 0, 0);
    for (; walk.vertices < vertices; ++walk.vertices) {
        if (hit.slot == CRT_NONE) {
            // Anywhere on a wall, corners and edges as often as faces.
            hit.slot = random.below(walls);
            hit.id = triangles[hit.slot].id;
            const f32 tiny = static_cast<f32>(std::pow(10.0, random.uniform(-12, 0)));
            const u32 corner = random.below(3);
            const f32 other =
                random.bits() & 1 ? tiny * 0.3f : static_cast<f32>(random.uniform(0, 1 - tiny));
            const f32 b[3] = {tiny, other, std::max(0.0f, 1 - tiny - other)};
            hit.b1 = b[corner];
            hit.b2 = b[(corner + 1) % 3];
            wo = crt_surface(&ctx, hit).ng;
        }
        const CrtSurface surface = crt_surface(&ctx, hit);
        const f32 clearance = surface.clearance * share;
        const vec3 ng = dot3(wo, surface.ng) > 0 ? surface.ng : -surface.ng;
        CrtSampler sampler = crt_sampler_begin(CRT_SAMPLER_INDEPENDENT, 0,
                                               crt_seed(1, static_cast<u32>(random.bits())), 2, 3);
        const CrtLightSample light =
            crt_light_sample(&ctx, crt_light_choose(&ctx, &sampler, 0), &sampler, 0, surface.p);
        if (light.pdf > 0 && dot3(light.wi, ng) > 0) {
            const vec3 o = crt_offset_origin(surface.p, clearance, ng, light.wi);
            const CrtRay shadow = rayOf(o, light.point - o, light.reach);
            ++walk.lit;
            const CrtHit occluder = oneByOne(ctx, shadow);
            walk.dark += crt_brute_force_any(&ctx, shadow, nullptr) != 0 || occluder.slot != CRT_NONE;
            walk.self_shadows += object_of(occluder) == 1;
        }
        const CrtScatter scatter = crt_sample_diffuse(splat4(1), ng, ng, random.pair());
        if (!scatter.valid) {
            hit.slot = CRT_NONE;
            continue;
        }
        const u32 left = hit.id;
        hit = crt_brute_force_closest(
            &ctx, rayOf(crt_offset_origin(surface.p, clearance, surface.ng, scatter.wi), scatter.wi));
        walk.self_hits += hit.slot != CRT_NONE && hit.id == left;
        if (!(object_of(hit) < 6)) {
            ++walk.escapes;
            hit.slot = CRT_NONE;
        }
        wo = -scatter.wi;
    }
    return walk;
}

struct Room {
    Vec3d scale;
    double far;
};
const Room kRooms[] = {{{1, 1, 1}, 0},        {{1, 1, 1}, 1e3},      {{1, 1, 1}, 1e5},
                       {{100, 1, 1}, 0},      {{100, 1, 1}, 1e4},    {{100, 1, 1}, 1e5},
                       {{10000, 1, 1}, 0},    {{10000, 1, 1}, 1e5},  {{1e-3, 1, 1}, 0},
                       {{1, 1e-3, 1}, 100},   {{3e7, 2e7, 1e7}, 0},  {{0.7e-5, 1e-5, 2e-5}, 0},
                       {{1e4, 1, 1e4}, -0.5}, {{1e5, 1e5, 1}, -0.5}, {{1e6, 1e6, 1}, -0.5}};

/// The room as it is (turn 0), or turned by 33 degrees about y (1) or about an axis of no wall (2).
crt::CompiledScene compiledRoom(const Room& r, int turn) {
    return crt::compileScene(room(r.scale, turn == 2 ? Vec3d{1, 2, 3} : Vec3d{0, 1, 0},
                                  turn == 0 ? 0 : 33 * 3.14159265358979 / 180, r.far),
                             0);
}

}  // namespace

TEST_CASE("no path leaves a closed room, and none meets the wall that it leaves", "[kernel][rays]") {
    Random random(28);
    Walk all;
    for (const Room& r : kRooms)
        for (int turn = 0; turn < 3; ++turn) {
            const Walk walk = walkIn(compiledRoom(r, turn), 60000, random);
            INFO("room " << r.scale[0] << "×" << r.scale[1] << "×" << r.scale[2] << ""
                         << ", triangle at " << r.far
                         << ", turn " << turn);
            CHECK(walk.escapes == 0);
            CHECK(walk.self_hits == 0);
            CHECK(walk.self_shadows == 0);
            all.vertices += walk.vertices;
            if (r.far < 0) continue;  // a ceiling as large as these is rounded by more than its neighbours
            all.lit += walk.lit;
            all.dark += walk.dark;
        }
    CHECK(all.vertices > 2000000);
    CHECK(all.lit > 500000);
    // A point of the ceiling's rim may round to just behind the wall that it meets there, and is then not
    // seen from near that wall.
    CHECK(static_cast<double>(all.dark) < 2e-4 * static_cast<double>(all.lit));
}

TEST_CASE("a ray starts on the side that it goes to, reflected or refracted", "[kernel][rays]") {
    Random random(31);
    std::uint64_t wrong = 0;
    for (int i = 0; i < 2000; ++i) {
        const crt::CompiledScene compiled =
            crt::compileScene(sceneOf(soup(random, 2), Accelerator::None), 0);
        const CrtContext ctx = contextOf(compiled);
        for (int k = 0; k < 50; ++k) {
            CrtHit hit = crt_no_hit(CRT_INFINITY);
            hit.slot = hit.id = random.below(2);
            hit.b1 = static_cast<f32>(random.uniform(0, 0.5));
            hit.b2 = static_cast<f32>(random.uniform(0, 0.5));
            const CrtSurface surface = crt_surface(&ctx, hit);
            const vec3 w = toFloat(random.direction());
            const Vec3d o = toDouble(crt_offset_origin(surface.p, surface.clearance, surface.ng, w));
            const CrtTriangle& t = CRT_ARRAY(CrtTriangle, ctx.blob, ctx.scene->triangles)[hit.slot];
            const Vec3d a = toDouble(vertexOf(t, 0)),
                        n = cross(minus(toDouble(vertexOf(t, 1)), a), minus(toDouble(vertexOf(t, 2)), a));
            wrong += (dot(minus(o, a), n) > 0) != (dot(toDouble(w), n) > 0);
        }
    }
    CHECK(wrong == 0);
}

TEST_CASE("parallel layers at 1e-5 of their size are seen", "[kernel][rays]") {
    // An offset that is safe because it is large steps over the neighbour. From anywhere on the lower layer
    // but its rim, the upper one is met.
    Random random(29);
    std::uint64_t skipped = 0;
    constexpr double kGap = 1e-5;
    for (int i = 0; i < 20000; ++i) {
        const Vec3d n = random.direction(), x = unit(cross(n, random.direction())), y = cross(n, x);
        const Vec3d at = times(random.direction(), random.uniform());
        Mesh mesh;
        for (const double height : {0.0, kGap}) {
            const Vec3d centre = plus(at, times(n, height));
            addTriangle(mesh, minus(centre, plus(x, y)), plus(centre, minus(x, y)), plus(centre, y));
        }
        const crt::CompiledScene compiled = crt::compileScene(sceneOf(mesh, Accelerator::None), 0);
        const CrtContext ctx = contextOf(compiled);
        CrtHit hit = crt_no_hit(CRT_INFINITY);
        hit.slot = hit.id = 0;
        hit.b1 = static_cast<f32>(random.uniform(0.1, 0.4));
        hit.b2 = static_cast<f32>(random.uniform(0.1, 0.4));
        const CrtSurface surface = crt_surface(&ctx, hit);
        const vec3 d = unitFloat(plus(n, times(random.direction(), 0.9)));
        const vec3 o = crt_offset_origin(surface.p, surface.clearance, surface.ng, d);
        skipped += crt_brute_force_closest(&ctx, rayOf(o, d)).id != 1;
    }
    CHECK(skipped == 0);
}

TEST_CASE("a third of the clearance that rays are given would do", "[kernel][rays]") {
    Random random(30);
    std::uint64_t failures = 0;
    for (const Room& r : kRooms)
        for (int turn = 0; turn < 3; ++turn) {
            const Walk walk = walkIn(compiledRoom(r, turn), 60000, random, 1.0f / 3);
            failures += walk.escapes + walk.self_hits;
        }
    CHECK(failures == 0);
}
