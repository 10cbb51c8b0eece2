/*
 * cuda_dialect.h: the words of gpu/kernels.h in CUDA C++. Besides nvcc and NVRTC, the compiler of the host
 * reads it for tests, behind a shim (CRT_CUDA_ON_HOST): no thread waits for another, so that tests run the
 * entry points as plain loops.
 */

/* CRT_BLOCKS_PER_SM: the number of blocks that a multiprocessor should hold at once. The host chooses it
   when compiling, against registers (cuda_lean_kernel.h). */
#define CRT_ENTRY(threads) extern "C" __global__ void __launch_bounds__(threads, CRT_BLOCKS_PER_SM)
#define CRT_SHORT_ENTRY(threads) extern "C" __global__ void __launch_bounds__(threads)

#define CRT_BLOCK 128u /* four warps, side by side as 16 × 8 pixels */
#define CRT_BLOCK_WIDTH 16u
#define CRT_BLOCK_HEIGHT 8u

#define crt_thread() threadIdx.x
#define crt_block() blockIdx.x
#define crt_blocks() gridDim.x
#define crt_slice() blockIdx.y
#define crt_slices() gridDim.y

/* `scene` is the blob's header once more: as a kernel argument it lies in constant memory, where all threads
   read the same word at once. */
#define CRT_SCENE_ARGUMENTS const __grid_constant__ CrtScene scene, const unsigned char *blob
#define CRT_WAVE_ARGUMENTS \
    const __grid_constant__ CrtScene scene, const __grid_constant__ CrtWave wave, const unsigned char *blob
#define CRT_TAKE_SCENE   \
    CrtContext context;  \
    context.blob = blob; \
    context.scene = &scene;
#define CRT_TAKE_WAVE CRT_TAKE_SCENE

/* The threads of a warp need no memory to share. */
#define CRT_GROUP
#define CRT_GROUP_WORDS(name) u32 *const name = 0

CRT_FN void crt_count(u64 *counter, u32 n) { atomicAdd(counter, (u64)n); }
CRT_FN void crt_add(u32 *word, u32 n) { atomicAdd(word, n); }

#ifdef CRT_CUDA_ON_HOST
CRT_FN u32 crt_take_place(const CrtWave *wave, u32 pass, u32 queue, u32 *) {
    return queue != CRT_NONE ? atomicAdd(crt_queue_length(wave, pass, queue), 1u) : 0u;
}
CRT_FN bool crt_sum(CrtRayCount *, u32 *, u32 *) { return true; }
#else
#define CRT_WARP 0xffffffffu
/* Lanes of the same queue take their places together, in the order of their slots. */
CRT_FN u32 crt_take_place(const CrtWave *wave, u32 pass, u32 queue, u32 *) {
    const u32 lane = threadIdx.x % 32u;
    const u32 same = __match_any_sync(CRT_WARP, queue);
    const u32 leader = __ffs(same) - 1u;
    u32 at = 0u;
    if (queue != CRT_NONE && lane == leader)
        at = atomicAdd(crt_queue_length(wave, pass, queue), (u32)__popc(same));
    return __shfl_sync(CRT_WARP, at, leader) + __popc(same & ((1u << lane) - 1u));
}
/* Over a warp, of numbers that are 0 or 1. */
CRT_FN bool crt_sum(CrtRayCount *rays, u32 *finished, u32 *) {
    rays->closest = __popc(__ballot_sync(CRT_WARP, rays->closest != 0u));
    rays->shadow = __popc(__ballot_sync(CRT_WARP, rays->shadow != 0u));
    *finished = __popc(__ballot_sync(CRT_WARP, *finished != 0u));
    return threadIdx.x % 32u == 0u;
}
#endif
