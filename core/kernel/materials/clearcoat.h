/*
 * clearcoat.h: the coat of OpenPBR Surface 1.1, a smooth or rough dielectric on anything that reflects. Of
 * light towards w_o it mirrors the share E(θ_o), by GGX as the coat of plastic does; what lies below gets
 * the rest, as the specification scales layers by their albedo:
 *
 *     f = f_coat + (1 − E(θ_o)) D T^(1/μ_o + 1/μ_i) f_below,    μ² = 1 − (1 − cos²)/η²
 *
 * T is the coat's transmittance straight on, μ the cosine inside. D is the darkening by light that the
 * coat sends back to the base again and again; E_b is the base's albedo straight on:
 *
 *     D = 1 + (Δ − 1) darkening,  Δ = (1 − K) / (1 − E_b K),  K = F(θ_o) + (K_r − F(θ_o)) r_b
 *
 * with K_r what it sends back of diffuse light from below and r_b how rough the base is. A white base under
 * a coat without colour is white, smooth or rough; but the coat is not reciprocal.
 */
#ifndef CRT_CLEARCOAT_H
#define CRT_CLEARCOAT_H

#include "kernel/materials/coat_table.h"
#include "kernel/materials/microfacet.h"
#include "kernel/materials/shading_normal.h"

CRT_KERNEL_BEGIN

#define CRT_CLEAR_COS_MIN 1e-3f /* inside the coat: an index of 1 bends nothing */
#define CRT_CLEAR_K_MAX 0.999999f /* along the surface everything is mirrored back */

CRT_FN int crt_is_coated(const CrtBsdf *b) { return CRT_HAS(CLEARCOAT) && b->clear_eta > 0.0f; }

/* True if the coat is rough; otherwise it mirrors, and light sampling does not find its reflection. */
CRT_FN int crt_is_coat_lobe(const CrtBsdf *b) { return crt_is_coated(b) && b->clear_alpha > 0.0f; }

/* The length of light's path through the coat, over the coat's thickness. */
CRT_FN f32 crt_clear_way(f32 cosine, f32 eta) {
    const f32 sine2 = crt_max(crt_fma(-cosine, cosine, 1.0f), 0.0f);
    const f32 cos2 = 1.0f - sine2 / (eta * eta);
    return 1.0f / crt_sqrt(crt_max(cos2, CRT_CLEAR_COS_MIN * CRT_CLEAR_COS_MIN));
}

/* The transmittance of a path of that length through a coat of optical depth `depth`. */
CRT_FN vec4 crt_clear_left(vec4 depth, f32 way) {
    return make_vec4(crt_exp_negative(-V4X(depth) * way), crt_exp_negative(-V4Y(depth) * way),
                     crt_exp_negative(-V4Z(depth) * way), crt_exp_negative(-V4W(depth) * way));
}

/* D, where the coat sends back the share `internal` of diffuse light from below, and mirrors the share
   `fresnel` of light from inside along the same way. `roughness`: of the base. */
CRT_FN vec4 crt_clear_darkening(f32 darkening, f32 internal, f32 roughness, f32 fresnel, vec4 base) {
    const f32 k = crt_min(crt_fma(internal - fresnel, roughness, fresnel), CRT_CLEAR_K_MAX);
    const vec4 darkened = splat4(1.0f - k) / (splat4(1.0f) - base * k);
    return splat4(1.0f) + (darkened - splat4(1.0f)) * darkening;
}

/* Of the material; 0 without a coat. */
CRT_FN CRT_GLOBAL const CrtLayers *crt_clear_layers(const CrtContext *ctx, u32 material) {
    if (!CRT_HAS(CLEARCOAT) || ctx->scene->layers.count == 0u) return 0;
    CRT_GLOBAL const CrtLayers *layers = CRT_ARRAY(CrtLayers, ctx->blob, ctx->scene->layers) + material;
    return layers->clear_ior > 0.0f ? layers : 0;
}

/* Call this after crt_bsdf_prepare has set the BSDF below, and its albedo. */
CRT_FN void crt_prepare_clearcoat(const CrtContext *ctx, CrtBsdf *b, CRT_GLOBAL const CrtLayers *layers,
                                  const CrtSurface *surface, vec4 position, int albedo) {
    const f32 eta = layers->clear_ior;
    const f32 towards = dot3(b->wo, b->ns);
    if (!(towards > 0.0f)) b->wo = crt_mirrored(b->wo, b->ns); /* seen as what is not Lambertian is */
    const f32 cosine = crt_min(crt_abs(towards), 1.0f);
    const f32 share = layers->clear_base_share;
    const f32 base =
        crt_fma(V4X(crt_value(ctx, layers->clear_base, surface, position)), share, 1.0f - share);
    const f32 roughness = CRT_HAS(COAT_TEXTURE)
                              ? V4X(crt_value(ctx, layers->clear_roughness, surface, position))
                              : crt_from_bits(layers->clear_roughness);
    const CrtCoat coat = crt_coat(ctx, layers->clear_albedo, layers->clear_internal, roughness);
    const f32 internal = crt_coat_returns(ctx, layers->clear_internal, roughness);
    const f32 dark = layers->clear_darkening;
    const vec4 darkening =
        crt_clear_darkening(dark, internal, base, crt_fresnel_dielectric(cosine, eta), b->albedo);
    const vec4 straight_on =
        crt_clear_darkening(dark, internal, base, crt_fresnel_dielectric(1.0f, eta), b->albedo);
    const f32 mirrored = crt_coat_reflects(coat, cosine, eta), facing = crt_coat_reflects(coat, 1.0f, eta);
    b->clear_eta = eta;
    b->clear_alpha = crt_is_rough_coat(coat) ? roughness * roughness : 0.0f;
    b->clear_depth = crt_value(ctx, layers->clear_depth, surface, position);
    const vec4 once = crt_clear_left(b->clear_depth, 1.0f);
    b->clear_albedo = mirrored;
    b->clear_below =
        darkening * crt_clear_left(b->clear_depth, crt_clear_way(cosine, eta)) * (1.0f - mirrored);
    const f32 below = 0.25f * sum4(b->clear_below * once * b->albedo);
    b->clear_chance = mirrored > 0.0f ? mirrored / (mirrored + below) : 0.0f;
    if (albedo) b->albedo = splat4(facing) + straight_on * once * once * b->albedo * (1.0f - facing);
}

/* The factor of the layers below the coat, for light from w_i. */
CRT_FN vec4 crt_through_clearcoat(const CrtBsdf *b, vec3 wi) {
    return b->clear_below * crt_clear_left(b->clear_depth, crt_clear_way(dot3(wi, b->ns), b->clear_eta));
}

/* As if its microfacets were the surface's. */
CRT_FN CrtBsdf crt_clear_facets(const CrtBsdf *b) {
    CrtBsdf coat = *b;
    coat.flags &= ~CRT_BSDF_ANISOTROPIC;
    coat.alpha = b->clear_alpha;
    return coat;
}

/* f·cos of what a rough coat mirrors, and its density. */
CRT_FN f32 crt_clearcoat(const CrtBsdf *b, vec3 wi, f32 *pdf) {
    *pdf = 0.0f;
    if (!crt_is_coat_lobe(b)) return 0.0f;
    const CrtBsdf coat = crt_clear_facets(b);
    const CrtMicrofacet m = crt_microfacet(&coat, wi);
    if (!(m.cos_o > 0.0f) || !(m.cos_i > 0.0f)) return 0.0f;
    *pdf = m.density / (2.0f * (m.cos_o + m.root_o));
    return crt_fresnel_dielectric(m.cos_m, b->clear_eta) * m.density * m.cos_i /
           (2.0f * (m.root_o * m.cos_i + m.root_i * m.cos_o));
}

/* Distributed as that. */
CRT_FN vec3 crt_clearcoat_direction(const CrtBsdf *b, CrtRandom2 u) {
    const CrtBsdf coat = crt_clear_facets(b);
    return normalize3(crt_reflect(b->wo, crt_visible_normal(&coat, u)));
}

/* Of `below`, the value of what lies under the coat, and *pdf, its density: those of both. */
CRT_FN vec4 crt_add_clearcoat(const CrtBsdf *b, vec3 wi, vec4 below, f32 *pdf) {
    f32 pdf_coat;
    const f32 coat = crt_clearcoat(b, wi, &pdf_coat);
    *pdf = (1.0f - b->clear_chance) * *pdf + b->clear_chance * pdf_coat;
    return below * crt_through_clearcoat(b, wi) + splat4(coat);
}

CRT_KERNEL_END

#endif
