/// A compilation by NVRTC in a process of its own (the program crt_nvrtc beside the plugin).
///
/// NVRTC cannot be told to stop, and a process cannot end while one of its threads is inside of it:
/// destructors of static objects would take the library apart under that thread. So a render with the
/// precompiled kernel would wait at its end for a kernel that it no longer needs. A separate process is left
/// behind instead: it puts the kernel into the cache, for the next run, and ends
/// (docs/decisions/0011-compiler-process.md).
#pragma once

#include "cuda_nvrtc.h"

#include "backend/sdk/kernel_cache.h"
#include "gpu/gpu_program.h"

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>

namespace crt::cuda {

/// The kernel to compile, and the place to keep it.
struct CompileJob {
    std::string nvrtc_path;  ///< As Nvrtc::path() has it.
    std::string text;
    int arch = 0;
    gpu::KernelSpec spec;
    std::string
        cache_directory;  ///< Empty: none; then only the process that waits could use the kernel.
    plugin::KernelCache::Key key{};
};

struct CompiledKernel {
    std::vector<unsigned char> cubin;
    double compile_seconds = 0, cache_seconds = 0;
};

class CompileProcess {
public:
    /// Starts `program`. Throws std::runtime_error with one sentence.
    CompileProcess(const std::string& program, const CompileJob& job);
    /// Leaves the process alone when it has a cache to fill, and ends it otherwise. Waits for nothing.
    ~CompileProcess();
    CompileProcess(const CompileProcess&) = delete;
    CompileProcess& operator=(const CompileProcess&) = delete;

    /// The kernel, once; nothing while it is compiled. Throws std::runtime_error when it cannot be.
    std::optional<CompiledKernel> poll();

private:
    pid_t process_ = -1;  ///< −1: it has ended.
    int answer_ = -1;
    bool fills_cache_;
};

/// crt_nvrtc in the folder of the library that this code is part of.
std::string compileProgram();

/// The other side: reads a job from one descriptor, compiles, stores, writes the answer to the other. The
/// exit status.
int runCompileProcess(int job, int answer);

}  // namespace crt::cuda
