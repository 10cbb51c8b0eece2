/*
 * surface.h: hit → position with its error bound, normals, material; and where a new ray may start without meeting the surface that it leaves.
 */
#ifndef CRT_SURFACE_H
#define CRT_SURFACE_H

#include "bvh.h"

CRT_KERNEL_BEGIN

typedef struct CrtSurface {
    vec3 p;
    vec3 error;    /* how far, per axis, a ray must start from p to be sure of its side */
    vec3 ng;       /* unit geometric normal, by the order of the vertices */
    vec3 ns;       /* unit shading normal, on the side of ng */
    u32 material;
    u32 emitter;   /* CRT_NONE: none */
} CrtSurface;

CRT_FN vec3 crt_triangle_vertex(CRT_GLOBAL const CrtTriangle *triangle, u32 i) {
    return make_vec3(triangle->p[i], triangle->p[3u + i], triangle->p[6u + i]);
}

/* Rounding of the triangle test, relative to the triangle's edges, that an origin must be clear of: measured, with a margin of four
   (tests/unit_kernel_rays.cpp). */
#define CRT_TEST_ERROR CRT_GAMMA(16.0f)
/* A position this near to an edge, in barycentrics, could by rounding lie beyond the neighbour across the edge. */
#define CRT_EDGE_MARGIN 4e-6f
#define CRT_EDGE_MARGIN_MAX 0.125f

CRT_FN vec3 crt_splat3(f32 s) { return make_vec3(s, s, s); }
CRT_FN f32 crt_largest3(vec3 v) { return crt_max(V3X(v), crt_max(V3Y(v), V3Z(v))); }

CRT_FN CrtSurface crt_surface(const CrtContext *ctx, CrtHit hit) {
    CRT_GLOBAL const CrtTriangle *triangle = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles) + hit.slot;
    CRT_GLOBAL const CrtPrimitive *primitive = CRT_ARRAY(CrtPrimitive, ctx->blob, ctx->scene->primitives) + hit.id;
    const vec3 p0 = crt_triangle_vertex(triangle, 0u);
    const vec3 p1 = crt_triangle_vertex(triangle, 1u);
    const vec3 p2 = crt_triangle_vertex(triangle, 2u);
    const vec3 extent = abs3(p1 - p0) + abs3(p2 - p0);
    const vec3 normal = cross3(p1 - p0, p2 - p0);
    const f32 twice_area = length3(normal);

    /* A path that starts in a corner within rounding of the other wall might start behind it, and leave a closed room. Such a start is drawn in
       from the edge: by a few ulp of the position against the triangle's height, at least a few ulp of its size. */
    const f32 size = crt_largest3(extent);
    const f32 rounding = 16.0f * CRT_EPSILON * crt_largest3(abs3(p0) + extent) * size / twice_area;
    const f32 margin = crt_min(CRT_EDGE_MARGIN + rounding, CRT_EDGE_MARGIN_MAX);
    const f32 c0 = crt_max(1.0f - hit.b1 - hit.b2, margin);
    const f32 c1 = crt_max(hit.b1, margin);
    const f32 c2 = crt_max(hit.b2, margin);
    const f32 scale = 1.0f / (c0 + c1 + c2);
    const f32 b0 = c0 * scale;
    const f32 b1 = c1 * scale;
    const f32 b2 = c2 * scale;
    const vec3 q0 = p0 * b0;
    const vec3 q1 = p1 * b1;
    const vec3 q2 = p2 * b2;
    CrtSurface s;
    s.p = q0 + q1 + q2;
    /* Of the position: seven rounded operations a term (PBRT 4e, 6.8.5) and two for b0. Of the test that a new ray meets: it shears the triangle along the
       ray, so that its size in every axis counts in every axis. */
    s.error = (abs3(q0) + abs3(q1) + abs3(q2)) * CRT_GAMMA(9.0f) + crt_splat3(size * CRT_TEST_ERROR);
    s.ng = normal / twice_area;
    s.ns = s.ng;
    s.material = primitive->material;
    s.emitter = primitive->emitter;
    if (CRT_HAS(SMOOTH_NORMALS) && primitive->normals != CRT_NONE) {
        CRT_GLOBAL const CrtNormals *n = CRT_ARRAY(CrtNormals, ctx->blob, ctx->scene->normals) + primitive->normals;
        const vec3 ns = make_vec3(n->n[0] * b0 + n->n[1] * b1 + n->n[2] * b2,
                                  n->n[3] * b0 + n->n[4] * b1 + n->n[5] * b2,
                                  n->n[6] * b0 + n->n[7] * b1 + n->n[8] * b2);
        const f32 length = length3(ns);
        /* Opposite normals can cancel: then the geometric one stands. */
        if (length > 1e-6f) {
            s.ns = ns / length;
            if (dot3(s.ns, s.ng) < 0.0f) s.ns = -s.ns;
        }
    }
    return s;
}

CRT_FN f32 crt_step_out(f32 x, f32 offset) {
    const f32 moved = x + offset;
    if (offset > 0.0f) return crt_next_up(moved);
    if (offset < 0.0f) return crt_next_down(moved);
    return moved;
}

/* Origin of a ray leaving p on the side of direction w: moved along the normal out of the box of the error (PBRT 4e, 6.8.6). No absolute epsilon. */
CRT_FN vec3 crt_offset_origin(vec3 p, vec3 error, vec3 normal, vec3 w) {
    const f32 d = dot3(abs3(normal), error);
    vec3 offset = normal * d;
    if (dot3(w, normal) < 0.0f) offset = -offset;
    return make_vec3(crt_step_out(V3X(p), V3X(offset)), crt_step_out(V3Y(p), V3Y(offset)), crt_step_out(V3Z(p), V3Z(offset)));
}

CRT_KERNEL_END

#endif
