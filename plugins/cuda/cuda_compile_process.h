/// A compilation by NVRTC in a separate process (the program crt_nvrtc beside the plugin). NVRTC cannot be
/// told to stop, and a process cannot end while one of its threads is inside of it: destructors of static
/// objects would take the library apart under that thread. So a render with the precompiled kernel would
/// wait at its end for a kernel that it no longer needs.
#pragma once

#include "cuda_nvrtc.h"

#include "backend/sdk/compile_process.h"
#include "gpu/gpu_program.h"

#include <string>
#include <vector>

namespace crt::cuda {

/// The kernel to compile.
struct CompileJob {
    std::string nvrtc_path;  ///< As Nvrtc::path() has it.
    std::string text;
    int arch = 0;
    gpu::KernelSpec spec;
};

/// For plugin::CompileProcess.
plugin::CompileMessage messageOf(const CompileJob& job);

/// crt_nvrtc in the folder of the library that this code is part of.
std::string compileProgram();

/// The work of crt_nvrtc: a CUBIN. Throws std::runtime_error.
std::vector<unsigned char> compileJob(plugin::CompileMessage& message);

}  // namespace crt::cuda
