/*
 * kernels.h: the entry points of GPU kernels, once for CUDA C++ and OpenCL C. Above this text stand that of
 * kernel/schedule/wavefront.h and the words of one language, cuda_dialect.h or opencl_dialect.h. Each entry
 * point is compiled by itself (CRT_ENTRIES), with the features that it needs.
 *
 * crt_render: a thread renders one pixel over a range of samples. Where the image is too small to fill the
 * device, the range is split over `slices` rows of the grid: each adds to a separate film, and
 * crt_add_slices then adds those to the film in the order of the samples, so the result does not depend on
 * which block ran first.
 *
 * crt_trace, crt_choose_queue and crt_shade_queue: a thread takes one slot of a wave one vertex further
 * (kernel/schedule/wavefront.h).
 *
 * The words of a language:
 *   CRT_ENTRY(threads)      begins an entry point whose blocks have this number of threads;
 *                           CRT_SHORT_ENTRY(threads) one that needs few registers
 *   CRT_BLOCK               threads of a block of crt_render; CRT_BLOCK_WIDTH × CRT_BLOCK_HEIGHT pixels
 *   CRT_SCENE_ARGUMENTS     the first arguments of crt_render; CRT_TAKE_SCENE makes `context` of them
 *   CRT_WAVE_ARGUMENTS      those of waves; CRT_TAKE_WAVE makes `context` and `wave` of them
 *   crt_thread(), crt_block(), crt_blocks()   number of a thread in its block, of the block, of all blocks
 *   crt_slice(), crt_slices()                 row of the grid, and number of rows
 *   CRT_GROUP_WORDS(name)   declares memory (CRT_GROUP) that the threads of a block share, if they need it
 *   crt_count(counter, n), crt_add(word, n)   atomic additions to 64 and to 32 bits
 *   crt_take_place(wave, pass, queue, words)  the place of a slot in a queue; all threads of a block call
 *   crt_sum(rays, finished, words)            sums over neighbouring threads, of which one gets 1 and has
 *                                             them; all threads of a block call
 */

/* The entry points of this program. */
#define CRT_ENTRY_RENDER 1
#define CRT_ENTRY_TRACE 2
#define CRT_ENTRY_SHADE 4
#define CRT_ENTRY_CHOOSE 8

/* Ray counters are spread, so that threads of different blocks do not queue for one address; the host adds
 * them up. */
#define CRT_RAY_COUNTERS 1024u

#if CRT_ENTRIES & CRT_ENTRY_RENDER
/*
 * Samples [first_sample, first_sample + sample_count) of the pixels [x0, x1) × [y0, y1). A warp has 8 × 4
 * pixels. `sums`, `counts`, `primitives` are the film when the grid has one row, else one film after
 * another, one for each row. `splats` is one plane for all rows, as its sums have no order; it may be null.
 */
CRT_ENTRY(CRT_BLOCK)
crt_render(CRT_SCENE_ARGUMENTS, u32 x0, u32 y0, u32 x1, u32 y1, u64 first_sample, u32 sample_count,
           CRT_GLOBAL f64 *sums, CRT_GLOBAL u64 *counts, CRT_GLOBAL u32 *primitives, CRT_GLOBAL u64 *splats,
           CRT_GLOBAL u64 *rays) {
    const u32 blocks_across = (x1 - x0 + CRT_BLOCK_WIDTH - 1u) / CRT_BLOCK_WIDTH;
    const u32 warps_across = (CRT_BLOCK_WIDTH + 7u) / 8u;
    const u32 warp = crt_thread() / 32u;
    const u32 lane = crt_thread() % 32u;
    const u32 x =
        x0 + (crt_block() % blocks_across) * CRT_BLOCK_WIDTH + (warp % warps_across) * 8u + lane % 8u;
    const u32 y =
        y0 + (crt_block() / blocks_across) * CRT_BLOCK_HEIGHT + (warp / warps_across) * 4u + lane / 8u;
    if (x >= x1 || y >= y1) return;

    CRT_TAKE_SCENE
    const u32 slice = crt_slice();
    const u32 first = (u32)((u64)sample_count * slice / crt_slices());
    const u32 last = (u32)((u64)sample_count * (slice + 1u) / crt_slices());
    const u64 film = (u64)slice * context.scene->width * context.scene->height;

    CrtRayCount traced;
    traced.closest = 0u;
    traced.shadow = 0u;
    crt_render_pixel(&context, x, y, first_sample + first, last - first,
                     sums + film * context.scene->channels * 2u, counts + film,
                     primitives != 0 ? primitives + film : 0, splats, &traced);

    CRT_GLOBAL u64 *counter = rays + 2u * ((crt_block() + 37u * slice) % CRT_RAY_COUNTERS);
    crt_count(counter, traced.closest);
    crt_count(counter + 1, traced.shadow);
}
#endif

#if CRT_ENTRIES & (CRT_ENTRY_TRACE | CRT_ENTRY_CHOOSE)
/* All threads of a block call. */
CRT_FN void crt_enqueue(const CrtWave *wave, u32 pass, u32 queue, u32 slot, CRT_GROUP u32 *words) {
    const u32 at = crt_take_place(wave, pass, queue, words);
    if (queue != CRT_NONE) wave->queued[(u64)queue * wave->slots + at] = slot;
}
#endif

#if CRT_ENTRIES & CRT_ENTRY_TRACE
/* Traces what the slots of a wave wait for. One thread a slot. */
CRT_ENTRY(CRT_WAVE_BLOCK) crt_trace(CRT_WAVE_ARGUMENTS, u32 pass) {
    CRT_GROUP_WORDS(words);
    CRT_TAKE_WAVE
    const u32 slot = crt_block() * CRT_WAVE_BLOCK + crt_thread();
    CrtRayCount traced;
    traced.closest = 0u;
    traced.shadow = 0u;
    u32 finished = 0u;
    /* The next pass's queues: those who read these places have ended. */
    if (slot < CRT_WAVE_QUEUES) *crt_queue_length(&wave, pass + 1u, slot) = 0u;
    const u32 queue = crt_wave_trace(&context, &wave, slot, pass == 0u, &traced, &finished);
    crt_enqueue(&wave, pass, queue, slot, words);

    if (!crt_sum(&traced, &finished, words)) return;
    CRT_GLOBAL u64 *counter = wave.rays + 2u * (crt_block() % CRT_RAY_COUNTERS);
    if (traced.closest != 0u) crt_count(counter, traced.closest);
    if (traced.shadow != 0u) crt_count(counter + 1, traced.shadow);
    if (finished != 0u) crt_add(wave.finished, finished);
}
#endif

#if CRT_ENTRIES & CRT_ENTRY_CHOOSE
/* Hands the slots that have met a mix or a pane to the queues of the materials that they find, unless their
   rays pass it. */
CRT_ENTRY(CRT_WAVE_BLOCK) crt_choose_queue(CRT_WAVE_ARGUMENTS, u32 pass) {
    CRT_GROUP_WORDS(words);
    CRT_TAKE_WAVE
    const u32 choice = wave.queue_of_choice;
    const u32 length = *crt_queue_length(&wave, pass, choice);
    for (u32 first = crt_block() * CRT_WAVE_BLOCK; first < length; first += crt_blocks() * CRT_WAVE_BLOCK) {
        const u32 i = first + crt_thread();
        u32 slot = 0u, queue = CRT_NONE;
        if (i < length) {
            slot = wave.queued[(u64)choice * wave.slots + i];
            queue = crt_wave_choose(&context, &wave, slot);
        }
        crt_enqueue(&wave, pass, queue, slot, words);
    }
}
#endif

#if CRT_ENTRIES & CRT_ENTRY_SHADE
/* Shades the slots of one queue. */
CRT_ENTRY(CRT_WAVE_BLOCK) crt_shade_queue(CRT_WAVE_ARGUMENTS, u32 pass, u32 queue) {
    CRT_TAKE_WAVE
    const u32 length = *crt_queue_length(&wave, pass, queue);
    for (u32 i = crt_block() * CRT_WAVE_BLOCK + crt_thread(); i < length; i += crt_blocks() * CRT_WAVE_BLOCK)
        crt_wave_shade(&context, &wave, wave.queued[(u64)queue * wave.slots + i]);
}
#endif

#if CRT_ENTRIES & (CRT_ENTRY_RENDER | CRT_ENTRY_TRACE)
/* Adds `slices` films, which lie one after another, to the film, in order, and clears them for the next
   launch. One thread a channel of a pixel of [x0, x1) × [y0, y1). */
CRT_SHORT_ENTRY(CRT_BLOCK)
crt_add_slices(u32 x0, u32 y0, u32 x1, u32 y1, u32 width, u32 height, u32 channels, u32 slices,
               CRT_GLOBAL f64 *sums, CRT_GLOBAL u64 *counts, CRT_GLOBAL u32 *primitives,
               CRT_GLOBAL f64 *slice_sums, CRT_GLOBAL u64 *slice_counts, CRT_GLOBAL u32 *slice_primitives) {
    const u64 thread = (u64)crt_block() * CRT_BLOCK + crt_thread();
    const u64 in_rectangle = thread / channels;
    const u32 channel = (u32)(thread % channels);
    const u32 y = y0 + (u32)(in_rectangle / (x1 - x0));
    if (y >= y1) return;
    const u64 pixel = (u64)y * width + x0 + (u32)(in_rectangle % (x1 - x0));
    const u64 film = (u64)width * height;

    CRT_GLOBAL f64 *pair = sums + (pixel * channels + channel) * 2u;
    for (u32 slice = 0u; slice < slices; ++slice) {
        CRT_GLOBAL f64 *part = slice_sums + ((slice * film + pixel) * channels + channel) * 2u;
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
