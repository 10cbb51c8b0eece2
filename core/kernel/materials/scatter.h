/*
 * scatter.h: the state of a BSDF (CrtBsdf) and a scattered direction (CrtScatter); Fresnel's equations; and
 * the surfaces without microfacets: Lambert's, mirrors, smooth dielectrics, panes.
 *
 * w_o and w_i point away from the surface. Radiance is transported: crossing into an index η times the
 * other scales it by 1/η².
 */
#ifndef CRT_SCATTER_H
#define CRT_SCATTER_H

#include "kernel/sampling/warp.h"

CRT_KERNEL_BEGIN

#define CRT_BSDF_DELTA 1u      /* into single directions alone: light sampling finds none of them */
#define CRT_BSDF_REFLECTS 2u   /* to the side of w_o */
#define CRT_BSDF_TRANSMITS 4u  /* to the other side */
#define CRT_BSDF_DISPERSIVE 8u /* directions depend on the wavelength */
#define CRT_BSDF_CHOOSES 16u   /* crt_bsdf_sample needs its second pair of random numbers */
#define CRT_BSDF_BOUNDS 32u    /* the surface of a body: a different medium lies behind it */
#define CRT_BSDF_FILM 64u      /* under a thin film: reflectances are thin_film.h's */
#define CRT_BSDF_COLORED 256u  /* a metal of OpenPBR's: reflectances are openpbr.h's */
#define CRT_BSDF_ANISOTROPIC 128u /* wider along its tangent than across it */
#define CRT_BSDF_RAISES 512u   /* Lambert's light, which interpolated normals raise (shading_normal.h) */

/* A BSDF without CRT_BSDF_DELTA may still have single directions beside its lobe: crt_bsdf_sample gives
   those the pdf 0, and crt_bsdf is of the lobe alone. */

/* Narrower than this GGX is taken for a mirror: its value and density would lose their digits in single
   precision, and the difference would not be visible. */
#define CRT_ALPHA_MIN 1e-3f

/* The rows in the tables of losses of a rough material (compensation.h). */
typedef struct CrtLosses {
    CRT_GLOBAL const f32 *rows; /* of the outside, at the roughness at or below, at the first index */
    u32 side;                   /* of w_o: 0 outside, 1 inside */
    u32 roughness_step, index_step; /* floats to the next row; 0 where there is one. Of anisotropic
                                       surfaces the first is that between azimuths */
    f32 between;                /* how far on to the row of the next roughness */
    vec4 index;                 /* rows from the first index to those of the path's wavelengths */
} CrtLosses;

/* The table of what a coat reflects by the cosine (coat_table.h). */
typedef struct CrtCoat {
    CRT_GLOBAL const f32 *table; /* 0: it is smooth, and Fresnel's equations say it */
    f32 between;                 /* how far on to the next table; 0: there may be none */
} CrtCoat;

/* A material at one vertex. Members that its kind does not use are not set. */
typedef struct CrtBsdf {
    u32 type;         /* CRT_MATERIAL_… */
    u32 flags;        /* CRT_BSDF_…; 0: everything is absorbed */
    vec3 wo;          /* unit */
    vec3 ns, ng;      /* on the side of w_o, the shading normal nearly so */
    vec4 reflectance; /* diffuse, and what mirrors as a whole; plastic: of the base, seen through the coat;
                         rough: what is given back to this side of what microfacets lose */
    vec4 eta;         /* dielectrics: index beyond the surface / index on w_o's side; conductors: real part
                         of the index */
    vec4 k;           /* conductors: extinction; 0 of dielectrics with a film; OpenPBR's: the dip */
    f32 edge;         /* OpenPBR's metals: reflectance along the surface; eta: straight on */
    vec4 film_eta;    /* thin film: its index / that on w_o's side */
    vec4 film_rounds; /* thin film: 2 n d / λ, n on w_o's side */
    f32 alpha;        /* rough surfaces: width of GGX; anisotropic: along the tangent */
    f32 narrowing;    /* anisotropic: the width across the tangent over that along it */
    vec3 tangent;     /* anisotropic: unit, perpendicular to ns */
    vec4 lanes;       /* dielectrics that are rough or under a film: share of what the path carries in each
                         wavelength */
    f32 pane_cosine;  /* panes: crt_pane_cosine, set before a normal map turns the normal */
    vec4 through;     /* rough dielectric: what is given back to the other side */
    f32 lost_chance;  /* rough: of sampling what is given back */
    f32 back_share;   /* rough dielectric: of that, this side's */
    CrtLosses losses; /* rough */
    vec4 tint;        /* metals and plastic: on what is mirrored (tint.h) */
    f32 coat_chance;  /* plastic: of sampling the coat */
    f32 pass_chance;  /* translucent plastic: of what the base scatters, of sampling the other side; */
    vec4 passed;      /* of that side, as `reflectance` of this one */
    CrtCoat coat;     /* plastic: what it reflects by the cosine */
    CRT_GLOBAL const f32 *base_loss; /* plastic: table of its rough base; 0: Lambert's; otherwise: */
    f32 base_roughness;
    f32 fuzz_albedo;  /* what the fuzz takes of light towards w_o; 0: there is none; otherwise: */
    f32 fuzz_chance;  /* of sampling it */
    vec4 fuzz_color;  /* times what it takes */
    f32 fuzz_width, fuzz_lean; /* of its lobe (fuzz.h) */
    f32 clear_eta;    /* index of the coat (clearcoat.h); 0: there is none; otherwise: */
    f32 clear_alpha;  /* width of its GGX; 0: it is smooth */
    f32 clear_albedo; /* what it mirrors of light towards w_o */
    f32 clear_chance; /* of sampling it */
    vec4 clear_below; /* what is left of what lies below, but for the way in */
    vec4 clear_depth; /* of which exp(−depth) is left straight on */
    vec4 multiple;    /* of what is reflected more than once, to be multiplied with the loss towards w_i */
    vec4 albedo;      /* for the first-hit output; only where it is asked for */
    int facet;        /* it is of a mapped surface (normal_map.h); then: */
    vec3 base;        /* unit, the surface's own shading normal, on the side of w_o */
    vec3 side;        /* unit, its geometric normal, on that side */
} CrtBsdf;

typedef struct CrtScatter {
    vec3 wi;        /* unit */
    vec4 weight;    /* f·|cos| / pdf */
    f32 pdf;        /* per steradian; 0 for a single direction */
    f32 eta_square; /* (index on the side of w_i / on the side of w_o)² where refracted, else 1 */
    int hero_only;  /* refracted by a wavelength-dependent index: only the hero's direction is right */
    int valid;
} CrtScatter;

/* (η·cos of refraction)² at cos of incidence, η² − 1 + cos²; ≤ 0 in total internal reflection. In
   this order an index of 1 gives back cos² itself, however grazing. */
CRT_FN f32 crt_refraction(f32 cos_i, f32 eta) { return (eta - 1.0f) * (eta + 1.0f) + cos_i * cos_i; }

/* Unpolarised reflectance of an interface at |cos| of incidence; eta: index beyond / index before. Exactly 1
   in total internal reflection, exactly 0 for an index of 1. */
CRT_FN f32 crt_fresnel_of(f32 cos_i, f32 eta) {
    const f32 refraction = crt_refraction(cos_i, eta);
    if (eta == 1.0f) return 0.0f; /* also where a grazing cosine is rounded to 0 or below */
    if (!(refraction > 0.0f)) return 1.0f;
    const f32 cos_t = crt_sqrt(refraction) / eta;
    const f32 rs = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    const f32 rp = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    return 0.5f * (rs * rs + rp * rp);
}

CRT_SHARED_FN f32 crt_fresnel_dielectric(f32 cos_i, f32 eta) { return crt_fresnel_of(cos_i, eta); }

CRT_SHARED_FN vec4 crt_fresnel_dielectric4(f32 cos_i, vec4 eta) {
    return make_vec4(crt_fresnel_of(cos_i, V4X(eta)), crt_fresnel_of(cos_i, V4Y(eta)),
                     crt_fresnel_of(cos_i, V4Z(eta)), crt_fresnel_of(cos_i, V4W(eta)));
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

/* An interface mirrors the share `fresnel` of each wavelength, with the chance `reflect`, and refracts the
   rest by `eta`. `hero_only`: the refraction is right for the hero only. Sides are those of ns. */
CRT_FN CrtScatter crt_reflect_or_refract(vec3 wo, vec3 ns, f32 cos_i, f32 eta, vec4 fresnel, vec4 passed,
                                         f32 reflect, int hero_only, f32 u) {
    CrtScatter s;
    s.pdf = 0.0f;
    s.eta_square = 1.0f;
    s.hero_only = 0;
    if (u < reflect) {
        s.wi = normalize3(crt_reflect(wo, ns));
        s.weight = fresnel / reflect;
        s.valid = dot3(s.wi, ns) > 0.0f;
        return s;
    }
    const f32 inverse_eta = 1.0f / eta;
    const f32 refraction = crt_refraction(cos_i, eta);
    s.hero_only = hero_only;
    s.eta_square = eta * eta;
    s.weight = passed / (1.0f - reflect) * (inverse_eta * inverse_eta);
    /* An index of exactly 1 is no surface: the direction passes unrounded. */
    s.wi = eta == 1.0f ? -wo
                       : normalize3(wo * -inverse_eta +
                                    ns * (cos_i - crt_sqrt(crt_max(refraction, 0.0f))) * inverse_eta);
    s.valid = refraction > 0.0f && dot3(s.wi, ns) < 0.0f;
    return s;
}

/* Smooth dielectric. `eta`: index beyond the surface / index on w_o's side. `hero`: 1 in the hero's lane, 0
   elsewhere. `dispersive`: the index differs between the path's living wavelengths. `hero_only`: only the
   hero is alive. */
CRT_FN CrtScatter crt_sample_dielectric(vec4 eta, vec3 wo, vec3 ns, vec4 hero, int dispersive, int hero_only,
                                        f32 u) {
    const f32 cos_i = crt_min(dot3(wo, ns), 1.0f);
    const f32 eta_hero = CRT_HAS(DISPERSION) ? sum4(eta * hero) : V4X(eta);
    const f32 fresnel_hero = crt_fresnel_dielectric(cos_i, eta_hero);
    const int divided = CRT_HAS(DISPERSION) && dispersive && !hero_only;
    vec4 fresnel = splat4(fresnel_hero);
    f32 reflect = fresnel_hero;
    if (divided) {
        fresnel = crt_fresnel_dielectric4(cos_i, eta);
        reflect = 0.25f * sum4(fresnel);
    }
    return crt_reflect_or_refract(wo, ns, cos_i, eta_hero, fresnel, splat4(1.0f - fresnel_hero), reflect,
                                  divided, u);
}

CRT_KERNEL_END

#endif
