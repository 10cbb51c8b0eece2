/*
 * continuation.h: how a path goes on from a vertex: scattering, and Russian roulette.
 */
#ifndef CRT_CONTINUATION_H
#define CRT_CONTINUATION_H

#include "kernel/transport/direct_light.h"

CRT_KERNEL_BEGIN

/* Scatters the path: its ray, throughput and densities become those of the way to its next vertex. Returns 0
   where it is absorbed. */
CRT_FN int crt_continue(const CrtContext *ctx, CrtPath *path, const CrtVertex *vertex, u32 dimension) {
    const CrtSurface *surface = &vertex->surface;
    const CrtRandom2 u = crt_sample_2d(&path->sampler, dimension + CRT_DIM_BSDF);
    CrtRandom2 choice = u;
    if (crt_vertex_chooses(vertex)) choice = crt_sample_2d(&path->sampler, dimension + CRT_DIM_CHOICE);
    const CrtScatter scatter =
        crt_vertex_sample(vertex, u, choice, path->hero, path->hero_only, CRT_RADIANCE);
    if (!scatter.valid) return 0;

    path->throughput = path->throughput * scatter.weight;
    if (CRT_HAS(DISPERSION) && scatter.hero_only) {
        path->throughput = path->throughput * path->hero * 4.0f;
        path->hero_only = 1;
    }
    path->eta_square = path->eta_square * scatter.eta_square;
    path->scatter_pdf = scatter.pdf;
    path->scatter_cosine = crt_scatter_cosine(&vertex->bsdf, scatter.wi);
    path->p = surface->p;
    if (CRT_HAS(LIGHT_TREE)) path->side = crt_scattering_side(vertex);
    if (CRT_HAS(MEDIA)) path->media = crt_vertex_media(ctx, vertex, scatter.wi, path->media);
    path->ray.o = crt_offset_origin(surface->p, surface->clearance, surface->ng, scatter.wi);
    path->ray.d = scatter.wi;
    path->ray.reach = CRT_INFINITY;
    path->depth += 1u;
    return 1;
}

/* Russian roulette on the spectral maximum, after `roulette_depth` events and panes. Returns 0 where the
   path ends; a path that carries no light always ends. */
CRT_FN int crt_roulette(const CrtContext *ctx, CrtPath *path, u32 dimension) {
    const f32 carried = max4(path->throughput) * path->eta_square;
    if (!(carried > 0.0f)) return 0;
    if (path->depth + path->panes >= ctx->scene->roulette_depth && carried < 1.0f) {
        const f32 survive = crt_max(carried, 0.05f);
        if (!(crt_sample_1d(&path->sampler, dimension + CRT_DIM_ROULETTE) < survive)) return 0;
        path->throughput = path->throughput / survive;
    }
    return 1;
}

CRT_KERNEL_END

#endif
