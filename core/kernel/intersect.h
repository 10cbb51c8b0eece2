/*
 * intersect.h: the one ray–triangle test that decides hit, distance and barycentrics on every backend. Whatever finds candidates (BVH, Embree, eight
 * at a time) may be sloppy as long as it misses none; this has the last word.
 *
 * Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection", with the edge functions as Kahan differences of products: their sign is exact,
 * so the two triangles at an edge agree without a fallback to double.
 */
#ifndef CRT_INTERSECT_H
#define CRT_INTERSECT_H

#include "camera.h"

CRT_KERNEL_BEGIN

typedef struct CrtHit {
    f32 t;       /* in lengths of the ray's direction */
    f32 b1, b2;  /* barycentrics of the second and third vertex */
    u32 slot;    /* in the triangle array; CRT_NONE: nothing hit */
    u32 id;      /* primitive id */
} CrtHit;

/* The ray in the triangle test's coordinates: axis kz is where the direction is largest. */
typedef struct CrtShear {
    u32 kx, ky, kz;
    f32 ox, oy, oz; /* origin, permuted */
    f32 sx, sy, sz;
} CrtShear;

CRT_FN CrtShear crt_shear(CrtRay ray) {
    CrtShear s;
    const f32 ax = crt_abs(V3X(ray.d));
    const f32 ay = crt_abs(V3Y(ray.d));
    const f32 az = crt_abs(V3Z(ray.d));
    f32 dx, dy, dz;
    if (ax > ay && ax > az) {
        s.kx = 1u; s.ky = 2u; s.kz = 0u;
        dx = V3Y(ray.d); dy = V3Z(ray.d); dz = V3X(ray.d);
        s.ox = V3Y(ray.o); s.oy = V3Z(ray.o); s.oz = V3X(ray.o);
    } else if (ay > az) {
        s.kx = 2u; s.ky = 0u; s.kz = 1u;
        dx = V3Z(ray.d); dy = V3X(ray.d); dz = V3Y(ray.d);
        s.ox = V3Z(ray.o); s.oy = V3X(ray.o); s.oz = V3Y(ray.o);
    } else {
        s.kx = 0u; s.ky = 1u; s.kz = 2u;
        dx = V3X(ray.d); dy = V3Y(ray.d); dz = V3Z(ray.d);
        s.ox = V3X(ray.o); s.oy = V3Y(ray.o); s.oz = V3Z(ray.o);
    }
    s.sz = 1.0f / dz;
    s.sx = dx * s.sz;
    s.sy = dy * s.sz;
    return s;
}

/* Does the ray hit the triangle at 0 < t < limit? Fills t, b1, b2. There is no least t: a ray starts far enough off its surface (surface.h) that
   the sign of t is right, and whatever is really in front, however near, must stop it, or light leaks through corners. */
CRT_FN int crt_intersect_triangle(CRT_GLOBAL const CrtTriangle *triangle, CrtShear ray, f32 limit, CrtHit *hit) {
    CRT_GLOBAL const f32 *px = triangle->p + 3u * ray.kx;
    CRT_GLOBAL const f32 *py = triangle->p + 3u * ray.ky;
    CRT_GLOBAL const f32 *pz = triangle->p + 3u * ray.kz;
    const f32 az = pz[0] - ray.oz;
    const f32 bz = pz[1] - ray.oz;
    const f32 cz = pz[2] - ray.oz;
    const f32 ax = (px[0] - ray.ox) - ray.sx * az;
    const f32 bx = (px[1] - ray.ox) - ray.sx * bz;
    const f32 cx = (px[2] - ray.ox) - ray.sx * cz;
    const f32 ay = (py[0] - ray.oy) - ray.sy * az;
    const f32 by = (py[1] - ray.oy) - ray.sy * bz;
    const f32 cy = (py[2] - ray.oy) - ray.sy * cz;
    const f32 u = crt_difference_of_products(cx, by, cy, bx);
    const f32 v = crt_difference_of_products(ax, cy, ay, cx);
    const f32 w = crt_difference_of_products(bx, ay, by, ax);
    if ((u < 0.0f || v < 0.0f || w < 0.0f) && (u > 0.0f || v > 0.0f || w > 0.0f)) return 0;
    const f32 det = u + v + w;
    if (det == 0.0f) return 0;
    const f32 inverse_det = 1.0f / det;
    const f32 sa = ray.sz * az;
    const f32 sb = ray.sz * bz;
    const f32 sc = ray.sz * cz;
    const f32 t = (u * sa + v * sb + w * sc) * inverse_det;
    if (!(t > 0.0f) || !(t < limit)) return 0;

    hit->t = t;
    hit->b1 = v * inverse_det;
    hit->b2 = w * inverse_det;
    return 1;
}

/* One ulp beyond the best hit, so that ties reach the comparison of ids. */
CRT_FN f32 crt_tie_limit(f32 t) { return t < CRT_INFINITY ? crt_next_up(t) : CRT_INFINITY; }

/* Tests one slot against the best hit so far; the nearer wins, and of equally near ones the lower primitive id, so the order of testing does not show. */
CRT_FN void crt_test_closest(CRT_GLOBAL const CrtTriangle *triangles, u32 slot, CrtShear shear, CrtHit *best) {
    CrtHit hit;
    if (!crt_intersect_triangle(triangles + slot, shear, crt_tie_limit(best->t), &hit)) return;
    const u32 id = triangles[slot].id;
    if (hit.t < best->t || id < best->id) {
        best->t = hit.t;
        best->b1 = hit.b1;
        best->b2 = hit.b2;
        best->slot = slot;
        best->id = id;
    }
}

CRT_FN CrtHit crt_no_hit(f32 reach) {
    CrtHit hit;
    hit.t = reach;
    hit.b1 = hit.b2 = 0.0f;
    hit.slot = CRT_NONE;
    hit.id = CRT_NONE;
    return hit;
}

#if CRT_SIMD8
/* Lanes of eight triangles that the ray may hit at 0 < t < limit: the arithmetic of crt_intersect_triangle, lane by lane, so it finds
   just those that the scalar test accepts. */
CRT_FN u32 crt_candidates8(CRT_GLOBAL const CrtTriangle8 *block, CrtShear ray, f32 limit) {
    CRT_GLOBAL const f32 *px = &block->p[3u * ray.kx][0];
    CRT_GLOBAL const f32 *py = &block->p[3u * ray.ky][0];
    CRT_GLOBAL const f32 *pz = &block->p[3u * ray.kz][0];
    const vec8 az = crt_load8(pz) - splat8(ray.oz);
    const vec8 bz = crt_load8(pz + 8) - splat8(ray.oz);
    const vec8 cz = crt_load8(pz + 16) - splat8(ray.oz);
    const vec8 sx = splat8(ray.sx);
    const vec8 sy = splat8(ray.sy);
    const vec8 ax = (crt_load8(px) - splat8(ray.ox)) - sx * az;
    const vec8 bx = (crt_load8(px + 8) - splat8(ray.ox)) - sx * bz;
    const vec8 cx = (crt_load8(px + 16) - splat8(ray.ox)) - sx * cz;
    const vec8 ay = (crt_load8(py) - splat8(ray.oy)) - sy * az;
    const vec8 by = (crt_load8(py + 8) - splat8(ray.oy)) - sy * bz;
    const vec8 cy = (crt_load8(py + 16) - splat8(ray.oy)) - sy * cz;
    const vec8 u1 = cy * bx, v1 = ay * cx, w1 = by * ax;
    const vec8 u = crt_fma8(cx, by, -u1) + crt_fma8(-cy, bx, u1);
    const vec8 v = crt_fma8(ax, cy, -v1) + crt_fma8(-ay, cx, v1);
    const vec8 w = crt_fma8(bx, ay, -w1) + crt_fma8(-by, ax, w1);
    const vec8 zero = splat8(0.0f);
    const mask8 outside = ((u < zero) | (v < zero) | (w < zero)) & ((u > zero) | (v > zero) | (w > zero));
    const vec8 det = u + v + w;
    const vec8 sz = splat8(ray.sz);
    const vec8 t = (u * (sz * az) + v * (sz * bz) + w * (sz * cz)) * (splat8(1.0f) / det);
    /* A zero determinant makes t NaN or infinite, which fails both comparisons. */
    const mask8 inside = ~outside & (t > zero) & (t < splat8(limit));
    return mask8_bits(inside);
}
#endif

CRT_KERNEL_END

#endif
