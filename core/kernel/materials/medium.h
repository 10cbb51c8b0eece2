/*
 * medium.h: absorption between surfaces. Bodies of dielectrics absorb by Beer and Lambert's law; the space
 * around them does not.
 *
 * A path carries the list of the media that surround it in one word. Each entry has CrtScene.medium_bits
 * bits (a divisor of 32); the medium that the path entered last comes first, and zeros follow the last
 * entry. Entering a body puts its medium in front. Leaving removes it, wherever it is in the list, so
 * bodies may overlap (compare Schmidt and Budge 2002, who choose by priorities). The first medium absorbs.
 * When the word is full, the path forgets the outermost medium.
 *
 * A ray that meets the back of a surface whose medium is not in its list has been inside that body all
 * along: the path passed one of two coinciding surfaces without meeting it. So that body absorbs on this
 * segment, and the list contains it from there on. It is unknown which of the two surfaces a path met, so a
 * path that crosses a surface that touches another one (touching_media.h) drops all other media from its
 * list; their back faces restore them. Surfaces with holes differ: a ray inside such a body whose list
 * lacks the medium came in through a hole, is in no glass, and leaves as freely (passing.h).
 *
 * Media that absorb equally share a number, unless their surfaces have holes: paths need not distinguish
 * them.
 */
#ifndef CRT_MEDIUM_H
#define CRT_MEDIUM_H

#include "kernel/materials/scatter.h"
#include "kernel/values/value.h"

CRT_KERNEL_BEGIN

/* The medium that the surface of a material bounds, also of a mix. */
CRT_FN u32 crt_medium_of(const CrtContext *ctx, u32 material) {
    return CRT_ARRAY(CrtMaterial, ctx->blob, ctx->scene->materials)[material].medium;
}

CRT_FN u32 crt_first_medium(const CrtContext *ctx, u32 media) {
    return media & ((1u << ctx->scene->medium_bits) - 1u);
}

/* Bit position of the first entry of a medium in the list; 32 if it is not there. */
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

/* The medium that a ray of direction d crossed before it met `surface`, given the list at its start. */
CRT_FN u32 crt_medium_before(const CrtContext *ctx, const CrtSurface *surface, vec3 d, u32 media) {
    const int inside = surface->medium != 0u && dot3(d, surface->ng) > 0.0f;
    return inside && !crt_surrounds(ctx, media, surface->medium) ? surface->medium
                                                                 : crt_first_medium(ctx, media);
}

/* True if the surface of another body coincides with the hit surface. */
CRT_FN int crt_touches(const CrtContext *ctx, CrtHit hit) {
    const u32 primitive = crt_primitive_of(ctx, hit);
    return (CRT_ARRAY(CrtPrimitive, ctx->blob, ctx->scene->primitives)[primitive].object &
            CRT_PRIMITIVE_TOUCHES) != 0u;
}

/* The list of a ray that leaves `surface` along w, given the list of the ray that arrived there. */
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
