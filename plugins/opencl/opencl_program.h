/// From what a scene needs to kernels that can be launched: text, options, compiler, disk cache.
#pragma once

#include "opencl_device.h"

#include "backend/sdk/plugin_guard.h"
#include "gpu/gpu_program.h"

#include <cstdint>
#include <string>
#include <vector>

namespace crt::opencl {

/// Side of the square of pixels that a block of crt_render covers. One pixel on a CPU: paths part at once,
/// so work-items side by side share nothing, and PoCL's loop over them costs a fifth to a third of the speed
/// (measured with groups of 8 × 1 to 16 × 16). A GPU gets the square that two warps or one wavefront fill.
std::uint32_t blockSide(const Device& device);

/// Options that a kernel and a device are compiled with. No option that relaxes arithmetic: OpenCL's
/// defaults keep IEEE rounding.
std::string buildOptions(const Device& device, const gpu::KernelSpec& spec);

/// The kernels for one scene on one device, built beside each other.
class OpenClProgram final : public gpu::GpuProgram {
public:
    /// Waits for the compiler. With CRT_KERNEL_FULL `wanted` is the kernel with everything in. The device
    /// and the session must outlive it.
    OpenClProgram(const plugin::Host& host, const Device& device, const Session& session,
                  const gpu::Specs& wanted, CrtKernelChoice choice);

    const std::vector<gpu::GpuKernel>& current() override { return kernels_; }
    void giveUpWaves(const std::string& why) override;
    /// "lean kernel, 2 of 2 compute units".
    std::string description() const override;

private:
    void build(const gpu::Specs& specs);

    plugin::Host host_;
    const Device& device_;
    const Session& session_;
    CrtKernelChoice choice_;
    std::vector<gpu::GpuKernel> kernels_;
};

}  // namespace crt::opencl
