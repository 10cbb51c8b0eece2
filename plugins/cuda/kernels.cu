/*
 * kernels.cu: the CUDA entry points. nvcc compiles this file ahead of time with everything in; while the
 * program runs, the host's text of kernel/schedule/wavefront.h stands above it, and NVRTC compiles what one
 * scene needs.
 *
 * crt_render: a thread renders one pixel over a range of samples. Where the image is too small to fill the
 * device, the range is split over `slices` rows of the grid: each adds to a separate film, and
 * crt_add_slices then adds those to the film in the order of the samples, so the result does not depend on
 * which block ran first.
 *
 * crt_trace, crt_choose_queue and crt_shade_queue: a thread takes one slot of a wave one vertex further
 * (kernel/schedule/wavefront.h). They are compiled one at a time, each with the features that it needs.
 *
 * No thread waits for another: tests run these very functions as plain loops.
 */
#ifndef CRT_WAVEFRONT_H
#include "kernel/schedule/wavefront.h"
#endif

/* The entry points of this module. */
#define CRT_ENTRY_RENDER 1
#define CRT_ENTRY_TRACE 2
#define CRT_ENTRY_SHADE 4
#define CRT_ENTRY_CHOOSE 8
#ifndef CRT_ENTRIES
#define CRT_ENTRIES CRT_ENTRY_RENDER
#endif

#define CRT_BLOCK 128u      /* threads: four warps of 8 × 4 pixels, side by side as 16 × 8 */
#define CRT_BLOCK_WIDTH 16u
#define CRT_BLOCK_HEIGHT 8u

/* Ray counters are spread, so that threads of different blocks do not queue for one address; the host adds
 * them up. */
#define CRT_RAY_COUNTERS 1024u

/* Blocks that a multiprocessor should hold at once: the host chooses it when compiling, against registers
 * (cuda_program.h). */
#ifndef CRT_BLOCKS_PER_SM
#define CRT_BLOCKS_PER_SM 4
#endif

#if CRT_ENTRIES & CRT_ENTRY_RENDER
/*
 * Samples [first_sample, first_sample + sample_count) of the pixels [x0, x1) × [y0, y1). `scene` is the
 * blob's header once more: as a kernel argument it lies in constant memory, where all threads read the same
 * word at once. `sums`, `counts`, `primitives` are the film when the grid has one row, else one film after
 * another, one for each row.
 */
extern "C" __global__ void __launch_bounds__(CRT_BLOCK, CRT_BLOCKS_PER_SM)
    crt_render(const __grid_constant__ CrtScene scene, const unsigned char* blob, u32 x0, u32 y0, u32 x1,
               u32 y1, u64 first_sample, u32 sample_count, f64* sums, u64* counts, u32* primitives,
               u64* rays) {
    const u32 blocks_across = (x1 - x0 + CRT_BLOCK_WIDTH - 1u) / CRT_BLOCK_WIDTH;
    const u32 warp = threadIdx.x / 32u;
    const u32 lane = threadIdx.x % 32u;
    const u32 x = x0 + (blockIdx.x % blocks_across) * CRT_BLOCK_WIDTH + (warp % 2u) * 8u + lane % 8u;
    const u32 y = y0 + (blockIdx.x / blocks_across) * CRT_BLOCK_HEIGHT + (warp / 2u) * 4u + lane / 8u;
    if (x >= x1 || y >= y1) return;

    const u32 slice = blockIdx.y;
    const u32 first = (u32)((u64)sample_count * slice / gridDim.y);
    const u32 last = (u32)((u64)sample_count * (slice + 1u) / gridDim.y);
    const u64 film = (u64)slice * scene.width * scene.height;

    CrtContext context;
    context.blob = blob;
    context.scene = &scene;
    CrtRayCount traced;
    traced.closest = 0u;
    traced.shadow = 0u;
    crt_render_pixel(&context, x, y, first_sample + first, last - first, sums + film * scene.channels * 2u,
                     counts + film, primitives != 0 ? primitives + film : 0, &traced);

    u64 *counter = rays + 2u * ((blockIdx.x + 37u * blockIdx.y) % CRT_RAY_COUNTERS);
    atomicAdd(counter, (u64)traced.closest);
    atomicAdd(counter + 1, (u64)traced.shadow);
}
#endif

#if CRT_ENTRIES & (CRT_ENTRY_TRACE | CRT_ENTRY_SHADE | CRT_ENTRY_CHOOSE)
CRT_FN CRT_GLOBAL u32 *crt_queue_length(const CrtWave *wave, u32 pass, u32 queue) {
    return wave->lengths + ((pass & 1u) * CRT_WAVE_QUEUES + queue);
}
#endif

#if CRT_ENTRIES & (CRT_ENTRY_TRACE | CRT_ENTRY_CHOOSE)
#ifdef CRT_CUDA_ON_HOST
CRT_FN void crt_enqueue(const CrtWave *wave, u32 pass, u32 queue, u32 slot) {
    if (queue == CRT_NONE) return;
    const u32 at = atomicAdd(crt_queue_length(wave, pass, queue), 1u);
    wave->queued[(u64)queue * wave->slots + at] = slot;
}
CRT_FN u32 crt_sum_of_warp(u32 value) { return value; }
CRT_FN int crt_speaks_for_warp() { return 1; }
#else
#define CRT_WARP 0xffffffffu
/* Lanes of the same queue take their places together, in the order of their slots. All lanes call. */
CRT_FN void crt_enqueue(const CrtWave *wave, u32 pass, u32 queue, u32 slot) {
    const u32 lane = threadIdx.x % 32u;
    const u32 same = __match_any_sync(CRT_WARP, queue);
    const u32 leader = __ffs(same) - 1u;
    u32 at = 0u;
    if (queue != CRT_NONE && lane == leader)
        at = atomicAdd(crt_queue_length(wave, pass, queue), (u32)__popc(same));
    at = __shfl_sync(CRT_WARP, at, leader) + __popc(same & ((1u << lane) - 1u));
    if (queue != CRT_NONE) wave->queued[(u64)queue * wave->slots + at] = slot;
}
/* Of numbers that are 0 or 1. All lanes call. */
CRT_FN u32 crt_sum_of_warp(u32 value) { return __popc(__ballot_sync(CRT_WARP, value != 0u)); }
CRT_FN int crt_speaks_for_warp() { return threadIdx.x % 32u == 0u; }
#endif
#endif

#if CRT_ENTRIES & CRT_ENTRY_TRACE
/* Traces what the slots of a wave wait for. One thread a slot. */
extern "C" __global__ void __launch_bounds__(CRT_BLOCK, CRT_BLOCKS_PER_SM)
    crt_trace(const __grid_constant__ CrtScene scene, const __grid_constant__ CrtWave wave,
              const unsigned char* blob, u32 pass) {
    const u32 slot = blockIdx.x * CRT_BLOCK + threadIdx.x;
    CrtContext context;
    context.blob = blob;
    context.scene = &scene;
    CrtRayCount traced;
    traced.closest = 0u;
    traced.shadow = 0u;
    u32 finished = 0u;
    /* The next pass's queues: those who read these places have ended. */
    if (slot < CRT_WAVE_QUEUES) *crt_queue_length(&wave, pass + 1u, slot) = 0u;
    const u32 queue = crt_wave_trace(&context, &wave, slot, pass == 0u, &traced, &finished);
    crt_enqueue(&wave, pass, queue, slot);

    const u32 closest = crt_sum_of_warp(traced.closest), shadows = crt_sum_of_warp(traced.shadow),
              ends = crt_sum_of_warp(finished);
    if (!crt_speaks_for_warp()) return;
    u64 *counter = wave.rays + 2u * (blockIdx.x % CRT_RAY_COUNTERS);
    if (closest != 0u) atomicAdd(counter, (u64)closest);
    if (shadows != 0u) atomicAdd(counter + 1, (u64)shadows);
    if (ends != 0u) atomicAdd(wave.finished, ends);
}
#endif

#if CRT_ENTRIES & CRT_ENTRY_CHOOSE
/* Hands the slots that have met a mix or a pane to the queues of the materials that they find, unless their
   rays pass it. */
extern "C" __global__ void __launch_bounds__(CRT_BLOCK, CRT_BLOCKS_PER_SM)
    crt_choose_queue(const __grid_constant__ CrtScene scene, const __grid_constant__ CrtWave wave,
                     const unsigned char* blob, u32 pass) {
    CrtContext context;
    context.blob = blob;
    context.scene = &scene;
    const u32 choice = wave.queue_of_choice;
    const u32 length = *crt_queue_length(&wave, pass, choice);
    for (u32 first = blockIdx.x * CRT_BLOCK; first < length; first += gridDim.x * CRT_BLOCK) {
        const u32 i = first + threadIdx.x;
        u32 slot = 0u, queue = CRT_NONE;
        if (i < length) {
            slot = wave.queued[(u64)choice * wave.slots + i];
            queue = crt_wave_choose(&context, &wave, slot);
        }
        crt_enqueue(&wave, pass, queue, slot);
    }
}
#endif

#if CRT_ENTRIES & CRT_ENTRY_SHADE
/* Shades the slots of one queue. */
extern "C" __global__ void __launch_bounds__(CRT_BLOCK, CRT_BLOCKS_PER_SM)
    crt_shade_queue(const __grid_constant__ CrtScene scene, const __grid_constant__ CrtWave wave,
                    const unsigned char* blob, u32 pass, u32 queue) {
    CrtContext context;
    context.blob = blob;
    context.scene = &scene;
    const u32 length = *crt_queue_length(&wave, pass, queue);
    for (u32 i = blockIdx.x * CRT_BLOCK + threadIdx.x; i < length; i += gridDim.x * CRT_BLOCK)
        crt_wave_shade(&context, &wave, wave.queued[(u64)queue * wave.slots + i]);
}
#endif

#if CRT_ENTRIES & (CRT_ENTRY_RENDER | CRT_ENTRY_TRACE)

/* Adds `slices` films, which lie one after another, to the film, in order, and clears them for the next
   launch. One thread a channel of a pixel of [x0, x1) × [y0, y1). */
extern "C" __global__ void __launch_bounds__(CRT_BLOCK)
    crt_add_slices(u32 x0, u32 y0, u32 x1, u32 y1, u32 width, u32 height, u32 channels, u32 slices,
                   f64* sums, u64* counts, u32* primitives, f64* slice_sums, u64* slice_counts,
                   u32* slice_primitives) {
    const u64 thread = (u64)blockIdx.x * CRT_BLOCK + threadIdx.x;
    const u64 in_rectangle = thread / channels;
    const u32 channel = (u32)(thread % channels);
    const u32 y = y0 + (u32)(in_rectangle / (x1 - x0));
    if (y >= y1) return;
    const u64 pixel = (u64)y * width + x0 + (u32)(in_rectangle % (x1 - x0));
    const u64 film = (u64)width * height;

    f64 *pair = sums + (pixel * channels + channel) * 2u;
    for (u32 slice = 0u; slice < slices; ++slice) {
        f64 *part = slice_sums + ((slice * film + pixel) * channels + channel) * 2u;
        crt_film_add(pair, part[0]);
        crt_film_add(pair, part[1]);
        part[0] = part[1] = 0.0;
    }
    if (channel != 0u) return;
    for (u32 slice = 0u; slice < slices; ++slice) {
        const u64 part = slice * film + pixel;
        /* The primitive belongs to the first valid sample, as in crt_render_pixel. */
        if (primitives != 0 && counts[pixel] == 0u && slice_counts[part] != 0u)
            primitives[pixel] = slice_primitives[part];
        counts[pixel] += slice_counts[part];
        slice_counts[part] = 0u;
    }
}
#endif
