/*
 * direct_light.h: the estimator of light that is sampled (next event estimation). A vertex samples a light,
 * and leaves a shadow ray to be traced. Its light is weighted by multiple importance sampling against the
 * chance that a scattered ray finds the same light (emission.h).
 */
#ifndef CRT_DIRECT_LIGHT_H
#define CRT_DIRECT_LIGHT_H

#include "kernel/lights/light_tree.h"
#include "kernel/lights/point_light.h"
#include "kernel/lights/shape_light.h"
#include "kernel/transport/path_state.h"
#include "kernel/transport/vertex.h"

CRT_KERNEL_BEGIN

/* A pending shadow ray, and the radiance to add to the path if nothing stops it. It is resolved before the
   path's next vertex. */
typedef struct CrtShadow {
    int pending;
    CrtRay ray; /* its reach is 0 or less where nothing fits in between */
    u32 media;  /* around it where it begins */
    vec4 radiance;
} CrtShadow;

/* Absorbs the light of a pending shadow ray on its way of `distance` along wi. */
CRT_FN void crt_absorb_shadow(const CrtContext *ctx, const CrtPath *path, const CrtVertex *vertex,
                              vec3 wi, f32 distance, CrtShadow *shadow) {
    shadow->media = crt_vertex_media(ctx, vertex, wi, path->media);
    shadow->radiance = shadow->radiance * crt_transmittance(ctx, crt_first_medium(ctx, shadow->media),
                                                            distance, path->wavelengths.position);
}

/* A direct-lighting sample of a vertex: the direction to a light, and the light that arrives if nothing is
   in the way. */
typedef struct CrtDirectSample {
    u32 light;       /* row of the light table */
    vec3 wi;         /* unit, from the vertex */
    f32 distance;    /* along wi; infinite from outside the scene */
    f32 irradiance;  /* that a plane facing wi gets per unit of the light's spectrum; 0: no light */
    f32 pdf;         /* per steradian, with the probability of choosing the light; 0: a single direction */
    vec3 point;      /* where the light is, unless its distance is infinite */
    f32 reach;       /* share of the way to it that a shadow ray goes */
    int area;        /* from an emitter of the scene, of which: */
    vec3 normal;
    f32 cosine;      /* of wi with it */
    int environment; /* from the environment, of which: */
    CrtEnvironmentPlace place;
} CrtDirectSample;

CRT_FN CrtDirectSample crt_direct_sample_of(const CrtContext *ctx, u32 light, CrtSampler *sampler,
                                            u32 dimension, const CrtVertex *vertex) {
    const vec3 p = vertex->surface.p;
    CrtDirectSample direct;
    direct.light = light;
    direct.distance = CRT_INFINITY;
    direct.point = p;
    direct.normal = vertex->bsdf.ns;
    direct.reach = direct.cosine = 0.0f;
    direct.area = 0;
    direct.place = crt_no_place();
    direct.environment = CRT_HAS(ENVIRONMENT_LIGHT) && direct.light + 1u == ctx->scene->environment_light;
    if (direct.environment) {
        const CrtEnvironmentSample s =
            crt_environment_sample(ctx, sampler, dimension, crt_vertex_base(vertex));
        direct.wi = s.wi;
        direct.pdf = s.pdf;
        direct.place = s.place;
        /* Of one without an image, what would be transmitted is left to scattered rays. */
        const int sampled =
            s.pdf > 0.0f && (crt_has_environment_image(ctx) || dot3(s.wi, crt_vertex_side(vertex)) > 0.0f);
        direct.irradiance = sampled ? 1.0f / s.pdf : 0.0f;
        return direct;
    }
    const u32 kind = CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights)[direct.light].kind;
    if (CRT_HAS(POINT_LIGHT) && kind >= CRT_LIGHT_POINT && kind != CRT_LIGHT_SHAPE &&
        kind != CRT_LIGHT_TILE) {
        const CrtPointLightSample s = crt_point_light_sample(ctx, direct.light, sampler, dimension, p);
        direct.wi = s.wi;
        direct.pdf = s.pdf;
        direct.irradiance = s.irradiance;
        direct.distance = s.distance;
        direct.point = s.point;
        direct.reach = CRT_POINT_LIGHT_REACH;
        return direct;
    }
    const CrtLightSample s =
        crt_is_shape_light(ctx, direct.light)
            ? crt_shape_light_sample(ctx, direct.light, sampler, dimension, p)
            : crt_light_sample(ctx, direct.light, sampler, dimension, p);
    direct.area = 1;
    direct.wi = s.wi;
    direct.pdf = s.pdf;
    direct.irradiance = s.pdf > 0.0f ? 1.0f / s.pdf : 0.0f;
    direct.distance = s.distance;
    direct.point = s.point;
    direct.reach = s.reach;
    direct.normal = s.normal;
    direct.cosine = s.cosine;
    return direct;
}

CRT_FN CrtDirectSample crt_direct_sample(const CrtContext *ctx, CrtSampler *sampler, u32 dimension,
                                         const CrtVertex *vertex) {
    u32 light, none = 0u;
    f32 probability = 1.0f;
    if (crt_has_light_tree(ctx)) {
        light = crt_light_tree_choose(ctx, sampler, dimension, vertex->surface.p,
                                      crt_scattering_side(vertex), &probability);
        none = light == CRT_NONE;
        if (none) light = 0u;
    } else {
        light = crt_light_choose(ctx, sampler, dimension);
    }
    CrtDirectSample direct = crt_direct_sample_of(ctx, light, sampler, dimension, vertex);
    if (crt_has_light_tree(ctx)) {
        direct.irradiance = none ? 0.0f : direct.irradiance / probability;
        direct.pdf = direct.pdf * probability;
    }
    return direct;
}

/* Probability with which scattering finds a direct-lighting sample, over that of light sampling. Those of
   an emitter are per area (crt_add_emission): of a ray scattered at the shadow ray's origin
   pdf·|n·d|/|d|³, of light sampling pdf·cos/distance². */
CRT_FN f32 crt_direct_ratio(const CrtDirectSample *direct, const CrtVertex *vertex, CrtRay ray) {
    const f32 squared = dot3(ray.d, ray.d);
    const vec3 towards = direct->area ? ray.d * (1.0f / crt_sqrt(squared)) : direct->wi;
    const f32 pdf = crt_vertex_pdf(vertex, towards);
    if (!direct->area) return pdf / direct->pdf;
    return pdf * crt_abs(dot3(direct->normal, towards)) * direct->distance * direct->distance /
           (direct->pdf * direct->cosine * squared);
}

/* Next event estimation: a light, and a ray towards it. */
CRT_FN void crt_sample_lights(const CrtContext *ctx, CrtPath *path, const CrtVertex *vertex,
                              u32 dimension, CrtShadow *shadow) {
    const CrtSurface *surface = &vertex->surface;
    const CrtDirectSample direct = crt_direct_sample(ctx, &path->sampler, dimension, vertex);
    if (!(direct.irradiance > 0.0f) || !crt_vertex_scatters(vertex, direct.wi)) return;
    const vec4 scattered = crt_vertex_eval(vertex, direct.wi, CRT_RADIANCE);
    if (max4(scattered) == 0.0f) return;
    const int far = direct.distance == CRT_INFINITY;
    shadow->pending = 1;
    shadow->ray.o = crt_offset_origin(surface->p, surface->clearance, crt_vertex_side(vertex), direct.wi);
    shadow->ray.d = far ? direct.wi : direct.point - shadow->ray.o;
    shadow->ray.reach = far ? CRT_INFINITY : direct.reach;
    f32 weight = direct.irradiance;
    if (direct.pdf > 0.0f && ctx->scene->nee == CRT_NEE_MIS)
        weight = weight * crt_power_heuristic(crt_direct_ratio(&direct, vertex, shadow->ray));
    const vec4 position = path->wavelengths.position;
    const vec4 light =
        direct.environment
            ? crt_environment_radiance(ctx, direct.place, position)
            : crt_emitted(ctx, CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights) + direct.light,
                          direct.point, position);
    shadow->radiance = path->throughput * scattered * light * weight;
    if (CRT_HAS(MEDIA)) crt_absorb_shadow(ctx, path, vertex, direct.wi, direct.distance, shadow);
}

CRT_KERNEL_END

#endif
