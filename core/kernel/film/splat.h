/*
 * splat.h: samples that add to other pixels than their own. Sums are integers of 128 bits in fixed point:
 * their addition has no order, so the bits are the same whichever thread, block or device comes first.
 *
 * The unit is 1 / splat_scale: 2^-32 of the scene's power, rounded to a power of two. A splat is rounded to
 * units once, and must be below 2^63 of them: 2^31 times the scene's power. A splat that is larger, or not
 * finite, is left out and counted. A sum has room for 2^64 of the largest, more than any render adds.
 */
#ifndef CRT_SPLAT_H
#define CRT_SPLAT_H

#include "kernel/film/film.h"

CRT_KERNEL_BEGIN

/* Adds to a sum of two words, the low one first, in two's complement. Most splats need one atomic. */
CRT_FN void crt_splat_add(CRT_GLOBAL u64 *sum, f64 units) {
    const int negative = units < 0.0;
    const u64 magnitude = (u64)((negative ? -units : units) + 0.5);
    const u64 low = negative ? (u64)0 - magnitude : magnitude;
    u64 high = negative && magnitude != (u64)0 ? ~(u64)0 : (u64)0;
    high += crt_atomic_carry(sum, low);
    if (high != (u64)0) (void)crt_atomic_carry(sum + 1, high);
}

/* True if a value fits into a splat. */
CRT_FN int crt_splat_fits(f32 value, f64 scale) {
    const f64 most = 9223372036854775808.0; /* 2^63 */
    return crt_is_finite(value) && (f64)value * scale < most && (f64)value * scale > -most;
}

/* The share that one sample has in all those of its number: one for each pixel of the window. The weight of
   a draw that each sample makes for no pixel in particular, such as a path that starts at a light. */
CRT_FN f32 crt_splat_share(const CrtContext *ctx) {
    return 1.0f / ((f32)ctx->scene->width * (f32)ctx->scene->height);
}

/* Adds to pixel (x, y) of the whole film, as a part of the sample that `film` takes at present. A pixel
   outside the crop window does not belong to this film. The value of a pixel is the sum of its splats over
   the number of samples a pixel. */
CRT_FN void crt_splat(const CrtContext *ctx, const CrtFilmPixel *film, u32 x, u32 y, vec4 xyz) {
    CRT_GLOBAL const CrtScene *scene = ctx->scene;
    const u32 column = x - scene->crop_x, row = y - scene->crop_y; /* huge where x or y is less */
    if (film->splats == 0 || column >= scene->width || row >= scene->height) return;
    const u32 shift = CRT_HAS(REPLICATES) ? scene->replicate_shift : 0u;
    const u32 words = CRT_SPLAT_WORDS(1u << shift);
    CRT_GLOBAL u64 *sums = film->splats + ((u64)row * scene->width + column) * words;
    const f64 scale = scene->splat_scale;
    if (!crt_splat_fits(V4X(xyz), scale) || !crt_splat_fits(V4Y(xyz), scale) ||
        !crt_splat_fits(V4Z(xyz), scale)) {
        (void)crt_atomic_carry(sums + (words - 1u), (u64)1);
        return;
    }
    const u32 replicate = crt_replicate(crt_film_next(film), shift);
    crt_splat_add(sums, (f64)V4X(xyz) * scale);
    crt_splat_add(sums + 2u * CRT_SPLAT_SUM_OF(replicate), (f64)V4Y(xyz) * scale);
    crt_splat_add(sums + 4u, (f64)V4Z(xyz) * scale);
}

CRT_KERNEL_END

#endif
