/*
 * intersect.h: the one ray–triangle test that decides hit, distance and barycentrics on every backend.
 * The search for candidates (BVH, eight at a time) may find too many but must not miss any; this test
 * decides.
 *
 * Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection", with the edge functions as Kahan
 * differences of products: their sign is exact, so the two triangles at an edge agree without a fallback to
 * double.
 */
#ifndef CRT_INTERSECT_H
#define CRT_INTERSECT_H

#include "kernel/geometry/hit.h"
#include "kernel/geometry/ray.h"

CRT_KERNEL_BEGIN

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

/* Around boxes, in lengths after normalisation (coordinates within ±1): the triangle test accepts hits
   whose offset from the ray is rounding, a few 2^-24; tests that cull must keep every triangle that it
   would accept. */
#define CRT_BOX_PADDING 5e-7f

/* Does the ray hit the triangle at 0 < t < limit? Fills t, b1, b2. There is no least t: a ray starts far
   enough off its surface (surface.h) that the sign of t is right, and whatever is really in front, however
   near, must stop it, or light leaks through corners. px: the coordinates of the three corners along axis kx
   of the ray. */
CRT_HOT_FN int crt_intersect_corners(vec3 px, vec3 py, vec3 pz, CrtShear ray, f32 limit, CrtHit *hit) {
    const f32 az = V3X(pz) - ray.oz;
    const f32 bz = V3Y(pz) - ray.oz;
    const f32 cz = V3Z(pz) - ray.oz;
    const f32 ax = crt_fma(-ray.sx, az, V3X(px) - ray.ox);
    const f32 bx = crt_fma(-ray.sx, bz, V3Y(px) - ray.ox);
    const f32 cx = crt_fma(-ray.sx, cz, V3Z(px) - ray.ox);
    const f32 ay = crt_fma(-ray.sy, az, V3X(py) - ray.oy);
    const f32 by = crt_fma(-ray.sy, bz, V3Y(py) - ray.oy);
    const f32 cy = crt_fma(-ray.sy, cz, V3Z(py) - ray.oy);
    const f32 u = crt_difference_of_products(cx, by, cy, bx);
    const f32 v = crt_difference_of_products(ax, cy, ay, cx);
    const f32 w = crt_difference_of_products(bx, ay, by, ax);
    if ((u < 0.0f || v < 0.0f || w < 0.0f) && (u > 0.0f || v > 0.0f || w > 0.0f)) return 0;
    const f32 det = u + v + w;
    if (det == 0.0f) return 0;
    const f32 inverse_det = 1.0f / det;
    const f32 t = crt_fma(u, az, crt_fma(v, bz, w * cz)) * ray.sz * inverse_det;
    if (!(t > 0.0f) || !(t < limit)) return 0;

    hit->t = t;
    hit->b1 = v * inverse_det;
    hit->b2 = w * inverse_det;
    return 1;
}

CRT_FN f32 crt_choose(u32 k, f32 a, f32 b, f32 c) { return k == 0u ? a : k == 1u ? b : c; }
CRT_FN vec3 crt_choose3(u32 k, vec3 a, vec3 b, vec3 c) {
    return make_vec3(crt_choose(k, V3X(a), V3X(b), V3X(c)), crt_choose(k, V3Y(a), V3Y(b), V3Y(c)),
                     crt_choose(k, V3Z(a), V3Z(b), V3Z(c)));
}

CRT_HOT_FN int crt_intersect_triangle(CRT_GLOBAL const CrtTriangle *triangle, CrtShear ray, f32 limit,
                                      CrtHit *hit) {
#if CRT_SIMD8
    CRT_GLOBAL const f32 *px = triangle->p + 3u * ray.kx;
    CRT_GLOBAL const f32 *py = triangle->p + 3u * ray.ky;
    CRT_GLOBAL const f32 *pz = triangle->p + 3u * ray.kz;
    return crt_intersect_corners(make_vec3(px[0], px[1], px[2]), make_vec3(py[0], py[1], py[2]),
                                 make_vec3(pz[0], pz[1], pz[2]), ray, limit, hit);
#else
    /* In three wide loads, since each lane reads from elsewhere. */
    const vec4 a = crt_load4(triangle->p), b = crt_load4(triangle->p + 4);
    const vec3 x = make_vec3(V4X(a), V4Y(a), V4Z(a)), y = make_vec3(V4W(a), V4X(b), V4Y(b)),
               z = make_vec3(V4Z(b), V4W(b), triangle->p[8]);
    /* By kz alone: it is less to keep than three axes. */
    return crt_intersect_corners(crt_choose3(ray.kz, y, z, x), crt_choose3(ray.kz, z, x, y),
                                 crt_choose3(ray.kz, x, y, z), ray, limit, hit);
#endif
}

/* One ulp beyond the best hit, so that ties reach the comparison of ids: of t ≥ 0 the next number; of
   others one below 0, too. */
CRT_FN f32 crt_tie_limit(f32 t) { return crt_from_bits(crt_bits(t) + (t < CRT_INFINITY ? 1u : 0u)); }

/* Of a hit and the best so far the nearer wins, and of equally near ones the lower primitive id, so that the
   order of testing does not show. (A CrtHit handed over costs the largest kernel 80 bytes of spilled
   registers.) */
CRT_FN void crt_keep_nearer(f32 t, f32 b1, f32 b2, u32 slot, u32 id, u32 instance, CrtHit *best) {
    if (t < best->t || id < best->id) {
        best->t = t;
        best->b1 = b1;
        best->b2 = b2;
        best->slot = slot;
        best->id = id;
        if (CRT_HAS(INSTANCES)) best->instance = instance;
    }
}

/* Tests one slot against the best hit so far. */
CRT_HOT_FN void crt_test_closest(CRT_GLOBAL const CrtTriangle *triangles, u32 slot, CrtShear shear,
                                 CrtHit *best) {
    CrtHit hit;
    if (!crt_intersect_triangle(triangles + slot, shear, crt_tie_limit(best->t), &hit)) return;
    crt_keep_nearer(hit.t, hit.b1, hit.b2, slot, triangles[slot].id, 0u, best);
}

#if CRT_SIMD8
/* Slack of crt_candidates8 for a ray from o, in lengths: bounds the rounding of its edge distances (at most
   some 30 · 2^-24 of 1 + |o|, scene coordinates being within ±1) and what the exact test accepts outside
   an edge. */
CRT_FN f32 crt_candidate_slack(vec3 o) {
    return 64.0f * CRT_EPSILON * (1.0f + crt_abs(V3X(o)) + crt_abs(V3Y(o)) + crt_abs(V3Z(o)));
}

/* row · (x, y, z, w) for eight triangles. */
CRT_FN vec8 crt_row8(CRT_GLOBAL const f32 *row, vec8 x, vec8 y, vec8 z, vec8 w) {
    return crt_fma8(
        crt_load8(row), x,
        crt_fma8(crt_load8(row + 8), y, crt_fma8(crt_load8(row + 16), z, crt_load8(row + 24) * w)));
}

/* Lanes of eight triangles that the ray may hit before `limit`. In homogeneous form, without a division:
   with h the height of the origin over the plane and n the height gained per length of the ray, the ray
   meets the plane at (n·o − h·d) / n. It may name a triangle that crt_intersect_triangle refuses, never
   miss one that it accepts: close to a plane the sign of h is not known. The slack there is smaller than
   the clearance of the triangle's own rays, or each would be a candidate of the triangle that it leaves:
   crt_height_slack. */
CRT_FN u32 crt_candidates8(CRT_GLOBAL const CrtTriangle8 *block, CrtRay ray, f32 slack, f32 limit) {
    CRT_GLOBAL const f32 *row = &block->row[0][0][0];
    const vec8 ox = splat8(V3X(ray.o)), oy = splat8(V3Y(ray.o)), oz = splat8(V3Z(ray.o));
    const vec8 dx = splat8(V3X(ray.d)), dy = splat8(V3Y(ray.d)), dz = splat8(V3Z(ray.d));
    const vec8 h =
        crt_fma8(crt_load8(row), ox,
                 crt_fma8(crt_load8(row + 8), oy, crt_fma8(crt_load8(row + 16), oz, crt_load8(row + 24))));
    const vec8 n = crt_fma8(crt_load8(row), dx, crt_fma8(crt_load8(row + 8), dy, crt_load8(row + 16) * dz));
    const vec8 x = crt_fma8(ox, n, -h * dx);
    const vec8 y = crt_fma8(oy, n, -h * dy);
    const vec8 z = crt_fma8(oz, n, -h * dz);
    const vec8 edges = crt_min8(crt_flip8(crt_row8(row + 32, x, y, z, n), crt_sign8(n)),
                                crt_min8(crt_flip8(crt_row8(row + 64, x, y, z, n), crt_sign8(n)),
                                         crt_flip8(crt_row8(row + 96, x, y, z, n), crt_sign8(n))));
    const vec8 behind = crt_flip8(h, crt_sign8(n)); /* how far the origin is past the plane */
    const vec8 inside =
        crt_min8(edges, crt_fma8(behind, splat8(-CRT_HEIGHT_SCALE), crt_load8(block->height_slack)));
    return mask8_bits(
        (inside > splat8(-slack)) &
        (behind > crt_fma8(crt_flip8(n, crt_sign8(n)), splat8(-crt_min(limit, 1e30f)), splat8(-slack))));
}
#endif

CRT_KERNEL_END

#endif
