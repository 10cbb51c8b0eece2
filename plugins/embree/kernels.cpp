// The kernel compiled ahead of time, once per feature mask: CMakeLists.txt builds this file with
// CRT_FEATURES and CRT_EMBREE_ENTRY set for each row of embree_program.cpp's table.
#include "embree_kernels.h"
#include "embree_program.h"

#include "kernel/path.h"

#include <algorithm>

namespace crt::kernel {

namespace {

// A scene whose rays all start where Embree takes them comes without nodes. Should a ray be another
// nevertheless, every triangle and shape is tested: slow, and right.
bool lacksNodes(const CrtContext* ctx) { return ctx->tracer != nullptr && ctx->scene->nodes.count == 0; }

CrtHit testAllClosest(const CrtContext* ctx, CrtRay ray) {
    const CrtTriangle* triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    const CrtShear shear = crt_shear(ray);
    CrtHit best = crt_no_hit(ray.reach);
    if (!crt_is_ray(ray)) return best;
    for (u32 slot = 0; slot < ctx->scene->triangle_count; ++slot)
        crt_test_slot(ctx, triangles, slot, ray, shear, &best);
    return best;
}

int testAllAny(const CrtContext* ctx, CrtRay ray) {
    const CrtTriangle* triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    const CrtShear shear = crt_shear(ray);
    CrtHit hit;
    if (!crt_is_ray(ray)) return 0;
    for (u32 slot = 0; slot < ctx->scene->triangle_count; ++slot)
        if (crt_slot_stops(ctx, triangles, slot, ray, shear, &hit)) return 1;
    return 0;
}

}  // namespace

// A handful of triangles is tested eight at a time without Embree; its BVH begins to pay above that. Rays
// that Embree does not take go through the blob's.
CRT_FN CrtHit crt_trace_closest(const CrtContext* ctx, CrtRay ray) {
    if (CRT_HAS(BVH) && ctx->tracer != nullptr && embree::Tracer::takes(ray))
        return ctx->tracer->closest(ray);
    if (CRT_HAS(BVH) && lacksNodes(ctx)) return testAllClosest(ctx, ray);
    return crt_software_closest(ctx, ray);
}

CRT_FN int crt_trace_any(const CrtContext* ctx, CrtRay ray) {
    if (CRT_HAS(BVH) && ctx->tracer != nullptr && embree::Tracer::takes(ray)) return ctx->tracer->any(ray);
    if (CRT_HAS(BVH) && lacksNodes(ctx)) return testAllAny(ctx, ray);
    return crt_software_any(ctx, ray);
}

}  // namespace crt::kernel

namespace crt::embree {
namespace {

using namespace kernel;

// Not inlined, so that two pixels can take turns without the kernel being there twice.
[[gnu::noinline]] bool advance(const CrtContext& ctx, CrtPixelWork& work, CrtRayCount& rays) {
    return crt_pixel_vertex(&ctx, &work, &rays) != 0;
}

// Two pixels in turn, vertex by vertex: a path is one long chain of dependent operations, and while it waits
// the processor works on the other's.
void renderPair(const CrtContext& ctx, CrtPixelWork& a, CrtPixelWork& b, CrtRayCount& rays) {
    while (advance(ctx, a, rays) && advance(ctx, b, rays)) continue;
    while (advance(ctx, a, rays)) continue;
    while (advance(ctx, b, rays)) continue;
    crt_pixel_end(&a);
    crt_pixel_end(&b);
}

}  // namespace

RayTotals CRT_EMBREE_ENTRY(const TileJob& job) {
    CrtContext ctx;
    ctx.blob = job.blob;
    ctx.scene = reinterpret_cast<const CrtScene*>(job.blob);
    ctx.tracer = job.tracer;
    const auto pixel = [&](std::uint32_t x, std::uint32_t y) {
        return crt_pixel_begin(&ctx, x, y, job.first_sample, job.sample_count, job.sums, job.counts,
                               job.primitives);
    };
    RayTotals totals;
    for (std::uint32_t y = job.y0; y < job.y1; ++y) {
        for (std::uint32_t x = job.x0; x < job.x1; x += 2) {
            CrtRayCount rays{0, 0};
            CrtPixelWork first = pixel(x, y), second = pixel(std::min(x + 1, job.x1 - 1), y);
            if (x + 1 == job.x1) second.sample_count = 0;  // A row of odd length: the last pixel is alone.
            renderPair(ctx, first, second, rays);
            totals.closest += rays.closest;
            totals.shadow += rays.shadow;
        }
    }
    return totals;
}

}  // namespace crt::embree
