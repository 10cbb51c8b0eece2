/*
 * shape_light.h: shapes that emit, as light.h has triangles: crt_shape_light_sample and
 * crt_shape_light_pdf. A whole sphere is sampled by the cone of directions in which it is seen; every other
 * shape uniformly on its area. From inside a sphere and from its own surface, and from so near that a
 * point's weight may exceed CRT_AREA_WEIGHT_MAX, scattered rays alone find it. The point and the light
 * alone decide which of these holds.
 */
#ifndef CRT_SHAPE_LIGHT_H
#define CRT_SHAPE_LIGHT_H

#include "kernel/lights/light.h"

CRT_KERNEL_BEGIN

CRT_FN int crt_is_shape_light(const CrtContext *ctx, u32 light) {
    if (!CRT_HAS(SHAPES)) return 0;
    return CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights)[light].kind == CRT_LIGHT_SHAPE;
}

/* The technique that samples a shape from a point, and its inputs. */
typedef struct CrtShapeView {
    u32 technique;        /* CRT_LIGHT_BY_… */
    vec3 towards;         /* the centre, from the point */
    f32 distance2;        /* squared, of the centre */
    f32 one_minus_cosine; /* by solid angle: of the cone's edge with its axis */
} CrtShapeView;

/* A lower bound of the distance of a point from a shape; q: the point, in its frame. */
CRT_FN f32 crt_shape_distance(CRT_GLOBAL const CrtShape *shape, vec3 q) {
    const f32 z = V3Z(q);
    const f32 r = crt_sqrt(crt_fma(V3X(q), V3X(q), V3Y(q) * V3Y(q)));
    if (shape->kind == CRT_SHAPE_SPHERE) return crt_abs(length3(q) - shape->radius);
    const f32 along = crt_max(0.0f, crt_max(shape->from_z - z, z - shape->to_z));
    const f32 across =
        shape->kind == CRT_SHAPE_DISK ? crt_max(0.0f, r - shape->radius) : crt_abs(r - shape->radius);
    const f32 height = shape->kind == CRT_SHAPE_DISK ? z : along;
    return crt_sqrt(crt_fma(across, across, height * height));
}

/* clearance: of the shape, within which a point of its surface is known. */
CRT_FN CrtShapeView crt_shape_view(CRT_GLOBAL const CrtLight *light, CRT_GLOBAL const CrtShape *shape,
                                   f32 clearance, vec3 p) {
    const f32 radius2 = shape->radius * shape->radius, outside = shape->radius + clearance;
    CrtShapeView v;
    v.towards = crt_load3(shape->centre) - p;
    v.distance2 = dot3(v.towards, v.towards);
    v.one_minus_cosine = 0.0f;
    v.technique = CRT_LIGHT_BY_CHANCE;
    if (CRT_HAS(OPACITY) && (light->flags & CRT_LIGHT_UNSAMPLED) != 0u) return v;
    if (shape->kind == CRT_SHAPE_SPHERE && shape->from_z < -shape->radius && shape->to_z > shape->radius) {
        if (!(outside * outside < v.distance2)) return v;
        const f32 sine2 = radius2 / v.distance2;
        v.one_minus_cosine = sine2 / (1.0f + crt_sqrt(1.0f - sine2));
        v.technique = CRT_LIGHT_BY_SOLID_ANGLE;
        return v;
    }
    const f32 nearest = crt_shape_distance(shape, crt_in_frame(shape, -v.towards));
    if (light->area <= CRT_AREA_WEIGHT_MAX * nearest * nearest) v.technique = CRT_LIGHT_BY_AREA;
    return v;
}

/* pdf per steradian of a direction that meets the shape with `cosine` at `distance`, given the light. */
CRT_FN f32 crt_shape_density(CrtShapeView view, f32 area, f32 cosine, f32 distance) {
    if (view.technique == CRT_LIGHT_BY_CHANCE) return 0.0f;
    if (view.technique == CRT_LIGHT_BY_SOLID_ANGLE)
        return view.one_minus_cosine > 0.0f ? 0.5f * CRT_INV_PI / view.one_minus_cosine : 0.0f;
    return cosine > 0.0f ? distance * distance / (cosine * area) : 0.0f;
}

/* A uniform point on a shape, from its centre, and its normal, outwards, a disk's along z. */
CRT_FN vec3 crt_shape_point(CRT_GLOBAL const CrtShape *shape, CrtRandom2 u, vec3 *normal) {
    const vec3 ex = crt_load3(shape->x), ey = crt_load3(shape->y), ez = crt_load3(shape->z);
    const f32 radius = shape->radius;
    if (shape->kind == CRT_SHAPE_DISK) {
        const CrtRandom2 d = crt_concentric_disk(u);
        *normal = ez;
        return ex * (d.x * radius) + ey * (d.y * radius);
    }
    f32 cosine;
    const f32 sine = crt_sincos(2.0f * CRT_PI * u.y, &cosine);
    const f32 lowest = shape->kind == CRT_SHAPE_SPHERE ? crt_max(shape->from_z, -radius) : shape->from_z;
    const f32 highest = shape->kind == CRT_SHAPE_SPHERE ? crt_min(shape->to_z, radius) : shape->to_z;
    const f32 z = crt_fma(u.x, highest - lowest, lowest);
    const vec3 across = ex * cosine + ey * sine;
    *normal = across;
    if (shape->kind == CRT_SHAPE_CYLINDER) return across * radius + ez * z;
    const f32 height = z / radius;
    *normal = across * crt_sqrt(crt_max(0.0f, 1.0f - height * height)) + ez * height;
    return *normal * radius;
}

/* As crt_light_sample. */
CRT_FN CrtLightSample crt_shape_light_sample(const CrtContext *ctx, u32 index, CrtSampler *sampler,
                                             u32 dimension, vec3 p) {
    CRT_GLOBAL const CrtLight *light = CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights) + index;
    CRT_GLOBAL const CrtTriangle *record =
        CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles) + light->slot;
    CRT_GLOBAL const CrtFace *face = CRT_ARRAY(CrtFace, ctx->blob, ctx->scene->faces) + light->slot;
    CRT_GLOBAL const CrtShape *shape = crt_shape_of(ctx, record->shape - 1u);
    const CrtShapeView view = crt_shape_view(light, shape, face->clearance, p);
    CrtLightSample s;
    s.pdf = s.reach = s.cosine = s.distance = 0.0f;
    s.point = p;
    s.wi = s.normal = crt_load3(shape->z);
    if (view.technique == CRT_LIGHT_BY_CHANCE) return s;
    const CrtRandom2 u = crt_sample_2d(sampler, dimension + CRT_DIM_LIGHT);
    vec3 normal;
    if (view.technique == CRT_LIGHT_BY_SOLID_ANGLE) {
        const f32 fallen = u.x * view.one_minus_cosine; /* 1 − cos of the angle from the axis */
        const f32 sine2 = fallen * (2.0f - fallen);
        f32 cosine;
        const f32 sine = crt_sincos(2.0f * CRT_PI * u.y, &cosine);
        const CrtFrame frame = crt_frame(view.towards * (1.0f / crt_sqrt(view.distance2)));
        const f32 across = crt_sqrt(crt_max(0.0f, sine2));
        s.wi = crt_to_world(frame, make_vec3(across * cosine, across * sine, 1.0f - fallen));
        /* The first of the two places: from the centre, across the direction and against it. */
        const vec3 off = s.wi * dot3(view.towards, s.wi) - view.towards;
        const f32 deep = crt_fma(shape->radius, shape->radius, -dot3(off, off));
        normal = normalize3(off - s.wi * crt_sqrt(crt_max(0.0f, deep)));
        s.point = crt_fma3(normal, shape->radius, crt_load3(shape->centre));
    } else {
        s.point = crt_load3(shape->centre) + crt_shape_point(shape, u, &normal);
    }
    const vec3 d = s.point - p;
    s.distance = length3(d);
    if (!(s.distance > 0.0f)) return s;
    s.wi = d * (1.0f / s.distance);
    s.normal = normal;
    const f32 facing = -dot3(normal, s.wi) * shape->facing;
    if (!(facing > 0.0f || ((light->flags & CRT_LIGHT_TWO_SIDED) != 0u && facing < 0.0f))) return s;
    s.cosine = crt_abs(facing);
    s.pdf = light->choice_probability * crt_shape_density(view, light->area, s.cosine, s.distance);
    if (s.pdf > 0.0f) s.reach = crt_reach(face->clearance, s.cosine, s.distance);
    return s;
}

/* As crt_light_pdf, of the place where a scattered ray met the light. */
CRT_FN CrtLightSeen crt_shape_light_pdf(const CrtContext *ctx, u32 index, vec3 p, vec3 point, vec3 normal) {
    CRT_GLOBAL const CrtLight *light = CRT_ARRAY(CrtLight, ctx->blob, ctx->scene->lights) + index;
    CRT_GLOBAL const CrtTriangle *record =
        CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles) + light->slot;
    CRT_GLOBAL const CrtFace *face = CRT_ARRAY(CrtFace, ctx->blob, ctx->scene->faces) + light->slot;
    const CrtShapeView view =
        crt_shape_view(light, crt_shape_of(ctx, record->shape - 1u), face->clearance, p);
    const vec3 d = point - p;
    const f32 distance = length3(d);
    CrtLightSeen seen;
    seen.cosine = crt_abs(dot3(normal, d)) / distance;
    seen.pdf = light->choice_probability * crt_shape_density(view, light->area, seen.cosine, distance);
    return seen;
}

CRT_KERNEL_END

#endif
