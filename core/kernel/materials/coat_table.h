/*
 * coat_table.h: what the coats of plastic.h and clearcoat.h reflect: tables by the cosine, which the
 * compiler of the scene makes. Where the roughness depends on the place there is one for each of
 * CRT_COAT_ROUGHNESSES, and values between two of them are linear in the root of the roughness, to 3e-3. So
 * is the mean over the cosine, and what the coat sends back from below stays what its table loses: a white
 * base returns all light.
 */
#ifndef CRT_COAT_TABLE_H
#define CRT_COAT_TABLE_H

#include "kernel/materials/scatter.h"
#include "kernel/values/value.h"

CRT_KERNEL_BEGIN

/* True if what a coat sends back depends on its roughness. */
CRT_FN int crt_has_coat_tables(CrtValue internal) {
    return CRT_HAS(COAT_TEXTURE) && (internal & CRT_VALUE_REFERENCE) != 0u;
}

/* The place of a roughness among the tables. */
CRT_FN f32 crt_coat_place(f32 roughness) {
    return crt_sqrt(crt_clamp(roughness, 0.0f, 1.0f)) * (f32)(CRT_COAT_ROUGHNESSES - 1u);
}

CRT_FN CRT_GLOBAL const f32 *crt_table(const CrtContext *ctx, CrtValue value) {
    return CRT_ARRAY(f32, ctx->blob, ctx->scene->spectra) + (value & CRT_VALUE_INDEX) * CRT_SPECTRUM_STRIDE;
}

/* Of a material whose values are `albedo` and `internal`. */
CRT_FN CrtCoat crt_coat(const CrtContext *ctx, CrtValue albedo, CrtValue internal, f32 roughness) {
    CrtCoat coat;
    coat.table = 0;
    coat.between = 0.0f;
    if (!CRT_HAS(TABLE) || (albedo & CRT_VALUE_REFERENCE) == 0u) return coat;
    u32 first = 0u;
    if (crt_has_coat_tables(internal)) {
        if (!(roughness * roughness >= CRT_ALPHA_MIN)) return coat;
        const f32 place = crt_coat_place(roughness);
        const u32 last = CRT_COAT_ROUGHNESSES - 2u;
        first = (u32)place < last ? (u32)place : last;
        coat.between = place - (f32)first;
    }
    coat.table = crt_table(ctx, albedo) + first * CRT_SPECTRUM_STRIDE;
    return coat;
}

CRT_FN int crt_is_rough_coat(CrtCoat coat) { return CRT_HAS(TABLE) && coat.table != 0; }

/* The share of light at `cosine`, at most 1, that a coat of index `eta` reflects. */
CRT_FN f32 crt_coat_reflects(CrtCoat coat, f32 cosine, f32 eta) {
    if (!crt_is_rough_coat(coat)) return crt_fresnel_dielectric(cosine, eta);
    const f32 place = cosine * CRT_COAT_STEPS;
    const f32 reflected = crt_lookup(coat.table, place);
    if (!(CRT_HAS(COAT_TEXTURE) && coat.between > 0.0f)) return reflected;
    return crt_fma(coat.between, crt_lookup(coat.table + CRT_SPECTRUM_STRIDE, place) - reflected, reflected);
}

/* The share of diffuse light from below that it sends back. */
CRT_FN f32 crt_coat_returns(const CrtContext *ctx, CrtValue internal, f32 roughness) {
    if (!crt_has_coat_tables(internal)) return crt_from_bits(internal);
    return crt_lookup(crt_table(ctx, internal), crt_coat_place(roughness));
}

CRT_KERNEL_END

#endif
