/*
 * path.h: one sample of one pixel. The value of sample s of pixel p depends on (scene, seed, p, s) alone.
 *
 * A path is advanced vertex by vertex, so that each backend chooses the schedule of vertices.
 */
#ifndef CRT_PATH_H
#define CRT_PATH_H

#include "kernel/geometry/bvh.h"
#include "kernel/transport/passing.h"
#include "kernel/transport/shade.h"

CRT_KERNEL_BEGIN

typedef struct CrtRayCount {
    u32 closest, shadow;
} CrtRayCount;

/* Traces the pending shadow ray of a vertex; adds its radiance if nothing stops it. */
CRT_FN void crt_resolve_shadow(const CrtContext *ctx, CrtPath *path, const CrtShadow *shadow,
                               CrtRayCount *rays) {
    int blocked = 0;
    if (shadow->ray.reach > 0.0f) {
        rays->shadow += 1u;
        CrtPassable none = crt_none_passable(shadow->ray.reach);
        blocked = crt_trace_any(ctx, shadow->ray, &none);
    }
    if (!blocked) path->radiance = path->radiance + shadow->radiance;
}

/* crt_path_advance where rays may pass surfaces. One loop traces the path's ray, then the shadow ray: both
   go on until something stops them. */
CRT_FN int crt_path_advance_passing(const CrtContext *ctx, CrtPath *path, CrtRayCount *rays) {
    CrtShadow shadow;
    CrtRay ray = path->ray;
    int alive = 0;
    const int passable = crt_is_passable(ctx);
    CrtPassage way;
    way.shadow = 0;
    if (passable)
        way = crt_passage(CRT_PASSING_DIMENSION(path->depth, 0), 0, ray.d, path->wavelengths.position,
                          path->media, path->throughput);
    rays->closest += 1u;
    for (;;) {
        CrtHit hit = crt_no_hit(ray.reach);
        int stopped = 0; /* 1: an opaque surface stops the shadow ray */
        int last = 0;    /* 1: the shadow ray meets nothing behind `hit` */
        if (ray.reach > 0.0f) {
            if (way.shadow && (crt_has_panes(ctx) || !passable)) {
                CrtPassable met = crt_none_passable(ray.reach);
                stopped = crt_trace_any(ctx, ray, &met);
                if (!stopped) hit = crt_hit_of_slot(ctx, ray, met.slot, met.instance);
                last = met.count == 1u;
            } else {
                hit = crt_trace_closest(ctx, ray);
            }
        }
        if (passable && !stopped && hit.slot != CRT_NONE &&
            crt_passes(ctx, hit, &path->sampler, &way, &ray)) {
            if (!last) continue;
            hit.slot = CRT_NONE;
        }
        if (way.shadow) { /* the shadow ray of the vertex */
            if (!stopped && hit.slot == CRT_NONE) path->radiance = path->radiance + way.carried;
            return alive;
        }
        if (passable) {
            hit.t = hit.t + dot3(ray.o - path->ray.o, ray.d); /* from where the path's ray began */
            path->throughput = way.carried;
            path->met = way.material;
            path->panes = crt_count_panes(path->panes, way.panes);
        }
        const u32 depth = path->depth;
        alive = crt_shade(ctx, path, hit, &shadow);
        if (!(CRT_HAS(NEE) && shadow.pending)) return alive;
        /* On processors a search without panes is faster: 2 % of all instructions. On GPUs a
           second copy of the search spills 400 bytes of registers. */
        if (CRT_SIMD8 && !passable) {
            crt_resolve_shadow(ctx, path, &shadow, rays);
            return alive;
        }
        ray = shadow.ray;
        if (ray.reach > 0.0f) rays->shadow += 1u;
        way.shadow = 1;
        way.carried = shadow.radiance;
        if (passable)
            way = crt_passage(CRT_PASSING_DIMENSION(depth, 1), 1, ray.d, path->wavelengths.position,
                              CRT_HAS(MEDIA) ? shadow.media : 0u, shadow.radiance);
    }
}

/* Traces the path's ray to its next vertex, shades it and resolves its shadow ray. Returns 0 when the path
   has ended. */
CRT_FN int crt_path_advance(const CrtContext *ctx, CrtPath *path, const CrtFilmPixel *film,
                            CrtRayCount *rays) {
    (void)film;
    if (crt_has_left(ctx, path)) return 0;
    if (CRT_HAS(OPACITY) || CRT_HAS(THIN_DIELECTRIC)) return crt_path_advance_passing(ctx, path, rays);
    CrtShadow shadow;
    rays->closest += 1u;
    const int alive = crt_shade(ctx, path, crt_trace_closest(ctx, path->ray), &shadow);
    if (CRT_HAS(NEE) && shadow.pending) crt_resolve_shadow(ctx, path, &shadow, rays);
    return alive;
}

CRT_FN vec4 crt_path_end(const CrtContext *ctx, const CrtPath *path) {
    return crt_to_xyz(ctx, path->wavelengths, path->radiance);
}

CRT_KERNEL_END

#endif
