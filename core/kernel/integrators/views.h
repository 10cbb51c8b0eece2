/*
 * views.h: pictures that are colours and not light.
 */
#ifndef CRT_VIEWS_H
#define CRT_VIEWS_H

#include "kernel/geometry/bvh.h"
#include "kernel/geometry/surface.h"
#include "kernel/integrators/path.h"

CRT_KERNEL_BEGIN

/* XYZ of linear sRGB (IEC 61966-2-1). */
CRT_FN vec4 crt_srgb_to_xyz(f32 r, f32 g, f32 b) {
    return make_vec4(0.41239080f * r + 0.35758434f * g + 0.18048079f * b,
                     0.21263901f * r + 0.71516868f * g + 0.07219232f * b,
                     0.01933082f * r + 0.11919478f * g + 0.95053215f * b, 0.0f);
}

/* Figure 1 of the paper that crt grew out of shows two views. A sample of either ends with the camera ray;
   its colour, as XYZ, takes the place of the path's radiance. */

/* Shading normals as colours. */
CRT_FN int crt_normals_advance(const CrtContext *ctx, CrtPath *path, const CrtFilmPixel *film,
                               CrtRayCount *rays) {
    (void)film;
    rays->closest += 1u;
    const CrtHit hit = crt_trace_closest(ctx, path->ray);
    if (hit.slot == CRT_NONE) return 0;
    const CrtSurface surface = crt_surface(ctx, hit);
    const vec3 n = dot3(path->ray.d, surface.ng) > 0.0f ? -surface.ns : surface.ns;
    path->first.normal = n;
    path->first.depth = hit.t * ctx->scene->depth_scale;
    path->first.primitive = hit.id;
    path->first.albedo = splat4(1.0f);
    path->radiance =
        crt_srgb_to_xyz(0.5f * (V3X(n) + 1.0f), 0.5f * (V3Y(n) + 1.0f), 0.5f * (V3Z(n) + 1.0f));
    return 0;
}

CRT_FN vec4 crt_normals_end(const CrtContext *ctx, const CrtPath *path) {
    (void)ctx;
    return path->radiance;
}

/* The objects' bounding boxes: a colour for each object, in one of three shades by the axis of the face that
   the ray meets. */
CRT_FN int crt_aabb_advance(const CrtContext *ctx, CrtPath *path, const CrtFilmPixel *film,
                            CrtRayCount *rays) {
    (void)film;
    rays->closest += 1u;
    CRT_GLOBAL const CrtObject *objects = CRT_ARRAY(CrtObject, ctx->blob, ctx->scene->objects);
    const CrtSlab slab = crt_slab(path->ray);
    f32 nearest = CRT_INFINITY;
    u32 which = CRT_NONE;
    for (u32 k = 0u; k < ctx->scene->objects.count; ++k) {
        const f32 t = crt_box(objects[k].lower, objects[k].upper, path->ray, slab, CRT_INFINITY);
        if (t > 0.0f && t < nearest) {
            nearest = t;
            which = k;
        }
    }
    if (which == CRT_NONE) return 0;
    const u32 h = crt_hash(which + 1u);
    const vec3 c = abs3((path->ray.o + path->ray.d * nearest) -
                        (crt_load3(objects[which].lower) + crt_load3(objects[which].upper)) * 0.5f);
    const vec3 extent = (crt_load3(objects[which].upper) - crt_load3(objects[which].lower)) * 0.5f;
    const f32 fx = V3X(extent) - V3X(c), fy = V3Y(extent) - V3Y(c), fz = V3Z(extent) - V3Z(c);
    const f32 shade = fx < fy ? (fx < fz ? 0.6f : 0.8f) : (fy < fz ? 1.0f : 0.8f);
    path->radiance = crt_srgb_to_xyz(shade * (0.25f + 0.75f * crt_unit(h)),
                                     shade * (0.25f + 0.75f * crt_unit(h << 8)),
                                     shade * (0.25f + 0.75f * crt_unit(h << 16)));
    return 0;
}

CRT_FN vec4 crt_aabb_end(const CrtContext *ctx, const CrtPath *path) {
    (void)ctx;
    return path->radiance;
}

CRT_KERNEL_END

#endif
