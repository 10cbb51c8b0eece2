/*
 * passing.h: surfaces that a ray can pass without a scattering event: surfaces with opacity below 1, and
 * panes. The path keeps its last vertex, and with it the densities that weigh light sampling against
 * scattered rays, because both techniques see a light through the same surfaces. Passing counts neither
 * towards the depth nor as another ray. Roulette counts panes, because each costs another search.
 *
 * A pane transmits T(θ, λ) (pane.h), here with its tint. A shadow ray multiplies the light that it tests
 * by T. A path's ray passes with probability q, the mean of T over its wavelengths, and then carries T/q.
 * Otherwise it stops, carries 1/(1 − q), and crt_shade reflects 1 − T of it, T without the tint.
 */
#ifndef CRT_PASSING_H
#define CRT_PASSING_H

#include "kernel/geometry/surface.h"
#include "kernel/materials/composition.h"
#include "kernel/materials/medium.h"
#include "kernel/materials/pane.h"
#include "kernel/materials/tint.h"

CRT_KERNEL_BEGIN

/* True if the scene has surfaces that rays may pass. */
CRT_FN int crt_is_passable(const CrtContext *ctx) {
    return CRT_SCENE_HAS(ctx->scene, OPACITY) || crt_has_panes(ctx);
}

/* State of a ray while it passes surfaces. */
typedef struct CrtPassage {
    u32 dimension; /* where its random numbers begin */
    u32 passed;    /* surfaces so far */
    u32 panes;     /* of them, panes */
    int shadow;    /* nothing is mirrored */
    u32 media;     /* around the ray where it begins (medium.h) */
    u32 material;  /* in scenes with panes, what a mix that stops the ray is found to be of; or CRT_NONE */
    vec3 d;        /* unit: a shadow ray is turned to its end behind each surface, by rounding */
    vec4 position; /* of the path's wavelengths */
    vec4 carried;  /* the throughput of the path, or the light that a shadow ray tests */
} CrtPassage;

/* The state at the start of a path's ray, or of the shadow ray of its vertex. `dimension`: of the first
   surface (CRT_PASSING_DIMENSION). */
CRT_FN CrtPassage crt_passage(u32 dimension, int shadow, vec3 d, vec4 position, u32 media, vec4 carried) {
    CrtPassage way;
    way.dimension = dimension;
    way.passed = 0u;
    way.panes = 0u;
    way.shadow = shadow;
    way.media = media;
    way.material = CRT_NONE;
    way.d = d / crt_sqrt(dot3(d, d));
    way.position = position;
    way.carried = carried;
    return way;
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

/* True if a ray passes the pane that it meets. Updates the light that the ray carries. */
CRT_FN int crt_passes_pane(const CrtContext *ctx, const CrtSurface *surface, u32 material,
                           CrtSampler *sampler, u32 dimension, CrtPassage *way) {
    CRT_GLOBAL const CrtMaterial *row = CRT_ARRAY(CrtMaterial, ctx->blob, ctx->scene->materials) + material;
    if (row->type != CRT_MATERIAL_THIN_DIELECTRIC) return 0;
    const CrtMaterial made_of = *row;
    CrtBsdf pane;
    pane.flags = 0u;
    crt_prepare_pane(ctx, &pane, &made_of, surface, way->position);
    vec4 through = crt_pane_transmittance(&pane, crt_pane_cosine(surface, way->d));
    if (CRT_HAS(TINT)) through = through * crt_tint(ctx, made_of.flags, material, surface, way->position);
    if (way->shadow) {
        way->carried = way->carried * through;
        return max4(way->carried) > 0.0f;
    }
    f32 chance = 0.25f * sum4(through);
    /* An emissive pane stops at least half of the rays: only those that stop see its emission. */
    if (CRT_HAS(AREA_LIGHT) && surface->light != CRT_NONE) chance = 0.5f * chance;
    if (crt_sample_1d(sampler, dimension + CRT_DIM_PANE) < chance) {
        way->carried = way->carried * (through / chance);
        return 1;
    }
    way->carried = way->carried / (1.0f - chance);
    return 0;
}

/* True if a ray passes a surface with opacity below 1. A hole in the surface of a body is a hole in the
   body: a ray that entered through a hole is in no glass and leaves anywhere; a ray in the glass meets no
   hole. */
CRT_FN int crt_passes_hole(const CrtContext *ctx, const CrtSurface *surface, CrtValue opacity, u32 medium,
                           CrtSampler *sampler, const CrtPassage *way, vec3 d) {
    if (medium != 0u && dot3(d, surface->ng) > 0.0f) return !crt_surrounds(ctx, way->media, medium);
    return !(crt_sample_1d(sampler, way->dimension + way->passed) <
             V4X(crt_value(ctx, opacity, surface, splat4(0.0f))));
}

/* True if a ray passes the surface that it meets. The ray then begins behind that surface. */
CRT_FN int crt_passes(const CrtContext *ctx, CrtHit hit, CrtSampler *sampler, CrtPassage *way, CrtRay *ray) {
    if (way->passed >= CRT_PASSES_MAX) return 0;
    const u32 primitive = crt_primitive_of(ctx, hit);
    u32 material = CRT_ARRAY(CrtPrimitive, ctx->blob, ctx->scene->primitives)[primitive].material;
    CrtValue opacity = CRT_OPAQUE;
    u32 kind = CRT_COMPOSED_PLAIN;
    if ((CRT_HAS(OPACITY) || CRT_HAS(MIX)) && ctx->scene->compositions.count != 0u) {
        if (CRT_HAS(OPACITY)) opacity = crt_compositions(ctx)[material].opacity;
        if (CRT_HAS(MIX)) kind = crt_compositions(ctx)[material].kind;
    }
    const int pane =
        crt_has_panes(ctx) && (kind != CRT_COMPOSED_PLAIN ||
                               CRT_ARRAY(CrtMaterial, ctx->blob, ctx->scene->materials)[material].type ==
                                   CRT_MATERIAL_THIN_DIELECTRIC);
    if (opacity == CRT_OPAQUE && !pane) return 0;
    const CrtSurface surface = crt_surface(ctx, hit);
    const u32 dimension = way->dimension + way->passed;
    int passes = 0;
    if (opacity != CRT_OPAQUE)
        passes = crt_passes_hole(ctx, &surface, opacity, CRT_HAS(MEDIA) ? crt_medium_of(ctx, material) : 0u,
                                 sampler, way, ray->d);
    if (pane && !passes) {
        if (CRT_HAS(MIX) && kind != CRT_COMPOSED_PLAIN)
            way->material = material =
                crt_chosen_material(ctx, &surface, ray->d, sampler, dimension + CRT_DIM_PANE_MIX);
        passes = crt_passes_pane(ctx, &surface, material, sampler, dimension, way);
        way->panes += (u32)passes;
    }
    if (!passes) return 0;
    *ray = crt_ray_behind(*ray, surface.p, surface.clearance, surface.ng);
    way->passed += 1u;
    way->material = CRT_NONE;
    return 1;
}

CRT_KERNEL_END

#endif
