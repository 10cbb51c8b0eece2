/*
 * light.h: sampling the lights: crt_light_choose, then crt_light_sample and crt_light_pdf for emitters,
 * crt_environment_sample and crt_environment_pdf for the environment. One emissive triangle, or two that
 * make a parallelogram, is one light, chosen by power, and so is the environment in scenes that request
 * this. A triangle whose radiance is a texture is many lights, its tiles, each chosen by its own power, so
 * that bright texels are found. crt_light_view decides how a point on a light is sampled, by the shaded
 * point and the light alone, for both sampling and the pdf: uniformly in solid angle where the light looks
 * large, else uniformly on its area; where neither works, scattered rays alone find it.
 */
#ifndef CRT_LIGHT_H
#define CRT_LIGHT_H

#include "kernel/geometry/surface.h"
#include "kernel/lights/environment_image.h"
#include "kernel/sampling/warp.h"

CRT_KERNEL_BEGIN

/* Area over squared distance above which a light is sampled by solid angle. Below, area sampling has nearly
   the same variance at a fifth of the cost; above, its 1/r² and cosine make it noisy. */
#define CRT_SOLID_ANGLE_THRESHOLD 0.3f

/* A light seen as nearly a hemisphere is left to chance: scattered rays almost always find it. */
#define CRT_SOLID_ANGLE_MAX 6.0f

/* Least height over the emitter's plane, as a share of the distance to its farthest corner, at which
   directions uniform in solid angle are found in single precision: nearer, corners lie on the horizon, some
   across from each other, and rounding turns the arcs between them by more than 1e-3. */
#define CRT_SOLID_ANGLE_HEIGHT 2.5e-4f

/* Nearer to the plane than that, points are sampled by area where the largest weight of one, area · cosine
   / distance² at the emitter's nearest point, is at most this. Elsewhere the emitter is within a few
   heights, and left to chance. */
#define CRT_AREA_WEIGHT_MAX 32.0f

typedef struct CrtLightSample {
    vec3 wi;      /* unit, from the shaded point */
    f32 pdf;      /* per steradian, with the probability of choosing this light; 0: no light from here */
    vec3 point;   /* on the emitter */
    vec3 normal;  /* of the emitter */
    f32 cosine;   /* of wi with the emitter's plane; above 0 */
    f32 distance; /* of `point` */
    f32 reach;    /* share of the way to `point` that is sure to end before the emitter */
} CrtLightSample;

/* Rounding of the place where a ray meets a surface, over the length of the ray: of its direction and
   length, and of the differences, shears and products of the surface's test. Measured
   (tests/unit_reach.cpp): .36 of it would do. */
#define CRT_RAY_ERROR CRT_GAMMA(16.0f)

/* Share of the way to a point on an emitter that is sure to end before the emitter. Clearance and rounding
   move the place where the ray meets the emitter's plane by one over the cosine of what they are across it.
   The clearance grows with the emitter's size and coordinates: of a small emitter in the middle of a scene
   it is less than the rounding that grows with the distance. */
CRT_FN f32 crt_reach(f32 clearance, f32 cosine, f32 distance) {
    return 1.0f - crt_fma(distance, CRT_RAY_ERROR, clearance) / (cosine * distance);
}

/* Solid angle of the triangle of the unit vectors a, b, c, given their |a·(b×c)|: tan(Ω/2) = |a·(b×c)|
   / (1 + a·b + b·c + c·a) (Van Oosterom and Strackee 1983); accurate for the smallest triangles. */
CRT_HOT_FN f32 crt_solid_angle(f32 triple, vec3 a, vec3 b, vec3 c) {
    return 2.0f * crt_atan2(triple, 1.0f + dot3(a, b) + dot3(b, c) + dot3(c, a));
}

/* An emitter's shape: the triangle o, o + a, o + b, or the parallelogram of the edges a and b at o. */
typedef struct CrtLightShape {
    vec3 o, a, b;
    vec3 normal;
    f32 area;
    int parallelogram;
} CrtLightShape;

/* The tile of a triangle that has the shape s. */
CRT_FN CrtLightShape crt_tile_shape(CrtLightShape s, u32 corner) {
    const f32 share = 1.0f / (f32)CRT_TILE_ROWS(corner);
    const u32 place = CRT_TILE_PLACE(corner), upside_down = place & 1u;
    s.a = s.a * share;
    s.b = s.b * share;
    s.o = crt_fma3(s.a, (f32)((place >> 1u) + upside_down),
                   crt_fma3(s.b, (f32)(CRT_TILE_ROW(corner) + upside_down), s.o));
    if (upside_down != 0u) {
        s.a = -s.a;
        s.b = -s.b;
    }
    return s;
}

CRT_FN CrtLightShape crt_light_shape(const CrtContext *ctx, CRT_GLOBAL const CrtLight *emitter) {
    CRT_GLOBAL const CrtTriangle *triangle =
        CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles) + emitter->slot;
    CRT_GLOBAL const CrtFace *face = CRT_ARRAY(CrtFace, ctx->blob, ctx->scene->faces) + emitter->slot;
    const int tile = CRT_HAS(EMISSION_IMAGE) && emitter->kind == CRT_LIGHT_TILE;
    const u32 corner = tile ? 0u : emitter->corner;
    CrtLightShape s;
    s.o = crt_triangle_vertex(triangle, corner);
    s.a = crt_triangle_vertex(triangle, corner == 2u ? 0u : corner + 1u) - s.o;
    s.b = crt_triangle_vertex(triangle, corner == 0u ? 2u : corner - 1u) - s.o;
    s.normal = crt_load3(face->normal);
    s.area = emitter->area;
    s.parallelogram = emitter->kind == CRT_LIGHT_PARALLELOGRAM;
    return tile ? crt_tile_shape(s, emitter->corner) : s;
}

/* The row of the light table that a place on an emitter belongs to. */
CRT_FN u32 crt_light_at(const CrtContext *ctx, const CrtSurface *surface) {
    if (!CRT_HAS(EMISSION_IMAGE)) return surface->light;
    CRT_GLOBAL const CrtLight *first = CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights) + surface->light;
    if (first->kind != CRT_LIGHT_TILE) return surface->light;
    const u32 rows = CRT_TILE_ROWS(first->corner), last = rows - 1u;
    const f32 x = surface->at.b1 * (f32)rows, y = surface->at.b2 * (f32)rows;
    u32 row = (u32)y, column = (u32)x;
    if (row > last) row = last;
    if (column > last - row) column = last - row;
    const int beyond = x - (f32)column + (y - (f32)row) > 1.0f;
    return surface->light + CRT_TILES_BEFORE(rows, row) + 2u * column +
           (beyond && column + row < last ? 1u : 0u);
}

/* The radiance of an emitter at a point of it, at the path's wavelengths. */
CRT_FN vec4 crt_emitted(const CrtContext *ctx, CRT_GLOBAL const CrtLight *light, vec3 point, vec4 position) {
    if (!CRT_HAS(EMISSION_IMAGE) || light->kind != CRT_LIGHT_TILE)
        return crt_value(ctx, light->radiance, 0, position);
    CRT_GLOBAL const CrtTriangle *triangle =
        CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles) + light->slot;
    const vec3 o = crt_triangle_vertex(triangle, 0u), d = point - o;
    const vec3 a = crt_triangle_vertex(triangle, 1u) - o, b = crt_triangle_vertex(triangle, 2u) - o;
    const vec3 n = cross3(a, b);
    const f32 scale = 1.0f / dot3(n, n);
    const f32 b1 = crt_clamp(dot3(cross3(d, b), n) * scale, 0.0f, 1.0f);
    const f32 b2 = crt_clamp(dot3(cross3(a, d), n) * scale, 0.0f, 1.0f - b1);
    const CrtFacePlace at = crt_face_place(ctx, triangle->id, 1.0f - b1 - b2, b1, b2);
    return crt_value_at(ctx, light->radiance, &at, position);
}

CRT_FN int crt_seen_large(CrtLightShape shape, vec3 p) {
    const vec3 d = shape.o + (shape.a + shape.b) * (shape.parallelogram ? 0.5f : 1.0f / 3.0f) - p;
    return shape.area > CRT_SOLID_ANGLE_THRESHOLD * dot3(d, d);
}

#define CRT_LIGHT_BY_AREA 0u
#define CRT_LIGHT_BY_SOLID_ANGLE 1u
#define CRT_LIGHT_BY_CHANCE 2u

/* The technique that samples an emitter from a point, and its inputs. */
typedef struct CrtLightView {
    u32 technique;
    f32 height;          /* of the point over the emitter's plane, against its normal: above 0 behind it */
    vec3 o, a, b, far;   /* by solid angle: unit directions to the corners */
    f32 triple, triple_far;
    f32 omega, omega_far; /* solid angles of the triangle at o and, for a parallelogram, of the one across
                             the diagonal */
} CrtLightView;

/* Squared distance of p from the nearest point of the segment o … o + edge. */
CRT_FN f32 crt_segment_distance2(vec3 o, vec3 edge, vec3 p) {
    const vec3 d = o - p;
    const f32 length2 = dot3(edge, edge);
    const f32 s = length2 > 0.0f ? crt_clamp(-dot3(d, edge) / length2, 0.0f, 1.0f) : 0.0f;
    const vec3 nearest = crt_fma3(edge, s, d);
    return dot3(nearest, nearest);
}

/* Squared distance of p from the emitter's edge, or 0 where p is over or under the emitter itself. */
CRT_FN f32 crt_edge_distance2(CrtLightShape s, vec3 p) {
    const vec3 d = p - s.o;
    const f32 aa = dot3(s.a, s.a), ab = dot3(s.a, s.b), bb = dot3(s.b, s.b);
    const f32 da = dot3(d, s.a), db = dot3(d, s.b);
    const f32 determinant = aa * bb - ab * ab;
    const f32 u = bb * da - ab * db, v = aa * db - ab * da; /* times the determinant */
    const f32 beyond = s.parallelogram ? crt_max(u, v) : u + v;
    if (u >= 0.0f && v >= 0.0f && beyond <= determinant) return 0.0f;
    const f32 at_o = crt_min(crt_segment_distance2(s.o, s.a, p), crt_segment_distance2(s.o, s.b, p));
    if (!s.parallelogram) return crt_min(at_o, crt_segment_distance2(s.o + s.a, s.b - s.a, p));
    return crt_min(
        at_o, crt_min(crt_segment_distance2(s.o + s.a, s.b, p), crt_segment_distance2(s.o + s.b, s.a, p)));
}

/* By pointer: called twice, it is not inlined, and copies of the shape in wide words wait for its narrow
 * stores. */
CRT_HOT_FN CrtLightView crt_light_view(const CrtLightShape *shape, vec3 p) {
    CrtLightView v;
    v.technique = CRT_LIGHT_BY_AREA;
    v.height = dot3(shape->normal, shape->o - p);
    v.omega = v.omega_far = v.triple = v.triple_far = 0.0f;
    if (!crt_seen_large(*shape, p)) return v;
    const vec3 o = shape->o - p;
    const vec3 a = o + shape->a, b = o + shape->b, far = a + shape->b;
    const f32 oo = dot3(o, o), aa = dot3(a, a), bb = dot3(b, b), ff = dot3(far, far);
    const f32 height = crt_abs(v.height);
    const f32 farthest2 = crt_max(crt_max(oo, crt_max(aa, bb)), shape->parallelogram ? ff : 0.0f);
    if (!(height * height > CRT_SOLID_ANGLE_HEIGHT * CRT_SOLID_ANGLE_HEIGHT * farthest2)) {
        const f32 distance2 = crt_edge_distance2(*shape, p);
        const f32 weight = shape->area * height;
        if (!(weight <= CRT_AREA_WEIGHT_MAX * distance2 * crt_sqrt(distance2)))
            v.technique = CRT_LIGHT_BY_CHANCE;
        return v;
    }
    const f32 inverse_o = 1.0f / crt_sqrt(oo), inverse_a = 1.0f / crt_sqrt(aa),
              inverse_b = 1.0f / crt_sqrt(bb), inverse_f = 1.0f / crt_sqrt(ff);
    v.o = o * inverse_o;
    v.a = a * inverse_a;
    v.b = b * inverse_b;
    v.far = far * inverse_f;
    /* Six times the volume of p and the triangle: from height and area, since a product of vectors near one
     * plane would be rounding. */
    const f32 volume = height * shape->area * (shape->parallelogram ? 1.0f : 2.0f) * (inverse_a * inverse_b);
    v.triple = volume * inverse_o;
    v.omega = crt_solid_angle(v.triple, v.o, v.a, v.b);
    if (shape->parallelogram) {
        v.triple_far = volume * inverse_f;
        v.omega_far = crt_solid_angle(v.triple_far, v.far, v.b, v.a);
    }
    v.technique =
        v.omega + v.omega_far < CRT_SOLID_ANGLE_MAX ? CRT_LIGHT_BY_SOLID_ANGLE : CRT_LIGHT_BY_CHANCE;
    return v;
}

/* pdf per steradian of a direction that meets the emitter's plane with `cosine` at `distance`, given the
 * emitter; 0 where it is left to chance. */
CRT_FN f32 crt_light_density(CrtLightView view, f32 area, f32 cosine, f32 distance) {
    if (view.technique == CRT_LIGHT_BY_CHANCE) return 0.0f;
    if (view.technique == CRT_LIGHT_BY_SOLID_ANGLE) {
        const f32 omega = view.omega + view.omega_far;
        return omega > 0.0f ? 1.0f / omega : 0.0f;
    }
    return cosine > 0.0f ? distance * distance / (cosine * area) : 0.0f;
}

/* The part of v perpendicular to unit n, normalised. */
CRT_FN vec3 crt_perpendicular(vec3 v, vec3 n) { return normalize3(v - n * dot3(v, n)); }

/*
 * A direction uniform in the solid angle `omega` of the spherical triangle a, b, c, whose |a·(b×c)| is
 * `triple` (after Arvo 1995). The side from a to c is cut at x so that a, b, x has the wanted part w of the
 * area; then a point on the arc from b to x is chosen. With Todhunter's tan(w/2) = tan(ab/2) tan(ax/2) sin
 * α / (1 + tan(ab/2) tan(ax/2) cos α) (1886, § 103) the cut is at tan(ax/2) = sin(w/2) / (tan(ab/2)
 * sin(α − w/2)).
 */
CRT_HOT_FN vec3 crt_sample_spherical_triangle(vec3 a, vec3 b, vec3 c, f32 triple, f32 omega, CrtRandom2 u) {
    /* The longest side, which may be nearly half a circle, is the one that is cut: arcs from the corner
     * across from it are shorter. */
    const f32 ab = dot3(a, b), bc = dot3(b, c), ca = dot3(c, a);
    vec3 p = a, q = b, r = c;
    f32 pq = ab, qr = bc, rp = ca;
    if (ab < bc && ab < ca) {
        p = b; q = c; r = a;
        pq = bc; qr = ca; rp = ab;
    } else if (bc < ca) {
        p = c; q = a; r = b;
        pq = ca; qr = ab; rp = bc;
    }
    const f32 alpha = crt_atan2(triple, qr - pq * rp);
    const f32 half_area = 0.5f * u.x * omega;
    f32 unused;
    const f32 numerator = crt_sincos(half_area, &unused) * length3(p + q);
    const f32 denominator = crt_sincos(crt_max(alpha - half_area, 0.0f), &unused) * length3(p - q);
    /* cos and sin of the arc from p to the cut, from numerator / denominator = tan of its half. */
    const f32 squares = numerator * numerator + denominator * denominator;
    const f32 scale = squares > 0.0f ? 1.0f / squares : 0.0f;
    const f32 cos_cut = (denominator * denominator - numerator * numerator) * scale;
    const f32 sin_cut = 2.0f * numerator * denominator * scale;
    const vec3 cut = p * cos_cut + crt_perpendicular(r, p) * sin_cut;
    const vec3 chord = q - cut;
    const f32 one_minus_cos = 0.5f * u.y * dot3(chord, chord);
    const f32 cos_theta = 1.0f - one_minus_cos;
    const f32 sin_theta = crt_sqrt(crt_max(0.0f, one_minus_cos * (2.0f - one_minus_cos)));
    const vec3 towards = cut - q * dot3(cut, q);
    const f32 length = length3(towards);
    return length > 0.0f ? normalize3(q * cos_theta + towards * (sin_theta / length)) : q;
}

/* Of the lights index … end − 1 the last with a choice of at most `choice`, or the first. */
CRT_FN u32 crt_light_search(CRT_GLOBAL const CrtLight *lights, u32 index, u32 end, u32 choice) {
    while (end - index > 1u) {
        const u32 middle = (index + end) >> 1;
        if (lights[middle].choice <= choice) index = middle;
        else end = middle;
    }
    return index;
}

/* Chooses a light to sample, by power. The scene must have a light. */
CRT_FN u32 crt_light_choose(const CrtContext *ctx, CrtSampler *sampler, u32 dimension) {
    CRT_GLOBAL const CrtLight *lights = CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights);
    const u32 end = ctx->scene->lights.count;
    if (end <= 1u) return 0u;
    return crt_light_search(lights, 0u, end, crt_sample_bits(sampler, dimension + CRT_DIM_LIGHT_CHOICE));
}

/* The emitter as seen from p. */
CRT_HOT_FN CrtLightView crt_emitter_view(CRT_GLOBAL const CrtLight *light, const CrtLightShape *shape,
                                         vec3 p) {
    CrtLightView view = crt_light_view(shape, p);
    if (CRT_HAS(OPACITY) && (light->flags & CRT_LIGHT_UNSAMPLED) != 0u) view.technique = CRT_LIGHT_BY_CHANCE;
    return view;
}

/* A direction from p to a point of the light. */
CRT_FN CrtLightSample crt_light_sample(const CrtContext *ctx, u32 index, CrtSampler *sampler, u32 dimension,
                                       vec3 p) {
    CRT_GLOBAL const CrtLight *light = CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights) + index;
    CrtLightSample s;
    const CrtLightShape shape = crt_light_shape(ctx, light);
    const CrtLightView view = crt_emitter_view(light, &shape, p);
    s.pdf = 0.0f;
    s.reach = 0.0f;
    s.point = p;
    s.wi = s.normal = shape.normal;
    s.cosine = s.distance = 0.0f;
    const int two_sided = (light->flags & CRT_LIGHT_TWO_SIDED) != 0u;
    /* Nothing to sample where the emitter's dark side is seen, or its plane. */
    if (view.technique == CRT_LIGHT_BY_CHANCE || !(view.height < 0.0f || (two_sided && view.height > 0.0f)))
        return s;
    CrtRandom2 u = crt_sample_2d(sampler, dimension + CRT_DIM_LIGHT);
    f32 cosine, distance;
    if (view.technique == CRT_LIGHT_BY_SOLID_ANGLE) {
        const f32 split = view.omega / (view.omega + view.omega_far);
        if (u.x < split || view.omega_far == 0.0f) {
            u.x = view.omega_far == 0.0f ? u.x : u.x / split;
            s.wi = crt_sample_spherical_triangle(view.o, view.a, view.b, view.triple, view.omega, u);
        } else {
            u.x = (u.x - split) / (1.0f - split);
            s.wi =
                crt_sample_spherical_triangle(view.far, view.b, view.a, view.triple_far, view.omega_far, u);
        }
        cosine = dot3(shape.normal, s.wi);
        distance = view.height / cosine;
        s.point = crt_fma3(s.wi, distance, p);
        if (!(distance > 0.0f)) return s; /* a direction along the plane, by rounding */
    } else {
        if (!shape.parallelogram) { /* uniform in the triangle */
            const f32 root = crt_sqrt(u.x);
            u.x = root * (1.0f - u.y);
            u.y = root * u.y;
        }
        s.point = crt_fma3(shape.a, u.x, crt_fma3(shape.b, u.y, shape.o));
        const vec3 d = s.point - p;
        distance = length3(d);
        s.wi = d * (1.0f / distance);
        cosine = view.height / distance; /* the same for all points of the plane but for the distance */
    }
    s.cosine = crt_abs(cosine);
    s.distance = distance;
    s.pdf = light->choice_probability * crt_light_density(view, shape.area, s.cosine, distance);
    CRT_GLOBAL const CrtFace *face = CRT_ARRAY(CrtFace, ctx->blob, ctx->scene->faces) + light->slot;
    if (s.pdf > 0.0f) s.reach = crt_reach(face->clearance, s.cosine, distance);
    return s;
}

/* A light met by a scattered ray, as crt_light_sample has it. */
typedef struct CrtLightSeen {
    f32 pdf;    /* per steradian at p; 0: light sampling does not find it */
    f32 cosine; /* with the emitter's plane, of the direction from p */
} CrtLightSeen;

CRT_FN CrtLightSeen crt_light_pdf(const CrtContext *ctx, u32 index, vec3 p, f32 distance) {
    CRT_GLOBAL const CrtLight *light = CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights) + index;
    const CrtLightShape shape = crt_light_shape(ctx, light);
    const CrtLightView view = crt_emitter_view(light, &shape, p);
    CrtLightSeen seen;
    seen.cosine = crt_abs(view.height) / distance;
    seen.pdf = light->choice_probability * crt_light_density(view, shape.area, seen.cosine, distance);
    return seen;
}

/* The environment among the lights. If it is the same in every direction, directions are sampled by their
 * cosine with the shading normal ns, on the side of w_o, since light counts by that cosine; scattered rays
 * alone find light from the other side. If it has an image, directions are sampled by its radiance, on both
 * sides. */
typedef struct CrtEnvironmentSample {
    vec3 wi; /* unit */
    CrtEnvironmentPlace place; /* of wi */
    f32 pdf; /* per steradian, with the probability of choosing the environment; 0: none */
} CrtEnvironmentSample;

/* True if the environment depends on the direction. */
CRT_FN int crt_has_environment_image(const CrtContext *ctx) {
    return CRT_HAS(ENVIRONMENT_IMAGE) && ctx->scene->environment_image.count != 0u;
}

/* The place in the environment that a direction leads to. */
CRT_FN CrtEnvironmentPlace crt_environment_towards(const CrtContext *ctx, vec3 d) {
    if (!crt_has_environment_image(ctx)) return crt_no_place();
    return crt_environment_place(crt_environment_image(ctx), d);
}

CRT_FN vec4 crt_environment_radiance(const CrtContext *ctx, CrtEnvironmentPlace place, vec4 position) {
    if (crt_has_environment_image(ctx)) return crt_environment_texel(ctx, place, position);
    return crt_value(ctx, ctx->scene->environment, 0, position);
}

/* pdf of a direction that leads to `place`, with the cosine `cos_s` with ns. */
CRT_FN f32 crt_environment_pdf(const CrtContext *ctx, CrtEnvironmentPlace place, f32 cos_s) {
    CRT_GLOBAL const CrtLight *lights = CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights);
    return lights[ctx->scene->environment_light - 1u].choice_probability *
           (crt_has_environment_image(ctx) ? crt_environment_density(ctx, place) : crt_lambert(cos_s));
}

CRT_FN CrtEnvironmentSample crt_environment_sample(const CrtContext *ctx, CrtSampler *sampler, u32 dimension,
                                                   vec3 ns) {
    CrtEnvironmentSample s;
    const CrtRandom2 u = crt_sample_2d(sampler, dimension + CRT_DIM_LIGHT);
    s.place = crt_no_place();
    s.wi = crt_has_environment_image(ctx) ? crt_environment_direction(ctx, u, &s.place)
                                          : crt_cosine_direction(ns, u);
    s.pdf = crt_environment_pdf(ctx, s.place, dot3(s.wi, ns));
    return s;
}

CRT_KERNEL_END

#endif
