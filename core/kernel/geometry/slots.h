/*
 * slots.h: what a slot of the scene holds: a triangle, a shape, or an instance.
 */
#ifndef CRT_SLOTS_H
#define CRT_SLOTS_H

#include "kernel/geometry/instances.h"
#include "kernel/geometry/shapes.h"

CRT_KERNEL_BEGIN

/* True if slots may hold instances or shapes besides triangles. */
#define CRT_HAS_SLOTS (CRT_HAS(SHAPES) || CRT_HAS(INSTANCES))

/* crt_test_closest of the triangle, shape or instance in the slot. */
CRT_HOT_FN void crt_test_slot(const CrtContext *ctx, CRT_GLOBAL const CrtTriangle *triangles, u32 slot,
                              CrtRay ray, CrtShear shear, CrtHit *best) {
    u32 shape = 0u;
    if (CRT_HAS_SLOTS) shape = triangles[slot].shape;
    if (CRT_HAS(INSTANCES) && shape >= CRT_SLOT_INSTANCE)
        crt_instance_closest(ctx, shape - CRT_SLOT_INSTANCE, ray, shear, best);
    else if (CRT_HAS(SHAPES) && shape != 0u)
        crt_test_shape_closest(ctx, triangles + slot, slot, ray, best);
    else
        crt_test_closest(triangles, slot, shear, best);
}

/* Returns 1 if the slot holds something that stops a shadow ray. */
CRT_HOT_FN int crt_slot_stops(const CrtContext *ctx, CRT_GLOBAL const CrtTriangle *triangles, u32 slot,
                              CrtRay ray, CrtShear shear, CrtPassable *passable) {
    u32 shape = 0u;
    if (CRT_HAS_SLOTS) shape = triangles[slot].shape;
    if (CRT_HAS(INSTANCES) && shape >= CRT_SLOT_INSTANCE)
        return crt_instance_any(ctx, shape - CRT_SLOT_INSTANCE, ray, shear, passable);
    if (CRT_HAS(SHAPES) && shape != 0u) return crt_shape_stops(ctx, triangles + slot, slot, ray, passable);
    return crt_triangle_stops(ctx, triangles, slot, shear, ray.reach, passable);
}

/* The hit of what the slot holds, if `instance` (as of CrtHit) has it. Slot CRT_NONE: none. */
CRT_HOT_FN CrtHit crt_hit_of_slot(const CrtContext *ctx, CrtRay ray, u32 slot, u32 instance) {
    CRT_GLOBAL const CrtTriangle *triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    CrtHit hit = crt_no_hit(ray.reach);
    if (slot == CRT_NONE) return hit;
    const CrtShear shear = crt_shear(ray);
    if (CRT_HAS(INSTANCES) && instance != 0u)
        crt_test_placed(crt_instance(ctx, instance - 1u), instance - 1u, triangles, slot, shear, &hit);
    else
        crt_test_slot(ctx, triangles, slot, ray, shear, &hit);
    return hit;
}

CRT_KERNEL_END

#endif
