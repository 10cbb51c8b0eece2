/// NVRTC, NVIDIA's run-time compiler, found at run time: a machine may have the driver and not the toolkit,
/// and then runs the precompiled kernel.
#pragma once

#include <nvrtc.h>

#include <string>
#include <vector>

namespace crt::cuda {

#define CRT_NVRTC_FUNCTIONS(F)                                                                    \
    F(nvrtcVersion) F(nvrtcGetErrorString) F(nvrtcGetNumSupportedArchs) F(nvrtcGetSupportedArchs) \
    F(nvrtcCreateProgram) F(nvrtcDestroyProgram) F(nvrtcCompileProgram) F(nvrtcGetProgramLogSize) \
    F(nvrtcGetProgramLog) F(nvrtcGetCUBINSize) F(nvrtcGetCUBIN)

/// Where NVRTC may lie, in the order of trying: by its name (the loader's own search, the newest version
/// first), then in the toolkit that $CUDA_HOME names, then in /usr/local/cuda. `cuda_home` may be null.
std::vector<std::string> nvrtcCandidates(const char* cuda_home);

/// A compiled kernel, and what the assembler said about it.
struct Cubin {
    std::vector<unsigned char> bytes;
    std::string log;
};

class Nvrtc {
public:
    /// The first candidate that can be opened; never closed. Throws std::runtime_error with one sentence
    /// when there is none. [any thread]
    static Nvrtc open(const std::vector<std::string>& candidates);

    const std::string& path() const { return path_; }
    int major() const { return major_; }
    int minor() const { return minor_; }
    /// "NVRTC 13.0".
    std::string name() const;

    /// True if it makes machine code for compute capability arch / 10.
    bool supports(int arch) const;

    /// Compiles `text`, whose errors call it `file`. Throws std::runtime_error with the first 20 lines of
    /// the log. [any thread]
    Cubin compile(const std::string& text, const std::string& file,
                  const std::vector<std::string>& options) const;

private:
    Nvrtc() = default;

#define CRT_NVRTC_MEMBER(name) decltype(&::name) name##_ = nullptr;
    CRT_NVRTC_FUNCTIONS(CRT_NVRTC_MEMBER)
#undef CRT_NVRTC_MEMBER
    std::string path_;
    int major_ = 0, minor_ = 0;
    std::vector<int> archs_;
};

}  // namespace crt::cuda
