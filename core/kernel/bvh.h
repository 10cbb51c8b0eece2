/*
 * bvh.h: software tracing, for backends without a tracer of their own: brute force for a handful of
 * triangles, the paper's culling by object boxes, and a four-wide BVH. Box tests only cull, conservatively;
 * crt_intersect_triangle and crt_intersect_shape decide.
 */
#ifndef CRT_BVH_H
#define CRT_BVH_H

#include "shapes.h"

CRT_KERNEL_BEGIN

#define CRT_BVH_STACK 96 /* three entries a level; bvh_build.cpp keeps the tree below 32 levels */

/* Which of a box's two planes a ray meets first, per axis, by the sign bit, so that −0 is told from +0;
   and
 * 1/d, infinite where d is zero. */
typedef struct CrtSlab {
    u32 near_x, near_y, near_z;
    vec3 inverse;
} CrtSlab;

CRT_FN CrtSlab crt_slab(CrtRay ray) {
    CrtSlab s;
    s.near_x = crt_bits(V3X(ray.d)) >> 31;
    s.near_y = 2u + (crt_bits(V3Y(ray.d)) >> 31);
    s.near_z = 4u + (crt_bits(V3Z(ray.d)) >> 31);
    s.inverse = make_vec3(1.0f / V3X(ray.d), 1.0f / V3Y(ray.d), 1.0f / V3Z(ray.d));
    return s;
}

#define CRT_SLAB_SLACK \
    1.0000005f /* 1 + 2γ(3), rounded up: rounding never loses a box that is touched (Ize 2013) */

/* Entry distance of a ray into one box, or infinity. A NaN (0·∞: the origin on a plane that the ray runs
 * along) counts as touching. */
CRT_FN f32 crt_box(CRT_GLOBAL const f32 *lower, CRT_GLOBAL const f32 *upper, CrtRay ray, CrtSlab slab,
                   f32 limit) {
    f32 enter = 0.0f;
    f32 leave = limit;
    const f32 tx0 = ((slab.near_x ? upper[0] : lower[0]) - V3X(ray.o)) * V3X(slab.inverse);
    const f32 tx1 = ((slab.near_x ? lower[0] : upper[0]) - V3X(ray.o)) * V3X(slab.inverse);
    const f32 ty0 = ((slab.near_y != 2u ? upper[1] : lower[1]) - V3Y(ray.o)) * V3Y(slab.inverse);
    const f32 ty1 = ((slab.near_y != 2u ? lower[1] : upper[1]) - V3Y(ray.o)) * V3Y(slab.inverse);
    const f32 tz0 = ((slab.near_z != 4u ? upper[2] : lower[2]) - V3Z(ray.o)) * V3Z(slab.inverse);
    const f32 tz1 = ((slab.near_z != 4u ? lower[2] : upper[2]) - V3Z(ray.o)) * V3Z(slab.inverse);
    enter = tx0 > enter ? tx0 : enter;
    enter = ty0 > enter ? ty0 : enter;
    enter = tz0 > enter ? tz0 : enter;
    leave = tx1 < leave ? tx1 : leave;
    leave = ty1 < leave ? ty1 : leave;
    leave = tz1 < leave ? tz1 : leave;
    return enter <= leave * CRT_SLAB_SLACK ? enter : CRT_INFINITY;
}

CRT_FN CrtHit crt_brute_force_closest(const CrtContext *ctx, CrtRay ray) {
    CRT_GLOBAL const CrtTriangle *triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    const CrtShear shear = crt_shear(ray);
    CrtHit best = crt_no_hit(ray.reach);
#if CRT_SIMD8
    CRT_GLOBAL const CrtTriangle8 *blocks = CRT_ARRAY(CrtTriangle8, ctx->blob, ctx->scene->triangles8);
    const u32 count = ctx->scene->triangles8.count;
    const f32 slack = crt_candidate_slack(ray.o);
    for (u32 b = 0u; b < count; ++b)
        for (u32 lanes = crt_candidates8(blocks + b, ray, slack, best.t); lanes != 0u; lanes &= lanes - 1u)
            crt_test_closest(triangles, blocks[b].slot[crt_lowest_bit(lanes)], shear, &best);
    if (CRT_HAS(SHAPES)) crt_last_slots_closest(ctx, ray, &best);
#else
    const u32 count = ctx->scene->triangle_count;
    for (u32 slot = 0u; slot < count; ++slot)
        if (CRT_HAS(SHAPES)) crt_test_slot(ctx, triangles, slot, ray, shear, &best);
        else crt_test_closest(triangles, slot, shear, &best);
#endif
    return best;
}

/* For a segment between two points of the scene: triangles that have the whole scene on one side cannot come
 * between, and are not asked. */
CRT_FN int crt_brute_force_any(const CrtContext *ctx, CrtRay ray) {
    CRT_GLOBAL const CrtTriangle *triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    CRT_GLOBAL const CrtTriangle8 *blocks = CRT_ARRAY(CrtTriangle8, ctx->blob, ctx->scene->occluders8);
    const u32 count = ctx->scene->occluders8.count;
    CrtHit hit;
#if CRT_SIMD8
    const f32 slack = crt_candidate_slack(ray.o);
    for (u32 b = 0u; b < count; ++b)
        for (u32 lanes = crt_candidates8(blocks + b, ray, slack, ray.reach); lanes != 0u;
             lanes &= lanes - 1u)
            if (crt_intersect_triangle(triangles + blocks[b].slot[crt_lowest_bit(lanes)], crt_shear(ray),
                                       ray.reach, &hit))
                return 1;
#else
    const CrtShear shear = crt_shear(ray);
    for (u32 b = 0u; b < count; ++b)
        for (u32 lane = 0u; lane < 8u && blocks[b].slot[lane] != CRT_NONE; ++lane)
            if (crt_intersect_triangle(triangles + blocks[b].slot[lane], shear, ray.reach, &hit)) return 1;
#endif
    if (CRT_HAS(SHAPES)) return crt_last_slots_any(ctx, ray);
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
            if (CRT_HAS(SHAPES)) crt_test_slot(ctx, triangles, objects[k].first + i, ray, shear, &best);
            else crt_test_closest(triangles, objects[k].first + i, shear, &best);
    }
    return best;
}

CRT_FN int crt_aabb_any(const CrtContext *ctx, CrtRay ray) {
    CRT_GLOBAL const CrtTriangle *triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    CRT_GLOBAL const CrtObject *objects = CRT_ARRAY(CrtObject, ctx->blob, ctx->scene->objects);
    const CrtShear shear = crt_shear(ray);
    const CrtSlab slab = crt_slab(ray);
    CrtHit hit;
    for (u32 k = 0u; k < ctx->scene->objects.count; ++k) {
        if (!(crt_box(objects[k].lower, objects[k].upper, ray, slab, ray.reach) < CRT_INFINITY)) continue;
        for (u32 i = 0u; i < objects[k].count; ++i)
            if (CRT_HAS(SHAPES)
                    ? crt_slot_stops(ctx, triangles, objects[k].first + i, ray, shear, &hit)
                    : crt_intersect_triangle(triangles + objects[k].first + i, shear, ray.reach, &hit))
                return 1;
    }
    return 0;
}

/* Entry distances into a node's four children; infinity where the ray misses. */
CRT_FN vec4 crt_node_distances(CRT_GLOBAL const CrtNode4 *node, CrtRay ray, CrtSlab slab, f32 limit) {
    const vec4 ox = splat4(V3X(ray.o)), oy = splat4(V3Y(ray.o)), oz = splat4(V3Z(ray.o));
    const vec4 ix = splat4(V3X(slab.inverse)), iy = splat4(V3Y(slab.inverse)),
               iz = splat4(V3Z(slab.inverse));
    CRT_GLOBAL const f32 *planes = &node->bounds[0][0];
    const vec4 enter = crt_max4((crt_load4(planes + 4u * slab.near_z) - oz) * iz,
                       crt_max4((crt_load4(planes + 4u * slab.near_y) - oy) * iy,
                       crt_max4((crt_load4(planes + 4u * slab.near_x) - ox) * ix, splat4(0.0f))));
    const vec4 leave =
        crt_min4(
            (crt_load4(planes + 4u * (slab.near_z ^ 1u)) - oz) * iz,
            crt_min4((crt_load4(planes + 4u * (slab.near_y ^ 1u)) - oy) * iy,
                     crt_min4((crt_load4(planes + 4u * (slab.near_x ^ 1u)) - ox) * ix, splat4(limit)))) *
        CRT_SLAB_SLACK;
    return make_vec4(V4X(enter) <= V4X(leave) ? V4X(enter) : CRT_INFINITY,
                     V4Y(enter) <= V4Y(leave) ? V4Y(enter) : CRT_INFINITY,
                     V4Z(enter) <= V4Z(leave) ? V4Z(enter) : CRT_INFINITY,
                     V4W(enter) <= V4W(leave) ? V4W(enter) : CRT_INFINITY);
}

#define CRT_SORT_CHILDREN(ta, ca, tb, cb) \
    if (tb < ta) {                        \
        const f32 t_swap = ta;            \
        const u32 c_swap = ca;            \
        ta = tb;                          \
        ca = cb;                          \
        tb = t_swap;                      \
        cb = c_swap;                      \
    }

/* Boxes let NaN in, so that none is lost that is touched; those of unused children too, which lead back to
   the root. A ray with a number that is none must not get there. */
CRT_FN int crt_is_ray(CrtRay ray) {
    const vec3 o = abs3(ray.o);
    const vec3 d = abs3(ray.d);
    return crt_is_finite((V3X(o) + V3Y(o) + V3Z(o)) + (V3X(d) + V3Y(d) + V3Z(d)));
}

CRT_FN CrtHit crt_bvh_closest(const CrtContext *ctx, CrtRay ray) {
    CRT_GLOBAL const CrtTriangle *triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    CRT_GLOBAL const CrtNode4 *nodes = CRT_ARRAY(CrtNode4, ctx->blob, ctx->scene->nodes);
    const CrtShear shear = crt_shear(ray);
    const CrtSlab slab = crt_slab(ray);
    CrtHit best = crt_no_hit(ray.reach);
    if (!crt_is_ray(ray)) return best;
    u32 stack[CRT_BVH_STACK];
    f32 entry[CRT_BVH_STACK];
    u32 size = 0u;
    u32 current = 0u; /* the root: node 0 */
    for (;;) {
        const u32 count = current & 15u;
        if (count == 0u) {
            CRT_GLOBAL const CrtNode4 *node = nodes + (current >> 4);
            const vec4 t = crt_node_distances(node, ray, slab, best.t);
            f32 t0 = V4X(t), t1 = V4Y(t), t2 = V4Z(t), t3 = V4W(t);
            u32 c0 = node->child[0], c1 = node->child[1], c2 = node->child[2], c3 = node->child[3];
            CRT_SORT_CHILDREN(t0, c0, t1, c1)
            CRT_SORT_CHILDREN(t2, c2, t3, c3)
            CRT_SORT_CHILDREN(t0, c0, t2, c2)
            CRT_SORT_CHILDREN(t1, c1, t3, c3)
            CRT_SORT_CHILDREN(t1, c1, t2, c2)
            if (t0 < CRT_INFINITY) {
                if (t3 < CRT_INFINITY) { stack[size] = c3; entry[size] = t3; ++size; }
                if (t2 < CRT_INFINITY) { stack[size] = c2; entry[size] = t2; ++size; }
                if (t1 < CRT_INFINITY) { stack[size] = c1; entry[size] = t1; ++size; }
                current = c0;
                continue;
            }
        } else {
            const u32 first = current >> 4;
            for (u32 i = 0u; i < count; ++i)
                if (CRT_HAS(SHAPES)) crt_test_slot(ctx, triangles, first + i, ray, shear, &best);
                else crt_test_closest(triangles, first + i, shear, &best);
        }
        /* A box that begins just behind the best hit may still hold a tie: the slack keeps it. */
        do {
            if (size == 0u) return best;
            --size;
        } while (entry[size] > best.t * CRT_SLAB_SLACK);
        current = stack[size];
    }
}

CRT_FN int crt_bvh_any(const CrtContext *ctx, CrtRay ray) {
    CRT_GLOBAL const CrtTriangle *triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    CRT_GLOBAL const CrtNode4 *nodes = CRT_ARRAY(CrtNode4, ctx->blob, ctx->scene->nodes);
    const CrtShear shear = crt_shear(ray);
    const CrtSlab slab = crt_slab(ray);
    CrtHit hit;
    if (!crt_is_ray(ray)) return 0;
    u32 stack[CRT_BVH_STACK];
    u32 size = 1u;
    stack[0] = 0u;
    while (size != 0u) {
        --size;
        const u32 current = stack[size];
        const u32 count = current & 15u;
        if (count == 0u) {
            CRT_GLOBAL const CrtNode4 *node = nodes + (current >> 4);
            const vec4 t = crt_node_distances(node, ray, slab, ray.reach);
            if (V4X(t) < CRT_INFINITY) { stack[size] = node->child[0]; ++size; }
            if (V4Y(t) < CRT_INFINITY) { stack[size] = node->child[1]; ++size; }
            if (V4Z(t) < CRT_INFINITY) { stack[size] = node->child[2]; ++size; }
            if (V4W(t) < CRT_INFINITY) { stack[size] = node->child[3]; ++size; }
        } else {
            const u32 first = current >> 4;
            for (u32 i = 0u; i < count; ++i)
                if (CRT_HAS(SHAPES) ? crt_slot_stops(ctx, triangles, first + i, ray, shear, &hit)
                                    : crt_intersect_triangle(triangles + first + i, shear, ray.reach, &hit))
                    return 1;
        }
    }
    return 0;
}

CRT_FN CrtHit crt_software_closest(const CrtContext *ctx, CrtRay ray) {
    if (CRT_HAS(BVH) && ctx->scene->accelerator == CRT_ACCELERATOR_BVH) return crt_bvh_closest(ctx, ray);
    if (CRT_HAS(AABB) && ctx->scene->accelerator == CRT_ACCELERATOR_AABB) return crt_aabb_closest(ctx, ray);
    if (CRT_HAS(BRUTE_FORCE)) return crt_brute_force_closest(ctx, ray);
    return crt_no_hit(ray.reach);
}

CRT_FN int crt_software_any(const CrtContext *ctx, CrtRay ray) {
    if (CRT_HAS(BVH) && ctx->scene->accelerator == CRT_ACCELERATOR_BVH) return crt_bvh_any(ctx, ray);
    if (CRT_HAS(AABB) && ctx->scene->accelerator == CRT_ACCELERATOR_AABB) return crt_aabb_any(ctx, ray);
    if (CRT_HAS(BRUTE_FORCE)) return crt_brute_force_any(ctx, ray);
    return 0;
}

/* The two hooks. A backend with a tracer of its own defines CRT_BACKEND_TRACE and both functions after
 * including path.h. */
#ifdef CRT_BACKEND_TRACE
CRT_FN CrtHit crt_trace_closest(const CrtContext *ctx, CrtRay ray);
CRT_FN int crt_trace_any(const CrtContext *ctx, CrtRay ray);
#else
CRT_FN CrtHit crt_trace_closest(const CrtContext *ctx, CrtRay ray) { return crt_software_closest(ctx, ray); }
CRT_FN int crt_trace_any(const CrtContext *ctx, CrtRay ray) { return crt_software_any(ctx, ray); }
#endif

CRT_KERNEL_END

#endif
