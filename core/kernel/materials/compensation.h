/*
 * compensation.h: what microfacets lose. GGX with Smith's shadowing follows light to one microfacet; light
 * that other microfacets block is lost, 1 − E(θ) of the light towards a view at θ. Here it is given
 * back, diffusely (Kulla and Conty 2017):
 *
 *     f = share · L(θ_o) L(θ_i) / (π L̄),    L = 1 − E, L̄ its mean over the cosine
 *
 * so that the furnace holds whatever the roughness, and the sum stays reciprocal. L is a table by √cos,
 * which the compiler of the scene makes.
 *
 * Of metals the share is F̄² (1 − M) / (1 − F̄ M), F̄ the mean of Fresnel's reflectance, M the
 * chance to be lost once more: the series of what leaves after two reflections, three, and so on (as Hoffman
 * 2019, whose M is L̄). Light on its way out between the microfacets is lost less often than light from
 * outside: a random walk on Smith's surface (Heitz et al. 2016) gives M = .76 L̄. Of dielectrics the share
 * is 1, part of it on the other side of the surface: T = (1 − F̄) min(L̄, L̄') / L̄, with the other
 * side's mean L̄'. As (1 − F̄) n² is the same of both sides, so is T L̄ n², as reciprocity asks.
 */
#ifndef CRT_COMPENSATION_H
#define CRT_COMPENSATION_H

#include "kernel/materials/anisotropy.h"
#include "kernel/sampling/spectrum.h"

CRT_KERNEL_BEGIN

/* True if losses may depend on the wavelength. */
#define CRT_DIVIDES (CRT_HAS(DISPERSION) || CRT_HAS(THIN_FILM))

#define CRT_LOST_AGAIN 0.76f /* M / L̄; tests/unit_microfacets.cpp */

/* The losses to read, and the place in them: between two roughnesses if the roughness is textured, or
   between two azimuths. */
typedef struct CrtLossPlace {
    f32 at;      /* along a row */
    u32 row;     /* floats from the first row to the one at or before the azimuth */
    f32 between; /* how far on to the next one */
} CrtLossPlace;

#define CRT_LOSS_BY_ROW (CRT_HAS(TEXTURE) || CRT_HAS(ANISOTROPY))

/* The place of a value that does not depend on a direction: CRT_LOSS_MEAN, CRT_LOSS_PASSED. */
CRT_FN CrtLossPlace crt_loss_constant(const CrtBsdf *b, f32 at) {
    CrtLossPlace place;
    place.at = at;
    place.row = 0u;
    place.between = b->losses.between;
    return place;
}

CRT_FN f32 crt_loss_along(f32 cosine) { return crt_sqrt(crt_clamp(cosine, 0.0f, 1.0f)) * CRT_LOSS_STEPS; }

/* Of the direction w, at `cosine` to the normal on its side. */
CRT_FN CrtLossPlace crt_loss_place(const CrtBsdf *b, vec3 w, f32 cosine) {
    CrtLossPlace place = crt_loss_constant(b, crt_loss_along(cosine));
    if (CRT_HAS(ANISOTROPY) && crt_is_anisotropic(b)) {
        const f32 at = crt_azimuth(b, w) * (f32)(CRT_LOSS_AZIMUTHS - 1u);
        const u32 last = CRT_LOSS_AZIMUTHS - 2u;
        const u32 i = (u32)at < last ? (u32)at : last;
        place.row = i * b->losses.roughness_step;
        place.between = at - (f32)i;
    }
    return place;
}

CRT_FN f32 crt_loss_of_rows(const CrtBsdf *b, CRT_GLOBAL const f32 *row, CrtLossPlace place) {
    const f32 loss = crt_lookup(row, place.at);
    if (!CRT_LOSS_BY_ROW) return loss;
    return crt_fma(place.between, crt_lookup(row + b->losses.roughness_step, place.at) - loss, loss);
}

/* At one place of the rows, and between those of two indices where what is reflected depends on the
   wavelength. */
CRT_FN f32 crt_loss_lane(const CrtBsdf *b, u32 side, CrtLossPlace place, f32 index) {
    CRT_GLOBAL const f32 *row = b->losses.rows + side * CRT_LOSS_STRIDE;
    const u32 i = CRT_DIVIDES ? (u32)index : 0u;
    row += i * b->losses.index_step;
    if (CRT_HAS(ANISOTROPY)) row += place.row;
    const f32 loss = crt_loss_of_rows(b, row, place);
    if (!CRT_DIVIDES) return loss;
    const f32 next = crt_loss_of_rows(b, row + b->losses.index_step, place);
    return crt_fma(index - (f32)i, next - loss, loss);
}

/* At the path's wavelengths. */
CRT_FN vec4 crt_loss(const CrtBsdf *b, u32 side, CrtLossPlace place) {
    const u32 lanes = CRT_DIVIDES && b->losses.index_step != 0u ? 4u : 1u;
    vec4 loss = splat4(0.0f);
    CRT_ROLLED for (u32 lane = 0u; lane < lanes; ++lane)
        loss = crt_with_lane(loss, lane,
                             crt_loss_lane(b, side, place, crt_lane(b->losses.index, lane)));
    return lanes == 1u ? splat4(V4X(loss)) : loss;
}

/* Directions of this light are sampled by the steps of the rows, each with its share, and within a step by
   the cosine: nearly as the light is distributed. Of a textured roughness the next larger row's, of several
   indices the first one's shares; of azimuths all have those of their mean. */
CRT_FN CRT_GLOBAL const f32 *crt_loss_shares(const CrtBsdf *b, u32 side) {
    return b->losses.rows + b->losses.roughness_step + side * CRT_LOSS_STRIDE + CRT_LOSS_SHARES;
}

/* The fourth power of the root of the cosine where a step begins: its cosine squared. */
CRT_FN f32 crt_loss_step(u32 i) {
    const f32 square = (f32)(i * i) * (1.0f / (CRT_LOSS_STEPS * CRT_LOSS_STEPS));
    return square * square;
}

/* Density per steradian of a direction at `cosine`. */
CRT_FN f32 crt_given_back_pdf(const CrtBsdf *b, u32 side, f32 cosine) {
    CRT_GLOBAL const f32 *shares = crt_loss_shares(b, side);
    const u32 last = (u32)CRT_LOSS_STEPS - 1u;
    const u32 at = (u32)crt_loss_along(cosine);
    const u32 i = at < last ? at : last;
    return (shares[i + 1u] - shares[i]) / (crt_loss_step(i + 1u) - crt_loss_step(i)) * crt_lambert(cosine);
}

/* A direction about the normal n. */
CRT_FN vec3 crt_given_back_direction(const CrtBsdf *b, u32 side, vec3 n, CrtRandom2 u) {
    CRT_GLOBAL const f32 *shares = crt_loss_shares(b, side);
    u32 i = 0u; /* the last step that begins at or below u.x */
    CRT_ROLLED for (u32 jump = 64u; jump != 0u; jump >>= 1u)
        if (i + jump < (u32)CRT_LOSS_STEPS && shares[i + jump] <= u.x) i += jump;
    const f32 share = shares[i + 1u] - shares[i];
    const f32 f = share > 0.0f ? crt_clamp((u.x - shares[i]) / share, 0.0f, 1.0f) : 0.5f;
    const f32 first = crt_loss_step(i);
    const f32 cos2 = crt_fma(f, crt_loss_step(i + 1u) - first, first);
    const f32 cosine = crt_sqrt(cos2), sine = crt_sqrt(crt_max(1.0f - cos2, 0.0f));
    f32 cos_phi;
    const f32 sin_phi = crt_sincos(2.0f * CRT_PI * u.y, &cos_phi);
    return normalize3(crt_to_world(crt_frame(n), make_vec3(sine * cos_phi, sine * sin_phi, cosine)));
}

/* Finds the rows of a material. `index`: inside over outside; under a film, the wavelengths' positions. */
CRT_FN CrtLosses crt_losses(const CrtContext *ctx, u32 loss, f32 roughness, vec4 index, u32 side) {
    CRT_GLOBAL const CrtLoss *record = CRT_ARRAY(CrtLoss, ctx->blob, ctx->scene->losses) + loss;
    CrtLosses l;
    l.rows = CRT_ARRAY(f32, ctx->blob, record->rows);
    l.side = side;
    l.between = 0.0f;
    l.roughness_step = l.index_step = 0u;
    l.index = splat4(0.0f);
    if (CRT_HAS(ANISOTROPY) && record->by_azimuth != 0u) {
        l.roughness_step = record->sides * CRT_LOSS_STRIDE;
    } else if (CRT_HAS(TEXTURE) && record->roughnesses > 1u) {
        const f32 at = crt_clamp(roughness, 0.0f, 1.0f) * (f32)(record->roughnesses - 1u);
        const u32 last = record->roughnesses - 2u;
        const u32 i = (u32)at < last ? (u32)at : last;
        l.roughness_step = record->sides * CRT_LOSS_STRIDE;
        l.rows += i * l.roughness_step;
        l.between = at - (f32)i;
    }
    if (CRT_DIVIDES && record->indices > 1u) {
        l.index_step = record->roughnesses * record->sides * CRT_LOSS_STRIDE;
        /* Short of the last row, behind which there is none. */
        const vec4 at = (index - splat4(record->first_index)) * record->index_scale;
        const vec4 last = splat4((f32)(record->indices - 1u) * (1.0f - CRT_EPSILON));
        l.index = crt_max4(crt_min4(at, last), splat4(0.0f));
    }
    return l;
}

/* Sets what a metal gives back: b->reflectance times L(θ_i). `mean`: F̄. */
CRT_FN void crt_prepare_metal_loss(CrtBsdf *b, vec4 mean) {
    const f32 lost = crt_loss_lane(b, 0u, crt_loss_place(b, b->wo, dot3(b->wo, b->ns)), 0.0f);
    const f32 lost_mean = crt_loss_lane(b, 0u, crt_loss_constant(b, CRT_LOSS_MEAN), 0.0f);
    const f32 relost = CRT_LOST_AGAIN * lost_mean;
    b->reflectance = mean * mean * ((1.0f - relost) * lost / lost_mean) / (splat4(1.0f) - mean * relost);
    b->lost_chance = lost;
}

/* Sets what glass gives back, b->reflectance times L(θ_i) on this side and b->through times L'(θ_i) on
   the other. The path's throughput in each wavelength weights the random choice. */
CRT_FN void crt_prepare_glass_loss(CrtBsdf *b) {
    const u32 side = b->losses.side;
    const vec4 square = b->eta * b->eta;
    const CrtLossPlace of_mean = crt_loss_constant(b, CRT_LOSS_MEAN);
    const vec4 lost = crt_loss(b, side, crt_loss_place(b, b->wo, dot3(b->wo, b->ns)));
    const vec4 mean = crt_loss(b, side, of_mean), beyond = crt_loss(b, 1u - side, of_mean);
    vec4 through = crt_loss(b, 0u, crt_loss_constant(b, CRT_LOSS_PASSED));
    if (side != 0u) through = through * square;
    through = through * crt_min4(mean, beyond) / mean;
    b->reflectance = lost * (splat4(1.0f) - through) / mean;
    b->through = lost * through / (beyond * square);
    b->lost_chance = sum4(b->lanes * lost);
    b->back_share = sum4(b->lanes * lost * (splat4(1.0f) - through)) / b->lost_chance;
}

CRT_KERNEL_END

#endif
