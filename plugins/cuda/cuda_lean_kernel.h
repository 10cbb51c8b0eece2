/// The lean kernel for one scene, compiled by NVRTC: text, options, and the key under which it is cached.
#pragma once

#include "cuda_nvrtc.h"

#include "backend/sdk/kernel_cache.h"
#include "gpu/gpu_program.h"

#include <cstdint>
#include <string>
#include <vector>

namespace crt::cuda {

using gpu::Entry;
using gpu::KernelSpec;

/// True if it has the stacks of a tree's traversal.
bool traverses(const KernelSpec& spec);

/// The whole text that NVRTC compiles.
std::string kernelText(const std::string& wavefront_text);

/// Numbers of blocks that a multiprocessor should hold at once, in the order of trying: more hide latency
/// better, but leave each thread fewer registers. The first that spills at most kSpillBytesAllowed wins;
/// the last is not judged. A few spilled values cost less than a fourth block gains; a fifth gains where
/// there is no tree to traverse (docs/decisions/0041-instruction-cache.md); a kernel that only traces is
/// best with seven (docs/decisions/0042-wavefront.md).
std::vector<int> blocksPerMultiprocessor(const KernelSpec& spec);
/// Of all stores and loads in the code of a kernel.
constexpr std::uint32_t kSpillBytesAllowed = 128;

/// Options for NVRTC. Arithmetic stays IEEE: nothing is contracted, divisions and square roots are rounded
/// correctly, subnormals are kept.
std::vector<std::string> nvrtcOptions(int arch, const KernelSpec& spec, int blocks_per_multiprocessor);

/// Key of the machine code: everything that decides it, and the driver's version, so that no driver has to
/// take what another one was given.
plugin::KernelCache::Key cacheKey(const std::string& text, int arch, const KernelSpec& spec,
                                  const std::string& compiler, const std::string& driver_version);

/// Resources of a kernel on the device, as the assembler reports them (--ptxas-options=-v).
struct ResourceUse {
    std::uint32_t registers = 0;
    std::uint32_t stack_bytes = 0;  ///< Per thread; includes what is spilled.
    std::uint32_t spill_bytes = 0;  ///< Stores and loads in the code.
};
ResourceUse resourceUse(const std::string& log, const std::string& kernel);

/// Machine code with as many blocks on a multiprocessor as go almost without spilling. Throws
/// std::runtime_error. [any thread]
Cubin compileLean(const Nvrtc& nvrtc, const std::string& text, int arch, const KernelSpec& spec);

}  // namespace crt::cuda
