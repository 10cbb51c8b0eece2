#include "host_kernels.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "cuda_shim.h"

#include "kernel/schedule/wavefront.h"

#define CRT_ENTRIES 15  // all
#include "../../plugins/cuda/cuda_dialect.h"
#include "../../plugins/gpu/kernels.h"

namespace crt::cuda_on_host {
namespace {

/// kernel<<<grid, CRT_BLOCK>>>: blocks are dealt to `host_threads` threads, in no order that could be relied
/// on.
template <class Kernel>
void launchGrid(unsigned grid_x, unsigned grid_y, unsigned host_threads, const Kernel& kernel) {
    const std::uint64_t blocks = std::uint64_t{grid_x} * grid_y;
    std::atomic<std::uint64_t> next{0};
    const auto work = [&] {
        gridDim = {grid_x, grid_y, 1};
        blockDim = {CRT_BLOCK, 1, 1};
        for (std::uint64_t block; (block = next.fetch_add(1)) < blocks;) {
            blockIdx = {static_cast<unsigned>(block % grid_x), static_cast<unsigned>(block / grid_x), 0};
            for (unsigned thread = 0; thread < CRT_BLOCK; ++thread) {
                threadIdx = {thread, 0, 0};
                kernel();
            }
        }
    };
    // Fewer blocks are often done before another thread has started.
    constexpr std::uint64_t kBlocksOfThread = 16;
    std::vector<std::thread> threads;
    for (unsigned i = 1; i < std::min<std::uint64_t>(host_threads, blocks / kBlocksOfThread); ++i)
        threads.emplace_back(work);
    work();
    for (std::thread& thread : threads) thread.join();
}

// CUDA's 64-bit integer is unsigned long long, the host's unsigned long: the same bits by another name.
static_assert(sizeof(u64) == sizeof(std::uint64_t));
u64* device(std::uint64_t* pointer) { return reinterpret_cast<u64*>(pointer); }

CrtScene header(const void* blob) {
    CrtScene scene;
    std::memcpy(&scene, blob, sizeof scene);
    return scene;
}

/// Calls `kernel` with what the pointers point to, read as the types that it declares.
template <class... Parameters, std::size_t... I>
void callWith(void (*kernel)(Parameters...), void** arguments, std::index_sequence<I...>) {
    kernel(*static_cast<std::remove_const_t<Parameters>*>(arguments[I])...);
}
template <class... Parameters>
void launchWith(void (*kernel)(Parameters...), unsigned grid_x, unsigned grid_y, void** arguments,
                unsigned host_threads) {
    launchGrid(grid_x, grid_y, host_threads,
               [&] { callWith(kernel, arguments, std::index_sequence_for<Parameters...>{}); });
}

}  // namespace

bool hasKernel(const char* name) {
    for (const char* known :
         {"crt_render", "crt_add_slices", "crt_trace", "crt_choose_queue", "crt_shade_queue"})
        if (std::strcmp(name, known) == 0) return true;
    return false;
}

bool launchByName(const char* name, unsigned grid_x, unsigned grid_y, unsigned block, void** arguments,
                  unsigned host_threads) {
    if (!hasKernel(name) || block != CRT_BLOCK) return false;
    if (std::strcmp(name, "crt_render") == 0)
        launchWith(crt_render, grid_x, grid_y, arguments, host_threads);
    else if (std::strcmp(name, "crt_trace") == 0)
        launchWith(crt_trace, grid_x, grid_y, arguments, host_threads);
    else if (std::strcmp(name, "crt_choose_queue") == 0)
        launchWith(crt_choose_queue, grid_x, grid_y, arguments, host_threads);
    else if (std::strcmp(name, "crt_shade_queue") == 0)
        launchWith(crt_shade_queue, grid_x, grid_y, arguments, host_threads);
    else
        launchWith(crt_add_slices, grid_x, grid_y, arguments, host_threads);
    return true;
}

std::uint32_t rayCounterPairs() { return CRT_RAY_COUNTERS; }

void launchRender(const void* scene_blob, const Launch& launch, std::uint32_t slices,
                  const FilmPointers& film, std::uint64_t* rays, unsigned host_threads) {
    const CrtScene scene = header(scene_blob);
    const unsigned across = (launch.x1 - launch.x0 + CRT_BLOCK_WIDTH - 1) / CRT_BLOCK_WIDTH;
    const unsigned down = (launch.y1 - launch.y0 + CRT_BLOCK_HEIGHT - 1) / CRT_BLOCK_HEIGHT;
    launchGrid(across * down, slices, host_threads, [&] {
        crt_render(scene, static_cast<const unsigned char*>(scene_blob), launch.x0, launch.y0, launch.x1,
                   launch.y1, launch.first_sample, launch.sample_count, film.sums, device(film.counts),
                   film.primitives, device(film.splats), device(rays));
    });
}

void launchWave(const void* scene_blob, const Launch& launch, std::uint32_t slices, const FilmPointers& film,
                std::uint64_t* rays, unsigned host_threads) {
    const CrtScene scene = header(scene_blob);
    constexpr u32 kShaders = 2, kQueues = 3;  // This one shader does for all; the last queue is of mixes.
    CrtWave wave{};
    wave.x0 = launch.x0;
    wave.y0 = launch.y0;
    wave.x1 = launch.x1;
    wave.y1 = launch.y1;
    wave.first_sample = launch.first_sample;
    crt_wave_divide(&wave, launch.sample_count, slices);
    crt_wave_lay_out(&wave, kQueues, nullptr, nullptr);
    std::vector<vec4> rows(std::size_t{wave.slots} * crt_wave_rows(CRT_FEATURES_ALL));
    std::vector<u32> words(CRT_WAVE_WORDS(std::size_t{wave.slots}, kQueues));
    crt_wave_lay_out(&wave, kQueues, rows.data(), words.data());
    const unsigned blocks = wave.slots / CRT_WAVE_BLOCK;
    wave.sums = film.sums;
    wave.counts = device(film.counts);
    wave.primitives = film.primitives;
    wave.rays = device(rays);
    wave.queue_of_choice = kShaders;
    wave.queue_of_miss = scene.environment == CRT_NONE && scene.point_lights.count == 0 ? CRT_NONE : 1;
    const auto* blob = static_cast<const unsigned char*>(scene_blob);
    for (u32 pass = 0; *wave.finished < wave.slots; ++pass) {
        launchGrid(blocks, 1, host_threads, [&] { crt_trace(scene, wave, blob, pass); });
        launchGrid(blocks, 1, host_threads, [&] { crt_choose_queue(scene, wave, blob, pass); });
        for (u32 queue = 0; queue < kShaders; ++queue)
            launchGrid(blocks, 1, host_threads, [&] { crt_shade_queue(scene, wave, blob, pass, queue); });
    }
}

void launchAddSlices(const void* scene_blob, const Launch& launch, std::uint32_t slices,
                     const FilmPointers& film, const FilmPointers& parts, unsigned host_threads) {
    const CrtScene scene = header(scene_blob);
    const auto grid = static_cast<unsigned>((launch.pixels() * scene.channels + CRT_BLOCK - 1) / CRT_BLOCK);
    launchGrid(grid, 1, host_threads, [&] {
        crt_add_slices(launch.x0, launch.y0, launch.x1, launch.y1, scene.width, scene.height, scene.channels,
                       slices, film.sums, device(film.counts), film.primitives, parts.sums,
                       device(parts.counts), parts.primitives);
    });
}

}  // namespace crt::cuda_on_host
