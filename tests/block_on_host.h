/// The words of CUDA that bench/paper_kernels.h uses, for a C++ compiler: the threads of a block are
/// threads of the host that wait for each other where a block's do, and the blocks of a grid run one after
/// another. It shows what kernels compute with barriers, shuffles and shared memory; nothing about their
/// speed.
#pragma once

#include <barrier>
#include <cmath>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

struct HostDim {
    unsigned x;
};
inline thread_local HostDim gridDim{1}, blockDim{1}, blockIdx{0}, threadIdx{0};

namespace block_on_host {
/// State that the threads of the running block share.
inline std::barrier<>* all_threads = nullptr;
inline std::vector<std::barrier<>*> warps;
inline std::vector<float> shuffled;
}  // namespace block_on_host

struct alignas(16) float4 {
    float x, y, z, w;
};
inline float4 make_float4(float x, float y, float z, float w) { return {x, y, z, w}; }
template <typename T>
T __ldg(const T* place) {
    return *place;
}
template <typename T>
T __ldcg(const T* place) {
    return *place;
}
inline void __syncthreads() { block_on_host::all_threads->arrive_and_wait(); }
inline void __threadfence() {}
inline float __shfl_down_sync(unsigned, float value, unsigned distance) {
    std::barrier<>& warp = *block_on_host::warps[threadIdx.x / 32];
    block_on_host::shuffled[threadIdx.x] = value;
    warp.arrive_and_wait();
    const unsigned from = threadIdx.x % 32 + distance;
    const float result = from < 32 ? block_on_host::shuffled[threadIdx.x + distance] : value;
    warp.arrive_and_wait();
    return result;
}
inline unsigned atomicInc(unsigned* place, unsigned most) {
    const unsigned old = *place;  // One block at a time, and one thread of it.
    *place = old >= most ? 0 : old + 1;
    return old;
}

#define __device__
#define __global__ inline
#define __shared__ static
#define __constant__ inline

/// Runs a kernel: kernel() is called by every thread of every block.
template <typename Kernel>
void runGrid(unsigned blocks, unsigned threads, const Kernel& kernel) {
    for (unsigned block = 0; block < blocks; ++block) {
        std::barrier<> all(threads);
        std::vector<std::unique_ptr<std::barrier<>>> warps;
        block_on_host::warps.clear();
        for (unsigned begin = 0; begin < threads; begin += 32) {
            warps.push_back(std::make_unique<std::barrier<>>(32));
            block_on_host::warps.push_back(warps.back().get());
        }
        block_on_host::all_threads = &all;
        block_on_host::shuffled.assign(threads, 0.0f);
        std::vector<std::jthread> running;
        for (unsigned thread = 0; thread < threads; ++thread)
            running.emplace_back([&, thread] {
                gridDim = {blocks};
                blockDim = {threads};
                blockIdx = {block};
                threadIdx = {thread};
                kernel();
            });
    }
}
