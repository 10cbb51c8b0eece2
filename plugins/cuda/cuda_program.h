/// From what a scene needs to kernels that can be launched: the precompiled one at once, and the lean ones
/// from the disk cache or, compiled by separate processes, as soon as all are ready. They give the same
/// bits, so a render may go over from one to the other between launches.
#pragma once

#include "cuda_compile_process.h"
#include "cuda_device.h"
#include "cuda_lean_kernel.h"

#include "backend/sdk/plugin_guard.h"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace crt::cuda {

/// Threads of a block and the pixels that it covers, as in kernels.cu.
constexpr std::uint32_t kBlock = 128, kBlockWidth = 16, kBlockHeight = 8;
/// Pairs of ray counters, as in kernels.cu.
constexpr std::uint32_t kRayCounters = 1024;

/// The kernels of one loaded module.
class Module {
public:
    Module() = default;
    /// `image`: a CUBIN or a fat binary.
    Module(const void* image, const KernelSpec& spec, std::string name);
    Module(Module&& other) noexcept { *this = std::move(other); }
    Module& operator=(Module&& other) noexcept;
    ~Module();
    explicit operator bool() const { return module_ != nullptr; }

    /// That of spec().entry.
    CUfunction kernel() const { return kernel_; }
    /// Of Entry::Render and Entry::Trace; else null.
    CUfunction addSlices() const { return add_slices_; }
    const KernelSpec& spec() const { return spec_; }
    const std::string& name() const { return name_; }
    std::uint32_t registers() const { return registers_; }
    std::uint32_t spillBytes() const { return spill_bytes_; }
    /// Blocks of kernel() that one multiprocessor holds at once.
    std::uint32_t residentBlocks() const { return resident_blocks_; }

private:
    CUmodule module_ = nullptr;
    CUfunction kernel_ = nullptr, add_slices_ = nullptr;
    KernelSpec spec_;
    std::uint32_t registers_ = 0, spill_bytes_ = 0, resident_blocks_ = 1;
    std::string name_;
};

/// Opens NVRTC, which is a library of 100 MB, as far as that was not done before. A CudaProgram does so
/// itself; beside other work it costs no time. [any thread]
void openCompiler() noexcept;

/// The kernels for one scene on one device. Used by one thread at a time, the context current.
class CudaProgram {
public:
    /// `wanted`: the lean kernels. With CRT_KERNEL_FULL there are none.
    CudaProgram(const plugin::Host& host, const Device& device, std::vector<KernelSpec> wanted,
                CrtKernelChoice choice);
    CudaProgram(const CudaProgram&) = delete;
    CudaProgram& operator=(const CudaProgram&) = delete;

    /// The kernels to be launched by now: those wanted, in their order, once all are there; before that, and
    /// if they are not available, the precompiled crt_render alone.
    const std::vector<Module>& current();

    /// Goes on with the precompiled kernel, which gives the same image.
    void giveUp(const std::string& why);

    const std::vector<KernelSpec>& wanted() const { return wanted_; }
    /// All lean kernels came from the disk cache.
    bool fromCache() const { return from_cache_; }
    /// Times of the compilers, added up.
    double compileSeconds() const { return compile_seconds_; }
    double cacheSeconds() const { return cache_seconds_; }
    /// The kernels that ran: "precompiled, then NVRTC 13.0 sm_90".
    std::string description() const;

private:
    /// A lean kernel on its way.
    struct Pending {
        std::size_t index;  ///< In wanted_.
        plugin::KernelCache::Key key;
        std::unique_ptr<CompileProcess> process;
    };
    void takeFromCache(const std::string& text, const Nvrtc& compiler, const Device& device);
    void startCompilers();
    /// Takes what is ready. Throws std::runtime_error when a kernel cannot be compiled.
    void poll();
    void loadPrecompiled();

    plugin::Host host_;
    std::vector<KernelSpec> wanted_;
    CompileJob job_;  ///< But for the spec and the key.
    std::string lean_name_;
    std::vector<Module> precompiled_, lean_;
    std::vector<Pending> pending_;
    bool from_cache_ = false;
    double compile_seconds_ = 0, cache_seconds_ = 0;
};

}  // namespace crt::cuda
