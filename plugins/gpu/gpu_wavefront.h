/// Paths advanced by separate kernels for tracing and for shading (kernel/schedule/wavefront.h).
#pragma once

#include "gpu_device.h"
#include "gpu_program.h"
#include "wave_plan.h"

#include "backend/sdk/launch_pacer.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace crt::gpu {

/// A film on the device, or a row of films of the same shape, one per slice.
struct GpuFilm {
    GpuBuffer sums, counts, primitives;
    std::uint64_t bytes() const { return sums.bytes + counts.bytes + primitives.bytes; }
};

/// The input and the target of a launch, on the device.
struct LaunchTarget {
    const kernel::CrtScene& scene;  ///< The blob's header.
    const GpuBuffer& blob;
    const GpuFilm& film;
    const GpuBuffer& rays;
};

class Wavefront {
public:
    /// `blob`: a compiled scene. Memory is taken by the launches.
    Wavefront(GpuDevice& device, const void* blob);

    const WavePlan& plan() const { return plan_; }
    std::uint64_t bytes() const { return rows_.bytes + words_.bytes; }

    /// The number of slices possible if this number of blocks of pixels lie side by side.
    std::uint32_t mostSlices(std::uint64_t blocks_across) const;

    /// Takes all samples of a launch, each of `slices` equal parts into a separate film. `kernels`: those of
    /// plan(). Waits for the end, and calls `meanwhile` between passes, which may throw. Throws
    /// PluginError: CRT_OUT_OF_MEMORY before anything is added.
    void launch(const std::vector<GpuKernel>& kernels, const Launch& launch, std::uint32_t slices,
                const LaunchTarget& target, const std::function<void()>& meanwhile);

private:
    /// Room for at least this number of slots, or for as many as memory allows.
    std::uint64_t ensureSlots(std::uint64_t wanted, std::uint64_t least);
    kernel::CrtWave waveOf(const Launch& part, std::uint32_t slices, const LaunchTarget& target) const;
    /// CRT_WAVE_ARGUMENTS of cuda_dialect.h or opencl_dialect.h.
    GpuArguments argumentsOf(const kernel::CrtWave& wave, const LaunchTarget& target) const;
    void runPass(const std::vector<GpuKernel>& kernels, const kernel::CrtWave& wave,
                 const LaunchTarget& target, std::uint32_t pass) const;
    void runWave(const std::vector<GpuKernel>& kernels, const kernel::CrtWave& wave,
                 const LaunchTarget& target, const std::function<void()>& meanwhile) const;

    GpuDevice& device_;
    WavePlan plan_;
    std::uint32_t row_count_, queue_count_;
    std::uint64_t slots_ = 0;  ///< That rows_ and words_ have room for.
    GpuBuffer rows_, words_;
    GpuBuffer header_;  ///< The wave, for devices that take no structs as arguments.
};

}  // namespace crt::gpu
