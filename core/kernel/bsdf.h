/*
 * bsdf.h: how surfaces scatter. crt_bsdf_prepare reads what a material is made of, once a vertex; then
 * crt_bsdf_sample, crt_bsdf_eval and crt_bsdf_pdf and the flags are all that path.h knows. A material is a
 * row of CRT_MATERIAL_LIST (features.h) and a case in each of the four; deltas, which can only be sampled,
 * need none in eval and pdf.
 *
 * w_o and w_i point away from the surface. Radiance is transported: crossing into an index η times the other
 * scales it by 1/η².
 */
#ifndef CRT_BSDF_H
#define CRT_BSDF_H

#include "value.h"

CRT_KERNEL_BEGIN

#define CRT_BSDF_DELTA 1u      /* scatters into single directions: light sampling finds none of them */
#define CRT_BSDF_REFLECTS 2u   /* to the side of w_o */
#define CRT_BSDF_TRANSMITS 4u  /* to the other side */
#define CRT_BSDF_DISPERSIVE 8u /* directions depend on the wavelength */

/* A material at one vertex. What its kind does not have is not set. */
typedef struct CrtBsdf {
    u32 type;         /* CRT_MATERIAL_… */
    u32 flags;        /* CRT_BSDF_…; 0: everything is absorbed */
    vec3 wo;          /* unit */
    vec3 ns, ng;      /* on the side of w_o, the shading normal nearly so */
    vec4 reflectance; /* diffuse, and what mirrors as a whole */
    vec4 eta;         /* dielectric: index beyond the surface / index on w_o's side; rough conductor: real
                         part of the index */
    vec4 k;           /* rough conductor: extinction */
    f32 alpha;        /* rough conductor: width of GGX */
    vec4 albedo;      /* for the first-hit output; only where it is asked for */
} CrtBsdf;

typedef struct CrtScatter {
    vec3 wi;        /* unit */
    vec4 weight;    /* f·|cos| / pdf */
    f32 pdf;        /* per steradian; 0 for a delta */
    f32 eta_square; /* (index on the side of w_i / on the side of w_o)² where refracted, else 1 */
    int hero_only;  /* refracted by a wavelength-dependent index: only the hero's direction is right */
    int valid;
} CrtScatter;

/* (η·cos of refraction)² at cos of incidence, η² − 1 + cos²; ≤ 0 in total internal reflection. In this order
   an index of 1 gives back cos² itself, however grazing. */
CRT_FN f32 crt_refraction(f32 cos_i, f32 eta) { return (eta - 1.0f) * (eta + 1.0f) + cos_i * cos_i; }

/* Unpolarised reflectance of an interface at |cos| of incidence; eta: index beyond / index before. Exactly 1
   in total internal reflection, exactly 0 for an index of 1. */
CRT_FN f32 crt_fresnel_dielectric(f32 cos_i, f32 eta) {
    const f32 refraction = crt_refraction(cos_i, eta);
    if (!(refraction > 0.0f)) return 1.0f;
    const f32 cos_t = crt_sqrt(refraction) / eta;
    const f32 rs = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    const f32 rp = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    return 0.5f * (rs * rs + rp * rp);
}

/* Unpolarised reflectance of a conductor of complex index n + ik at cos of incidence, four wavelengths at
 * once. */
CRT_FN vec4 crt_fresnel_conductor(f32 cos_i, vec4 n, vec4 k) {
    const f32 cos2 = cos_i * cos_i;
    const f32 sin2 = 1.0f - cos2;
    const vec4 n2 = n * n;
    const vec4 k2 = k * k;
    const vec4 t0 = n2 - k2 - splat4(sin2);
    const vec4 a2b2 = crt_sqrt4(t0 * t0 + n2 * k2 * 4.0f);
    const vec4 a = crt_sqrt4(crt_max4((a2b2 + t0) * 0.5f, splat4(0.0f)));
    const vec4 t1 = a2b2 + splat4(cos2);
    const vec4 t2 = a * (2.0f * cos_i);
    const vec4 rs = (t1 - t2) / (t1 + t2);
    const vec4 t3 = a2b2 * cos2 + splat4(sin2 * sin2);
    const vec4 t4 = t2 * sin2;
    const vec4 rp = rs * (t3 - t4) / (t3 + t4);
    return (rs + rp) * 0.5f;
}

CRT_FN vec3 crt_reflect(vec3 wo, vec3 n) { return n * (2.0f * dot3(wo, n)) - wo; }

/* Lambertian f·|cos| per unit reflectance for a direction at cos_s from the shading normal, and its pdf:
   both cos/π; 0 below the horizon. */
CRT_FN f32 crt_lambert(f32 cos_s) { return crt_max(cos_s, 0.0f) * CRT_INV_PI; }

/* Nothing is scattered. */
CRT_FN CrtScatter crt_no_scatter(void) {
    CrtScatter s;
    s.wi = make_vec3(0.0f, 0.0f, 0.0f);
    s.weight = splat4(0.0f);
    s.pdf = 0.0f;
    s.eta_square = 1.0f;
    s.hero_only = 0;
    s.valid = 0;
    return s;
}

/* Distributed as the cosine with n, over π; unit to 4 ulp. */
CRT_FN vec3 crt_cosine_direction(vec3 n, CrtRandom2 u) {
    const CrtRandom2 disk = crt_concentric_disk(u);
    const f32 z = crt_sqrt(crt_max(0.0f, crt_fma(-disk.x, disk.x, crt_fma(-disk.y, disk.y, 1.0f))));
    return crt_to_world(crt_frame(n), make_vec3(disk.x, disk.y, z));
}

CRT_FN CrtScatter crt_sample_diffuse(vec4 reflectance, vec3 ns, vec3 ng, CrtRandom2 u) {
    CrtScatter s;
    s.wi = crt_cosine_direction(ns, u);
    s.weight = reflectance;
    s.pdf = crt_lambert(dot3(s.wi, ns));
    s.eta_square = 1.0f;
    s.hero_only = 0;
    /* Light that the shading normal would send through the surface is lost, not leaked. */
    s.valid = dot3(s.wi, ng) > 0.0f && s.pdf > 0.0f;
    return s;
}

CRT_FN CrtScatter crt_sample_mirror(vec4 reflectance, vec3 wo, vec3 ns, vec3 ng) {
    CrtScatter s;
    s.wi = normalize3(crt_reflect(wo, ns));
    s.weight = reflectance;
    s.pdf = 0.0f;
    s.eta_square = 1.0f;
    s.hero_only = 0;
    s.valid = dot3(s.wi, ng) > 0.0f;
    return s;
}

/* Smooth dielectric. `eta`: index beyond the surface / index on w_o's side. `hero`: 1 in the hero's lane, 0
   elsewhere. `dispersive`: the index differs between the path's living wavelengths. `alone`: only the hero
   is alive. */
CRT_FN CrtScatter crt_sample_dielectric(vec4 eta, vec3 wo, vec3 ns, vec3 ng, vec4 hero, int dispersive,
                                        int alone, f32 u) {
    CrtScatter s;
    const f32 cos_i = crt_min(dot3(wo, ns), 1.0f);
    const f32 eta_hero = CRT_HAS(DISPERSION) ? sum4(eta * hero) : V4X(eta);
    const f32 fresnel_hero = crt_fresnel_dielectric(cos_i, eta_hero);
    vec4 fresnel = splat4(fresnel_hero);
    f32 reflect = fresnel_hero;
    if (CRT_HAS(DISPERSION) && dispersive && !alone) {
        fresnel =
            make_vec4(crt_fresnel_dielectric(cos_i, V4X(eta)), crt_fresnel_dielectric(cos_i, V4Y(eta)),
                      crt_fresnel_dielectric(cos_i, V4Z(eta)), crt_fresnel_dielectric(cos_i, V4W(eta)));
        reflect = 0.25f * sum4(fresnel);
    }
    s.pdf = 0.0f;
    s.eta_square = 1.0f;
    s.hero_only = 0;
    if (u < reflect) {
        s.wi = normalize3(crt_reflect(wo, ns));
        s.weight = fresnel / reflect;
        s.valid = dot3(s.wi, ng) > 0.0f;
        return s;
    }
    const f32 inverse_eta = 1.0f / eta_hero;
    const f32 refraction = crt_refraction(cos_i, eta_hero);
    s.hero_only = CRT_HAS(DISPERSION) && dispersive && !alone;
    s.eta_square = eta_hero * eta_hero;
    s.weight = splat4((1.0f - fresnel_hero) / (1.0f - reflect) * (inverse_eta * inverse_eta));
    /* An index of exactly 1 is no surface: the direction passes unrounded. */
    s.wi = eta_hero == 1.0f ? -wo
                            : normalize3(wo * -inverse_eta +
                                         ns * (cos_i - crt_sqrt(crt_max(refraction, 0.0f))) * inverse_eta);
    s.valid = refraction > 0.0f && dot3(s.wi, ng) < 0.0f;
    return s;
}

/* Narrower than this GGX is taken for a mirror: its value and density would lose their digits in single
   precision, and the image cannot tell. */
#define CRT_ALPHA_MIN 1e-3f

/* Two directions in the shading frame, each with the root of Smith's shadowing, a = √(cos² + α² sin²), of
   which Λ = (a/cos − 1)/2 (Heitz 2014); and GGX's density of the normal halfway. */
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

/* f·cos = F D G₂ / (4 cos_o), G₂ = 1 / (1 + Λ_o + Λ_i): shadowing and masking correlated by height. */
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

/* Mirrors w_o in one of the normals that it sees (Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with
   Spherical Caps"): stretched by α, the visible normals are those halfway to a cap of the sphere. */
CRT_FN CrtScatter crt_sample_rough_conductor(const CrtBsdf *b, CrtRandom2 u) {
    const CrtFrame frame = crt_frame(b->ns);
    const vec3 stretched = normalize3(make_vec3(b->alpha * dot3(b->wo, frame.s),
                                                b->alpha * dot3(b->wo, frame.t), dot3(b->wo, frame.n)));
    f32 cos_phi;
    const f32 sin_phi = crt_sincos(2.0f * CRT_PI * u.x, &cos_phi);
    const f32 z = crt_fma(1.0f - u.y, 1.0f + V3Z(stretched), -V3Z(stretched));
    const f32 sine = crt_sqrt(crt_max(0.0f, 1.0f - z * z));
    const vec3 cap = make_vec3(sine * cos_phi, sine * sin_phi, z) + stretched;
    const vec3 normal = crt_to_world(
        frame, normalize3(make_vec3(b->alpha * V3X(cap), b->alpha * V3Y(cap), crt_max(V3Z(cap), 0.0f))));
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

/* A material's type; known without looking where the kernel has only one. */
#define CRT_ONLY_MATERIAL(F, bit, NAME, Name, word, scatter, text) \
    if (CRT_KERNEL_MATERIALS == 1 << bit) return bit;
CRT_FN u32 crt_material_type(u32 type) {
    CRT_MATERIAL_LIST(CRT_ONLY_MATERIAL, )
    return type;
}

/* What the material of `surface` does to light that leaves along wo. The first vertex asks for the albedo.
 */
CRT_FN void crt_bsdf_prepare(const CrtContext *ctx, CrtBsdf *b, const CrtSurface *surface, vec3 wo,
                             vec4 position, int albedo) {
    const CrtMaterial material = CRT_ARRAY(CrtMaterial, ctx->blob, ctx->scene->materials)[surface->material];
    const int outside = dot3(wo, surface->ng) > 0.0f;
    b->type = crt_material_type(material.type);
    b->flags = 0u;
    b->wo = wo;
    b->ng = outside ? surface->ng : -surface->ng;
    b->ns = outside ? surface->ns : -surface->ns;
    /* A shading normal that turns away from the viewer would reflect light from behind the surface. */
    if (CRT_HAS(SMOOTH_NORMALS) && !(dot3(wo, b->ns) > 0.0f)) b->ns = b->ng;
    b->albedo = splat4(1.0f);
    switch (b->type) {
        case CRT_MATERIAL_DIFFUSE:
            if (CRT_HAS(DIFFUSE)) {
                b->flags = CRT_BSDF_REFLECTS;
                b->reflectance = crt_value(ctx, material.reflectance, surface, position);
                if (albedo) b->albedo = b->reflectance;
            }
            break;
        case CRT_MATERIAL_MIRROR:
            if (CRT_HAS(MIRROR)) {
                b->flags = CRT_BSDF_REFLECTS | CRT_BSDF_DELTA;
                b->reflectance = crt_value(ctx, material.reflectance, surface, position);
                if (albedo) b->albedo = b->reflectance;
            }
            break;
        case CRT_MATERIAL_CONDUCTOR:
            if (CRT_HAS(CONDUCTOR)) {
                const vec4 n = crt_value(ctx, material.eta, surface, position);
                const vec4 k = crt_value(ctx, material.k, surface, position);
                b->flags = CRT_BSDF_REFLECTS | CRT_BSDF_DELTA;
                b->reflectance = crt_fresnel_conductor(crt_min(dot3(wo, b->ns), 1.0f), n, k);
                if (albedo) b->albedo = crt_fresnel_conductor(1.0f, n, k);
            }
            break;
        case CRT_MATERIAL_ROUGH_CONDUCTOR:
            if (CRT_HAS(ROUGH_CONDUCTOR)) {
                const f32 roughness = V4X(crt_value(ctx, material.roughness, surface, position));
                b->flags = CRT_BSDF_REFLECTS;
                b->eta = crt_value(ctx, material.eta, surface, position);
                b->k = crt_value(ctx, material.k, surface, position);
                b->alpha = roughness * roughness;
                if (!(b->alpha >= CRT_ALPHA_MIN)) {
                    b->flags = CRT_BSDF_REFLECTS | CRT_BSDF_DELTA;
                    b->reflectance = crt_fresnel_conductor(crt_min(dot3(wo, b->ns), 1.0f), b->eta, b->k);
                }
                if (albedo) b->albedo = crt_fresnel_conductor(1.0f, b->eta, b->k);
            }
            break;
        case CRT_MATERIAL_DIELECTRIC:
            if (CRT_HAS(DIELECTRIC)) {
                const vec4 eta = crt_value(ctx, material.eta, surface, position);
                b->flags = CRT_BSDF_REFLECTS | CRT_BSDF_TRANSMITS | CRT_BSDF_DELTA;
                if ((material.flags & CRT_MATERIAL_DISPERSIVE) != 0u) b->flags |= CRT_BSDF_DISPERSIVE;
                b->eta = outside ? eta : splat4(1.0f) / eta;
            }
            break;
        default: break;
    }
}

/* A direction w_i, distributed as crt_bsdf_pdf or a delta. `hero`: 1 in the hero's lane, 0 elsewhere.
   `alone`: only the hero is alive. */
CRT_FN CrtScatter crt_bsdf_sample(const CrtBsdf *b, CrtRandom2 u, vec4 hero, int alone) {
    switch (b->type) {
        case CRT_MATERIAL_DIFFUSE:
            if (CRT_HAS(DIFFUSE)) return crt_sample_diffuse(b->reflectance, b->ns, b->ng, u);
            break;
        case CRT_MATERIAL_MIRROR:
        case CRT_MATERIAL_CONDUCTOR:
            if (CRT_HAS(MIRROR) || CRT_HAS(CONDUCTOR))
                return crt_sample_mirror(b->reflectance, b->wo, b->ns, b->ng);
            break;
        case CRT_MATERIAL_ROUGH_CONDUCTOR:
            if (CRT_HAS(ROUGH_CONDUCTOR)) {
                if ((b->flags & CRT_BSDF_DELTA) != 0u)
                    return crt_sample_mirror(b->reflectance, b->wo, b->ns, b->ng);
                return crt_sample_rough_conductor(b, u);
            }
            break;
        case CRT_MATERIAL_DIELECTRIC:
            if (CRT_HAS(DIELECTRIC))
                return crt_sample_dielectric(b->eta, b->wo, b->ns, b->ng, hero,
                                             (b->flags & CRT_BSDF_DISPERSIVE) != 0u, alone, u.x);
            break;
        default: break;
    }
    return crt_no_scatter();
}

/* f(w_o, w_i)·|cos w_i|; 0 for deltas. */
CRT_FN vec4 crt_bsdf_eval(const CrtBsdf *b, vec3 wi) {
    switch (b->type) {
        case CRT_MATERIAL_DIFFUSE:
            if (CRT_HAS(DIFFUSE)) return b->reflectance * crt_lambert(dot3(wi, b->ns));
            break;
        case CRT_MATERIAL_ROUGH_CONDUCTOR:
            if (CRT_HAS(ROUGH_CONDUCTOR) && (b->flags & CRT_BSDF_DELTA) == 0u)
                return crt_rough_conductor(b, wi);
            break;
        default: break;
    }
    return splat4(0.0f);
}

/* Density per steradian with which crt_bsdf_sample finds w_i; 0 for deltas. */
CRT_FN f32 crt_bsdf_pdf(const CrtBsdf *b, vec3 wi) {
    switch (b->type) {
        case CRT_MATERIAL_DIFFUSE:
            if (CRT_HAS(DIFFUSE)) return crt_lambert(dot3(wi, b->ns));
            break;
        case CRT_MATERIAL_ROUGH_CONDUCTOR:
            if (CRT_HAS(ROUGH_CONDUCTOR) && (b->flags & CRT_BSDF_DELTA) == 0u)
                return crt_rough_conductor_pdf(b, wi);
            break;
        default: break;
    }
    return 0.0f;
}

CRT_KERNEL_END

#endif
