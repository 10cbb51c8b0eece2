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

CRT_FN vec4 crt_layered_eval(const CrtBsdf *b, vec3 wi) {
    const vec4 below = crt_bsdf_eval(b, wi);
    if (!crt_is_fuzzy(b)) return below;
    f32 unused;
    return below * (1.0f - b->fuzz_albedo) + crt_fuzz(b, wi, &unused);
}

CRT_FN f32 crt_layered_pdf(const CrtBsdf *b, vec3 wi) {
    const f32 below = crt_bsdf_pdf(b, wi);
    if (!crt_is_fuzzy(b)) return below;
    f32 pdf;
    (void)crt_fuzz(b, wi, &pdf);
    return (1.0f - b->fuzz_chance) * below + b->fuzz_chance * pdf;
}

/* The fuzz or what lies below it by chance, for which u.x is used twice; but for single directions, weighed
   by the density of both. */
CRT_FN CrtScatter crt_layered_sample(const CrtBsdf *b, CrtRandom2 u, CrtRandom2 choice, vec4 hero,
                                     int alone) {
    if (!crt_is_fuzzy(b)) return crt_bsdf_sample(b, u, choice, hero, alone);
    const f32 chance = b->fuzz_chance;
    const int of_fuzz = u.x < chance;
    u.x = crt_min(of_fuzz ? u.x / chance : (u.x - chance) / (1.0f - chance), 1.0f - CRT_EPSILON);
    CrtScatter s;
    vec4 below;
    f32 pdf_below, pdf;
    if (of_fuzz) {
        s = crt_no_scatter();
        s.wi = crt_fuzz_direction(b, u);
        s.valid = 1;
        if (!(dot3(s.wi, b->ng) > 0.0f)) {
            s.weight = b->fuzz_color / chance;
            s.valid = CRT_HAS(SMOOTH_NORMALS);
            return crt_turned_up(b, s);
        }
        below = crt_bsdf_eval(b, s.wi);
        pdf_below = crt_bsdf_pdf(b, s.wi);
    } else {
        s = crt_bsdf_sample(b, u, choice, hero, alone);
        if (!s.valid) return s;
        if (s.pdf == 0.0f) {
            s.weight = s.weight * ((1.0f - b->fuzz_albedo) / (1.0f - chance));
            return s;
        }
        below = s.weight * s.pdf;
        pdf_below = s.pdf;
    }
    const vec4 fuzz = crt_fuzz(b, s.wi, &pdf);
    s.pdf = (1.0f - chance) * pdf_below + chance * pdf;
    s.valid = s.pdf > 0.0f;
    if (s.valid) s.weight = (below * (1.0f - b->fuzz_albedo) + fuzz) / s.pdf;
    return s;
}

CRT_KERNEL_END

#endif
