// Rays against triangles, alone, eight at a time, through boxes and trees: nothing leaks through an edge,
// and nothing is culled that would be hit. A separate executable, compiled for AVX2 like the kernels of the
// Embree backend.
//
// Over 450 lines: a separate executable, since it is compiled for another processor.
#include "kernel_test.h"

#include "compile/bvh_build.h"
#include "scene/mesh/mesh_io.h"

#include <algorithm>
#include <array>
#include <cfloat>
#include <numeric>
#include <string>

using namespace kernel_test;
using crt::Accelerator;
using crt::Mesh;
using crt::Vec3d;
using crt::verify::addTriangle;
using crt::verify::icosphere;

namespace {

/// Embree's own far place for such tests: nothing is round there.
constexpr Vec3d kFarPlace{148376, 1234, -223423};

bool sameBits(const CrtHit& a, const CrtHit& b) {
    return a.id == b.id && crt_bits(a.t) == crt_bits(b.t) && crt_bits(a.b1) == crt_bits(b.b1) &&
           crt_bits(a.b2) == crt_bits(b.b2);
}

/// A scene compiled for each of the accelerators.
struct ThreeWays {
    crt::CompiledScene brute, bvh, boxes;
    explicit ThreeWays(const Mesh& mesh)
        : brute(compiled(mesh, Accelerator::None)),
          bvh(compiled(mesh, Accelerator::Bvh)),
          boxes(compiled(mesh, Accelerator::Aabb)) {}
    static crt::CompiledScene compiled(const Mesh& mesh, Accelerator accelerator) {
        return crt::compileScene(sceneOf(mesh, accelerator), 0);
    }
};

/// A point of the triangle: a vertex, a point of an edge, or any, in float.
vec3 aimAt(const CrtTriangle& t, int how, Random& random) {
    const u32 i = random.below(3);
    const Vec3d a = toDouble(vertexOf(t, i)), b = toDouble(vertexOf(t, (i + 1) % 3)),
                c = toDouble(vertexOf(t, (i + 2) % 3));
    if (how == 0) return toFloat(a);
    if (how == 1) return toFloat(plus(a, times(minus(b, a), random.uniform())));
    const double u = std::sqrt(random.uniform()), v = random.uniform();
    return toFloat(plus(times(a, 1 - u), plus(times(b, u * (1 - v)), times(c, u * v))));
}
const char* const kHow[] = {"vertices", "edges", "faces"};

/// Rays of every awkward kind into a scene within ±1. `like_a_path`: only those of which the paths of an
/// integrator have some, of unit length and from nowhere on a triangle.
CrtRay awkwardRay(const CrtContext& ctx, Random& random, bool like_a_path) {
    const auto* triangles = CRT_ARRAY(CrtTriangle, ctx.blob, ctx.scene->triangles);
    const CrtTriangle& target = triangles[random.below(ctx.scene->triangle_count)];
    const vec3 aim = aimAt(target, static_cast<int>(random.below(3)), random);
    Vec3d o{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    switch (random.below(like_a_path ? 6 : 8)) {
        case 0: o = times(random.direction(), 1e4); break;              // from far away
        case 1: o = plus(o, times(random.direction(), 50)); break;
        case 6: o = toDouble(aimAt(target, 2, random)); break;          // along the triangle's own plane
        case 7: o = toDouble(aimAt(triangles[random.below(ctx.scene->triangle_count)], 0, random)); break;
        case 2:  // along an axis, in the plane of the target, with either zero
        case 3: {
            const u32 axis = random.below(3);
            Vec3d d{random.bits() & 1 ? 0.0 : -0.0, random.bits() & 1 ? 0.0 : -0.0,
                    random.bits() & 1 ? 0.0 : -0.0};
            d[axis] = random.bits() & 1 ? 1 : -1;
            o = minus(toDouble(aim), times(d, random.uniform(0, 2)));
            return rayOf(toFloat(o), toFloat(d));
        }
        case 4: {                                                       // in a plane of constant x, y or z
            Vec3d d = minus(toDouble(aim), o);
            const u32 axis = random.below(3);
            d[axis] = random.bits() & 1 ? 0.0 : -0.0;
            o[axis] = toDouble(aim)[axis];
            return rayOf(toFloat(o), unitFloat(d));
        }
        default: break;
    }
    const Vec3d d = minus(toDouble(aim), toDouble(toFloat(o)));
    return rayOf(toFloat(o), like_a_path || random.bits() & 1 ? unitFloat(d) : toFloat(d));
}

/// Rate at which tracing through the tree, the objects' boxes and eight triangles at a time differs from one
/// triangle after another.
std::uint64_t disagreements(const ThreeWays& scene, Random& random, int rays, std::uint64_t* hits) {
    const CrtContext brute = contextOf(scene.brute), bvh = contextOf(scene.bvh),
                     boxes = contextOf(scene.boxes);
    std::uint64_t wrong = 0;
    for (int i = 0; i < rays; ++i) {
        const bool like_a_path = i % 2 == 0;
        CrtRay ray = awkwardRay(brute, random, like_a_path);
        const CrtHit expected = oneByOne(brute, ray);
        *hits += expected.slot != CRT_NONE;
        // Eight triangles at a time take it from surface.h that a ray starts clear of every plane.
        if (like_a_path) wrong += !sameBits(expected, crt_brute_force_closest(&brute, ray));
        wrong += !sameBits(expected, crt_bvh_closest(&bvh, ray));
        wrong += !sameBits(expected, crt_aabb_closest(&boxes, ray));
        // Any hit up to somewhere before or behind the nearest.
        ray.reach = expected.slot == CRT_NONE ? CRT_INFINITY
                                              : expected.t * static_cast<f32>(random.uniform(0.5, 1.5));
        const int any = expected.slot != CRT_NONE && expected.t < ray.reach;
        wrong += crt_bvh_any(&bvh, ray, nullptr) != any;
        wrong += crt_aabb_any(&boxes, ray, nullptr) != any;
    }
    return wrong;
}

/// Shadow rays, from above one triangle to just before another: how often one triangle after another and the
/// four ways disagree. Of consecutive triangles in one plane, none is the target of another: a wall with all
/// of the scene on one side is no occluder, for rays within its plane neither.
std::uint64_t shadowDisagreements(const ThreeWays& scene, Random& random, int rays, std::uint64_t* hits,
                                  u32 in_one_plane = 1) {
    const CrtContext brute = contextOf(scene.brute), bvh = contextOf(scene.bvh),
                     boxes = contextOf(scene.boxes);
    const auto* triangles = CRT_ARRAY(CrtTriangle, brute.blob, brute.scene->triangles);
    std::uint64_t wrong = 0;
    for (int i = 0; i < rays; ++i) {
        CrtHit from = crt_no_hit(CRT_INFINITY);
        from.slot = random.below(brute.scene->triangle_count);
        from.id = triangles[from.slot].id;
        from.b1 = static_cast<f32>(random.uniform(0, 0.5));
        from.b2 = static_cast<f32>(random.uniform(0, 0.5));
        const CrtSurface surface = crt_surface(&brute, from);
        const u32 target = random.below(brute.scene->triangle_count);
        if (target / in_one_plane == from.slot / in_one_plane) continue;
        const vec3 to = aimAt(triangles[target], 2, random);
        const vec3 o = crt_offset_origin(surface.p, surface.clearance, surface.ng, to - surface.p);
        const CrtRay ray = rayOf(o, to - o, 0.999f);
        const CrtHit expected = oneByOne(brute, ray);
        const int any = expected.slot != CRT_NONE && expected.t < ray.reach;
        *hits += static_cast<std::uint64_t>(any);
        wrong += crt_brute_force_any(&brute, ray, nullptr) != any;
        wrong += crt_bvh_any(&bvh, ray, nullptr) != any;
        wrong += crt_aabb_any(&boxes, ray, nullptr) != any;
    }
    return wrong;
}

}  // namespace

TEST_CASE("nothing leaks: rays at vertices, edges and faces from inside closed spheres", "[kernel][rays]") {
    struct Place {
        const char* what;
        Vec3d centre;
        double radius;
        bool company;  // a far triangle keeps the sphere away from the scene's centre, where floats are
                       // coarse
    };
    for (const Place& place :
         {Place{"at the origin", {0, 0, 0}, 1, false}, Place{"far away", kFarPlace, 100, false},
          Place{"far from the scene's centre", kFarPlace, 100, true}}) {
        for (const bool tree : {false, true}) {
            Mesh mesh = icosphere(tree ? 5 : 2, place.radius, place.centre);
            const auto closed = static_cast<u32>(mesh.triangles.size());
            if (place.company)
                addTriangle(mesh, times(place.centre, -1), plus(times(place.centre, -1), {1, 0, 0}),
                            plus(times(place.centre, -1), {0, 1, 0}));
            const crt::CompiledScene compiled =
                crt::compileScene(sceneOf(mesh, tree ? Accelerator::Bvh : Accelerator::None), 0);
            const CrtContext ctx = contextOf(compiled);
            const auto* triangles = arrayOf<CrtTriangle>(compiled, ctx.scene->triangles);
            const double scale = std::ldexp(1.0, compiled.scale_exponent);
            const Vec3d centre = times(minus(place.centre, compiled.centre), scale);
            Random random(tree);
            for (int how = 0; how < 3; ++how) {
                std::uint64_t misses = 0;
                for (int i = 0; i < 350000; ++i) {
                    // Every third from one point, as a camera's.
                    const Vec3d from =
                        plus(centre, times(random.direction(),
                                           i % 3 == 0 ? 0 : 0.5 * place.radius * scale * random.uniform()));
                    u32 slot = 0;
                    do slot = random.below(compiled.triangles ? static_cast<u32>(compiled.triangles) : 1u);
                    while (triangles[slot].id >= closed);
                    const vec3 o = toFloat(from);
                    const Vec3d d = minus(toDouble(aimAt(triangles[slot], how, random)), toDouble(o));
                    const CrtRay ray = rayOf(o, i & 1 ? unitFloat(d) : toFloat(d));
                    const CrtHit hit =
                        tree ? crt_bvh_closest(&ctx, ray) : crt_brute_force_closest(&ctx, ray);
                    misses += hit.slot == CRT_NONE || hit.id >= closed;
                }
                INFO(place.what << ", " << (tree ? "BVH" : "brute force") << ", rays at " << kHow[how]);
                CHECK(misses == 0);
            }
        }
    }
}

TEST_CASE("tree, boxes and lanes find what the plain loop finds, bit by bit", "[kernel][rays]") {
    std::uint64_t hits = 0, blocked = 0;
    Random random(21);
    for (const std::uint32_t count : {1u, 2u, 3u, 5u, 9u, 60u, 700u}) {
        INFO(count << " triangles");
        const ThreeWays scene(soup(random, count));
        CHECK(disagreements(scene, random, count > 100 ? 44000 : 22000, &hits) == 0);
        CHECK(shadowDisagreements(scene, random, 20000, &blocked) == 0);
    }
    // Eight triangles exactly, one block, many times over.
    for (int i = 0; i < 300; ++i) {
        const ThreeWays scene(soup(random, 8));
        CHECK(disagreements(scene, random, 500, &hits) == 0);
        CHECK(shadowDisagreements(scene, random, 500, &blocked) == 0);
    }
    CHECK(hits > 150000);
    CHECK(blocked > 2000);
    const ThreeWays sphere(icosphere(3, 1, {0, 0, 0}));
    CHECK(disagreements(sphere, random, 10000, &hits) == 0);
    CHECK(shadowDisagreements(sphere, random, 10000, &blocked) == 0);
}

/// Parallelograms and other quadrangles, each of two triangles: anywhere, in planes of constant x, y or z,
/// and where it is asked for in one plane with the one before, beside it or over it.
Mesh quadrangles(Random& random, std::uint32_t count, bool in_one_plane = true) {
    Mesh mesh;
    Vec3d p{}, a{}, b{};
    for (std::uint32_t i = 0; i < count; ++i) {
        if (i % 4 != 3 || !in_one_plane) {
            p = {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
            a = times(random.direction(), std::pow(10.0, random.uniform(-2, 0)));
            b = times(random.direction(), std::pow(10.0, random.uniform(-2, 0)));
            if (i % 4 == 1) p[i % 3] = a[i % 3] = b[i % 3] = 0;
        } else {
            p = plus(p, random.bits() & 1 ? a : times(a, 0.5));
        }
        // The corner across: of a parallelogram; or near it, in the plane.
        const double u = i % 2 ? 1 : random.uniform(0.9, 1.1), v = i % 2 ? 1 : random.uniform(0.9, 1.1);
        const Vec3d across = plus(p, plus(times(a, u), times(b, v)));
        addTriangle(mesh, p, plus(p, a), across);
        addTriangle(mesh, p, across, plus(p, b));
    }
    return mesh;
}

TEST_CASE("patches of two triangles find what the plain loop finds, bit by bit", "[kernel][rays]") {
    Random random(29);
    std::uint64_t hits = 0, blocked = 0, patches = 0, pairs = 0;
    for (int i = 0; i < 60; ++i) {
        const ThreeWays scene(quadrangles(random, 1 + random.below(24)));
        const CrtContext ctx = contextOf(scene.brute);
        const auto* all = CRT_ARRAY(CrtPatch, ctx.blob, ctx.scene->patches);
        std::vector<int> met(ctx.scene->triangle_count);
        for (u32 k = 0; k < ctx.scene->patches.count; ++k) {
            ++patches;
            pairs += all[k].slot[1] != CRT_NONE;
            for (const u32 slot : all[k].slot)
                if (slot != CRT_NONE) ++met.at(slot);
        }
        CHECK(std::all_of(met.begin(), met.end(), [](int n) { return n == 1; }));
        CHECK(disagreements(scene, random, 10000, &hits) == 0);
        const ThreeWays apart(quadrangles(random, 1 + random.below(24), false));
        CHECK(shadowDisagreements(apart, random, 10000, &blocked, 2) == 0);
        // The patches themselves, also where eight triangles are taken at a time.
        const auto* triangles = CRT_ARRAY(CrtTriangle, ctx.blob, ctx.scene->triangles);
        std::uint64_t wrong = 0, undecided = 0;
        for (int ray = 0; ray < 5000; ++ray) {
            CrtRay r = awkwardRay(ctx, random, true);
            const CrtHit expected = oneByOne(ctx, r);
            CrtHit hit;
            if (crt_patches_closest(all, ctx.scene->patches.count, triangles, r, &hit))
                wrong += !sameBits(expected, hit);
            else
                ++undecided;
            if (expected.slot == CRT_NONE) continue;
            r.reach = expected.t * static_cast<f32>(random.uniform(0.5, 1.5));
            const u32 any = crt_patches_any(all, ctx.scene->patches.count, triangles, r);
            wrong += any < 2 && any != (expected.t < r.reach ? 1u : 0u);
        }
        CHECK(wrong == 0);
        CHECK(undecided < 5000);
    }
    CHECK(hits > 100000);
    CHECK(blocked > 1000);
    CHECK(pairs * 10 > patches * 9);
}

namespace {

/// Towards a triangle, from a place in its plane, beside it or on it, and off the plane by what lies on both
/// sides of the rounding of heights. False where the triangle has no plane.
bool rayNearPlane(const CrtTriangle& target, Random& random, CrtRay* ray) {
    const Vec3d a = toDouble(vertexOf(target, 0)), b = toDouble(vertexOf(target, 1)),
                c = toDouble(vertexOf(target, 2));
    const Vec3d normal = cross(minus(b, a), minus(c, a));
    if (!(length(normal) > 0)) return false;
    const double u = random.uniform(-2, 3), v = random.uniform(-2, 3);
    const double height = std::pow(10.0, random.uniform(-7.5, -5.7)) * (random.bits() & 1 ? 1 : -1);
    const Vec3d in_plane = plus(a, plus(times(minus(b, a), u), times(minus(c, a), v)));
    const vec3 o = toFloat(plus(in_plane, times(unit(normal), height)));
    *ray = rayOf(o, unitFloat(minus(toDouble(aimAt(target, 2, random)), toDouble(o))));
    return true;
}

}  // namespace

TEST_CASE("patches refuse no hit of a ray that starts within rounding of a triangle's plane",
          "[kernel][rays]") {
    Random random(30);
    std::uint64_t accepted = 0, refused = 0, farther = 0;
    for (int scene = 0; scene < 40; ++scene) {
        const crt::CompiledScene compiled =
            ThreeWays::compiled(scene % 2 ? soup(random, 64) : quadrangles(random, 32), Accelerator::None);
        const CrtContext ctx = contextOf(compiled);
        const auto* triangles = CRT_ARRAY(CrtTriangle, ctx.blob, ctx.scene->triangles);
        const auto* patches = CRT_ARRAY(CrtPatch, ctx.blob, ctx.scene->patches);
        for (int i = 0; i < 20000; ++i) {
            CrtRay ray;
            if (!rayNearPlane(triangles[random.below(ctx.scene->triangle_count)], random, &ray)) continue;
            const CrtShear shear = crt_shear(ray);
            const CrtPatchSlack slack = crt_patch_slack(ray);
            for (u32 k = 0; k < ctx.scene->patches.count; ++k) {
                f32 least;
                const int met = crt_patch_meeting(patches + k, ray, slack, CRT_INFINITY, &least);
                for (const u32 slot : patches[k].slot) {
                    CrtHit hit;
                    if (slot == CRT_NONE ||
                        !crt_intersect_triangle(triangles + slot, shear, CRT_INFINITY, &hit))
                        continue;
                    ++accepted;
                    refused += !met;
                    farther += met && least > hit.t;
                }
            }
        }
    }
    CHECK(accepted > 400000);
    CHECK(refused == 0);
    CHECK(farther == 0);
}

#if CRT_SIMD8
TEST_CASE("lanes without a triangle are no candidates, from wherever a ray comes", "[kernel][rays]") {
    Random random(28);
    // Five triangles: three lanes of the only block are unused.
    const crt::CompiledScene compiled = ThreeWays::compiled(soup(random, 5), Accelerator::None);
    const CrtContext ctx = contextOf(compiled);
    REQUIRE(ctx.scene->triangles8.count == 1);
    const auto* block = CRT_ARRAY(CrtTriangle8, ctx.blob, ctx.scene->triangles8);
    u32 unused = 0;
    for (u32 lane = 0; lane < 8; ++lane) unused |= block->slot[lane] == CRT_NONE ? 1u << lane : 0u;
    REQUIRE(unused == 0xe0u);
    for (const double distance : {0.0, 1.0, 1e3, 3e5, 1e8, 1e20})
        for (int i = 0; i < 1000; ++i) {
            const vec3 o = toFloat(times(random.direction(), distance));
            const CrtRay ray = rayOf(o, toFloat(times(random.direction(), random.uniform(0.1, 3))));
            REQUIRE((crt_candidates8(block, ray, crt_candidate_slack(o), CRT_INFINITY) & unused) == 0);
        }
}

TEST_CASE(
    "eight triangles at a time refuse no hit of a ray that starts within rounding of a triangle's plane",
    "[kernel][rays]") {
    Random random(27);
    std::uint64_t accepted = 0, refused = 0;
    for (int scene = 0; scene < 40; ++scene) {
        const crt::CompiledScene compiled = ThreeWays::compiled(soup(random, 64), Accelerator::None);
        const CrtContext ctx = contextOf(compiled);
        const auto* triangles = CRT_ARRAY(CrtTriangle, ctx.blob, ctx.scene->triangles);
        const auto* blocks = CRT_ARRAY(CrtTriangle8, ctx.blob, ctx.scene->triangles8);
        for (int i = 0; i < 50000; ++i) {
            CrtRay ray;
            if (!rayNearPlane(triangles[random.below(ctx.scene->triangle_count)], random, &ray)) continue;
            const CrtShear shear = crt_shear(ray);
            const f32 slack = crt_candidate_slack(ray.o);
            for (u32 block = 0; block < ctx.scene->triangles8.count; ++block) {
                const u32 lanes = crt_candidates8(blocks + block, ray, slack, CRT_INFINITY);
                for (u32 lane = 0; lane < 8; ++lane) {
                    CrtHit hit;
                    const u32 slot = blocks[block].slot[lane];
                    if (slot == CRT_NONE ||
                        !crt_intersect_triangle(triangles + slot, shear, CRT_INFINITY, &hit))
                        continue;
                    ++accepted;
                    refused += (lanes >> lane & 1) == 0;
                }
            }
        }
    }
    CHECK(accepted > 1000000);
    CHECK(refused == 0);
}
#endif

TEST_CASE("and on the meshes that crt makes", "[kernel][rays]") {
    Random random(22);
    std::uint64_t hits = 0;
    for (const char* name : {"sphere", "prism", "figure", "dragon"}) {
        const crt::LoadedMesh file =
            crt::loadObj(std::string(CRT_BUILD_DIR) + "/share/crt/meshes/" + name + ".obj");
        const int rays =
            static_cast<int>(std::min<std::size_t>(10000, 20000000 / file.mesh.triangles.size()));
        INFO(name);
        CHECK(disagreements(ThreeWays(file.mesh), random, rays, &hits) == 0);
    }
    CHECK(hits > 5000);
}

TEST_CASE("a box that is touched is entered: exact fractions decide", "[kernel][rays]") {
    Random random(23);
    std::uint64_t culled = 0, touched_count = 0, node_differs = 0, entered_untouched = 0,
                  untouched_count = 0;
    const auto zero = [&] { return random.bits() & 1 ? 0.0f : -0.0f; };
    for (int i = 0; i < 2000000; ++i) {
        // Eighths between −1 and 1 and small whole directions: numbers whose fractions compare exactly.
        int lower[3], upper[3], o[3], d[3];
        f32 box_lower[3], box_upper[3], ray_d[3];
        for (int k = 0; k < 3; ++k) {
            lower[k] = static_cast<int>(random.below(17)) - 8;
            upper[k] = random.below(3) == 0
                           ? lower[k]
                           : lower[k] + static_cast<int>(random.below(static_cast<u32>(9 - lower[k])));
            o[k] = random.below(3) == 0 ? (random.bits() & 1 ? lower[k] : upper[k])
                                        : static_cast<int>(random.below(33)) - 16;
            d[k] = random.below(2) ? 0 : static_cast<int>(random.below(7)) - 3;
            box_lower[k] = static_cast<f32>(lower[k]) / 8;
            box_upper[k] = static_cast<f32>(upper[k]) / 8;
            ray_d[k] = d[k] == 0 ? zero() : static_cast<f32>(d[k]);
        }
        if (d[0] == 0 && d[1] == 0 && d[2] == 0) continue;
        // t from enter_n/enter_d to leave_n/leave_d, denominators > 0.
        long enter_n = 0, enter_d = 1, leave_n = 1, leave_d = 0;
        bool touched = true;
        for (int k = 0; k < 3; ++k) {
            if (d[k] == 0) {
                touched &= lower[k] <= o[k] && o[k] <= upper[k];
                continue;
            }
            const long sign = d[k] > 0 ? 1 : -1, denominator = sign * d[k];
            const long near = sign * ((d[k] > 0 ? lower[k] : upper[k]) - o[k]),
                       far = sign * ((d[k] > 0 ? upper[k] : lower[k]) - o[k]);
            if (near * enter_d > enter_n * denominator) enter_n = near, enter_d = denominator;
            if (far * leave_d < leave_n * denominator) leave_n = far, leave_d = denominator;
        }
        touched &= enter_n * leave_d <= leave_n * enter_d;
        const CrtRay ray = rayOf(
            make_vec3(static_cast<f32>(o[0]) / 8, static_cast<f32>(o[1]) / 8, static_cast<f32>(o[2]) / 8),
            make_vec3(ray_d[0], ray_d[1], ray_d[2]));
        const CrtSlab slab = crt_slab(ray);
        const f32 t = crt_box(box_lower, box_upper, ray, slab, CRT_INFINITY);
        CrtNode4 node{};
        for (u32 k = 0; k < 3; ++k)
            for (u32 c = 0; c < 4; ++c) {
                node.bounds[2 * k][c] = c == 2 ? box_lower[k] : CRT_INFINITY;
                node.bounds[2 * k + 1][c] = c == 2 ? box_upper[k] : -CRT_INFINITY;
            }
        const vec4 four = crt_node_distances(&node, crt_node_ray(ray, 0.0f), CRT_INFINITY);
        // Not the same numbers, but on such boxes the same answer; and never entered later than they are.
        node_differs += (V4Z(four) < CRT_INFINITY) != (t < CRT_INFINITY) || V4Z(four) > t ||
                        V4X(four) < CRT_INFINITY || V4Y(four) < CRT_INFINITY || V4W(four) < CRT_INFINITY;
        touched_count += touched;
        untouched_count += !touched;
        culled += touched && !(t < CRT_INFINITY);
        entered_untouched += !touched && t < CRT_INFINITY;
    }
    CHECK(culled == 0);
    CHECK(node_differs == 0);
    CHECK(touched_count > 100000);
    // And it does cull: on such numbers, all that it may.
    CHECK(entered_untouched == 0);
    CHECK(untouched_count > 100000);
}

TEST_CASE("rays that are none hit nothing, and end", "[kernel][rays]") {
    const ThreeWays scene(icosphere(4, 1, {0, 0, 0}));
    const CrtContext brute = contextOf(scene.brute), bvh = contextOf(scene.bvh),
                     boxes = contextOf(scene.boxes);
    const f32 nan = std::nanf(""), inf = CRT_INFINITY;
    std::vector<CrtRay> rays;
    for (const f32 bad : {nan, inf, -inf})
        for (u32 mask = 1; mask < 64; ++mask) {
            const auto at = [&](u32 bit, f32 good) { return mask >> bit & 1 ? bad : good; };
            rays.push_back(rayOf(make_vec3(at(0, 0.1f), at(1, 0.2f), at(2, 0.3f)),
                                 make_vec3(at(3, 0.5f), at(4, 0.0f), at(5, -0.7f))));
        }
    for (const f32 zero : {0.0f, -0.0f})
        rays.push_back(rayOf(make_vec3(0.1f, 0.2f, 0.3f), make_vec3(zero, zero, zero)));
    rays.push_back(rayOf(make_vec3(0.1f, 0.2f, 0.3f), make_vec3(FLT_TRUE_MIN, 0, 0)));
    // Real directions, but no way to go.
    for (const f32 reach : {0.0f, -1.0f, -inf})
        rays.push_back(rayOf(make_vec3(0, 0, 0), make_vec3(0, 0, 1), reach));
    std::uint64_t hits = 0;
    for (const CrtRay& ray : rays) {
        hits += crt_brute_force_closest(&brute, ray).slot != CRT_NONE;
        hits += crt_bvh_closest(&bvh, ray).slot != CRT_NONE;
        hits += crt_aabb_closest(&boxes, ray).slot != CRT_NONE;
        hits += static_cast<std::uint64_t>(crt_brute_force_any(&brute, ray, nullptr) +
                                           crt_bvh_any(&bvh, ray, nullptr) +
                                           crt_aabb_any(&boxes, ray, nullptr));
    }
    CHECK(hits == 0);
    // Directions of extreme but honest lengths do hit.
    for (const f32 length : {1e-18f, 1e-30f, 1e18f, 1e30f}) {
        INFO(length);
        CHECK(crt_bvh_closest(&bvh, rayOf(make_vec3(0.1f, 0.2f, 0.3f), make_vec3(0.3f * length, 0, length)))
                  .slot != CRT_NONE);
    }
}

TEST_CASE("triangles without area are never hit", "[kernel][rays]") {
    Random random(24);
    Mesh mesh;
    for (int i = 0; i < 2000; ++i) {
        const Vec3d a = times(random.direction(), random.uniform()),
                    b = times(random.direction(), random.uniform());
        switch (i % 4) {
            case 0: addTriangle(mesh, a, a, a); break;
            case 1: addTriangle(mesh, a, b, b); break;
            case 2: addTriangle(mesh, a, b, a); break;
            // Three points of one line, exactly.
            default: {
                const Vec3d step{std::ldexp(std::round(a[0] * 64), -12),
                                 std::ldexp(std::round(a[1] * 64), -12),
                                 std::ldexp(std::round(a[2] * 64), -12)};
                const Vec3d start{std::ldexp(std::round(b[0] * 512), -10),
                                  std::ldexp(std::round(b[1] * 512), -10),
                                  std::ldexp(std::round(b[2] * 512), -10)};
                addTriangle(mesh, start, plus(start, times(step, 1 + random.below(5))),
                            plus(start, times(step, -3)));
            }
        }
    }
    for (const Accelerator accelerator : {Accelerator::None, Accelerator::Bvh}) {
        const crt::CompiledScene compiled = crt::compileScene(sceneOf(mesh, accelerator), 0);
        const CrtContext ctx = contextOf(compiled);
        const double scale = std::ldexp(1.0, compiled.scale_exponent);
        std::uint64_t hits = 0;
        for (int i = 0; i < 100000; ++i) {
            // At the places where they would be.
            const auto& t = mesh.triangles[random.below(2000)];
            const Vec3d p = mesh.positions[t[0]], q = mesh.positions[t[random.below(2) + 1]];
            const Vec3d target =
                times(minus(plus(p, times(minus(q, p), random.uniform())), compiled.centre), scale);
            const vec3 o = toFloat(times(random.direction(), 1.5));
            const CrtRay ray = rayOf(o, unitFloat(minus(toDouble(toFloat(target)), toDouble(o))));
            hits += (accelerator == Accelerator::Bvh ? crt_bvh_closest(&ctx, ray)
                                                     : crt_brute_force_closest(&ctx, ray))
                        .slot != CRT_NONE;
        }
        CHECK(hits == 0);
    }
}

TEST_CASE("of triangles equally near, the first in the author's order is hit", "[kernel][rays]") {
    Random random(25);
    constexpr std::uint32_t kDistinct = 50, kCopies = 7;
    const Mesh distinct = soup(random, kDistinct);
    std::vector<std::uint32_t> order(kDistinct * kCopies);
    std::iota(order.begin(), order.end(), 0u);
    for (std::size_t i = order.size(); i > 1; --i)
        std::swap(order[i - 1], order[random.below(static_cast<u32>(i))]);
    Mesh mesh = distinct;
    mesh.triangles.clear();
    std::vector<u32> first(kDistinct, CRT_NONE);
    for (const std::uint32_t i : order) {
        first[i % kDistinct] = std::min(first[i % kDistinct], static_cast<u32>(mesh.triangles.size()));
        mesh.triangles.push_back(distinct.triangles[i % kDistinct]);
    }
    const ThreeWays all(mesh), single(distinct);
    const CrtContext ctx = contextOf(single.brute);
    std::uint64_t wrong = 0, hits = 0;
    for (int i = 0; i < 20000; ++i) {
        const CrtRay ray = awkwardRay(ctx, random, true);
        const CrtHit one = oneByOne(ctx, ray);
        if (one.slot == CRT_NONE) continue;
        // Where two different triangles tie, the one whose first copy comes first wins; those rays go to the
        // general comparison.
        ++hits;
        const CrtContext bvh = contextOf(all.bvh), brute = contextOf(all.brute),
                         boxes = contextOf(all.boxes);
        const CrtHit hit = oneByOne(brute, ray);
        wrong += hit.t != one.t || first[order[hit.id] % kDistinct] != hit.id;
        wrong += !sameBits(hit, crt_bvh_closest(&bvh, ray)) ||
                 !sameBits(hit, crt_brute_force_closest(&brute, ray)) ||
                 !sameBits(hit, crt_aabb_closest(&boxes, ray));
    }
    CHECK(wrong == 0);
    CHECK(hits > 5000);
}

TEST_CASE("a tree holds every triangle once, inside all boxes above it, within the kernel's stack",
          "[kernel][rays]") {
    Random random(27);
    const auto check = [](const std::vector<crt::TriangleBounds>& triangles) {
        const crt::Bvh bvh = crt::buildBvh(triangles, 0.0f);
        REQUIRE(!bvh.nodes.empty());
        CHECK(bvh.depth <= crt::kMaxBvhDepth);
        std::vector<int> seen(triangles.size());
        std::uint64_t outside = 0;
        struct Entry {
            u32 node;
            int depth;
            crt::TriangleBounds box;
        };
        constexpr f32 huge = FLT_MAX;
        std::vector<Entry> stack{{0, 1, {{-huge, -huge, -huge}, {huge, huge, huge}}}};
        int deepest = 0;
        while (!stack.empty()) {
            const Entry entry = stack.back();
            stack.pop_back();
            deepest = std::max(deepest, entry.depth);
            const CrtNode4& node = bvh.nodes[entry.node];
            for (u32 c = 0; c < 4; ++c) {
                if (node.bounds[0][c] > node.bounds[1][c]) continue;
                crt::TriangleBounds box = entry.box;
                for (u32 k = 0; k < 3; ++k) {
                    box.lower[k] = std::max(box.lower[k], node.bounds[2 * k][c]);
                    box.upper[k] = std::min(box.upper[k], node.bounds[2 * k + 1][c]);
                }
                const u32 count = node.child[c] & 15, first = node.child[c] >> 4;
                if (count == 0) stack.push_back({first, entry.depth + 1, box});
                for (u32 i = 0; i < count; ++i) {
                    const u32 id = bvh.order[first + i];
                    ++seen[id];
                    for (u32 k = 0; k < 3; ++k)
                        outside +=
                            triangles[id].lower[k] < box.lower[k] || triangles[id].upper[k] > box.upper[k];
                }
            }
        }
        CHECK(outside == 0);
        CHECK(std::all_of(seen.begin(), seen.end(), [](int n) { return n == 1; }));
        CHECK(deepest == bvh.depth);
    };
    for (const std::size_t count : {1u, 2u, 3u, 4u, 5u, 15u, 16u, 17u, 1000u}) {
        std::vector<crt::TriangleBounds> triangles(count);
        for (auto& t : triangles)
            for (std::size_t k = 0; k < 3; ++k) {
                t.lower[k] = static_cast<f32>(random.uniform(-1, 1));
                t.upper[k] = t.lower[k] + static_cast<f32>(random.uniform(0, 0.1));
            }
        INFO(count);
        check(triangles);
    }
    // All the same; all on a line; nested, each half as large, to the end of the floats; one cluster inside
    // another, to the end of the halvings.
    check(std::vector<crt::TriangleBounds>(100000, {{0, 0, 0}, {1, 1, 1}}));
    std::vector<crt::TriangleBounds> nested, line, clusters;
    for (int i = 0; i < 120; ++i)
        nested.push_back({{0, 0, 0}, {std::ldexp(1.0f, -i), std::ldexp(1.0f, -i), std::ldexp(1.0f, -i)}});
    for (int i = 0; i < 5000; ++i)
        line.push_back({{static_cast<f32>(i), 0, 0}, {static_cast<f32>(i), 0, 0}});
    for (int i = 0; i < 2000; ++i) {
        const f32 x = std::ldexp(1.0f, -i % 140);
        clusters.push_back({{x, 0, 0}, {x, 0, 0}});
    }
    check(nested);
    check(line);
    check(clusters);
}
