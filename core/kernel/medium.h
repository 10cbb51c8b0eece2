/*
 * medium.h: what the light crosses between surfaces. Bodies of dielectrics absorb (Beer and Lambert); what
 * is around them does not.
 *
 * A path carries the list of the media that surround it, the one that it entered last first: numbers of
 * CrtScene.medium_bits each (a divisor of 32) in a word, 0 behind the last. Going into a body puts its
 * medium in front, going out takes it away, wherever it is in the list, so that bodies may overlap (compare
 * Schmidt and Budge 2002, whose priorities choose where here the last does). The first one absorbs. Where
 * the word is full, the outermost is forgotten.
 *
 * A ray that meets the back of a surface whose medium is not in its list has been inside that body all
 * along: where two surfaces coincide, one of them is passed unseen. So that body has absorbed, and is in the
 * list from there on. Which of two it was cannot be told, so a ray that crosses a surface that touches
 * another one (touching_media.h) keeps nothing of what was around it: the backs that it meets bring it back.
 * Surfaces with holes are another matter: inside such a body without its medium in the list is what came in
 * by a hole, where there is no glass, and goes out as freely (composition.h).
 *
 * Bodies whose media absorb alike have one number, unless their surface has holes: it makes no difference.
 */
#ifndef CRT_MEDIUM_H
#define CRT_MEDIUM_H

#include "bsdf.h"

CRT_KERNEL_BEGIN

/* What the surface of a material bounds; of one that is made of others, all of them. */
CRT_FN u32 crt_medium_of(const CrtContext *ctx, u32 material) {
    return CRT_ARRAY(CrtMaterial, ctx->blob, ctx->scene->materials)[material].medium;
}

CRT_FN u32 crt_first_medium(const CrtContext *ctx, u32 media) {
    return media & ((1u << ctx->scene->medium_bits) - 1u);
}

/* Where in the list a medium is first, in bits; 32 where it is not. */
CRT_FN u32 crt_place_of_medium(const CrtContext *ctx, u32 media, u32 medium) {
    u32 at = 0u;
    for (; media != 0u; media >>= ctx->scene->medium_bits) {
        if (crt_first_medium(ctx, media) == medium) return at;
        at += ctx->scene->medium_bits;
    }
    return 32u;
}

CRT_FN int crt_surrounds(const CrtContext *ctx, u32 media, u32 medium) {
    return crt_place_of_medium(ctx, media, medium) < 32u;
}

CRT_FN u32 crt_entered(const CrtContext *ctx, u32 media, u32 medium) {
    return media << ctx->scene->medium_bits | medium;
}

CRT_FN u32 crt_left(const CrtContext *ctx, u32 media, u32 medium) {
    const u32 at = crt_place_of_medium(ctx, media, medium);
    if (at >= 32u) return media;
    const u32 before = (1u << at) - 1u;
    return (media & before) | (media >> ctx->scene->medium_bits & ~before);
}

CRT_FN f32 crt_transmittance_lane(f32 absorption, f32 distance) {
    return absorption > 0.0f ? crt_exp_negative(-absorption * distance) : 1.0f; /* at infinity, too */
}

/* exp(−σ·distance) of a medium at the path's wavelengths. `distance` in lengths here. */
CRT_FN vec4 crt_transmittance(const CrtContext *ctx, u32 medium, f32 distance, vec4 position) {
    if (medium == 0u) return splat4(1.0f);
    const CrtValue absorption = CRT_ARRAY(CrtValue, ctx->blob, ctx->scene->media)[medium - 1u];
    if (absorption == 0u) return splat4(1.0f);
    const vec4 sigma = crt_value(ctx, absorption, 0, position) * ctx->scene->depth_scale;
    return make_vec4(crt_transmittance_lane(V4X(sigma), distance),
                     crt_transmittance_lane(V4Y(sigma), distance),
                     crt_transmittance_lane(V4Z(sigma), distance),
                     crt_transmittance_lane(V4W(sigma), distance));
}

/* What a ray of direction d crossed before it met `surface`, among `media`. */
CRT_FN u32 crt_medium_before(const CrtContext *ctx, const CrtSurface *surface, vec3 d, u32 media) {
    const int inside = surface->medium != 0u && dot3(d, surface->ng) > 0.0f;
    return inside && !crt_surrounds(ctx, media, surface->medium) ? surface->medium
                                                                 : crt_first_medium(ctx, media);
}

/* Whether another body's surface lies in the same place. */
CRT_FN int crt_touches(const CrtContext *ctx, CrtHit hit) {
    const u32 primitive = crt_primitive_of(ctx, hit);
    return (CRT_ARRAY(CrtPrimitive, ctx->blob, ctx->scene->primitives)[primitive].object &
            CRT_PRIMITIVE_TOUCHES) != 0u;
}

/* What is around a ray that leaves `surface` along w, where `media` were around the one that led there. */
CRT_FN u32 crt_media_behind(const CrtContext *ctx, const CrtSurface *surface, const CrtBsdf *bsdf, vec3 w,
                            u32 media) {
    if (surface->medium == 0u || (bsdf->flags & CRT_BSDF_BOUNDS) == 0u) return media;
    const int from_inside = dot3(bsdf->wo, surface->ng) < 0.0f;
    if (dot3(w, surface->ng) < 0.0f) {
        if (from_inside && crt_surrounds(ctx, media, surface->medium)) return media;
        return crt_entered(ctx, surface->touches ? 0u : media, surface->medium);
    }
    if (!from_inside) return media;
    return surface->touches ? 0u : crt_left(ctx, media, surface->medium);
}

CRT_KERNEL_END

#endif
