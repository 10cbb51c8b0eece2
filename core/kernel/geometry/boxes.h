/*
 * boxes.h: rays and boxes aligned with the axes, which cull, conservatively.
 */
#ifndef CRT_BOXES_H
#define CRT_BOXES_H

#include "kernel/geometry/ray.h"

CRT_KERNEL_BEGIN

#define CRT_BVH_STACK 96 /* three entries a level; bvh_build.cpp keeps the tree below 32 levels */

/* Per axis: the plane of a box's two that a ray meets first, by the sign bit, which differs between −0 and
   +0; and 1/d, infinite where d is zero. */
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

/* A ray for the tests of a tree's nodes: 1/d and, for near and far planes, the terms that turn a plane's
   coordinate into its distance along the ray. */
typedef struct CrtNodeRay {
    u32 near_x, near_y, near_z; /* as of CrtSlab; the signs of 1/d, too, tell them */
    vec3 inverse, near, far;
} CrtNodeRay;

#define CRT_LEAST_NORMAL 1.17549435e-38f

/* 1/d. A component below 2^-126, which could give NaN, counts as 2^-126. */
CRT_FN f32 crt_node_inverse(f32 d) {
    const f32 least = (crt_bits(d) >> 31) != 0u ? -CRT_LEAST_NORMAL : CRT_LEAST_NORMAL;
    return crt_fast_reciprocal(crt_abs(d) < CRT_LEAST_NORMAL ? least : d);
}

/* The length by which planes must be apart along one axis, `slack` included, so that rounding misses none:
   planes lie within 1; 1/d moves a coordinate by (1 + |o|) 2^-23 at most, and the sum, its product and the
   fused operation by (1 + |o|) 2^-24 each. */
CRT_FN f32 crt_node_slack(f32 o, f32 slack) {
    return crt_fma(6.0f * CRT_EPSILON, 1.0f + crt_abs(o), slack);
}

/* `slack`: the length by which boxes grow on every side. */
CRT_FN CrtNodeRay crt_node_ray(CrtRay ray, f32 slack) {
    CrtNodeRay r;
    const u32 sx = crt_bits(V3X(ray.d)) >> 31, sy = crt_bits(V3Y(ray.d)) >> 31,
              sz = crt_bits(V3Z(ray.d)) >> 31;
    r.near_x = sx;
    r.near_y = 2u + sy;
    r.near_z = 4u + sz;
    r.inverse = make_vec3(crt_node_inverse(V3X(ray.d)), crt_node_inverse(V3Y(ray.d)),
                          crt_node_inverse(V3Z(ray.d)));
    const f32 x = crt_node_slack(V3X(ray.o), slack), y = crt_node_slack(V3Y(ray.o), slack),
              z = crt_node_slack(V3Z(ray.o), slack);
    const vec3 way = make_vec3(sx != 0u ? -x : x, sy != 0u ? -y : y, sz != 0u ? -z : z);
    r.near = -((ray.o + way) * r.inverse);
    r.far = -((ray.o - way) * r.inverse);
    return r;
}

/* Entry distances into a node's four children; infinity where the ray misses. Boxes that begin beyond
   `limit` by more than rounding are missed. */
CRT_HOT_FN vec4 crt_node_distances(CRT_GLOBAL const CrtNode4 *node, CrtNodeRay ray, f32 limit) {
    CRT_GLOBAL const f32 *planes = &node->bounds[0][0];
#if CRT_SIMD8
    const u32 near_x = ray.near_x, near_y = ray.near_y, near_z = ray.near_z;
#else /* a GPU has no registers to keep them in */
    const u32 near_x = crt_bits(V3X(ray.inverse)) >> 31, near_y = 2u + (crt_bits(V3Y(ray.inverse)) >> 31),
              near_z = 4u + (crt_bits(V3Z(ray.inverse)) >> 31);
#endif
    const vec4 ix = splat4(V3X(ray.inverse)), iy = splat4(V3Y(ray.inverse)), iz = splat4(V3Z(ray.inverse));
    const vec4 enter = crt_cull_max4(
        crt_fma4(crt_load4(planes + 4u * near_z), iz, splat4(V3Z(ray.near))),
        crt_cull_max4(crt_fma4(crt_load4(planes + 4u * near_y), iy, splat4(V3Y(ray.near))),
                      crt_cull_max4(crt_fma4(crt_load4(planes + 4u * near_x), ix, splat4(V3X(ray.near))),
                                    splat4(0.0f))));
    const vec4 leave = crt_cull_min4(
        crt_fma4(crt_load4(planes + 4u * (near_z ^ 1u)), iz, splat4(V3Z(ray.far))),
        crt_cull_min4(
            crt_fma4(crt_load4(planes + 4u * (near_y ^ 1u)), iy, splat4(V3Y(ray.far))),
            crt_cull_min4(crt_fma4(crt_load4(planes + 4u * (near_x ^ 1u)), ix, splat4(V3X(ray.far))),
                          splat4(limit * CRT_SLAB_SLACK))));
    return make_vec4(V4X(enter) <= V4X(leave) ? V4X(enter) : CRT_INFINITY,
                     V4Y(enter) <= V4Y(leave) ? V4Y(enter) : CRT_INFINITY,
                     V4Z(enter) <= V4Z(leave) ? V4Z(enter) : CRT_INFINITY,
                     V4W(enter) <= V4W(leave) ? V4W(enter) : CRT_INFINITY);
}

/* A child that is left to visit, and the distance at which the ray enters it. */
#define CRT_STACKED(child, t) (((u64)(child) << 32) | (u64)crt_bits(t))
#define CRT_STACKED_CHILD(entry) ((u32)((entry) >> 32))
#define CRT_STACKED_ENTRY(entry) crt_from_bits((u32)(entry))

#define CRT_SORT_CHILDREN(ta, ca, tb, cb) \
    if (tb < ta) {                        \
        const f32 t_swap = ta;            \
        const u32 c_swap = ca;            \
        ta = tb;                          \
        ca = cb;                          \
        tb = t_swap;                      \
        cb = c_swap;                      \
    }

/* Of the children that a ray enters at t the nearest becomes `current`; the others go onto the stack, the
   farthest first. 0: it enters none. */
CRT_HOT_FN int crt_enter_nearest(CRT_GLOBAL const CrtNode4 *node, vec4 t, u64 *stack, u32 *size,
                                 u32 *current) {
    f32 t0 = V4X(t), t1 = V4Y(t), t2 = V4Z(t), t3 = V4W(t);
    const vec4 child = crt_load4((CRT_GLOBAL const f32 *)node->child); /* in one wide load */
    u32 c0 = crt_bits(V4X(child)), c1 = crt_bits(V4Y(child)), c2 = crt_bits(V4Z(child)),
        c3 = crt_bits(V4W(child));
    CRT_SORT_CHILDREN(t0, c0, t1, c1)
    CRT_SORT_CHILDREN(t2, c2, t3, c3)
    CRT_SORT_CHILDREN(t0, c0, t2, c2)
    CRT_SORT_CHILDREN(t1, c1, t3, c3)
    CRT_SORT_CHILDREN(t1, c1, t2, c2)
    if (!(t0 < CRT_INFINITY)) return 0;
    if (t3 < CRT_INFINITY) { stack[*size] = CRT_STACKED(c3, t3); ++*size; }
    if (t2 < CRT_INFINITY) { stack[*size] = CRT_STACKED(c2, t2); ++*size; }
    if (t1 < CRT_INFINITY) { stack[*size] = CRT_STACKED(c1, t1); ++*size; }
    *current = c0;
    return 1;
}

/* The next from the stack that may hold a hit at most as far as t: a box that begins just behind the best
   hit may still hold a tie, and the slack keeps it. 0: there is none. */
CRT_HOT_FN int crt_next_stacked(const u64 *stack, u32 *size, f32 t, u32 *current) {
    const f32 limit = t * CRT_SLAB_SLACK;
    while (*size != 0u) {
        --*size;
        const u64 next = stack[*size];
        if (CRT_STACKED_ENTRY(next) > limit) continue;
        *current = CRT_STACKED_CHILD(next);
        return 1;
    }
    return 0;
}

/* One of the children that a ray enters at t becomes `current`; the others go onto the stack, in any order.
   0: it enters none. */
CRT_HOT_FN int crt_enter_any(CRT_GLOBAL const CrtNode4 *node, vec4 t, u32 *stack, u32 *size, u32 *current) {
    const vec4 child = crt_load4((CRT_GLOBAL const f32 *)node->child); /* in one wide load */
    u32 next = CRT_NONE;
    if (V4X(t) < CRT_INFINITY) next = crt_bits(V4X(child));
#define CRT_ENTER_ANY(LANE)           \
    if (LANE(t) < CRT_INFINITY) {     \
        if (next != CRT_NONE) {       \
            stack[*size] = next;      \
            ++*size;                  \
        }                             \
        next = crt_bits(LANE(child)); \
    }
    CRT_ENTER_ANY(V4Y)
    CRT_ENTER_ANY(V4Z)
    CRT_ENTER_ANY(V4W)
#undef CRT_ENTER_ANY
    if (next == CRT_NONE) return 0;
    *current = next;
    return 1;
}

/* Tests of boxes accept NaN, so that they lose no box that is touched. They would accept unused children
   too, which lead back to the root. So a ray with a NaN must not enter the tree. */
CRT_FN int crt_is_ray(CrtRay ray) {
    const vec3 o = abs3(ray.o);
    const vec3 d = abs3(ray.d);
    return crt_is_finite((V3X(o) + V3Y(o) + V3Z(o)) + (V3X(d) + V3Y(d) + V3Z(d)));
}

CRT_KERNEL_END

#endif
