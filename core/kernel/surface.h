/*
 * surface.h: hit → position with its error bound, normals, material; and where a new ray may start without meeting the surface that it leaves.
 */
#ifndef CRT_SURFACE_H
#define CRT_SURFACE_H

#include "bvh.h"

CRT_KERNEL_BEGIN

typedef struct CrtSurface {
    vec3 p;
    vec3 error;    /* bound on the error of p, per axis */
    vec3 ng;       /* unit geometric normal, by the order of the vertices */
    vec3 ns;       /* unit shading normal, on the side of ng */
    u32 material;
    u32 emitter;   /* CRT_NONE: none */
} CrtSurface;

CRT_FN vec3 crt_triangle_vertex(CRT_GLOBAL const CrtTriangle *triangle, u32 i) {
    return make_vec3(triangle->p[i], triangle->p[3u + i], triangle->p[6u + i]);
}

CRT_FN CrtSurface crt_surface(const CrtContext *ctx, CrtHit hit) {
    CRT_GLOBAL const CrtTriangle *triangle = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles) + hit.slot;
    CRT_GLOBAL const CrtPrimitive *primitive = CRT_ARRAY(CrtPrimitive, ctx->blob, ctx->scene->primitives) + hit.id;
    const vec3 p0 = crt_triangle_vertex(triangle, 0u);
    const vec3 p1 = crt_triangle_vertex(triangle, 1u);
    const vec3 p2 = crt_triangle_vertex(triangle, 2u);
    const f32 b0 = 1.0f - hit.b1 - hit.b2;
    const vec3 q0 = p0 * b0;
    const vec3 q1 = p1 * hit.b1;
    const vec3 q2 = p2 * hit.b2;
    CrtSurface s;
    s.p = q0 + q1 + q2;
    /* Seven rounded operations a term (PBRT 4e, 6.8.5), and two for b0. */
    s.error = (abs3(q0) + abs3(q1) + abs3(q2)) * CRT_GAMMA(9.0f);
    s.ng = normalize3(cross3(p1 - p0, p2 - p0));
    s.ns = s.ng;
    s.material = primitive->material;
    s.emitter = primitive->emitter;
    if (CRT_HAS(SMOOTH_NORMALS) && primitive->normals != CRT_NONE) {
        CRT_GLOBAL const CrtNormals *n = CRT_ARRAY(CrtNormals, ctx->blob, ctx->scene->normals) + primitive->normals;
        const vec3 ns = make_vec3(n->n[0] * b0 + n->n[1] * hit.b1 + n->n[2] * hit.b2,
                                  n->n[3] * b0 + n->n[4] * hit.b1 + n->n[5] * hit.b2,
                                  n->n[6] * b0 + n->n[7] * hit.b1 + n->n[8] * hit.b2);
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

/* Origin of a ray leaving p on the side of direction w: moved along the normal out of the box of p's error (PBRT 4e, 6.8.6). No absolute epsilon. */
CRT_FN vec3 crt_offset_origin(vec3 p, vec3 error, vec3 normal, vec3 w) {
    const f32 d = dot3(abs3(normal), error);
    vec3 offset = normal * d;
    if (dot3(w, normal) < 0.0f) offset = -offset;
    return make_vec3(crt_step_out(V3X(p), V3X(offset)), crt_step_out(V3Y(p), V3Y(offset)), crt_step_out(V3Z(p), V3Z(offset)));
}

CRT_KERNEL_END

#endif
