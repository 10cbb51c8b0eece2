/*
 * bvh.h: software tracing, for backends without their own tracer: brute force for a few triangles, the
 * paper's culling by object boxes, and a four-wide BVH. Box tests only cull, conservatively; the test of
 * what a slot holds decides (slots.h).
 */
#ifndef CRT_BVH_H
#define CRT_BVH_H

#include "kernel/geometry/patches.h"
#include "kernel/geometry/slots.h"

CRT_KERNEL_BEGIN

CRT_FN CrtHit crt_brute_force_closest(const CrtContext *ctx, CrtRay ray) {
    CRT_GLOBAL const CrtTriangle *triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    CrtHit best;
#if CRT_SIMD8
    CRT_GLOBAL const CrtTriangle8 *blocks = CRT_ARRAY(CrtTriangle8, ctx->blob, ctx->scene->triangles8);
    const CrtShear shear = crt_shear(ray);
    const u32 count = ctx->scene->triangles8.count;
    const f32 slack = crt_candidate_slack(ray.o);
    best = crt_no_hit(ray.reach);
    for (u32 b = 0u; b < count; ++b)
        for (u32 lanes = crt_candidates8(blocks + b, ray, slack, best.t); lanes != 0u; lanes &= lanes - 1u)
            crt_test_closest(triangles, blocks[b].slot[crt_lowest_bit(lanes)], shear, &best);
#else
    if (!crt_patches_closest(CRT_ARRAY(CrtPatch, ctx->blob, ctx->scene->patches), ctx->scene->patches.count,
                             triangles, ray, &best)) {
        const CrtShear shear = crt_shear(ray);
        const u32 count = ctx->scene->triangle_count - ctx->scene->shapes.count;
        best = crt_no_hit(ray.reach);
        CRT_ROLLED for (u32 slot = 0u; slot < count; ++slot) crt_test_closest(triangles, slot, shear, &best);
    }
#endif
    if (CRT_HAS(SHAPES)) crt_last_slots_closest(ctx, ray, &best);
    return best;
}

/* For a segment between two points of the scene: triangles that have the whole scene on one side cannot
 * come between, and are not tested. */
CRT_FN int crt_brute_force_any(const CrtContext *ctx, CrtRay ray, CrtPassable *passable) {
    CRT_GLOBAL const CrtTriangle *triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
#if CRT_SIMD8
    CRT_GLOBAL const CrtTriangle8 *blocks = CRT_ARRAY(CrtTriangle8, ctx->blob, ctx->scene->occluders8);
    const u32 count = ctx->scene->occluders8.count;
    const f32 slack = crt_candidate_slack(ray.o);
    for (u32 b = 0u; b < count; ++b)
        for (u32 lanes = crt_candidates8(blocks + b, ray, slack, ray.reach); lanes != 0u;
             lanes &= lanes - 1u)
            if (crt_triangle_stops(ctx, triangles, blocks[b].slot[crt_lowest_bit(lanes)], crt_shear(ray),
                                   ray.reach, passable))
                return 1;
#else
    CRT_GLOBAL const CrtPatch *patches = CRT_ARRAY(CrtPatch, ctx->blob, ctx->scene->occluder_patches);
    const u32 count = ctx->scene->occluder_patches.count;
    const u32 stopped = crt_has_panes(ctx) ? 2u : crt_patches_any(patches, count, triangles, ray);
    if (stopped == 1u) return 1;
    if (stopped == 2u) {
        const CrtShear shear = crt_shear(ray);
        CRT_ROLLED for (u32 i = 0u; i < 2u * count; ++i) {
            const u32 slot = patches[i >> 1].slot[i & 1u];
            if (slot != CRT_NONE && crt_triangle_stops(ctx, triangles, slot, shear, ray.reach, passable))
                return 1;
        }
    }
#endif
    if (CRT_HAS(SHAPES)) return crt_last_slots_any(ctx, ray, passable);
    return 0;
}

CRT_FN CrtHit crt_aabb_closest(const CrtContext *ctx, CrtRay ray) {
    CRT_GLOBAL const CrtTriangle *triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    CRT_GLOBAL const CrtObject *objects = CRT_ARRAY(CrtObject, ctx->blob, ctx->scene->objects);
    const CrtShear shear = crt_shear(ray);
    const CrtSlab slab = crt_slab(ray);
    CrtHit best = crt_no_hit(ray.reach);
    for (u32 k = 0u; k < ctx->scene->objects.count; ++k) {
        if (!(crt_box(objects[k].lower, objects[k].upper, ray, slab, best.t) < CRT_INFINITY)) continue;
        for (u32 i = 0u; i < objects[k].count; ++i)
            if (CRT_HAS_SLOTS) crt_test_slot(ctx, triangles, objects[k].first + i, ray, shear, &best);
            else crt_test_closest(triangles, objects[k].first + i, shear, &best);
    }
    return best;
}

CRT_FN int crt_aabb_any(const CrtContext *ctx, CrtRay ray, CrtPassable *passable) {
    CRT_GLOBAL const CrtTriangle *triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    CRT_GLOBAL const CrtObject *objects = CRT_ARRAY(CrtObject, ctx->blob, ctx->scene->objects);
    const CrtShear shear = crt_shear(ray);
    const CrtSlab slab = crt_slab(ray);
    for (u32 k = 0u; k < ctx->scene->objects.count; ++k) {
        if (!(crt_box(objects[k].lower, objects[k].upper, ray, slab, ray.reach) < CRT_INFINITY)) continue;
        for (u32 i = 0u; i < objects[k].count; ++i)
            if (CRT_HAS_SLOTS
                    ? crt_slot_stops(ctx, triangles, objects[k].first + i, ray, shear, passable)
                    : crt_triangle_stops(ctx, triangles, objects[k].first + i, shear, ray.reach, passable))
                return 1;
    }
    return 0;
}

/* The node `current`: its nearest child that the ray enters becomes the current one. 0: it enters none. */
CRT_FN int crt_enter_node(CRT_GLOBAL const CrtNode4 *nodes, CrtNodeRay ray, f32 limit, u64 *stack, u32 *size,
                          u32 *current) {
    CRT_GLOBAL const CrtNode4 *node = nodes + (*current >> 4);
    return crt_enter_nearest(node, crt_node_distances(node, ray, limit), stack, size, current);
}

CRT_FN void crt_test_leaf(const CrtContext *ctx, CRT_GLOBAL const CrtTriangle *triangles, u32 leaf,
                          CrtRay ray, CrtShear shear, CrtHit *best) {
    const u32 first = leaf >> 4, end = first + (leaf & 15u);
    for (u32 slot = first; slot < end; ++slot)
        if (CRT_HAS_SLOTS) crt_test_slot(ctx, triangles, slot, ray, shear, best);
        else crt_test_closest(triangles, slot, shear, best);
}

CRT_FN CrtHit crt_bvh_closest(const CrtContext *ctx, CrtRay ray) {
    CRT_GLOBAL const CrtTriangle *triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    CRT_GLOBAL const CrtNode4 *nodes = CRT_ARRAY(CrtNode4, ctx->blob, ctx->scene->nodes);
    const CrtShear shear = crt_shear(ray);
    const CrtNodeRay among = crt_node_ray(ray, 0.0f);
    CrtHit best = crt_no_hit(ray.reach);
    if (!crt_is_ray(ray)) return best;
    u64 stack[CRT_BVH_STACK];
    u32 size = 0u;
    u32 current = 0u; /* the root: node 0 */
    for (;;) {
#if CRT_SIMD8
        if ((current & 15u) == 0u) {
            if (crt_enter_node(nodes, among, best.t, stack, &size, &current)) continue;
        } else {
            crt_test_leaf(ctx, triangles, current, ray, shear, &best);
        }
#else
        /* Visits boxes until it finds a leaf, then tests its triangles, so that the lanes of a warp do the
           same together (Aila and Laine 2009, "while-while"). */
        while ((current & 15u) == 0u) {
            if (crt_enter_node(nodes, among, best.t, stack, &size, &current)) continue;
            if (!crt_next_stacked(stack, &size, best.t, &current)) return best;
        }
        crt_test_leaf(ctx, triangles, current, ray, shear, &best);
#endif
        if (!crt_next_stacked(stack, &size, best.t, &current)) return best;
    }
}

CRT_FN int crt_bvh_any(const CrtContext *ctx, CrtRay ray, CrtPassable *passable) {
    CRT_GLOBAL const CrtTriangle *triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    CRT_GLOBAL const CrtNode4 *nodes = CRT_ARRAY(CrtNode4, ctx->blob, ctx->scene->nodes);
    const CrtShear shear = crt_shear(ray);
    const CrtNodeRay among = crt_node_ray(ray, 0.0f);
    if (!crt_is_ray(ray)) return 0;
    u32 stack[CRT_BVH_STACK];
#if CRT_SIMD8
    u32 size = 0u;
    u32 current = 0u; /* the root: node 0 */
    for (;;) {
        const u32 count = current & 15u;
        if (count == 0u) {
            CRT_GLOBAL const CrtNode4 *node = nodes + (current >> 4);
            const vec4 t = crt_node_distances(node, among, ray.reach);
            if (crt_enter_any(node, t, stack, &size, &current)) continue;
        } else {
            const u32 first = current >> 4;
            for (u32 i = 0u; i < count; ++i)
                if (CRT_HAS_SLOTS
                        ? crt_slot_stops(ctx, triangles, first + i, ray, shear, passable)
                        : crt_triangle_stops(ctx, triangles, first + i, shear, ray.reach, passable))
                    return 1;
        }
        if (size == 0u) return 0;
        --size;
        current = stack[size];
    }
#else
    u32 size = 0u;
    u32 current = 0u; /* the root: node 0 */
    for (;;) {
        while ((current & 15u) == 0u) {
            CRT_GLOBAL const CrtNode4 *node = nodes + (current >> 4);
            const vec4 t = crt_node_distances(node, among, ray.reach);
            if (crt_enter_any(node, t, stack, &size, &current)) continue;
            if (size == 0u) return 0;
            --size;
            current = stack[size];
        }
        const u32 first = current >> 4, end = first + (current & 15u);
        for (u32 slot = first; slot < end; ++slot)
            if (CRT_HAS_SLOTS ? crt_slot_stops(ctx, triangles, slot, ray, shear, passable)
                              : crt_triangle_stops(ctx, triangles, slot, shear, ray.reach, passable))
                return 1;
        if (size == 0u) return 0;
        --size;
        current = stack[size];
    }
#endif
}

CRT_FN CrtHit crt_software_closest(const CrtContext *ctx, CrtRay ray) {
    if (CRT_HAS(BVH) && ctx->scene->accelerator == CRT_ACCELERATOR_BVH) return crt_bvh_closest(ctx, ray);
    if (CRT_HAS(AABB) && ctx->scene->accelerator == CRT_ACCELERATOR_AABB) return crt_aabb_closest(ctx, ray);
    if (CRT_HAS(BRUTE_FORCE)) return crt_brute_force_closest(ctx, ray);
    return crt_no_hit(ray.reach);
}

CRT_FN int crt_software_any(const CrtContext *ctx, CrtRay ray, CrtPassable *passable) {
    if (CRT_HAS(BVH) && ctx->scene->accelerator == CRT_ACCELERATOR_BVH)
        return crt_bvh_any(ctx, ray, passable);
    if (CRT_HAS(AABB) && ctx->scene->accelerator == CRT_ACCELERATOR_AABB)
        return crt_aabb_any(ctx, ray, passable);
    if (CRT_HAS(BRUTE_FORCE)) return crt_brute_force_any(ctx, ray, passable);
    return 0;
}

/* The two hooks: the first hit, and whether something stops a shadow ray. A backend with its own tracer
 * defines CRT_BACKEND_TRACE and both functions after including the kernel. */
#ifdef CRT_BACKEND_TRACE
CRT_FN CrtHit crt_trace_closest(const CrtContext *ctx, CrtRay ray);
CRT_FN int crt_trace_any(const CrtContext *ctx, CrtRay ray, CrtPassable *passable);
#else
CRT_FN CrtHit crt_trace_closest(const CrtContext *ctx, CrtRay ray) { return crt_software_closest(ctx, ray); }
CRT_FN int crt_trace_any(const CrtContext *ctx, CrtRay ray, CrtPassable *passable) {
    return crt_software_any(ctx, ray, passable);
}
#endif

CRT_KERNEL_END

#endif
