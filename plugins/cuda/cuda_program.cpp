#include "cuda_program.h"

#include "cuda_kernel_text.h"
#include "cuda_precompiled.h"

#include "kernel/bvh.h"
#include "kernel/features.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace crt::cuda {

using plugin::KernelCache;

namespace {

class Stopwatch {
public:
    double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// One for the process; a throw leaves it unset. [any thread]
const Nvrtc& nvrtc() {
    static const Nvrtc found = Nvrtc::open(nvrtcCandidates(std::getenv("CUDA_HOME")));
    return found;
}

/// The number that stands right before `word`, or 0.
std::uint32_t numberBefore(const std::string& line, const std::string& word) {
    const std::size_t end = line.find(word);
    if (end == std::string::npos) return 0;
    const std::size_t last = line.find_last_of("0123456789", end);
    if (last == std::string::npos) return 0;
    const std::size_t before = line.find_last_not_of("0123456789", last);
    return static_cast<std::uint32_t>(
        std::stoul(line.substr(before == std::string::npos ? 0 : before + 1, last)));
}

}  // namespace

std::string kernelText(const std::string& path_text) {
    return path_text + "\n#line 1 \"kernels.cu\"\n" + kKernelText;
}

std::vector<int> blocksPerMultiprocessor(std::uint64_t features) {
    if ((features & CRT_FEATURE_BVH) == 0) return {5, 4, 3};
    return {4, 3};
}

std::vector<std::string> nvrtcOptions(int arch, std::uint64_t features, int blocks_per_multiprocessor) {
    char mask[48];
    std::snprintf(mask, sizeof mask, "-DCRT_FEATURES=0x%llxul", static_cast<unsigned long long>(features));
    return {"--gpu-architecture=sm_" + std::to_string(arch),
            "--std=c++17",
            "--fmad=false",
            "--prec-div=true",
            "--prec-sqrt=true",
            "--ftz=false",
            "--ptxas-options=-v",
            mask,
            "-DCRT_BLOCKS_PER_SM=" + std::to_string(blocks_per_multiprocessor)};
}

KernelCache::Key cacheKey(const std::string& text, int arch, std::uint64_t features,
                          const std::string& compiler, const std::string& driver_version) {
    std::string options;
    for (const int blocks : blocksPerMultiprocessor(features))
        for (const std::string& option : nvrtcOptions(arch, features, blocks)) options += option + ' ';
    return KernelCache::makeKey({"cuda", text, options, compiler, driver_version});
}

ResourceUse resourceUse(const std::string& log, const std::string& kernel) {
    // "… Function properties for crt_render", then a line about the stack and the spills, and one with
    // "Used 96 registers"; each kernel in turn.
    ResourceUse use;
    bool ours = false;
    std::istringstream lines(log);
    for (std::string line; std::getline(lines, line);) {
        if (line.find("Compiling entry function") != std::string::npos)
            ours = line.find("'" + kernel + "'") != std::string::npos;
        if (line.find("Function properties for") != std::string::npos)
            ours = line.find(kernel) != std::string::npos;
        if (!ours) continue;
        if (line.find("stack frame") != std::string::npos) {
            use.stack_bytes = numberBefore(line, " bytes stack frame");
            use.spill_bytes =
                numberBefore(line, " bytes spill stores") + numberBefore(line, " bytes spill loads");
        }
        if (line.find(" registers") != std::string::npos) use.registers = numberBefore(line, " registers");
    }
    return use;
}

Cubin compileLean(const Nvrtc& compiler, const std::string& text, int arch, std::uint64_t features) {
    Cubin cubin;
    for (const int blocks : blocksPerMultiprocessor(features)) {
        cubin = compiler.compile(text, "path.h", nvrtcOptions(arch, features, blocks));
        if (resourceUse(cubin.log, "crt_render").spill_bytes <= kSpillBytesAllowed) break;
    }
    return cubin;
}

Module::Module(const void* image, std::uint64_t features, std::string name)
    : features_(features), name_(std::move(name)) {
    const Driver& cuda = driver();
    cuda.check(cuda.cuModuleLoadData(&module_, image), "loading the " + name_ + " kernel");
    try {
        cuda.check(cuda.cuModuleGetFunction(&render_, module_, "crt_render"),
                   "taking crt_render from the module");
        cuda.check(cuda.cuModuleGetFunction(&add_slices_, module_, "crt_add_slices"),
                   "taking crt_add_slices from the module");
        // No kernel uses shared memory: all of it may cache the scene.
        cuda.check(cuda.cuFuncSetCacheConfig(render_, CU_FUNC_CACHE_PREFER_L1), "preferring the L1 cache");

        int registers = 0, local_bytes = 0, blocks = 0;
        cuda.check(cuda.cuFuncGetAttribute(&registers, CU_FUNC_ATTRIBUTE_NUM_REGS, render_),
                   "asking for registers");
        cuda.check(cuda.cuFuncGetAttribute(&local_bytes, CU_FUNC_ATTRIBUTE_LOCAL_SIZE_BYTES, render_),
                   "asking for local memory");
        cuda.check(cuda.cuOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, render_, kBlock, 0),
                   "asking for the occupancy");
        // Local memory is the stacks of both traversals of the BVH, which are meant to be there, and what
        // did not fit into registers.
        constexpr int kTraversalStack = CRT_BVH_STACK * (sizeof(kernel::u64) + sizeof(kernel::u32));
        registers_ = static_cast<std::uint32_t>(registers);
        spill_bytes_ = static_cast<std::uint32_t>(
            std::max(0, local_bytes - ((features_ & CRT_FEATURE_BVH) ? kTraversalStack : 0)));
        resident_blocks_ = static_cast<std::uint32_t>(std::max(blocks, 1));
    } catch (...) {
        cuda.cuModuleUnload(module_);
        throw;
    }
}

Module& Module::operator=(Module&& other) noexcept {
    std::swap(module_, other.module_);
    std::swap(render_, other.render_);
    std::swap(add_slices_, other.add_slices_);
    std::swap(features_, other.features_);
    std::swap(registers_, other.registers_);
    std::swap(spill_bytes_, other.spill_bytes_);
    std::swap(resident_blocks_, other.resident_blocks_);
    std::swap(name_, other.name_);
    return *this;
}

Module::~Module() {
    if (module_ != nullptr) driver().cuModuleUnload(module_);
}

void openCompiler() noexcept {
    try {
        nvrtc();
    } catch (...) {
        // Whoever needs it tries again, and tells.
    }
}

CudaProgram::CudaProgram(const plugin::Host& host, const Device& device, std::uint64_t scene_features,
                         CrtKernelChoice choice)
    : host_(host), features_(choice == CRT_KERNEL_FULL ? CRT_FEATURES_ALL : scene_features) {
    const auto loadPrecompiled = [&] {
        precompiled_ = Module(kPrecompiledKernels, CRT_FEATURES_ALL, "precompiled");
    };
    if (choice == CRT_KERNEL_FULL) {
        loadPrecompiled();
        return;
    }

    const Nvrtc* compiler = nullptr;
    try {
        compiler = &nvrtc();
    } catch (const std::runtime_error& error) {
        host_.log(CRT_LOG_INFO, std::string("cuda: ") + error.what() +
                                    ": using the precompiled kernel with everything in");
    }
    if (compiler != nullptr && !compiler->supports(device.arch)) {
        host_.log(CRT_LOG_INFO, "cuda: " + compiler->name() + " does not know '" + device.name +
                                    "': using the precompiled kernel");
        compiler = nullptr;
    }
    if (compiler == nullptr) {
        loadPrecompiled();
        return;
    }

    const Stopwatch cache_time;
    lean_name_ = compiler->name() + " sm_" + std::to_string(device.arch);
    const std::string text = kernelText(host_.kernelSource("path.h"));
    const KernelCache::Key key = cacheKey(text, device.arch, features_, compiler->name(), driver().version);
    std::string refused;
    const std::optional<std::vector<unsigned char>> cubin =
        KernelCache(host_.cacheDirectory()).load(key, &refused);
    if (!refused.empty())
        host_.log(CRT_LOG_WARNING, "cuda: a cached kernel is refused, and compiled again: " + refused);
    if (cubin) {
        try {
            lean_ = Module(cubin->data(), features_, lean_name_);
            from_cache_ = true;
        } catch (const plugin::PluginError& error) {
            host_.log(
                CRT_LOG_DEBUG,
                std::string("cuda: the cached kernel is refused, and compiled again: ") + error.what());
        }
    }
    cache_seconds_ = cache_time.seconds();
    if (lean_) return;

    const char* directory = host_.cacheDirectory();
    try {
        compiling_ = std::make_unique<CompileProcess>(
            compileProgram(), CompileJob{compiler->path(), text, device.arch, features_,
                                         directory != nullptr ? directory : "", key});
        if (choice == CRT_KERNEL_LEAN_ONLY) {
            std::optional<CompiledKernel> compiled;
            while (!(compiled = compiling_->poll()))
                std::this_thread::sleep_for(std::chrono::milliseconds(5));
            compiling_.reset();
            takeLean(*compiled);
            return;
        }
    } catch (const std::runtime_error& error) {
        compiling_.reset();
        host_.log(CRT_LOG_WARNING,
                  std::string("cuda: using the precompiled kernel with everything in: ") + error.what());
    }
    loadPrecompiled();
}

void CudaProgram::takeLean(const CompiledKernel& compiled) {
    compile_seconds_ = compiled.compile_seconds;
    cache_seconds_ += compiled.cache_seconds;
    lean_ = Module(compiled.cubin.data(), features_, lean_name_);
}

const Module& CudaProgram::current() {
    if (!compiling_) return lean_ ? lean_ : precompiled_;
    try {
        const std::optional<CompiledKernel> compiled = compiling_->poll();
        if (!compiled) return precompiled_;
        compiling_.reset();
        takeLean(*compiled);
    } catch (const std::exception& error) {
        // The precompiled kernel gives the same image.
        compiling_.reset();
        host_.log(CRT_LOG_WARNING,
                  std::string("cuda: going on with the precompiled kernel: ") + error.what());
    }
    return lean_ ? lean_ : precompiled_;
}

std::string CudaProgram::description() const {
    if (!lean_) return precompiled_.name();
    return precompiled_ ? precompiled_.name() + ", then " + lean_.name() : lean_.name();
}

}  // namespace crt::cuda
