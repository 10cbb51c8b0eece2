/// Paths advanced by kernels of their own for tracing and for shading (kernel/wavefront.h).
#pragma once

#include "cuda_device.h"
#include "cuda_program.h"

#include "backend/sdk/launch_pacer.h"
#include "kernel/wavefront.h"

#include <cstdint>
#include <vector>

namespace crt::cuda {

/// The kernels that a scene's waves need, and who of them shades what.
struct WavePlan {
    /// crt_trace; the shader of queue 0, of queue 1, …; where there are mixes, crt_choose, whose queue is
    /// the last.
    std::vector<KernelSpec> kernels;
    std::uint32_t queue_of_kind[32] = {};
    std::uint32_t queue_of_mix = CRT_NONE, queue_of_miss = CRT_NONE;
    std::uint32_t queues() const { return static_cast<std::uint32_t>(kernels.size() - 1); }
};
/// `blob`: a compiled scene (kernel/layout.h).
WavePlan planWave(const void* blob);

/// What a wave adds to, on the device.
struct WaveTarget {
    CUdeviceptr blob, sums, counts, primitives, rays;
};

/// Launches waves. The device's context is current.
class Wavefront {
public:
    Wavefront(const Device& device, const void* blob);

    const WavePlan& plan() const { return plan_; }
    std::uint64_t bytes() const { return rows_.bytes() + words_.bytes(); }

    /// How many slices there may be where so many blocks of pixels lie side by side.
    std::uint32_t mostSlices(std::uint64_t blocks_across) const;

    /// Takes all samples of a launch, each of `slices` equal parts into a film of its own. `kernels`: those
    /// of plan(). Waits for the end. Throws PluginError: CRT_OUT_OF_MEMORY before anything is added.
    void launch(const std::vector<Module>& kernels, const kernel::CrtScene& scene, const Launch& launch,
                std::uint32_t slices, const WaveTarget& target);

private:
    std::uint64_t bytesPerSlot() const;
    /// Room for at least so many slots, or for as many as memory allows.
    std::uint64_t ensureSlots(std::uint64_t wanted, std::uint64_t least);
    kernel::CrtWave waveOf(const Launch& launch, std::uint32_t slices, const WaveTarget& target) const;
    void runPass(const std::vector<Module>& kernels, kernel::CrtScene scene, kernel::CrtWave wave,
                 CUdeviceptr blob, std::uint32_t pass) const;
    void runWave(const std::vector<Module>& kernels, const kernel::CrtScene& scene,
                 const kernel::CrtWave& wave, CUdeviceptr blob) const;

    const Device& device_;
    WavePlan plan_;
    std::uint32_t row_count_;
    std::uint64_t slots_ = 0;  ///< That rows_ and words_ have room for.
    Memory rows_, words_;
};

}  // namespace crt::cuda
