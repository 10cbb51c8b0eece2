/// The kernels that the waves of a scene need, and the materials that each of them shades
/// (kernel/schedule/wavefront.h).
#pragma once

#include "gpu_program.h"

#include "kernel/dialect/features.h"
#include "kernel/dialect/layout.h"
#include "kernel/schedule/wavefront.h"

#include <cstdint>
#include <map>
#include <vector>

namespace crt::gpu {

struct WavePlan {
    /// crt_trace; the shader of queue 0, of queue 1, …; where there are mixes or panes, crt_choose_queue,
    /// whose queue is the last.
    Specs kernels;
    std::uint32_t queue_of_kind[CRT_MATERIAL_NUMBERS] = {};
    std::uint32_t queue_of_choice = CRT_NONE, queue_of_miss = CRT_NONE;
    /// The only queue that crt_choose_queue fills; CRT_NONE where it fills several.
    std::uint32_t chosen_queue = CRT_NONE;
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
constexpr std::uint64_t kOfMaterials =
    CRT_FEATURES_MATERIALS | CRT_FEATURE_THIN_FILM | CRT_FEATURE_ANISOTROPY | CRT_FEATURE_NORMAL_MAP |
    CRT_FEATURE_FUZZ | CRT_FEATURE_CLEARCOAT | CRT_FEATURE_ROUGH_BASE | CRT_FEATURE_TRANSLUCENT;

/// Of these, what the material of that number has.
inline std::uint64_t featuresOfMaterial(const void* blob, std::uint32_t number) {
    using namespace kernel;
    const auto& scene = *static_cast<const CrtScene*>(blob);
    const CrtMaterial& material = rowsOf<CrtMaterial>(blob, scene.materials)[number];
    std::uint64_t features = std::uint64_t{1} << material.type;
    const auto note = [&](std::uint64_t feature, bool has) { features |= has ? feature : 0; };
    note(CRT_FEATURE_THIN_FILM, material.film_thickness != 0);
    note(CRT_FEATURE_ANISOTROPY, material.narrowing > 0);
    note(CRT_FEATURE_TRANSLUCENT, (material.flags & CRT_MATERIAL_TRANSLUCENT) != 0);
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
        // Where no surface is mixed or has holes, a ray that passes no pane meets one.
        if (scene.compositions.count == 0)
            plan.chosen_queue = plan.queue_of_kind[CRT_MATERIAL_THIN_DIELECTRIC];
        plan.kernels.push_back({Entry::Choose, others | (panes != kinds.end() ? panes->second : 0)});
    }
    return plan;
}

}  // namespace crt::gpu
