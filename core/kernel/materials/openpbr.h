/*
 * openpbr.h: metals as OpenPBR Surface 1.1 describes them: by their colours straight on and near the edge,
 * not by an index. "F82-tint" (Kutz, Hasan and Edmondson 2021): Schlick's curve from F₀ to 1, less a dip
 * that is deepest at the cosine 1/7 (82°), where `tint` of Schlick's value is left; all of it times a
 * weight:
 *
 *     F = w (F₀ + (1 − F₀)(1 − μ)⁵ − b μ (1 − μ)⁶)
 *     b = (1 − tint) F_Schlick(1/7) / ((1/7)(6/7)⁶)
 */
#ifndef CRT_OPENPBR_H
#define CRT_OPENPBR_H

#include "kernel/materials/scatter.h"

CRT_KERNEL_BEGIN

#define CRT_EDGE_SCHLICK 0.46266436f /* (6/7)⁵ */
#define CRT_EDGE_DIP 17.651394f      /* 1 / ((1/7)(6/7)⁶) */

CRT_FN int crt_is_colored(const CrtBsdf *b) {
    return CRT_HAS(ROUGH_CONDUCTOR) && (b->flags & CRT_BSDF_COLORED) != 0u;
}

/* Replaces b->eta, F₀, and b->k, the tint, by w F₀ and b, so that each angle costs less. */
CRT_FN void crt_prepare_colors(CrtBsdf *b, f32 weight) {
    b->flags |= CRT_BSDF_COLORED;
    b->edge = weight;
    b->eta = b->eta * weight;
    const vec4 near_edge = b->eta + (splat4(weight) - b->eta) * CRT_EDGE_SCHLICK;
    b->k = (splat4(1.0f) - b->k) * near_edge * CRT_EDGE_DIP;
}

/* Dark metals with a dark tint would have a reflectance below 0 beside the dip. */
CRT_FN vec4 crt_colored_reflectance(const CrtBsdf *b, f32 cos_i) {
    const f32 away = crt_max(1.0f - cos_i, 0.0f), away2 = away * away, away5 = away2 * away2 * away;
    return crt_max4(b->eta + (splat4(b->edge) - b->eta) * away5 - b->k * (cos_i * away5 * away),
                    splat4(0.0f));
}

/* Its mean over the cosine. */
CRT_FN vec4 crt_colored_mean(const CrtBsdf *b) {
    return crt_max4(b->eta + (splat4(b->edge) - b->eta) * (1.0f / 21.0f) - b->k * (1.0f / 126.0f),
                    splat4(0.0f));
}

CRT_KERNEL_END

#endif
