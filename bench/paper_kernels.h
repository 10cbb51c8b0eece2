/// The kernels of bench/paper_gpu.cu. Compiled by nvcc, and by a C++ compiler in tests/unit_paper.cpp,
/// where threads of the host play those of a block (tests/block_on_host.h, included before). Blocks have a
/// multiple of 32 threads, at most 1024.
#pragma once

#include "paper_work.h"

namespace paper {

constexpr unsigned kAllLanes = 0xffffffffu;
constexpr unsigned kWarp = 32;
/// Triangles of 48 bytes that 64 KiB of constant memory hold.
constexpr std::uint32_t kConstantTriangles = 1344;

struct Add {
    static __device__ float apply(float a, float b) { return a + b; }
    static __device__ float neutral() { return 0.0f; }
};
struct Least {
    static __device__ float apply(float a, float b) { return fminf(a, b); }
    static __device__ float neutral() { return 3.402823466e38f; }
};
struct Most {
    static __device__ float apply(float a, float b) { return fmaxf(a, b); }
    static __device__ float neutral() { return -3.402823466e38f; }
};

/// `value` of all threads of the block together; the result is right in thread 0 alone. `scratch` has one
/// place a warp; all threads must have arrived before it is used again.
template <typename Operation>
__device__ float blockTotal(float value, float* scratch) {
    for (unsigned distance = kWarp / 2; distance > 0; distance /= 2)
        value = Operation::apply(value, __shfl_down_sync(kAllLanes, value, distance));
    if (threadIdx.x % kWarp == 0) scratch[threadIdx.x / kWarp] = value;
    __syncthreads();
    if (threadIdx.x < kWarp) {
        value = threadIdx.x < blockDim.x / kWarp ? scratch[threadIdx.x] : Operation::neutral();
        for (unsigned distance = kWarp / 2; distance > 0; distance /= 2)
            value = Operation::apply(value, __shfl_down_sync(kAllLanes, value, distance));
    }
    __syncthreads();
    return value;
}

/// True if this block is the last of the grid to come here. Earlier writes of thread 0 of the other blocks
/// are then readable. `arrived` is 0 before and after.
__device__ inline bool isLastBlock(unsigned* arrived, bool* answer) {
    if (threadIdx.x == 0) {
        __threadfence();
        *answer = atomicInc(arrived, gridDim.x - 1) == gridDim.x - 1;
        __threadfence();
    }
    __syncthreads();
    return *answer;
}

/// Sum of `count` numbers that begin at a multiple of 16 bytes, in one pass: four loads of 16 bytes a
/// thread before the first is used, warps by shuffles, blocks by the last to finish, in the same order
/// every time.
__global__ void sumKernel(const float* values, std::size_t count, float* of_blocks, unsigned* arrived,
                          float* result) {
    __shared__ float scratch[kWarp];
    __shared__ bool is_last;
    const float4* fours = reinterpret_cast<const float4*>(values);
    const std::size_t quads = count / 4, stride = std::size_t{gridDim.x} * blockDim.x;
    const std::size_t first = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x;
    float4 sum = make_float4(0, 0, 0, 0);
    std::size_t i = first;
    for (; i + 3 * stride < quads; i += 4 * stride) {
        const float4 a = __ldg(fours + i), b = __ldg(fours + i + stride);
        const float4 c = __ldg(fours + i + 2 * stride), d = __ldg(fours + i + 3 * stride);
        sum.x += (a.x + b.x) + (c.x + d.x);
        sum.y += (a.y + b.y) + (c.y + d.y);
        sum.z += (a.z + b.z) + (c.z + d.z);
        sum.w += (a.w + b.w) + (c.w + d.w);
    }
    for (; i < quads; i += stride) {
        const float4 a = __ldg(fours + i);
        sum.x += a.x;
        sum.y += a.y;
        sum.z += a.z;
        sum.w += a.w;
    }
    float own = (sum.x + sum.y) + (sum.z + sum.w);
    if (first < count % 4) own += __ldg(values + 4 * quads + first);
    const float of_block = blockTotal<Add>(own, scratch);
    if (threadIdx.x == 0) of_blocks[blockIdx.x] = of_block;
    if (!isLastBlock(arrived, &is_last)) return;
    float total = 0;
    for (unsigned k = threadIdx.x; k < gridDim.x; k += blockDim.x) total += __ldcg(of_blocks + k);
    total = blockTotal<Add>(total, scratch);
    if (threadIdx.x == 0) *result = total;
}

/// The most roundings that a number of sumKernel goes through.
inline double sumAdditions(std::size_t count, unsigned blocks, unsigned threads) {
    const double of_thread = std::ceil(static_cast<double>(count / 4) / (double(blocks) * threads));
    return of_thread + 2 + 2 + 1 + 10 + std::ceil(double(blocks) / threads) + 10;
}

/// Running box of a thread.
struct ThreadBox {
    float low[3], high[3];
    __device__ ThreadBox() {
        for (int k = 0; k < 3; ++k) {
            low[k] = Least::neutral();
            high[k] = Most::neutral();
        }
    }
    __device__ void take(int axis, float value) {
        low[axis] = fminf(low[axis], value);
        high[axis] = fmaxf(high[axis], value);
    }
};

// Layout of points in memory, and the part of them that a load takes.

/// x y z x y z …, by loads of 4 bytes.
struct PointsAos {
    static constexpr std::size_t kAtOnce = 1;
    static __device__ void take(ThreadBox& box, const float* points, std::size_t, std::size_t i) {
        for (int k = 0; k < 3; ++k) box.take(k, __ldg(points + 3 * i + k));
    }
};
/// The same, four points by three loads of 16 bytes.
struct PointsAosWide {
    static constexpr std::size_t kAtOnce = 4;
    static __device__ void take(ThreadBox& box, const float* points, std::size_t, std::size_t i) {
        const float4* fours = reinterpret_cast<const float4*>(points) + 3 * i;
        const float4 a = __ldg(fours), b = __ldg(fours + 1), c = __ldg(fours + 2);
        box.take(0, a.x), box.take(1, a.y), box.take(2, a.z), box.take(0, a.w);
        box.take(1, b.x), box.take(2, b.y), box.take(0, b.z), box.take(1, b.w);
        box.take(2, c.x), box.take(0, c.y), box.take(1, c.z), box.take(2, c.w);
    }
};
/// x x … y y … z z …, each array `pitch` numbers long, by loads of 4 bytes.
struct PointsSoa {
    static constexpr std::size_t kAtOnce = 1;
    static __device__ void take(ThreadBox& box, const float* points, std::size_t pitch, std::size_t i) {
        for (int k = 0; k < 3; ++k) box.take(k, __ldg(points + k * pitch + i));
    }
};
/// The same, four points by three loads of 16 bytes; `pitch` is a multiple of 4.
struct PointsSoaWide {
    static constexpr std::size_t kAtOnce = 4;
    static __device__ void take(ThreadBox& box, const float* points, std::size_t pitch, std::size_t i) {
        for (int k = 0; k < 3; ++k) {
            const float4 a = __ldg(reinterpret_cast<const float4*>(points + k * pitch) + i);
            box.take(k, a.x), box.take(k, a.y), box.take(k, a.z), box.take(k, a.w);
        }
    }
};

/// Box of `count` points, a multiple of what Points takes at once; the program fills up with the last
/// point.
template <typename Points>
__global__ void boxKernel(const float* points, std::size_t count, std::size_t pitch, float* of_blocks,
                          unsigned* arrived, float* result) {
    __shared__ float scratch[kWarp];
    __shared__ bool is_last;
    ThreadBox box;
    const std::size_t groups = count / Points::kAtOnce, stride = std::size_t{gridDim.x} * blockDim.x;
    for (std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x; i < groups; i += stride)
        Points::take(box, points, pitch, i);
    for (int k = 0; k < 3; ++k) {
        const float low = blockTotal<Least>(box.low[k], scratch);
        const float high = blockTotal<Most>(box.high[k], scratch);
        if (threadIdx.x == 0) {
            of_blocks[6 * blockIdx.x + k] = low;
            of_blocks[6 * blockIdx.x + 3 + k] = high;
        }
    }
    if (!isLastBlock(arrived, &is_last)) return;
    for (int k = 0; k < 6; ++k) {
        float value = k < 3 ? Least::neutral() : Most::neutral();
        for (unsigned block = threadIdx.x; block < gridDim.x; block += blockDim.x) {
            const float other = __ldcg(of_blocks + 6 * block + k);
            value = k < 3 ? fminf(value, other) : fmaxf(value, other);
        }
        value = k < 3 ? blockTotal<Least>(value, scratch) : blockTotal<Most>(value, scratch);
        if (threadIdx.x == 0) result[k] = value;
    }
}

/// A table that all threads read, each at the same place at the same time.
__constant__ float4 constant_table[3 * kConstantTriangles];

__device__ inline void unpack(float4 a, float4 b, float4 c, float* t) {
    t[0] = a.x, t[1] = a.y, t[2] = a.z, t[3] = b.x, t[4] = b.y, t[5] = b.z, t[6] = c.x, t[7] = c.y,
    t[8] = c.z;
}
struct FetchConstant {
    __device__ void operator()(std::uint32_t i, float* t) const {
        unpack(constant_table[3 * i], constant_table[3 * i + 1], constant_table[3 * i + 2], t);
    }
};
struct FetchGlobal {
    const float4* table;
    __device__ void operator()(std::uint32_t i, float* t) const {
        unpack(__ldg(table + 3 * i), __ldg(table + 3 * i + 1), __ldg(table + 3 * i + 2), t);
    }
};
struct FetchGlobalArrays {
    const float* arrays;
    std::uint32_t count;
    __device__ void operator()(std::uint32_t i, float* t) const {
        for (int k = 0; k < 9; ++k) t[k] = __ldg(arrays + k * count + i);
    }
};
struct FetchShared {
    const float4* table;
    __device__ void operator()(std::uint32_t i, float* t) const {
        unpack(table[3 * i], table[3 * i + 1], table[3 * i + 2], t);
    }
};

/// Every ray against every triangle; a ray a thread.
template <typename Fetch>
__global__ void sweepKernel(Fetch fetch, std::uint32_t triangles, std::uint32_t rays,
                            std::uint32_t* nearest) {
    const std::uint32_t index = blockIdx.x * blockDim.x + threadIdx.x;
    if (index < rays) nearest[index] = nearestOf(rayAt(index), triangles, fetch);
}

/// The same, from shared memory, which the block fills first: at most `most` triangles.
template <std::uint32_t most>
__global__ void sweepSharedKernel(const float4* table, std::uint32_t triangles, std::uint32_t rays,
                                  std::uint32_t* nearest) {
    __shared__ float4 copy[3 * most];
    for (std::uint32_t i = threadIdx.x; i < 3 * triangles; i += blockDim.x) copy[i] = __ldg(table + i);
    __syncthreads();
    const std::uint32_t index = blockIdx.x * blockDim.x + threadIdx.x;
    if (index < rays) nearest[index] = nearestOf(rayAt(index), triangles, FetchShared{copy});
}

/// Copies 16 bytes a thread and turn.
__global__ void copyKernel(const float4* from, float4* to, std::size_t quads) {
    const std::size_t stride = std::size_t{gridDim.x} * blockDim.x;
    for (std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x; i < quads; i += stride)
        to[i] = __ldg(from + i);
}

}  // namespace paper
