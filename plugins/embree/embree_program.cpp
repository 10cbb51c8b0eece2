#include "embree_program.h"

#include "embree_kernels.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <thread>

namespace crt::embree {

using plugin::KernelCache;

#define CRT_EMBREE_DECLARE(Name, NAME, lean, text) RayTotals render##Name(const TileJob& job);
CRT_EMBREE_KERNELS(CRT_EMBREE_DECLARE)  // kernels.cpp defines them.
#undef CRT_EMBREE_DECLARE

namespace {

#define CRT_EMBREE_ROW(Name, NAME, lean, text) {text, CRT_EMBREE_##NAME##_FEATURES, render##Name, lean},
constexpr Precompiled kPrograms[] = {CRT_EMBREE_KERNELS(CRT_EMBREE_ROW)};
#undef CRT_EMBREE_ROW

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Kernels that are compiled ahead do not have the texts of CRT_KERNEL_DIR.
bool hasOtherTexts() {
    const char* const directory = std::getenv("CRT_KERNEL_DIR");
    return directory != nullptr && *directory != '\0';
}

}  // namespace

const Precompiled& choosePrecompiled(std::uint64_t scene_features, CrtKernelChoice choice) {
    if (choice != CRT_KERNEL_FULL)
        for (const Precompiled& program : kPrograms)
            if ((scene_features & ~program.features) == 0) return program;
    return std::end(kPrograms)[-1];
}

std::span<const Precompiled> allPrecompiled() { return kPrograms; }

std::optional<double> compileAfterSeconds(bool is_lean_enough, bool has_avx512, const char* said) {
    if (is_lean_enough && !has_avx512) return std::nullopt;
    char* end = nullptr;
    const double seconds = said != nullptr ? std::strtod(said, &end) : -1;
    if (end != said && end != nullptr && *end == '\0' && seconds >= 0) return seconds;
    return is_lean_enough ? kSecondsBeforeVectorizing : kSecondsBeforeCompiling;
}

EmbreeProgram::EmbreeProgram(const plugin::Host& host, std::uint64_t scene_features, CrtKernelChoice choice)
    : host_(host),
      scene_features_(scene_features),
      precompiled_(choosePrecompiled(scene_features, choice)),
      current_(precompiled_.render),
      compile_after_seconds_(compileAfterSeconds(precompiled_.is_lean_enough && !hasOtherTexts(),
                                                 processorHasAvx512(), std::getenv("CRT_COMPILE_AFTER"))) {
    if (choice == CRT_KERNEL_FULL || !compile_after_seconds_) return;
    openCompiler();
    if (choice != CRT_KERNEL_LEAN_ONLY || lean_) return;
    while (compiler_) {
        poll(std::numeric_limits<double>::infinity());
        if (compiler_) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    rendered_precompiled_ = false;
}

void EmbreeProgram::openCompiler() {
    try {
        compiler_ = findCompiler(std::getenv("CRT_CXX"), std::getenv("PATH"));
    } catch (const std::exception& error) {
        giveUp(CRT_LOG_INFO, error.what());
        return;
    }
    const Clock::time_point start = Clock::now();
    text_ = kernelText(host_.kernelSource("kernel/schedule/pixel.h"));
    if (const char* const directory = host_.cacheDirectory()) place_.cache_directory = directory;
    place_.key = cacheKey(text_, *compiler_, scene_features_);
    std::string refused;
    const auto code = KernelCache(host_.cacheDirectory()).load(place_.key, &refused);
    if (!refused.empty())
        host_.log(CRT_LOG_WARNING, "embree: a cached kernel is refused, and compiled again: " + refused);
    if (code) {
        try {
            take(*code);
            from_cache_ = true;
        } catch (const std::runtime_error& error) {
            place_.replaces = true;
            host_.log(
                CRT_LOG_DEBUG,
                std::string("embree: the cached kernel is refused, and compiled again: ") + error.what());
        }
    }
    cache_seconds_ = secondsSince(start);
}

void EmbreeProgram::startCompiling() {
    if (!compiler_) return;
    try {
        if (!plugin::CompileProcess::mayStart(place_, std::max(std::thread::hardware_concurrency(), 1u)))
            return;
        process_ = std::make_unique<plugin::CompileProcess>(compileProgram(), place_,
                                                            messageOf(text_, *compiler_, scene_features_));
    } catch (const std::exception& error) {
        giveUp(CRT_LOG_WARNING, error.what());
    }
}

void EmbreeProgram::take(const std::vector<unsigned char>& code) {
    lean_.emplace(code);
    compiler_.reset();
    current_.store(lean_->render(), std::memory_order_release);
}

void EmbreeProgram::giveUp(CrtLogLevel level, const std::string& why) {
    compiler_.reset();
    process_.reset();
    host_.log(level, std::string("embree: rendering with the precompiled kernel '") + precompiled_.name +
                         "': " + why);
}

void EmbreeProgram::poll(double rendered) {
    if (!compiler_) return;
    if (!process_) {
        rendered_precompiled_ = true;
        if (rendered >= *compile_after_seconds_) startCompiling();
        return;
    }
    try {
        const std::optional<plugin::CompiledCode> compiled = process_->poll();
        if (!compiled) return;
        process_.reset();
        compile_seconds_ = compiled->compile_seconds;
        cache_seconds_ += compiled->cache_seconds;
        take(compiled->code);
    } catch (const std::exception& error) {
        giveUp(CRT_LOG_WARNING, error.what());
    }
}

std::string EmbreeProgram::description() const {
    const std::string precompiled = std::string("precompiled, ") + precompiled_.name;
    if (!lean_) return precompiled;
    return (rendered_precompiled_ ? precompiled + ", then " : std::string()) + "lean, " + lean_->compiler();
}

}  // namespace crt::embree
