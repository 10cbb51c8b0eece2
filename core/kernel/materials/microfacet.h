/*
 * microfacet.h: rough metals and rough glass: GGX's distribution of normals, isotropic or wider along a
 * tangent (anisotropy.h), Smith's shadowing correlated by height, and normals sampled as w_o sees them.
 */
#ifndef CRT_MICROFACET_H
#define CRT_MICROFACET_H

#include "kernel/materials/compensation.h"
#include "kernel/materials/metal.h"

CRT_KERNEL_BEGIN

/* Two directions in the shading frame, each with the root of Smith's shadowing, a = √(cos² + α² sin²),
   of which Λ = (a/cos − 1)/2 (Heitz 2014); and GGX's density of the normal halfway. */
typedef struct CrtMicrofacet {
    f32 cos_o, cos_i; /* 0 or below: the microfacets do not mirror between them */
    f32 cos_m;        /* of both with the normal halfway */
    f32 root_o, root_i;
    f32 density;
} CrtMicrofacet;

/* Of the direction w, at `cosine` to the normal. */
CRT_FN f32 crt_smith_root(const CrtBsdf *b, vec3 w, f32 cosine) {
    const f32 cos2 = cosine * cosine;
    if (CRT_HAS(ANISOTROPY) && crt_is_anisotropic(b)) {
        const f32 x = b->alpha * dot3(w, b->tangent);
        const f32 y = b->alpha * b->narrowing * dot3(w, cross3(b->ns, b->tangent));
        return crt_sqrt(cos2 + x * x + y * y);
    }
    return crt_sqrt(crt_max(cos2 + b->alpha * b->alpha * (1.0f - cos2), 0.0f));
}

/* GGX's density of the normal (x, y, z)/√hh in the facets' frame: α²/π / (sin² + α² cos²)²; where
   it is narrower across, 1 / (π α_t α_b (x²/α_t² + y²/α_b² + z²)²). */
CRT_FN f32 crt_normal_density(const CrtBsdf *b, f32 x, f32 y, f32 z, f32 hh) {
    f32 narrowing = 1.0f;
    if (CRT_HAS(ANISOTROPY) && crt_is_anisotropic(b)) narrowing = b->narrowing;
    if (CRT_HAS(ANISOTROPY)) y = y / narrowing;
    const f32 spread = (x * x + y * y + b->alpha * b->alpha * (z * z)) / hh;
    const f32 density = CRT_INV_PI * (b->alpha / spread) * (b->alpha / spread);
    return CRT_HAS(ANISOTROPY) ? density / narrowing : density;
}

CRT_FN CrtMicrofacet crt_microfacet(const CrtBsdf *b, vec3 wi) {
    const CrtFrame frame = crt_facet_frame(b);
    const vec3 h = b->wo + wi;
    const f32 x = dot3(frame.s, h), y = dot3(frame.t, h), z = dot3(frame.n, h);
    const f32 hh = x * x + y * y + z * z;
    CrtMicrofacet m;
    m.cos_o = dot3(b->wo, b->ns);
    m.cos_i = dot3(wi, b->ns);
    m.cos_m = crt_min(dot3(b->wo, h) / crt_sqrt(hh), 1.0f);
    m.root_o = crt_smith_root(b, b->wo, m.cos_o);
    m.root_i = crt_smith_root(b, wi, m.cos_i);
    m.density = crt_normal_density(b, x, y, z, hh);
    return m;
}

/* The share of its microfacets' losses that a metal gives back, f·cos. */
CRT_FN vec4 crt_metal_returned(const CrtBsdf *b, vec3 wi, f32 cos_i) {
    return b->reflectance *
           (crt_loss_lane(b, 0u, crt_loss_place(b, wi, cos_i), 0.0f) * crt_lambert(cos_i));
}

/* f·cos = F D G₂ / (4 cos_o), G₂ = 1 / (1 + Λ_o + Λ_i): shadowing and masking correlated by height;
   and what is given back. The density is that of the visible normals, G₁ D cos_m / cos_o, turned into that
   of directions by 1 / (4 cos_m), together with that of what is given back. */
CRT_FN vec4 crt_rough_conductor(const CrtBsdf *b, vec3 wi, f32 *pdf) {
    const CrtMicrofacet m = crt_microfacet(b, wi);
    *pdf = 0.0f;
    if (!(m.cos_o > 0.0f) || !(m.cos_i > 0.0f)) return splat4(0.0f);
    *pdf = b->lost_chance * crt_given_back_pdf(b, 0u, m.cos_i) +
           (1.0f - b->lost_chance) * (m.density / (2.0f * (m.cos_o + m.root_o)));
    return crt_metal_returned(b, wi, m.cos_i) +
           crt_metal_reflectance(b, m.cos_m) *
               (m.density * m.cos_i / (2.0f * (m.root_o * m.cos_i + m.root_i * m.cos_o)));
}

/* One of the normals that w_o sees (Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical
   Caps"): stretched by α, they are those halfway to a cap of the sphere. */
CRT_HOT_FN vec3 crt_visible_normal(const CrtBsdf *b, CrtRandom2 u) {
    const CrtFrame frame = crt_facet_frame(b);
    f32 across = b->alpha;
    if (CRT_HAS(ANISOTROPY) && crt_is_anisotropic(b)) across = b->alpha * b->narrowing;
    const vec3 stretched = normalize3(make_vec3(b->alpha * dot3(b->wo, frame.s),
                                                across * dot3(b->wo, frame.t), dot3(b->wo, frame.n)));
    f32 cos_phi;
    const f32 sin_phi = crt_sincos(2.0f * CRT_PI * u.x, &cos_phi);
    const f32 z = crt_fma(1.0f - u.y, 1.0f + V3Z(stretched), -V3Z(stretched));
    const f32 sine = crt_sqrt(crt_max(0.0f, 1.0f - z * z));
    const vec3 cap = make_vec3(sine * cos_phi, sine * sin_phi, z) + stretched;
    return crt_to_world(
        frame, normalize3(make_vec3(b->alpha * V3X(cap), across * V3Y(cap), crt_max(V3Z(cap), 0.0f))));
}

CRT_FN CrtScatter crt_sample_rough_conductor(const CrtBsdf *b, CrtRandom2 u) {
    CrtScatter s = crt_no_scatter();
    const int given_back = u.x < b->lost_chance;
    u.x = crt_rescaled(u.x, b->lost_chance);
    s.wi = given_back ? crt_given_back_direction(b, 0u, b->ns, u)
                      : normalize3(crt_reflect(b->wo, crt_visible_normal(b, u)));
    const vec4 value = crt_rough_conductor(b, s.wi, &s.pdf);
    s.valid = dot3(s.wi, b->ng) > 0.0f && s.pdf > 0.0f;
    if (s.valid) s.weight = value / s.pdf;
    return s;
}

/* Rough dielectric (Walter et al. 2007; PBRT 4e, 9.7): each microfacet mirrors the share of light that
 * Fresnel's equations give, and refracts the rest.
 *
 * Where the index depends on the wavelength, so does the microfacet that refracts between two directions.
 * Every wavelength has its value for any pair of directions; a direction is sampled by the index of one of
 * them, chosen at each vertex by the path's throughput in each (`lanes`), and its density is the mean over
 * that choice. All four wavelengths stay alive, weighted: the balance heuristic over the wavelengths at
 * each vertex (compare Wilkie et al. 2014, who choose one for a whole path). */

/* Refraction by one microfacet from w_i to w_o at one wavelength. */
typedef struct CrtRefracted {
    f32 value; /* f·|cos| */
    f32 pdf;
} CrtRefracted;

/* Where the lobe is narrower than this, index and roughness being too small to blur what is seen through the
   surface, the half vector loses its digits: it is taken for smooth. Radians. */
#define CRT_BEND_MIN 1e-4f

/* True if an interface of index `eta` and width `alpha` is more than smooth at all four wavelengths. */
CRT_FN int crt_is_rough(f32 alpha, vec4 eta) {
    const vec4 bend = make_vec4(crt_abs(V4X(eta) - 1.0f), crt_abs(V4Y(eta) - 1.0f),
                                crt_abs(V4Z(eta) - 1.0f), crt_abs(V4W(eta) - 1.0f));
    const f32 least = crt_min(crt_min(V4X(bend), V4Y(bend)), crt_min(V4Z(bend), V4W(bend)));
    return alpha >= CRT_ALPHA_MIN && alpha * least >= CRT_BEND_MIN;
}

CRT_FN CrtRefracted crt_rough_refraction(const CrtBsdf *b, vec3 wi, u32 lane) {
    const f32 eta = crt_lane(b->eta, lane);
    CrtRefracted r;
    r.value = r.pdf = 0.0f;
    const CrtFrame frame = crt_facet_frame(b);
    const vec3 h = b->wo + wi * eta; /* along the microfacet's normal, of either sense, of length √hh */
    const f32 x = dot3(frame.s, h), y = dot3(frame.t, h), z = dot3(frame.n, h);
    const f32 hh = x * x + y * y + z * z;
    const f32 outwards = z < 0.0f ? -1.0f : 1.0f;
    const f32 h_o = dot3(b->wo, h) * outwards, h_i = -dot3(wi, h) * outwards;
    if (!(h_o > 0.0f) || !(h_i > 0.0f)) return r; /* the microfacet is seen from behind */
    const f32 cos_o = dot3(b->wo, b->ns), cos_i = -dot3(wi, b->ns);
    if (!(cos_o > 0.0f) || !(cos_i > 0.0f)) return r;
    const f32 root_o = crt_smith_root(b, b->wo, cos_o), root_i = crt_smith_root(b, wi, cos_i);
    const f32 density = crt_normal_density(b, x, y, z, hh);
    const f32 cos_m = crt_min(h_o / crt_sqrt(hh), 1.0f);
    const f32 passed =
        1.0f - (crt_has_film(b)
                    ? crt_film_reflectance_lane(cos_m, crt_lane(b->film_eta, lane),
                                                crt_lane(b->film_rounds, lane), eta, 0.0f)
                    : crt_fresnel_dielectric(cos_m, eta));
    /* |w_i·m| |w_o·m| / (w_o·m + η w_i·m)², with m = h/√hh, is h_i h_o / hh². The density of
       normals becomes that of directions by dm/dw_i = η² |w_i·m| / (w_o·m + η w_i·m)² (Walter,
       equation 17). */
    const f32 turned = passed * density * (h_o / hh) * (h_i / hh);
    r.value = turned * 2.0f * cos_i / (root_o * cos_i + root_i * cos_o);
    r.pdf = turned * 2.0f * eta * eta / (cos_o + root_o);
    return r;
}

/* f·|cos| at each wavelength, and the density of w_i: the visible normals' times the share of what they
   mirror or refract. Sides are those of n_s. */
CRT_FN vec4 crt_rough_dielectric(const CrtBsdf *b, vec3 wi, f32 *pdf) {
    *pdf = 0.0f;
    const int mirrored = dot3(wi, b->ns) > 0.0f;
    const int divided = crt_is_divided(b);
    if (mirrored) {
        const CrtMicrofacet m = crt_microfacet(b, wi);
        if (!(m.cos_o > 0.0f)) return splat4(0.0f);
        const vec4 fresnel = divided ? crt_dielectric_reflectance(b, m.cos_m)
                                        : splat4(crt_fresnel_dielectric(m.cos_m, V4X(b->eta)));
        const u32 side = b->losses.side;
        const vec4 given_back = b->reflectance * crt_loss(b, side, crt_loss_place(b, wi, m.cos_i));
        *pdf = b->lost_chance * b->back_share * crt_given_back_pdf(b, side, m.cos_i) +
               (1.0f - b->lost_chance) * (divided ? sum4(b->lanes * fresnel) : V4X(fresnel)) *
                   (m.density / (2.0f * (m.cos_o + m.root_o)));
        return given_back * crt_lambert(m.cos_i) +
               fresnel * (m.density * m.cos_i / (2.0f * (m.root_o * m.cos_i + m.root_i * m.cos_o)));
    }
    const f32 cos_i = -dot3(wi, b->ns);
    const u32 beyond = 1u - b->losses.side;
    const vec4 given_back = b->through * crt_loss(b, beyond, crt_loss_place(b, wi, cos_i));
    const u32 lanes = divided ? 4u : 1u;
    vec4 value = splat4(0.0f), density = splat4(0.0f);
    CRT_ROLLED for (u32 lane = 0u; lane < lanes; ++lane) {
        const CrtRefracted r = crt_rough_refraction(b, wi, lane);
        value = crt_with_lane(value, lane, r.value);
        density = crt_with_lane(density, lane, r.pdf);
    }
    *pdf = b->lost_chance * (1.0f - b->back_share) * crt_given_back_pdf(b, beyond, cos_i) +
           (1.0f - b->lost_chance) * (divided ? sum4(b->lanes * density) : V4X(density));
    return given_back * crt_lambert(cos_i) + (divided ? value : splat4(V4X(value)));
}

/* A direction by one of the visible normals. `choice`: of mirroring and refracting, and of the wavelength
   by whose index. Of length 0 where there is none. */
CRT_FN vec3 crt_rough_dielectric_direction(const CrtBsdf *b, CrtRandom2 u, CrtRandom2 choice,
                                           f32 *eta_square) {
    const vec3 none = make_vec3(0.0f, 0.0f, 0.0f);
    const vec3 normal = crt_visible_normal(b, u);
    const f32 cos_m = crt_min(dot3(b->wo, normal), 1.0f);
    if (!(cos_m > 0.0f)) return none;
    const int divided = crt_is_divided(b);
    f32 eta = V4X(b->eta);
    f32 reflect = crt_fresnel_dielectric(cos_m, eta);
    if (divided) {
        /* Shares of the four wavelengths in what is refracted, one after another. */
        const vec4 fresnel = crt_dielectric_reflectance(b, cos_m);
        const vec4 passed = b->lanes * (splat4(1.0f) - fresnel);
        reflect = sum4(b->lanes * fresnel);
        const f32 at = choice.y * sum4(passed);
        const f32 one = V4X(passed), two = one + V4Y(passed), three = two + V4Z(passed);
        eta = at < one ? V4X(b->eta) : (at < two ? V4Y(b->eta) : (at < three ? V4Z(b->eta) : V4W(b->eta)));
    }
    vec3 wi;
    if (choice.x < reflect) {
        wi = normalize3(crt_reflect(b->wo, normal));
        return dot3(wi, b->ns) > 0.0f ? wi : none;
    }
    const f32 refraction = crt_refraction(cos_m, eta);
    if (!(refraction > 0.0f)) return none;
    *eta_square = eta * eta;
    wi = normalize3((normal * (cos_m - crt_sqrt(refraction)) - b->wo) * (1.0f / eta));
    return dot3(wi, b->ns) < 0.0f ? wi : none;
}

/* `choice`: of what is given back and the rest, and within them. */
CRT_FN CrtScatter crt_sample_rough_dielectric(const CrtBsdf *b, CrtRandom2 u, CrtRandom2 choice) {
    CrtScatter s = crt_no_scatter();
    const int given_back = choice.x < b->lost_chance;
    choice.x = crt_rescaled(choice.x, b->lost_chance);
    if (given_back) {
        const int back = choice.x < b->back_share;
        s.wi = crt_given_back_direction(b, back ? b->losses.side : 1u - b->losses.side,
                                        back ? b->ns : -b->ns, u);
        if (!back) s.eta_square = V4X(b->eta) * V4X(b->eta);
    } else {
        s.wi = crt_rough_dielectric_direction(b, u, choice, &s.eta_square);
    }
    const vec4 value = crt_rough_dielectric(b, s.wi, &s.pdf);
    s.valid = s.pdf > 0.0f;
    if (s.valid) s.weight = value / s.pdf;
    return s;
}

CRT_KERNEL_END

#endif
