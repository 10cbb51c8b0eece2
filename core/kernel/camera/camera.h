/*
 * camera.h: film point → ray. Perspective, pinhole or thin lens; pixel filters by importance sampling
 * (Ernst et al. 2006), so a sample belongs to one pixel and has weight 1.
 */
#ifndef CRT_CAMERA_H
#define CRT_CAMERA_H

#include "kernel/dialect/context.h"
#include "kernel/geometry/ray.h"
#include "kernel/sampling/warp.h"

CRT_KERNEL_BEGIN

/* Offset from the pixel centre of the uniform number u, increasing. The share of the filter that is farther
   from the middle, `beyond`, finds its cell by exponent and leading bits, so that cells are as fine in the
   tail, where a factor of two is a small way, as in the middle. A share too small for a number of 24 bits
   takes the last node. */
CRT_FN f32 crt_filter_offset(const CrtContext *ctx, f32 u) {
    CRT_GLOBAL const f32 *table = CRT_ARRAY(f32, ctx->blob, ctx->scene->filter);
    const f32 beyond = 2.0f * (u < 0.5f ? u : 1.0f - u);
    const u32 a_cell = 0x00800000u / CRT_FILTER_STEPS; /* steps of a float's bits */
    const u32 steps = crt_bits(1.0f) - crt_bits(beyond);
    const u32 cell = steps / a_cell;
    f32 offset = table[CRT_FILTER_TABLE];
    if (cell < CRT_FILTER_TABLE)
        offset =
            table[cell] + (f32)(steps % a_cell) * (1.0f / (f32)a_cell) * (table[cell + 1u] - table[cell]);
    return u < 0.5f ? -offset : offset;
}

/* Ray of a pixel in whole-film coordinates; unit direction. */
CRT_FN CrtRay crt_camera_ray(const CrtContext *ctx, CrtSampler *sampler, u32 pixel_x, u32 pixel_y) {
    CRT_GLOBAL const CrtCamera *camera = &ctx->scene->camera;
    const CrtRandom2 u = crt_sample_2d(sampler, CRT_DIM_FILM);
    f32 dx = u.x;
    f32 dy = u.y;
    if (CRT_HAS(FILTER) && ctx->scene->filter.count != 0u) {
        dx = 0.5f + crt_filter_offset(ctx, u.x);
        dy = 0.5f + crt_filter_offset(ctx, u.y);
    }
    CrtRay ray;
    ray.o = crt_load3(camera->origin);
    ray.d = crt_fma3(crt_load3(camera->step_x), (f32)pixel_x + dx,
                     crt_fma3(crt_load3(camera->step_y), (f32)pixel_y + dy, crt_load3(camera->corner)));
    if (CRT_HAS(LENS) && camera->lens_radius > 0.0f) {
        const CrtRandom2 lens = crt_concentric_disk(crt_sample_2d(sampler, CRT_DIM_LENS));
        const vec3 shift =
            (crt_load3(camera->lens_x) * lens.x + crt_load3(camera->lens_y) * lens.y) * camera->lens_radius;
        ray.d = ray.d * camera->focus_distance - shift;
        ray.o = ray.o + shift;
    }
    ray.d = normalize3(ray.d);
    ray.reach = CRT_INFINITY;
    return ray;
}

CRT_KERNEL_END

#endif
