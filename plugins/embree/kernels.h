/// The kernel for one feature mask, CRT_FEATURES, as the function CRT_EMBREE_ENTRY. kernels.cpp compiles it
/// ahead of time, and embree_lean_kernel.h while the program runs; then CRT_EMBREE_LEAN is defined.
#pragma once

#include "tile_job.h"

#include "kernel/schedule/pixel.h"

#include "traversal.h"

#include <algorithm>

#ifdef CRT_EMBREE_LEAN
#if defined(__clang__)
#define CRT_EMBREE_COMPILER "clang++ " __clang_version__
#else
#define CRT_EMBREE_COMPILER "g++ " __VERSION__
#endif
extern "C" [[gnu::visibility("default")]] const char crt_embree_compiler[] = CRT_EMBREE_COMPILER;
#endif

namespace crt::kernel {

// A handful of triangles is tested eight at a time in a loop; the tree begins to pay above that.
CRT_FN CrtHit crt_trace_closest(const CrtContext* ctx, CrtRay ray) {
    if (CRT_HAS(BVH) && ctx->tree != 0) return embree::closestHit(ctx, ray);
    return crt_software_closest(ctx, ray);
}

CRT_FN int crt_trace_any(const CrtContext* ctx, CrtRay ray, CrtPassable* passable) {
    if (CRT_HAS(BVH) && ctx->tree != 0) return embree::anyHit(ctx, ray, passable) ? 1 : 0;
    return crt_software_any(ctx, ray, passable);
}

}  // namespace crt::kernel

namespace crt::embree {
namespace {

using namespace kernel;

// Not inlined, so that two pixels can take turns without the kernel being there twice.
[[gnu::noinline]] bool advance(const CrtContext& ctx, CrtPixelWork& work, CrtRayCount& rays) {
    return crt_pixel_vertex(&ctx, &work, &rays) != 0;
}

// A path may have no end: call the host after every fixed number of rays, so that it can cancel.
bool isCancelled(const TileJob& job, const CrtRayCount& rays) {
    constexpr u32 kRaysBetweenLooks = 1u << 16;
    return rays.closest % kRaysBetweenLooks == 0 && job.cancelled(job.host);
}

// Two pixels in turn, vertex by vertex: a path is one long chain of dependent operations, and while it waits
// the processor works on the other's. Returns false where the host cancelled.
bool renderPair(const TileJob& job, const CrtContext& ctx, CrtPixelWork& a, CrtPixelWork& b,
                CrtRayCount& rays) {
    while (advance(ctx, a, rays) && advance(ctx, b, rays))
        if (isCancelled(job, rays)) return false;
    while (advance(ctx, a, rays))
        if (isCancelled(job, rays)) return false;
    while (advance(ctx, b, rays))
        if (isCancelled(job, rays)) return false;
    crt_pixel_end(&a);
    crt_pixel_end(&b);
    return true;
}

}  // namespace

#ifdef CRT_EMBREE_LEAN
extern "C" [[gnu::visibility("default")]]
#endif
RayTotals
CRT_EMBREE_ENTRY(const TileJob& job) {
    CrtContext ctx;
    ctx.blob = job.blob;
    ctx.scene = reinterpret_cast<const CrtScene*>(job.blob);
    ctx.tree = job.tree;
    const auto pixel = [&](std::uint32_t x, std::uint32_t y) {
        return crt_pixel_begin(&ctx, x, y, job.first_sample, job.sample_count, job.sums, job.counts,
                               job.primitives, job.splats);
    };
    RayTotals totals{0, 0};
    for (std::uint32_t y = job.y0; y < job.y1; ++y) {
        for (std::uint32_t x = job.x0; x < job.x1; x += 2) {
            CrtRayCount rays{0, 0};
            CrtPixelWork first = pixel(x, y), second = pixel(std::min(x + 1, job.x1 - 1), y);
            if (x + 1 == job.x1) second.sample_count = 0;  // A row of odd length: the last pixel is alone.
            const bool done = renderPair(job, ctx, first, second, rays);
            totals.closest += rays.closest;
            totals.shadow += rays.shadow;
            if (!done) return totals;
        }
    }
    return totals;
}

}  // namespace crt::embree
