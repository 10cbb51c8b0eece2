/*
 * opencl_dialect.h: the words of gpu/kernels.h in OpenCL C 1.2. A work-item is a thread, a work-group a
 * block, whose size is fixed so that a binary is complete: PoCL compiles a kernel for one group size.
 */

#define CRT_ENTRY(threads) __kernel __attribute__((reqd_work_group_size(threads, 1, 1))) void
#define CRT_SHORT_ENTRY(threads) CRT_ENTRY(threads)

/* The host chooses the sides (opencl_device.h). */
#define CRT_BLOCK (CRT_BLOCK_WIDTH * CRT_BLOCK_HEIGHT)

#define crt_thread() ((u32)get_local_id(0))
#define crt_block() ((u32)get_group_id(0))
#define crt_blocks() ((u32)get_num_groups(0))
#define crt_slice() ((u32)get_group_id(1))
#define crt_slices() ((u32)get_num_groups(1))

#define CRT_SCENE_ARGUMENTS CRT_GLOBAL const CRT_BYTE *blob
#define CRT_TAKE_SCENE   \
    CrtContext context;  \
    context.blob = blob; \
    context.scene = (CRT_GLOBAL const CrtScene *)blob;

/* Arguments by value must not contain pointers: `header` is the host's CrtWave, whose pointers are invalid
   here. `queues`: their number. */
#define CRT_WAVE_ARGUMENTS                                                                      \
    CRT_GLOBAL const CRT_BYTE *blob, CRT_GLOBAL const CRT_BYTE *header, u32 queues,             \
    CRT_GLOBAL vec4 *rows, CRT_GLOBAL u32 *row_words, CRT_GLOBAL f64 *sums,                     \
    CRT_GLOBAL u64 *counts, CRT_GLOBAL u32 *primitives, CRT_GLOBAL u64 *rays
#define CRT_TAKE_WAVE                                            \
    CRT_TAKE_SCENE                                               \
    CrtWave wave = *(CRT_GLOBAL const CrtWave *)header;          \
    crt_wave_lay_out(&wave, queues, rows, row_words);            \
    wave.sums = sums;                                            \
    wave.counts = counts;                                        \
    wave.primitives = primitives;                                \
    wave.rays = rays;

/* Lengths of queues in the block, then the places where they begin, then three sums. */
#define CRT_GROUP __local
#define CRT_GROUP_WORDS(name) CRT_GROUP u32 name[2u * CRT_WAVE_QUEUES + 3u]

CRT_FN void crt_count(CRT_GLOBAL u64 *counter, u32 n) { (void)crt_atomic_carry(counter, n); }
CRT_FN void crt_add(CRT_GLOBAL u32 *word, u32 n) { atomic_add((volatile CRT_GLOBAL u32 *)word, n); }

/* The slots of a block take their places together: one atomic of the device a queue. */
CRT_FN u32 crt_take_place(const CrtWave *wave, u32 pass, u32 queue, CRT_GROUP u32 *words) {
    CRT_GROUP u32 *lengths = words, *begins = words + CRT_WAVE_QUEUES;
    const u32 item = crt_thread();
    if (item < CRT_WAVE_QUEUES) lengths[item] = 0u;
    barrier(CLK_LOCAL_MEM_FENCE);
    u32 at = 0u;
    if (queue != CRT_NONE) at = atomic_inc(&lengths[queue]);
    barrier(CLK_LOCAL_MEM_FENCE);
    if (item < CRT_WAVE_QUEUES && lengths[item] != 0u)
        begins[item] = atomic_add(
            (volatile CRT_GLOBAL u32 *)crt_queue_length(wave, pass, item), lengths[item]);
    barrier(CLK_LOCAL_MEM_FENCE);
    return queue != CRT_NONE ? begins[queue] + at : 0u;
}
/* Over a block. */
CRT_FN int crt_sum(CrtRayCount *rays, u32 *finished, CRT_GROUP u32 *words) {
    CRT_GROUP u32 *sums = words + 2u * CRT_WAVE_QUEUES;
    const u32 item = crt_thread();
    if (item < 3u) sums[item] = 0u;
    barrier(CLK_LOCAL_MEM_FENCE);
    if (rays->closest != 0u) atomic_add(&sums[0], rays->closest);
    if (rays->shadow != 0u) atomic_add(&sums[1], rays->shadow);
    if (*finished != 0u) atomic_inc(&sums[2]);
    barrier(CLK_LOCAL_MEM_FENCE);
    rays->closest = sums[0];
    rays->shadow = sums[1];
    *finished = sums[2];
    return item == 0u;
}
