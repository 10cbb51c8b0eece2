/*
 * kernels.cl: the OpenCL entry point. The host's text of kernel/path.h stands above this one when it is
 * compiled.
 *
 * CRT_GROUP_X and CRT_GROUP_Y are the work-group's sides, fixed so that a binary is complete: PoCL compiles
 * a kernel for one group size.
 */

/* Adds to a 64-bit counter kept as two words, low first: OpenCL 1.2 promises atomics of 32 bits only. */
static inline void crt_count(volatile __global uint *counter, uint n) {
    const uint before = atomic_add(&counter[0], n);
    if (before + n < before) atomic_inc(&counter[1]);
}

/* Samples [first_sample, first_sample + sample_count) of the pixels [x0, x1) × [y0, y1), one work-item a
   pixel. `rays` holds the counts of closest and of shadow rays. */
__kernel __attribute__((reqd_work_group_size(CRT_GROUP_X, CRT_GROUP_Y, 1))) void crt_render(
    __global const uchar* blob, __global double* sums, __global ulong* counts, __global uint* primitives,
    volatile __global uint* rays, uint x0, uint y0, uint x1, uint y1, ulong first_sample,
    uint sample_count) {
    const uint x = x0 + (uint)get_global_id(0);
    const uint y = y0 + (uint)get_global_id(1);
    if (x >= x1 || y >= y1) return;

    CrtContext context;
    context.blob = blob;
    context.scene = (__global const CrtScene *)blob;
    CrtRayCount traced;
    traced.closest = 0u;
    traced.shadow = 0u;
    crt_render_pixel(&context, x, y, first_sample, sample_count, sums, counts, primitives, &traced);
    crt_count(&rays[0], traced.closest);
    crt_count(&rays[2], traced.shadow);
}
