/*
 * layers.h: a BSDF with the fuzz that lies on it (fuzz.h): what normal_map.h and shade.h ask.
 */
#ifndef CRT_LAYERS_H
#define CRT_LAYERS_H

#include "bsdf.h"
#include "fuzz.h"

CRT_KERNEL_BEGIN

/* Whether light sampling finds nothing of it. */
CRT_FN int crt_is_delta(const CrtBsdf *b) {
    return (b->flags & CRT_BSDF_DELTA) != 0u && !crt_is_fuzzy(b);
}

CRT_FN void crt_layered_prepare(const CrtContext *ctx, CrtBsdf *b, const CrtSurface *surface, vec3 wo,
                                vec4 position, vec4 carried, int albedo) {
    crt_bsdf_prepare(ctx, b, surface, wo, position, carried, albedo);
    if (CRT_HAS(FUZZ)) crt_prepare_fuzz(ctx, b, surface, position, albedo);
}

/* Of `below`, the value of what lies under the fuzz, and *pdf, its density: those of both. */
CRT_FN vec4 crt_add_fuzz(const CrtBsdf *b, vec3 wi, vec4 below, f32 *pdf) {
    f32 pdf_fuzz;
    const vec4 fuzz = crt_fuzz(b, wi, &pdf_fuzz);
    *pdf = (1.0f - b->fuzz_chance) * *pdf + b->fuzz_chance * pdf_fuzz;
    return below * (1.0f - b->fuzz_albedo) + fuzz;
}

CRT_FN vec4 crt_layered_eval(const CrtBsdf *b, vec3 wi) {
    f32 pdf;
    const vec4 below = crt_bsdf(b, wi, &pdf);
    return crt_is_fuzzy(b) ? crt_add_fuzz(b, wi, below, &pdf) : below;
}

CRT_FN f32 crt_layered_pdf(const CrtBsdf *b, vec3 wi) {
    f32 pdf;
    const vec4 below = crt_bsdf(b, wi, &pdf);
    if (crt_is_fuzzy(b)) (void)crt_add_fuzz(b, wi, below, &pdf);
    return pdf;
}

/* The fuzz or what lies below it by chance, for which u.x is used twice; but for single directions, weighed
   by the density of both. */
CRT_FN CrtScatter crt_layered_sample(const CrtBsdf *b, CrtRandom2 u, CrtRandom2 choice, vec4 hero,
                                     int alone) {
    const int fuzzy = crt_is_fuzzy(b);
    const f32 chance = fuzzy ? b->fuzz_chance : 0.0f;
    const int of_fuzz = fuzzy && u.x < chance;
    if (fuzzy) u.x = crt_rescaled(u.x, chance);
    CrtScatter s;
    vec4 below;
    f32 pdf;
    if (of_fuzz) {
        s = crt_no_scatter();
        s.wi = crt_fuzz_direction(b, u);
        s.valid = 1;
        if (!(dot3(s.wi, b->ng) > 0.0f)) {
            s.weight = b->fuzz_color / chance;
            s.valid = CRT_HAS(SMOOTH_NORMALS);
            return crt_turned_up(b, s);
        }
        below = crt_bsdf(b, s.wi, &pdf);
    } else {
        s = crt_bsdf_sample(b, u, choice, hero, alone);
        if (!fuzzy || !s.valid) return s;
        if (s.pdf == 0.0f) {
            s.weight = s.weight * ((1.0f - b->fuzz_albedo) / (1.0f - chance));
            return s;
        }
        below = s.weight * s.pdf;
        pdf = s.pdf;
    }
    const vec4 both = crt_add_fuzz(b, s.wi, below, &pdf);
    s.pdf = pdf;
    s.valid = s.pdf > 0.0f;
    if (s.valid) s.weight = both / s.pdf;
    return s;
}

CRT_KERNEL_END

#endif
