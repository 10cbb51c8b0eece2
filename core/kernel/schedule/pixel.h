/*
 * pixel.h: the plain schedule, which every backend has: one loop over the vertices of one sample after
 * another of one pixel.
 */
#ifndef CRT_PIXEL_H
#define CRT_PIXEL_H

#include "kernel/film/film.h"
#include "kernel/integrators/integrator.h"

CRT_KERNEL_BEGIN

/* A pixel of the crop window, some of whose samples are being taken. */
typedef struct CrtPixelWork {
    u32 x, y;
    u32 sample_count;
    int alive; /* `path` has not ended */
    CrtFilmPixel film;
    CrtPath path;
} CrtPixelWork;

/* `sums`, `counts`, `primitives` and `splats` as crt_film_pixel takes them. */
CRT_FN CrtPixelWork crt_pixel_begin(const CrtContext *ctx, u32 x, u32 y, u64 first_sample, u32 sample_count,
                                    CRT_GLOBAL f64 *sums, CRT_GLOBAL u64 *counts,
                                    CRT_GLOBAL u32 *primitives, CRT_GLOBAL u64 *splats) {
    CrtPixelWork work;
    work.x = x;
    work.y = y;
    work.sample_count = sample_count;
    work.alive = 0;
    work.film = crt_film_pixel(ctx, x, y, first_sample, sums, counts, primitives, splats);
    return work;
}

/* Adds the sample whose path has ended. */
CRT_FN void crt_add_sample(const CrtContext *ctx, CrtPixelWork *work) {
    const vec4 xyz = crt_integrator_end(ctx, &work->path);
    crt_film_add_sample(ctx, &work->film, xyz, work->path.radiance, work->path.wavelengths,
                        &work->path.first);
}

/* Begins the pixel's next sample. */
CRT_FN void crt_begin_sample(const CrtContext *ctx, CrtPixelWork *work) {
    crt_path_begin(ctx, &work->path, work->x, work->y, crt_film_next(&work->film));
}

/* Takes the pixel one vertex further, into its next sample where a path has ended. Returns 0 when the last
 * sample is done. */
CRT_FN int crt_pixel_vertex(const CrtContext *ctx, CrtPixelWork *work, CrtRayCount *rays) {
    if (work->film.done >= work->sample_count) return 0;
    if (!work->alive) crt_begin_sample(ctx, work);
    work->alive = crt_integrator_advance(ctx, &work->path, &work->film, rays);
    if (!work->alive) crt_add_sample(ctx, work);
    return 1;
}

CRT_FN void crt_pixel_end(CrtPixelWork *work) { crt_film_end(&work->film); }

/* ADDS samples [first_sample, first_sample + sample_count) of pixel (x, y) of the crop window to the film,
   and rays to *rays. On a GPU a lane whose path has ended either waits for the others of its warp, whose
   next camera rays then go the same way through the tree; or, where there is no tree and all rays cost the
   same, it begins its next sample at once, in one flat loop over the vertices of all samples (measured:
   docs/decisions/0039-what-a-lane-does-when-its-path-ends.md). */
CRT_FN void crt_render_pixel(const CrtContext *ctx, u32 x, u32 y, u64 first_sample, u32 sample_count,
                             CRT_GLOBAL f64 *sums, CRT_GLOBAL u64 *counts, CRT_GLOBAL u32 *primitives,
                             CRT_GLOBAL u64 *splats, CrtRayCount *rays) {
    CrtPixelWork work =
        crt_pixel_begin(ctx, x, y, first_sample, sample_count, sums, counts, primitives, splats);
    const int waits = CRT_HAS(VIEW) ? 0 : CRT_HAS(BVH);
    if (waits) {
        while (work.film.done < work.sample_count) {
            crt_begin_sample(ctx, &work);
            while (crt_integrator_advance(ctx, &work.path, &work.film, rays)) continue;
            crt_add_sample(ctx, &work);
        }
    } else {
        while (crt_pixel_vertex(ctx, &work, rays)) continue;
    }
    crt_pixel_end(&work);
}

CRT_KERNEL_END

#endif
