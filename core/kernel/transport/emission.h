/*
 * emission.h: the estimator of light that a path's ray meets. It is weighted by multiple importance sampling
 * against the chance that light sampling had found the same light (direct_light.h).
 */
#ifndef CRT_EMISSION_H
#define CRT_EMISSION_H

#include "kernel/lights/light_tree.h"
#include "kernel/lights/point_light.h"
#include "kernel/lights/shape_light.h"
#include "kernel/transport/path_state.h"

CRT_KERNEL_BEGIN

/* Emission met by the ray, weighted against the chance that light sampling had found it. */
CRT_FN void crt_add_emission(const CrtContext *ctx, CrtPath *path, const CrtSurface *surface, f32 t) {
    const u32 index = crt_light_at(ctx, surface);
    CRT_GLOBAL const CrtLight *emitter = CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights) + index;
    const int front = dot3(surface->ng, path->ray.d) < 0.0f;
    if (!front && (emitter->flags & CRT_LIGHT_TWO_SIDED) == 0u) return;
    f32 weight = 1.0f;
    if (CRT_HAS(NEE) && ctx->scene->nee != CRT_NEE_NONE && path->scatter_pdf > 0.0f) {
        const f32 distance = length3(crt_fma3(path->ray.d, t, path->ray.o) - path->p);
        CrtLightSeen light = crt_is_shape_light(ctx, index)
                                 ? crt_shape_light_pdf(ctx, index, path->p,
                                                       crt_fma3(path->ray.d, t, path->ray.o), surface->ng)
                                 : crt_light_pdf(ctx, index, path->p, distance);
        if (crt_has_light_tree(ctx))
            light.pdf = light.pdf * crt_light_tree_probability(ctx, index, path->p, path->side);
        if (light.pdf > 0.0f) {
            /* The ray starts a clearance off p, from which lights are sampled. Close to a light the
               directions from the two differ: both techniques estimate what arrives at p, and are weighed
               by the area of the light per probability. */
            const f32 nearer = t / distance;
            const f32 area = light.cosine / crt_abs(dot3(surface->ng, path->ray.d)) * nearer * nearer;
            const f32 ratio = light.pdf / path->scatter_pdf * area;
            if (ctx->scene->nee == CRT_NEE_ONLY || !(ratio < 1e15f)) return;
            const f32 clearance = length3(path->ray.o - path->p);
            const f32 cosines = (t + clearance / crt_abs(path->scatter_cosine)) /
                                distance; /* at p over that at the ray's origin */
            weight = area * cosines * crt_power_heuristic(ratio);
        }
    }
    const vec4 emitted = crt_value(ctx, emitter->radiance, surface, path->wavelengths.position);
    crt_add_radiance(path, path->throughput * emitted * weight);
}

/* Radiance of the environment at `place`, which the ray leads to, weighted in the same way. */
CRT_FN void crt_add_environment(const CrtContext *ctx, CrtPath *path, CrtEnvironmentPlace place) {
    CRT_GLOBAL const CrtScene *scene = ctx->scene;
    f32 weight = 1.0f;
    if (CRT_HAS(ENVIRONMENT_LIGHT) && scene->environment_light != 0u && scene->nee != CRT_NEE_NONE &&
        path->scatter_pdf > 0.0f) {
        const f32 pdf = crt_environment_pdf(ctx, place, path->scatter_cosine);
        if (pdf > 0.0f && scene->nee == CRT_NEE_ONLY) return;
        weight = crt_power_heuristic(pdf / path->scatter_pdf);
    }
    const vec4 seen = crt_environment_radiance(ctx, place, path->wavelengths.position);
    crt_add_radiance(path, path->throughput * seen * weight);
}

/* Emission where the ray meets nothing: the environment, at `place`, and suns. */
CRT_FN void crt_add_distant_emission(const CrtContext *ctx, CrtPath *path, CrtEnvironmentPlace place) {
    CRT_GLOBAL const CrtScene *scene = ctx->scene;
    if (CRT_HAS(ENVIRONMENT) && scene->environment != CRT_NONE) crt_add_environment(ctx, path, place);
    if (CRT_HAS(POINT_LIGHT) && scene->point_lights.count != 0u)
        crt_add_radiance(path, path->throughput * crt_suns_seen(ctx, path->ray.d, path->scatter_pdf,
                                                                path->wavelengths.position));
}

/* The path's ray meets nothing. Returns 0 when the path has ended: all at once, or, where paths take turns
   and the environment is an image, at its next turn (crt_has_left). A texel comes from far memory: waiting
   for it took an eighth of the time in which `sun` of bench/scenes/race is rendered. */
CRT_FN int crt_leave(const CrtContext *ctx, CrtPath *path) {
    const CrtEnvironmentPlace place = crt_environment_towards(ctx, path->ray.d);
    if (CRT_TAKES_TURNS && crt_has_environment_image(ctx)) {
        crt_fetch_environment(ctx, place);
        path->place = place;
        path->leaves = 1;
        return 1;
    }
    crt_add_distant_emission(ctx, path, place);
    return 0;
}

/* True for a path that crt_leave kept: it has ended, with the radiance that it sees. */
CRT_FN int crt_has_left(const CrtContext *ctx, CrtPath *path) {
    if (!(CRT_TAKES_TURNS && crt_has_environment_image(ctx) && path->leaves)) return 0;
    crt_add_distant_emission(ctx, path, path->place);
    return 1;
}

CRT_KERNEL_END

#endif
