/// From what a scene needs to kernels that can be launched: the precompiled one at once, and the lean ones
/// from the disk cache or, compiled by separate processes, as soon as all are ready. They give the same
/// bits, so a render may go over from one to the other between launches.
#pragma once

#include "cuda_compile_process.h"
#include "cuda_device.h"
#include "cuda_lean_kernel.h"

#include "backend/sdk/plugin_guard.h"
#include "gpu/gpu_program.h"

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace crt::cuda {

using gpu::GpuKernel;

/// Opens NVRTC, which is a library of 100 MB, as far as that was not done before. A CudaProgram does so
/// itself; beside other work it costs no time. [any thread]
void openCompiler() noexcept;

/// The kernels for one scene on one device. Used by one thread at a time, the context current.
class CudaProgram final : public gpu::GpuProgram {
public:
    /// `wanted`: the lean kernels; with CRT_KERNEL_FULL none is lean. The device must outlive it.
    CudaProgram(const plugin::Host& host, const Device& device, const gpu::Specs& wanted,
                CrtKernelChoice choice);

    /// Those wanted once all are there; before that, and if they are not available, the precompiled one.
    const std::vector<GpuKernel>& current() override;
    void giveUpWaves(const std::string& why) override;
    /// "precompiled, then NVRTC 13.0 sm_90".
    std::string description() const override;

private:
    /// A lean kernel on its way.
    struct Pending {
        std::size_t index;  ///< In wanted_.
        plugin::KernelCache::Key key;
        bool replaces;  ///< The driver refuses the kernel that is in the cache.
        std::unique_ptr<plugin::CompileProcess> process;
    };
    void takeFromCache(const std::string& text, const Nvrtc& compiler);
    void startCompilers();
    /// Takes what is ready. Throws std::runtime_error when a kernel cannot be compiled.
    void poll();
    /// Goes on with the precompiled kernel, which gives the same image.
    void giveUp(const std::string& why);
    void loadPrecompiled();

    plugin::Host host_;
    const Device& device_;
    CompileJob job_;  ///< But for the spec.
    std::string cache_directory_;
    std::string lean_name_;
    std::vector<GpuKernel> precompiled_, lean_;
    std::vector<Pending> pending_;
};

}  // namespace crt::cuda
