#include "cuda_lean_kernel.h"

#include "cuda_dialect_text.h"

#include "kernel/dialect/features.h"

#include <cstdio>
#include <sstream>

namespace crt::cuda {

using plugin::KernelCache;

namespace {

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

bool traverses(const KernelSpec& spec) {
    return (spec.entry == Entry::Render || spec.entry == Entry::Trace) &&
           (spec.features & CRT_FEATURE_BVH) != 0;
}

std::string kernelText(const std::string& wavefront_text) {
    return gpu::kernelText(wavefront_text, "cuda_dialect.h", kDialectText);
}

std::vector<int> blocksPerMultiprocessor(const KernelSpec& spec) {
    if (spec.entry == Entry::Trace) return {7, 6, 5};
    if (spec.entry == Entry::Render && (spec.features & CRT_FEATURE_BVH) == 0) return {5, 4, 3};
    return {4, 3};
}

std::vector<std::string> nvrtcOptions(int arch, const KernelSpec& spec, int blocks_per_multiprocessor) {
    char mask[48];
    std::snprintf(mask, sizeof mask, "-DCRT_FEATURES=0x%llxul",
                  static_cast<unsigned long long>(spec.features));
    return {"--gpu-architecture=sm_" + std::to_string(arch),
            "--std=c++17",
            "--fmad=false",
            "--prec-div=true",
            "--prec-sqrt=true",
            "--ftz=false",
            "--ptxas-options=-v",
            mask,
            "-DCRT_LEAN=1",
            "-DCRT_ENTRIES=" + std::to_string(static_cast<std::uint32_t>(spec.entry)),
            "-DCRT_BLOCKS_PER_SM=" + std::to_string(blocks_per_multiprocessor)};
}

KernelCache::Key cacheKey(const std::string& text, int arch, const KernelSpec& spec,
                          const std::string& compiler, const std::string& driver_version) {
    std::string options;
    for (const int blocks : blocksPerMultiprocessor(spec))
        for (const std::string& option : nvrtcOptions(arch, spec, blocks)) options += option + ' ';
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

Cubin compileLean(const Nvrtc& compiler, const std::string& text, int arch, const KernelSpec& spec) {
    Cubin cubin;
    for (const int blocks : blocksPerMultiprocessor(spec)) {
        cubin = compiler.compile(text, "wavefront.h", nvrtcOptions(arch, spec, blocks));
        if (resourceUse(cubin.log, entryName(spec.entry)).spill_bytes <= kSpillBytesAllowed) break;
    }
    return cubin;
}

}  // namespace crt::cuda
