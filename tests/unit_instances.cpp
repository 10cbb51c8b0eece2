// Meshes that are stored once and placed many times: rays against them, their surfaces, what shares a mesh
// and what does not, and what it costs.
//
// Over 450 lines: one subject, from its rays to its scene files.
#include "captured_log.h"
#include "compiled_scenes.h"
#include "scene_texts.h"

#include "compile/near_surfaces.h"
#include "compile/placements.h"
#include "verify/shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

using namespace compile_test;
using crt::Matrix4d;
using crt::Mesh;
using crt::Object;
using crt::Sharing;
using crt::verify::icosphere;
using namespace crt::test;

namespace {

/// Turned somehow, scaled along its axes, mirrored where a scale is negative, and moved.
Matrix4d placedAt(const Vec3d& position, const Vec3d& scale, Random& random) {
    const Vec3d w = random.direction(), u = unit(cross(w, random.direction())), v = cross(w, u);
    Matrix4d m = crt::kIdentity4d;
    for (std::size_t k = 0; k < 3; ++k) {
        m[4 * k] = u[k] * scale[0];
        m[4 * k + 1] = v[k] * scale[1];
        m[4 * k + 2] = w[k] * scale[2];
        m[4 * k + 3] = position[k];
    }
    return m;
}

Vec3d randomPoint(Random& random, double within) {
    return {random.uniform(-within, within), random.uniform(-within, within),
            random.uniform(-within, within)};
}

/// Triangles of all sizes, anywhere within ±1, with normals and texture coordinates.
Mesh texturedSoup(Random& random, std::uint32_t count) {
    Mesh mesh;
    for (std::uint32_t i = 0; i < count; ++i) {
        const Vec3d p = randomPoint(random, 1);
        const double size = std::pow(10.0, random.uniform(-3, 0));
        crt::verify::addTriangle(mesh, p, plus(p, times(random.direction(), size)),
                                 plus(p, times(random.direction(), size * random.uniform(0.01, 1))));
    }
    Vec3d normal{};
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        if (i % 3 == 0) normal = random.direction();
        mesh.normals.push_back(unit(plus(normal, times(random.direction(), 0.3))));
        mesh.uvs.push_back({random.uniform(0, 2), random.uniform(0, 2)});
    }
    mesh.normal_index = mesh.uv_index = mesh.triangles;
    return mesh;
}

/// Two meshes in many places each, beside triangles that are where they stand and a sphere; textured, so
/// that coordinates are kept.
Scene crowd(Random& random, const std::vector<Vec3d>& scales, Sharing sharing, double spread = 1) {
    Scene scene = sceneOf(texturedSoup(random, 40), crt::Accelerator::Bvh);
    scene.textures.emplace_back();
    scene.textures.back().kind = crt::Texture::Kind::Checker;
    scene.materials.resize(1);
    scene.materials[0].reflectance = crt::constantSpectrum(0.5);
    scene.materials[0].reflectance_texture = 0;
    scene.objects[0].material = 0;
    for (const std::uint32_t triangles : {60u, 300u}) {
        scene.meshes.push_back(texturedSoup(random, triangles));
        Object object;
        object.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
        object.material = 0;
        object.sharing = sharing;
        object.transforms.clear();
        for (const Vec3d& scale : scales)
            object.transforms.push_back(placedAt(randomPoint(random, spread), scale, random));
        scene.objects.push_back(object);
    }
    Object ball;
    ball.mesh = static_cast<std::uint32_t>(scene.meshes.size());
    scene.meshes.emplace_back();
    ball.material = 0;
    ball.shape = crt::Quadric{.type = crt::QuadricType::Sphere, .radius = 0.2, .from_z = -0.2, .to_z = 0.2};
    scene.objects.push_back(ball);
    return scene;
}

const std::vector<Vec3d> kGentle{{0.3, 0.3, 0.3}, {0.5, 0.4, 0.6}, {-0.3, 0.5, 0.5}, {1, 1, 1}};
/// Needles, plates, specks and mirrors.
const std::vector<Vec3d> kHarsh{{1, 1e-3, 1e-3},    {1, 1, 1e-3},   {1e-4, 1e-4, 1e-4}, {-1, -2, -0.01},
                                {1e-6, 1e-6, 1e-6}, {30, 30, 0.02}, {-5e-3, 5, 5}};

/// Slots of the triangles of an instance's mesh, which are behind those of the scene, as primitives are
/// behind those of its triangles and shapes.
struct MeshSlots {
    u32 first, end;
};
MeshSlots meshSlots(const CrtContext& ctx, const CrtInstance& instance) {
    const auto* instances = CRT_ARRAY(CrtInstance, ctx.blob, ctx.scene->instances);
    u32 end = ctx.scene->primitives.count;
    for (u32 i = 0; i < ctx.scene->instances.count; ++i)
        if (instances[i].first_primitive > instance.first_primitive)
            end = std::min(end, instances[i].first_primitive);
    const u32 shift = ctx.scene->instances.count;
    return {instance.first_primitive + shift, end + shift};
}

/// Every triangle of the scene in turn, whatever the trees.
CrtHit everyInstanceInTurn(const CrtContext& ctx, CrtRay ray) {
    const auto* triangles = CRT_ARRAY(CrtTriangle, ctx.blob, ctx.scene->triangles);
    const auto* instances = CRT_ARRAY(CrtInstance, ctx.blob, ctx.scene->instances);
    const CrtShear shear = crt_shear(ray);
    CrtHit best = crt_no_hit(ray.reach);
    for (u32 slot = 0; slot < ctx.scene->triangle_count; ++slot)
        if (triangles[slot].shape < CRT_SLOT_INSTANCE)
            crt_test_slot(&ctx, triangles, slot, ray, shear, &best);
    for (u32 i = 0; i < ctx.scene->instances.count; ++i) {
        const MeshSlots slots = meshSlots(ctx, instances[i]);
        for (u32 slot = slots.first; slot < slots.end; ++slot)
            crt_test_placed(instances + i, i, triangles, slot, shear, &best);
    }
    return best;
}

bool anyOneByOne(const CrtContext& ctx, CrtRay ray) {
    const auto* triangles = CRT_ARRAY(CrtTriangle, ctx.blob, ctx.scene->triangles);
    const auto* instances = CRT_ARRAY(CrtInstance, ctx.blob, ctx.scene->instances);
    const CrtShear shear = crt_shear(ray);
    CrtHit hit;
    for (u32 slot = 0; slot < ctx.scene->triangle_count; ++slot)
        if (triangles[slot].shape < CRT_SLOT_INSTANCE &&
            crt_slot_stops(&ctx, triangles, slot, ray, shear, nullptr))
            return true;
    for (u32 i = 0; i < ctx.scene->instances.count; ++i) {
        const MeshSlots slots = meshSlots(ctx, instances[i]);
        for (u32 slot = slots.first; slot < slots.end; ++slot)
            if (crt_intersect_placed(instances + i, triangles + slot, shear, ray.reach, &hit)) return true;
    }
    return false;
}

bool sameBits(const CrtHit& a, const CrtHit& b) {
    return a.id == b.id && a.slot == b.slot && a.instance == b.instance && crt_bits(a.t) == crt_bits(b.t) &&
           crt_bits(a.b1) == crt_bits(b.b1) && crt_bits(a.b2) == crt_bits(b.b2);
}

/// A ray at a vertex, an edge or a face of some instance: from within the scene, from far away, along an
/// axis, or along the plane of the triangle.
CrtRay rayAtInstance(const CrtContext& ctx, Random& random) {
    const auto* triangles = CRT_ARRAY(CrtTriangle, ctx.blob, ctx.scene->triangles);
    const u32 index = random.below(ctx.scene->instances.count);
    const MeshSlots slots = meshSlots(ctx, CRT_ARRAY(CrtInstance, ctx.blob, ctx.scene->instances)[index]);
    const CrtTriangle& target = triangles[slots.first + random.below(slots.end - slots.first)];
    std::array<Vec3d, 3> p;
    for (u32 k = 0; k < 3; ++k) p[k] = toDouble(crt_corner(&ctx, &target, index + 1, k));
    const double b1 = random.below(3) == 0 ? 0 : random.uniform(),
                 b2 = random.below(3) == 0 ? 0 : random.uniform(0, 1 - b1);
    const Vec3d aim = plus(times(p[0], 1 - b1 - b2), plus(times(p[1], b1), times(p[2], b2)));
    Vec3d o = randomPoint(random, 1);
    switch (random.below(5)) {
        case 0: o = times(random.direction(), 1e4); break;
        case 1: o = plus(p[1], times(minus(p[2], p[0]), random.uniform(-2, 2))); break;
        case 2: {
            Vec3d d{random.bits() & 1 ? 0.0 : -0.0, random.bits() & 1 ? 0.0 : -0.0,
                    random.bits() & 1 ? 0.0 : -0.0};
            const u32 axis = random.below(3);
            d[axis] = random.bits() & 1 ? 1 : -1;
            return rayOf(toFloat(minus(aim, times(d, random.uniform(0, 2)))), toFloat(d));
        }
        default: break;
    }
    const vec3 from = toFloat(o);
    const Vec3d d = minus(aim, toDouble(from));
    if (!(length(d) > 0)) return rayOf(from, make_vec3(0, 0, 1));
    return rayOf(from, random.below(2) ? unitFloat(d) : toFloat(d));
}

}  // namespace

TEST_CASE("trees of instances find what a loop over their triangles finds, bit by bit", "[instances]") {
    Random random(3701);
    std::uint64_t hits = 0, rays = 0, wrong = 0, wrong_any = 0;
    for (const auto* scales : {&kGentle, &kHarsh})
        for (const double spread : {1.0, 300.0}) {
            const CompiledScene compiled =
                crt::compileScene(crowd(random, *scales, Sharing::Always, spread), 0);
            const CrtContext ctx = contextOf(compiled);
            REQUIRE(ctx.scene->instances.count == 2 * scales->size());
            for (int i = 0; i < 40000; ++i) {
                CrtRay ray = rayAtInstance(ctx, random);
                const CrtHit expected = everyInstanceInTurn(ctx, ray);
                wrong += !sameBits(crt_bvh_closest(&ctx, ray), expected);
                // To half the way, to the hit and just beyond.
                ray.reach = expected.t * std::array<f32, 3>{0.5f, 1.0f, 1.0001f}[random.below(3)];
                wrong_any += (crt_bvh_any(&ctx, ray, nullptr) != 0) != anyOneByOne(ctx, ray);
                hits += expected.instance != 0;
                ++rays;
            }
        }
    CHECK(wrong == 0);
    CHECK(wrong_any == 0);
    CHECK(hits > rays / 3);
}

TEST_CASE("a shadow ray keeps the nearest pane of instances, triangles and shapes, bit by bit",
          "[instances]") {
    Random random(3702);
    std::uint64_t of_instances = 0, of_others = 0, none = 0, wrong = 0;
    Scene scene = crowd(random, kGentle, Sharing::Always);
    scene.materials[0] = {};
    scene.materials[0].type = crt::MaterialType::ThinDielectric;
    scene.materials[0].eta = crt::constantSpectrum(1.5);
    const CompiledScene compiled = crt::compileScene(scene, 0);
    const CrtContext ctx = contextOf(compiled);
    REQUIRE((ctx.scene->features & CRT_FEATURE_THIN_DIELECTRIC) != 0);
    for (int i = 0; i < 40000; ++i) {
        CrtRay ray = rayAtInstance(ctx, random);
        if (random.below(4) == 0) ray.reach = static_cast<f32>(random.uniform());
        CrtPassable met = crt_none_passable(ray.reach);
        // All are panes, so that nothing stops it.
        REQUIRE(crt_bvh_any(&ctx, ray, &met) == 0);
        const CrtHit nearest = crt_bvh_closest(&ctx, ray);
        const CrtHit kept = crt_hit_of_slot(&ctx, ray, met.slot, met.instance);
        wrong += !sameBits(kept, nearest) || (met.count == 0) != (nearest.slot == CRT_NONE);
        if (nearest.slot == CRT_NONE)
            ++none;
        else
            ++(nearest.instance != 0 ? of_instances : of_others);
    }
    CHECK(wrong == 0);
    CHECK(of_instances > 10000);
    CHECK(of_others > 300);
    CHECK(none > 1000);
}

namespace {

/// A place of a compiled scene, in the author's units.
Vec3d authors(const CompiledScene& compiled, vec3 p) {
    return plus(times(toDouble(p), std::ldexp(1.0, -compiled.scale_exponent)), compiled.centre);
}

std::vector<u32> slotsById(const CrtContext& ctx) {
    const auto* triangles = CRT_ARRAY(CrtTriangle, ctx.blob, ctx.scene->triangles);
    std::vector<u32> slots(ctx.scene->triangle_count);
    for (u32 slot = 0; slot < slots.size(); ++slot) slots[triangles[slot].id] = slot;
    return slots;
}

double angle(vec3 a, vec3 b) {
    return std::atan2(length(cross(toDouble(a), toDouble(b))), dot(toDouble(a), toDouble(b)));
}

}  // namespace

TEST_CASE("surfaces of instances are those of the flattened scene but for rounding", "[instances]") {
    for (const std::uint64_t seed : {3702, 3703}) {
        const auto& scales = seed == 3702 ? kGentle : kHarsh;
        Random for_instanced(seed), for_flat(seed), random(seed + 10);
        const CompiledScene instanced = crt::compileScene(crowd(for_instanced, scales, Sharing::Always), 0);
        const CompiledScene flat = crt::compileScene(crowd(for_flat, scales, Sharing::Never), 0);
        const CrtContext ctx = contextOf(instanced), flat_ctx = contextOf(flat);
        REQUIRE(ctx.scene->instances.count == 2 * scales.size());
        REQUIRE(flat_ctx.scene->instances.count == 0);
        const std::vector<u32> flat_slots = slotsById(flat_ctx);
        const auto* instances = CRT_ARRAY(CrtInstance, ctx.blob, ctx.scene->instances);
        // Numbers between the triangles that stand for themselves and those of instances.
        const u32 between = 1 + ctx.scene->instances.count;
        // γ(8) of a scene within ±1, and of the mesh that is placed in it, in the author's units.
        const double rounding = 8 * 0x1p-24 * 3 * std::ldexp(1.0, -instanced.scale_exponent);
        double farthest = 0, widest = 0, widest_shading = 0;
        std::uint64_t compared = 0, uvs_apart = 0;
        for (int i = 0; i < 60000; ++i) {
            CrtHit hit = crt_bvh_closest(&ctx, rayAtInstance(ctx, random));
            if (hit.instance == 0) continue;
            // Off the edges, from which a place is drawn in by a margin that is rounded, too.
            hit.b1 = static_cast<f32>(random.uniform(0.2, 0.4));
            hit.b2 = static_cast<f32>(random.uniform(0.2, 0.4));
            CrtHit same = hit;
            same.instance = 0;
            same.id = hit.id - between;
            same.slot = flat_slots[same.id];
            if (instances[hit.instance - 1].facing < 0) std::swap(same.b1, same.b2);
            const CrtSurface a = crt_surface(&ctx, hit), b = crt_surface(&flat_ctx, same);
            ++compared;
            const Vec3d apart = minus(authors(instanced, a.p), authors(flat, b.p));
            for (const double x : apart) farthest = std::max(farthest, std::abs(x));
            uvs_apart += std::abs(a.at.u - b.at.u) > 1e-5f || std::abs(a.at.v - b.at.v) > 1e-5f;
            CHECK(a.material == b.material);
            // A sliver's plane is known less well than its corners.
            const auto& t = CRT_ARRAY(CrtTriangle, flat_ctx.blob, flat_ctx.scene->triangles)[same.slot];
            const Vec3d o = toDouble(crt_triangle_vertex(&t, 0)),
                        e1 = minus(toDouble(crt_triangle_vertex(&t, 1)), o),
                        e2 = minus(toDouble(crt_triangle_vertex(&t, 2)), o);
            const double height = length(cross(e1, e2)) / std::max(length(e1), length(e2));
            if (height < 1e-2) continue;
            widest = std::max(widest, angle(a.ng, b.ng));
            // A normal is turned to the side of its face, which may be either where it lies along the face.
            if (seed == 3702 && std::abs(dot3(a.ns, a.ng)) > 1e-3f)
                widest_shading = std::max(widest_shading, angle(a.ns, b.ns));
        }
        CHECK(compared > 20000);
        CHECK(farthest <= rounding);
        CHECK(farthest > 0);
        CHECK(uvs_apart == 0);
        CHECK(widest < 8 * 0x1p-24 * 3 / 1e-2);
        CHECK(widest_shading < 1e-4);
    }
}

namespace {

constexpr Vec3d kMiddle{0.3, -0.2, 0.1};

struct Walk {
    std::uint64_t steps = 0, escapes = 0, self_hits = 0;
};

/// From wall to wall inside an instance of a closed mesh, nearly along the wall every third time.
Walk walkIn(const CompiledScene& compiled, std::uint64_t steps, Random& random) {
    const CrtContext ctx = contextOf(compiled);
    const vec3 middle =
        toFloat(times(minus(kMiddle, compiled.centre), std::ldexp(1.0, compiled.scale_exponent)));
    Walk walk;
    CrtHit hit = crt_no_hit(CRT_INFINITY);
    vec3 wo = make_vec3(0, 0, 0);
    for (; walk.steps < steps; ++walk.steps) {
        CrtRay ray = rayOf(middle, toFloat(random.direction()));
        const u32 left = hit.id;
        if (hit.slot != CRT_NONE) {
            const CrtSurface surface = crt_surface(&ctx, hit);
            const vec3 n = dot3(wo, surface.ng) > 0 ? surface.ng : -surface.ng;
            const Vec3d along = unit(cross(toDouble(n), random.direction()));
            const double lift =
                random.below(3) == 0 ? std::pow(10.0, random.uniform(-6, -1)) : random.uniform(0, 3);
            ray.d = unitFloat(plus(along, times(toDouble(n), lift)));
            ray.o = crt_offset_origin(surface.p, surface.clearance, surface.ng, ray.d);
        }
        hit = crt_bvh_closest(&ctx, ray);
        walk.self_hits += hit.slot != CRT_NONE && hit.id == left;
        walk.escapes += hit.slot == CRT_NONE || hit.instance != 1;
        if (hit.instance != 1) hit = crt_no_hit(CRT_INFINITY);
        wo = -ray.d;
    }
    return walk;
}

}  // namespace

TEST_CASE("no path leaves an instance that is closed, and none meets the wall that it leaves",
          "[instances]") {
    Random random(3704);
    const Mesh ball = icosphere(2, 1, {0, 0, 0}), box = crt::verify::boxMesh({-1, -1, -1}, {1, 1, 1}, true);
    struct Room {
        const Mesh& mesh;
        Vec3d scale;
        double far;
    };
    for (const auto& [mesh, scale, far] : {Room{ball, {1, 1, 1}, 0},
                                           {ball, {1, 1, 1}, 1e4},
                                           {ball, {-1, 1, 1}, 100},
                                           {ball, {3e7, 2e7, 1e7}, 0},
                                           {box, {1, 1, 1}, 1e5},
                                           {box, {100, 1, 1}, 0},
                                           {box, {100, 1, 1}, 1e3},
                                           {box, {-30, 20, 0.1}, 0},
                                           {box, {-30, 20, 0.1}, 100}}) {
        Scene scene = sceneOf(mesh);
        scene.objects[0].sharing = Sharing::Always;
        scene.objects[0].transforms = {placedAt(kMiddle, scale, random)};
        if (far > 0) {
            const double d = far * std::abs(scale[0]);
            scene.meshes.emplace_back();
            crt::verify::addTriangle(scene.meshes.back(), {d, 0.3 * d, -0.6 * d},
                                     {1.1 * d, 0.3 * d, -0.6 * d}, {d, 0.4 * d, -0.6 * d});
            scene.objects.emplace_back();
            scene.objects.back().mesh = 1;
        }
        const Walk walk = walkIn(crt::compileScene(scene, 0), 40000, random);
        INFO("scale " << scale[0] << " " << scale[1] << " " << scale[2] << ", triangle at " << far);
        CHECK(walk.escapes == 0);
        CHECK(walk.self_hits == 0);
    }
}

namespace {

/// An object with this number of triangles, in this number of places.
Scene placed(std::size_t triangles, std::size_t places, Sharing sharing) {
    Scene scene = sceneOf(Mesh{});
    scene.meshes[0].positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    scene.meshes[0].triangles.assign(triangles, {0, 1, 2});
    Object& object = scene.objects[0];
    object.sharing = sharing;
    object.transforms.assign(places, crt::kIdentity4d);
    for (std::size_t i = 0; i < places; ++i) object.transforms[i][3] = 2.0 * static_cast<double>(i);
    return scene;
}
bool shared(const Scene& scene) { return crt::sharesMesh(scene, scene.objects[0]); }

}  // namespace

TEST_CASE("a mesh is shared where it is asked for, and where the copies would be too many", "[instances]") {
    CHECK(shared(placed(1, 1, Sharing::Always)));
    CHECK_FALSE(shared(placed(1, 1000, Sharing::Auto)));
    CHECK_FALSE(shared(placed(1 << 21, 2, Sharing::Auto)));
    CHECK(shared(placed((1 << 21) + 1, 2, Sharing::Auto)));
    CHECK_FALSE(shared(placed((1 << 22) + 1, 1, Sharing::Auto)));
    CHECK_FALSE(shared(placed((1 << 21) + 1, 2, Sharing::Never)));
    CHECK_FALSE(shared(placed(0, 2, Sharing::Always)));

    Scene scene = placed(2, 3, Sharing::Always);
    scene.integrator.accelerator = crt::Accelerator::None;
    CHECK_FALSE(shared(scene));
    scene.integrator.accelerator = crt::Accelerator::Auto;
    scene.integrator.type = crt::IntegratorType::Aabb;
    CHECK_FALSE(shared(scene));
}

TEST_CASE("what emits is written out, and says so", "[instances]") {
    Scene scene = placed(2, 3, Sharing::Always);
    scene.emissions.push_back({crt::constantSpectrum(1), false});
    scene.objects[0].emission = 0;
    const crt::test::CapturedLog log;
    const CompiledScene compiled = crt::compileScene(scene, 0);
    CHECK(headerOf(compiled).instances.count == 0);
    CHECK(headerOf(compiled).triangle_count == 6);
    CHECK(compiled.emitters == 6);
    CHECK(log.text().find("emit") != std::string::npos);
}

TEST_CASE("places that flatten a mesh are written out, the others are not", "[instances]") {
    Scene scene = placed(2, 5, Sharing::Always);
    auto& transforms = scene.objects[0].transforms;
    transforms[1] = {1, 0, 0, 2, 0, 1, 0, 0, 0, 0, 0, 0};     // into a plane
    transforms[2] = {1, 0, 0, 4, 2, 0, 0, 0, 0, 0, 1, 0};     // singular, too
    transforms[3] = {1, 0, 0, 6, 0, 1, 0, 0, 0, 0, 1e-7, 0};  // nearly
    const CompiledScene compiled = crt::compileScene(scene, 0);
    const CrtContext ctx = contextOf(compiled);
    CHECK(ctx.scene->instances.count == 2);
    CHECK(ctx.scene->triangle_count == 3 * 2 + 2);
    for (const double x : {0.1, 2.1, 6.1, 8.1}) {
        const Vec3d o =
            times(minus({x, 0.1, -1}, compiled.centre), std::ldexp(1.0, compiled.scale_exponent));
        INFO("x = " << x);
        CHECK(crt_bvh_closest(&ctx, rayOf(toFloat(o), make_vec3(0, 0, 1))).slot != CRT_NONE);
    }
    scene.objects[0].transforms[4][3] = std::numeric_limits<double>::infinity();
    CHECK_THROWS_WITH(crt::compileScene(scene, 0), Contains("beyond the range of single precision"));
}

TEST_CASE("an instance costs little more than its record", "[instances]") {
    Random random(3705);
    Scene scene = sceneOf(texturedSoup(random, 20000));
    scene.objects[0].sharing = Sharing::Never;
    const std::size_t once = crt::compileScene(scene, 0).size_bytes;
    scene.objects[0].sharing = Sharing::Always;
    scene.objects[0].transforms.clear();
    for (int i = 0; i < 1000; ++i)
        scene.objects[0].transforms.push_back(placedAt(randomPoint(random, 50), {1, 1, 1}, random));
    const std::size_t many = crt::compileScene(scene, 0).size_bytes;
    CHECK(static_cast<double>(many) <= 1.1 * static_cast<double>(once) + 128.0 * 1000);
}

TEST_CASE("instances are part of a scene's identity, whoever builds the tree", "[instances]") {
    Random random(3706);
    Scene scene = crowd(random, kGentle, Sharing::Always);
    crt::CompileOptions own;
    own.accelerator_reach = 1e30;
    const std::string identity = crt::compileScene(scene, 0).hash;
    CHECK(crt::compileScene(scene, 0, own).hash == identity);
    scene.objects[1].transforms[0][3] += 1e-3;
    CHECK(crt::compileScene(scene, 0).hash != identity);
    scene.objects[1].transforms[0][3] -= 1e-3;
    CHECK(crt::compileScene(scene, 0).hash == identity);
    scene.meshes[1].positions[0][0] += 1e-3;
    CHECK(crt::compileScene(scene, 0).hash != identity);
}

TEST_CASE("instances are passed over where near surfaces are looked for", "[instances]") {
    Scene scene = placed(1, 3, Sharing::Always);
    Mesh floor;
    crt::verify::addTriangle(floor, {-1, -1, 2e-5}, {9, -1, 2e-5}, {-1, 9, 2e-5});
    scene.meshes.push_back(floor);
    scene.objects.emplace_back();
    scene.objects.back().mesh = 1;
    CHECK(crt::findNearSurfaces(crt::compileScene(scene, 0)).near == 0);
    scene.objects[0].sharing = Sharing::Never;
    CHECK(crt::findNearSurfaces(crt::compileScene(scene, 0)).near > 0);
}

TEST_CASE("a scene of instances alone compiles, whoever finds its hits", "[instances]") {
    const Scene scene = placed(2, 3, Sharing::Always);
    for (const double reach : {0.0, 1e30}) {
        crt::CompileOptions options;
        options.accelerator_reach = reach;
        const CompiledScene compiled = crt::compileScene(scene, 0, options);
        CHECK(headerOf(compiled).instances.count == 3);
        CHECK((headerOf(compiled).nodes.count == 0) == (reach > 0));
    }
}

TEST_CASE("who shares, in the scene", "[scene_yaml][instances]") {
    const auto sharing = [](const std::string& share) {
        return parse(kGrey + "objects:\n  - {mesh: " + kTriangle + ", material: grey" + share + "}\n")
            .objects[0]
            .sharing;
    };
    CHECK(sharing("") == Sharing::Auto);
    CHECK(sharing(", share: always") == Sharing::Always);
    CHECK(sharing(", share: never") == Sharing::Never);
    CHECK_THAT(refused(kGrey + "objects:\n  - {mesh: " + kTriangle + ", material: grey, share: allways}\n"),
               Contains("always"));
}
