/// Paths advanced by separate kernels for tracing and for shading (kernel/schedule/wavefront.h).
#pragma once

#include "cuda_device.h"
#include "cuda_program.h"

#include "backend/sdk/launch_pacer.h"
#include "common/wave_plan.h"
#include "kernel/schedule/wavefront.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace crt::cuda {

/// The target of a wave, on the device.
struct WaveTarget {
    CUdeviceptr blob, sums, counts, primitives, rays;
};

/// Launches waves. The device's context is current.
class Wavefront {
public:
    Wavefront(const Device& device, const void* blob);

    const plugin::WavePlan& plan() const { return plan_; }
    std::uint64_t bytes() const { return rows_.bytes() + words_.bytes(); }

    /// The number of slices possible if this number of blocks of pixels lie side by side.
    std::uint32_t mostSlices(std::uint64_t blocks_across) const;

    /// Takes all samples of a launch, each of `slices` equal parts into a separate film. `kernels`: those of
    /// plan(). Waits for the end, and calls `meanwhile` between passes, which may throw. Throws
    /// PluginError: CRT_OUT_OF_MEMORY before anything is added.
    void launch(const std::vector<Module>& kernels, const kernel::CrtScene& scene, const Launch& launch,
                std::uint32_t slices, const WaveTarget& target, const std::function<void()>& meanwhile);

private:
    /// Room for at least this number of slots, or for as many as memory allows.
    std::uint64_t ensureSlots(std::uint64_t wanted, std::uint64_t least);
    kernel::CrtWave waveOf(const Launch& launch, std::uint32_t slices, const WaveTarget& target) const;
    void runPass(const std::vector<Module>& kernels, kernel::CrtScene scene, kernel::CrtWave wave,
                 CUdeviceptr blob, std::uint32_t pass) const;
    void runWave(const std::vector<Module>& kernels, const kernel::CrtScene& scene,
                 const kernel::CrtWave& wave, CUdeviceptr blob,
                 const std::function<void()>& meanwhile) const;

    const Device& device_;
    plugin::WavePlan plan_;
    std::uint32_t row_count_;
    std::uint64_t slots_ = 0;  ///< That rows_ and words_ have room for.
    Memory rows_, words_;
};

}  // namespace crt::cuda
