#include "cuda_wavefront.h"

#include "common/film_slices.h"

#include <algorithm>
#include <string>

namespace crt::cuda {

using plugin::divideUp;

namespace {

/// Slots of a wave: enough to fill any GPU many times over.
constexpr std::uint64_t kMostSlots = std::uint64_t{1} << 22;

template <class T>
T* onDevice(CUdeviceptr address) {
    return reinterpret_cast<T*>(address);
}

}  // namespace

Wavefront::Wavefront(const Device& device, const void* blob)
    : device_(device),
      plan_(plugin::planWave(blob)),
      row_count_(kernel::crt_wave_rows(static_cast<const kernel::CrtScene*>(blob)->features)) {}

std::uint32_t Wavefront::mostSlices(std::uint64_t blocks_across) const {
    return static_cast<std::uint32_t>(
        std::max<std::uint64_t>(1, kMostSlots / CRT_WAVE_BLOCK / std::max<std::uint64_t>(blocks_across, 1)));
}

std::uint64_t Wavefront::ensureSlots(std::uint64_t wanted, std::uint64_t least) {
    if (wanted <= slots_) return slots_;
    std::size_t free_bytes = 0, all_bytes = 0;
    driver().check(driver().cuMemGetInfo(&free_bytes, &all_bytes), "querying free memory");
    const std::uint64_t budget =
        std::min<std::uint64_t>(device_.memory_bytes / 16, (free_bytes + bytes()) / 2);
    wanted = std::max(std::min({wanted, budget / plan_.bytesPerSlot(row_count_), kMostSlots}), least);
    wanted = wanted / CRT_WAVE_BLOCK * CRT_WAVE_BLOCK;
    if (wanted <= slots_) return slots_;
    // The old ones go first: two need not fit side by side.
    slots_ = 0;
    rows_ = Memory();
    words_ = Memory();
    const char* what = "the paths of a wave";
    try {
        requireFree(wanted * plan_.bytesPerSlot(row_count_), device_, what);
        rows_ = Memory(wanted * row_count_ * sizeof(kernel::vec4), device_, what);
        words_ = Memory(CRT_WAVE_WORDS(wanted, plan_.queues()) * sizeof(std::uint32_t), device_, what);
    } catch (...) {
        rows_ = Memory();
        throw;
    }
    slots_ = wanted;
    return slots_;
}

kernel::CrtWave Wavefront::waveOf(const Launch& launch, std::uint32_t slices,
                                  const WaveTarget& target) const {
    kernel::CrtWave wave = plugin::waveOf(plan_, launch, slices);
    kernel::crt_wave_lay_out(&wave, plan_.queues(), onDevice<kernel::vec4>(rows_.address()),
                             onDevice<kernel::u32>(words_.address()));
    wave.sums = onDevice<kernel::f64>(target.sums);
    wave.counts = onDevice<kernel::u64>(target.counts);
    wave.primitives = onDevice<kernel::u32>(target.primitives);
    wave.rays = onDevice<kernel::u64>(target.rays);
    return wave;
}

void Wavefront::runPass(const std::vector<Module>& kernels, kernel::CrtScene scene, kernel::CrtWave wave,
                        CUdeviceptr blob, std::uint32_t pass) const {
    const Driver& cuda = driver();
    const unsigned blocks = wave.slots / CRT_WAVE_BLOCK;
    void* trace_arguments[] = {&scene, &wave, &blob, &pass};
    cuda.check(cuda.cuLaunchKernel(kernels.front().kernel(), blocks, 1, 1, kBlock, 1, 1, 0, nullptr,
                                   trace_arguments, nullptr),
               "launching the kernel that traces");
    // Only the device has the length of a queue: as many blocks as it holds at once take turns.
    const auto most = [&](const Module& kernel) {
        return std::min(blocks, kernel.residentBlocks() * device_.multiprocessors);
    };
    if (plan_.queue_of_choice != CRT_NONE)
        cuda.check(cuda.cuLaunchKernel(kernels.back().kernel(), most(kernels.back()), 1, 1, kBlock, 1, 1, 0,
                                       nullptr, trace_arguments, nullptr),
                   "launching the kernel that chooses materials");
    for (std::uint32_t queue = 0; queue < plan_.shaders(); ++queue) {
        const Module& shader = kernels[queue + 1];
        void* shade_arguments[] = {&scene, &wave, &blob, &pass, &queue};
        cuda.check(cuda.cuLaunchKernel(shader.kernel(), most(shader), 1, 1, kBlock, 1, 1, 0, nullptr,
                                       shade_arguments, nullptr),
                   "launching a kernel that shades");
    }
}

void Wavefront::runWave(const std::vector<Module>& kernels, const kernel::CrtScene& scene,
                        const kernel::CrtWave& wave, CUdeviceptr blob,
                        const std::function<void()>& meanwhile) const {
    const Driver& cuda = driver();
    const auto finished = reinterpret_cast<CUdeviceptr>(wave.finished);
    cuda.check(cuda.cuMemsetD8(reinterpret_cast<CUdeviceptr>(wave.lengths), 0,
                               CRT_WAVE_WORDS(0, plan_.queues()) * sizeof(std::uint32_t)),
               "clearing the queues");
    plugin::runPasses(
        wave, [&](std::uint32_t pass) { runPass(kernels, scene, wave, blob, pass); },
        [&] {
            std::uint32_t done = 0;
            cuda.check(cuda.cuMemcpyDtoH(&done, finished, sizeof done),
                       "rendering on '" + device_.name + "'");
            if (done < wave.slots) meanwhile();
            return done;
        });
}

void Wavefront::launch(const std::vector<Module>& kernels, const kernel::CrtScene& scene,
                       const Launch& launch, std::uint32_t slices, const WaveTarget& target,
                       const std::function<void()>& meanwhile) {
    // Slots of one row of blocks, and rows of blocks that there is room for.
    const std::uint64_t across = divideUp(launch.x1 - launch.x0, kBlockWidth) * slices * CRT_WAVE_BLOCK;
    const std::uint64_t down = divideUp(launch.y1 - launch.y0, kBlockHeight);
    const std::uint64_t slots = ensureSlots(std::min(across * down, std::max(kMostSlots, across)), across);
    plugin::inBands(launch, slots, across, [&](const Launch& part) {
        runWave(kernels, scene, waveOf(part, slices, target), target.blob, meanwhile);
    });
}

}  // namespace crt::cuda
