/*
 * vertex.h: a place at which a path scatters: where it is, the direction from which the path came, and what
 * scatters there (today a surface's BSDF). A vertex holds nothing of a path or of an integrator.
 *
 * w_o leads to where the path came from, w_i to where it goes on. Both kinds of paths scatter here:
 *
 *   CRT_RADIANCE    from the camera: radiance flows from w_i to w_o
 *   CRT_IMPORTANCE  from a light: importance flows from w_i to w_o, radiance from w_o to w_i
 *
 * The BSDFs of kernel/materials transport radiance, and their values hold the cosine at w_i. Importance is
 * transported by the adjoint, which swaps the directions:
 *
 *     f*(w_o, w_i) |n_g·w_i| = f(w_i, w_o) |n_g·w_i|
 *
 * Two things make f asymmetric (Veach 1997, 5.2 and 5.3). crt_adjoint holds both, and nothing else does:
 *
 *   - Refraction into an index η times that on w_o's side scales radiance by 1/η². That factor stands in
 *     the weight of crt_reflect_or_refract (scatter.h) and in what crt_prepare_glass_loss gives back to the
 *     other side (compensation.h). In crt_rough_refraction (microfacet.h) it cancels the η² by which
 *     directions spread, which densities have and values do not. Importance has no such factor:
 *     a light's power is neither lost nor gained by refraction. CrtScatter.eta_square is η². Of a radiance
 *     path, path->eta_square is the product of these factors, by which roulette takes them back; of
 *     importance it is 1.
 *   - A BSDF about a shading normal weighs light by its cosine with n_s, where geometry has n_g. Its
 *     adjoint is f |n_s·w_o| |n_g·w_i| / (|n_g·w_o| |n_s·w_i|), values included.
 *
 * The adjoint is exact for symmetric BSDFs: all kinds of materials on flat surfaces; about interpolated
 * normals Lambert's law, rough metals and rough glass, where each direction is on one side of both normals.
 * Elsewhere it is approximate (docs/decisions/0081-vertex-and-transport-modes.md).
 */
#ifndef CRT_VERTEX_H
#define CRT_VERTEX_H

#include "kernel/materials/medium.h"
#include "kernel/materials/normal_map.h"

CRT_KERNEL_BEGIN

#define CRT_RADIANCE 0
#define CRT_IMPORTANCE 1

typedef struct CrtVertex {
    CrtSurface surface; /* where: p, n_g, clearance, what it bounds. Its n_s is the BSDF's */
    vec3 wo;            /* unit, to where the path came from */
    CrtBsdf bsdf;       /* what scatters there; its w_o may be a mirrored one */
} CrtVertex;

/* Prepares the BSDF of a vertex whose surface and w_o are set. `slot`: of the hit. `position`: of the
   wavelengths. `carried`: the path's throughput, which weights choices between wavelengths. `face`: the
   face's normal replaces the interpolated one. `albedo`: also computes the albedo. */
CRT_FN void crt_vertex_prepare(const CrtContext *ctx, CrtVertex *vertex, u32 slot, vec4 position,
                               vec4 carried, int face, int albedo) {
    CrtSurface *surface = &vertex->surface;
    CrtBsdf *bsdf = &vertex->bsdf;
    vec3 wo = vertex->wo;
    const vec3 ng = surface->ng;
    if (CRT_HAS(THIN_DIELECTRIC)) bsdf->pane_cosine = crt_pane_cosine(surface, -wo);
    if (CRT_HAS(NORMAL_MAP)) crt_map_normal(ctx, surface, slot, &wo, bsdf);
    if (face) surface->ns = ng;
    crt_layered_prepare(ctx, bsdf, surface, wo, position, carried, albedo);
    surface->ng = ng;
}

/* True if no direction of light can be evaluated: the vertex scatters into single directions alone. */
CRT_FN int crt_vertex_is_delta(const CrtVertex *vertex) { return crt_is_delta(&vertex->bsdf); }

/* The normal that separates reflection from transmission, on the side of w_o; and the one that light arrives
   about by its cosine. */
CRT_FN vec3 crt_vertex_side(const CrtVertex *vertex) { return crt_side(&vertex->bsdf); }
CRT_FN vec3 crt_vertex_base(const CrtVertex *vertex) { return crt_base(&vertex->bsdf); }

/* The normal of a vertex that scatters nothing to its other side; otherwise of length 0. */
CRT_FN vec3 crt_scattering_side(const CrtVertex *vertex) {
    return (vertex->bsdf.flags & CRT_BSDF_TRANSMITS) == 0u ? crt_vertex_side(vertex)
                                                           : make_vec3(0.0f, 0.0f, 0.0f);
}

/* True if the vertex scatters light from the side of wi. */
CRT_FN int crt_vertex_scatters(const CrtVertex *vertex, vec3 wi) {
    const int before = dot3(wi, crt_vertex_side(vertex)) > 0.0f;
    return (vertex->bsdf.flags & (before ? CRT_BSDF_REFLECTS : CRT_BSDF_TRANSMITS)) != 0u;
}

/* The list of the media around a ray that leaves along w, given that of the ray that arrived. */
CRT_FN u32 crt_vertex_media(const CrtContext *ctx, const CrtVertex *vertex, vec3 w, u32 media) {
    return crt_media_behind(ctx, &vertex->surface, &vertex->bsdf, w, media);
}

/* The cosine by which the BSDF weighs light along w. Lambert's light has that of shading_normal.h, raised
   light included; a facet has those of all its ways (normal_map.h). */
CRT_FN f32 crt_shading_cosine(const CrtBsdf *b, vec3 w) {
    if ((b->flags & CRT_BSDF_RAISES) == 0u && !crt_is_facet(b)) return crt_abs(dot3(w, b->ns));
    f32 sum = 0.0f;
    if (crt_is_translucent(b) && dot3(w, b->ng) < 0.0f) w = -w; /* the same law on both sides */
    const u32 ways = CRT_HAS(NORMAL_MAP) ? crt_ways(b, w) : 1u;
    CRT_ROLLED for (u32 way = 0u; way < ways; ++way)
        sum = sum + crt_lambert_pdf(b, way == 0u ? w : crt_mirrored(w, b->base));
    return CRT_PI * sum;
}

/* The factor of the adjoint, on values and on weights. */
CRT_FN vec4 crt_adjoint(const CrtVertex *vertex, vec3 wi) {
    const CrtBsdf *b = &vertex->bsdf;
    const vec3 ng = crt_vertex_side(vertex);
    vec4 factor = splat4(1.0f);
    if ((CRT_HAS(DIELECTRIC) || CRT_HAS(ROUGH_DIELECTRIC)) && (b->flags & CRT_BSDF_BOUNDS) != 0u &&
        dot3(wi, ng) < 0.0f)
        factor = b->eta * b->eta;
    if (!(CRT_HAS(SMOOTH_NORMALS) || CRT_HAS(NORMAL_MAP))) return factor;
    const f32 shaded = crt_shading_cosine(b, vertex->wo) * crt_abs(dot3(wi, ng));
    const f32 flat = crt_abs(dot3(vertex->wo, ng)) * crt_shading_cosine(b, wi);
    return flat > 0.0f ? factor * (shaded / flat) : splat4(0.0f);
}

/* f·|cos| of directions that are not single ones. */
CRT_FN vec4 crt_vertex_eval(const CrtVertex *vertex, vec3 wi, int mode) {
    const vec4 value = crt_surface_eval(&vertex->bsdf, wi);
    return mode == CRT_RADIANCE ? value : value * crt_adjoint(vertex, wi);
}

/* The density of wi among the directions of crt_vertex_sample, per steradian: the same in both modes. */
CRT_FN f32 crt_vertex_pdf(const CrtVertex *vertex, vec3 wi) { return crt_surface_pdf(&vertex->bsdf, wi); }

/* A direction in which the path goes on. `choice`: two more random numbers, where crt_vertex_chooses.
   `hero`: 1 in the hero's lane, 0 elsewhere. `hero_only`: only the hero is alive. */
CRT_FN CrtScatter crt_vertex_sample(const CrtVertex *vertex, CrtRandom2 u, CrtRandom2 choice, vec4 hero,
                                    int hero_only, int mode) {
    CrtScatter s = crt_surface_sample(&vertex->bsdf, u, choice, hero, hero_only);
    if (mode == CRT_RADIANCE || !s.valid) return s;
    s.weight = s.weight * crt_adjoint(vertex, s.wi);
    s.eta_square = 1.0f;
    return s;
}

/* True if crt_vertex_sample reads its second pair of random numbers. */
CRT_FN int crt_vertex_chooses(const CrtVertex *vertex) { return crt_chooses(&vertex->bsdf); }

CRT_KERNEL_END

#endif
