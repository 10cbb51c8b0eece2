/*
 * shadow_ray.h: how surfaces stop shadow rays. A surface stops one, unless the scene has panes and the ray
 * may pass the surface (passing.h). Surfaces are searched in any order until one stops the ray. The nearest
 * of those that it may pass is kept, so that most shadow rays need one search.
 */
#ifndef CRT_SHADOW_RAY_H
#define CRT_SHADOW_RAY_H

#include "kernel/geometry/intersect.h"

CRT_KERNEL_BEGIN

/* The surfaces met so far that a shadow ray may pass. Only scenes with panes read and write it. A search
   holds it in registers, so that it is less than the hit of the nearest surface: crt_hit_of_slot (slots.h)
   gives that. */
typedef struct CrtPassable {
    f32 t;        /* of the nearest one */
    u32 slot;     /* of the same; CRT_NONE: there is none */
    u32 instance; /* as of CrtHit */
    u32 count;    /* 0: none; 1: the nearest is the only one; more: others may be behind it */
} CrtPassable;

CRT_FN CrtPassable crt_none_passable(f32 reach) {
    CrtPassable passable;
    passable.t = reach;
    passable.slot = CRT_NONE;
    passable.instance = 0u;
    passable.count = 0u;
    return passable;
}

CRT_FN int crt_has_panes(const CrtContext *ctx) { return CRT_SCENE_HAS(ctx->scene, THIN_DIELECTRIC); }

/* In a scene with panes: true if a ray may pass the surface that it meets, or meets a mix. crt_passes
   decides. */
CRT_HOT_FN int crt_may_pass(const CrtContext *ctx, CrtHit hit) {
    const u32 material =
        CRT_ARRAY(CrtPrimitive, ctx->blob, ctx->scene->primitives)[crt_primitive_of(ctx, hit)].material;
    if ((CRT_HAS(OPACITY) || CRT_HAS(MIX)) && ctx->scene->compositions.count != 0u) {
        CRT_GLOBAL const CrtComposition *c = crt_compositions(ctx) + material;
        if (c->opacity != CRT_OPAQUE || c->kind != CRT_COMPOSED_PLAIN) return 1;
    }
    return CRT_ARRAY(CrtMaterial, ctx->blob, ctx->scene->materials)[material].type ==
           CRT_MATERIAL_THIN_DIELECTRIC;
}

/* Returns 1 if a surface that a shadow ray has hit stops it. The ray hits the surface at most `hits`
   times. */
CRT_HOT_FN int crt_stops(const CrtContext *ctx, CrtHit hit, u32 hits, CrtPassable *passable) {
    if (!crt_has_panes(ctx)) return 1;
    if (!crt_may_pass(ctx, hit)) return 1;
    if (hit.t < passable->t ||
        (hit.t == passable->t && hit.id < crt_id_of(ctx, passable->slot, passable->instance))) {
        passable->t = hit.t;
        passable->slot = hit.slot;
        if (CRT_HAS(INSTANCES)) passable->instance = hit.instance;
    }
    passable->count += hits;
    return 0;
}

/* Returns 1 if a triangle stops a shadow ray. */
CRT_HOT_FN int crt_triangle_stops(const CrtContext *ctx, CRT_GLOBAL const CrtTriangle *triangles, u32 slot,
                                  CrtShear shear, f32 reach, CrtPassable *passable) {
    CrtHit hit;
    if (!crt_intersect_triangle(triangles + slot, shear, reach, &hit)) return 0;
    hit.slot = slot;
    hit.id = triangles[slot].id;
    hit.instance = 0u;
    return crt_stops(ctx, hit, 1u, passable);
}

CRT_KERNEL_END

#endif
