/*
 * fuzz.h: the fuzz of OpenPBR Surface 1.1, fibres that stand on a surface: "Practical Multiple-Scattering
 * Sheen Using Linearly Transformed Cosines" (Zeltner, Burley and Chiang 2022), with the fits of its tables
 * that MaterialX has (mx_microfacet_sheen.glsl, Apache-2.0): of light towards w_o it takes the share E(θ_o)
 * and sends it on, in its colour, by Lambert's lobe under a linear map,
 *
 *     f cos θ_i = colour w E D(w_i),    D = a² cos θ_i / (π |M w_i|⁴),    M = (a 0 b; 0 a 0; 0 0 1)
 *
 * with x in the plane of w_o; w is the share of the surface that it lies on. The layers below get the rest,
 * 1 − w E, as the specification scales layers by their albedo: light that comes in through the fuzz is
 * not scaled once more on its way. So a white surface under white fuzz is white, and never brighter; but
 * neither the layer nor its lobe is reciprocal. Seen from inside a body there is no fuzz.
 */
#ifndef CRT_FUZZ_H
#define CRT_FUZZ_H

#include "kernel/materials/scatter.h"
#include "kernel/values/value.h"

CRT_KERNEL_BEGIN

#define CRT_FUZZ_ROUGHNESS_MIN 0.01f /* the tables' first */

CRT_FN int crt_is_fuzzy(const CrtBsdf *b) { return CRT_HAS(FUZZ) && b->fuzz_albedo > 0.0f; }

/* E at a cosine x, of the roughness y. */
CRT_FN f32 crt_fuzz_albedo(f32 x, f32 y) {
    const f32 s = y * (0.0206607f + 1.58491f * y) / (0.0379424f + y * (1.32227f + y));
    const f32 m = y * (-0.193854f + y * (-1.14885f + y * (1.7932f - 0.95943f * y * y))) / (0.046391f + y);
    const f32 o =
        y * (0.000654023f + (-0.0207818f + 0.119681f * y) * y) / (1.26264f + y * (-1.92021f + y));
    const f32 away = (x - m) / s;
    return crt_max(crt_exp_negative(-0.5f * away * away) / (s * 2.50662827f) + o, 0.0f);
}

/* Call this after crt_bsdf_prepare has set the BSDF below. */
CRT_FN void crt_prepare_fuzz(const CrtContext *ctx, CrtBsdf *b, const CrtSurface *surface, vec4 position,
                             int albedo) {
    b->fuzz_albedo = 0.0f;
    if (ctx->scene->layers.count == 0u) return;
    const CrtLayers layers = CRT_ARRAY(CrtLayers, ctx->blob, ctx->scene->layers)[surface->material];
    const int inside = (b->flags & CRT_BSDF_TRANSMITS) != 0u && dot3(b->ng, surface->ng) < 0.0f;
    if (!(layers.fuzz_weight > 0.0f) || inside) return;
    const vec4 color = crt_value(ctx, layers.fuzz_color, surface, position);
    const f32 x = crt_min(crt_abs(dot3(b->wo, b->ns)), 1.0f);
    const f32 y = crt_max(layers.fuzz_roughness, CRT_FUZZ_ROUGHNESS_MIN);
    b->fuzz_albedo = layers.fuzz_weight * crt_fuzz_albedo(x, y);
    b->fuzz_color = color * b->fuzz_albedo;
    const f32 scattered = 0.25f * sum4(b->fuzz_color);
    b->fuzz_chance = scattered / (scattered + 1.0f - b->fuzz_albedo);
    b->fuzz_width = (2.58126f * x + 0.813703f * y) * y / (1.0f + 0.310327f * x * x + 2.60994f * x * y);
    b->fuzz_lean = crt_sqrt(1.0f - x) * (y - 1.0f) * y * y * y /
                   (0.0000254053f + 1.71228f * x - 1.71506f * x * y + 1.34174f * y * y);
    if (albedo) {
        const f32 facing = layers.fuzz_weight * crt_fuzz_albedo(1.0f, y);
        b->albedo = color * facing + b->albedo * (1.0f - facing);
    }
}

/* Unit, from the normal towards the viewer; any direction where the view is along it. */
CRT_FN vec3 crt_fuzz_axis(const CrtBsdf *b) {
    const vec3 off = b->wo - b->ns * dot3(b->wo, b->ns);
    const f32 length = length3(off);
    return length > 1e-6f ? off * (1.0f / length) : crt_frame(b->ns).s;
}

/* f·cos and its density, of directions above the surface. */
CRT_FN vec4 crt_fuzz(const CrtBsdf *b, vec3 wi, f32 *pdf) {
    const f32 z = dot3(wi, b->ns), x = dot3(wi, crt_fuzz_axis(b));
    *pdf = 0.0f;
    if (!(z > 0.0f) || !(dot3(wi, b->ng) > 0.0f)) return splat4(0.0f);
    const f32 wide = b->fuzz_width * b->fuzz_width;
    const f32 leant = b->fuzz_width * x + b->fuzz_lean * z;
    const f32 square = leant * leant + wide * crt_max(1.0f - x * x - z * z, 0.0f) + z * z;
    *pdf = CRT_INV_PI * wide * z / (square * square);
    return b->fuzz_color * *pdf;
}

/* Distributed as that, about the shading normal. */
CRT_FN vec3 crt_fuzz_direction(const CrtBsdf *b, CrtRandom2 u) {
    const vec3 axis = crt_fuzz_axis(b);
    const CrtRandom2 disk = crt_concentric_disk(u);
    const f32 z = crt_sqrt(crt_max(0.0f, crt_fma(-disk.x, disk.x, crt_fma(-disk.y, disk.y, 1.0f))));
    const f32 x = (disk.x - b->fuzz_lean * z) / b->fuzz_width;
    return normalize3(axis * x + cross3(b->ns, axis) * (disk.y / b->fuzz_width) + b->ns * z);
}

/* Of `below`, the value of what lies under the fuzz, and *pdf, its density: those of both. */
CRT_FN vec4 crt_add_fuzz(const CrtBsdf *b, vec3 wi, vec4 below, f32 *pdf) {
    f32 pdf_fuzz;
    const vec4 fuzz = crt_fuzz(b, wi, &pdf_fuzz);
    *pdf = (1.0f - b->fuzz_chance) * *pdf + b->fuzz_chance * pdf_fuzz;
    return below * (1.0f - b->fuzz_albedo) + fuzz;
}

CRT_KERNEL_END

#endif
