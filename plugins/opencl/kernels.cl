/*
 * kernels.cl: the OpenCL entry points. The host's text of kernel/schedule/wavefront.h stands above this one
 * when it is compiled, each entry point by itself with the features that it needs.
 *
 * CRT_GROUP_X and CRT_GROUP_Y are the sides of crt_render's work-group, fixed so that a binary is complete:
 * PoCL compiles a kernel for one group size.
 */

/* The entry points of this program. */
#define CRT_ENTRY_RENDER 1
#define CRT_ENTRY_TRACE 2
#define CRT_ENTRY_SHADE 4
#define CRT_ENTRY_CHOOSE 8

/* Ray counters are spread, so that groups do not queue for one address; the host adds them up. */
#define CRT_RAY_COUNTERS 256u

static inline CrtContext crt_context_of(__global const uchar *blob) {
    CrtContext context;
    context.blob = blob;
    context.scene = (__global const CrtScene *)blob;
    return context;
}

/* Adds to a 64-bit counter kept as two words, low first: OpenCL 1.2 promises atomics of 32 bits only. */
static inline void crt_count(volatile __global uint *counter, uint n) {
    const uint before = atomic_add(&counter[0], n);
    if (before + n < before) atomic_inc(&counter[1]);
}

#if CRT_ENTRIES & CRT_ENTRY_RENDER
/* Samples [first_sample, first_sample + sample_count) of the pixels [x0, x1) × [y0, y1), one work-item a
   pixel. `rays` holds CRT_RAY_COUNTERS places for the numbers of closest and of shadow rays. */
__kernel __attribute__((reqd_work_group_size(CRT_GROUP_X, CRT_GROUP_Y, 1))) void crt_render(
    __global const uchar* blob, __global double* sums, __global ulong* counts, __global uint* primitives,
    volatile __global uint* rays, uint x0, uint y0, uint x1, uint y1, ulong first_sample,
    uint sample_count) {
    const uint x = x0 + (uint)get_global_id(0);
    const uint y = y0 + (uint)get_global_id(1);
    if (x >= x1 || y >= y1) return;

    const CrtContext context = crt_context_of(blob);
    CrtRayCount traced;
    traced.closest = 0u;
    traced.shadow = 0u;
    crt_render_pixel(&context, x, y, first_sample, sample_count, sums, counts, primitives, &traced);
    volatile __global uint *counter = rays + 4u * ((x + 31u * y) % CRT_RAY_COUNTERS);
    crt_count(&counter[0], traced.closest);
    crt_count(&counter[2], traced.shadow);
}
#endif

#if CRT_ENTRIES & (CRT_ENTRY_TRACE | CRT_ENTRY_SHADE | CRT_ENTRY_CHOOSE)
/* A wave of `queues` queues. In OpenCL, arguments by value must not contain pointers: `header` is the host's
   CrtWave, whose pointers are invalid here. */
static inline CrtWave crt_wave_given(__global const uchar *header, uint queues, __global float4 *rows,
                                     __global uint *words) {
    CrtWave wave = *(__global const CrtWave *)header;
    crt_wave_lay_out(&wave, queues, rows, words);
    return wave;
}

static inline volatile __global uint *crt_queue_length(const CrtWave *wave, uint pass, uint queue) {
    return wave->lengths + ((pass & 1u) * CRT_WAVE_QUEUES + queue);
}
#endif

#if CRT_ENTRIES & (CRT_ENTRY_TRACE | CRT_ENTRY_CHOOSE)
/* The slots of a group take their places together: one atomic of the device a queue. All work-items call;
   `lengths` holds 2 · CRT_WAVE_QUEUES words. */
static inline void crt_enqueue(const CrtWave *wave, uint pass, uint queue, uint slot,
                               __local uint *lengths) {
    const uint item = (uint)get_local_id(0);
    if (item < CRT_WAVE_QUEUES) lengths[item] = 0u;
    barrier(CLK_LOCAL_MEM_FENCE);
    uint at = 0u;
    if (queue != CRT_NONE) at = atomic_inc(&lengths[queue]);
    barrier(CLK_LOCAL_MEM_FENCE);
    if (item < CRT_WAVE_QUEUES && lengths[item] != 0u)
        lengths[CRT_WAVE_QUEUES + item] = atomic_add(crt_queue_length(wave, pass, item), lengths[item]);
    barrier(CLK_LOCAL_MEM_FENCE);
    if (queue != CRT_NONE)
        wave->queued[(ulong)queue * wave->slots + lengths[CRT_WAVE_QUEUES + queue] + at] = slot;
}
#endif

#if CRT_ENTRIES & CRT_ENTRY_TRACE
/* Traces what the slots of a wave wait for. One work-item a slot. */
__kernel __attribute__((reqd_work_group_size(CRT_WAVE_BLOCK, 1, 1))) void crt_trace(
    __global const uchar* blob, __global const uchar* header, uint queues, __global float4* rows,
    __global uint* words, __global double* sums, __global ulong* counts, __global uint* primitives,
    volatile __global uint* rays, uint pass) {
    __local uint lengths[2u * CRT_WAVE_QUEUES];
    __local uint totals[3];
    const uint slot = (uint)get_global_id(0), item = (uint)get_local_id(0);
    if (item < 3u) totals[item] = 0u;
    CrtWave wave = crt_wave_given(header, queues, rows, words);
    wave.sums = sums;
    wave.counts = counts;
    wave.primitives = primitives;
    /* The next pass's queues: those who read these places have ended. */
    if (slot < CRT_WAVE_QUEUES) *crt_queue_length(&wave, pass + 1u, slot) = 0u;

    const CrtContext context = crt_context_of(blob);
    CrtRayCount traced;
    traced.closest = 0u;
    traced.shadow = 0u;
    uint finished = 0u;
    const uint queue = crt_wave_trace(&context, &wave, slot, pass == 0u, &traced, &finished);
    crt_enqueue(&wave, pass, queue, slot, lengths);

    if (traced.closest != 0u) atomic_add(&totals[0], traced.closest);
    if (traced.shadow != 0u) atomic_add(&totals[1], traced.shadow);
    if (finished != 0u) atomic_inc(&totals[2]);
    barrier(CLK_LOCAL_MEM_FENCE);
    if (item != 0u) return;
    volatile __global uint *counter = rays + 4u * ((uint)get_group_id(0) % CRT_RAY_COUNTERS);
    crt_count(&counter[0], totals[0]);
    crt_count(&counter[2], totals[1]);
    if (totals[2] != 0u) atomic_add((volatile __global uint *)wave.finished, totals[2]);
}
#endif

#if CRT_ENTRIES & CRT_ENTRY_CHOOSE
/* Hands the slots that have met a mix or a pane to the queues of the materials that they find, unless their
   rays pass it. */
__kernel __attribute__((reqd_work_group_size(CRT_WAVE_BLOCK, 1, 1))) void crt_choose_queue(
    __global const uchar* blob, __global const uchar* header, uint queues, __global float4* rows,
    __global uint* words, uint pass) {
    __local uint lengths[2u * CRT_WAVE_QUEUES];
    CrtWave wave = crt_wave_given(header, queues, rows, words);
    const CrtContext context = crt_context_of(blob);
    const uint choice = wave.queue_of_choice, length = *crt_queue_length(&wave, pass, choice);
    for (uint first = (uint)get_group_id(0) * CRT_WAVE_BLOCK; first < length;
         first += (uint)get_num_groups(0) * CRT_WAVE_BLOCK) {
        const uint i = first + (uint)get_local_id(0);
        uint slot = 0u, queue = CRT_NONE; /* all of a group meet at the barriers */
        if (i < length) {
            slot = wave.queued[(ulong)choice * wave.slots + i];
            queue = crt_wave_choose(&context, &wave, slot);
        }
        crt_enqueue(&wave, pass, queue, slot, lengths);
    }
}
#endif

#if CRT_ENTRIES & CRT_ENTRY_SHADE
/* Shades the slots of one queue. */
__kernel __attribute__((reqd_work_group_size(CRT_WAVE_BLOCK, 1, 1))) void crt_shade_queue(
    __global const uchar* blob, __global const uchar* header, uint queues, __global float4* rows,
    __global uint* words, uint pass, uint queue) {
    const CrtWave wave = crt_wave_given(header, queues, rows, words);
    const CrtContext context = crt_context_of(blob);
    const uint length = *crt_queue_length(&wave, pass, queue);
    for (uint i = (uint)get_global_id(0); i < length; i += (uint)get_global_size(0))
        crt_wave_shade(&context, &wave, wave.queued[(ulong)queue * wave.slots + i]);
}
#endif
