#include "near_surfaces.h"

#include "kernel/path.h"

#include "vec3d.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace crt {
namespace {

kernel::CrtContext contextOf(const CompiledScene& scene) {
    kernel::CrtContext context{};
    context.blob = scene.data();
    context.scene = reinterpret_cast<const kernel::CrtScene*>(scene.data());
    return context;
}

/// As many rays as take some hundredths of a second: from every triangle in small scenes, from an even choice in large ones.
constexpr std::uint64_t kTriangles = 10000;
constexpr std::uint64_t kTriangleTests = 4000000;

/// Emitters that are asked about coplanar surfaces, and pairs where there is no tree to find neighbours by.
constexpr std::uint64_t kEmitters = 100000;

/// A triangle of the compiled scene, in double.
struct Corners {
    std::array<Vec3d, 3> p;
    Vec3d normal;  ///< Unit; zero without area.
    double clearance = 0;
};

Corners cornersOf(const kernel::CrtContext& context, std::uint32_t slot) {
    using namespace kernel;
    const CrtTriangle& triangle = CRT_ARRAY(CrtTriangle, context.blob, context.scene->triangles)[slot];
    const CrtFace& face = CRT_ARRAY(CrtFace, context.blob, context.scene->faces)[slot];
    Corners c;
    for (std::size_t v = 0; v < 3; ++v) c.p[v] = {triangle.p[v], triangle.p[3 + v], triangle.p[6 + v]};
    c.normal = {face.normal[0], face.normal[1], face.normal[2]};
    c.clearance = static_cast<double>(face.clearance);
    return c;
}

double largestEdge(const Corners& c) {
    double squared = 0;
    for (std::size_t v = 0; v < 3; ++v) {
        const Vec3d edge = c.p[(v + 1) % 3] - c.p[v];
        squared = std::max(squared, dot(edge, edge));
    }
    return std::sqrt(squared);
}

/// Whether the corners of the smaller lie in the plane of the larger, whose normal is known better, as well as rays can tell.
bool inOnePlane(const Corners& a, const Corners& b) {
    const Corners &large = largestEdge(a) < largestEdge(b) ? b : a, &small = &large == &a ? b : a;
    return std::all_of(small.p.begin(), small.p.end(), [&](const Vec3d& corner) {
        return std::abs(dot(large.normal, corner - large.p[0])) <= std::max(a.clearance, b.clearance);
    });
}

/// Whether two triangles of one plane have area in common: by the separating axes of their edges. What merely touches has not.
bool overlap(const Corners& a, const Corners& b) {
    const auto apart = [](const Corners& of, const Corners& other) {
        for (std::size_t v = 0; v < 3; ++v) {
            const Vec3d edge = of.p[(v + 1) % 3] - of.p[v];
            const Vec3d inwards = cross(of.normal, edge) * (1 / std::sqrt(dot(edge, edge)));
            double farthest = -std::numeric_limits<double>::infinity();
            for (const Vec3d& corner : other.p) farthest = std::max(farthest, dot(inwards, corner - of.p[v]));
            if (farthest <= std::max(of.clearance, other.clearance)) return true;
        }
        return false;
    };
    return dot(a.normal, a.normal) > 0 && dot(b.normal, b.normal) > 0 && !apart(a, b) && !apart(b, a);
}

/// Slots whose bounding boxes come within `padding` of that of `box`, until `visit` returns true.
template <class Visit>
bool anyNeighbour(const kernel::CrtContext& context, const Corners& box, double padding, const Visit& visit) {
    using namespace kernel;
    const CrtScene& scene = *context.scene;
    if (scene.accelerator != CRT_ACCELERATOR_BVH) {
        for (std::uint32_t slot = 0; slot < scene.triangle_count; ++slot)
            if (visit(slot)) return true;
        return false;
    }
    Vec3d lower = box.p[0], upper = box.p[0];
    for (const Vec3d& corner : box.p)
        for (std::size_t k = 0; k < 3; ++k) {
            lower[k] = std::min(lower[k], corner[k] - padding);
            upper[k] = std::max(upper[k], corner[k] + padding);
        }
    const auto* nodes = CRT_ARRAY(CrtNode4, context.blob, scene.nodes);
    std::vector<std::uint32_t> open{0};
    while (!open.empty()) {
        const CrtNode4& node = nodes[open.back()];
        open.pop_back();
        for (std::size_t child = 0; child < 4; ++child) {
            bool meets = true;
            for (std::size_t k = 0; k < 3; ++k)
                meets = meets && static_cast<double>(node.bounds[2 * k][child]) <= upper[k] && static_cast<double>(node.bounds[2 * k + 1][child]) >= lower[k];
            if (!meets) continue;
            const std::uint32_t index = node.child[child] >> 4, count = node.child[child] & 15u;
            if (count == 0) open.push_back(index);
            for (std::uint32_t slot = index; slot < index + count; ++slot)
                if (visit(slot)) return true;
        }
    }
    return false;
}

/// Every how-manieth of `count` to look at, for at least `wanted` of them.
std::uint64_t stepFor(std::uint64_t count, std::uint64_t wanted) {
    return std::max<std::uint64_t>(1, count / std::max<std::uint64_t>(wanted, 1));
}

}  // namespace

std::uint64_t nearSurfacesStep(std::uint64_t triangles) { return stepFor(triangles, kTriangles); }
std::uint64_t coplanarLightStep(std::uint64_t emitters) { return stepFor(emitters, kEmitters); }

std::optional<CoplanarLight> findCoplanarLight(const CompiledScene& scene) {
    using namespace kernel;
    const CrtContext context = contextOf(scene);
    const auto* triangles = CRT_ARRAY(CrtTriangle, context.blob, context.scene->triangles);
    const auto* primitives = CRT_ARRAY(CrtPrimitive, context.blob, context.scene->primitives);
    const bool tree = context.scene->accelerator == CRT_ACCELERATOR_BVH;
    const std::uint64_t count = context.scene->triangle_count;
    const std::uint64_t step = tree ? coplanarLightStep(scene.emitters)
                                    : stepFor(scene.emitters, kTriangleTests / std::max<std::uint64_t>(count, 1));
    std::optional<CoplanarLight> found;
    for (std::uint32_t slot = 0; slot < count && !found; ++slot) {
        const CrtPrimitive& light = primitives[triangles[slot].id];
        if (light.emitter == CRT_NONE || light.emitter % step != 0) continue;
        const Corners own = cornersOf(context, slot);
        anyNeighbour(context, own, 2 * own.clearance, [&](std::uint32_t other) {
            // Of one lamp's halves, and of two lamps that shine alike, it does not matter which is seen.
            const CrtPrimitive& surface = primitives[triangles[other].id];
            if (other == slot || surface.emitter == light.emitter) return false;
            const Corners corners = cornersOf(context, other);
            if (!inOnePlane(own, corners) || !overlap(own, corners)) return false;
            const double gap = 2 * std::max(own.clearance, corners.clearance);
            found = {triangles[slot].id, triangles[other].id, std::ldexp(gap, -scene.scale_exponent)};
            return true;
        });
    }
    return found;
}

NearSurfaces findNearSurfaces(const CompiledScene& scene) {
    using namespace kernel;
    const CrtContext context = contextOf(scene);
    const auto* triangles = CRT_ARRAY(CrtTriangle, context.blob, context.scene->triangles);
    const auto* faces = CRT_ARRAY(CrtFace, context.blob, context.scene->faces);
    const u32 count = context.scene->triangle_count;
    float largest = 0;
    for (u32 slot = 0; slot < count; ++slot) largest = std::max(largest, faces[slot].clearance);

    NearSurfaces found;
    const bool tree = context.scene->accelerator == CRT_ACCELERATOR_BVH;
    const std::uint64_t step = tree ? nearSurfacesStep(scene.triangles)
                                    : stepFor(count, std::min(kTriangles, kTriangleTests / std::max(count, 1u)));
    for (u32 slot = 0; slot < count; ++slot) {
        if (triangles[slot].id % step != 0) continue;  // by id: in every order of slots the same
        const vec3 normal = crt_load3(faces[slot].normal);
        if (dot3(normal, normal) == 0.0f) continue;  // no area
        ++found.asked;
        CrtRay ray;
        ray.o = (crt_triangle_vertex(triangles + slot, 0) + crt_triangle_vertex(triangles + slot, 1) + crt_triangle_vertex(triangles + slot, 2)) *
                (1.0f / 3.0f);
        const float touching = 16 * CRT_EPSILON * std::max({std::abs(ray.o.x), std::abs(ray.o.y), std::abs(ray.o.z)});
        for (const float side : {1.0f, -1.0f}) {
            // Begins beyond what touches, among it the triangle itself.
            ray.d = normal * side;
            CrtRay beyond = ray;
            beyond.o = ray.o + ray.d * touching;
            beyond.reach = largest;
            const CrtHit hit = crt_software_closest(&context, beyond);
            if (hit.slot == CRT_NONE || hit.slot == slot) continue;
            const float clearance = std::max(faces[slot].clearance, faces[hit.slot].clearance);
            if (hit.t + touching > clearance) continue;
            ++found.near;
            found.nearest_clearance = std::max(found.nearest_clearance, std::ldexp(static_cast<double>(clearance), -scene.scale_exponent));
            break;
        }
    }
    return found;
}

}  // namespace crt
