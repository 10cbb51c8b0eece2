/*
 * boxes.h: rays and boxes aligned with the axes, which cull, conservatively.
 */
#ifndef CRT_BOXES_H
#define CRT_BOXES_H

#include "intersect.h"

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

/* Entry distances into a node's four children; infinity where the ray misses. The planes that it meets
   first are asked from `from`, the others from `to`: the ray's origin, both, or apart by what boxes are to
   be larger on each side. */
CRT_FN vec4 crt_node_distances(CRT_GLOBAL const CrtNode4 *node, vec3 from, vec3 to, CrtSlab slab,
                               f32 limit) {
    const vec4 ox = splat4(V3X(from)), oy = splat4(V3Y(from)), oz = splat4(V3Z(from));
    const vec4 px = splat4(V3X(to)), py = splat4(V3Y(to)), pz = splat4(V3Z(to));
    const vec4 ix = splat4(V3X(slab.inverse)), iy = splat4(V3Y(slab.inverse)),
               iz = splat4(V3Z(slab.inverse));
    CRT_GLOBAL const f32 *planes = &node->bounds[0][0];
    const vec4 enter = crt_max4((crt_load4(planes + 4u * slab.near_z) - oz) * iz,
                       crt_max4((crt_load4(planes + 4u * slab.near_y) - oy) * iy,
                       crt_max4((crt_load4(planes + 4u * slab.near_x) - ox) * ix, splat4(0.0f))));
    const vec4 leave =
        crt_min4(
            (crt_load4(planes + 4u * (slab.near_z ^ 1u)) - pz) * iz,
            crt_min4((crt_load4(planes + 4u * (slab.near_y ^ 1u)) - py) * iy,
                     crt_min4((crt_load4(planes + 4u * (slab.near_x ^ 1u)) - px) * ix, splat4(limit)))) *
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

/* Of the children that a ray enters at t the nearest becomes `current`; the others go onto the stack, the
   farthest first. 0: it enters none. */
CRT_FN int crt_enter_nearest(CRT_GLOBAL const CrtNode4 *node, vec4 t, u32 *stack, f32 *entry, u32 *size,
                             u32 *current) {
    f32 t0 = V4X(t), t1 = V4Y(t), t2 = V4Z(t), t3 = V4W(t);
    u32 c0 = node->child[0], c1 = node->child[1], c2 = node->child[2], c3 = node->child[3];
    CRT_SORT_CHILDREN(t0, c0, t1, c1)
    CRT_SORT_CHILDREN(t2, c2, t3, c3)
    CRT_SORT_CHILDREN(t0, c0, t2, c2)
    CRT_SORT_CHILDREN(t1, c1, t3, c3)
    CRT_SORT_CHILDREN(t1, c1, t2, c2)
    if (!(t0 < CRT_INFINITY)) return 0;
    if (t3 < CRT_INFINITY) { stack[*size] = c3; entry[*size] = t3; ++*size; }
    if (t2 < CRT_INFINITY) { stack[*size] = c2; entry[*size] = t2; ++*size; }
    if (t1 < CRT_INFINITY) { stack[*size] = c1; entry[*size] = t1; ++*size; }
    *current = c0;
    return 1;
}

/* All children that a ray enters at t go onto the stack, in any order. Returns its size. */
CRT_FN u32 crt_enter_all(CRT_GLOBAL const CrtNode4 *node, vec4 t, u32 *stack, u32 size) {
    if (V4X(t) < CRT_INFINITY) { stack[size] = node->child[0]; ++size; }
    if (V4Y(t) < CRT_INFINITY) { stack[size] = node->child[1]; ++size; }
    if (V4Z(t) < CRT_INFINITY) { stack[size] = node->child[2]; ++size; }
    if (V4W(t) < CRT_INFINITY) { stack[size] = node->child[3]; ++size; }
    return size;
}

/* Boxes let NaN in, so that none is lost that is touched; those of unused children too, which lead back to
   the root. A ray with a number that is none must not get there. */
CRT_FN int crt_is_ray(CrtRay ray) {
    const vec3 o = abs3(ray.o);
    const vec3 d = abs3(ray.d);
    return crt_is_finite((V3X(o) + V3Y(o) + V3Z(o)) + (V3X(d) + V3Y(d) + V3Z(d)));
}

CRT_KERNEL_END

#endif
