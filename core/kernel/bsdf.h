/*
 * bsdf.h: how surfaces scatter. A function a kind of material samples a direction; crt_path_vertex (path.h)
 * has the switch between them. Only the Lambertian can be evaluated for a given pair of directions; mirror,
 * conductor and dielectric are smooth: their pdf is a delta.
 *
 * w_o and w_i point away from the surface. Radiance is transported: crossing into an index η times the other
 * scales it by 1/η².
 */
#ifndef CRT_BSDF_H
#define CRT_BSDF_H

#include "surface.h"

CRT_KERNEL_BEGIN

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

/* Lambertian f·cos per unit reflectance for a direction at cos_s from the shading normal, and its pdf: both
 * cos/π. */
CRT_FN f32 crt_lambert(f32 cos_s) { return cos_s * CRT_INV_PI; }

CRT_FN CrtScatter crt_sample_diffuse(vec4 reflectance, vec3 ns, vec3 ng, CrtRandom2 u) {
    CrtScatter s;
    const CrtRandom2 disk = crt_concentric_disk(u);
    const f32 z = crt_sqrt(crt_max(0.0f, crt_fma(-disk.x, disk.x, crt_fma(-disk.y, disk.y, 1.0f))));
    s.wi = crt_to_world(crt_frame(ns), make_vec3(disk.x, disk.y, z)); /* unit to 4 ulp */
    s.weight = reflectance;
    s.pdf = crt_lambert(crt_max(dot3(s.wi, ns), 0.0f));
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

CRT_KERNEL_END

#endif
