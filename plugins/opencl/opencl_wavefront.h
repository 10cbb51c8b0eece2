/// Paths advanced by separate kernels for tracing and for shading (kernel/schedule/wavefront.h).
#pragma once

#include "opencl_device.h"
#include "opencl_program.h"

#include "backend/sdk/launch_pacer.h"
#include "common/wave_plan.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace crt::opencl {

/// True if scenes of many materials are rendered in waves there: on GPUs. On a processor the lanes do not
/// wait for each other, and waves cost a fifth to a third (docs/decisions/0044-waves-for-opencl.md); with
/// CRT_OPENCL_WAVES=1 in the environment it takes them too, so that tests and measurements can. Everywhere,
/// where a path may outlast a launch (backend/sdk/gpu_schedule.h).
bool takesWaves(const Device& device, std::uint32_t max_depth);

/// The input and the target of a wave, on the device.
struct WaveTarget {
    cl_mem scene, sums, counts, primitives, rays;
};

/// Launches waves. The film has one slice: that of crt_render.
class Wavefront {
public:
    /// Makes a buffer of this size for the purpose in the sentence. Throws PluginError: CRT_OUT_OF_MEMORY.
    using Allocate = std::function<Buffer(std::uint64_t bytes, const char* what)>;

    /// `blob`: a compiled scene. Takes the memory of its slots: as many as its film fills, or as the device
    /// should hold at once.
    Wavefront(const Device& device, const Session& session, const void* blob, const Allocate& allocate);

    const plugin::WavePlan& plan() const { return plan_; }

    /// Takes all samples of a launch. `kernels`: those of plan(). Waits for the end, and calls `meanwhile`
    /// between passes, which may throw.
    void launch(const std::vector<Program>& kernels, const Launch& launch, const WaveTarget& target,
                const std::function<void()>& meanwhile) const;

private:
    void runWave(const std::vector<Program>& kernels, const kernel::CrtWave& wave,
                 const std::function<void()>& meanwhile) const;
    void run(const Program& program, std::uint64_t groups) const;

    const Device& device_;
    const Session& session_;
    plugin::WavePlan plan_;
    std::uint64_t slots_ = 0;
    Buffer header_, rows_, words_;
};

}  // namespace crt::opencl
