// The kernel compiled ahead of time, once per feature mask: CMakeLists.txt builds this file with CRT_FEATURES and CRT_EMBREE_ENTRY set for
// each row of embree_program.cpp's table.
#include "embree_program.h"

#include "kernel/path.h"

namespace crt::kernel {

// A handful of triangles is tested eight at a time without Embree; its BVH begins to pay above that. Rays that Embree does not take go through the blob's.
CRT_FN CrtHit crt_trace_closest(const CrtContext* ctx, CrtRay ray) {
    if (CRT_HAS(BVH) && ctx->tracer != nullptr && embree::Tracer::takes(ray)) return ctx->tracer->closest(ray);
    return crt_software_closest(ctx, ray);
}

CRT_FN int crt_trace_any(const CrtContext* ctx, CrtRay ray) {
    if (CRT_HAS(BVH) && ctx->tracer != nullptr && embree::Tracer::takes(ray)) return ctx->tracer->any(ray);
    return crt_software_any(ctx, ray);
}

}  // namespace crt::kernel

namespace crt::embree {

RayTotals CRT_EMBREE_ENTRY(const TileJob& job) {
    using namespace kernel;
    CrtContext ctx;
    ctx.blob = job.blob;
    ctx.scene = reinterpret_cast<const CrtScene*>(job.blob);
    ctx.tracer = job.tracer;
    RayTotals totals;
    for (std::uint32_t y = job.y0; y < job.y1; ++y) {
        for (std::uint32_t x = job.x0; x < job.x1; ++x) {
            CrtRayCount rays{0, 0};
            crt_render_pixel(&ctx, x, y, job.first_sample, job.sample_count, job.sums, job.counts, job.primitives, &rays);
            totals.closest += rays.closest;
            totals.shadow += rays.shadow;
        }
    }
    return totals;
}

}  // namespace crt::embree
