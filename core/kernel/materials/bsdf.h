/*
 * bsdf.h: how surfaces scatter. crt_bsdf_prepare reads what a material is made of, once a vertex; then
 * crt_bsdf_sample, crt_bsdf and the flags are all that layers.h uses. A material is a row of
 * CRT_MATERIAL_LIST (features.h) and a case in each of the three; deltas, which can only be sampled, need
 * none in crt_bsdf.
 */
#ifndef CRT_BSDF_H
#define CRT_BSDF_H

#include "kernel/materials/pane.h"
#include "kernel/materials/plastic.h"

CRT_KERNEL_BEGIN

/* A material's type: a constant where the kernel has only one. */
#define CRT_ONLY_MATERIAL(F, bit, NAME, Name, word, scatter, text) \
    if (only == 1ul << bit) return bit;
CRT_FN u32 crt_material_type(u32 type) {
    const u64 only = CRT_KERNEL_MATERIALS;
    CRT_MATERIAL_LIST(CRT_ONLY_MATERIAL, )
    return type;
}

/* The roughness of a material. Light passes a rough coat twice, in and out: what lies below looks rougher
   (OpenPBR Surface 1.1, "Coat"). Where one of the two roughnesses depends on the place, that is added here.
 */
CRT_FN f32 crt_own_roughness(const CrtContext *ctx, const CrtMaterial *material, const CrtSurface *surface,
                             vec4 position) {
    const f32 own = V4X(crt_value(ctx, material->roughness, surface, position));
    if (!CRT_HAS(COAT_TEXTURE) || (material->flags & CRT_MATERIAL_UNDER_COAT) == 0u) return own;
    CRT_GLOBAL const CrtLayers *layers =
        CRT_ARRAY(CrtLayers, ctx->blob, ctx->scene->layers) + surface->material;
    const f32 coat = V4X(crt_value(ctx, layers->clear_roughness, surface, position));
    const f32 width = own * own, coat_width = coat * coat;
    return crt_min(crt_sqrt(crt_sqrt(width * width + 2.0f * (coat_width * coat_width))), 1.0f);
}

/* The share of entering light that a translucent sheet sends to its other side, at most the rest of what it
   reflects; 0 for others. *returned: the share that it sends back, set for translucent ones. `base`, `k`: a
   and k of plastic.h. */
CRT_FN vec4 crt_prepare_sheet(const CrtContext *ctx, CrtBsdf *b, const CrtMaterial *material,
                              const CrtSurface *surface, vec4 position, vec4 base, f32 k, vec4 *returned) {
    b->pass_chance = 0.0f;
    b->passed = splat4(0.0f);
    if ((material->flags & CRT_MATERIAL_TRANSLUCENT) == 0u) return splat4(0.0f);
    b->flags |= CRT_BSDF_TRANSMITS;
    CRT_GLOBAL const CrtLayers *layers =
        CRT_ARRAY(CrtLayers, ctx->blob, ctx->scene->layers) + surface->material;
    const vec4 through = crt_value(ctx, layers->transmittance, surface, position);
    vec4 passed = crt_min4(through, splat4(1.0f) - base);
    if ((material->flags & CRT_MATERIAL_OPENPBR) == 0u)
        *returned = crt_sheet_returns(base, passed, k, &passed);
    const f32 here = sum4(*returned), there = sum4(passed);
    b->pass_chance = there > 0.0f ? there / (here + there) : 0.0f;
    return passed;
}

/* Prepares the BSDF of the material of `surface`, for light that leaves along wo. `carried`: the path's
   throughput, which weights the choice between wavelengths. `albedo`: also computes the albedo, which the
   first vertex needs. */
CRT_FN void crt_bsdf_prepare(const CrtContext *ctx, CrtBsdf *b, const CrtSurface *surface, vec3 wo,
                             vec4 position, vec4 carried, int albedo) {
    const CrtMaterial material = CRT_ARRAY(CrtMaterial, ctx->blob, ctx->scene->materials)[surface->material];
    const int outside = dot3(wo, surface->ng) > 0.0f;
    b->type = crt_material_type(material.type);
    b->flags = 0u;
    b->wo = wo;
    b->ng = outside ? surface->ng : -surface->ng;
    b->ns = outside ? surface->ns : -surface->ns;
    if (CRT_HAS(SMOOTH_NORMALS) || CRT_HAS(NORMAL_MAP)) {
        crt_face_viewer(b, (material.flags & CRT_MATERIAL_TRANSMITS) != 0u);
        wo = b->wo;
    }
    b->albedo = splat4(1.0f);
    switch (b->type) {
        case CRT_MATERIAL_DIFFUSE:
            if (CRT_HAS(DIFFUSE)) {
                b->flags = CRT_BSDF_REFLECTS | CRT_BSDF_RAISES;
                b->reflectance = crt_value(ctx, material.of.diffuse.reflectance, surface, position);
                if (albedo) b->albedo = b->reflectance;
            }
            break;
        case CRT_MATERIAL_MIRROR:
            if (CRT_HAS(MIRROR)) {
                b->flags = CRT_BSDF_REFLECTS | CRT_BSDF_DELTA;
                b->reflectance = crt_value(ctx, material.of.diffuse.reflectance, surface, position);
                if (albedo) b->albedo = b->reflectance;
            }
            break;
        case CRT_MATERIAL_CONDUCTOR:
            if (CRT_HAS(CONDUCTOR)) {
                b->eta = crt_value(ctx, material.of.metal.eta, surface, position);
                b->k = crt_value(ctx, material.of.metal.k, surface, position);
                b->flags = CRT_BSDF_REFLECTS | CRT_BSDF_DELTA;
                if (CRT_HAS(TINT))
                    b->tint = crt_tint(ctx, material.flags, surface->material, surface, position);
                if (CRT_HAS(THIN_FILM)) crt_prepare_film(ctx, b, &material, surface, position, splat4(1.0f));
                b->reflectance = crt_metal_reflectance(b, crt_min(dot3(wo, b->ns), 1.0f));
                if (albedo) b->albedo = crt_metal_reflectance(b, 1.0f);
            }
            break;
        case CRT_MATERIAL_ROUGH_CONDUCTOR:
            if (CRT_HAS(ROUGH_CONDUCTOR)) {
                const f32 roughness = crt_own_roughness(ctx, &material, surface, position);
                b->flags = CRT_BSDF_REFLECTS;
                b->eta = crt_value(ctx, material.of.metal.eta, surface, position);
                b->k = crt_value(ctx, material.of.metal.k, surface, position);
                b->alpha = roughness * roughness;
                if (CRT_HAS(ANISOTROPY)) crt_prepare_anisotropy(ctx, b, &material, surface, outside);
                if (CRT_HAS(TINT))
                    b->tint = crt_tint(ctx, material.flags, surface->material, surface, position);
                if ((material.flags & CRT_MATERIAL_OPENPBR) != 0u)
                    crt_prepare_colors(b, V4X(crt_value(ctx, material.of.metal.factor, surface, position)));
                if (CRT_HAS(THIN_FILM)) crt_prepare_film(ctx, b, &material, surface, position, splat4(1.0f));
                if (b->alpha >= CRT_ALPHA_MIN) {
                    b->losses = crt_losses(ctx, material.loss, roughness, splat4(0.0f), 0u);
                    crt_prepare_metal_loss(b, crt_metal_mean(ctx, b, &material, surface, position));
                } else {
                    b->flags |= CRT_BSDF_DELTA;
                    b->reflectance = crt_metal_reflectance(b, crt_min(dot3(wo, b->ns), 1.0f));
                }
                if (albedo) b->albedo = crt_metal_reflectance(b, 1.0f);
            }
            break;
        case CRT_MATERIAL_DIELECTRIC:
            if (CRT_HAS(DIELECTRIC)) {
                const vec4 eta = crt_value(ctx, material.of.glass.eta, surface, position);
                b->flags = CRT_BSDF_REFLECTS | CRT_BSDF_TRANSMITS | CRT_BSDF_DELTA | CRT_BSDF_BOUNDS;
                if ((material.flags & CRT_MATERIAL_DISPERSIVE) != 0u) b->flags |= CRT_BSDF_DISPERSIVE;
                b->eta = outside ? eta : splat4(1.0f) / eta;
                if (CRT_HAS(THIN_FILM)) {
                    b->k = splat4(0.0f);
                    b->lanes = carried / sum4(carried);
                    crt_prepare_film(ctx, b, &material, surface, position, outside ? splat4(1.0f) : eta);
                }
            }
            break;
        case CRT_MATERIAL_ROUGH_DIELECTRIC:
            if (CRT_HAS(ROUGH_DIELECTRIC)) {
                const f32 roughness = V4X(crt_value(ctx, material.roughness, surface, position));
                const vec4 eta = crt_value(ctx, material.of.glass.eta, surface, position);
                b->flags = CRT_BSDF_REFLECTS | CRT_BSDF_TRANSMITS | CRT_BSDF_BOUNDS;
                if ((material.flags & CRT_MATERIAL_DISPERSIVE) != 0u) b->flags |= CRT_BSDF_DISPERSIVE;
                b->eta = outside ? eta : splat4(1.0f) / eta;
                b->alpha = roughness * roughness;
                if (CRT_HAS(ANISOTROPY)) crt_prepare_anisotropy(ctx, b, &material, surface, outside);
                b->lanes = carried / sum4(carried);
                if (CRT_HAS(THIN_FILM)) {
                    b->k = splat4(0.0f);
                    crt_prepare_film(ctx, b, &material, surface, position, outside ? splat4(1.0f) : eta);
                }
                if (crt_is_rough(b->alpha, eta)) {
                    b->flags |= CRT_BSDF_CHOOSES;
                    b->losses = crt_losses(ctx, material.loss, roughness, crt_has_film(b) ? position : eta,
                                           outside ? 0u : 1u);
                    crt_prepare_glass_loss(b);
                } else {
                    b->flags |= CRT_BSDF_DELTA;
                }
            }
            break;
        case CRT_MATERIAL_THIN_DIELECTRIC:
            if (CRT_HAS(THIN_DIELECTRIC)) {
                /* Light that passes has no vertex here (passing.h). */
                b->flags = CRT_BSDF_REFLECTS | CRT_BSDF_DELTA;
                crt_prepare_pane(ctx, b, &material, surface, position);
                b->reflectance = splat4(1.0f) - crt_pane_transmittance(b, b->pane_cosine);
            }
            break;
        case CRT_MATERIAL_PLASTIC:
            if (CRT_HAS(PLASTIC)) {
                const vec4 base = crt_value(ctx, material.of.plastic.reflectance, surface, position);
                const f32 roughness = crt_own_roughness(ctx, &material, surface, position);
                const f32 eta = V4X(crt_value(ctx, material.of.plastic.eta, surface, position));
                const f32 k = crt_coat_returns(ctx, material.of.plastic.internal, roughness);
                b->flags = CRT_BSDF_REFLECTS | CRT_BSDF_CHOOSES | CRT_BSDF_RAISES;
                b->eta = splat4(eta);
                b->alpha = roughness * roughness;
                b->coat = crt_coat(ctx, material.of.plastic.coat, material.of.plastic.internal, roughness);
                /* The share of entering light that the base sends back through the coat. */
                vec4 returned = base * (1.0f - k) / (splat4(1.0f) - base * k);
                if ((material.flags & CRT_MATERIAL_OPENPBR) != 0u) returned = base;
                const f32 mirrored = crt_coat_albedo(b, dot3(wo, b->ns));
                vec4 passed = splat4(0.0f);
                if (CRT_HAS(TRANSLUCENT))
                    passed = crt_prepare_sheet(ctx, b, &material, surface, position, base, k, &returned);
                f32 scattered = 0.25f * sum4(returned) * (1.0f - mirrored);
                b->reflectance = returned * ((1.0f - mirrored) / ((1.0f - k) * eta * eta));
                if (crt_is_translucent(b)) {
                    scattered = scattered + 0.25f * sum4(passed) * (1.0f - mirrored);
                    b->passed = passed * ((1.0f - mirrored) / ((1.0f - k) * eta * eta));
                }
                if (CRT_HAS(ROUGH_BASE))
                    returned = crt_prepare_rough_base(ctx, b, surface->material, returned,
                                                      (1.0f - k) * eta * eta);
                f32 seen = mirrored;
                if (CRT_HAS(TINT)) {
                    b->tint = crt_tint(ctx, material.flags, surface->material, surface, position);
                    seen = mirrored * (0.25f * sum4(b->tint));
                }
                b->coat_chance = seen > 0.0f ? seen / (seen + scattered) : 0.0f;
                if (albedo) {
                    const f32 facing = crt_coat_albedo(b, 1.0f);
                    b->albedo = crt_tinted(b, splat4(facing)) + (returned + passed) * (1.0f - facing);
                }
            }
            break;
        default: break;
    }
}

/* Smooth dielectric, with or without a film. */
CRT_FN CrtScatter crt_sample_smooth(const CrtBsdf *b, vec4 hero, int hero_only, f32 u) {
    if (crt_has_film(b)) return crt_to_its_side(b, crt_sample_filmed_dielectric(b, hero, hero_only, u));
    return crt_to_its_side(b, crt_sample_dielectric(b->eta, b->wo, b->ns, hero,
                                                    (b->flags & CRT_BSDF_DISPERSIVE) != 0u, hero_only, u));
}

/* True if crt_bsdf_sample needs its second pair of random numbers. */
CRT_FN int crt_chooses(const CrtBsdf *b) {
    return (CRT_HAS(ROUGH_DIELECTRIC) || CRT_HAS(PLASTIC)) && (b->flags & CRT_BSDF_CHOOSES) != 0u;
}

/* A direction w_i, distributed as the density of crt_bsdf or a delta. `choice`: two more random numbers,
   where crt_chooses. `hero`: 1 in the hero's lane, 0 elsewhere. `hero_only`: only the hero is
   alive. */
CRT_FN CrtScatter crt_bsdf_sample(const CrtBsdf *b, CrtRandom2 u, CrtRandom2 choice, vec4 hero,
                                  int hero_only) {
    (void)choice;
    switch (b->type) {
        case CRT_MATERIAL_DIFFUSE:
            if (CRT_HAS(DIFFUSE)) return crt_sample_lambert(b, u);
            break;
        case CRT_MATERIAL_MIRROR:
        case CRT_MATERIAL_CONDUCTOR:
            if (CRT_HAS(MIRROR) || CRT_HAS(CONDUCTOR)) return crt_sample_mirror_up(b, b->reflectance);
            break;
        case CRT_MATERIAL_ROUGH_CONDUCTOR:
            if (CRT_HAS(ROUGH_CONDUCTOR)) {
                if ((b->flags & CRT_BSDF_DELTA) != 0u) return crt_sample_mirror_up(b, b->reflectance);
                CrtBsdf about = *b;
                about.ng = crt_sampled_about(b);
                return crt_mirror_up(b, crt_sample_rough_conductor(&about, u));
            }
            break;
        case CRT_MATERIAL_DIELECTRIC:
            if (CRT_HAS(DIELECTRIC)) return crt_sample_smooth(b, hero, hero_only, u.x);
            break;
        case CRT_MATERIAL_ROUGH_DIELECTRIC:
            if (CRT_HAS(ROUGH_DIELECTRIC)) {
                if ((b->flags & CRT_BSDF_DELTA) == 0u)
                    return crt_to_its_side(b, crt_sample_rough_dielectric(b, u, choice));
                return crt_sample_smooth(b, hero, hero_only, u.x);
            }
            break;
        case CRT_MATERIAL_THIN_DIELECTRIC:
            if (CRT_HAS(THIN_DIELECTRIC))
                return crt_to_its_side(b, crt_sample_mirror(b->reflectance, b->wo, b->ns, b->ns));
            break;
        case CRT_MATERIAL_PLASTIC:
            if (CRT_HAS(PLASTIC)) return crt_sample_plastic(b, u, choice.x);
            break;
        default: break;
    }
    return crt_no_scatter();
}

/* f(w_o, w_i)·|cos w_i|, and the density per steradian with which crt_bsdf_sample finds w_i; both 0 for
   deltas. */
CRT_FN vec4 crt_bsdf(const CrtBsdf *b, vec3 wi, f32 *pdf) {
    *pdf = 0.0f;
    switch (b->type) {
        case CRT_MATERIAL_DIFFUSE:
            if (CRT_HAS(DIFFUSE)) {
                const f32 lambert = crt_lambert_pdf(b, wi);
                *pdf = lambert;
                return b->reflectance * lambert;
            }
            break;
        case CRT_MATERIAL_ROUGH_CONDUCTOR:
            if (CRT_HAS(ROUGH_CONDUCTOR) && (b->flags & CRT_BSDF_DELTA) == 0u)
                return crt_rough_conductor(b, wi, pdf);
            break;
        case CRT_MATERIAL_ROUGH_DIELECTRIC:
            if (CRT_HAS(ROUGH_DIELECTRIC) && (b->flags & CRT_BSDF_DELTA) == 0u) {
                /* Directions that crt_to_its_side mirrors are not part of the lobe. */
                if ((CRT_HAS(SMOOTH_NORMALS) || CRT_HAS(NORMAL_MAP)) && !crt_keeps_side(b, wi)) break;
                return crt_rough_dielectric(b, wi, pdf);
            }
            break;
        case CRT_MATERIAL_PLASTIC:
            if (CRT_HAS(PLASTIC)) return crt_plastic(b, wi, pdf);
            break;
        default: break;
    }
    return splat4(0.0f);
}

CRT_KERNEL_END

#endif
