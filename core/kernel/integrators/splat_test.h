/*
 * splat_test.h: a test of films that take splats, whose image is known. A sample throws one splat onto a
 * pixel of the whole film that its random numbers choose; it measures nothing. The image is a ramp: pixel
 * (x, y) of a film of w × h pixels is expected to be X = (x + 1) / w, Y = (y + 1) / h, Z = 1, in any crop
 * window.
 */
#ifndef CRT_SPLAT_TEST_H
#define CRT_SPLAT_TEST_H

#include "kernel/film/splat.h"
#include "kernel/integrators/path.h"

CRT_KERNEL_BEGIN

CRT_FN int crt_splat_test_advance(const CrtContext *ctx, CrtPath *path, const CrtFilmPixel *film,
                                  CrtRayCount *rays) {
    (void)rays;
    const f32 width = (f32)ctx->scene->film_width, height = (f32)ctx->scene->film_height;
    const CrtRandom2 u = crt_sample_2d(&path->sampler, CRT_DIM_VERTEX);
    const f32 x = crt_floor(u.x * width), y = crt_floor(u.y * height);
    const vec4 xyz = make_vec4((x + 1.0f) / width, (y + 1.0f) / height, 1.0f, 0.0f);
    /* Over the probability of the pixel. */
    crt_splat(ctx, film, (u32)x, (u32)y, xyz * (width * height * crt_splat_share(ctx)));
    return 0;
}

CRT_FN vec4 crt_splat_test_end(const CrtContext *ctx, const CrtPath *path) {
    (void)ctx;
    (void)path;
    return splat4(0.0f);
}

CRT_KERNEL_END

#endif
