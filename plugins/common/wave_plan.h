/// The kernels that the waves of a scene need, and the materials that each of them shades
/// (kernel/schedule/wavefront.h).
#pragma once

#include "kernel_spec.h"

#include "backend/sdk/launch_pacer.h"
#include "kernel/dialect/features.h"
#include "kernel/dialect/layout.h"
#include "kernel/schedule/wavefront.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <vector>

namespace crt::plugin {

struct WavePlan {
    /// crt_trace; the shader of queue 0, of queue 1, …; where there are mixes or panes, crt_choose_queue,
    /// whose queue is the last.
    std::vector<KernelSpec> kernels;
    std::uint32_t queue_of_kind[32] = {};
    std::uint32_t queue_of_choice = CRT_NONE, queue_of_miss = CRT_NONE;
    std::uint32_t queues() const { return static_cast<std::uint32_t>(kernels.size() - 1); }
    /// Queues that are shaded: all but that of choices.
    std::uint32_t shaders() const { return queues() - (queue_of_choice != CRT_NONE ? 1 : 0); }
    /// Bytes that a slot of this number of rows takes on the device.
    std::uint64_t bytesPerSlot(std::uint32_t rows) const {
        return rows * sizeof(kernel::vec4) +
               (CRT_WAVE_WORDS(1, queues()) - CRT_WAVE_WORDS(0, queues())) * sizeof(std::uint32_t);
    }
};

namespace wave_plan {

template <class Row>
const Row* rowsOf(const void* blob, const kernel::CrtSpan& span) {
    using kernel::u64;
    return CRT_ARRAY(Row, static_cast<const unsigned char*>(blob), span);
}

/// Features that some materials have and others lack.
constexpr std::uint64_t kOfMaterials = CRT_FEATURES_MATERIALS | CRT_FEATURE_THIN_FILM |
                                       CRT_FEATURE_ANISOTROPY | CRT_FEATURE_NORMAL_MAP | CRT_FEATURE_FUZZ |
                                       CRT_FEATURE_CLEARCOAT | CRT_FEATURE_ROUGH_BASE;

/// Of these, what the material of that number has.
inline std::uint64_t featuresOfMaterial(const void* blob, std::uint32_t number) {
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

}  // namespace wave_plan

/// `blob`: a compiled scene (kernel/dialect/layout.h).
inline WavePlan planWave(const void* blob) {
    using namespace kernel;
    using namespace wave_plan;
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
    // crt_wave_choose also decides which rays pass a pane.
    const auto panes = kinds.find(CRT_MATERIAL_THIN_DIELECTRIC);
    if (mixes || panes != kinds.end()) {
        plan.queue_of_choice = plan.queues();
        plan.kernels.push_back({Entry::Choose, others | (panes != kinds.end() ? panes->second : 0)});
    }
    return plan;
}

/// The wave of a launch, but for where it is kept and what it adds to. `slices`: films side by side.
inline kernel::CrtWave waveOf(const WavePlan& plan, const Launch& launch, std::uint32_t slices) {
    kernel::CrtWave wave{};
    wave.x0 = launch.x0;
    wave.y0 = launch.y0;
    wave.x1 = launch.x1;
    wave.y1 = launch.y1;
    wave.first_sample = launch.first_sample;
    wave.sample_count = launch.sample_count;
    wave.slices = slices;
    std::copy(std::begin(plan.queue_of_kind), std::end(plan.queue_of_kind), wave.queue_of_kind);
    wave.queue_of_choice = plan.queue_of_choice;
    wave.queue_of_miss = plan.queue_of_miss;
    return wave;
}

/// Calls `run(part)` with the launch in bands of rows of pixels such that their slots fit `slots`; `across`:
/// slots that one row of blocks takes.
template <class Run>
void inBands(const Launch& launch, std::uint64_t slots, std::uint64_t across, Run&& run) {
    const auto rows =
        static_cast<std::uint32_t>(std::max<std::uint64_t>(1, slots / across) * CRT_WAVE_BLOCK_HEIGHT);
    for (std::uint32_t y = launch.y0; y < launch.y1; y += rows) {
        Launch part = launch;
        part.y0 = y;
        part.y1 = std::min(launch.y1, y + rows);
        run(part);
    }
}

/// Runs passes until all slots of a wave are done. `pass(number)` starts one; `done()` waits for those that
/// were started and says how many slots are done. It may throw: then the wave stays as it is.
template <class Pass, class Done>
void runPasses(const kernel::CrtWave& wave, Pass&& pass, Done&& done) {
    /// Between two looks at how many slots are done. A pass without any costs a few microseconds.
    constexpr std::uint32_t kPassesAtOnce = 4;
    // No sample takes fewer passes than one, and the last is added in one more.
    std::uint64_t passes = (std::uint64_t{wave.sample_count} + wave.slices - 1) / wave.slices + 1;
    std::uint32_t number = 0;
    do {
        for (; passes != 0; --passes) pass(number++);
        passes = kPassesAtOnce;
    } while (done() < wave.slots);
}

}  // namespace crt::plugin
