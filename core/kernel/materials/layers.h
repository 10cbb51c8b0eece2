/*
 * layers.h: a BSDF with its layers, fuzz (fuzz.h) over a coat (clearcoat.h). normal_map.h and shade.h use
 * these functions.
 */
#ifndef CRT_LAYERS_H
#define CRT_LAYERS_H

#include "kernel/materials/bsdf.h"
#include "kernel/materials/clearcoat.h"
#include "kernel/materials/fuzz.h"

CRT_KERNEL_BEGIN

/* True if light sampling cannot find any of the scattered light. */
CRT_FN int crt_is_delta(const CrtBsdf *b) {
    return (b->flags & CRT_BSDF_DELTA) != 0u && !crt_is_fuzzy(b) && !crt_is_coat_lobe(b);
}

CRT_FN void crt_layered_prepare(const CrtContext *ctx, CrtBsdf *b, const CrtSurface *surface, vec3 wo,
                                vec4 position, vec4 carried, int albedo) {
    CRT_GLOBAL const CrtLayers *coat = crt_clear_layers(ctx, surface->material);
    crt_bsdf_prepare(ctx, b, surface, wo, position, carried, albedo || coat != 0);
    if (CRT_HAS(CLEARCOAT)) {
        b->clear_eta = 0.0f;
        if (coat != 0) crt_prepare_clearcoat(ctx, b, coat, surface, position, albedo);
    }
    if (CRT_HAS(FUZZ)) crt_prepare_fuzz(ctx, b, surface, position, albedo);
}

/* Of `below`, the value of what lies under the layers, and *pdf, its density: those of all. */
CRT_FN vec4 crt_add_layers(const CrtBsdf *b, vec3 wi, vec4 below, f32 *pdf) {
    if (crt_is_coated(b)) below = crt_add_clearcoat(b, wi, below, pdf);
    if (crt_is_fuzzy(b)) below = crt_add_fuzz(b, wi, below, pdf);
    return below;
}

CRT_FN vec4 crt_layered_eval(const CrtBsdf *b, vec3 wi) {
    f32 pdf;
    const vec4 below = crt_bsdf(b, wi, &pdf);
    return crt_add_layers(b, wi, below, &pdf);
}

CRT_FN f32 crt_layered_pdf(const CrtBsdf *b, vec3 wi) {
    f32 pdf;
    const vec4 below = crt_bsdf(b, wi, &pdf);
    (void)crt_add_layers(b, wi, below, &pdf);
    return pdf;
}

#define CRT_LAYER_NONE 0 /* what lies below */
#define CRT_LAYER_COAT 1
#define CRT_LAYER_FUZZ 2

/* Of one layer alone, chosen with `chance`: what a smooth coat mirrors; and what goes below the surface,
   mirrored up by it. */
CRT_FN CrtScatter crt_sample_layer_alone(const CrtBsdf *b, int layer, CrtScatter s, f32 chance) {
    const f32 seen = crt_is_fuzzy(b) ? 1.0f - b->fuzz_albedo : 1.0f; /* of the coat */
    if (layer == CRT_LAYER_FUZZ) {
        s.weight = b->fuzz_color / chance;
    } else if (!crt_is_coat_lobe(b)) {
        return crt_sample_mirror_up(b, splat4(b->clear_albedo * (seen / chance)));
    } else {
        f32 pdf;
        const f32 value = crt_clearcoat(b, s.wi, &pdf);
        s.weight = splat4(pdf > 0.0f ? value / pdf * (seen / chance) : 0.0f);
    }
    s.valid = CRT_HAS(SMOOTH_NORMALS);
    return crt_mirror_up(b, s);
}

/* A single direction of what lies below the layers, reached with `chance`. */
CRT_FN CrtScatter crt_single_below(const CrtBsdf *b, CrtScatter s, f32 chance) {
    if (crt_is_coated(b)) s.weight = s.weight * crt_through_clearcoat(b, s.wi);
    s.weight = s.weight * ((crt_is_fuzzy(b) ? 1.0f - b->fuzz_albedo : 1.0f) / chance);
    return s;
}

/* One of the layers or what lies below them by chance, for which u.x is used again; but for single
   directions, weighed by the density of all. */
CRT_FN CrtScatter crt_layered_sample(const CrtBsdf *b, CrtRandom2 u, CrtRandom2 choice, vec4 hero,
                                     int hero_only) {
    int layer = CRT_LAYER_NONE;
    f32 chance = 1.0f;
    if (crt_is_fuzzy(b)) {
        const int chosen = u.x < b->fuzz_chance;
        if (chosen) layer = CRT_LAYER_FUZZ;
        chance = chosen ? b->fuzz_chance : 1.0f - b->fuzz_chance;
        u.x = crt_rescaled(u.x, b->fuzz_chance);
    }
    if (crt_is_coated(b) && layer == CRT_LAYER_NONE) {
        const int chosen = u.x < b->clear_chance;
        if (chosen) layer = CRT_LAYER_COAT;
        chance *= chosen ? b->clear_chance : 1.0f - b->clear_chance;
        u.x = crt_rescaled(u.x, b->clear_chance);
    }
    CrtScatter s;
    vec4 below;
    f32 pdf;
    if (layer != CRT_LAYER_NONE) {
        s = crt_no_scatter();
        if (layer == CRT_LAYER_FUZZ) {
            s.wi = crt_fuzz_direction(b, u);
        } else if (crt_is_coat_lobe(b)) {
            s.wi = crt_clearcoat_direction(b, u);
            if (!(dot3(s.wi, b->ns) > 0.0f)) return s;
        }
        s.valid = 1;
        if (!(dot3(s.wi, b->ng) > 0.0f)) return crt_sample_layer_alone(b, layer, s, chance);
        below = crt_bsdf(b, s.wi, &pdf);
    } else {
        s = crt_bsdf_sample(b, u, choice, hero, hero_only);
        if (!s.valid || (!crt_is_fuzzy(b) && !crt_is_coated(b))) return s;
        if (s.pdf == 0.0f) return crt_single_below(b, s, chance);
        below = s.weight * s.pdf;
        pdf = s.pdf;
    }
    const vec4 all = crt_add_layers(b, s.wi, below, &pdf);
    s.pdf = pdf;
    s.valid = s.pdf > 0.0f;
    if (s.valid) s.weight = all / s.pdf;
    return s;
}

CRT_KERNEL_END

#endif
