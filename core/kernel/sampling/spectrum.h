/*
 * spectrum.h: four wavelengths per path (hero wavelength sampling, Wilkie et al. 2014), spectra at them, and
 * what the observer sees.
 */
#ifndef CRT_SPECTRUM_H
#define CRT_SPECTRUM_H

#include "kernel/dialect/context.h"
#include "kernel/dialect/math.h"

CRT_KERNEL_BEGIN

typedef struct CrtWavelengths {
    vec4 position; /* λ − 360 nm, in [0, 470] */
    f32 u;         /* that placed them; their densities are found again from it: one register for four */
} CrtWavelengths;

/* Wavelength and 1/pdf at u ∈ [0,1): the tabulated inverse distribution, linear between nodes, so the
   density is constant in each cell and exactly 1/(N·Δλ). */
CRT_FN f32 crt_wavelength(const CrtContext *ctx, f32 u, f32 *inverse_pdf) {
    CRT_GLOBAL const f32 *table = CRT_ARRAY(f32, ctx->blob, ctx->scene->wavelengths);
    const f32 x = u * (f32)CRT_WAVELENGTH_TABLE;
    const u32 cell = (u32)x;
    const f32 lower = table[cell];
    const f32 step = table[cell + 1u] - lower;
    *inverse_pdf = step * (f32)CRT_WAVELENGTH_TABLE;
    return crt_fma(x - (f32)cell, step, lower) - CRT_WAVELENGTH_MIN_NM;
}

/* One stratified number places all four, (u + i)/4: each in its own quarter of the distribution. The inverse
   density is that of the four together, 1 / (4 pdf(λ)), nm. */
CRT_FN vec4 crt_four_wavelengths(const CrtContext *ctx, f32 u, vec4 *inverse_pdf) {
    f32 w0, w1, w2, w3;
    const f32 l0 = crt_wavelength(ctx, u * 0.25f, &w0);
    const f32 l1 = crt_wavelength(ctx, u * 0.25f + 0.25f, &w1);
    const f32 l2 = crt_wavelength(ctx, u * 0.25f + 0.5f, &w2);
    const f32 l3 = crt_wavelength(ctx, crt_min(u * 0.25f + 0.75f, 1.0f - CRT_EPSILON), &w3);
    *inverse_pdf = make_vec4(w0, w1, w2, w3) * 0.25f;
    return make_vec4(l0, l1, l2, l3);
}

CRT_FN CrtWavelengths crt_sample_wavelengths(const CrtContext *ctx, f32 u) {
    CrtWavelengths w;
    vec4 unused;
    w.position = crt_four_wavelengths(ctx, u, &unused);
    w.u = u;
    return w;
}

CRT_FN f32 crt_lookup(CRT_GLOBAL const f32 *table, f32 position) {
    const u32 i = (u32)position;
    const f32 a = table[i];
    return crt_fma(position - (f32)i, table[i + 1u] - a, a);
}

/* A table at the path's wavelengths, linear between nanometres. */
CRT_SHARED_FN vec4 crt_lookup4(CRT_GLOBAL const f32 *table, vec4 position) {
    return make_vec4(crt_lookup(table, V4X(position)), crt_lookup(table, V4Y(position)),
                     crt_lookup(table, V4Z(position)), crt_lookup(table, V4W(position)));
}

/* A tabulated spectrum of the scene. */
CRT_FN vec4 crt_spectrum(const CrtContext *ctx, u32 index, vec4 position) {
    return crt_lookup4(CRT_ARRAY(f32, ctx->blob, ctx->scene->spectra) + index * CRT_SPECTRUM_STRIDE,
                       position);
}

/* ½ + x / (2√(1 + x²)) of each lane. 1 / (2h(h + |x|)), with h = √(1 + x²), is the smaller of that
   and 1 minus that: no digits cancel, also where a surface is nearly black. Six roundings: error < 6 ulp of
   the result, or of 1 minus it. */
CRT_FN vec4 crt_sigmoid_of(vec4 x) {
    const vec4 one = splat4(1.0f);
    const vec4 size = crt_abs4(x);
    const vec4 h = crt_sqrt4(crt_fma4(x, x, one));
    const vec4 smaller = splat4(0.5f) / (h * (h + size));
    return crt_where_less4(x, splat4(0.0f), smaller, one - smaller);
}

/* A reflectance of three numbers (Jakob and Hanika 2019): the sigmoid of c0 + c1 t + c2 t², t the
   wavelength as -1 (360 nm) to 1 (830 nm). */
CRT_FN vec4 crt_sigmoid(f32 c0, f32 c1, f32 c2, vec4 position) {
    const f32 scale = 2.0f / (f32)(CRT_WAVELENGTH_COUNT - 1u);
    const vec4 t = crt_fma4(position, splat4(scale), splat4(-1.0f));
    return crt_sigmoid_of(crt_fma4(crt_fma4(splat4(c2), t, splat4(c1)), t, splat4(c0)));
}

/* (x̄, ȳ, z̄, 0) / ∫ȳ at one wavelength. */
CRT_FN vec4 crt_observer(const CrtContext *ctx, f32 position) {
    CRT_GLOBAL const f32 *table = CRT_ARRAY(f32, ctx->blob, ctx->scene->observer);
    const u32 i = (u32)position;
    const vec4 a = crt_load4(table + 4u * i);
    const vec4 b = crt_load4(table + 4u * i + 4u);
    return a + (b - a) * (position - (f32)i);
}

/* XYZ (and 0) of the radiance carried by the four wavelengths. */
CRT_FN vec4 crt_to_xyz(const CrtContext *ctx, CrtWavelengths w, vec4 radiance) {
    vec4 inverse_pdf;
    (void)crt_four_wavelengths(ctx, w.u, &inverse_pdf);
    const vec4 r = radiance * inverse_pdf;
    return (crt_observer(ctx, V4X(w.position)) * V4X(r) + crt_observer(ctx, V4Y(w.position)) * V4Y(r)) +
           (crt_observer(ctx, V4Z(w.position)) * V4Z(r) + crt_observer(ctx, V4W(w.position)) * V4W(r));
}

CRT_KERNEL_END

#endif
