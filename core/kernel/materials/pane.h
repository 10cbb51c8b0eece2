/*
 * pane.h: thin panes. A pane is two parallel interfaces so close together that transmitted light is neither
 * bent nor shifted. Light is reflected back and forth between them and keeps its polarisation (Stokes
 * 1862), so for each polarisation
 *
 *     T = (1 − R₁)(1 − R₂) / (1 − R₁ R₂),
 *
 * with R₁ and R₂ the reflectances of the two sides. T of unpolarised light is the mean of both. The pane
 * reflects the rest and absorbs nothing.
 */
#ifndef CRT_PANE_H
#define CRT_PANE_H

#include "kernel/materials/thin_film.h"

CRT_KERNEL_BEGIN

/* T of one polarisation, from the admittances a before and b in the glass, and the reflectance of the side
   with a film. Of two bare sides it is 2ab / (a² + b²), without a difference of near numbers. */
CRT_FN f32 crt_pane_polarised(f32 a, f32 b, int filmed, f32 film) {
    if (!filmed) return 2.0f * a * b / (a * a + b * b);
    const f32 passed = 4.0f * a * b / ((a + b) * (a + b)); /* 1 − R₂ */
    const f32 ends = (1.0f - film) + film * passed;        /* 1 − R₁ R₂ */
    return ends > 0.0f ? (1.0f - film) * passed / ends : 0.0f;
}

/* T of unpolarised light at one wavelength. `rounds`: of the film, as crt_film_polarised has them. */
CRT_FN f32 crt_pane_transmittance_lane(f32 cos_i, f32 eta, int filmed, f32 film_eta, f32 rounds) {
    const f32 refraction = crt_refraction(cos_i, eta);
    if (!(refraction > 0.0f)) return 0.0f; /* thinner than its surroundings, and beyond the critical angle */
    f32 across = 0.0f, along = 0.0f;
    if (filmed) across = crt_film_polarised(cos_i, film_eta, rounds, eta, 0.0f, &along);
    const f32 b = crt_sqrt(refraction);
    return 0.5f * (crt_pane_polarised(cos_i, b, filmed, across) +
                   crt_pane_polarised(eta * eta * cos_i, b, filmed, along));
}

/* The transmittance of a pane at the path's wavelengths. It is the same in both directions of the light. */
CRT_HOT_FN vec4 crt_pane_transmittance(const CrtBsdf *b, f32 cos_i) {
    const int filmed = crt_has_film(b);
    vec4 passed = splat4(0.0f);
    CRT_ROLLED for (u32 lane = 0u; lane < 4u; ++lane) passed = crt_with_lane(
        passed, lane,
        crt_pane_transmittance_lane(cos_i, crt_lane(b->eta, lane), filmed,
                                    CRT_HAS(THIN_FILM) && filmed ? crt_lane(b->film_eta, lane) : 0.0f,
                                    CRT_HAS(THIN_FILM) && filmed ? crt_lane(b->film_rounds, lane) : 0.0f));
    return passed;
}

/* Reads what a pane is made of. */
CRT_FN void crt_prepare_pane(const CrtContext *ctx, CrtBsdf *b, const CrtMaterial *material,
                             const CrtSurface *surface, vec4 position) {
    b->eta = crt_value(ctx, material->of.glass.eta, surface, position);
    if (CRT_HAS(THIN_FILM)) {
        b->k = b->film_eta = b->film_rounds = splat4(0.0f);
        crt_prepare_film(ctx, b, material, surface, position, splat4(1.0f));
    }
}

/* Cosine of incidence of direction d: with the interpolated normal where that faces d. A normal map turns
   what a pane mirrors and not how much, so that all rays through it need no map. */
CRT_FN f32 crt_pane_cosine(const CrtSurface *surface, vec3 d) {
    const f32 flat = dot3(d, surface->ng);
    const f32 cosine = flat > 0.0f ? dot3(d, surface->ns) : -dot3(d, surface->ns);
    return crt_min(cosine > 0.0f ? cosine : crt_abs(flat), 1.0f);
}

CRT_KERNEL_END

#endif
