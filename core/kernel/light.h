/*
 * light.h: sampling the emitters. One emissive triangle, or two that make a parallelogram, is one light, chosen by power; a point on it is chosen
 * by solid angle where it is seen large, else by area.
 */
#ifndef CRT_LIGHT_H
#define CRT_LIGHT_H

#include "bsdf.h"

CRT_KERNEL_BEGIN

/* Area over squared distance above which a triangle is sampled by solid angle (Arvo 1995). Below, area sampling has nearly the same variance at a
   fifth of the cost; above, its 1/r² and cosine make it noisy. The choice depends on the triangle and the point alone, so that sampling and pdf agree. */
#define CRT_SOLID_ANGLE_THRESHOLD 0.3f

/* A light seen as nearly a hemisphere is left to chance hits, which find it all but always. Its corners lie on the horizon, some across from each
   other, and the arcs between them are hardly defined; area sampling would be noisy and weigh next to nothing. */
#define CRT_SOLID_ANGLE_MAX 6.0f

typedef struct CrtLightSample {
    vec3 point;   /* on the emitter */
    vec3 wi;      /* unit, from the shaded point */
    f32 reach;    /* share of the way to `point` that is sure to end before the emitter */
    f32 pdf;      /* per steradian, with the probability of choosing this emitter; 0: no light from here */
    u32 spectrum;
} CrtLightSample;

/* |a·(b×c)| / (1 + a·b + b·c + c·a) = tan(Ω/2) for unit vectors (Van Oosterom and Strackee 1983); accurate for the smallest triangles. */
CRT_FN f32 crt_solid_angle(vec3 a, vec3 b, vec3 c) {
    const f32 triple = crt_abs(dot3(a, cross3(b, c)));
    return 2.0f * crt_atan2(triple, 1.0f + dot3(a, b) + dot3(b, c) + dot3(c, a));
}

/* An emitter's shape: the triangle o, o + a, o + b, or the parallelogram of the edges a and b at o. */
typedef struct CrtLightShape {
    vec3 o, a, b;
    int parallelogram;
} CrtLightShape;

CRT_FN CrtLightShape crt_light_shape(const CrtContext *ctx, CRT_GLOBAL const CrtEmitter *emitter) {
    CRT_GLOBAL const CrtTriangle *triangle = CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles) + emitter->slot;
    const u32 corner = emitter->corner;
    CrtLightShape s;
    s.o = crt_triangle_vertex(triangle, corner);
    s.a = crt_triangle_vertex(triangle, corner == 2u ? 0u : corner + 1u) - s.o;
    s.b = crt_triangle_vertex(triangle, corner == 0u ? 2u : corner - 1u) - s.o;
    s.parallelogram = (emitter->flags & CRT_EMITTER_PARALLELOGRAM) != 0u;
    return s;
}

CRT_FN int crt_seen_large(CrtLightShape shape, f32 area, vec3 p) {
    const vec3 d = shape.o + (shape.a + shape.b) * (shape.parallelogram ? 0.5f : 1.0f / 3.0f) - p;
    return area > CRT_SOLID_ANGLE_THRESHOLD * dot3(d, d);
}

/* Solid angles of the triangle at o and, for a parallelogram, of the one across the diagonal. */
typedef struct CrtLightView {
    vec3 o, a, b, far; /* unit directions to the corners */
    f32 omega, omega_far;
    int usable; /* whether directions are to be sampled by solid angle */
    int left_to_chance; /* not to be sampled at all */
} CrtLightView;

CRT_FN CrtLightView crt_light_view(CrtLightShape shape, f32 area, vec3 p) {
    CrtLightView v;
    v.left_to_chance = 0;
    v.usable = crt_seen_large(shape, area, p);
    if (!v.usable) return v;
    v.o = normalize3(shape.o - p);
    v.a = normalize3(shape.o + shape.a - p);
    v.b = normalize3(shape.o + shape.b - p);
    v.far = normalize3(shape.o + shape.a + shape.b - p);
    v.omega = crt_solid_angle(v.o, v.a, v.b);
    v.omega_far = shape.parallelogram ? crt_solid_angle(v.far, v.b, v.a) : 0.0f;
    v.left_to_chance = !(v.omega + v.omega_far < CRT_SOLID_ANGLE_MAX);
    v.usable = !v.left_to_chance;
    return v;
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
    CRT_GLOBAL const CrtFace *face = CRT_ARRAY(CrtFace, ctx->blob, ctx->scene->faces) + emitter->slot;
    const CrtLightShape shape = crt_light_shape(ctx, emitter);
    const vec3 normal = crt_load3(face->normal);
    CrtRandom2 u = crt_sample_2d(sampler, dimension + CRT_DIM_LIGHT);
    CrtLightSample s;
    s.spectrum = emitter->spectrum;
    s.pdf = 0.0f;
    s.reach = 0.0f;
    f32 cosine, distance;
    const CrtLightView view = crt_light_view(shape, emitter->area, p);
    if (view.left_to_chance) {
        s.point = p;
        s.wi = normal;
        return s;
    }
    if (view.usable) {
        const f32 omega = view.omega + view.omega_far;
        const f32 split = view.omega / omega;
        if (u.x < split || view.omega_far == 0.0f) {
            u.x = view.omega_far == 0.0f ? u.x : u.x / split;
            s.wi = crt_sample_spherical_triangle(view.o, view.a, view.b, view.omega, u);
        } else {
            u.x = (u.x - split) / (1.0f - split);
            s.wi = crt_sample_spherical_triangle(view.far, view.b, view.a, view.omega_far, u);
        }
        cosine = -dot3(normal, s.wi);
        distance = -dot3(normal, shape.o - p) / cosine;
        s.point = crt_fma3(s.wi, distance, p);
        if (distance > 0.0f && omega > 0.0f) s.pdf = emitter->choice_probability / omega;
    } else {
        if (!shape.parallelogram) { /* uniform in the triangle */
            const f32 root = crt_sqrt(u.x);
            u.x = root * (1.0f - u.y);
            u.y = root * u.y;
        }
        s.point = crt_fma3(shape.a, u.x, crt_fma3(shape.b, u.y, shape.o));
        const vec3 d = s.point - p;
        const f32 distance2 = dot3(d, d);
        distance = crt_sqrt(distance2);
        s.wi = d * (1.0f / distance);
        cosine = -dot3(normal, s.wi);
        if (cosine != 0.0f) s.pdf = emitter->choice_probability * distance2 / (crt_abs(cosine) * emitter->area);
    }
    const int two_sided = (emitter->flags & CRT_EMITTER_TWO_SIDED) != 0u;
    if (!(cosine > 0.0f) && !(two_sided && cosine < 0.0f)) s.pdf = 0.0f;
    /* The shadow ray stops short of the emitter by its clearance, measured along the ray. */
    if (s.pdf > 0.0f) s.reach = 1.0f - face->clearance / (crt_abs(cosine) * distance);
    return s;
}

/* pdf per steradian with which crt_sample_light at p would have found the point at distance t along w_i on an emitter. */
CRT_FN f32 crt_light_pdf(const CrtContext *ctx, u32 emitter_index, vec3 p, vec3 wi, f32 t) {
    CRT_GLOBAL const CrtEmitter *emitter = CRT_ARRAY(CrtEmitter, ctx->blob, ctx->scene->emitters) + emitter_index;
    const CrtLightShape shape = crt_light_shape(ctx, emitter);
    const CrtLightView view = crt_light_view(shape, emitter->area, p);
    if (view.left_to_chance) return 0.0f;
    if (view.usable) {
        const f32 omega = view.omega + view.omega_far;
        return omega > 0.0f ? emitter->choice_probability / omega : 0.0f;
    }
    CRT_GLOBAL const CrtFace *face = CRT_ARRAY(CrtFace, ctx->blob, ctx->scene->faces) + emitter->slot;
    const f32 cosine = crt_abs(dot3(crt_load3(face->normal), wi));
    return cosine > 0.0f ? emitter->choice_probability * t * t / (cosine * emitter->area) : 0.0f;
}

/* Veach's power heuristic for one sample of each technique, as a ratio so that a large pdf cannot overflow. */
CRT_FN f32 crt_power_heuristic(f32 pdf, f32 other) {
    const f32 ratio = other / pdf;
    return 1.0f / (1.0f + ratio * ratio);
}

CRT_KERNEL_END

#endif
