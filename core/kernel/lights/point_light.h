/*
 * point_light.h: lights without a surface. Points, spots, directional lights, IES lamps and beams lie in
 * single directions, so that light sampling alone finds them; a sun is a cone of directions, which rays that
 * meet nothing find too.
 */
#ifndef CRT_POINT_LIGHT_H
#define CRT_POINT_LIGHT_H

#include "kernel/sampling/warp.h"
#include "kernel/values/value.h"

CRT_KERNEL_BEGIN

/* Share of the way to a light that shadow rays go: surfaces within rounding of the light, such as the
   ceiling that it hangs on, do not hide it. */
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

CRT_FN CRT_GLOBAL const CrtLightForm *crt_light_form(const CrtContext *ctx,
                                                     CRT_GLOBAL const CrtPointLight *own) {
    return CRT_ARRAY(CrtLightForm, ctx->blob, own->form);
}

/* The last but one of the increasing `angles`, or the last that is at most x; at least the first. There are
   two or more. */
CRT_FN u32 crt_interval(CRT_GLOBAL const f32 *angles, u32 count, f32 x) {
    u32 index = 0u;
    u32 end = count - 1u;
    while (end - index > 1u) {
        const u32 middle = (index + end) >> 1;
        if (angles[middle] <= x) index = middle;
        else end = middle;
    }
    return index;
}

/* Share of the greatest intensity that an IES lamp sends in a direction: linear in both angles between those
   of its file, 0 beyond its vertical ones. */
CRT_FN f32 crt_ies_share(const CrtContext *ctx, CRT_GLOBAL const CrtPointLight *own, vec3 away) {
    CRT_GLOBAL const CrtLightForm *form = crt_light_form(ctx, own);
    CRT_GLOBAL const f32 *vertical = CRT_ARRAY(f32, ctx->blob, form->vertical);
    CRT_GLOBAL const f32 *horizontal = CRT_ARRAY(f32, ctx->blob, form->horizontal);
    CRT_GLOBAL const f32 *shares = CRT_ARRAY(f32, ctx->blob, form->shares);
    const u32 rows = form->vertical.count;
    const f32 x = dot3(away, crt_load3(form->u)), y = dot3(away, crt_load3(form->v));
    const f32 theta = crt_atan2(crt_sqrt(x * x + y * y), dot3(away, crt_load3(own->direction)));
    if (theta < vertical[0] || theta > vertical[rows - 1u]) return 0.0f;
    const u32 row = crt_interval(vertical, rows, theta);
    const f32 t = (theta - vertical[row]) / (vertical[row + 1u] - vertical[row]);
    u32 column = 0u, next = 0u;
    f32 s = 0.0f;
    if (form->horizontal.count > 1u) {
        const f32 angle = crt_atan2(y, x);
        const f32 phi = angle < 0.0f ? angle + 2.0f * CRT_PI : angle;
        column = crt_interval(horizontal, form->horizontal.count, phi);
        next = column + 1u;
        s = crt_min((phi - horizontal[column]) / (horizontal[next] - horizontal[column]), 1.0f);
    }
    const f32 lower = shares[column * rows + row] * (1.0f - s) + shares[next * rows + row] * s;
    const f32 upper = shares[column * rows + row + 1u] * (1.0f - s) + shares[next * rows + row + 1u] * s;
    return lower * (1.0f - t) + upper * t;
}

/* The distance of p along a beam; 0 or less where p is outside it. */
CRT_FN f32 crt_beam_distance(const CrtContext *ctx, CRT_GLOBAL const CrtPointLight *own, int disk, vec3 p) {
    CRT_GLOBAL const CrtLightForm *form = crt_light_form(ctx, own);
    const vec3 d = p - crt_load3(own->position);
    const f32 x = dot3(d, crt_load3(form->u)), y = dot3(d, crt_load3(form->v));
    const int inside = disk ? x * x + y * y <= form->half_u * form->half_u
                            : crt_abs(x) <= form->half_u && crt_abs(y) <= form->half_v;
    return inside ? dot3(d, crt_load3(own->direction)) : 0.0f;
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
    if (light->kind >= CRT_LIGHT_DISK_BEAM) {
        s.wi = -crt_load3(own->direction);
        s.distance = crt_beam_distance(ctx, own, light->kind == CRT_LIGHT_DISK_BEAM, p);
        s.point = crt_fma3(s.wi, s.distance, p);
        if (!(s.distance > 0.0f)) s.irradiance = 0.0f;
        return s;
    }
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
    if (light->kind == CRT_LIGHT_IES) s.irradiance = s.irradiance * crt_ies_share(ctx, own, -s.wi);
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
