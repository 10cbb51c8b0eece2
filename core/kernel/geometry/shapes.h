/*
 * shapes.h: rays and the surfaces of the second order: spheres and parts of them, disks, cylinders. Like
 * intersect.h this decides hit, distance and place on every backend.
 *
 * The discriminant is that of the ray's nearest point to the centre, not b² − ac, and the root that
 * loses its digits comes from the product of both (Haines, Günther, Akenine-Möller 2019, "Precision
 * Improvements for Ray/Sphere Intersection"). A hit stores its place on the surface itself, not on the ray:
 * two numbers b1 and b2. The position is computed from these, so that it is off the surface by rounding
 * alone, however far the ray came.
 */
#ifndef CRT_SHAPES_H
#define CRT_SHAPES_H

#include "kernel/geometry/shadow_ray.h"

CRT_KERNEL_BEGIN

/* The distance along the normal at which a ray must start that leaves a shape, from a position with
   coordinates up to `coordinate`: 2 · 2^-24 · coordinate a component for the sums that make the position
   and the origin, and as much again where the ray is grazing. `size` is the radius, and the length along
   the axis where there is one: the position's direction from the centre errs by 2.5 · 2^-24, the
   difference to the centre that the next ray's test takes by 1, its square by 1.5, the discriminant by 3.5.
   √3: all are per axis. Measured: tests/unit_shapes.cpp. */
CRT_FN f32 crt_shape_clearance(f32 coordinate, f32 size) {
    return 1.7320509f * (coordinate * CRT_GAMMA(4.0f) + size * CRT_GAMMA(16.0f));
}

/* A direction as a point of the square −1 … 1, along the faces of an octahedron (Meyer et al. 2010, "On
   Floating-Point Normal Vectors"): error some 2^-24, everywhere alike. */
CRT_FN void crt_direction_to_square(vec3 d, f32 *u, f32 *v) {
    const f32 scale = 1.0f / (crt_abs(V3X(d)) + crt_abs(V3Y(d)) + crt_abs(V3Z(d)));
    const f32 x = V3X(d) * scale, y = V3Y(d) * scale;
    *u = x;
    *v = y;
    if (V3Z(d) < 0.0f) {
        *u = (1.0f - crt_abs(y)) * (x < 0.0f ? -1.0f : 1.0f);
        *v = (1.0f - crt_abs(x)) * (y < 0.0f ? -1.0f : 1.0f);
    }
}

CRT_FN vec3 crt_square_to_direction(f32 u, f32 v) {
    const f32 z = 1.0f - crt_abs(u) - crt_abs(v);
    if (z >= 0.0f) return normalize3(make_vec3(u, v, z));
    return normalize3(make_vec3((1.0f - crt_abs(v)) * (u < 0.0f ? -1.0f : 1.0f),
                                (1.0f - crt_abs(u)) * (v < 0.0f ? -1.0f : 1.0f), z));
}

/* A direction (x, y) as a number from −2 to 2, along the sides of a square on its corner. */
CRT_FN f32 crt_turn_of(f32 x, f32 y) {
    const f32 along = y / (crt_abs(x) + crt_abs(y));
    return x >= 0.0f ? along : (y >= 0.0f ? 2.0f - along : -2.0f - along);
}

/* The same, as a unit vector. */
CRT_FN vec3 crt_direction_of_turn(f32 turn) {
    const f32 size = crt_abs(turn);
    const f32 y = size <= 1.0f ? turn : (turn > 0.0f ? 2.0f - turn : -2.0f - turn);
    return normalize3(make_vec3(1.0f - size, y, 0.0f));
}

CRT_FN int crt_intersect_disk(CRT_GLOBAL const CrtShape *shape, vec3 f, vec3 d, f32 limit, CrtHit *hit) {
    const vec3 axis = crt_load3(shape->z);
    const f32 t = -dot3(axis, f) / dot3(axis, d);
    if (!(t > 0.0f) || !(t < limit)) return 0;
    const vec3 p = crt_fma3(d, t, f);
    const f32 x = dot3(crt_load3(shape->x), p), y = dot3(crt_load3(shape->y), p);
    if (!(crt_fma(x, x, y * y) <= shape->met_to * shape->met_to)) return 0;
    hit->t = t;
    hit->b1 = x;
    hit->b2 = y;
    return 1;
}

/* Does the ray hit the shape at 0 < t < limit? Fills t, b1, b2. Compilers for processors pass a ray in
   memory: calls take two fifths of a render whose rays test each of a few shapes. */
CRT_HOT_FN int crt_intersect_shape(CRT_GLOBAL const CrtShape *shape, CrtRay ray, f32 limit, CrtHit *hit) {
    const vec3 f = ray.o - crt_load3(shape->centre);
    if (shape->kind == CRT_SHAPE_DISK) return crt_intersect_disk(shape, f, ray.d, limit, hit);
    const vec3 axis = crt_load3(shape->z);
    const f32 radius = shape->radius;
    const int cylinder = shape->kind == CRT_SHAPE_CYLINDER;
    /* o + t·d, from the centre; of a cylinder as it is seen along the axis, in the frame. */
    vec3 o = f, d = ray.d;
    if (cylinder) {
        const vec3 x = crt_load3(shape->x), y = crt_load3(shape->y);
        o = make_vec3(dot3(x, f), dot3(y, f), 0.0f);
        d = make_vec3(dot3(x, ray.d), dot3(y, ray.d), 0.0f);
    }
    const f32 a = dot3(d, d), b = -dot3(o, d);
    const f32 c = crt_fma(-radius, radius, dot3(o, o));
    const vec3 nearest = crt_fma3(d, b / a, o);
    const f32 chord2 = crt_fma(radius, radius, -dot3(nearest, nearest));
    if (!(chord2 >= 0.0f)) return 0;
    const f32 chord = crt_sqrt(chord2 / a); /* half of it, in lengths of d */
    const f32 q = b < 0.0f ? crt_fma(-chord, a, b) : crt_fma(chord, a, b);
    const f32 enter = b < 0.0f ? q / a : c / q;
    const f32 leave = b < 0.0f ? c / q : q / a;
    for (u32 i = 0u; i < 2u; ++i) {
        const f32 t = i == 0u ? enter : leave;
        if (!(t > 0.0f) || !(t < limit)) continue;
        const vec3 p = crt_fma3(d, i == 0u ? -chord : chord, nearest);
        const f32 z = cylinder ? crt_fma(t, dot3(axis, ray.d), dot3(axis, f)) : dot3(axis, p);
        if (!(z >= shape->met_from) || !(z <= shape->met_to)) continue;
        hit->t = t;
        if (cylinder) {
            hit->b1 = crt_turn_of(V3X(p), V3Y(p));
            hit->b2 = z;
        } else {
            crt_direction_to_square(p, &hit->b1, &hit->b2);
        }
        return 1;
    }
    return 0;
}

CRT_FN CRT_GLOBAL const CrtShape *crt_shape_of(const CrtContext *ctx, u32 index) {
    return CRT_ARRAY(CrtShape, ctx->blob, ctx->scene->shapes) + index;
}

/* crt_test_closest of a shape. */
CRT_FN void crt_test_shape_closest(const CrtContext *ctx, CRT_GLOBAL const CrtTriangle *record, u32 slot,
                                   CrtRay ray, CrtHit *best) {
    CrtHit hit;
    if (!crt_intersect_shape(crt_shape_of(ctx, record->shape - 1u), ray, crt_tie_limit(best->t), &hit))
        return;
    crt_keep_nearer(hit.t, hit.b1, hit.b2, slot, record->id, 0u, best);
}

/* The shapes of a scene whose slots are in the order of ids. */
CRT_FN void crt_last_slots_closest(const CrtContext *ctx, CrtRay ray, CrtHit *best) {
    CRT_GLOBAL const CrtTriangle *triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    const u32 end = ctx->scene->triangle_count;
    for (u32 slot = end - ctx->scene->shapes.count; slot < end; ++slot)
        crt_test_shape_closest(ctx, triangles + slot, slot, ray, best);
}

/* Returns 1 if a shape stops a shadow ray. The ray may hit a sphere or a cylinder twice. */
CRT_FN int crt_shape_stops(const CrtContext *ctx, CRT_GLOBAL const CrtTriangle *record, u32 slot, CrtRay ray,
                           CrtPassable *passable) {
    CrtHit hit;
    if (!crt_intersect_shape(crt_shape_of(ctx, record->shape - 1u), ray, ray.reach, &hit)) return 0;
    hit.slot = slot;
    hit.id = record->id;
    hit.instance = 0u;
    return crt_stops(ctx, hit, 2u, passable);
}

CRT_FN int crt_last_slots_any(const CrtContext *ctx, CrtRay ray, CrtPassable *passable) {
    CRT_GLOBAL const CrtTriangle *triangles = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles);
    CrtHit hit;
    if (!crt_has_panes(ctx)) {
        for (u32 i = 0u; i < ctx->scene->shapes.count; ++i)
            if (crt_intersect_shape(crt_shape_of(ctx, i), ray, ray.reach, &hit)) return 1;
        return 0;
    }
    const u32 end = ctx->scene->triangle_count;
    for (u32 slot = end - ctx->scene->shapes.count; slot < end; ++slot)
        if (crt_shape_stops(ctx, triangles + slot, slot, ray, passable)) return 1;
    return 0;
}

CRT_KERNEL_END

#endif
