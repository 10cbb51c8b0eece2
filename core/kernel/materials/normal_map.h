/*
 * normal_map.h: normals from an image, in the tangent space of the texture's coordinates.
 *
 * A mapped normal that is merely put in place of the surface's own loses light: what the BSDF about it
 * sends below the surface, and all that it would send towards a viewer behind it. Here it is, as in
 * Schüßler et al. (2017, "Microfacet-based Normal Mapping for Robust Monte Carlo Path Tracing"), the
 * normal of a facet beside which stands a wall, a mirror upright on the surface: a viewer behind it sees it
 * in the wall. The surface mirrors up light that leaves the facet downwards: by its interpolated normal,
 * where it has one, and then by its geometric one, as other smooth surfaces do (shading_normal.h). So in
 * uniform light a surface reflects as much as its BSDF. docs/decisions/0024-normal-maps.md says why the
 * walls cast no shadow.
 *
 * Surfaces that transmit have no walls: there the mapped normal stands in the place of the other, and what
 * would leave to the wrong side is mirrored by the face (crt_to_its_side). A translucent sheet raises its
 * light on either side, as about an interpolated normal.
 */
#ifndef CRT_NORMAL_MAP_H
#define CRT_NORMAL_MAP_H

#include "kernel/materials/layers.h"

CRT_KERNEL_BEGIN

/* Slopes are at most 87°. */
#define CRT_LEAST_SLOPE_COS 0.05f

/* The normal that the map has at a place, about the shading normal; on its side. */
CRT_FN vec3 crt_mapped_normal(const CrtContext *ctx, const CrtSurface *surface, u32 slot,
                              const CrtComposition *c) {
    const CrtTexture map =
        CRT_ARRAY(CrtTexture, ctx->blob, ctx->scene->textures)[c->normal_map & CRT_VALUE_INDEX];
    CRT_GLOBAL const CrtTriangle *triangle =
        CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles) + slot;
    CRT_GLOBAL const f32 *uv = CRT_ARRAY(CrtUvs, ctx->blob, ctx->scene->uvs)[surface->at.id].uv;
    const vec4 texel = crt_image(ctx, &map, &surface->at, splat4(0.0f));
    /* Along the picture's rows to the right, and up its columns. */
    const vec3 o = crt_corner(ctx, triangle, surface->instance, 0u);
    vec3 e1 = crt_corner(ctx, triangle, surface->instance, 1u) - o;
    vec3 e2 = crt_corner(ctx, triangle, surface->instance, 2u) - o;
    f32 u1 = uv[1] - uv[0], u2 = uv[2] - uv[0], v1 = uv[4] - uv[3], v2 = uv[5] - uv[3];
    if (CRT_HAS(SHAPES) && triangle->shape != 0u) {
        crt_edges_of_shape(ctx, triangle, surface->p, &e1, &e2);
        u1 = v2 = 1.0f;
        u2 = v1 = 0.0f;
    }
    const f32 s1 = map.from_uv[0] * u1 + map.from_uv[1] * v1, s2 = map.from_uv[0] * u2 + map.from_uv[1] * v2;
    const f32 t1 = -map.from_uv[3] * u1 - map.from_uv[4] * v1,
              t2 = -map.from_uv[3] * u2 - map.from_uv[4] * v2;
    const f32 sign = crt_difference_of_products(s1, t2, s2, t1) < 0.0f ? -1.0f : 1.0f;
    const vec3 n = surface->ns;
    const vec3 right = (e1 * t2 - e2 * t1) * sign;
    const vec3 up = (e2 * s1 - e1 * s2) * sign;
    const vec3 flat = right - n * dot3(right, n);
    const f32 length = length3(flat);
    if (!(length > 0.0f)) return n; /* without extent in the picture, or seen along it */
    const vec3 x = flat * (1.0f / length);
    vec3 y = cross3(n, x);
    if (dot3(y, up) < 0.0f) y = -y; /* the picture is mirrored */
    const f32 nx = V4X(texel) * c->normal_strength, ny = V4Y(texel) * c->normal_strength;
    const f32 nz = crt_max(V4Z(texel), CRT_LEAST_SLOPE_COS * crt_sqrt(nx * nx + ny * ny));
    const vec3 mapped = x * nx + y * ny + n * nz;
    const f32 size = length3(mapped);
    return size > 0.0f ? mapped * (1.0f / size) : n;
}

/* Turns a surface with a normal map into the facet, and wo into the direction from which the facet is
   seen. */
CRT_FN void crt_map_normal(const CrtContext *ctx, CrtSurface *surface, u32 slot, vec3 *wo, CrtBsdf *b) {
    b->facet = 0;
    if (ctx->scene->compositions.count == 0u) return;
    const CrtComposition c = crt_compositions(ctx)[surface->material];
    if (c.normal_map == 0u) return;
    const vec3 mapped = crt_mapped_normal(ctx, surface, slot, &c);
    const f32 front = dot3(*wo, surface->ng) > 0.0f ? 1.0f : -1.0f;
    b->side = surface->ng * front;
    b->base = surface->ns * front;
    if (!(dot3(*wo, b->base) > 0.0f)) b->base = b->side;
    surface->ns = mapped;
    const f32 slope_cos = dot3(mapped, b->base) * front;
    if (c.walled == 0u || !(slope_cos > 0.0f)) return;
    b->facet = 1;
    surface->ng = mapped;
    if (!(dot3(*wo, mapped) * front > 0.0f))
        *wo = crt_mirrored(*wo, normalize3(b->base * slope_cos - mapped * front));
}

/* The normal that separates reflection from transmission, and the one that light arrives about by its
   cosine. */
CRT_FN vec3 crt_side(const CrtBsdf *b) { return crt_is_facet(b) ? b->side : b->ng; }
CRT_FN vec3 crt_base(const CrtBsdf *b) { return crt_is_facet(b) ? b->base : b->ns; }

/* Cosine of a scattered direction with the base; or, where that is below it, less the one with the side. */
CRT_FN f32 crt_scatter_cosine(const CrtBsdf *b, vec3 wi) {
    const f32 cosine = dot3(wi, crt_base(b));
    if (!CRT_HAS(SMOOTH_NORMALS)) return cosine;
    if (!CRT_HAS(TRANSLUCENT) && cosine > 0.0f) return cosine;
    const f32 above = dot3(wi, crt_side(b));
    if (CRT_HAS(TRANSLUCENT) && cosine > 0.0f) return crt_is_translucent(b) && above < 0.0f ? above : cosine;
    return above > 0.0f ? -above : cosine;
}

/* True if the base of a facet differs from its side: the surface has an interpolated normal. */
CRT_FN int crt_is_tilted(const CrtBsdf *b) {
    const vec3 off = b->base - b->side;
    return dot3(off, off) > 0.0f;
}

/* The number of a facet's directions that end in wi: wi itself, and the one that the surface mirrors into
   it. */
CRT_FN u32 crt_ways(const CrtBsdf *b, vec3 wi) {
    if (!b->facet) return 1u;
    return dot3(wi, b->base) > 0.0f ? 2u : 0u;
}

/* crt_layered_eval, _pdf and _sample of the surface, whose facet `b` may be. */
CRT_FN vec4 crt_surface_eval(const CrtBsdf *b, vec3 wi) {
    if (!CRT_HAS(NORMAL_MAP)) return crt_layered_eval(b, wi);
    vec4 sum = splat4(0.0f);
    const u32 ways = crt_ways(b, wi);
    CRT_ROLLED for (u32 way = 0u; way < ways; ++way)
        sum = sum + crt_layered_eval(b, way == 0u ? wi : crt_mirrored(wi, b->base));
    return sum;
}

CRT_FN f32 crt_surface_pdf(const CrtBsdf *b, vec3 wi) {
    if (!CRT_HAS(NORMAL_MAP)) return crt_layered_pdf(b, wi);
    f32 sum = 0.0f;
    const u32 ways = crt_ways(b, wi);
    CRT_ROLLED for (u32 way = 0u; way < ways; ++way)
        sum = sum + crt_layered_pdf(b, way == 0u ? wi : crt_mirrored(wi, b->base));
    return sum;
}

/* The weight is of the way that was taken; the density, which light sampling competes with, of both. */
CRT_FN CrtScatter crt_surface_sample(const CrtBsdf *b, CrtRandom2 u, CrtRandom2 choice, vec4 hero,
                                     int hero_only) {
    CrtScatter s = crt_layered_sample(b, u, choice, hero, hero_only);
    if (!crt_is_facet(b) || !s.valid) return s;
    if (dot3(s.wi, b->base) < 0.0f) s.wi = crt_mirrored(s.wi, b->base);
    if (CRT_HAS(SMOOTH_NORMALS) && dot3(s.wi, b->side) < 0.0f && crt_is_tilted(b)) {
        s.wi = crt_mirrored(s.wi, b->side); /* as crt_mirror_up */
        s.pdf = 0.0f;
    }
    s.valid = dot3(s.wi, b->side) > 0.0f;
    if (s.valid && s.pdf > 0.0f) s.pdf = crt_surface_pdf(b, s.wi);
    return s;
}

CRT_KERNEL_END

#endif
