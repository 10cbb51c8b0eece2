/*
 * patches.h: a few triangles, two at a time, for backends that trace each ray in its own lane. Of all
 * patches of the scene the one that a ray enters first is found by planes and strips, without a branch; the
 * one ray–triangle test decides about its triangles alone. Where the patch found does not settle it (the
 * ray misses it by rounding, or the next one is as near by rounding), the caller tests all triangles.
 */
#ifndef CRT_PATCHES_H
#define CRT_PATCHES_H

#include "kernel/geometry/intersect.h"

CRT_KERNEL_BEGIN

/* Bounds of the rounding errors where a ray meets a plane, over the cosine of the two (crt_patch_meeting):
   of a distance within the plane and of the ray's parameter. Heights and slopes have errors of some ten
   2^-24 of the coordinates; the exact test accepts less than that beyond an edge. */
typedef struct CrtPatchSlack {
    f32 across; /* lengths */
    f32 along;  /* of the ray's parameter, times the slope */
    f32 height; /* lengths, besides the patch's own */
} CrtPatchSlack;

CRT_FN CrtPatchSlack crt_patch_slack(CrtRay ray) {
    const f32 far = crt_abs(V3X(ray.o)) + crt_abs(V3Y(ray.o)) + crt_abs(V3Z(ray.o));
    const f32 size = CRT_EPSILON * (1.0f + far);
    CrtPatchSlack slack;
    slack.across = 128.0f * size * (crt_abs(V3X(ray.d)) + crt_abs(V3Y(ray.d)) + crt_abs(V3Z(ray.d)));
    slack.along = 64.0f * size;
    slack.height = 64.0f / CRT_HEIGHT_SCALE * size;
    return slack;
}

/* A ray that runs along a plane to within this, in slope, squared, may lie on either side of it. */
#define CRT_PATCH_GRAZING 9.0949470e-13f /* 2^-40 */

/* True if the ray may hit a triangle of the patch in 0 < t < reach; never 0 where crt_intersect_triangle
   accepts one. *least: no hit of the patch is nearer. Comparisons let NaN through: a ray in the plane. */
CRT_FN int crt_patch_meeting(CRT_GLOBAL const CrtPatch *patch, CrtRay ray, CrtPatchSlack slack, f32 reach,
                             f32 *least) {
    const vec4 plane = crt_load4(patch->plane);
    const vec4 first = crt_load4(patch->first);
    const vec4 second = crt_load4(patch->second);
    const vec4 sizes = crt_load4(patch->sizes);
    const f32 h = crt_fma(V4X(plane), V3X(ray.o),
                          crt_fma(V4Y(plane), V3Y(ray.o), crt_fma(V4Z(plane), V3Z(ray.o), V4W(plane))));
    const f32 n = crt_fma(V4X(plane), V3X(ray.d), crt_fma(V4Y(plane), V3Y(ray.d), V4Z(plane) * V3Z(ray.d)));
    const f32 inverse = crt_fast_reciprocal(n);
    const f32 grazing = crt_abs(inverse);
    const f32 t = -h * inverse;
    const vec3 p = crt_fma3(ray.d, t, ray.o);
    const f32 u = crt_fma(V4X(first), V3X(p),
                          crt_fma(V4Y(first), V3Y(p), crt_fma(V4Z(first), V3Z(p), V4W(first))));
    const f32 v = crt_fma(V4X(second), V3X(p),
                          crt_fma(V4Y(second), V3Y(p), crt_fma(V4Z(second), V3Z(p), V4W(second))));
    const f32 behind = crt_fma(crt_fma(CRT_PATCH_GRAZING, grazing, slack.height + V4Z(sizes)), grazing, t);
    const f32 nearest = crt_fma(-slack.along, grazing, t);
    *least = crt_cull_max(nearest, 0.0f);
    /* Without branches, so that the work of two patches overlaps. */
    const int in_first = !(crt_abs(u) > crt_fma(slack.across, grazing, V4X(sizes)));
    const int in_second = !(crt_abs(v) > crt_fma(slack.across, grazing, V4Y(sizes)));
    const int ahead = !(behind <= 0.0f), before = !(nearest >= reach);
    int met = in_first & in_second & ahead & before;
    if (met && V4W(sizes) != 0.0f) { /* one triangle: half of the parallelogram */
        const vec4 third = crt_load4(patch->third);
        const f32 w = crt_fma(V4X(third), V3X(p),
                              crt_fma(V4Y(third), V3Y(p), crt_fma(V4Z(third), V3Z(p), V4W(third))));
        met = !(w < -slack.across * grazing);
    }
    return met;
}

/* Finds the hit of a ray with a few triangles. Returns 0 where all of them have to be tested. */
CRT_FN int crt_patches_closest(CRT_GLOBAL const CrtPatch *patches, u32 count,
                               CRT_GLOBAL const CrtTriangle *triangles, CrtRay ray, CrtHit *best) {
    const CrtPatchSlack slack = crt_patch_slack(ray);
    f32 nearest = CRT_INFINITY, next = CRT_INFINITY;
    u32 found = CRT_NONE;
    CRT_TWICE for (u32 i = 0u; i < count; ++i) {
        f32 least;
        const int met = crt_patch_meeting(patches + i, ray, slack, ray.reach, &least);
        const f32 from = met ? least : CRT_INFINITY;
        next = crt_cull_min(crt_cull_max(from, nearest), next);
        found = met && from < nearest ? i : found;
        nearest = crt_cull_min(from, nearest);
    }
    *best = crt_no_hit(ray.reach);
    if (found == CRT_NONE) return 1;
    const CrtShear shear = crt_shear(ray);
    crt_test_closest(triangles, patches[found].slot[0], shear, best);
    if (patches[found].slot[1] != CRT_NONE)
        crt_test_closest(triangles, patches[found].slot[1], shear, best);
    return best->slot == CRT_NONE ? next == CRT_INFINITY : best->t < next;
}

/* Returns 1 if one of a few triangles stops a ray, 0 if none does, and 2 where all of them have to be
   tested. */
CRT_FN u32 crt_patches_any(CRT_GLOBAL const CrtPatch *patches, u32 count,
                           CRT_GLOBAL const CrtTriangle *triangles, CrtRay ray) {
    const CrtPatchSlack slack = crt_patch_slack(ray);
    u32 found = CRT_NONE, met = 0u;
    CRT_TWICE for (u32 i = 0u; i < count; ++i) {
        f32 least;
        if (crt_patch_meeting(patches + i, ray, slack, ray.reach, &least)) {
            found = i;
            met += 1u;
        }
    }
    if (met == 0u) return 0u;
    const CrtShear shear = crt_shear(ray);
    CrtHit hit;
    for (u32 k = 0u; k < 2u; ++k) {
        const u32 slot = patches[found].slot[k];
        if (slot != CRT_NONE && crt_intersect_triangle(triangles + slot, shear, ray.reach, &hit)) return 1u;
    }
    return met > 1u ? 2u : 0u;
}

CRT_KERNEL_END

#endif
