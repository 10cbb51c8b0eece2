/*
 * shade.h: what happens to a path at a vertex: emission of emitters met, a shadow ray of light sampling,
 * and the direction in which the path goes on. Nothing here traces a ray, so that a backend may trace as it
 * likes.
 */
#ifndef CRT_SHADE_H
#define CRT_SHADE_H

#include "kernel/camera/camera.h"
#include "kernel/lights/light_tree.h"
#include "kernel/lights/point_light.h"
#include "kernel/lights/shape_light.h"
#include "kernel/materials/composition.h"
#include "kernel/materials/medium.h"
#include "kernel/materials/normal_map.h"
#include "kernel/transport/path_state.h"

CRT_KERNEL_BEGIN

/* Written in place: a path that is returned is copied in wide words, which wait for its narrow stores. */
CRT_FN void crt_path_begin(const CrtContext *ctx, CrtPath *path, u32 x, u32 y, u64 sample) {
    CRT_GLOBAL const CrtScene *scene = ctx->scene;
    const u32 pixel_x = scene->crop_x + x;
    const u32 pixel_y = scene->crop_y + y;
    path->sampler = crt_sampler_begin(scene->sampler, scene->replicate_shift, scene->seed,
                                      pixel_y * scene->film_width + pixel_x, sample);
    path->ray = crt_camera_ray(ctx, &path->sampler, pixel_x, pixel_y);
    path->wavelengths = crt_sample_wavelengths(ctx, crt_sample_1d(&path->sampler, CRT_DIM_WAVELENGTH));
    path->hero = make_vec4(1.0f, 0.0f, 0.0f, 0.0f);
    if (CRT_HAS(DISPERSION) && CRT_IN_MASK(scene->features, DISPERSION))
        path->hero = crt_hero_lane(crt_sample_bits(&path->sampler, CRT_DIM_HERO) >> 30);
    path->throughput = splat4(1.0f);
    path->radiance = splat4(0.0f);
    path->scatter_pdf = 0.0f;
    path->scatter_cosine = 0.0f;
    path->p = path->ray.o;
    if (CRT_HAS(LIGHT_TREE)) path->side = make_vec3(0.0f, 0.0f, 0.0f);
    path->eta_square = 1.0f;
    path->depth = 0u;
    path->alone = 0;
    path->met = CRT_NONE;
    path->media = CRT_HAS(MEDIA) ? scene->camera_media : 0u;
    path->first.albedo = splat4(0.0f);
    path->first.normal = make_vec3(0.0f, 0.0f, 0.0f);
    path->first.depth = 0.0f;
    path->first.primitive = CRT_NONE;
}

/* Emission met by the ray, weighted against the chance that light sampling had found it. */
CRT_FN void crt_add_emission(const CrtContext *ctx, CrtPath *path, const CrtSurface *surface, f32 t) {
    CRT_GLOBAL const CrtLight *emitter =
        CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights) + surface->light;
    const int front = dot3(surface->ng, path->ray.d) < 0.0f;
    if (!front && (emitter->flags & CRT_LIGHT_TWO_SIDED) == 0u) return;
    f32 weight = 1.0f;
    if (CRT_HAS(NEE) && ctx->scene->nee != CRT_NEE_NONE && path->scatter_pdf > 0.0f) {
        const f32 distance = length3(crt_fma3(path->ray.d, t, path->ray.o) - path->p);
        CrtLightSeen light =
            crt_is_shape_light(ctx, surface->light)
                ? crt_shape_light_pdf(ctx, surface->light, path->p,
                                      crt_fma3(path->ray.d, t, path->ray.o), surface->ng)
                : crt_light_pdf(ctx, surface->light, path->p, distance);
        if (crt_has_light_tree(ctx))
            light.pdf = light.pdf * crt_light_tree_probability(ctx, surface->light, path->p, path->side);
        if (light.pdf > 0.0f) {
            /* The ray starts a clearance off p, from which lights are sampled. Close to a light that is
               another direction: both techniques estimate what arrives at p, and are weighed by the area of
               the light per probability. */
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
    path->radiance = path->radiance +
                     path->throughput *
                         crt_value(ctx, emitter->radiance, surface, path->wavelengths.position) * weight;
}

/* What a ray that meets nothing finds, weighted in the same way. */
CRT_FN void crt_add_environment(const CrtContext *ctx, CrtPath *path) {
    CRT_GLOBAL const CrtScene *scene = ctx->scene;
    const CrtEnvironmentPlace place = crt_environment_towards(ctx, path->ray.d);
    f32 weight = 1.0f;
    if (CRT_HAS(ENVIRONMENT_LIGHT) && scene->environment_light != 0u && scene->nee != CRT_NEE_NONE &&
        path->scatter_pdf > 0.0f) {
        const f32 pdf = crt_environment_pdf(ctx, place, path->scatter_cosine);
        if (pdf > 0.0f && scene->nee == CRT_NEE_ONLY) return;
        weight = crt_power_heuristic(pdf / path->scatter_pdf);
    }
    path->radiance =
        path->radiance +
        path->throughput * crt_environment_radiance(ctx, place, path->wavelengths.position) * weight;
}

/* What is left of the path's throughput after the way to `surface`, or, with none, to nowhere. */
CRT_FN void crt_absorb(const CrtContext *ctx, CrtPath *path, const CrtSurface *surface) {
    /* From where it was scattered: the ray began a clearance off. */
    const f32 distance = surface != 0 ? length3(surface->p - path->p) : CRT_INFINITY;
    const u32 medium = surface != 0 ? crt_medium_before(ctx, surface, path->ray.d, path->media)
                                    : crt_first_medium(ctx, path->media);
    path->throughput =
        path->throughput * crt_transmittance(ctx, medium, distance, path->wavelengths.position);
}

/* A pending shadow ray, and the radiance to add to the path if nothing stops it. It is resolved before the
   path's next vertex. */
typedef struct CrtShadow {
    int pending;
    CrtRay ray; /* its reach is 0 or less where nothing fits in between */
    u32 media;  /* around it where it begins */
    vec4 radiance;
} CrtShadow;

/* What is left of the light that waits for the answer, after its way of `distance` along wi. */
CRT_FN void crt_absorb_shadow(const CrtContext *ctx, const CrtPath *path, const CrtSurface *surface,
                              const CrtBsdf *bsdf, vec3 wi, f32 distance, CrtShadow *shadow) {
    shadow->media = crt_media_behind(ctx, surface, bsdf, wi, path->media);
    shadow->radiance = shadow->radiance * crt_transmittance(ctx, crt_first_medium(ctx, shadow->media),
                                                            distance, path->wavelengths.position);
}

/* A direct-lighting sample of a point: the direction to a light, and the light that arrives if nothing is in
   the way. */
typedef struct CrtDirectSample {
    u32 light;       /* row of the light table */
    vec3 wi;         /* unit, from the point */
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
                                            u32 dimension, vec3 p, const CrtBsdf *bsdf) {
    CrtDirectSample direct;
    direct.light = light;
    direct.distance = CRT_INFINITY;
    direct.point = p;
    direct.normal = bsdf->ns;
    direct.reach = direct.cosine = 0.0f;
    direct.area = 0;
    direct.place = crt_no_place();
    direct.environment = CRT_HAS(ENVIRONMENT_LIGHT) && direct.light + 1u == ctx->scene->environment_light;
    if (direct.environment) {
        const CrtEnvironmentSample s = crt_environment_sample(ctx, sampler, dimension, crt_base(bsdf));
        direct.wi = s.wi;
        direct.pdf = s.pdf;
        direct.place = s.place;
        /* Of one without an image, what would be transmitted is left to scattered rays. */
        const int sampled =
            s.pdf > 0.0f && (crt_has_environment_image(ctx) || dot3(s.wi, crt_side(bsdf)) > 0.0f);
        direct.irradiance = sampled ? 1.0f / s.pdf : 0.0f;
        return direct;
    }
    if (CRT_HAS(POINT_LIGHT) && !crt_is_shape_light(ctx, direct.light) &&
        CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights)[direct.light].kind >= CRT_LIGHT_POINT) {
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

/* The normal of a surface that scatters nothing to its other side; otherwise of length 0. */
CRT_FN vec3 crt_scattering_side(const CrtBsdf *bsdf) {
    return (bsdf->flags & CRT_BSDF_TRANSMITS) == 0u ? crt_side(bsdf) : make_vec3(0.0f, 0.0f, 0.0f);
}

CRT_FN CrtDirectSample crt_direct_sample(const CrtContext *ctx, CrtSampler *sampler, u32 dimension, vec3 p,
                                         const CrtBsdf *bsdf) {
    u32 light, none = 0u;
    f32 probability = 1.0f;
    if (crt_has_light_tree(ctx)) {
        light = crt_light_tree_choose(ctx, sampler, dimension, p, crt_scattering_side(bsdf), &probability);
        none = light == CRT_NONE;
        if (none) light = 0u;
    } else {
        light = crt_light_choose(ctx, sampler, dimension);
    }
    CrtDirectSample direct = crt_direct_sample_of(ctx, light, sampler, dimension, p, bsdf);
    if (crt_has_light_tree(ctx)) {
        direct.irradiance = none ? 0.0f : direct.irradiance / probability;
        direct.pdf = direct.pdf * probability;
    }
    return direct;
}

/* Probability with which the BSDF finds a direct-lighting sample, over that of light sampling. An emitter's
   are per area (crt_add_emission): of a ray scattered at the shadow ray's origin pdf·|n·d|/|d|³, of light
   sampling pdf·cos/distance². */
CRT_FN f32 crt_direct_ratio(const CrtDirectSample *direct, const CrtBsdf *bsdf, CrtRay ray) {
    const f32 squared = dot3(ray.d, ray.d);
    const vec3 towards = direct->area ? ray.d * (1.0f / crt_sqrt(squared)) : direct->wi;
    const f32 pdf = crt_surface_pdf(bsdf, towards);
    if (!direct->area) return pdf / direct->pdf;
    return pdf * crt_abs(dot3(direct->normal, towards)) * direct->distance * direct->distance /
           (direct->pdf * direct->cosine * squared);
}

/* Next event estimation: a light, and a ray towards it. */
CRT_FN void crt_sample_lights(const CrtContext *ctx, CrtPath *path, const CrtSurface *surface,
                              const CrtBsdf *bsdf, u32 dimension, CrtShadow *shadow) {
    const CrtDirectSample direct = crt_direct_sample(ctx, &path->sampler, dimension, surface->p, bsdf);
    if (!(direct.irradiance > 0.0f)) return;
    const int before = dot3(direct.wi, crt_side(bsdf)) > 0.0f;
    if ((bsdf->flags & (before ? CRT_BSDF_REFLECTS : CRT_BSDF_TRANSMITS)) == 0u) return;
    const vec4 scattered = crt_surface_eval(bsdf, direct.wi);
    if (max4(scattered) == 0.0f) return;
    const int far = direct.distance == CRT_INFINITY;
    shadow->pending = 1;
    shadow->ray.o = crt_offset_origin(surface->p, surface->clearance, crt_side(bsdf), direct.wi);
    shadow->ray.d = far ? direct.wi : direct.point - shadow->ray.o;
    shadow->ray.reach = far ? CRT_INFINITY : direct.reach;
    f32 weight = direct.irradiance;
    if (direct.pdf > 0.0f && ctx->scene->nee == CRT_NEE_MIS)
        weight = weight * crt_power_heuristic(crt_direct_ratio(&direct, bsdf, shadow->ray));
    const vec4 position = path->wavelengths.position;
    const vec4 light =
        direct.environment
            ? crt_environment_radiance(ctx, direct.place, position)
            : crt_value(ctx, CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights)[direct.light].radiance, 0,
                        position);
    shadow->radiance = path->throughput * scattered * light * weight;
    if (CRT_HAS(MEDIA)) crt_absorb_shadow(ctx, path, surface, bsdf, direct.wi, direct.distance, shadow);
}

/* What happens to a path at `hit`, which its ray has met: it gains what is emitted there, and is scattered.
   Returns 0 when it has ended. Traces nothing: path->ray is the next ray, and *shadow may ask for another,
   whether or not the path goes on. */
CRT_FN int crt_shade(const CrtContext *ctx, CrtPath *path, CrtHit hit, CrtShadow *shadow) {
    CRT_GLOBAL const CrtScene *scene = ctx->scene;
    shadow->pending = 0;
    if (hit.slot == CRT_NONE) {
        if (CRT_HAS(MEDIA)) crt_absorb(ctx, path, 0);
        if (CRT_HAS(ENVIRONMENT) && scene->environment != CRT_NONE) crt_add_environment(ctx, path);
        if (CRT_HAS(POINT_LIGHT) && scene->point_lights.count != 0u)
            path->radiance = path->radiance +
                             path->throughput * crt_suns_seen(ctx, path->ray.d, path->scatter_pdf,
                                                              path->wavelengths.position);
        return 0;
    }
    const u32 dimension = CRT_DIM_VERTEX + CRT_DIM_PER_VERTEX * path->depth;
    CrtSurface surface = crt_surface(ctx, hit);
    if (CRT_HAS(MEDIA)) {
        surface.medium = crt_medium_of(ctx, surface.material);
        surface.touches = crt_touches(ctx, hit);
    }
    if (CRT_HAS(MIX))
        surface.material =
            path->met != CRT_NONE
                ? path->met
                : crt_chosen_material(ctx, &surface, path->ray.d, &path->sampler, dimension + CRT_DIM_MIX);
    if (CRT_HAS(MEDIA)) crt_absorb(ctx, path, &surface);
    if (CRT_HAS(AREA_LIGHT) && surface.light != CRT_NONE) crt_add_emission(ctx, path, &surface, hit.t);

    const int first = CRT_HAS(AOV) && scene->aovs != 0u && path->depth == 0u;
    if (!first && path->depth >= scene->max_depth) return 0;
    CrtBsdf bsdf;
    vec3 wo = -path->ray.d;
    const vec3 ng = surface.ng;
    if (CRT_HAS(THIN_DIELECTRIC)) bsdf.pane_cosine = crt_pane_cosine(&surface, path->ray.d);
    if (CRT_HAS(NORMAL_MAP)) crt_map_normal(ctx, &surface, hit.slot, &wo, &bsdf);
    if (crt_sees_face(ctx, surface.material, path->depth)) surface.ns = ng;
    crt_layered_prepare(ctx, &bsdf, &surface, wo, path->wavelengths.position, path->throughput, first);
    surface.ng = ng;
    if (first) {
        path->first.normal = bsdf.ns;
        path->first.depth = hit.t * scene->depth_scale;
        path->first.primitive = hit.id;
        path->first.albedo = bsdf.albedo;
        if (path->depth >= scene->max_depth) return 0;
    }

    if (CRT_HAS(NEE) && scene->nee != CRT_NEE_NONE && scene->lights.count != 0u &&
        !crt_is_delta(&bsdf))
        crt_sample_lights(ctx, path, &surface, &bsdf, dimension, shadow);
    const CrtRandom2 u = crt_sample_2d(&path->sampler, dimension + CRT_DIM_BSDF);
    CrtRandom2 choice = u;
    if ((CRT_HAS(ROUGH_DIELECTRIC) || CRT_HAS(PLASTIC)) && (bsdf.flags & CRT_BSDF_CHOOSES) != 0u)
        choice = crt_sample_2d(&path->sampler, dimension + CRT_DIM_CHOICE);
    const CrtScatter scatter = crt_surface_sample(&bsdf, u, choice, path->hero, path->alone);
    if (!scatter.valid) return 0;

    path->throughput = path->throughput * scatter.weight;
    if (CRT_HAS(DISPERSION) && scatter.hero_only) {
        path->throughput = path->throughput * path->hero * 4.0f;
        path->alone = 1;
    }
    path->eta_square = path->eta_square * scatter.eta_square;
    path->scatter_pdf = scatter.pdf;
    path->scatter_cosine = crt_scatter_cosine(&bsdf, scatter.wi);
    path->p = surface.p;
    if (CRT_HAS(LIGHT_TREE)) path->side = crt_scattering_side(&bsdf);
    if (CRT_HAS(MEDIA)) path->media = crt_media_behind(ctx, &surface, &bsdf, scatter.wi, path->media);
    path->ray.o = crt_offset_origin(surface.p, surface.clearance, surface.ng, scatter.wi);
    path->ray.d = scatter.wi;
    path->ray.reach = CRT_INFINITY;
    path->depth += 1u;

    /* Roulette on the spectral maximum. A path that carries nothing has ended in any case. */
    const f32 carried = max4(path->throughput) * path->eta_square;
    if (!(carried > 0.0f)) return 0;
    if (path->depth >= scene->roulette_depth && carried < 1.0f) {
        const f32 survive = crt_max(carried, 0.05f);
        if (!(crt_sample_1d(&path->sampler, dimension + CRT_DIM_ROULETTE) < survive)) return 0;
        path->throughput = path->throughput / survive;
    }
    return 1;
}

CRT_KERNEL_END

#endif
