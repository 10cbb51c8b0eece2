/// From what a scene needs to the kernel that renders it: one of those compiled ahead at once, and the lean
/// one from the disk cache or, compiled by a separate process, as soon as it is ready. They give the same
/// bits, so a render may go over from one to the other between tiles.
#pragma once

#include "embree_lean_kernel.h"
#include "tile_job.h"

#include "backend/crt_backend.h"
#include "backend/sdk/plugin_guard.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace crt::embree {

/// A kernel compiled ahead of time.
struct Precompiled {
    const char* name;
    std::uint64_t features;
    RenderTile render;
    bool is_lean_enough;  ///< Leaving out what a scene does not need gains nothing, by measurement.
};

/// Smallest mask first; the last one has all features.
std::span<const Precompiled> allPrecompiled();

/// The smallest one that covers the scene.
const Precompiled& choosePrecompiled(std::uint64_t scene_features, CrtKernelChoice choice);

/// Processor seconds of rendering after which the compiler is started. The compiler takes about as many:
/// however long the render is, both together take at most twice the time of the better choice.
constexpr double kSecondsBeforeCompiling = 4;
/// The same where a kernel gains from AVX-512 alone, which is some 5 % of the time: a render of this length
/// gains what the compiler takes.
constexpr double kSecondsBeforeVectorizing = 60;

/// After how many processor seconds of rendering a scene has its own kernel compiled; nothing where it never
/// has, because it would gain nothing. `said` is the environment's CRT_COMPILE_AFTER, or null.
std::optional<double> compileAfterSeconds(bool is_lean_enough, bool has_avx512, const char* said);

/// The kernels for one scene.
class EmbreeProgram {
public:
    /// With CRT_KERNEL_LEAN_ONLY it waits for the compiler, with CRT_KERNEL_FULL none is lean.
    EmbreeProgram(const plugin::Host& host, std::uint64_t scene_features, CrtKernelChoice choice);

    /// The kernel to render with by now. [any thread]
    RenderTile current() const { return current_.load(std::memory_order_acquire); }
    /// Starts the compiler when `rendered` processor seconds are enough, and takes the kernel that is ready.
    /// [one thread at a time]
    void poll(double rendered);

    /// "precompiled, all features, then lean, g++ 12.2.0".
    std::string description() const;
    std::uint64_t features() const { return lean_ ? scene_features_ : precompiled_.features; }
    bool fromCache() const { return from_cache_; }
    double compileSeconds() const { return compile_seconds_; }
    double cacheSeconds() const { return cache_seconds_; }

private:
    void openCompiler();
    void startCompiling();
    void take(const std::vector<unsigned char>& code);
    /// Goes on with the precompiled kernel, which gives the same image.
    void giveUp(CrtLogLevel level, const std::string& why);

    plugin::Host host_;
    std::uint64_t scene_features_;
    const Precompiled& precompiled_;
    std::atomic<RenderTile> current_;
    std::optional<Compiler> compiler_;  ///< None: there is nothing to be compiled any more.
    std::string text_;
    plugin::CompilePlace place_;
    std::unique_ptr<plugin::CompileProcess> process_;
    std::optional<LeanKernel> lean_;
    bool rendered_precompiled_ = false, from_cache_ = false;
    std::optional<double> compile_after_seconds_;
    double compile_seconds_ = 0, cache_seconds_ = 0;
};

}  // namespace crt::embree
