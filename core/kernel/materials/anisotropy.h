/*
 * anisotropy.h: the tangent of surfaces whose roughness depends on the direction, as that of brushed metal
 * does.
 *
 * The tangent is the direction in which the texture coordinate u grows, or, where a triangle has none of
 * use, the direction around the axis y: that of a lathe's chisel on a piece that turns about it. Widths are
 * those of OpenPBR Surface 1.1: α_t = r² √(2 / (1 + (1 − a)²)) along the tangent, (1 − a) α_t
 * across.
 */
#ifndef CRT_ANISOTROPY_H
#define CRT_ANISOTROPY_H

#include "kernel/geometry/surface.h"
#include "kernel/materials/scatter.h"

CRT_KERNEL_BEGIN

CRT_FN int crt_is_anisotropic(const CrtBsdf *b) { return (b->flags & CRT_BSDF_ANISOTROPIC) != 0u; }

/* Sine of the angle to the axis y below which it gives no direction. */
#define CRT_LEAST_LATHE_SINE 1e-3f

/* Unit, perpendicular to n, the surface's normal there. */
CRT_FN vec3 crt_tangent(const CrtContext *ctx, const CrtSurface *surface, vec3 n) {
    if (ctx->scene->uvs.count != 0u) {
        CRT_GLOBAL const f32 *uv = CRT_ARRAY(CrtUvs, ctx->blob, ctx->scene->uvs)[surface->at.id].uv;
        CRT_GLOBAL const CrtTriangle *triangle =
            CRT_ARRAY(CrtTriangle, ctx->blob, ctx->scene->triangles) + surface->slot;
        const vec3 o = crt_corner(ctx, triangle, surface->instance, 0u);
        const vec3 e1 = crt_corner(ctx, triangle, surface->instance, 1u) - o;
        const vec3 e2 = crt_corner(ctx, triangle, surface->instance, 2u) - o;
        const f32 v1 = uv[4] - uv[3], v2 = uv[5] - uv[3];
        f32 area = crt_difference_of_products(uv[1] - uv[0], v2, uv[2] - uv[0], v1);
        vec3 along = (e1 * v2 - e2 * v1) * (area < 0.0f ? -1.0f : 1.0f);
        if (CRT_HAS(SHAPES) && triangle->shape != 0u) {
            vec3 along_v;
            crt_edges_of_shape(ctx, triangle, surface->p, &along, &along_v);
            area = 1.0f;
        }
        const vec3 flat = along - n * dot3(along, n);
        const f32 length = length3(flat);
        if (area != 0.0f && length > 0.0f) return flat * (1.0f / length);
    }
    const f32 sine2 = V3Z(n) * V3Z(n) + V3X(n) * V3X(n);
    if (sine2 > CRT_LEAST_LATHE_SINE * CRT_LEAST_LATHE_SINE)
        return make_vec3(V3Z(n), 0.0f, -V3X(n)) * (1.0f / crt_sqrt(sine2));
    return normalize3(make_vec3(1.0f, 0.0f, 0.0f) - n * V3X(n));
}

/* Widens b->alpha and finds the tangent, which both sides of the surface have in common. */
CRT_FN void crt_prepare_anisotropy(const CrtContext *ctx, CrtBsdf *b, const CrtMaterial *material,
                                   const CrtSurface *surface, int outside) {
    if (!(material->narrowing > 0.0f)) return;
    const vec3 n = outside ? b->ns : -b->ns;
    const vec3 tangent = crt_tangent(ctx, surface, n);
    b->flags |= CRT_BSDF_ANISOTROPIC;
    b->alpha = b->alpha * material->widening;
    b->narrowing = material->narrowing;
    b->tangent = tangent * material->turn_cos + cross3(n, tangent) * material->turn_sin;
}

/* The frame that microfacets are distributed in. */
CRT_FN CrtFrame crt_facet_frame(const CrtBsdf *b) {
    CrtFrame frame = crt_frame(b->ns);
    if (CRT_HAS(ANISOTROPY) && crt_is_anisotropic(b)) {
        frame.s = b->tangent;
        frame.t = cross3(b->ns, b->tangent);
    }
    return frame;
}

/* 0 for a direction whose azimuth is along the tangent, 1 across it. As steep where the surface is smoothest
   as losses are: by √narrowing. */
CRT_FN f32 crt_azimuth(const CrtBsdf *b, vec3 w) {
    const f32 along = crt_abs(dot3(w, b->tangent));
    const f32 across = crt_sqrt(b->narrowing) * crt_abs(dot3(w, cross3(b->ns, b->tangent)));
    return along + across > 0.0f ? across / (along + across) : 0.0f;
}

CRT_KERNEL_END

#endif
