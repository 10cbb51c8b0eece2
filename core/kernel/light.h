/*
 * light.h: sampling the emitters. One emissive triangle is one light, chosen by power; a point on it is chosen by solid angle where the triangle
 * is seen large, else by area.
 */
#ifndef CRT_LIGHT_H
#define CRT_LIGHT_H

#include "bsdf.h"

CRT_KERNEL_BEGIN

/* Area over squared distance above which a triangle is sampled by solid angle (Arvo 1995). Below, area sampling has nearly the same variance at a
   fifth of the cost; above, its 1/r² and cosine make it noisy. The choice depends on the triangle and the point alone, so that sampling and pdf agree. */
#define CRT_SOLID_ANGLE_THRESHOLD 0.3f

typedef struct CrtLightSample {
    vec3 point;   /* on the emitter, moved off it towards the shaded point */
    vec3 wi;      /* unit, from the shaded point */
    f32 pdf;      /* per steradian, with the probability of choosing this emitter; 0: no light from here */
    u32 spectrum;
} CrtLightSample;

/* |a·(b×c)| / (1 + a·b + b·c + c·a) = tan(Ω/2) for unit vectors (Van Oosterom and Strackee 1983); accurate for the smallest triangles. */
CRT_FN f32 crt_solid_angle(vec3 a, vec3 b, vec3 c) {
    const f32 triple = crt_abs(dot3(a, cross3(b, c)));
    return 2.0f * crt_atan2(triple, 1.0f + dot3(a, b) + dot3(b, c) + dot3(c, a));
}

CRT_FN int crt_seen_large(vec3 p0, vec3 p1, vec3 p2, f32 area, vec3 p) {
    const vec3 d = (p0 + p1 + p2) * (1.0f / 3.0f) - p;
    return area > CRT_SOLID_ANGLE_THRESHOLD * dot3(d, d);
}

/* The part of v perpendicular to unit n, normalised. */
CRT_FN vec3 crt_perpendicular(vec3 v, vec3 n) { return normalize3(v - n * dot3(v, n)); }

/* A direction uniform in the solid angle `omega` of the spherical triangle a, b, c (Arvo 1995, in PBRT 4e's form). */
CRT_FN vec3 crt_sample_spherical_triangle(vec3 a, vec3 b, vec3 c, f32 omega, CrtRandom2 u) {
    const vec3 n_ab = normalize3(cross3(a, b));
    const vec3 n_ca = normalize3(cross3(c, a));
    const f32 cos_alpha = crt_clamp(-dot3(n_ab, n_ca), -1.0f, 1.0f);
    const f32 sin_alpha = crt_sqrt(crt_max(0.0f, 1.0f - cos_alpha * cos_alpha));
    f32 cos_x;
    const f32 sin_x = crt_sincos(u.x * omega, &cos_x);
    const f32 sin_phi = cos_x * sin_alpha - sin_x * cos_alpha;
    const f32 cos_phi = -cos_x * cos_alpha - sin_x * sin_alpha;
    const f32 k1 = cos_phi + cos_alpha;
    const f32 k2 = sin_phi - sin_alpha * dot3(a, b);
    const f32 denominator = (k2 * sin_phi + k1 * cos_phi) * sin_alpha;
    f32 cos_b = denominator != 0.0f ? (k2 + (k2 * cos_phi - k1 * sin_phi) * cos_alpha) / denominator : 1.0f;
    cos_b = crt_clamp(cos_b, -1.0f, 1.0f);
    const f32 sin_b = crt_sqrt(crt_max(0.0f, 1.0f - cos_b * cos_b));
    const vec3 c_cut = a * cos_b + crt_perpendicular(c, a) * sin_b;
    const f32 cos_theta = 1.0f - u.y * (1.0f - dot3(c_cut, b));
    const f32 sin_theta = crt_sqrt(crt_max(0.0f, 1.0f - cos_theta * cos_theta));
    const vec3 towards = c_cut - b * dot3(c_cut, b);
    const f32 length = length3(towards);
    return length > 0.0f ? normalize3(b * cos_theta + towards * (sin_theta / length)) : b;
}

/* Chooses a light and a point on it for the point p. */
CRT_FN CrtLightSample crt_sample_light(const CrtContext *ctx, CrtSampler *sampler, u32 dimension, vec3 p) {
    CRT_GLOBAL const CrtEmitter *emitters = CRT_ARRAY(CrtEmitter, ctx->blob, ctx->scene->emitters);
    u32 index = 0u;
    u32 end = ctx->scene->emitters.count;
    if (end > 1u) {
        const u32 choice = crt_sample_bits(sampler, dimension + CRT_DIM_LIGHT_CHOICE);
        while (end - index > 1u) {
            const u32 middle = (index + end) >> 1;
            if (emitters[middle].choice <= choice) index = middle;
            else end = middle;
        }
    }
    CRT_GLOBAL const CrtEmitter *emitter = emitters + index;
    CRT_GLOBAL const CrtTriangle *triangle = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles) + emitter->slot;
    const vec3 p0 = crt_triangle_vertex(triangle, 0u);
    const vec3 p1 = crt_triangle_vertex(triangle, 1u);
    const vec3 p2 = crt_triangle_vertex(triangle, 2u);
    const vec3 normal = normalize3(cross3(p1 - p0, p2 - p0));
    const CrtRandom2 u = crt_sample_2d(sampler, dimension + CRT_DIM_LIGHT);
    const vec3 test_error = crt_splat3(crt_largest3(abs3(p1 - p0) + abs3(p2 - p0)) * CRT_TEST_ERROR); /* the shadow ray must end before the emitter */
    CrtLightSample s;
    s.spectrum = emitter->spectrum;
    s.pdf = 0.0f;
    vec3 point, error;
    if (crt_seen_large(p0, p1, p2, emitter->area, p)) {
        const vec3 a = normalize3(p0 - p);
        const vec3 b = normalize3(p1 - p);
        const vec3 c = normalize3(p2 - p);
        const f32 omega = crt_solid_angle(a, b, c);
        s.wi = crt_sample_spherical_triangle(a, b, c, omega, u);
        const f32 cosine = dot3(normal, s.wi);
        const f32 t = dot3(normal, p0 - p) / cosine;
        point = p + s.wi * t;
        error = (abs3(p) + abs3(point)) * CRT_GAMMA(9.0f) + test_error;
        const int lit = cosine < 0.0f || (emitter->flags & CRT_EMITTER_TWO_SIDED) != 0u;
        if (lit && t > 0.0f && omega > 0.0f) s.pdf = emitter->choice_probability / omega;
    } else {
        const f32 root = crt_sqrt(u.x);
        const f32 b0 = 1.0f - root;
        const f32 b1 = root * (1.0f - u.y);
        const f32 b2 = root * u.y;
        const vec3 q0 = p0 * b0;
        const vec3 q1 = p1 * b1;
        const vec3 q2 = p2 * b2;
        point = q0 + q1 + q2;
        error = (abs3(q0) + abs3(q1) + abs3(q2)) * CRT_GAMMA(9.0f) + test_error;
        const vec3 d = point - p;
        const f32 distance2 = dot3(d, d);
        s.wi = d / crt_sqrt(distance2);
        f32 cosine = -dot3(normal, s.wi);
        if ((emitter->flags & CRT_EMITTER_TWO_SIDED) != 0u) cosine = crt_abs(cosine);
        if (cosine > 0.0f) s.pdf = emitter->choice_probability * distance2 / (cosine * emitter->area);
    }
    s.point = crt_offset_origin(point, error, normal, -s.wi);
    return s;
}

/* pdf per steradian with which crt_sample_light at p would have found the point at distance t along w_i on an emitter. */
CRT_FN f32 crt_light_pdf(const CrtContext *ctx, u32 emitter_index, vec3 p, vec3 wi, f32 t) {
    CRT_GLOBAL const CrtEmitter *emitter = CRT_ARRAY(CrtEmitter, ctx->blob, ctx->scene->emitters) + emitter_index;
    CRT_GLOBAL const CrtTriangle *triangle = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles) + emitter->slot;
    const vec3 p0 = crt_triangle_vertex(triangle, 0u);
    const vec3 p1 = crt_triangle_vertex(triangle, 1u);
    const vec3 p2 = crt_triangle_vertex(triangle, 2u);
    if (crt_seen_large(p0, p1, p2, emitter->area, p)) {
        const f32 omega = crt_solid_angle(normalize3(p0 - p), normalize3(p1 - p), normalize3(p2 - p));
        return omega > 0.0f ? emitter->choice_probability / omega : 0.0f;
    }
    const f32 cosine = crt_abs(dot3(normalize3(cross3(p1 - p0, p2 - p0)), wi));
    return cosine > 0.0f ? emitter->choice_probability * t * t / (cosine * emitter->area) : 0.0f;
}

/* Veach's power heuristic for one sample of each technique, as a ratio so that a large pdf cannot overflow. */
CRT_FN f32 crt_power_heuristic(f32 pdf, f32 other) {
    const f32 ratio = other / pdf;
    return 1.0f / (1.0f + ratio * ratio);
}

CRT_KERNEL_END

#endif
