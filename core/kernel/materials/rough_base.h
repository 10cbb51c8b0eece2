/*
 * rough_base.h: diffuse reflection by a rough surface, EON (Portsmouth, Kutz and Hill 2025, "EON: A
 * practical energy-preserving rough diffuse BRDF"), alone or under a coat. One reflection, Fujii's lobe, is
 *
 *     g = (1 + r s/t) / π,    s = w_i·w_o − cos θ_i cos θ_o
 *
 * for the roughness r, with t the larger cosine where s > 0, else 1. It is scaled so that it loses nothing
 * where it loses least; what it loses elsewhere is given back, diffusely. Under a coat that lets in T(θ)
 * the same holds for the light that comes through the coat. With
 *
 *     A(θ_o) = ∫ T(θ_i) g cos θ_i dω_i,    N = max A,    L = 1 − A/N
 *     L̄ = ∫ L T cos dω / (π T̄),            ρ_m = ρ² (1 − L̄) / (1 − ρ L̄)
 *
 * and ρ the base's reflectance, the base under its coat is
 *
 *     f = T(θ_o) T(θ_i) (ρ g / N + ρ_m L(θ_o) L(θ_i) / (π T̄ L̄))
 *
 * which is EON where T is 1. It is reciprocal, and a white base sends back all that the coat lets in: L is
 * a table by the cosine, which the compiler of the scene makes (compile/rough_base.h).
 */
#ifndef CRT_ROUGH_BASE_H
#define CRT_ROUGH_BASE_H

#include "kernel/materials/scatter.h"
#include "kernel/sampling/spectrum.h"

CRT_KERNEL_BEGIN

CRT_FN int crt_has_rough_base(const CrtBsdf *b) { return CRT_HAS(ROUGH_BASE) && b->base_loss != 0; }

/* L at a cosine. */
CRT_FN f32 crt_base_loss(const CrtBsdf *b, f32 cosine) {
    return crt_lookup(b->base_loss, crt_min(cosine, 1.0f) * CRT_COAT_STEPS);
}

/* From b->reflectance, which is ρ T(θ_o) / T̄ of the material's base. `reflectance`: ρ. `passed`: T̄.
   Returns what is sent back of what enters straight on. */
CRT_FN vec4 crt_prepare_rough_base(const CrtContext *ctx, CrtBsdf *b, u32 material, vec4 reflectance,
                                   f32 passed) {
    b->base_loss = 0;
    if (ctx->scene->layers.count == 0u) return reflectance;
    const CrtLayers layers = CRT_ARRAY(CrtLayers, ctx->blob, ctx->scene->layers)[material];
    if ((layers.base_loss & CRT_VALUE_REFERENCE) == 0u) return reflectance;
    b->base_loss = CRT_ARRAY(f32, ctx->blob, ctx->scene->spectra) +
                   (layers.base_loss & CRT_VALUE_INDEX) * CRT_SPECTRUM_STRIDE;
    b->base_roughness = layers.base_roughness;
    const f32 mean = layers.base_mean, facing = crt_base_loss(b, 1.0f);
    const vec4 rounds = reflectance * (1.0f - mean) / (splat4(1.0f) - reflectance * mean);
    b->multiple = b->reflectance * rounds * (crt_base_loss(b, dot3(b->wo, b->ns)) / mean);
    b->reflectance = b->reflectance * (passed * layers.base_scale);
    return reflectance * (splat4(1.0f - facing) + rounds * facing);
}

/* Over T(θ_i) cos θ_i / π, of the direction w at cos_i. */
CRT_FN vec4 crt_rough_base(const CrtBsdf *b, vec3 w, f32 cos_i) {
    const f32 cos_o = dot3(b->wo, b->ns);
    const f32 s = dot3(w, b->wo) - cos_i * cos_o;
    const f32 once = crt_fma(b->base_roughness, s > 0.0f ? s / crt_max(cos_i, cos_o) : s, 1.0f);
    return b->reflectance * crt_max(once, 0.0f) + b->multiple * crt_base_loss(b, cos_i);
}

CRT_KERNEL_END

#endif
