/*
 * surface.h: hit → position, normals, material; and where a new ray may start without meeting the surface
 * that it leaves.
 */
#ifndef CRT_SURFACE_H
#define CRT_SURFACE_H

#include "kernel/geometry/instances.h"
#include "kernel/geometry/shapes.h"

CRT_KERNEL_BEGIN

CRT_FN vec3 crt_triangle_vertex(CRT_GLOBAL const CrtTriangle *triangle, u32 i) {
    return make_vec3(triangle->p[i], triangle->p[3u + i], triangle->p[6u + i]);
}

/* A corner of a triangle, in the scene. `instance` is that of the hit. */
CRT_FN vec3 crt_corner(const CrtContext *ctx, CRT_GLOBAL const CrtTriangle *triangle, u32 instance, u32 i) {
    if (CRT_HAS(INSTANCES) && instance != 0u) {
        CRT_GLOBAL const f32 *m = crt_instance(ctx, instance - 1u)->to_world;
        const f32 x = triangle->p[i], y = triangle->p[3u + i], z = triangle->p[6u + i];
        return make_vec3(crt_place(m, x, y, z), crt_place(m + 4, x, y, z), crt_place(m + 8, x, y, z));
    }
    return crt_triangle_vertex(triangle, i);
}

/* Rounding of the triangle test, relative to the triangle's size, that an origin must be clear of. Measured
   (tests/unit_kernel_rays.cpp): with .35 of the whole clearance no path in seven million steps leaves a
   closed room or meets its own wall; with a quarter, some twenty do. */
#define CRT_TEST_ERROR CRT_GAMMA(16.0f)
/* A position nearer to an edge than this, in barycentrics, could by rounding lie beyond the neighbour across
 * the edge. */
#define CRT_EDGE_MARGIN 4e-6f
#define CRT_EDGE_MARGIN_MAX 0.125f

/* The distance off its plane at which a ray that leaves a triangle must start. The triangle has coordinates
   up to `coordinate` and edges up to `size`. A position is the sum of nine rounded operations a term (PBRT
   4e, 6.8.5, and two for b0); the test that the new ray meets shears the triangle along the ray, so that
   its size in every axis counts. √3: both are per axis. */
CRT_FN f32 crt_clearance(f32 coordinate, f32 size) {
    return 1.7320509f * (coordinate * CRT_GAMMA(9.0f) + size * CRT_TEST_ERROR);
}

/* A ray's origin o may be taken for the wrong side of a triangle's plane within γ(1)·coordinate +
   γ(8)·size, by the triangle test, and 4 · 2^-24 (|ox| + |oy| + |oz|), by rounding of its height: less
   than the clearance. Eight triangles at a time (intersect.h) compare CRT_HEIGHT_SCALE times the height with
   the slack of a ray, which is 64 · 2^-24 (1 + |ox| + |oy| + |oz|): this is what is left of the sum. */
CRT_FN f32 crt_height_slack(f32 coordinate, f32 size) {
    return CRT_HEIGHT_SCALE * (CRT_GAMMA(1.0f) * coordinate + CRT_GAMMA(8.0f) * size) - 64.0f * CRT_EPSILON;
}

/* The least distance from its edges, in barycentrics, at which a path may start on a triangle: a few ulp of
   the position against the triangle's height. A start in a corner within rounding of the other wall might
   lie behind that wall, and leave a closed room. */
CRT_FN f32 crt_edge_margin(f32 coordinate, f32 size, f32 twice_area) {
    const f32 rounding = 16.0f * CRT_EPSILON * (coordinate + size) * size;
    return rounding < CRT_EDGE_MARGIN_MAX * twice_area
               ? crt_min(CRT_EDGE_MARGIN + rounding / twice_area, CRT_EDGE_MARGIN_MAX)
               : CRT_EDGE_MARGIN_MAX;
}

/* Least share of the clearance of the whole disk: at its centre the position is not rounded. */
#define CRT_DISK_LEAST_CLEARANCE 1.5258789e-5f /* 2^-16 */

/* A vector in the frame of a shape. */
CRT_FN vec3 crt_in_frame(CRT_GLOBAL const CrtShape *shape, vec3 v) {
    return make_vec3(dot3(crt_load3(shape->x), v), dot3(crt_load3(shape->y), v),
                     dot3(crt_load3(shape->z), v));
}

/* Texture coordinates of the place q of a shape's frame. Around the axis u grows from 0 at x to 1; v from 0
   at a sphere's lower pole to 1 at the upper, however much of it is left; along a cylinder from end to end.
   On a disk they are those of the square around it. */
CRT_FN void crt_shape_uv(CRT_GLOBAL const CrtShape *shape, vec3 q, f32 *u, f32 *v) {
    const f32 x = V3X(q), y = V3Y(q), z = V3Z(q);
    if (shape->kind == CRT_SHAPE_DISK) {
        *u = crt_fma(x / shape->radius, 0.5f, 0.5f);
        *v = crt_fma(y / shape->radius, 0.5f, 0.5f);
        return;
    }
    const f32 turn = crt_atan2(y, x) * (0.5f * CRT_INV_PI);
    *u = turn < 0.0f ? turn + 1.0f : turn;
    *v = shape->kind == CRT_SHAPE_CYLINDER
             ? (z - shape->from_z) / (shape->to_z - shape->from_z)
             : crt_fma(crt_atan2(z, crt_sqrt(crt_fma(x, x, y * y))), CRT_INV_PI, 0.5f);
}

/* The derivatives of the place q by u and by v, in the scene's axes. */
CRT_FN void crt_shape_edges(CRT_GLOBAL const CrtShape *shape, vec3 q, vec3 *along_u, vec3 *along_v) {
    const vec3 ex = crt_load3(shape->x), ey = crt_load3(shape->y), ez = crt_load3(shape->z);
    const f32 x = V3X(q), y = V3Y(q), z = V3Z(q);
    const f32 r = crt_sqrt(crt_fma(x, x, y * y));
    *along_u = (ey * x - ex * y) * (2.0f * CRT_PI);
    *along_v = ez * (shape->to_z - shape->from_z);
    if (shape->kind == CRT_SHAPE_SPHERE && r > 0.0f)
        *along_v = (ez * r - (ex * x + ey * y) * (z / r)) * CRT_PI;
    if (shape->kind == CRT_SHAPE_DISK) {
        *along_u = ex * (2.0f * shape->radius);
        *along_v = ey * (2.0f * shape->radius);
    }
}

/* The distance along the normal at which a ray that leaves a disk at p must start; p is b1 x + b2 y from
   the centre, in the frame. It is at most `whole`, the crt_shape_clearance of the whole disk, and counts
   the rounding at p alone. Rounding in an axis moves the height over the plane by the normal's part in that
   axis. So rays leave a disk along two axes from a distance that depends on the precision of its height,
   not on its size. */
CRT_FN f32 crt_disk_clearance(CRT_GLOBAL const CrtShape *shape, vec3 p, f32 b1, f32 b2, f32 whole) {
    const vec3 summands = abs3(p) + abs3(crt_load3(shape->centre)) + abs3(crt_load3(shape->x) * b1) +
                          abs3(crt_load3(shape->y) * b2);
    return crt_min(whole, crt_fma(CRT_GAMMA(16.0f), dot3(abs3(crt_load3(shape->z)), summands),
                                  CRT_DISK_LEAST_CLEARANCE * whole));
}

/* crt_surface of a shape. Places near its edges are moved inwards, as on triangles: a place within rounding
   of an edge may lie behind the shape that begins there. */
CRT_FN CrtSurface crt_shape_surface(const CrtContext *ctx, CRT_GLOBAL const CrtShape *shape, CrtHit hit) {
    CRT_GLOBAL const CrtPrimitive *primitive =
        CRT_ARRAY(CrtPrimitive, ctx->blob, ctx->scene->primitives) + hit.id;
    CRT_GLOBAL const CrtFace *face = CRT_ARRAY(CrtFace, ctx->blob, ctx->scene->faces) + hit.slot;
    const vec3 ex = crt_load3(shape->x), ey = crt_load3(shape->y), ez = crt_load3(shape->z);
    const f32 radius = shape->radius, margin = face->margin;
    const f32 lowest = shape->from_z + margin, highest = shape->to_z - margin;
    vec3 centre = crt_load3(shape->centre);
    CrtSurface s;
    int on_lip = 0;
    s.clearance = face->clearance;
    if (shape->kind == CRT_SHAPE_DISK) {
        const f32 r = crt_sqrt(crt_fma(hit.b1, hit.b1, hit.b2 * hit.b2));
        on_lip = r > radius && shape->met_to > radius;
        const f32 inwards = r > radius - margin ? (radius - margin) / r : 1.0f;
        s.p = crt_fma3(ex, hit.b1 * inwards, crt_fma3(ey, hit.b2 * inwards, centre));
        s.ng = ez;
        s.clearance = crt_disk_clearance(shape, s.p, hit.b1 * inwards, hit.b2 * inwards, face->clearance);
    } else {
        if (shape->kind == CRT_SHAPE_CYLINDER) {
            const vec3 n = crt_direction_of_turn(hit.b1);
            s.ng = ex * V3X(n) + ey * V3Y(n);
            on_lip = hit.b2 < shape->from_z || hit.b2 > shape->to_z;
            centre = crt_fma3(ez, crt_clamp(hit.b2, lowest, highest), centre);
        } else {
            s.ng = crt_square_to_direction(hit.b1, hit.b2);
            const f32 z = dot3(s.ng, ez) * radius;
            on_lip = (z < shape->from_z && shape->met_from < shape->from_z) ||
                     (z > shape->to_z && shape->met_to > shape->to_z);
            if (z < lowest || z > highest) {
                const vec3 across = s.ng - ez * (z / radius);
                const f32 to = crt_clamp(z, lowest, highest) / radius;
                s.ng = across * (crt_sqrt(crt_max(0.0f, 1.0f - to * to)) / length3(across)) + ez * to;
            }
        }
        s.p = crt_fma3(s.ng, radius, centre);
    }
    s.ng = s.ng * shape->facing;
    s.ns = s.ng;
    s.material = primitive->material;
    s.light = on_lip ? CRT_NONE : primitive->light;
    if (CRT_HAS(ANISOTROPY)) s.slot = hit.slot;
    if (CRT_HAS(INSTANCES)) s.instance = 0u;
    if (CRT_HAS(TEXTURE) || CRT_HAS(ANISOTROPY)) s.at.id = hit.id;
    if (CRT_HAS(TEXTURE)) {
        s.at.b1 = s.at.b2 = 0.0f;
        crt_shape_uv(shape, crt_in_frame(shape, s.p - crt_load3(shape->centre)), &s.at.u, &s.at.v);
    }
    return s;
}

CRT_FN f32 crt_largest(vec3 v) { return crt_max(V3X(v), crt_max(V3Y(v), V3Z(v))); }

/* The plane of a triangle of an instance: the values that CrtFace holds for other triangles, by the same
   rules. */
CRT_FN CrtFace crt_placed_face(const CrtContext *ctx, CRT_GLOBAL const CrtTriangle *triangle, u32 instance) {
    const vec3 o = crt_corner(ctx, triangle, instance, 0u);
    const vec3 p = crt_corner(ctx, triangle, instance, 1u), q = crt_corner(ctx, triangle, instance, 2u);
    const vec3 a = p - o, b = q - o;
    const f32 coordinate =
        crt_max(crt_largest(abs3(o)), crt_max(crt_largest(abs3(p)), crt_largest(abs3(q))));
    const f32 size = crt_largest(abs3(a) + abs3(b));
    const vec3 n = cross3(a, b);
    const f32 twice_area = length3(n);
    const f32 scale =
        twice_area > 0.0f ? crt_instance(ctx, instance - 1u)->facing / twice_area : 0.0f;
    CrtFace face;
    face.normal[0] = V3X(n) * scale;
    face.normal[1] = V3Y(n) * scale;
    face.normal[2] = V3Z(n) * scale;
    face.clearance = crt_clearance(coordinate, size);
    face.margin = crt_edge_margin(coordinate, size, twice_area);
    return face;
}

/* The unit normal of a mesh at a corner, in the scene. */
CRT_FN vec3 crt_placed_normal(const CrtContext *ctx, u32 instance, vec3 n) {
    CRT_GLOBAL const f32 *m = crt_instance(ctx, instance - 1u)->to_mesh;
    const vec3 placed = make_vec3(crt_fma(m[0], V3X(n), crt_fma(m[4], V3Y(n), m[8] * V3Z(n))),
                                  crt_fma(m[1], V3X(n), crt_fma(m[5], V3Y(n), m[9] * V3Z(n))),
                                  crt_fma(m[2], V3X(n), crt_fma(m[6], V3Y(n), m[10] * V3Z(n))));
    return placed / length3(placed);
}

/* The place of barycentrics on the triangle of a primitive. */
CRT_FN CrtFacePlace crt_face_place(const CrtContext *ctx, u32 id, f32 b0, f32 b1, f32 b2) {
    CrtFacePlace at;
    at.id = id;
    at.b1 = b1;
    at.b2 = b2;
    at.u = at.v = 0.0f;
    if (ctx->scene->uvs.count != 0u) {
        CRT_GLOBAL const f32 *uv = CRT_ARRAY(CrtUvs, ctx->blob, ctx->scene->uvs)[id].uv;
        at.u = crt_fma(uv[0], b0, crt_fma(uv[1], b1, uv[2] * b2));
        at.v = crt_fma(uv[3], b0, crt_fma(uv[4], b1, uv[5] * b2));
    }
    return at;
}

CRT_HOT_FN CrtSurface crt_surface(const CrtContext *ctx, CrtHit hit) {
    CRT_GLOBAL const CrtTriangle *triangle =
        CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles) + hit.slot;
    if (CRT_HAS(SHAPES) && triangle->shape != 0u)
        return crt_shape_surface(ctx, crt_shape_of(ctx, triangle->shape - 1u), hit);
    /* A pointer, or each number chosen by itself, costs the full kernel 120 bytes of spilled registers. */
    CrtFace face;
    if (CRT_HAS(INSTANCES) && hit.instance != 0u) face = crt_placed_face(ctx, triangle, hit.instance);
    else face = CRT_ARRAY(CrtFace, ctx->blob, ctx->scene->faces)[hit.slot];
    const u32 id = crt_primitive_of(ctx, hit);
    CRT_GLOBAL const CrtPrimitive *primitive =
        CRT_ARRAY(CrtPrimitive, ctx->blob, ctx->scene->primitives) + id;
    f32 b0 = 1.0f - hit.b1 - hit.b2;
    f32 b1 = hit.b1;
    f32 b2 = hit.b2;
    if (crt_min(b0, crt_min(b1, b2)) < face.margin) { /* rare: drawn in from the edge */
        b0 = crt_max(b0, face.margin);
        b1 = crt_max(b1, face.margin);
        b2 = crt_max(b2, face.margin);
        const f32 scale = 1.0f / (b0 + b1 + b2);
        b0 *= scale;
        b1 *= scale;
        b2 *= scale;
    }
    CrtSurface s;
    s.p = crt_fma3(crt_corner(ctx, triangle, hit.instance, 0u), b0,
                   crt_fma3(crt_corner(ctx, triangle, hit.instance, 1u), b1,
                            crt_corner(ctx, triangle, hit.instance, 2u) * b2));
    s.ng = make_vec3(face.normal[0], face.normal[1], face.normal[2]);
    s.clearance = face.clearance;
    s.ns = s.ng;
    s.material = primitive->material;
    s.light = primitive->light;
    if (CRT_HAS(ANISOTROPY)) s.slot = hit.slot;
    if (CRT_HAS(INSTANCES)) s.instance = hit.instance;
    if (CRT_HAS(TEXTURE))
        s.at = crt_face_place(ctx, id, b0, b1, b2);
    else if (CRT_HAS(ANISOTROPY))
        s.at.id = id;
    if (CRT_HAS(SMOOTH_NORMALS) && primitive->normals != CRT_NONE) {
        CRT_GLOBAL const CrtNormals *n =
            CRT_ARRAY(CrtNormals, ctx->blob, ctx->scene->normals) + primitive->normals;
        vec3 ns = make_vec3(n->n[0] * b0 + n->n[1] * b1 + n->n[2] * b2,
                            n->n[3] * b0 + n->n[4] * b1 + n->n[5] * b2,
                            n->n[6] * b0 + n->n[7] * b1 + n->n[8] * b2);
        if (CRT_HAS(INSTANCES) && hit.instance != 0u)
            ns = crt_fma3(crt_placed_normal(ctx, hit.instance, make_vec3(n->n[0], n->n[3], n->n[6])), b0,
                 crt_fma3(crt_placed_normal(ctx, hit.instance, make_vec3(n->n[1], n->n[4], n->n[7])), b1,
                          crt_placed_normal(ctx, hit.instance, make_vec3(n->n[2], n->n[5], n->n[8])) * b2));
        const f32 length = length3(ns);
        /* Opposite normals can cancel: then the geometric one is used. */
        if (length > 1e-6f) {
            s.ns = ns / length;
            if (dot3(s.ns, s.ng) < 0.0f) s.ns = -s.ns;
        }
    }
    return s;
}

/* The derivatives by u and by v at a place p on a shape, in place of a triangle's edges. */
CRT_FN void crt_edges_of_shape(const CrtContext *ctx, CRT_GLOBAL const CrtTriangle *triangle, vec3 p,
                               vec3 *along_u, vec3 *along_v) {
    CRT_GLOBAL const CrtShape *shape = crt_shape_of(ctx, triangle->shape - 1u);
    crt_shape_edges(shape, crt_in_frame(shape, p - crt_load3(shape->centre)), along_u, along_v);
}

/* Origin of a ray leaving p on the side of direction w. No absolute epsilon: the clearance is the
 * triangle's. */
CRT_FN vec3 crt_offset_origin(vec3 p, f32 clearance, vec3 normal, vec3 w) {
    return crt_fma3(normal, dot3(w, normal) < 0.0f ? -clearance : clearance, p);
}

CRT_KERNEL_END

#endif
