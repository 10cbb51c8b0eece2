/// From a feature mask to a kernel that can be launched: the precompiled one at once, and the lean one from
/// the disk cache or, compiled by a process of its own, as soon as it is ready. Both give the same bits, so
/// a render may go over from one to the other between launches.
#pragma once

#include "cuda_compile_process.h"
#include "cuda_device.h"
#include "cuda_nvrtc.h"

#include "backend/sdk/kernel_cache.h"
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

/// The whole text that NVRTC compiles: the host's text of kernel/path.h, then kernels.cu.
std::string kernelText(const std::string& path_text);

/// How many blocks a multiprocessor should hold at once, in the order of trying: more hide latency better,
/// but leave each thread fewer registers. The first that spills at most kSpillBytesAllowed wins; the last is
/// not judged. A few spilled values cost less than a fourth block gains (docs/results/cuda.md); a fifth
/// gains where there is no tree to traverse (docs/decisions/0041-instruction-cache.md).
std::vector<int> blocksPerMultiprocessor(std::uint64_t features);
/// Of all stores and loads in the code of crt_render.
constexpr std::uint32_t kSpillBytesAllowed = 128;

/// Options for NVRTC. Arithmetic stays IEEE: nothing is contracted, divisions and square roots are rounded
/// correctly, subnormals are kept.
std::vector<std::string> nvrtcOptions(int arch, std::uint64_t features, int blocks_per_multiprocessor);

/// Key of the machine code: everything that decides it, and the driver's version, so that no driver has to
/// take what another one was given.
plugin::KernelCache::Key cacheKey(const std::string& text, int arch, std::uint64_t features,
                                  const std::string& compiler, const std::string& driver_version);

/// What a kernel takes on the device, as the assembler reports it (--ptxas-options=-v).
struct ResourceUse {
    std::uint32_t registers = 0;
    std::uint32_t stack_bytes = 0;  ///< Per thread; includes what is spilled.
    std::uint32_t spill_bytes = 0;  ///< Stores and loads in the code.
};
ResourceUse resourceUse(const std::string& log, const std::string& kernel);

/// Machine code for a mask, with as many blocks on a multiprocessor as go almost without spilling. Throws
/// std::runtime_error. [any thread]
Cubin compileLean(const Nvrtc& nvrtc, const std::string& text, int arch, std::uint64_t features);

/// The kernels of one loaded module.
class Module {
public:
    Module() = default;
    /// `image`: a CUBIN or a fat binary.
    Module(const void* image, std::uint64_t features, std::string name);
    Module(Module&& other) noexcept { *this = std::move(other); }
    Module& operator=(Module&& other) noexcept;
    ~Module();
    explicit operator bool() const { return module_ != nullptr; }

    CUfunction render() const { return render_; }
    CUfunction addSlices() const { return add_slices_; }
    std::uint64_t features() const { return features_; }
    const std::string& name() const { return name_; }
    std::uint32_t registers() const { return registers_; }
    std::uint32_t spillBytes() const { return spill_bytes_; }
    /// Blocks of crt_render that one multiprocessor holds at once.
    std::uint32_t residentBlocks() const { return resident_blocks_; }

private:
    CUmodule module_ = nullptr;
    CUfunction render_ = nullptr, add_slices_ = nullptr;
    std::uint64_t features_ = 0, registers_ = 0, spill_bytes_ = 0, resident_blocks_ = 1;
    std::string name_;
};

/// Opens NVRTC, which is a library of 100 MB, as far as that was not done before. A CudaProgram does so
/// itself; beside other work it costs no time. [any thread]
void openCompiler() noexcept;

/// The kernel for one mask on one device. Used by one thread at a time, the context current.
class CudaProgram {
public:
    CudaProgram(const plugin::Host& host, const Device& device, std::uint64_t scene_features,
                CrtKernelChoice choice);
    CudaProgram(const CudaProgram&) = delete;
    CudaProgram& operator=(const CudaProgram&) = delete;

    /// The best kernel that there is by now.
    const Module& current();

    std::uint64_t features() const { return features_; }
    bool fromCache() const { return from_cache_; }
    double compileSeconds() const { return compile_seconds_; }
    double cacheSeconds() const { return cache_seconds_; }
    /// Which kernels ran: "precompiled, then NVRTC 13.0 sm_90".
    std::string description() const;

private:
    void takeLean(const CompiledKernel& compiled);

    plugin::Host host_;
    std::uint64_t features_;
    std::string lean_name_;
    Module precompiled_, lean_;
    bool from_cache_ = false;
    double compile_seconds_ = 0, cache_seconds_ = 0;
    std::unique_ptr<CompileProcess> compiling_;
};

}  // namespace crt::cuda
