/*
 * microfacet.h: rough metals and rough glass: GGX's distribution of normals, Smith's shadowing correlated by
 * height, and normals sampled as w_o sees them.
 */
#ifndef CRT_MICROFACET_H
#define CRT_MICROFACET_H

#include "scatter.h"

CRT_KERNEL_BEGIN

/* Narrower than this GGX is taken for a mirror: its value and density would lose their digits in single
   precision, and the image cannot tell. */
#define CRT_ALPHA_MIN 1e-3f

/* Two directions in the shading frame, each with the root of Smith's shadowing, a = √(cos² + α² sin²),
   of which Λ = (a/cos − 1)/2 (Heitz 2014); and GGX's density of the normal halfway. */
typedef struct CrtMicrofacet {
    f32 cos_o, cos_i; /* 0 or below: the microfacets do not mirror between them */
    f32 cos_m;        /* of both with the normal halfway */
    f32 root_o, root_i;
    f32 density;
} CrtMicrofacet;

CRT_FN f32 crt_smith_root(f32 cosine, f32 alpha) {
    const f32 cos2 = cosine * cosine;
    return crt_sqrt(crt_max(cos2 + alpha * alpha * (1.0f - cos2), 0.0f));
}

CRT_FN CrtMicrofacet crt_microfacet(const CrtBsdf *b, vec3 wi) {
    const CrtFrame frame = crt_frame(b->ns);
    const vec3 h = b->wo + wi;
    const f32 x = dot3(frame.s, h), y = dot3(frame.t, h), z = dot3(frame.n, h);
    const f32 hh = x * x + y * y + z * z;
    CrtMicrofacet m;
    m.cos_o = dot3(b->wo, b->ns);
    m.cos_i = dot3(wi, b->ns);
    m.cos_m = crt_min(dot3(b->wo, h) / crt_sqrt(hh), 1.0f);
    m.root_o = crt_smith_root(m.cos_o, b->alpha);
    m.root_i = crt_smith_root(m.cos_i, b->alpha);
    /* D = α²/π / (sin² + α² cos²)², with the sines and cosines of h, which is not of unit length. */
    const f32 spread = (x * x + y * y + b->alpha * b->alpha * (z * z)) / hh;
    m.density = CRT_INV_PI * (b->alpha / spread) * (b->alpha / spread);
    return m;
}

/* f·cos = F D G₂ / (4 cos_o), G₂ = 1 / (1 + Λ_o + Λ_i): shadowing and masking correlated by height.
   */
CRT_FN vec4 crt_rough_conductor(const CrtBsdf *b, vec3 wi) {
    const CrtMicrofacet m = crt_microfacet(b, wi);
    if (!(m.cos_o > 0.0f) || !(m.cos_i > 0.0f)) return splat4(0.0f);
    return crt_fresnel_conductor(m.cos_m, b->eta, b->k) *
           (m.density * m.cos_i / (2.0f * (m.root_o * m.cos_i + m.root_i * m.cos_o)));
}

/* The visible normals' density G₁ D cos_m / cos_o, turned into that of directions by 1 / (4 cos_m). */
CRT_FN f32 crt_rough_conductor_pdf(const CrtBsdf *b, vec3 wi) {
    const CrtMicrofacet m = crt_microfacet(b, wi);
    if (!(m.cos_o > 0.0f) || !(m.cos_i > 0.0f)) return 0.0f;
    return m.density / (2.0f * (m.cos_o + m.root_o));
}

/* One of the normals that w_o sees (Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical
   Caps"): stretched by α, they are those halfway to a cap of the sphere. */
CRT_FN vec3 crt_visible_normal(const CrtBsdf *b, CrtRandom2 u) {
    const CrtFrame frame = crt_frame(b->ns);
    const vec3 stretched = normalize3(make_vec3(b->alpha * dot3(b->wo, frame.s),
                                                b->alpha * dot3(b->wo, frame.t), dot3(b->wo, frame.n)));
    f32 cos_phi;
    const f32 sin_phi = crt_sincos(2.0f * CRT_PI * u.x, &cos_phi);
    const f32 z = crt_fma(1.0f - u.y, 1.0f + V3Z(stretched), -V3Z(stretched));
    const f32 sine = crt_sqrt(crt_max(0.0f, 1.0f - z * z));
    const vec3 cap = make_vec3(sine * cos_phi, sine * sin_phi, z) + stretched;
    return crt_to_world(
        frame, normalize3(make_vec3(b->alpha * V3X(cap), b->alpha * V3Y(cap), crt_max(V3Z(cap), 0.0f))));
}

CRT_FN CrtScatter crt_sample_rough_conductor(const CrtBsdf *b, CrtRandom2 u) {
    const vec3 normal = crt_visible_normal(b, u);
    CrtScatter s = crt_no_scatter();
    s.wi = normalize3(crt_reflect(b->wo, normal));
    const CrtMicrofacet m = crt_microfacet(b, s.wi);
    if (!(m.cos_o > 0.0f) || !(m.cos_i > 0.0f)) return s;
    s.pdf = m.density / (2.0f * (m.cos_o + m.root_o));
    s.weight = crt_fresnel_conductor(m.cos_m, b->eta, b->k) *
               (m.cos_i * (m.cos_o + m.root_o) / (m.root_o * m.cos_i + m.root_i * m.cos_o));
    s.valid = dot3(s.wi, b->ng) > 0.0f && s.pdf > 0.0f;
    return s;
}

/* Rough dielectric (Walter et al. 2007; PBRT 4e, 9.7): as much of the light as Fresnel says is mirrored in
 * each microfacet, the rest is refracted by it.
 *
 * Where the index depends on the wavelength, so does the microfacet that refracts between two directions.
 * Every wavelength has its value for any pair of directions; a direction is sampled by the index of one of
 * them, chosen at each vertex anew by what the path carries in each (`lanes`), and its density is the mean
 * over that choice. All four wavelengths live on, weighted: the balance heuristic over the wavelengths at
 * each vertex (compare Wilkie et al. 2014, who choose one for a whole path). */

/* What one microfacet refracts from w_i to w_o at one index. */
typedef struct CrtRefracted {
    f32 value; /* f·|cos| */
    f32 pdf;
} CrtRefracted;

/* Where the lobe is narrower than this, index and roughness being too small to blur what is seen through the
   surface, the half vector loses its digits: it is taken for smooth. Radians. */
#define CRT_BEND_MIN 1e-4f

/* Whether an interface of index `eta` and width `alpha` is more than smooth at all four wavelengths. */
CRT_FN int crt_is_rough(f32 alpha, vec4 eta) {
    const vec4 bend = make_vec4(crt_abs(V4X(eta) - 1.0f), crt_abs(V4Y(eta) - 1.0f),
                                crt_abs(V4Z(eta) - 1.0f), crt_abs(V4W(eta) - 1.0f));
    const f32 least = crt_min(crt_min(V4X(bend), V4Y(bend)), crt_min(V4Z(bend), V4W(bend)));
    return alpha >= CRT_ALPHA_MIN && alpha * least >= CRT_BEND_MIN;
}

CRT_FN CrtRefracted crt_rough_refraction(const CrtBsdf *b, vec3 wi, f32 eta) {
    CrtRefracted r;
    r.value = r.pdf = 0.0f;
    const CrtFrame frame = crt_frame(b->ns);
    const vec3 h = b->wo + wi * eta; /* along the microfacet's normal, of either sense, of length √hh */
    const f32 x = dot3(frame.s, h), y = dot3(frame.t, h), z = dot3(frame.n, h);
    const f32 hh = x * x + y * y + z * z;
    const f32 outwards = z < 0.0f ? -1.0f : 1.0f;
    const f32 h_o = dot3(b->wo, h) * outwards, h_i = -dot3(wi, h) * outwards;
    if (!(h_o > 0.0f) || !(h_i > 0.0f)) return r; /* the microfacet is seen from behind */
    const f32 cos_o = dot3(b->wo, b->ns), cos_i = -dot3(wi, b->ns);
    if (!(cos_o > 0.0f) || !(cos_i > 0.0f)) return r;
    const f32 root_o = crt_smith_root(cos_o, b->alpha), root_i = crt_smith_root(cos_i, b->alpha);
    const f32 spread = (x * x + y * y + b->alpha * b->alpha * (z * z)) / hh;
    const f32 density = CRT_INV_PI * (b->alpha / spread) * (b->alpha / spread);
    const f32 passed = 1.0f - crt_fresnel_dielectric(crt_min(h_o / crt_sqrt(hh), 1.0f), eta);
    /* |w_i·m| |w_o·m| / (w_o·m + η w_i·m)², with m = h/√hh, is h_i h_o / hh². The density of
       normals becomes that of directions by dm/dw_i = η² |w_i·m| / (w_o·m + η w_i·m)² (Walter,
       equation 17). */
    const f32 turned = passed * density * (h_o / hh) * (h_i / hh);
    r.value = turned * 2.0f * cos_i / (root_o * cos_i + root_i * cos_o);
    r.pdf = turned * 2.0f * eta * eta / (cos_o + root_o);
    return r;
}

/* f·|cos| at each wavelength, and the density of w_i: the visible normals' times the share of what they
   mirror or refract. */
CRT_FN vec4 crt_rough_dielectric(const CrtBsdf *b, vec3 wi, f32 *pdf) {
    *pdf = 0.0f;
    const int mirrored = dot3(wi, b->ns) > 0.0f;
    if (mirrored != (dot3(wi, b->ng) > 0.0f)) return splat4(0.0f);
    const int dispersive = CRT_HAS(DISPERSION) && (b->flags & CRT_BSDF_DISPERSIVE) != 0u;
    if (mirrored) {
        const CrtMicrofacet m = crt_microfacet(b, wi);
        if (!(m.cos_o > 0.0f)) return splat4(0.0f);
        const vec4 fresnel = dispersive ? crt_fresnel_dielectric4(m.cos_m, b->eta)
                                        : splat4(crt_fresnel_dielectric(m.cos_m, V4X(b->eta)));
        *pdf = (dispersive ? sum4(b->lanes * fresnel) : V4X(fresnel)) *
               (m.density / (2.0f * (m.cos_o + m.root_o)));
        return fresnel * (m.density * m.cos_i / (2.0f * (m.root_o * m.cos_i + m.root_i * m.cos_o)));
    }
    const u32 lanes = dispersive ? 4u : 1u;
    vec4 value = splat4(0.0f), density = splat4(0.0f);
    CRT_ROLLED for (u32 lane = 0u; lane < lanes; ++lane) {
        const CrtRefracted r = crt_rough_refraction(b, wi, crt_lane(b->eta, lane));
        value = crt_with_lane(value, lane, r.value);
        density = crt_with_lane(density, lane, r.pdf);
    }
    *pdf = dispersive ? sum4(b->lanes * density) : V4X(density);
    return dispersive ? value : splat4(V4X(value));
}

/* `choice`: of mirroring and refracting, and of the wavelength by whose index. */
CRT_FN CrtScatter crt_sample_rough_dielectric(const CrtBsdf *b, CrtRandom2 u, CrtRandom2 choice) {
    CrtScatter s = crt_no_scatter();
    const vec3 normal = crt_visible_normal(b, u);
    const f32 cos_m = crt_min(dot3(b->wo, normal), 1.0f);
    if (!(cos_m > 0.0f)) return s;
    const int dispersive = CRT_HAS(DISPERSION) && (b->flags & CRT_BSDF_DISPERSIVE) != 0u;
    f32 eta = V4X(b->eta);
    f32 reflect = crt_fresnel_dielectric(cos_m, eta);
    if (dispersive) {
        /* Shares of the four wavelengths in what is refracted, one after another. */
        const vec4 fresnel = crt_fresnel_dielectric4(cos_m, b->eta);
        const vec4 passed = b->lanes * (splat4(1.0f) - fresnel);
        reflect = sum4(b->lanes * fresnel);
        const f32 at = choice.y * sum4(passed);
        const f32 one = V4X(passed), two = one + V4Y(passed), three = two + V4Z(passed);
        eta = at < one ? V4X(b->eta) : (at < two ? V4Y(b->eta) : (at < three ? V4Z(b->eta) : V4W(b->eta)));
    }
    const int mirrored = choice.x < reflect;
    if (mirrored) {
        s.wi = normalize3(crt_reflect(b->wo, normal));
    } else {
        const f32 refraction = crt_refraction(cos_m, eta);
        if (!(refraction > 0.0f)) return s;
        s.wi = normalize3((normal * (cos_m - crt_sqrt(refraction)) - b->wo) * (1.0f / eta));
        s.eta_square = eta * eta;
    }
    if (mirrored != (dot3(s.wi, b->ng) > 0.0f)) return s;
    const vec4 value = crt_rough_dielectric(b, s.wi, &s.pdf);
    s.valid = s.pdf > 0.0f;
    if (s.valid) s.weight = value / s.pdf;
    return s;
}

CRT_KERNEL_END

#endif
