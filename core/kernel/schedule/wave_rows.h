/*
 * wave_rows.h: where a path lies between the kernels of a wave (wavefront.h). A slot takes a share of one
 * pixel's samples, one after another. Its path lies in rows of 16 bytes, a row of all slots after another,
 * so that neighbouring threads read neighbouring places.
 */
#ifndef CRT_WAVE_ROWS_H
#define CRT_WAVE_ROWS_H

#include "kernel/schedule/pixel.h"

CRT_KERNEL_BEGIN

#define CRT_WAVE_BLOCK 128u /* slots of 16 × 8 pixels, as warps of 8 × 4 */
#define CRT_WAVE_BLOCK_WIDTH 16u
#define CRT_WAVE_BLOCK_HEIGHT 8u
#define CRT_WAVE_QUEUES 16u /* at most: one a kind of material, one of misses, one of choices */

/* State of a slot. None: its path goes on from a vertex. */
#define CRT_WAVE_DONE 1u  /* its samples are taken, or it has none */
#define CRT_WAVE_ENDED 2u /* its path has ended */
#define CRT_WAVE_SHADOW 4u /* it waits for a shadow ray */
#define CRT_WAVE_PASSED 8u /* the ray that it waits for goes on behind a surface that it has passed */
#define CRT_WAVE_LAST 16u /* behind the surface that its shadow ray meets there is no other */

/* Rows of a slot: what it waits for, then the state of its path. */
#define CRT_ROW_NUMBER(ROW, DECLARATIONS, LANES) CRT_ROW_##ROW,
enum CrtWaveRow {
    CRT_ROW_HIT,              /* t, b1, b2, slot of the scene */
    CRT_ROW_HIT_IDS,          /* primitive, instance, material of a mix */
    CRT_ROW_SHADOW_ORIGIN,    /* and reach */
    CRT_ROW_SHADOW_DIRECTION, /* and the media around it */
    CRT_ROW_SHADOW_RADIANCE,
    CRT_PATH_STATE(CRT_ROW_NUMBER, CRT_ROW_NUMBER, CRT_ROW_NUMBER, CRT_ROW_NUMBER)
    /* Where there are panes: the origin of a path's ray behind what it has passed, or the first direction of
       a shadow ray; and how many surfaces it has passed. */
    CRT_ROW_PASSED
};

/* The number of rows of a scene's slots. */
CRT_FN u32 crt_wave_rows(u64 features) {
    if (CRT_IN_MASK(features, THIN_DIELECTRIC)) return CRT_ROW_PASSED + 1u;
    if (CRT_IN_MASK(features, AOV)) return CRT_ROW_PRIMITIVE + 1u;
    if (CRT_IN_MASK(features, LIGHT_TREE)) return CRT_ROW_SIDE + 1u;
    return CRT_ROW_SIDE;
}

/* A launch: samples of the pixels [x0, x1) × [y0, y1), from first_sample on, and where slots are kept. */
typedef struct CrtWave {
    u32 x0, y0, x1, y1;
    u64 first_sample;
    u32 slices;           /* each adds to a separate film */
    u32 slice_samples;    /* of a slice: the host divides, so that no slot does */
    u32 longer_slices;    /* the first ones, which have one sample more */
    u32 blocks_per_slice;
    u32 slots;            /* slices · blocks_per_slice · CRT_WAVE_BLOCK */
    CRT_GLOBAL vec4 *rows;
    CRT_GLOBAL u32 *state, *done, *valid; /* of each slot; its samples, and the finite ones */
    CRT_GLOBAL u32 *queued;   /* the slots of each queue, in places for all slots */
    CRT_GLOBAL u32 *lengths;  /* CRT_WAVE_QUEUES of even passes, then those of odd ones */
    CRT_GLOBAL u32 *finished; /* how many slots are done */
    CRT_GLOBAL f64 *sums;     /* as crt_render_pixel takes them, a film after another for the slices */
    CRT_GLOBAL u64 *counts;
    CRT_GLOBAL u32 *primitives;
    CRT_GLOBAL u64 *rays;     /* pairs of counters */
    u32 queue_of_kind[CRT_MATERIAL_NUMBERS]; /* by CRT_MATERIAL_… */
    u32 queue_of_choice;      /* whose slots go on to other queues, or are traced on (crt_wave_choose) */
    u32 queue_of_miss;        /* CRT_NONE: nothing shines there */
} CrtWave;
CRT_ASSERT_SIZE(CrtWave, 400);

/* Words of 4 bytes that slots and queues take besides the rows. */
#define CRT_WAVE_WORDS(slots, queues) ((slots) * (3u + (queues)) + 2u * CRT_WAVE_QUEUES + 1u)

/* Divides the samples between the slices. The host calls this. */
CRT_FN void crt_wave_divide(CrtWave *wave, u32 sample_count, u32 slices) {
    wave->slices = slices;
    wave->slice_samples = sample_count / slices;
    wave->longer_slices = sample_count % slices;
}

/* Sets the number of slots for the wave's pixels and slices, and where each of their arrays begins. The
   host calls this. */
CRT_FN void crt_wave_lay_out(CrtWave *wave, u32 queues, CRT_GLOBAL vec4 *rows, CRT_GLOBAL u32 *words) {
    const u32 across = (wave->x1 - wave->x0 + CRT_WAVE_BLOCK_WIDTH - 1u) / CRT_WAVE_BLOCK_WIDTH;
    const u32 down = (wave->y1 - wave->y0 + CRT_WAVE_BLOCK_HEIGHT - 1u) / CRT_WAVE_BLOCK_HEIGHT;
    wave->blocks_per_slice = across * down;
    wave->slots = wave->blocks_per_slice * wave->slices * CRT_WAVE_BLOCK;
    wave->rows = rows;
    wave->state = words;
    wave->done = wave->state + wave->slots;
    wave->valid = wave->done + wave->slots;
    wave->queued = wave->valid + wave->slots;
    wave->lengths = wave->queued + (u64)queues * wave->slots;
    wave->finished = wave->lengths + 2u * CRT_WAVE_QUEUES;
}

/* The pixel and the samples of a slot. */
typedef struct CrtWaveShare {
    u32 x, y, slice;
    u32 first, count; /* samples, from the launch's first */
} CrtWaveShare;

CRT_FN CrtWaveShare crt_wave_share(const CrtWave *wave, u32 slot) {
    const u32 block = slot / CRT_WAVE_BLOCK, thread = slot % CRT_WAVE_BLOCK;
    const u32 warp = thread / 32u, lane = thread % 32u;
    const u32 across = (wave->x1 - wave->x0 + CRT_WAVE_BLOCK_WIDTH - 1u) / CRT_WAVE_BLOCK_WIDTH;
    const u32 tile = block % wave->blocks_per_slice;
    CrtWaveShare share;
    share.slice = block / wave->blocks_per_slice;
    share.x = wave->x0 + (tile % across) * CRT_WAVE_BLOCK_WIDTH + (warp % 2u) * 8u + lane % 8u;
    share.y = wave->y0 + (tile / across) * CRT_WAVE_BLOCK_HEIGHT + (warp / 2u) * 4u + lane / 8u;
    share.first = share.slice * wave->slice_samples +
                  (share.slice < wave->longer_slices ? share.slice : wave->longer_slices);
    share.count = share.x < wave->x1 && share.y < wave->y1
                      ? wave->slice_samples + (share.slice < wave->longer_slices ? 1u : 0u)
                      : 0u;
    return share;
}

/* The number of slots in a queue of this pass. */
CRT_FN CRT_GLOBAL u32 *crt_queue_length(const CrtWave *wave, u32 pass, u32 queue) {
    return wave->lengths + ((pass & 1u) * CRT_WAVE_QUEUES + queue);
}

CRT_FN CRT_GLOBAL vec4 *crt_row(const CrtWave *wave, u32 row, u32 slot) {
    return wave->rows + ((u64)row * wave->slots + slot);
}
CRT_FN vec4 crt_row_of(vec3 v, f32 w) { return make_vec4(V3X(v), V3Y(v), V3Z(v), w); }
CRT_FN vec3 crt_row_vector(vec4 row) { return make_vec3(V4X(row), V4Y(row), V4Z(row)); }

/* True if the wave has the rows of the first hit. */
CRT_FN int crt_wave_has_first_hit(const CrtContext *ctx) { return CRT_SCENE_HAS(ctx->scene, AOV); }

/* The random numbers of the slot's sample, as its path left them. */
CRT_FN CrtSampler crt_load_sampler(const CrtContext *ctx, const CrtWave *wave, u32 slot) {
    CRT_GLOBAL const CrtScene *scene = ctx->scene;
    const CrtWaveShare share = crt_wave_share(wave, slot);
    CrtSampler sampler =
        crt_sampler_begin(scene->sampler, scene->replicate_shift, scene->seed,
                          (scene->crop_y + share.y) * scene->film_width + scene->crop_x + share.x,
                          wave->first_sample + share.first + wave->done[slot]);
    if (CRT_HAS(XORSHIFT) && scene->sampler == CRT_SAMPLER_XORSHIFT)
        sampler.b0 = crt_bits(V4W(*crt_row(wave, CRT_ROW_DIRECTION, slot)));
    return sampler;
}

CRT_FN CrtWavelengths crt_load_wavelengths(const CrtWave *wave, u32 slot) {
    CrtWavelengths w;
    w.position = *crt_row(wave, CRT_ROW_WAVELENGTHS, slot);
    w.u = V4Z(*crt_row(wave, CRT_ROW_REST, slot));
    return w;
}

CRT_FN CrtRay crt_load_path_ray(const CrtWave *wave, u32 slot) {
    CrtRay ray;
    ray.o = crt_row_vector(*crt_row(wave, CRT_ROW_ORIGIN, slot));
    ray.d = crt_row_vector(*crt_row(wave, CRT_ROW_DIRECTION, slot));
    ray.reach = CRT_INFINITY;
    return ray;
}

CRT_FN u32 crt_load_depth(const CrtWave *wave, u32 slot) {
    return crt_depth_of_word(crt_bits(V4W(*crt_row(wave, CRT_ROW_ORIGIN, slot))));
}

/* CRT_PACK_… makes a row of `path`, CRT_UNPACK_… reads `path` from a row. */
#define CRT_PACK_V4(member) path->member
#define CRT_PACK_V3(member, LANE) crt_row_of(path->member, CRT_PACK_##LANE)
#define CRT_PACK_F4(X, Y, Z, W) make_vec4(CRT_PACK_##X, CRT_PACK_##Y, CRT_PACK_##Z, CRT_PACK_##W)
#define CRT_PACK_F1(LANE) splat4(CRT_PACK_##LANE)
#define CRT_PACK_F32(member) path->member
#define CRT_PACK_U32(member) crt_from_bits(path->member)
#define CRT_PACK_WORD crt_from_bits(crt_path_word(path))
#define CRT_PACK_NUMBERS crt_from_bits(path->sampler.b0)
#define CRT_PACK_UNUSED 0.0f
#define CRT_UNPACK_V4(member) path->member = row;
#define CRT_UNPACK_V3(member, LANE) path->member = crt_row_vector(row); lane = V4W(row); CRT_UNPACK_##LANE
#define CRT_UNPACK_F4(X, Y, Z, W)                                     \
    lane = V4X(row); CRT_UNPACK_##X lane = V4Y(row); CRT_UNPACK_##Y   \
    lane = V4Z(row); CRT_UNPACK_##Z lane = V4W(row); CRT_UNPACK_##W
#define CRT_UNPACK_F1(LANE) lane = V4X(row); CRT_UNPACK_##LANE
#define CRT_UNPACK_F32(member) path->member = lane;
#define CRT_UNPACK_U32(member) path->member = crt_bits(lane);
#define CRT_UNPACK_WORD crt_set_path_word(path, crt_bits(lane));
#define CRT_UNPACK_NUMBERS path->sampler = crt_load_sampler(ctx, wave, slot);
#define CRT_UNPACK_UNUSED
#define CRT_STORE_ROW(ROW, DECLARATIONS, LANES) *crt_row(wave, CRT_ROW_##ROW, slot) = CRT_PACK_##LANES;
#define CRT_STORE_IN_TREE(ROW, DECLARATIONS, LANES) \
    if (crt_has_light_tree(ctx)) *crt_row(wave, CRT_ROW_##ROW, slot) = CRT_PACK_##LANES;
#define CRT_LOAD_ROW(ROW, DECLARATIONS, LANES)                   \
    {                                                            \
        const vec4 row = *crt_row(wave, CRT_ROW_##ROW, slot);    \
        CRT_UNPACK_##LANES                                       \
    }
#define CRT_LOAD_IN_TREE(ROW, DECLARATIONS, LANES)               \
    if (crt_has_light_tree(ctx)) {                               \
        const vec4 row = *crt_row(wave, CRT_ROW_##ROW, slot);    \
        CRT_UNPACK_##LANES                                       \
    }
#define CRT_NO_ROW(ROW, DECLARATIONS, LANES)

/* The rows that crt_shade changes, but for the radiance. */
CRT_FN void crt_store_vertex(const CrtContext *ctx, const CrtWave *wave, u32 slot, const CrtPath *path) {
    CRT_PATH_STATE(CRT_STORE_ROW, CRT_STORE_IN_TREE, CRT_NO_ROW, CRT_NO_ROW)
}

CRT_FN void crt_store_first_hit(const CrtWave *wave, u32 slot, const CrtPath *path) {
    CRT_PATH_STATE(CRT_NO_ROW, CRT_NO_ROW, CRT_NO_ROW, CRT_STORE_ROW)
}

/* All rows of a sample that begins. */
CRT_FN void crt_store_begin(const CrtContext *ctx, const CrtWave *wave, u32 slot, const CrtPath *path) {
    crt_store_vertex(ctx, wave, slot, path);
    CRT_PATH_STATE(CRT_NO_ROW, CRT_NO_ROW, CRT_STORE_ROW, CRT_NO_ROW)
    if (crt_wave_has_first_hit(ctx)) crt_store_first_hit(wave, slot, path);
}

/* All but the first hit, which only the film needs. Written in place, as crt_path_begin does. */
CRT_FN void crt_load_path(const CrtContext *ctx, const CrtWave *wave, u32 slot, CrtPath *path) {
    f32 lane;
    CRT_PATH_STATE(CRT_LOAD_ROW, CRT_LOAD_IN_TREE, CRT_LOAD_ROW, CRT_NO_ROW)
    path->ray.reach = CRT_INFINITY;
    path->met = CRT_HAS(MIX) ? crt_bits(V4Z(*crt_row(wave, CRT_ROW_HIT_IDS, slot))) : CRT_NONE;
}

CRT_FN void crt_load_first_hit(const CrtWave *wave, u32 slot, CrtPath *path) {
    f32 lane;
    CRT_PATH_STATE(CRT_NO_ROW, CRT_NO_ROW, CRT_NO_ROW, CRT_LOAD_ROW)
}

/* Numbers of a state that were taken while tracing. */
CRT_FN void crt_store_xorshift(const CrtContext *ctx, const CrtWave *wave, u32 slot, const CrtSampler *s) {
    if (!CRT_HAS(XORSHIFT) || ctx->scene->sampler != CRT_SAMPLER_XORSHIFT) return;
    CRT_GLOBAL vec4 *row = crt_row(wave, CRT_ROW_DIRECTION, slot);
    *row = crt_row_of(crt_row_vector(*row), crt_from_bits(s->b0));
}

CRT_FN void crt_store_hit(const CrtWave *wave, u32 slot, CrtHit hit) {
    *crt_row(wave, CRT_ROW_HIT, slot) = make_vec4(hit.t, hit.b1, hit.b2, crt_from_bits(hit.slot));
    *crt_row(wave, CRT_ROW_HIT_IDS, slot) =
        make_vec4(crt_from_bits(hit.id), crt_from_bits(CRT_HAS(INSTANCES) ? hit.instance : 0u),
                  crt_from_bits(CRT_NONE), 0.0f);
}

/* Stores the place of a surface that a shadow ray may pass: crt_hit_of_slot finds its hit. */
CRT_FN void crt_store_passable(const CrtWave *wave, u32 slot, CrtPassable met) {
    CrtHit hit = crt_no_hit(met.t);
    hit.slot = met.slot;
    hit.instance = met.instance;
    crt_store_hit(wave, slot, hit);
}

CRT_FN CrtRay crt_load_shadow_ray(const CrtWave *wave, u32 slot) {
    const vec4 origin = *crt_row(wave, CRT_ROW_SHADOW_ORIGIN, slot);
    CrtRay ray;
    ray.o = crt_row_vector(origin);
    ray.d = crt_row_vector(*crt_row(wave, CRT_ROW_SHADOW_DIRECTION, slot));
    ray.reach = V4W(origin);
    return ray;
}

/* Counts panes that the slot's path has passed. */
CRT_FN void crt_store_panes(const CrtWave *wave, u32 slot, u32 panes) {
    CRT_GLOBAL vec4 *row = crt_row(wave, CRT_ROW_ORIGIN, slot);
    const u32 word = crt_word_behind_panes(crt_bits(V4W(*row)), panes);
    *row = crt_row_of(crt_row_vector(*row), crt_from_bits(word));
}

/* The depth of the vertex that sent a shadow ray: crt_shade has counted that vertex already where the path
   goes on. */
CRT_FN u32 crt_shadow_depth(const CrtWave *wave, u32 slot, u32 state) {
    return crt_load_depth(wave, slot) - (state & CRT_WAVE_ENDED ? 0u : 1u);
}

/* The state of a slot's ray while it passes surfaces. `state`: of the slot. */
CRT_FN CrtPassage crt_load_passage(const CrtContext *ctx, const CrtWave *wave, u32 slot, u32 state) {
    const int shadow = (state & CRT_WAVE_SHADOW) != 0u;
    const vec4 direction =
        *crt_row(wave, shadow ? CRT_ROW_SHADOW_DIRECTION : CRT_ROW_DIRECTION, slot);
    const u32 depth = shadow ? crt_shadow_depth(wave, slot, state) : crt_load_depth(wave, slot);
    const u32 media =
        crt_bits(V4W(shadow ? direction : *crt_row(wave, CRT_ROW_REST, slot)));
    const vec4 carried = *crt_row(wave, shadow ? CRT_ROW_SHADOW_RADIANCE : CRT_ROW_THROUGHPUT, slot);
    const vec4 position =
        crt_has_panes(ctx) ? *crt_row(wave, CRT_ROW_WAVELENGTHS, slot) : splat4(0.0f);
    CrtPassage way = crt_passage(CRT_PASSING_DIMENSION(depth, shadow), shadow, crt_row_vector(direction),
                                 position, media, carried);
    if ((state & CRT_WAVE_PASSED) != 0u) {
        const vec4 passed = *crt_row(wave, CRT_ROW_PASSED, slot);
        way.passed = crt_bits(V4W(passed));
        if (shadow) way.d = crt_row_vector(passed);
    }
    return way;
}

CRT_FN CrtHit crt_load_hit(const CrtWave *wave, u32 slot) {
    const vec4 found = *crt_row(wave, CRT_ROW_HIT, slot), ids = *crt_row(wave, CRT_ROW_HIT_IDS, slot);
    CrtHit hit;
    hit.t = V4X(found);
    hit.b1 = V4Y(found);
    hit.b2 = V4Z(found);
    hit.slot = crt_bits(V4W(found));
    hit.id = crt_bits(V4X(ids));
    hit.instance = crt_bits(V4Y(ids));
    return hit;
}

CRT_KERNEL_END

#endif
