/// The few words of CUDA that the entry points use (plugins/cuda/cuda_dialect.h), for a C++ compiler on a
/// machine without a GPU. Include it before the kernel and after all other headers: NVRTC's own macro is
/// defined here.
///
/// This checks what the entry points compute: which pixels and samples each thread takes, and the sum of the
/// slices. It says nothing about nvcc's arithmetic; that is for a machine with a GPU.
#pragma once

#include <cstdint>

struct CrtHostDim3 {
    unsigned x, y, z;
};
// Those of the CUDA thread that this thread plays.
inline thread_local CrtHostDim3 gridDim{1, 1, 1}, blockDim{1, 1, 1}, blockIdx{0, 0, 0}, threadIdx{0, 0, 0};

inline unsigned long long atomicAdd(unsigned long long* address, unsigned long long value) {
    return __atomic_fetch_add(address, value, __ATOMIC_RELAXED);
}
inline unsigned atomicAdd(unsigned* address, unsigned value) {
    return __atomic_fetch_add(address, value, __ATOMIC_RELAXED);
}

#define CRT_CUDA_ON_HOST
#define __CUDACC_RTC__
#define __device__
#define __global__
#define __grid_constant__
#define __launch_bounds__(...)
#define __align__(bytes) alignas(bytes)
