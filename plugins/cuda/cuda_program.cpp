#include "cuda_program.h"

#include "cuda_precompiled.h"

#include "kernel/dialect/features.h"
#include "kernel/geometry/bvh.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <thread>

namespace crt::cuda {

using plugin::KernelCache;

namespace {

/// One for the process; a throw leaves it unset. [any thread]
const Nvrtc& nvrtc() {
    static const Nvrtc found = Nvrtc::open(nvrtcCandidates(std::getenv("CUDA_HOME")));
    return found;
}

/// `image`: a CUBIN or a fat binary. `name`: for messages.
GpuKernel loadKernel(const void* image, const KernelSpec& spec, const std::string& name,
                     const Device& device) {
    const Driver& cuda = driver();
    CUmodule module = nullptr;
    cuda.check(cuda.cuModuleLoadData(&module, image), "loading the " + name + " kernel");
    GpuKernel kernel;
    kernel.module = {static_cast<void*>(module),
                     [](void* loaded) { driver().cuModuleUnload(static_cast<CUmodule>(loaded)); }};
    kernel.spec = spec;
    const auto take = [&](const std::string& entry) {
        CUfunction function = nullptr;
        cuda.check(cuda.cuModuleGetFunction(&function, module, entry.c_str()),
                   "taking " + entry + " from the module");
        return function;
    };
    CUfunction const entry = take(entryName(spec.entry));
    kernel.entry = entry;
    if (spec.entry == Entry::Render || spec.entry == Entry::Trace)
        kernel.add_slices = take("crt_add_slices");
    // No kernel uses shared memory: all of it may cache the scene.
    cuda.check(cuda.cuFuncSetCacheConfig(entry, CU_FUNC_CACHE_PREFER_L1), "preferring the L1 cache");

    int registers = 0, local_bytes = 0, blocks = 0;
    cuda.check(cuda.cuFuncGetAttribute(&registers, CU_FUNC_ATTRIBUTE_NUM_REGS, entry), "querying registers");
    cuda.check(cuda.cuFuncGetAttribute(&local_bytes, CU_FUNC_ATTRIBUTE_LOCAL_SIZE_BYTES, entry),
               "querying local memory");
    cuda.check(cuda.cuOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, entry, kBlock, 0),
               "querying the occupancy");
    // Local memory is the stacks of both traversals of the BVH, which are meant to be there, and what did
    // not fit into registers.
    constexpr int kTraversalStack = CRT_BVH_STACK * (sizeof(kernel::u64) + sizeof(kernel::u32));
    kernel.registers = static_cast<std::uint32_t>(registers);
    kernel.spill_bytes =
        static_cast<std::uint32_t>(std::max(0, local_bytes - (traverses(spec) ? kTraversalStack : 0)));
    kernel.resident_blocks = static_cast<std::uint64_t>(std::max(blocks, 1)) * device.multiprocessors;
    return kernel;
}

}  // namespace

void openCompiler() noexcept {
    try {
        nvrtc();
    } catch (...) {
        // The next use tries again, and reports the error.
    }
}

CudaProgram::CudaProgram(const plugin::Host& host, const Device& device, const gpu::Specs& wanted,
                         CrtKernelChoice choice)
    : GpuProgram(wanted), host_(host), device_(device) {
    if (choice == CRT_KERNEL_FULL) {
        loadPrecompiled();
        return;
    }

    const Nvrtc* compiler = nullptr;
    try {
        compiler = &nvrtc();
    } catch (const std::runtime_error& error) {
        host_.log(CRT_LOG_INFO, std::string("cuda: ") + error.what() +
                                    ": using the precompiled kernel with all features");
    }
    if (compiler != nullptr && !compiler->supports(device.arch)) {
        host_.log(CRT_LOG_INFO, "cuda: " + compiler->name() + " does not support '" + device.name +
                                    "': using the precompiled kernel");
        compiler = nullptr;
    }
    if (compiler == nullptr) {
        loadPrecompiled();
        return;
    }

    lean_name_ = compiler->name() + " sm_" + std::to_string(device.arch);
    const std::string text = kernelText(host_.kernelSource("kernel/schedule/wavefront.h"));
    takeFromCache(text, *compiler);
    if (pending_.empty()) {
        from_cache_ = true;
        return;
    }

    if (const char* directory = host_.cacheDirectory()) cache_directory_ = directory;
    job_ = CompileJob{compiler->path(), text, device.arch, {}};
    try {
        startCompilers();
        while (choice == CRT_KERNEL_LEAN_ONLY && !pending_.empty()) {
            poll();
            if (!pending_.empty()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
    } catch (const std::runtime_error& error) {
        giveUp(std::string("using the precompiled kernel with all features: ") + error.what());
    }
    if (!pending_.empty()) loadPrecompiled();
}

void CudaProgram::loadPrecompiled() {
    if (precompiled_.empty())
        precompiled_.push_back(
            loadKernel(kPrecompiledKernels, {Entry::Render, CRT_FEATURES_ALL}, "precompiled", device_));
}

void CudaProgram::takeFromCache(const std::string& text, const Nvrtc& compiler) {
    const gpu::Stopwatch cache_time;
    const KernelCache cache(host_.cacheDirectory());
    lean_.resize(wanted_.size());
    for (std::size_t i = 0; i < wanted_.size(); ++i) {
        Pending kernel{i, cacheKey(text, device_.arch, wanted_[i], compiler.name(), driver().version), false,
                       nullptr};
        std::string refused;
        const std::optional<std::vector<unsigned char>> cubin = cache.load(kernel.key, &refused);
        if (!refused.empty())
            host_.log(CRT_LOG_WARNING, "cuda: a cached kernel is refused, and compiled again: " + refused);
        if (cubin) {
            try {
                lean_[i] = loadKernel(cubin->data(), wanted_[i], lean_name_, device_);
                continue;
            } catch (const plugin::PluginError& error) {
                kernel.replaces = true;
                host_.log(
                    CRT_LOG_DEBUG,
                    std::string("cuda: the cached kernel is refused, and compiled again: ") + error.what());
            }
        }
        pending_.push_back(std::move(kernel));
    }
    cache_seconds_ = cache_time.seconds();
}

void CudaProgram::startCompilers() {
    // The host's cores render nothing meanwhile, but each compiler takes some 200 MB.
    const std::size_t most = std::clamp(std::thread::hardware_concurrency(), 1u, 16u);
    for (std::size_t i = 0; i < std::min(most, pending_.size()); ++i) {
        const plugin::CompilePlace place{cache_directory_, pending_[i].key, pending_[i].replaces};
        // Many short renders, one after the other, would leave as many compilers behind.
        if (pending_[i].process != nullptr || !plugin::CompileProcess::mayStart(place, most)) continue;
        job_.spec = wanted_[pending_[i].index];
        pending_[i].process =
            std::make_unique<plugin::CompileProcess>(compileProgram(), place, messageOf(job_));
    }
}

void CudaProgram::poll() {
    for (std::size_t i = 0; i < pending_.size();) {
        const std::optional<plugin::CompiledCode> compiled =
            pending_[i].process != nullptr ? pending_[i].process->poll() : std::nullopt;
        if (!compiled) {
            ++i;
            continue;
        }
        const std::size_t index = pending_[i].index;
        pending_.erase(pending_.begin() + static_cast<std::ptrdiff_t>(i));
        compile_seconds_ += compiled->compile_seconds;
        cache_seconds_ += compiled->cache_seconds;
        lean_[index] = loadKernel(compiled->code.data(), wanted_[index], lean_name_, device_);
    }
    startCompilers();
}

void CudaProgram::giveUp(const std::string& why) {
    pending_.clear();
    lean_.clear();
    host_.log(CRT_LOG_WARNING, "cuda: " + why);
    loadPrecompiled();
}

void CudaProgram::giveUpWaves(const std::string& why) {
    giveUp("continuing with the precompiled kernel: " + why);
}

const std::vector<GpuKernel>& CudaProgram::current() {
    if (!pending_.empty()) {
        try {
            poll();
        } catch (const std::exception& error) {
            giveUpWaves(error.what());
        }
    }
    return lean_.empty() || !pending_.empty() ? precompiled_ : lean_;
}

std::string CudaProgram::description() const {
    if (lean_.empty() || !pending_.empty()) return "precompiled";
    const std::string lean =
        lean_name_ + (lean_.size() > 1 ? ", " + std::to_string(lean_.size()) + " kernels" : std::string());
    return precompiled_.empty() ? lean : "precompiled, then " + lean;
}

}  // namespace crt::cuda
