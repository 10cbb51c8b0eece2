#include "cuda_nvrtc.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstddef>
#include <stdexcept>

namespace crt::cuda {
namespace {

/// Destroys a program however compile() ends.
struct ProgramOwner {
    nvrtcProgram program = nullptr;
    decltype(&nvrtcDestroyProgram) destroy;
    ~ProgramOwner() {
        if (program != nullptr) destroy(&program);
    }
};

std::string firstLines(const std::string& text, int line_count) {
    std::size_t end = 0;
    for (int line = 0; line < line_count; ++line) {
        end = text.find('\n', end);
        if (end == std::string::npos) return text;
        ++end;
    }
    return text.substr(0, end) + "(more lines follow)";
}

/// NVRTC asks the loader for its companion by bare name, which finds it only in the system's folders. One
/// that lies beside an NVRTC opened by path is loaded beforehand: the loader then knows it by its name.
/// Without it, compiling fails with a message that says so.
void loadBuiltins(const std::string& nvrtc_path, int major, int minor) {
    const std::size_t slash = nvrtc_path.rfind('/');
    if (slash == std::string::npos) return;
    const std::string name = "libnvrtc-builtins.so." + std::to_string(major) + "." + std::to_string(minor);
    dlopen((nvrtc_path.substr(0, slash + 1) + name).c_str(), RTLD_NOW | RTLD_LOCAL);
}

}  // namespace

std::vector<std::string> nvrtcCandidates(const char* cuda_home) {
    const std::vector<std::string> names = {"libnvrtc.so.13", "libnvrtc.so.12", "libnvrtc.so"};
    std::vector<std::string> folders = {""};
    if (cuda_home != nullptr && *cuda_home != '\0') folders.push_back(cuda_home + std::string("/lib64/"));
    folders.push_back("/usr/local/cuda/lib64/");
    std::vector<std::string> candidates;
    for (const std::string& folder : folders)
        for (const std::string& name : names)
            if (std::find(candidates.begin(), candidates.end(), folder + name) == candidates.end())
                candidates.push_back(folder + name);
    return candidates;
}

Nvrtc Nvrtc::open(const std::vector<std::string>& candidates) {
    std::string refusals;
    for (const std::string& path : candidates) {
        void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
        if (library == nullptr) {
            if (refusals.empty())
                refusals = dlerror();  // of the name that should have been found: the others say the same
            continue;
        }
        Nvrtc nvrtc;
        bool complete = true;
#define CRT_NVRTC_LOAD(name)                                                              \
    nvrtc.name##_ = reinterpret_cast<decltype(nvrtc.name##_)>(dlsym(library, #name));     \
    complete = complete && nvrtc.name##_ != nullptr;
        CRT_NVRTC_FUNCTIONS(CRT_NVRTC_LOAD)
#undef CRT_NVRTC_LOAD
        int count = 0;
        if (!complete || nvrtc.nvrtcVersion_(&nvrtc.major_, &nvrtc.minor_) != NVRTC_SUCCESS ||
            nvrtc.nvrtcGetNumSupportedArchs_(&count) != NVRTC_SUCCESS) {
            refusals = path + " is too old: CUDA 11.2 or newer is needed";
            continue;
        }
        loadBuiltins(path, nvrtc.major_, nvrtc.minor_);
        nvrtc.archs_.resize(static_cast<std::size_t>(count));
        if (count > 0) nvrtc.nvrtcGetSupportedArchs_(nvrtc.archs_.data());
        nvrtc.path_ = path;
        return nvrtc;
    }
    throw std::runtime_error("NVRTC is not installed (" + refusals + ")");
}

std::string Nvrtc::name() const { return "NVRTC " + std::to_string(major_) + "." + std::to_string(minor_); }

bool Nvrtc::supports(int arch) const {
    return std::find(archs_.begin(), archs_.end(), arch) != archs_.end();
}

Cubin Nvrtc::compile(const std::string& text, const std::string& file,
                     const std::vector<std::string>& options) const {
    const auto check = [&](nvrtcResult result, const char* what) {
        if (result != NVRTC_SUCCESS)
            throw std::runtime_error(name() + " cannot " + what + ": " + nvrtcGetErrorString_(result));
    };
    ProgramOwner owner{nullptr, nvrtcDestroyProgram_};
    check(nvrtcCreateProgram_(&owner.program, text.c_str(), file.c_str(), 0, nullptr, nullptr),
          "create a program");

    std::vector<const char*> arguments;
    for (const std::string& option : options) arguments.push_back(option.c_str());
    const nvrtcResult result =
        nvrtcCompileProgram_(owner.program, static_cast<int>(arguments.size()), arguments.data());

    Cubin cubin;
    std::size_t log_size = 0;
    if (nvrtcGetProgramLogSize_(owner.program, &log_size) == NVRTC_SUCCESS && log_size > 1) {
        cubin.log.resize(log_size);
        if (nvrtcGetProgramLog_(owner.program, cubin.log.data()) == NVRTC_SUCCESS)
            cubin.log.resize(log_size - 1);  // its NUL
    }
    if (result != NVRTC_SUCCESS)
        throw std::runtime_error(name() + " cannot compile the kernel (" + nvrtcGetErrorString_(result) +
                                 "):\n" + firstLines(cubin.log, 20));

    std::size_t size = 0;
    check(nvrtcGetCUBINSize_(owner.program, &size), "return the size of the kernel");
    cubin.bytes.resize(size);
    check(nvrtcGetCUBIN_(owner.program, reinterpret_cast<char*>(cubin.bytes.data())), "return the kernel");
    return cubin;
}

}  // namespace crt::cuda
