/*
 * point_light.h: lights without a surface. Points, spots and directional lights lie in single directions, so
 * that light sampling alone finds them; a sun is a cone of directions, which rays that meet nothing find
 * too.
 */
#ifndef CRT_POINT_LIGHT_H
#define CRT_POINT_LIGHT_H

#include "light.h"

CRT_KERNEL_BEGIN

/* Share of the way to a light that shadow rays go: what is nearer to it than rounding tells, as the ceiling
   on which it is put, does not hide it. */
#define CRT_POINT_LIGHT_REACH (1.0f - 64.0f * CRT_EPSILON)

/* Squared distance below which a light is in the shaded point: its square would leave single precision. */
#define CRT_POINT_LIGHT_NEAREST 1e-24f

/* 1 − cos of the angle between unit vectors, exact also where it is small. */
CRT_FN f32 crt_one_minus_cos(vec3 a, vec3 b) {
    const vec3 d = a - b;
    return 0.5f * dot3(d, d);
}

CRT_FN CRT_GLOBAL const CrtPointLight *crt_point_light(const CrtContext *ctx,
                                                       CRT_GLOBAL const CrtLight *light) {
    return CRT_ARRAY(CrtPointLight, ctx->blob, ctx->scene->point_lights) + light->slot;
}

/* Share of a spot's radiant intensity in a direction: 1 within the cone but for its penumbra, where it falls
   to 0 by Hermite's cubic in the cosine, as in pbrt-v4. */
CRT_FN f32 crt_spot_falloff(CRT_GLOBAL const CrtPointLight *spot, vec3 away) {
    const f32 inside = spot->cone - crt_one_minus_cos(crt_load3(spot->direction), away);
    const f32 t = crt_clamp(inside * spot->inverse_penumbra, 0.0f, 1.0f);
    return t * t * (3.0f - 2.0f * t);
}

/* pdf of the directions of a sun, all of which are equally likely. */
CRT_FN f32 crt_sun_density(CRT_GLOBAL const CrtPointLight *sun) { return 0.5f * CRT_INV_PI / sun->cone; }

/* A direction uniform in the cone of unit `axis` of which 1 − cos is `cone` at the edge. */
CRT_FN vec3 crt_cone_direction(vec3 axis, f32 cone, CrtRandom2 u) {
    const f32 one_minus_cos = cone * u.x;
    const f32 sin_theta = crt_sqrt(one_minus_cos * (2.0f - one_minus_cos));
    f32 cosine;
    const f32 sine = crt_sincos(2.0f * CRT_PI * u.y, &cosine);
    return crt_to_world(crt_frame(axis),
                        make_vec3(sin_theta * cosine, sin_theta * sine, 1.0f - one_minus_cos));
}

typedef struct CrtPointLightSample {
    vec3 wi;       /* unit, from the shaded point */
    f32 irradiance; /* that a plane facing wi gets per unit of the spectrum, over the probability of choosing
                       this light; 0: no light from here */
    f32 pdf;       /* per steradian, with the probability of choosing this light; 0: a single direction */
    int far;       /* from outside the scene; otherwise from `point` */
    vec3 point;
    f32 distance;
} CrtPointLightSample;

CRT_FN CrtPointLightSample crt_point_light_sample(const CrtContext *ctx, u32 index, CrtSampler *sampler,
                                                  u32 dimension, vec3 p) {
    CRT_GLOBAL const CrtLight *light = CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights) + index;
    CRT_GLOBAL const CrtPointLight *own = crt_point_light(ctx, light);
    CrtPointLightSample s;
    s.point = crt_load3(own->position);
    s.irradiance = own->strength / light->choice_probability;
    s.pdf = 0.0f;
    s.far = light->kind == CRT_LIGHT_DIRECTIONAL || light->kind == CRT_LIGHT_SUN;
    s.distance = CRT_INFINITY;
    if (s.far) {
        s.wi = -crt_load3(own->direction);
        if (light->kind == CRT_LIGHT_SUN) {
            const f32 density = crt_sun_density(own);
            s.wi = crt_cone_direction(s.wi, own->cone, crt_sample_2d(sampler, dimension + CRT_DIM_LIGHT));
            s.irradiance = s.irradiance / density;
            s.pdf = light->choice_probability * density;
        }
        return s;
    }
    const vec3 d = s.point - p;
    const f32 squared = dot3(d, d);
    s.wi = d;
    if (!(squared > CRT_POINT_LIGHT_NEAREST)) {
        s.irradiance = 0.0f;
        return s;
    }
    s.distance = crt_sqrt(squared);
    s.wi = d * (1.0f / s.distance);
    s.irradiance = s.irradiance / squared;
    if (light->kind == CRT_LIGHT_SPOT) s.irradiance = s.irradiance * crt_spot_falloff(own, -s.wi);
    return s;
}

/* Radiance of the suns in direction d, weighed against light sampling where that competes: `scatter_pdf` is
   that of d, or 0. */
CRT_FN vec4 crt_suns_seen(const CrtContext *ctx, vec3 d, f32 scatter_pdf, vec4 position) {
    CRT_GLOBAL const CrtLight *lights = CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights);
    CRT_GLOBAL const CrtPointLight *suns = CRT_ARRAY(CrtPointLight, ctx->blob, ctx->scene->point_lights);
    vec4 radiance = splat4(0.0f);
    for (u32 i = 0u; i < ctx->scene->point_lights.count; ++i) {
        CRT_GLOBAL const CrtPointLight *sun = suns + i;
        CRT_GLOBAL const CrtLight *light = lights + sun->light;
        if (light->kind != CRT_LIGHT_SUN) break;
        if (!(crt_one_minus_cos(-crt_load3(sun->direction), d) <= sun->cone)) continue;
        f32 weight = sun->strength;
        if (ctx->scene->nee != CRT_NEE_NONE && scatter_pdf > 0.0f) {
            if (ctx->scene->nee == CRT_NEE_ONLY) continue;
            weight = weight * crt_power_heuristic(light->choice_probability * crt_sun_density(sun) /
                                                  scatter_pdf);
        }
        radiance = radiance + crt_value(ctx, light->radiance, 0, position) * weight;
    }
    return radiance;
}

CRT_KERNEL_END

#endif
