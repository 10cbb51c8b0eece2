/*
 * composition.h: materials made of others, and surfaces that are there in part.
 *
 * Of a mix, one material is chosen at each vertex, before anything else is asked of it: light sampling and
 * scattering see the same one, so that its density alone is what they weigh each other by. A surface of
 * opacity a stops a share a of the rays that meet it, scattered and shadow rays alike, each by a random
 * number of its own; the others go on behind it, as if it were not there.
 */
#ifndef CRT_COMPOSITION_H
#define CRT_COMPOSITION_H

#include "medium.h"

CRT_KERNEL_BEGIN

CRT_FN CRT_GLOBAL const CrtComposition *crt_compositions(const CrtContext *ctx) {
    return CRT_ARRAY(CrtComposition, ctx->blob, ctx->scene->compositions);
}

/* The material that a ray of direction d finds on a surface. What is left of a random number after a choice
   makes the next one. */
CRT_FN u32 crt_chosen_material(const CrtContext *ctx, const CrtSurface *surface, vec3 d, CrtSampler *sampler,
                               u32 dimension) {
    u32 material = surface->material;
    f32 u = 0.0f;
    if (ctx->scene->compositions.count == 0u) return material;
    CrtComposition c = crt_compositions(ctx)[material];
    while (c.kind != CRT_COMPOSED_PLAIN) {
        int second = dot3(d, surface->ng) > 0.0f;
        if (c.kind == CRT_COMPOSED_MIX) {
            const f32 amount = V4X(crt_value(ctx, c.amount, surface, splat4(0.0f)));
            if (u == 0.0f) u = crt_sample_1d(sampler, dimension);
            second = u < amount;
            u = second ? u / amount : (u - amount) / (1.0f - amount);
            u = crt_clamp(u, CRT_EPSILON, 1.0f - CRT_EPSILON);
        }
        material = second ? c.second : c.first;
        c = crt_compositions(ctx)[material];
    }
    return material;
}

/* The ray from behind the surface that it passes at p. It ends where `ray` does. Called: NVIDIA's OpenCL
   compiler (driver 580.159) never ends where this is inlined into the loop over passed surfaces. */
CRT_CALLED_FN CrtRay crt_ray_behind(CrtRay ray, vec3 p, f32 clearance, vec3 ng) {
    CrtRay behind = ray;
    behind.o = crt_offset_origin(p, clearance, ng, ray.d);
    if (ray.reach < CRT_INFINITY) {
        behind.d = ray.o + ray.d - behind.o;
        const f32 left = dot3(behind.d, ray.d) / dot3(ray.d, ray.d);
        behind.reach = left > 0.0f ? 1.0f - (1.0f - ray.reach) / left : 0.0f;
    }
    return behind;
}

/* Whether a ray, with `media` around it, passes the surface that it meets. If so, it becomes the ray from
   behind it. A hole in the surface of a body is one in the body: a ray that came in by a hole is in no glass,
   and goes out wherever it likes; one that is in the glass meets no hole from there. */
CRT_FN int crt_passes(const CrtContext *ctx, CrtHit hit, u32 media, CrtSampler *sampler, u32 dimension,
                      CrtRay *ray) {
    const u32 primitive = crt_primitive_of(ctx, hit);
    const u32 material = CRT_ARRAY(CrtPrimitive, ctx->blob, ctx->scene->primitives)[primitive].material;
    const CrtValue opacity = crt_compositions(ctx)[material].opacity;
    if (opacity == CRT_OPAQUE) return 0;
    const CrtSurface surface = crt_surface(ctx, hit);
    const u32 medium = CRT_HAS(MEDIA) ? crt_medium_of(ctx, material) : 0u;
    if (medium != 0u && dot3(ray->d, surface.ng) > 0.0f) {
        if (crt_surrounds(ctx, media, medium)) return 0;
    } else if (crt_sample_1d(sampler, dimension) < V4X(crt_value(ctx, opacity, &surface, splat4(0.0f)))) return 0;
    *ray = crt_ray_behind(*ray, surface.p, surface.clearance, surface.ng);
    return 1;
}

CRT_KERNEL_END

#endif
