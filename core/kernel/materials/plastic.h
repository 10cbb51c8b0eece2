/*
 * plastic.h: a diffuse base under a clear coat, smooth or rough. The coat reflects the share E(θ). The
 * rest enters, and the base scatters it by Lambert's law. It leaves, except for the share that the coat
 * sends back from below, which the base scatters again:
 *
 *     f = f_coat + a/π (1 − E(θ_o)) (1 − E(θ_i)) / (η² (1 − a k)),    k = 1 − (1 − Ē)/η²
 *
 * with a the base's albedo, Ē the mean of E over the cosine and k the share of diffuse light that the coat
 * sends back from below, which (1 − k) η² = 1 − Ē ties to what it lets in. It is Mitsuba's
 * `roughplastic` with `nonlinear` (Jakob et al. 2022), whose tables of transmittance are here E of
 * microfacets that mirror once: what they lose enters. It is reciprocal, and a white base sends all light
 * back. A tint (tint.h) is on f_coat alone.
 *
 * A base with a transmittance t beside its reflectance is a thin sheet with the same coat on both of its
 * sides. Light that it scatters to the other side leaves there, except for the share that this side's
 * coat sends back. With
 * D and B the light inside that goes to this side's coat and to the other's, of E that has entered,
 *
 *     D = a (E + k D) + t k B,    B = t (E + k D) + a k B
 *
 * so that D ± B = (a ± t) E / (1 − (a ± t) k). The share 1 − k of each leaves. Without a coat, a and
 * t are what is seen: Lambert's law on both sides.
 */
#ifndef CRT_PLASTIC_H
#define CRT_PLASTIC_H

#include "kernel/materials/coat_table.h"
#include "kernel/materials/microfacet.h"
#include "kernel/materials/rough_base.h"
#include "kernel/materials/shading_normal.h"
#include "kernel/materials/tint.h"

CRT_KERNEL_BEGIN

/* E(θ). */
CRT_FN f32 crt_coat_albedo(const CrtBsdf *b, f32 cosine) {
    return crt_coat_reflects(b->coat, crt_min(cosine, 1.0f), V4X(b->eta));
}

/* Of the base that reflects `a` and transmits `t`, under a coat that sends back `k` from below: what leaves
   of what has entered, on this side; *passed: on the other one. */
CRT_FN vec4 crt_sheet_returns(vec4 a, vec4 t, f32 k, vec4 *passed) {
    const vec4 sum = a + t, difference = a - t;
    const vec4 both = sum * (1.0f - k) / (splat4(1.0f) - sum * k);
    const vec4 apart = difference * (1.0f - k) / (splat4(1.0f) - difference * k);
    *passed = (both - apart) * 0.5f;
    return (both + apart) * 0.5f;
}

/* f·|cos| towards the other side of a translucent sheet, and its density: as what the base reflects towards
   the opposite direction. */
CRT_FN vec4 crt_plastic_passed(const CrtBsdf *b, vec3 wi, f32 *pdf) {
    const vec3 w = -wi;
    const f32 cos_i = dot3(w, b->ns), cos_g = dot3(w, b->ng);
    const f32 below = crt_below(b);
    f32 lambert = crt_lambert(cos_i);
    f32 leaving = cos_i > 0.0f ? (1.0f - crt_coat_albedo(b, cos_i)) * lambert : 0.0f;
    if (below > 0.0f) {
        const f32 raised = below * crt_lambert(cos_g);
        lambert = lambert + raised;
        leaving =
            leaving + (1.0f - crt_coat_albedo(b, crt_cosine_before_lift(below, cos_i, cos_g))) * raised;
    }
    *pdf = (1.0f - b->coat_chance) * b->pass_chance * lambert;
    return b->passed * leaving;
}

/* f·|cos| without what a smooth coat mirrors, and its density, on the side of w_o. About an interpolated
   normal, what the base sends below the surface is raised (shading_normal.h). */
CRT_FN vec4 crt_plastic_reflected(const CrtBsdf *b, vec3 wi, f32 *pdf) {
    const f32 cos_i = dot3(wi, b->ns);
    const f32 below = crt_below(b);
    f32 lambert = crt_lambert(cos_i);
    f32 entering = cos_i > 0.0f ? (1.0f - crt_coat_albedo(b, cos_i)) * lambert : 0.0f;
    vec4 rough = splat4(0.0f);
    if (crt_has_rough_base(b) && cos_i > 0.0f) rough = crt_rough_base(b, wi, cos_i) * entering;
    if (below > 0.0f) {
        const f32 cos_g = dot3(wi, b->ng);
        const f32 raised = below * crt_lambert(cos_g);
        lambert = cos_g > 0.0f ? lambert + raised : 0.0f;
        const f32 direct = entering;
        entering = cos_g > 0.0f ? entering + (1.0f - crt_coat_albedo(b, crt_cosine_before_lift(below, cos_i,
                                                                                        cos_g))) * raised
                                : 0.0f;
        if (crt_has_rough_base(b)) {
            const f32 before = crt_cosine_before_lift(below, cos_i, cos_g);
            const vec4 shape = crt_rough_base(b, crt_before_lift(b, below, wi, before), before);
            rough = cos_g > 0.0f ? rough + shape * (entering - direct) : splat4(0.0f);
        }
    }
    const vec4 base = crt_has_rough_base(b) ? rough : b->reflectance * entering;
    *pdf = (1.0f - b->coat_chance) * lambert;
    if (crt_is_translucent(b)) *pdf = *pdf * (1.0f - b->pass_chance);
    if (!crt_is_rough_coat(b->coat) || !(cos_i > 0.0f)) return base;
    const CrtMicrofacet m = crt_microfacet(b, wi);
    if (!(m.cos_o > 0.0f)) return base;
    *pdf += b->coat_chance * m.density / (2.0f * (m.cos_o + m.root_o));
    return base + crt_tinted(b, splat4(crt_fresnel_dielectric(m.cos_m, V4X(b->eta)) * m.density * m.cos_i /
                                       (2.0f * (m.root_o * m.cos_i + m.root_i * m.cos_o))));
}

/* The same on both sides. */
CRT_FN vec4 crt_plastic(const CrtBsdf *b, vec3 wi, f32 *pdf) {
    if (crt_is_translucent(b) && dot3(wi, b->ng) < 0.0f) return crt_plastic_passed(b, wi, pdf);
    return crt_plastic_reflected(b, wi, pdf);
}

/* `choice`: of coat, base and the base's other side. Light that a smooth coat mirrors has the density 0 of a
   delta; the rest has that of the base alone, which light sampling competes with. */
CRT_FN CrtScatter crt_sample_plastic(const CrtBsdf *b, CrtRandom2 u, f32 choice) {
    CrtScatter s = crt_no_scatter();
    if (choice < b->coat_chance) {
        if (!crt_is_rough_coat(b->coat))
            return crt_sample_mirror_up(
                b, crt_tinted(b, splat4(crt_coat_albedo(b, dot3(b->wo, b->ns)) / b->coat_chance)));
        s.wi = normalize3(crt_reflect(b->wo, crt_visible_normal(b, u)));
        s.valid = dot3(s.wi, b->ns) > 0.0f;
    } else {
        s.wi = crt_lift(b, crt_cosine_direction(b->ns, u));
        s.valid = dot3(s.wi, b->ng) > 0.0f;
        if (crt_is_translucent(b) && crt_rescaled(choice, b->coat_chance) < b->pass_chance) {
            s.wi = -s.wi;
            const vec4 passed = crt_plastic_passed(b, s.wi, &s.pdf);
            s.valid = s.valid && s.pdf > 0.0f;
            if (s.valid) s.weight = passed / s.pdf;
            return s;
        }
    }
    const vec4 value = crt_plastic_reflected(b, s.wi, &s.pdf);
    s.valid = s.valid && s.pdf > 0.0f;
    if (s.valid) s.weight = value / s.pdf;
    return crt_mirror_up(b, s);
}

CRT_KERNEL_END

#endif
