/*
 * wavefront.h: paths advanced by separate kernels for tracing and for shading (Laine, Karras and Aila 2013,
 * "Megakernels Considered Harmful"). A slot takes a share of one pixel's samples, one after another. A pass
 * traces the ray that each slot waits for and sorts the slots by the kind of material that they have met;
 * then each kind is shaded by a kernel that holds that kind alone. Between kernels a path lies in rows of
 * 16 bytes, a row of all slots after another. A slot computes what crt_render_pixel computes, and adds it
 * to the film in the same order. It knows the path tracer alone, which does not splat.
 */
#ifndef CRT_WAVEFRONT_H
#define CRT_WAVEFRONT_H

#include "kernel/schedule/wave_rows.h"

CRT_KERNEL_BEGIN

/* Adds the sample of a path that has ended to the film. */
CRT_FN void crt_wave_add(const CrtContext *ctx, const CrtWave *wave, u32 slot, CrtPixelWork *work) {
    CrtPath *path = &work->path;
    path->radiance = *crt_row(wave, CRT_ROW_RADIANCE, slot);
    path->wavelengths = crt_load_wavelengths(wave, slot);
    if (crt_wave_has_first_hit(ctx)) crt_load_first_hit(wave, slot, path);
    crt_add_sample(ctx, work);
}

/* Adds the sample that has ended, unless this is the first pass, and begins the slot's next one. Returns 0
   when there is none. */
CRT_FN int crt_wave_next_sample(const CrtContext *ctx, const CrtWave *wave, u32 slot, int first_pass) {
    CRT_GLOBAL const CrtScene *scene = ctx->scene;
    const CrtWaveShare share = crt_wave_share(wave, slot);
    const u64 film = (u64)share.slice * scene->width * scene->height;
    if (share.count == 0u) {
        wave->state[slot] = CRT_WAVE_DONE;
        return 0;
    }
    CrtPixelWork work = crt_pixel_begin(
        ctx, share.x, share.y, wave->first_sample + share.first, share.count,
        wave->sums + film * scene->channels * 2u, wave->counts + film,
        wave->primitives != 0 ? wave->primitives + film : 0, 0);
    if (!first_pass) {
        work.film.done = wave->done[slot];
        work.film.valid = wave->valid[slot];
        crt_wave_add(ctx, wave, slot, &work);
    }
    wave->done[slot] = work.film.done;
    wave->valid[slot] = work.film.valid;
    if (work.film.done >= share.count) {
        crt_pixel_end(&work);
        wave->state[slot] = CRT_WAVE_DONE;
        return 0;
    }
    crt_begin_sample(ctx, &work);
    crt_store_begin(ctx, wave, slot, &work.path);
    return 1;
}

/* The hit of a ray that may pass surfaces; *ray then begins behind the last surface that it has passed. For
   scenes without panes: in scenes with panes crt_wave_choose lets rays pass, so that tracing stays short. */
CRT_FN CrtHit crt_trace_passing(const CrtContext *ctx, CrtSampler *sampler, CrtPassage *way, CrtRay *ray) {
    for (;;) {
        CrtHit hit = crt_no_hit(ray->reach);
        if (ray->reach > 0.0f) hit = crt_trace_closest(ctx, *ray);
        if (hit.slot == CRT_NONE || !crt_passes(ctx, hit, sampler, way, ray)) return hit;
    }
}

/* Traces the shadow ray that a slot waits for, and adds its light where nothing stops it. Returns 0 where
   crt_wave_choose has to decide if the ray passes the surface that it meets. */
CRT_FN int crt_wave_resolve_shadow(const CrtContext *ctx, const CrtWave *wave, u32 slot, u32 state,
                                   CrtRayCount *rays) {
    CrtRay ray = crt_load_shadow_ray(wave, slot);
    int blocked = 0;
    if (ray.reach > 0.0f) {
        if ((state & CRT_WAVE_PASSED) == 0u) rays->shadow += 1u;
        if (crt_has_panes(ctx)) {
            CrtPassable met = crt_none_passable(ray.reach);
            blocked = crt_trace_any(ctx, ray, &met);
            if (!blocked && met.count != 0u) {
                crt_store_passable(wave, slot, met);
                if (met.count == 1u) wave->state[slot] = state | CRT_WAVE_LAST;
                return 0;
            }
        } else if (crt_is_passable(ctx)) {
            CrtSampler sampler = crt_load_sampler(ctx, wave, slot);
            CrtPassage way = crt_load_passage(ctx, wave, slot, state);
            blocked = crt_trace_passing(ctx, &sampler, &way, &ray).slot != CRT_NONE;
            crt_store_xorshift(ctx, wave, slot, &sampler);
        } else {
            CrtPassable none = crt_none_passable(ray.reach);
            blocked = crt_trace_any(ctx, ray, &none);
        }
    }
    CRT_GLOBAL vec4 *radiance = crt_row(wave, CRT_ROW_RADIANCE, slot);
    if (!blocked) *radiance = *radiance + *crt_row(wave, CRT_ROW_SHADOW_RADIANCE, slot);
    return 1;
}

/* Traces the ray of the slot's path to its next vertex, or to a surface that it may pass. */
CRT_FN CrtHit crt_wave_closest(const CrtContext *ctx, const CrtWave *wave, u32 slot, u32 state,
                               CrtRayCount *rays) {
    CrtRay ray = crt_load_path_ray(wave, slot);
    const vec3 o = ray.o;
    CrtHit hit;
    if ((state & CRT_WAVE_PASSED) != 0u) ray.o = crt_row_vector(*crt_row(wave, CRT_ROW_PASSED, slot));
    else rays->closest += 1u;
    if (crt_is_passable(ctx) && !crt_has_panes(ctx)) {
        CrtSampler sampler = crt_load_sampler(ctx, wave, slot);
        CrtPassage way = crt_load_passage(ctx, wave, slot, state);
        hit = crt_trace_passing(ctx, &sampler, &way, &ray);
        crt_store_xorshift(ctx, wave, slot, &sampler);
    } else {
        hit = crt_trace_closest(ctx, ray);
    }
    /* From where the path's ray began. */
    if (crt_is_passable(ctx)) hit.t = hit.t + dot3(ray.o - o, ray.d);
    crt_store_hit(wave, slot, hit);
    return hit;
}

CRT_FN u32 crt_queue_of_material(const CrtContext *ctx, const CrtWave *wave, u32 material) {
    return wave->queue_of_kind[CRT_ARRAY(CrtMaterial, ctx->blob, ctx->scene->materials)[material].type];
}

/* The queue for what a path's ray has met: that of its material, or that of crt_wave_choose. */
CRT_FN u32 crt_queue_of(const CrtContext *ctx, const CrtWave *wave, CrtHit hit) {
    CRT_GLOBAL const CrtScene *scene = ctx->scene;
    if (hit.slot == CRT_NONE) return wave->queue_of_miss;
    const u32 material =
        CRT_ARRAY(CrtPrimitive, ctx->blob, scene->primitives)[crt_primitive_of(ctx, hit)].material;
    if (crt_has_panes(ctx) && crt_may_pass(ctx, hit)) return wave->queue_of_choice;
    if (CRT_HAS(MIX) && scene->compositions.count != 0u &&
        crt_compositions(ctx)[material].kind != CRT_COMPOSED_PLAIN)
        return wave->queue_of_choice;
    return crt_queue_of_material(ctx, wave, material);
}

/* One slot in one pass: its shadow ray, then the ray of its path or, where that has ended, of its next
   sample. Returns the queue that it belongs to, or CRT_NONE. *finished: its last sample is done. */
CRT_FN u32 crt_wave_trace(const CrtContext *ctx, const CrtWave *wave, u32 slot, int first_pass,
                          CrtRayCount *rays, u32 *finished) {
    u32 state = first_pass ? CRT_WAVE_ENDED : wave->state[slot];
    if ((state & CRT_WAVE_DONE) != 0u) return CRT_NONE;
    if ((state & CRT_WAVE_SHADOW) != 0u) {
        if (!crt_wave_resolve_shadow(ctx, wave, slot, state, rays)) return wave->queue_of_choice;
        state &= CRT_WAVE_ENDED;
    }
    if ((state & CRT_WAVE_ENDED) != 0u) {
        if (!crt_wave_next_sample(ctx, wave, slot, first_pass)) {
            *finished = 1u;
            return CRT_NONE;
        }
        state = 0u;
    }
    const u32 queue = crt_queue_of(ctx, wave, crt_wave_closest(ctx, wave, slot, state, rays));
    if (queue == CRT_NONE) wave->state[slot] = CRT_WAVE_ENDED;
    else if (crt_has_panes(ctx)) wave->state[slot] = state; /* crt_wave_choose reads it */
    return queue;
}

/* True if the slot's ray passes the surface that it has met. The next pass then traces it on from behind
   that surface. A shadow ray is finished if it is stopped or has passed the last surface. */
CRT_FN int crt_wave_passes(const CrtContext *ctx, const CrtWave *wave, u32 slot) {
    const u32 state = wave->state[slot];
    const int shadow = (state & CRT_WAVE_SHADOW) != 0u;
    CrtSampler sampler = crt_load_sampler(ctx, wave, slot);
    CrtPassage way = crt_load_passage(ctx, wave, slot, state);
    CrtRay ray = shadow ? crt_load_shadow_ray(wave, slot) : crt_load_path_ray(wave, slot);
    if (!shadow && (state & CRT_WAVE_PASSED) != 0u)
        ray.o = crt_row_vector(*crt_row(wave, CRT_ROW_PASSED, slot));
    CrtHit hit = crt_load_hit(wave, slot);
    if (shadow) hit = crt_hit_of_slot(ctx, ray, hit.slot, hit.instance); /* crt_store_passable */
    const int passes = crt_passes(ctx, hit, &sampler, &way, &ray);
    crt_store_xorshift(ctx, wave, slot, &sampler);
    const int last = (state & CRT_WAVE_LAST) != 0u;
    wave->state[slot] = passes && !last ? state | CRT_WAVE_PASSED : state & CRT_WAVE_ENDED;
    if (shadow && last) {
        CRT_GLOBAL vec4 *radiance = crt_row(wave, CRT_ROW_RADIANCE, slot);
        if (passes) *radiance = *radiance + way.carried;
        return 1;
    }
    if (shadow) {
        *crt_row(wave, CRT_ROW_SHADOW_RADIANCE, slot) = way.carried;
        *crt_row(wave, CRT_ROW_SHADOW_ORIGIN, slot) = crt_row_of(ray.o, ray.reach);
        *crt_row(wave, CRT_ROW_SHADOW_DIRECTION, slot) = crt_row_of(ray.d, crt_from_bits(way.media));
    } else {
        *crt_row(wave, CRT_ROW_THROUGHPUT, slot) = way.carried;
        CRT_GLOBAL vec4 *ids = crt_row(wave, CRT_ROW_HIT_IDS, slot);
        *ids = make_vec4(V4X(*ids), V4Y(*ids), crt_from_bits(way.material), 0.0f);
        if (way.panes != 0u) crt_store_panes(wave, slot, way.panes);
    }
    if (passes)
        *crt_row(wave, CRT_ROW_PASSED, slot) = crt_row_of(shadow ? way.d : ray.o, crt_from_bits(way.passed));
    return passes || shadow;
}

/* The queue of the material that the slot's path finds: crt_shade will find the same one. CRT_NONE where a
   ray is traced on. */
CRT_FN u32 crt_wave_choose(const CrtContext *ctx, const CrtWave *wave, u32 slot) {
    if (crt_has_panes(ctx)) {
        if (crt_wave_passes(ctx, wave, slot)) return CRT_NONE;
        const u32 met = crt_bits(V4Z(*crt_row(wave, CRT_ROW_HIT_IDS, slot)));
        if (met != CRT_NONE) return crt_queue_of_material(ctx, wave, met);
    }
    const CrtSurface surface = crt_surface(ctx, crt_load_hit(wave, slot));
    CrtSampler sampler = crt_load_sampler(ctx, wave, slot);
    const u32 dimension = crt_vertex_dimension(crt_load_depth(wave, slot));
    const u32 material = crt_chosen_material(ctx, &surface, crt_load_path_ray(wave, slot).d, &sampler,
                                             dimension + CRT_DIM_MIX);
    return crt_queue_of_material(ctx, wave, material);
}

/* Shades what the slot's path has met. */
CRT_FN void crt_wave_shade(const CrtContext *ctx, const CrtWave *wave, u32 slot) {
    CrtPath path;
    CrtShadow shadow;
    crt_load_path(ctx, wave, slot, &path);
    path.radiance_row = crt_row(wave, CRT_ROW_RADIANCE, slot);
    const CrtHit hit = crt_load_hit(wave, slot);
    const int first = crt_wave_has_first_hit(ctx) && path.depth == 0u && hit.slot != CRT_NONE;
    const int alive = crt_shade(ctx, &path, hit, &shadow);
    u32 state = alive ? 0u : CRT_WAVE_ENDED;
    if (alive) crt_store_vertex(ctx, wave, slot, &path);
    if (first) crt_store_first_hit(wave, slot, &path);
    if (CRT_HAS(NEE) && shadow.pending) {
        state |= CRT_WAVE_SHADOW;
        *crt_row(wave, CRT_ROW_SHADOW_ORIGIN, slot) = crt_row_of(shadow.ray.o, shadow.ray.reach);
        *crt_row(wave, CRT_ROW_SHADOW_DIRECTION, slot) =
            crt_row_of(shadow.ray.d, crt_from_bits(CRT_HAS(MEDIA) ? shadow.media : 0u));
        *crt_row(wave, CRT_ROW_SHADOW_RADIANCE, slot) = shadow.radiance;
        /* The shadow ray takes the generator's numbers that follow those of the vertex. */
        if ((CRT_HAS(OPACITY) || CRT_HAS(MIX)) && !alive) crt_store_xorshift(ctx, wave, slot, &path.sampler);
    }
    wave->state[slot] = state;
}

CRT_KERNEL_END

#endif
