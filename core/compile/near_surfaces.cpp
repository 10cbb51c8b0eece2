#include "compile/near_surfaces.h"

#include "kernel/geometry/slots.h"
#include "kernel/geometry/surface.h"

#include "base/parallel.h"
#include "base/vec3d.h"
#include "compile/box.h"
#include "compile/context_of.h"
#include "compile/coplanar.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

namespace crt {
namespace {

using kernel::u64;  // CRT_ARRAY computes with it

/// Triangles that are asked at most, in large scenes an even choice of them.
constexpr std::uint64_t kTriangles = 10000;
constexpr std::uint64_t kEmitters = 100000;

/// Tests of a triangle against another, some hundredths of a second of them. Where thousands lie on one spot
/// each is a neighbour of each: then fewer triangles are asked, and the time stays what it is.
constexpr std::uint64_t kTriangleTests = 4000000;

/// All of [0, count) in an order whose every beginning is spread evenly: multiples of the golden section,
/// modulo count.
class EvenOrder {
public:
    explicit EvenOrder(std::uint64_t count)
        : count_(count), step_(static_cast<std::uint64_t>(static_cast<double>(count) * 0.6180339887498949)) {
        while (count_ > 1 && std::gcd(step_, count_) != 1) ++step_;
    }
    std::uint64_t operator[](std::uint64_t i) const {
        return static_cast<std::uint64_t>(static_cast<unsigned __int128>(i) * step_ % count_);
    }

private:
    std::uint64_t count_, step_;
};

/// Slots whose bounding boxes meet `box`, until `visit` returns true or no test is left in `tests`.
/// Instances are passed over: their triangles are stored without the places where they stand.
template <class Visit>
void visitNeighbours(const kernel::CrtContext& context, const Box& box, std::uint64_t& tests,
                     const Visit& visit) {
    using namespace kernel;
    const CrtScene& scene = *context.scene;
    const auto* triangles = CRT_ARRAY(CrtTriangle, context.blob, scene.triangles);
    // A false answer goes on; so do the tests, while there are any.
    const auto stops = [&](std::uint32_t slot) {
        if (triangles[slot].shape >= CRT_SLOT_INSTANCE) return false;
        return tests == 0 || (--tests, visit(slot));
    };
    if (scene.accelerator != CRT_ACCELERATOR_BVH) {
        for (std::uint32_t slot = 0; slot < scene.triangle_count; ++slot)
            if (stops(slot)) return;
        return;
    }
    const auto* nodes = CRT_ARRAY(CrtNode4, context.blob, scene.nodes);
    std::vector<std::uint32_t> open{0};
    while (!open.empty()) {
        const CrtNode4& node = nodes[open.back()];
        open.pop_back();
        for (std::size_t child = 0; child < 4; ++child) {
            bool meets = true;
            for (std::size_t k = 0; k < 3; ++k)
                meets = meets && static_cast<double>(node.bounds[2 * k][child]) <= box.upper[k] &&
                        static_cast<double>(node.bounds[2 * k + 1][child]) >= box.lower[k];
            if (!meets) continue;
            const std::uint32_t index = node.child[child] >> 4, count = node.child[child] & 15u;
            if (count == 0) open.push_back(index);
            for (std::uint32_t slot = index; slot < index + count; ++slot)
                if (stops(slot)) return;
        }
    }
}

/// The closest triangle or shape that a ray meets within its reach, which is short.
kernel::CrtHit closestWithin(const kernel::CrtContext& context, const kernel::CrtRay& ray,
                             std::uint64_t& tests) {
    using namespace kernel;
    const Vec3d o{ray.o.x, ray.o.y, ray.o.z}, d{ray.d.x, ray.d.y, ray.d.z};
    const auto point = [&](double t) {
        Vec3d p;
        for (std::size_t k = 0; k < 3; ++k) p[k] = o[k] + t * d[k];
        return p;
    };
    const auto reach = static_cast<double>(ray.reach);
    Box box;
    box.add(point(0), reach * 1e-3);
    box.add(point(reach), reach * 1e-3);
    const auto* triangles = CRT_ARRAY(CrtTriangle, context.blob, context.scene->triangles);
    const CrtShear shear = crt_shear(ray);
    CrtHit best = crt_no_hit(ray.reach);
    visitNeighbours(context, box, tests, [&](std::uint32_t slot) {
        crt_test_slot(&context, triangles, slot, ray, shear, &best);
        return false;
    });
    return best;
}

/// Slots by id; CRT_NONE for triangles that a reduced scene (near_scene.h) lacks. By ids, so that every
/// order of slots is asked about the same triangles.
std::vector<std::uint32_t> slotsOf(const CompiledScene& scene, const kernel::CrtContext& context) {
    using namespace kernel;
    const auto* triangles = CRT_ARRAY(CrtTriangle, context.blob, context.scene->triangles);
    std::vector<std::uint32_t> slots(scene.triangles + scene.shapes + scene.instances, CRT_NONE);
    for (std::uint32_t slot = 0; slot < context.scene->triangle_count; ++slot)
        slots[triangles[slot].id] = slot;
    return slots;
}

}  // namespace

std::vector<std::uint32_t> askedTriangles(std::uint64_t triangles) {
    const EvenOrder order(triangles);
    std::vector<std::uint32_t> ids(std::min(triangles, kTriangles));
    for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<std::uint32_t>(order[i]);
    return ids;
}

float largestClearance(const kernel::CrtFace* faces, std::size_t count) {
    constexpr std::size_t kPart = std::size_t{1} << 18;
    std::vector<float> largest(partsOf(count, kPart), 0.0f);
    parallelFor(count, kPart, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i)
            largest[first / kPart] = std::max(largest[first / kPart], faces[i].clearance);
    });
    return largest.empty() ? 0.0f : *std::max_element(largest.begin(), largest.end());
}

std::vector<std::uint32_t> askedEmitters(const CompiledScene& scene) {
    std::vector<std::uint32_t> ids;
    if (scene.emitters == 0) return ids;
    const kernel::CrtContext context = contextOf(scene);
    const auto* primitives = CRT_ARRAY(kernel::CrtPrimitive, context.blob, context.scene->primitives);
    const std::uint64_t step = std::max<std::uint64_t>(1, scene.emitters / kEmitters);
    for (std::uint32_t id = 0; id < scene.triangles + scene.shapes; ++id)  // Instances emit nothing.
        if (primitives[id].light != CRT_NONE && primitives[id].light % step == 0) ids.push_back(id);
    return ids;
}

TriangleBounds aroundMiddle(const kernel::CrtTriangle& triangle, float reach) {
    TriangleBounds bounds{};
    for (std::size_t k = 0; k < 3; ++k) {
        const float* p = triangle.p + 3 * k;
        bounds.lower[k] = (p[0] + p[1] + p[2]) / 3 - reach;
        bounds.upper[k] = (p[0] + p[1] + p[2]) / 3 + reach;
    }
    return bounds;
}

std::optional<CoplanarLight> findCoplanarLight(const CompiledScene& scene) {
    using namespace kernel;
    const CrtContext context = contextOf(scene);
    const auto* triangles = CRT_ARRAY(CrtTriangle, context.blob, context.scene->triangles);
    const auto* primitives = CRT_ARRAY(CrtPrimitive, context.blob, context.scene->primitives);
    std::vector<std::uint32_t> lights = askedEmitters(scene);
    if (lights.empty()) return std::nullopt;
    const std::vector<std::uint32_t> slots = slotsOf(scene, context);
    std::erase_if(lights, [&](std::uint32_t id) { return slots[id] == CRT_NONE; });
    std::uint64_t tests = kTriangleTests;
    std::optional<CoplanarLight> found;
    const EvenOrder order(lights.size());
    for (std::uint64_t i = 0; i < lights.size() && !found && tests > 0; ++i) {
        const std::uint32_t slot = slots[lights[order[i]]];
        const CrtPrimitive& light = primitives[triangles[slot].id];
        const Corners own = cornersOf(context.blob, slot);
        Box box;
        for (const Vec3d& corner : own.p) box.add(corner, 2 * own.clearance);
        visitNeighbours(context, box, tests, [&](std::uint32_t other) {
            // Of one lamp's halves, and of two lamps that shine alike, it does not matter which is seen.
            const CrtPrimitive& surface = primitives[triangles[other].id];
            if (other == slot || surface.light == light.light) return false;
            const Corners corners = cornersOf(context.blob, other);
            if (!inOnePlane(own, corners) || !overlap(own, corners)) return false;
            const double gap = 2 * std::max(own.clearance, corners.clearance);
            found = {triangles[slot].id, triangles[other].id, std::ldexp(gap, -scene.scale_exponent)};
            return true;
        });
    }
    return found;
}

CoarseLights findCoarseLights(const CompiledScene& scene) {
    using namespace kernel;
    constexpr double kCoarse = 1e-3;
    const CrtContext context = contextOf(scene);
    const auto* triangles = CRT_ARRAY(CrtTriangle, context.blob, context.scene->triangles);
    const auto* primitives = CRT_ARRAY(CrtPrimitive, context.blob, context.scene->primitives);
    const auto* shapes = CRT_ARRAY(CrtShape, context.blob, context.scene->shapes);
    CoarseLights found;
    if (scene.emitters == 0) return found;
    for (std::uint32_t slot = 0; slot < context.scene->triangle_count; ++slot) {
        const CrtTriangle& triangle = triangles[slot];
        if (triangle.shape >= CRT_SLOT_INSTANCE || primitives[triangle.id].light == CRT_NONE) continue;
        double coordinate = 0, size = 0;
        for (const float p : triangle.p) coordinate = std::max(coordinate, std::abs(static_cast<double>(p)));
        if (triangle.shape != 0) {
            size = static_cast<double>(shapes[triangle.shape - 1].radius);
        } else {
            const Corners c = cornersOf(context.blob, slot);
            const Vec3d n = cross(c.p[1] - c.p[0], c.p[2] - c.p[0]);
            size = length(n) / largestEdge(c);
        }
        if (!(size > 0)) continue;
        ++found.asked;
        const double rounding = coordinate * static_cast<double>(CRT_EPSILON) / size;
        found.lights += rounding > kCoarse;
        found.rounding = std::max(found.rounding, rounding);
    }
    return found;
}

std::optional<std::array<NormalRay, 2>> normalRays(const kernel::CrtContext& context, std::uint32_t slot,
                                                   float reach) {
    using namespace kernel;
    const auto* triangles = CRT_ARRAY(CrtTriangle, context.blob, context.scene->triangles);
    const auto* faces = CRT_ARRAY(CrtFace, context.blob, context.scene->faces);
    const vec3 normal = crt_load3(faces[slot].normal);
    if (dot3(normal, normal) == 0.0f) return std::nullopt;
    const vec3 middle =
        (crt_triangle_vertex(triangles + slot, 0) + crt_triangle_vertex(triangles + slot, 1) +
         crt_triangle_vertex(triangles + slot, 2)) *
        (1.0f / 3.0f);
    const float touching =
        16 * CRT_EPSILON * std::max({std::abs(middle.x), std::abs(middle.y), std::abs(middle.z)});
    std::array<NormalRay, 2> rays{};
    for (std::size_t i = 0; i < 2; ++i) {
        rays[i].touching = touching;
        rays[i].ray.d = normal * (i == 0 ? 1.0f : -1.0f);
        // Begins beyond what touches, among it the triangle itself.
        rays[i].ray.o = middle + rays[i].ray.d * touching;
        rays[i].ray.reach = reach;
    }
    return rays;
}

std::optional<float> clearanceBeyond(const kernel::CrtContext& context, std::uint32_t slot,
                                     const NormalRay& from, const kernel::CrtHit& hit) {
    const auto* faces = CRT_ARRAY(kernel::CrtFace, context.blob, context.scene->faces);
    const float clearance = std::max(faces[slot].clearance, faces[hit.slot].clearance);
    return hit.t + from.touching > clearance ? std::nullopt : std::optional(clearance);
}

NearSurfaces findNearSurfaces(const CompiledScene& scene) {
    using namespace kernel;
    const CrtContext context = contextOf(scene);
    const auto* faces = CRT_ARRAY(CrtFace, context.blob, context.scene->faces);
    const u32 count = context.scene->triangle_count;
    const float largest = largestClearance(faces, count);

    NearSurfaces found;
    const std::vector<std::uint32_t> slots = slotsOf(scene, context);
    std::uint64_t tests = kTriangleTests;
    for (const std::uint32_t id : askedTriangles(scene.triangles)) {
        if (tests == 0) break;
        const u32 slot = slots[id];
        if (slot == CRT_NONE) continue;
        const auto rays = normalRays(context, slot, largest);
        if (!rays) continue;
        ++found.asked;
        for (const NormalRay& from : *rays) {
            const CrtHit hit = closestWithin(context, from.ray, tests);
            if (hit.slot == CRT_NONE || hit.slot == slot) continue;
            const std::optional<float> clearance = clearanceBeyond(context, slot, from, hit);
            if (!clearance) continue;
            ++found.near;
            found.nearest_clearance = std::max(
                found.nearest_clearance, std::ldexp(static_cast<double>(*clearance), -scene.scale_exponent));
            break;
        }
    }
    return found;
}

}  // namespace crt
