// The kernel with everything in, as nvcc compiles it: crt_render.
#define CRT_ENTRIES 1
#include "kernel/schedule/wavefront.h"
#include "cuda/cuda_dialect.h"
#include "gpu/kernels.h"
