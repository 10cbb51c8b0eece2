/*
 * texture.h: values that depend on the place on a surface: images, patterns, colours of vertices.
 *
 * Between texels and between vertices, spectra are interpolated, not the coefficients that they are made of:
 * those of black and white are so large that half-way between them is no grey.
 */
#ifndef CRT_TEXTURE_H
#define CRT_TEXTURE_H

#include "kernel/geometry/hit.h"
#include "kernel/sampling/spectrum.h"

CRT_KERNEL_BEGIN

/* s within the image, [0, 1]. */
CRT_FN f32 crt_wrap(f32 s, u32 wrap) {
    if (wrap == CRT_WRAP_CLAMP) return crt_clamp(s, 0.0f, 1.0f);
    if (wrap == CRT_WRAP_REPEAT) return s - crt_floor(s);
    const f32 r = s - 2.0f * crt_floor(0.5f * s);
    return r > 1.0f ? 2.0f - r : r;
}

/* The two texels of a row or column that a place lies between, and how far it is from the first to the
   second. */
typedef struct CrtTexelPair {
    i32 first, second;
    f32 f;
} CrtTexelPair;

CRT_FN CrtTexelPair crt_texel_pair(f32 s, u32 count, u32 wrap, u32 nearest) {
    const i32 last = (i32)count - 1;
    const f32 x = crt_wrap(s, wrap) * (f32)count;
    CrtTexelPair pair;
    if (nearest != 0u) {
        const i32 i = (i32)x;
        pair.first = pair.second = i > last ? last : i;
        pair.f = 0.0f;
        return pair;
    }
    /* Texel i has its centre at i + ½. Mirrored at its edge an image goes on with its last texel, as does
       one that is held. */
    const f32 before = crt_floor(x - 0.5f);
    const i32 i = (i32)before;
    pair.first = i >= 0 ? i : wrap == CRT_WRAP_REPEAT ? last : 0;
    pair.second = i < last ? i + 1 : wrap == CRT_WRAP_REPEAT ? 0 : last;
    pair.f = x - 0.5f - before;
    return pair;
}

/* A texel of three words as the coefficients of a sigmoid: 16, 14 and 14 bits of them, all times the power
   of two that 4 bits say. */
CRT_FN vec4 crt_texel_spectrum(CRT_GLOBAL const u16 *texel, vec4 position) {
    const u32 w0 = texel[0];
    const u32 w1 = texel[1];
    const u32 w2 = texel[2];
    const f32 scale = crt_from_bits((((w1 & 3u) | (w2 & 3u) << 2u) + 125u) << 23u); /* 2^-2 to 2^13 */
    return crt_sigmoid(((f32)w0 - 32768.0f) * (scale * 3.0517578125e-5f),
                       ((f32)(w1 >> 2u) - 8192.0f) * (scale * 1.220703125e-4f),
                       ((f32)(w2 >> 2u) - 8192.0f) * (scale * 1.220703125e-4f), position);
}

CRT_FN vec4 crt_texel(const CrtContext *ctx, const CrtTexture *texture, i32 x, i32 y, vec4 position) {
    CRT_GLOBAL const u16 *words = CRT_ARRAY(u16, ctx->blob, texture->words);
    const u64 index = (u64)(u32)y * texture->width + (u32)x;
    if (CRT_HAS(NORMAL_MAP) && texture->kind == CRT_TEXTURE_NORMALS) {
        CRT_GLOBAL const u16 *n = words + index * 3u;
        return make_vec4((f32)n[0], (f32)n[1], (f32)n[2], 0.0f) * (2.0f / 65535.0f) -
               make_vec4(1.0f, 1.0f, 1.0f, 0.0f);
    }
    if (texture->kind == CRT_TEXTURE_NUMBERS) return splat4((f32)words[index] * (1.0f / 65535.0f));
    return crt_texel_spectrum(words + index * 3u, position);
}

CRT_FN vec4 crt_mix4(vec4 a, vec4 b, f32 f) { return a + (b - a) * f; }

/* The coordinates of a texture look-up. */
typedef struct CrtTexturePlace {
    f32 s, t;
} CrtTexturePlace;

CRT_FN CrtTexturePlace crt_texture_place(const CrtTexture *texture, const CrtFacePlace *at) {
    CrtTexturePlace place;
    place.s = crt_fma(texture->from_uv[0], at->u,
                      crt_fma(texture->from_uv[1], at->v, texture->from_uv[2]));
    place.t = crt_fma(texture->from_uv[3], at->u,
                      crt_fma(texture->from_uv[4], at->v, texture->from_uv[5]));
    return place;
}

CRT_FN vec4 crt_image(const CrtContext *ctx, const CrtTexture *texture, const CrtFacePlace *at,
                      vec4 position) {
    const CrtTexturePlace place = crt_texture_place(texture, at);
    const CrtTexelPair x = crt_texel_pair(place.s, texture->width, texture->wrap, texture->nearest);
    const CrtTexelPair y = crt_texel_pair(place.t, texture->height, texture->wrap, texture->nearest);
    const vec4 upper_left = crt_texel(ctx, texture, x.first, y.first, position);
    if (texture->nearest != 0u) return upper_left;
    const vec4 upper =
        crt_mix4(upper_left, crt_texel(ctx, texture, x.second, y.first, position), x.f);
    const vec4 lower = crt_mix4(crt_texel(ctx, texture, x.first, y.second, position),
                                crt_texel(ctx, texture, x.second, y.second, position), x.f);
    return crt_mix4(upper, lower, y.f);
}

/* Patterns: crt_<word> of CRT_PATTERN_LIST returns 0 where the pattern has its first value, 1 where it has
   the second. `numbers`: those of its keys, in the order of the schema. */

/* Squares of side 1: the first value where the two numbers of a square, counted from that at (0, 0), have an
   even sum. */
CRT_FN int crt_checker(CrtTexturePlace at, CRT_GLOBAL const f32 *numbers) {
    (void)numbers;
    const f32 half_sum = 0.5f * (crt_floor(at.s) + crt_floor(at.t));
    return crt_floor(half_sum) != half_sum;
}

CRT_FN vec4 crt_vertex_color(const CrtContext *ctx, const CrtFacePlace *at, vec4 position) {
    CRT_GLOBAL const f32 *c =
        CRT_ARRAY(CrtVertexColors, ctx->blob, ctx->scene->vertex_colors)[at->id].c;
    return crt_sigmoid(c[0], c[1], c[2], position) * (1.0f - at->b1 - at->b2) +
           crt_sigmoid(c[3], c[4], c[5], position) * at->b1 +
           crt_sigmoid(c[6], c[7], c[8], position) * at->b2;
}

CRT_FN int crt_is_texture(CrtValue value) { return (value & CRT_VALUE_KIND) == CRT_VALUE_TEXTURE; }

#define CRT_PATTERN_CHOOSES(number, NAME, Name, word, KERNELS)                                          \
    if (CRT_HAS(KERNELS) && texture.kind == CRT_TEXTURE_##NAME)                                         \
        second = crt_##word(crt_texture_place(&texture, at), CRT_ARRAY(f32, ctx->blob, texture.words)); \
    else

/* Resolves nested patterns to the value at a place. */
CRT_FN CrtValue crt_resolve_pattern(const CrtContext *ctx, CrtValue value, const CrtFacePlace *at) {
    while (crt_is_texture(value)) {
        const CrtTexture texture =
            CRT_ARRAY(CrtTexture, ctx->blob, ctx->scene->textures)[value & CRT_VALUE_INDEX];
        int second;
        CRT_PATTERN_LIST(CRT_PATTERN_CHOOSES) break;
        value = second ? texture.second : texture.first;
    }
    return value;
}

/* The factor of an image. */
CRT_FN vec4 crt_factor(const CrtContext *ctx, CrtValue factor, const CrtFacePlace *at, vec4 position) {
    if (crt_is_texture(factor)) return crt_vertex_color(ctx, at, position);
    if (CRT_HAS(TABLE) && (factor & CRT_VALUE_REFERENCE) != 0u)
        return crt_spectrum(ctx, factor & CRT_VALUE_INDEX, position);
    return splat4(crt_from_bits(factor));
}

/* Neither number, nor table, nor pattern. Called from wherever a material has a value; everything by value,
   so that none of it has to lie in memory. */
CRT_CALLED_FN vec4 crt_texture(CrtContext ctx, u32 index, CrtFacePlace at, vec4 position) {
    const CrtTexture texture = CRT_ARRAY(CrtTexture, ctx.blob, ctx.scene->textures)[index];
    if (texture.kind == CRT_TEXTURE_VERTICES) return crt_vertex_color(&ctx, &at, position);
    const vec4 texel = crt_image(&ctx, &texture, &at, position);
    if (!CRT_HAS(FACTOR) || texture.first == 0u) return texel;
    return texel * crt_factor(&ctx, texture.first, &at, position);
}

CRT_KERNEL_END

#endif
