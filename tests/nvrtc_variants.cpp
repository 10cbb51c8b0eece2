// Compiles every kernel variant that matters for one GPU with NVRTC, through the code of the CUDA backend,
// and checks that none spills more than a few registers. Needs no GPU. Prints registers and compile time of
// each variant.
//
//     nvrtc_variants [--arch 90] [--part I N] [--precompiled LOG] [--fewest-blocks] [--largest]
//         [--only] [SCENE …]
//
// The masks: everything, each sampler and accelerator, each kind of material, and those of the scenes given,
// as a render of the file compiles them. --only: those of the scenes that follow, alone. --part: every N-th
// variant, from the I-th on. --largest: without the masks whose features a scene's kernel has among others,
// because that kernel needs at least as many registers and may use no more. --precompiled: the kernel with
// everything in is judged by what nvcc has written into LOG while the build compiled it, and is not compiled
// again. --fewest-blocks: each variant is compiled once, with the most registers that a render allows it,
// instead of as a render does. It fails where a render's fails, because a render takes more blocks only
// where those spill little. Exit code 77, which ctest shows as skipped, where NVRTC is missing.
#include "cuda_nvrtc.h"
#include "cuda_program.h"

#include "backend/loader.h"
#include "backend/sdk/gpu_schedule.h"
#include "base/error.h"
#include "compile/compile.h"
#include "file_bytes.h"
#include "gpu/wave_plan.h"
#include "kernel/dialect/features.h"
#include "kernel/dialect/layout.h"
#include "render/outputs.h"
#include "scene/yaml/scene_yaml.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace {

using crt::gpu::Entry;
using crt::gpu::KernelSpec;

constexpr int kSkipped = 77;

/// Masks as compileScene derives them, by name. One is compiled once however many names lead to it.
std::map<std::uint64_t, std::string> representativeMasks() {
    constexpr std::uint64_t lit =
        CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE | CRT_FEATURE_TABLE;
    constexpr std::uint64_t sobol = CRT_FEATURE_SOBOL | CRT_FEATURE_REPLICATES;
    constexpr std::uint64_t box = lit | sobol | CRT_FEATURE_BRUTE_FORCE;
    constexpr std::uint64_t mesh = lit | sobol | CRT_FEATURE_BVH;
    constexpr std::uint64_t glass = CRT_FEATURE_DIELECTRIC | CRT_FEATURE_DISPERSION;
    return {
        {CRT_FEATURES_ALL, "everything"},
        {box, "a box, Sobol, brute force"},
        {(box & ~sobol) | CRT_FEATURE_INDEPENDENT, "a box, independent sampler"},
        {(box & ~sobol) | CRT_FEATURE_XORSHIFT, "a box, xorshift sampler"},
        {(box & ~CRT_FEATURE_BRUTE_FORCE) | CRT_FEATURE_AABB, "a box, object boxes"},
        {box & ~CRT_FEATURE_NEE, "a box, no light sampling"},
        {mesh, "a mesh, BVH"},
        {mesh | CRT_FEATURE_SMOOTH_NORMALS, "a smooth mesh"},
        {box & ~CRT_FEATURE_TABLE, "a box of constants"},
        {mesh | CRT_FEATURE_SHAPES, "a mesh and spheres"},
        {mesh | CRT_FEATURE_CONDUCTOR, "a mesh of metal"},
        {mesh | CRT_FEATURE_ROUGH_CONDUCTOR, "a mesh of rough metal"},
        {mesh | CRT_FEATURE_ROUGH_CONDUCTOR | CRT_FEATURE_ANISOTROPY, "a mesh of brushed metal"},
        {mesh | CRT_FEATURE_ROUGH_CONDUCTOR | CRT_FEATURE_PLASTIC, "a mesh of openpbr"},
        {mesh | CRT_FEATURE_PLASTIC | CRT_FEATURE_ROUGH_BASE, "a mesh of clay"},
        {mesh | CRT_FEATURE_FUZZ, "a mesh of velvet"},
        {mesh | CRT_FEATURE_ROUGH_CONDUCTOR | CRT_FEATURE_PLASTIC | CRT_FEATURE_CLEARCOAT | CRT_FEATURE_MIX,
         "a mesh of car paint"},
        {mesh | CRT_FEATURE_DIELECTRIC, "a mesh of glass"},
        {mesh | CRT_FEATURE_TEXTURE, "a mesh with textures"},
        {mesh | glass, "a mesh of dispersive glass"},
        {mesh | CRT_FEATURE_ROUGH_DIELECTRIC, "a mesh of rough glass"},
        {mesh | CRT_FEATURE_ROUGH_DIELECTRIC | CRT_FEATURE_DISPERSION, "a mesh of dispersive rough glass"},
        {mesh | CRT_FEATURE_THIN_DIELECTRIC, "a mesh of panes"},
        {mesh | CRT_FEATURE_PLASTIC, "a mesh of plastic"},
        {mesh | CRT_FEATURE_DIELECTRIC | CRT_FEATURE_MEDIA, "a mesh of absorbing glass"},
        {mesh | CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_ENVIRONMENT_LIGHT, "a mesh, sampled environment"},
        {mesh | CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_ENVIRONMENT_LIGHT | CRT_FEATURE_ENVIRONMENT_IMAGE,
         "a mesh, environment image"},
        {mesh | CRT_FEATURE_POINT_LIGHT, "a mesh, lights without a surface"},
        {mesh | CRT_FEATURE_SPECTRAL_FILM, "a mesh, spectral film"},
        {mesh | CRT_FEATURE_LIGHT_TREE, "a mesh, a tree of lights"},
        {mesh | CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_LENS | CRT_FEATURE_FILTER,
         "a mesh, environment, lens and filter"},
        {mesh | CRT_FEATURE_AOV, "a mesh with AOVs"},
        {mesh | CRT_FEATURE_MIX | CRT_FEATURE_MIRROR, "a mesh of a mix"},
        {mesh | CRT_FEATURE_OPACITY, "a mesh of opacity below 1"},
        {mesh | CRT_FEATURE_TEXTURE | CRT_FEATURE_NORMAL_MAP, "a mesh with a normal map"},
        {mesh | glass | CRT_FEATURE_MIRROR | CRT_FEATURE_CONDUCTOR | CRT_FEATURE_SMOOTH_NORMALS |
             CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_LENS | CRT_FEATURE_FILTER,
         "all materials, BVH"},
        {CRT_FEATURE_SOBOL | CRT_FEATURE_BVH | CRT_FEATURE_VIEW, "a view of normals"},
        {sobol | CRT_FEATURE_SPLAT, "splats"},
    };
}

/// Names of kernels by what they are compiled from.
using Variants = std::map<std::pair<std::uint32_t, std::uint64_t>, std::string>;

void add(const KernelSpec& kernel, const std::string& name, Variants& variants) {
    variants.emplace(std::pair(static_cast<std::uint32_t>(kernel.entry), kernel.features), name);
}

void addMask(std::uint64_t mask, const std::string& name, Variants& variants) {
    if (!crt::wantsWavefront(mask, 0)) return add({Entry::Render, mask}, name, variants);
    add({Entry::Trace, mask}, name, variants);
    const std::uint64_t kinds = mask & CRT_FEATURES_MATERIALS;
    for (std::uint64_t kind = 1; kind <= kinds; kind <<= 1)
        if ((kinds & kind) != 0) add({Entry::Shade, (mask & ~kinds) | kind}, name, variants);
}

void addScene(const crt::CompiledScene& scene, const std::string& name, Variants& variants) {
    const crt::kernel::CrtScene& header = scene.header();
    if (!crt::wantsWavefront(header.features, header.max_depth))
        return add({Entry::Render, header.features}, name, variants);
    for (const KernelSpec& kernel : crt::gpu::planWave(scene.data()).kernels) add(kernel, name, variants);
}

KernelSpec specOf(const Variants::value_type& variant) {
    return {static_cast<Entry>(variant.first.first), variant.first.second};
}

/// True if `larger` has all of its features, and may have as many registers.
bool isCoveredBy(const KernelSpec& spec, const KernelSpec& larger) {
    return spec.entry == larger.entry && (spec.features & ~larger.features) == 0 &&
           crt::cuda::blocksPerMultiprocessor(spec).back() ==
               crt::cuda::blocksPerMultiprocessor(larger).back();
}

int run(int argc, char** argv) {
    int arch = 90, part = 1, parts = 1;
    bool fewest_blocks = false, largest = false;
    std::string precompiled;
    Variants masks, variants;
    for (const auto& [mask, name] : representativeMasks()) addMask(mask, name, masks);
    for (int i = 1; i < argc; ++i) {
        if (std::strcmp(argv[i], "--arch") == 0 && i + 1 < argc) {
            arch = std::atoi(argv[++i]);
            continue;
        }
        if (std::strcmp(argv[i], "--part") == 0 && i + 2 < argc) {
            part = std::atoi(argv[++i]);
            parts = std::atoi(argv[++i]);
            continue;
        }
        if (std::strcmp(argv[i], "--precompiled") == 0 && i + 1 < argc) {
            precompiled = crt::slurp(argv[++i]);
            if (precompiled.empty()) throw std::runtime_error(std::string(argv[i]) + " is missing or empty");
            continue;
        }
        if (std::strcmp(argv[i], "--fewest-blocks") == 0) {
            fewest_blocks = true;
            continue;
        }
        if (std::strcmp(argv[i], "--largest") == 0) {
            largest = true;
            continue;
        }
        if (std::strcmp(argv[i], "--only") == 0) {
            masks.clear();
            variants.clear();
            continue;
        }
        const crt::Scene scene = crt::loadScene(argv[i]);
        addScene(crt::compileScene(scene, crt::requestedAovs(scene)), argv[i], variants);
    }
    const auto isCovered = [&](const Variants::value_type& mask) {
        return std::any_of(variants.begin(), variants.end(), [&](const Variants::value_type& variant) {
            return isCoveredBy(specOf(mask), specOf(variant));
        });
    };
    if (largest) std::erase_if(masks, isCovered);
    variants.merge(masks);

    const CrtHost host = crt::makeHost(false);
    const char* wavefront_text = host.kernel_source(host.user, "kernel/schedule/wavefront.h");
    if (wavefront_text == nullptr)
        throw std::runtime_error("the program holds no kernel source wavefront.h");
    const std::string text = crt::cuda::kernelText(wavefront_text);

    std::vector<crt::cuda::Nvrtc> found;
    try {
        found.push_back(crt::cuda::Nvrtc::open(crt::cuda::nvrtcCandidates(std::getenv("CUDA_HOME"))));
    } catch (const std::runtime_error& error) {
        std::printf("SKIPPED: %s\n", error.what());
        return kSkipped;
    }
    const crt::cuda::Nvrtc& nvrtc = found.front();
    if (!nvrtc.supports(arch)) {
        std::printf("SKIPPED: %s does not compile for sm_%d\n", nvrtc.name().c_str(), arch);
        return kSkipped;
    }

    std::printf("%s, sm_%d, %zu variants\n%9s %6s %6s %8s %8s  %s\n", nvrtc.name().c_str(), arch,
                variants.size(), "registers", "stack", "spill", "CUBIN kB", "ms", "variant");
    int failures = 0, number = 0;
    for (const auto& [key, name] : variants) {
        if (number++ % parts != part - 1) continue;
        const KernelSpec spec = specOf({key, name});
        const std::string entry = crt::gpu::entryName(spec.entry);
        const auto start = std::chrono::steady_clock::now();
        const auto compiled = [&] {
            // The kernel with everything in is compiled ahead of time, for three blocks (its
            // CMakeLists.txt).
            const bool full = spec.features == CRT_FEATURES_ALL;
            if (full && !precompiled.empty()) return crt::cuda::Cubin{{}, precompiled};
            if (!full && !fewest_blocks) return crt::cuda::compileLean(nvrtc, text, arch, spec);
            const int blocks = crt::cuda::blocksPerMultiprocessor(spec).back();
            return nvrtc.compile(text, "kernel/schedule/wavefront.h",
                                 crt::cuda::nvrtcOptions(arch, spec, blocks));
        };
        const crt::cuda::Cubin cubin = compiled();
        const double ms =
            std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
        const crt::cuda::ResourceUse use = crt::cuda::resourceUse(cubin.log, entry);
        std::printf("%9u %6u %6u %8.1f %8.0f  %-15s 0x%011lx %s\n", use.registers, use.stack_bytes,
                    use.spill_bytes, static_cast<double>(cubin.bytes.size()) / 1e3, ms, entry.c_str(),
                    spec.features, name.c_str());
        std::fflush(stdout);
        // An entry that is not in the log would pass for one that spills nothing.
        if (use.registers == 0)
            std::printf("FAILED: the assembler's log says nothing of %s:\n%s\n", entry.c_str(),
                        cubin.log.c_str());
        constexpr std::uint32_t kAllowed = crt::cuda::kSpillBytesAllowed;
        const bool spills = use.spill_bytes > kAllowed;
        if (spills)
            std::printf("FAILED: %u bytes are spilled, and %u are allowed\n", use.spill_bytes, kAllowed);
        // The only array that a thread may keep in memory is the BVH's traversal stack. Spilled values are
        // there, too, and each is stored and loaded at least once.
        const bool array = !crt::cuda::traverses(spec) && use.stack_bytes > use.spill_bytes;
        if (array) std::printf("FAILED: local memory without a traversal stack\n");
        failures += use.registers == 0 || spills || array;
    }
    std::printf("%d of %zu variants failed\n", failures, variants.size());
    return failures == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const std::exception& error) {
        std::printf("FAILED: %s\n", error.what());
        return 1;
    }
}
