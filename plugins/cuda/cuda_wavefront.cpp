#include "cuda_wavefront.h"

#include "common/film_slices.h"

#include <algorithm>
#include <map>
#include <string>

namespace crt::cuda {

using plugin::divideUp;

namespace {

/// Slots of a wave: enough to fill any GPU many times over.
constexpr std::uint64_t kMostSlots = std::uint64_t{1} << 22;
/// Between two looks at how many slots are done. A pass without any costs a few microseconds.
constexpr std::uint32_t kPassesAtOnce = 4;

template <class Row>
const Row* rowsOf(const void* blob, const kernel::CrtSpan& span) {
    using kernel::u64;
    return CRT_ARRAY(Row, static_cast<const unsigned char*>(blob), span);
}

template <class T>
T* onDevice(CUdeviceptr address) {
    return reinterpret_cast<T*>(address);
}

}  // namespace

namespace {

/// What some materials have and others lack.
constexpr std::uint64_t kOfMaterials = CRT_FEATURES_MATERIALS | CRT_FEATURE_THIN_FILM |
                                       CRT_FEATURE_ANISOTROPY | CRT_FEATURE_NORMAL_MAP | CRT_FEATURE_FUZZ |
                                       CRT_FEATURE_CLEARCOAT | CRT_FEATURE_ROUGH_BASE;

/// Of these, what the material of that number has.
std::uint64_t featuresOfMaterial(const void* blob, std::uint32_t number) {
    using namespace kernel;
    const auto& scene = *static_cast<const CrtScene*>(blob);
    const CrtMaterial& material = rowsOf<CrtMaterial>(blob, scene.materials)[number];
    std::uint64_t features = std::uint64_t{1} << material.type;
    const auto note = [&](std::uint64_t feature, bool has) { features |= has ? feature : 0; };
    note(CRT_FEATURE_THIN_FILM, material.film_thickness != 0);
    note(CRT_FEATURE_ANISOTROPY, material.narrowing > 0);
    if (scene.compositions.count != 0)
        note(CRT_FEATURE_NORMAL_MAP,
             rowsOf<CrtComposition>(blob, scene.compositions)[number].normal_map != 0);
    if (scene.layers.count != 0) {
        const CrtLayers& layers = rowsOf<CrtLayers>(blob, scene.layers)[number];
        note(CRT_FEATURE_FUZZ, layers.fuzz_weight > 0);
        note(CRT_FEATURE_CLEARCOAT, layers.clear_ior != 0);
        note(CRT_FEATURE_ROUGH_BASE, layers.base_loss != 0);
    }
    return features;
}

}  // namespace

WavePlan planWave(const void* blob) {
    using namespace kernel;
    const auto& scene = *static_cast<const CrtScene*>(blob);
    const auto* materials = rowsOf<CrtMaterial>(blob, scene.materials);
    const auto* compositions = rowsOf<CrtComposition>(blob, scene.compositions);
    const std::uint64_t others = scene.features & ~kOfMaterials;
    WavePlan plan;
    plan.kernels.push_back({Entry::Trace, scene.features});
    std::map<std::uint32_t, std::uint64_t> kinds;
    bool mixes = false;
    for (std::uint32_t i = 0; i < scene.materials.count; ++i) {
        if (scene.compositions.count != 0 && compositions[i].kind != CRT_COMPOSED_PLAIN)
            mixes = true;
        else if ((CRT_FEATURES_MATERIALS >> materials[i].type & 1) != 0)  // 0: nothing is made of it
            kinds[materials[i].type] |= featuresOfMaterial(blob, i);
    }
    for (const auto& [kind, features] : kinds) {
        plan.queue_of_kind[kind] = plan.queues();
        plan.kernels.push_back({Entry::Shade, others | features});
    }
    if ((scene.features & (CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_POINT_LIGHT)) != 0) {
        plan.queue_of_miss = plan.queues();
        plan.kernels.push_back({Entry::Shade, others});
    }
    if (mixes) {
        plan.queue_of_mix = plan.queues();
        plan.kernels.push_back({Entry::Choose, others});
    }
    return plan;
}

Wavefront::Wavefront(const Device& device, const void* blob)
    : device_(device),
      plan_(planWave(blob)),
      row_count_(CRT_WAVE_ROWS(static_cast<const kernel::CrtScene*>(blob)->features)) {}

std::uint64_t Wavefront::bytesPerSlot() const {
    const std::uint64_t words = CRT_WAVE_WORDS(1, plan_.queues()) - CRT_WAVE_WORDS(0, plan_.queues());
    return row_count_ * sizeof(kernel::vec4) + words * sizeof(std::uint32_t);
}

std::uint32_t Wavefront::mostSlices(std::uint64_t blocks_across) const {
    return static_cast<std::uint32_t>(
        std::max<std::uint64_t>(1, kMostSlots / CRT_WAVE_BLOCK / std::max<std::uint64_t>(blocks_across, 1)));
}

std::uint64_t Wavefront::ensureSlots(std::uint64_t wanted, std::uint64_t least) {
    if (wanted <= slots_) return slots_;
    std::size_t free_bytes = 0, all_bytes = 0;
    driver().check(driver().cuMemGetInfo(&free_bytes, &all_bytes), "asking for free memory");
    const std::uint64_t budget =
        std::min<std::uint64_t>(device_.memory_bytes / 16, (free_bytes + bytes()) / 2);
    wanted = std::max(std::min({wanted, budget / bytesPerSlot(), kMostSlots}), least);
    wanted = wanted / CRT_WAVE_BLOCK * CRT_WAVE_BLOCK;
    if (wanted <= slots_) return slots_;
    // The old ones go first: two need not fit side by side.
    slots_ = 0;
    rows_ = Memory();
    words_ = Memory();
    const char* what = "the paths of a wave";
    try {
        requireFree(wanted * bytesPerSlot(), device_, what);
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
    kernel::CrtWave wave{};
    wave.x0 = launch.x0;
    wave.y0 = launch.y0;
    wave.x1 = launch.x1;
    wave.y1 = launch.y1;
    wave.first_sample = launch.first_sample;
    wave.sample_count = launch.sample_count;
    wave.slices = slices;
    kernel::crt_wave_lay_out(&wave, plan_.queues(), onDevice<kernel::vec4>(rows_.address()),
                             onDevice<kernel::u32>(words_.address()));
    wave.sums = onDevice<kernel::f64>(target.sums);
    wave.counts = onDevice<kernel::u64>(target.counts);
    wave.primitives = onDevice<kernel::u32>(target.primitives);
    wave.rays = onDevice<kernel::u64>(target.rays);
    std::copy(std::begin(plan_.queue_of_kind), std::end(plan_.queue_of_kind), wave.queue_of_kind);
    wave.queue_of_mix = plan_.queue_of_mix;
    wave.queue_of_miss = plan_.queue_of_miss;
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
    // How long a queue is the device alone knows: as many blocks as it holds at once take turns.
    const auto most = [&](const Module& kernel) {
        return std::min(blocks, kernel.residentBlocks() * device_.multiprocessors);
    };
    std::uint32_t shaders = plan_.queues();
    if (plan_.queue_of_mix != CRT_NONE) {
        --shaders;
        cuda.check(cuda.cuLaunchKernel(kernels.back().kernel(), most(kernels.back()), 1, 1, kBlock, 1, 1, 0,
                                       nullptr, trace_arguments, nullptr),
                   "launching the kernel that chooses materials");
    }
    for (std::uint32_t queue = 0; queue < shaders; ++queue) {
        const Module& shader = kernels[queue + 1];
        void* shade_arguments[] = {&scene, &wave, &blob, &pass, &queue};
        cuda.check(cuda.cuLaunchKernel(shader.kernel(), most(shader), 1, 1, kBlock, 1, 1, 0, nullptr,
                                       shade_arguments, nullptr),
                   "launching a kernel that shades");
    }
}

void Wavefront::runWave(const std::vector<Module>& kernels, const kernel::CrtScene& scene,
                        const kernel::CrtWave& wave, CUdeviceptr blob) const {
    const Driver& cuda = driver();
    const auto finished = reinterpret_cast<CUdeviceptr>(wave.finished);
    cuda.check(cuda.cuMemsetD8(reinterpret_cast<CUdeviceptr>(wave.lengths), 0,
                               CRT_WAVE_WORDS(0, plan_.queues()) * sizeof(std::uint32_t)),
               "clearing the queues");
    // No sample takes fewer passes than one, and the last is added in one more.
    std::uint64_t passes = divideUp(wave.sample_count, wave.slices) + 1;
    std::uint32_t pass = 0, done = 0;
    while (done < wave.slots) {
        for (; passes != 0; --passes) runPass(kernels, scene, wave, blob, pass++);
        cuda.check(cuda.cuMemcpyDtoH(&done, finished, sizeof done), "rendering on '" + device_.name + "'");
        passes = kPassesAtOnce;
    }
}

void Wavefront::launch(const std::vector<Module>& kernels, const kernel::CrtScene& scene,
                       const Launch& launch, std::uint32_t slices, const WaveTarget& target) {
    // Slots of one row of blocks, and rows of blocks that there is room for.
    const std::uint64_t across = divideUp(launch.x1 - launch.x0, kBlockWidth) * slices * CRT_WAVE_BLOCK;
    const std::uint64_t down = divideUp(launch.y1 - launch.y0, kBlockHeight);
    const std::uint64_t slots = ensureSlots(std::min(across * down, std::max(kMostSlots, across)), across);
    const auto rows = static_cast<std::uint32_t>(std::max<std::uint64_t>(1, slots / across) * kBlockHeight);
    for (std::uint32_t y = launch.y0; y < launch.y1; y += rows) {
        Launch part = launch;
        part.y0 = y;
        part.y1 = std::min(launch.y1, y + rows);
        runWave(kernels, scene, waveOf(part, slices, target), target.blob);
    }
}

}  // namespace crt::cuda
