/*
 * environment_image.h: an image around the scene. Its texels are even in radiance. Light sampling chooses
 * one by its radiance times its solid angle, a row and then a column, and a direction within it; for rays
 * that meet nothing, crt_environment_pdf gives the density of their direction.
 */
#ifndef CRT_ENVIRONMENT_IMAGE_H
#define CRT_ENVIRONMENT_IMAGE_H

#include "kernel/sampling/sampler.h"
#include "kernel/values/value.h"

CRT_KERNEL_BEGIN

CRT_FN CRT_GLOBAL const CrtEnvironmentImage *crt_environment_image(const CrtContext *ctx) {
    return CRT_ARRAY(CrtEnvironmentImage, ctx->blob, ctx->scene->environment_image);
}

/* The place of a direction in the image. */
typedef struct CrtEnvironmentPlace {
    u32 row, column;
    f32 sine; /* of its angle with the image's axis */
} CrtEnvironmentPlace;

/* Of an environment without an image. */
CRT_FN CrtEnvironmentPlace crt_no_place(void) {
    CrtEnvironmentPlace place;
    place.row = place.column = 0u;
    place.sine = 0.0f;
    return place;
}

CRT_FN CrtEnvironmentPlace crt_environment_place(CRT_GLOBAL const CrtEnvironmentImage *image, vec3 d) {
    CrtEnvironmentPlace place;
    const f32 right = dot3(crt_load3(image->right), d);
    const f32 up = dot3(crt_load3(image->up), d);
    const f32 ahead = dot3(crt_load3(image->ahead), d);
    place.sine = crt_sqrt(right * right + ahead * ahead);
    const f32 row = crt_atan2(place.sine, up) * CRT_INV_PI * (f32)image->height;
    const f32 column = (crt_atan2(right, ahead) * (0.5f * CRT_INV_PI) + 0.5f) * (f32)image->width;
    /* Rounding may lead one beyond the last. */
    const u32 r = (u32)row;
    const u32 c = (u32)column;
    place.row = r < image->height ? r : image->height - 1u;
    place.column = c < image->width ? c : image->width - 1u;
    return place;
}

/* Last of the items whose first number is at most u; `first` holds those numbers, ascending. The guide
   (layout.h) leaves few items to search, on average, of any image (Chen and Asau, "On generating random
   variates from an empirical distribution", AIIE Transactions 6, 1974): so few lines of memory are read. */
CRT_FN u32 crt_chosen(CRT_GLOBAL const u32 *first, CRT_GLOBAL const u32 *guide, u32 shift, u32 u) {
    const u32 part = u >> shift;
    u32 index = guide[part];
    /* No branch on what is read: a processor guesses every second one wrong. */
    for (u32 left = guide[part + 1u] - index + 1u; left > 1u; left -= left >> 1)
        index += first[index + (left >> 1)] <= u ? left >> 1 : 0u;
    return index;
}

/* The number of the 2^32 random values that choose an item: less than all, since each item has at least
   one. */
CRT_FN f32 crt_share(CRT_GLOBAL const u32 *first, u32 count, u32 index) {
    const u32 end = index + 1u < count ? first[index + 1u] : 0u;
    return (f32)(end - first[index]);
}

CRT_FN CRT_GLOBAL const u32 *crt_environment_columns(const CrtContext *ctx,
                                                     CRT_GLOBAL const CrtEnvironmentImage *image, u32 row) {
    return CRT_ARRAY(u32, ctx->blob, image->columns) + (u64)row * image->width;
}

CRT_FN CRT_GLOBAL const CrtEnvironmentTexel *crt_environment_texels(
    const CrtContext *ctx, CRT_GLOBAL const CrtEnvironmentImage *image, u32 row) {
    return CRT_ARRAY(CrtEnvironmentTexel, ctx->blob, image->texels) + (u64)row * image->width;
}

/* Begins to bring what is read at a place into a processor's cache. */
CRT_FN void crt_fetch_environment(const CrtContext *ctx, CrtEnvironmentPlace place) {
    CRT_GLOBAL const CrtEnvironmentImage *image = crt_environment_image(ctx);
    CRT_FETCH(crt_environment_texels(ctx, image, place.row) + place.column);
    CRT_FETCH(crt_environment_columns(ctx, image, place.row) + place.column);
}

/* pdf of a direction at `place`, given that the environment is sampled: the texel's probability over its
   extent, 2π² sin θ / (rows · columns) for a direction at θ. */
CRT_FN f32 crt_environment_density(const CrtContext *ctx, CrtEnvironmentPlace place) {
    CRT_GLOBAL const CrtEnvironmentImage *image = crt_environment_image(ctx);
    const f32 scale = 2.3283064365386963e-10f; /* 2^-32 */
    const f32 row =
        crt_share(CRT_ARRAY(u32, ctx->blob, image->rows), image->height, place.row) * scale;
    const f32 column =
        crt_share(crt_environment_columns(ctx, image, place.row), image->width, place.column) * scale;
    const f32 extent = 2.0f * CRT_PI * CRT_PI * crt_max(place.sine, 1e-12f);
    return row * column * ((f32)image->width * (f32)image->height) / extent;
}

/* A direction of the image, and its texel: the one that was chosen, also near an edge, where a look-up
   could round to the neighbour. */
CRT_FN vec3 crt_environment_direction(const CrtContext *ctx, CrtRandom2 u, CrtEnvironmentPlace *place) {
    CRT_GLOBAL const CrtEnvironmentImage *image = crt_environment_image(ctx);
    CRT_GLOBAL const u32 *rows = CRT_ARRAY(u32, ctx->blob, image->rows);
    const u32 u_row = (u32)(u.y * 4294967296.0f);
    const u32 u_column = (u32)(u.x * 4294967296.0f);
    const u32 row = crt_chosen(rows, CRT_ARRAY(u32, ctx->blob, image->row_guide), image->row_shift, u_row);
    CRT_GLOBAL const u32 *columns = crt_environment_columns(ctx, image, row);
    CRT_GLOBAL const u32 *guide = CRT_ARRAY(u32, ctx->blob, image->column_guides) +
                                  (u64)row * ((0xFFFFFFFFu >> image->column_shift) + 2u);
    const u32 column = crt_chosen(columns, guide, image->column_shift, u_column);
    CRT_FETCH(crt_environment_texels(ctx, image, row) + column);
    /* The rest of each number gives the place in the texel. */
    const f32 in_row = (f32)(u_row - rows[row]) / crt_share(rows, image->height, row);
    const f32 in_column = (f32)(u_column - columns[column]) / crt_share(columns, image->width, column);
    const f32 theta = ((f32)row + in_row) * (CRT_PI / (f32)image->height);
    const f32 phi = ((f32)column + in_column) * (2.0f * CRT_PI / (f32)image->width) - CRT_PI;
    f32 cos_theta, cos_phi;
    const f32 sin_theta = crt_sincos(theta, &cos_theta);
    const f32 sin_phi = crt_sincos(phi, &cos_phi);
    const vec3 d = crt_fma3(crt_load3(image->right), sin_theta * sin_phi,
                            crt_fma3(crt_load3(image->up), cos_theta,
                                     crt_load3(image->ahead) * (sin_theta * cos_phi)));
    place->row = row;
    place->column = column;
    place->sine = sin_theta;
    return normalize3(d);
}

/* Radiance of a texel. */
CRT_FN vec4 crt_environment_texel(const CrtContext *ctx, CrtEnvironmentPlace place, vec4 position) {
    CRT_GLOBAL const CrtEnvironmentTexel *texel =
        crt_environment_texels(ctx, crt_environment_image(ctx), place.row) + place.column;
    return crt_sigmoid(texel->c0, texel->c1, texel->c2, position) * texel->scale *
           crt_value(ctx, ctx->scene->environment, 0, position);
}

CRT_KERNEL_END

#endif
