/*
 * film.h: a sample → the channels of its pixel. Sums are pairs of doubles, hi + lo, so that the order of
 * samples does not show.
 */
#ifndef CRT_FILM_H
#define CRT_FILM_H

#include "kernel/sampling/sampler.h"
#include "kernel/sampling/spectrum.h"

CRT_KERNEL_BEGIN

/* The AOVs of the first surface that a path meets. */
typedef struct CrtFirstHit {
    vec4 albedo; /* at the path's wavelengths */
    vec3 normal;
    f32 depth;   /* along the ray, scene units; 0 where nothing is hit */
    u32 primitive;
} CrtFirstHit;

/* A pixel of the crop window, and which of its samples have been added. Their sums go to its place in the
   film. */
typedef struct CrtFilmPixel {
    u64 first_sample;
    u32 done, valid;           /* samples: so far; and of these, finite ones */
    CRT_GLOBAL f64 *pairs;     /* the pixel's channels */
    CRT_GLOBAL u64 *count;
    CRT_GLOBAL u32 *primitive; /* may be null */
    CRT_GLOBAL u64 *splats;    /* of all pixels (splat.h); may be null */
} CrtFilmPixel;

/* `sums`, `counts`, `primitives` and `splats` as in CrtFilmView, for the whole film; `primitives` and
   `splats` may be null. */
CRT_FN CrtFilmPixel crt_film_pixel(const CrtContext *ctx, u32 x, u32 y, u64 first_sample,
                                   CRT_GLOBAL f64 *sums, CRT_GLOBAL u64 *counts,
                                   CRT_GLOBAL u32 *primitives, CRT_GLOBAL u64 *splats) {
    const u64 index = (u64)y * ctx->scene->width + x;
    CrtFilmPixel pixel;
    pixel.first_sample = first_sample;
    pixel.done = pixel.valid = 0u;
    pixel.pairs = sums + index * ctx->scene->channels * 2u;
    pixel.count = counts + index;
    pixel.primitive = primitives;
    if (primitives != 0) pixel.primitive += index;
    pixel.splats = splats;
    return pixel;
}

/* The number of the sample that is to be added next. */
CRT_FN u64 crt_film_next(const CrtFilmPixel *pixel) { return pixel->first_sample + pixel->done; }

/* All samples have been added. */
CRT_FN void crt_film_end(CrtFilmPixel *pixel) { *pixel->count += pixel->valid; }

CRT_FN void crt_film_add(CRT_GLOBAL f64 *pair, f64 value) {
    CrtSum sum;
    sum.hi = pair[0];
    sum.lo = pair[1];
    sum = crt_sum_add(sum, value);
    pair[0] = sum.hi;
    pair[1] = sum.lo;
}

CRT_FN void crt_film_add_vector(CRT_GLOBAL f64 *pairs, u32 width, vec4 value) {
    crt_film_add(pairs, (f64)V4X(value));
    if (width > 1u) crt_film_add(pairs + 2, (f64)V4Y(value));
    if (width > 2u) crt_film_add(pairs + 4, (f64)V4Z(value));
    if (width > 3u) crt_film_add(pairs + 6, (f64)V4W(value));
}

/* The value of each AOV of the first hit: as many components as the AOV has channels. */
CRT_FN vec4 crt_first_hit_albedo(const CrtContext *ctx, const CrtFirstHit *first,
                                 CrtWavelengths wavelengths) {
    return crt_to_xyz(ctx, wavelengths, first->albedo);
}
CRT_FN vec4 crt_first_hit_normal(const CrtContext *ctx, const CrtFirstHit *first,
                                 CrtWavelengths wavelengths) {
    (void)ctx;
    (void)wavelengths;
    return make_vec4(V3X(first->normal), V3Y(first->normal), V3Z(first->normal), 0.0f);
}
CRT_FN vec4 crt_first_hit_depth(const CrtContext *ctx, const CrtFirstHit *first,
                                CrtWavelengths wavelengths) {
    (void)ctx;
    (void)wavelengths;
    return splat4(first->depth);
}

/* Adds the AOV channels of one sample to the pixel's pairs. */
#define CRT_ADD_CHANNEL_FIRST_HIT(stem, width)                               \
    if (scene->stem##_channel != 0u)                                         \
        crt_film_add_vector(pairs + 2u * scene->stem##_channel, width,       \
                            crt_first_hit_##stem(ctx, first, wavelengths));
#define CRT_ADD_CHANNEL_SAMPLES(stem, width) /* crt_film_add_sample */
#define CRT_ADD_CHANNEL(bit, NAME, Name, stem, width, SOURCE, name, exr) \
    CRT_ADD_CHANNEL_##SOURCE(stem, width)
CRT_FN void crt_film_add_aovs(const CrtContext *ctx, const CrtFirstHit *first, CrtWavelengths wavelengths,
                              CRT_GLOBAL f64 *pairs) {
    CRT_GLOBAL const CrtScene *scene = ctx->scene;
    CRT_CHANNEL_LIST(CRT_ADD_CHANNEL)
}

/* Adds one sample to the bins and the responses of a spectral film: the radiance at its four wavelengths
   over the density of each. */
CRT_FN void crt_film_add_spectrum(const CrtContext *ctx, vec4 radiance, CrtWavelengths wavelengths,
                                  CRT_GLOBAL f64 *pixel) {
    CRT_GLOBAL const CrtSpectralFilm *film =
        CRT_ARRAY(CrtSpectralFilm, ctx->blob, ctx->scene->spectral_film);
    const vec4 position = wavelengths.position;
    vec4 inverse_pdf;
    (void)crt_four_wavelengths(ctx, wavelengths.u, &inverse_pdf);
    const vec4 integral = radiance * inverse_pdf;
    CRT_GLOBAL f64 *pairs = pixel + 2u * film->channel;
    CRT_ROLLED for (u32 lane = 0u; lane < 4u; ++lane) {
        const f32 bin = (crt_lane(position, lane) - film->first) * film->per_nm;
        if (bin >= 0.0f && bin < (f32)film->bins)
            crt_film_add(pairs + 2u * (u32)bin, (f64)crt_lane(integral, lane) * (f64)film->per_nm);
    }
    pairs += 2u * film->bins;
    CRT_GLOBAL const f32 *table = CRT_ARRAY(f32, ctx->blob, film->responses);
    CRT_ROLLED for (u32 k = 0u; k < film->responses.count; ++k)
        crt_film_add(pairs + 2u * k,
                     (f64)sum4(crt_lookup4(table + k * CRT_SPECTRUM_STRIDE, position) * integral));
}

/* Adds the next sample: its colour, and its other channels. A sample that is not finite is not counted
   either. */
CRT_FN void crt_film_add_sample(const CrtContext *ctx, CrtFilmPixel *pixel, vec4 xyz, vec4 radiance,
                                CrtWavelengths wavelengths, const CrtFirstHit *first) {
    CRT_GLOBAL const CrtScene *scene = ctx->scene;
    CRT_GLOBAL f64 *pairs = pixel->pairs;
    if (crt_is_finite(V4X(xyz)) && crt_is_finite(V4Y(xyz)) && crt_is_finite(V4Z(xyz))) {
        const f64 luminance = (f64)V4Y(xyz);
        crt_film_add(pairs + 0, (f64)V4X(xyz));
        crt_film_add(pairs + 2, luminance);
        crt_film_add(pairs + 4, (f64)V4Z(xyz));
        if (scene->square_channel != 0u)
            crt_film_add(pairs + 2u * scene->square_channel, luminance * luminance);
        if (CRT_HAS(REPLICATES) && scene->replicate_shift != 0u) {
            const u32 replicate = crt_replicate(crt_film_next(pixel), scene->replicate_shift);
            const u32 stored = (1u << scene->replicate_shift) - 1u;
            if (replicate < stored) {
                crt_film_add(pairs + 2u * (scene->replicate_channel + replicate), luminance);
                if (CRT_HAS(AOV) && (scene->aovs & CRT_AOV_COLOR_ERROR) != 0u) {
                    CRT_GLOBAL f64 *others =
                        pairs + 2u * (scene->replicate_channel + stored + 2u * replicate);
                    crt_film_add(others, (f64)V4X(xyz));
                    crt_film_add(others + 2, (f64)V4Z(xyz));
                }
            }
        }
        if (CRT_HAS(AOV)) {
            if (scene->channels > CRT_CHANNELS_BASE) crt_film_add_aovs(ctx, first, wavelengths, pairs);
            if (pixel->primitive != 0 && pixel->valid == 0u && *pixel->count == 0u)
                *pixel->primitive = first->primitive;
        }
        if (CRT_HAS(SPECTRAL_FILM) && scene->spectral_film.count != 0u)
            crt_film_add_spectrum(ctx, radiance, wavelengths, pairs);
        pixel->valid += 1u;
    }
    pixel->done += 1u;
}

CRT_KERNEL_END

#endif
