/*
 * thin_film.h: a film of some hundred nanometres on a metal or a dielectric: the reflections of its two
 * sides interfere. Airy's sum of all rounds within the film (Born and Wolf, 7.6.1), for both polarisations,
 * at each wavelength of the path:
 *
 *     r = (r₁₂ + r₂₃ e) / (1 + r₁₂ r₂₃ e),    e = exp(2πi · 2 n₂ d cos θ₂ / λ)
 *
 * The film absorbs nothing: light that a dielectric under it does not reflect passes. Beyond the film's
 * critical angle cos θ₂ is imaginary, e real, and light tunnels.
 */
#ifndef CRT_THIN_FILM_H
#define CRT_THIN_FILM_H

#include "kernel/materials/scatter.h"
#include "kernel/values/value.h"

CRT_KERNEL_BEGIN

typedef struct CrtComplex {
    f32 re, im;
} CrtComplex;

CRT_FN CrtComplex crt_complex(f32 re, f32 im) {
    CrtComplex z;
    z.re = re;
    z.im = im;
    return z;
}
CRT_FN CrtComplex crt_complex_sum(CrtComplex a, CrtComplex b) {
    return crt_complex(a.re + b.re, a.im + b.im);
}
CRT_FN CrtComplex crt_complex_difference(CrtComplex a, CrtComplex b) {
    return crt_complex(a.re - b.re, a.im - b.im);
}
CRT_FN CrtComplex crt_complex_product(CrtComplex a, CrtComplex b) {
    return crt_complex(crt_difference_of_products(a.re, b.re, a.im, b.im),
                       crt_difference_of_products(a.re, b.im, -a.im, b.re));
}
CRT_FN f32 crt_complex_square(CrtComplex z) { return z.re * z.re + z.im * z.im; }

/* The root with Im ≥ 0, of z with Im ≥ 0. */
CRT_FN CrtComplex crt_complex_root(CrtComplex z) {
    const f32 size = crt_sqrt(crt_complex_square(z));
    /* The larger part first: the difference of the other has no digits left. */
    const f32 larger = crt_sqrt(0.5f * (size + crt_abs(z.re)));
    const f32 smaller = larger > 0.0f ? 0.5f * z.im / larger : 0.0f;
    return z.re < 0.0f ? crt_complex(smaller, larger) : crt_complex(larger, smaller);
}

/* |r|² of one polarisation from the admittances of the three media and e. */
CRT_FN f32 crt_airy(f32 before, CrtComplex film, CrtComplex beyond, CrtComplex e) {
    const CrtComplex y1 = crt_complex(before, 0.0f);
    const CrtComplex n12 = crt_complex_difference(y1, film), d12 = crt_complex_sum(y1, film);
    const CrtComplex n23 = crt_complex_difference(film, beyond), d23 = crt_complex_sum(film, beyond);
    const CrtComplex n23_e = crt_complex_product(n23, e);
    const CrtComplex above = crt_complex_sum(crt_complex_product(n12, d23), crt_complex_product(n23_e, d12));
    const CrtComplex below = crt_complex_sum(crt_complex_product(d12, d23), crt_complex_product(n12, n23_e));
    const f32 square = crt_complex_square(below);
    /* The film's admittance vanishes at its critical angle only: no light enters it there. */
    return square > 0.0f ? crt_min(crt_complex_square(above) / square, 1.0f) : 1.0f;
}

/* Reflectance of what is polarised across the plane of incidence, and *along of what is in it, at one
   wavelength and cosine of incidence. Indices are relative to the medium before the film: `film` of the
   film, n + ik of what is under it. `rounds`: 2 d n₁ / λ. */
CRT_HOT_FN f32 crt_film_polarised(f32 cos_i, f32 film, f32 rounds, f32 n, f32 k, f32 *along) {
    *along = 1.0f;
    if (k == 0.0f && !(crt_refraction(cos_i, n) > 0.0f)) return 1.0f;
    /* n cos θ of the media but the first: (n cos θ)² = n² − sin². */
    const f32 square = crt_refraction(cos_i, film);
    const f32 root = crt_sqrt(crt_abs(square));
    const CrtComplex inside = square < 0.0f ? crt_complex(0.0f, root) : crt_complex(root, 0.0f);
    const CrtComplex index2 = crt_complex((n - k) * (n + k), 2.0f * n * k);
    const CrtComplex beyond = crt_complex_root(
        crt_complex(crt_refraction(cos_i, n) - k * k, index2.im));
    CrtComplex e;
    if (square < 0.0f) {
        e = crt_complex(crt_exp_negative(-2.0f * CRT_PI * rounds * root), 0.0f);
    } else {
        const f32 turns = rounds * root;
        e.im = crt_sincos(2.0f * CRT_PI * (turns - crt_floor(turns)), &e.re);
    }
    /* Across the plane of incidence n cos θ, in it cos θ / n = n cos θ / n². */
    const f32 across = crt_airy(cos_i, inside, beyond, e);
    const f32 inverse = 1.0f / (film * film), size = crt_complex_square(index2);
    const CrtComplex conjugate = crt_complex(index2.re / size, -index2.im / size);
    *along = crt_airy(cos_i, crt_complex(inside.re * inverse, inside.im * inverse),
                      crt_complex_product(beyond, conjugate), e);
    return across;
}

/* The mean of both: unpolarised light. */
CRT_FN f32 crt_film_reflectance_lane(f32 cos_i, f32 film, f32 rounds, f32 n, f32 k) {
    f32 along;
    const f32 across = crt_film_polarised(cos_i, film, rounds, n, k, &along);
    return 0.5f * (across + along);
}

/* The same at the path's wavelengths. */
CRT_FN vec4 crt_film_reflectance(const CrtBsdf *b, f32 cos_i) {
    vec4 reflectance = splat4(0.0f);
    CRT_ROLLED for (u32 lane = 0u; lane < 4u; ++lane)
        reflectance = crt_with_lane(
            reflectance, lane,
            crt_film_reflectance_lane(cos_i, crt_lane(b->film_eta, lane), crt_lane(b->film_rounds, lane),
                                      crt_lane(b->eta, lane), crt_lane(b->k, lane)));
    return reflectance;
}

/* Reads the film of a material whose eta and k are set. `before`: index on w_o's side over that outside. */
CRT_HOT_FN void crt_prepare_film(const CrtContext *ctx, CrtBsdf *b, const CrtMaterial *material,
                                 const CrtSurface *surface, vec4 position, vec4 before) {
    if (material->film_thickness == 0u) return;
    const f32 thickness_nm =
        V4X(crt_value(ctx, material->film_thickness, surface, position)) * material->film_scale;
    if (!(thickness_nm > 0.0f)) return;
    b->flags |= CRT_BSDF_FILM;
    b->film_rounds = before * (2.0f * thickness_nm) / (position + splat4(CRT_WAVELENGTH_MIN_NM));
    b->film_eta = crt_value(ctx, material->film_index, surface, position) / before;
}

CRT_FN int crt_has_film(const CrtBsdf *b) {
    return CRT_HAS(THIN_FILM) && (b->flags & CRT_BSDF_FILM) != 0u;
}

/* Its mean over the cosine, 2 ∫ R c dc, by three points of Gauss in c². */
CRT_FN vec4 crt_film_mean(const CrtBsdf *b) {
    vec4 mean = splat4(0.0f);
    CRT_ROLLED for (u32 i = 0u; i < 3u; ++i) {
        const f32 cosine = i == 0u ? 0.33571089f : (i == 1u ? 0.70710678f : 0.94196514f);
        mean = mean + crt_film_reflectance(b, cosine) * (i == 1u ? 0.44444444f : 0.27777778f);
    }
    return mean;
}

/* Unpolarised reflectance of a dielectric at each wavelength, with or without a film. */
CRT_FN vec4 crt_dielectric_reflectance(const CrtBsdf *b, f32 cos_i) {
    if (crt_has_film(b)) return crt_film_reflectance(b, cos_i);
    return crt_fresnel_dielectric4(cos_i, b->eta);
}

/* True if the reflectance of a dielectric depends on the wavelength. */
CRT_FN int crt_is_divided(const CrtBsdf *b) {
    return (CRT_HAS(DISPERSION) && (b->flags & CRT_BSDF_DISPERSIVE) != 0u) || crt_has_film(b);
}

/* Smooth dielectric under a film. */
CRT_FN CrtScatter crt_sample_filmed_dielectric(const CrtBsdf *b, vec4 hero, int hero_only, f32 u) {
    const f32 cos_i = crt_min(dot3(b->wo, b->ns), 1.0f);
    const vec4 fresnel = crt_film_reflectance(b, cos_i);
    return crt_reflect_or_refract(b->wo, b->ns, cos_i,
                                  CRT_HAS(DISPERSION) ? sum4(b->eta * hero) : V4X(b->eta), fresnel,
                                  splat4(1.0f) - fresnel, sum4(b->lanes * fresnel),
                                  (b->flags & CRT_BSDF_DISPERSIVE) != 0u && !hero_only, u);
}

CRT_KERNEL_END

#endif
