#include "near_surfaces.h"

#include "kernel/path.h"

#include <algorithm>
#include <cmath>

namespace crt {
namespace {

/// As many rays as take some hundredths of a second: from every triangle in small scenes, from an even choice in large ones.
constexpr std::uint64_t kTriangles = 10000;
constexpr std::uint64_t kTriangleTests = 4000000;

}  // namespace

NearSurfaces findNearSurfaces(const CompiledScene& scene) {
    using namespace kernel;
    CrtContext context{};
    context.blob = scene.data();
    context.scene = reinterpret_cast<const CrtScene*>(scene.data());
    const auto* triangles = CRT_ARRAY(CrtTriangle, context.blob, context.scene->triangles);
    const auto* faces = CRT_ARRAY(CrtFace, context.blob, context.scene->faces);
    const u32 count = context.scene->triangle_count;
    float largest = 0;
    for (u32 slot = 0; slot < count; ++slot) largest = std::max(largest, faces[slot].clearance);

    NearSurfaces found;
    const bool tree = context.scene->accelerator == CRT_ACCELERATOR_BVH;
    const std::uint64_t wanted = std::min(kTriangles, tree ? kTriangles : kTriangleTests / std::max(count, 1u));
    const u32 step = static_cast<u32>(std::max<std::uint64_t>(1, count / std::max<std::uint64_t>(wanted, 1)));
    for (u32 slot = 0; slot < count; slot += step) {
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
