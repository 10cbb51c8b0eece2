/// Kernels of GPU-like backends: what they are compiled from, and how the common host code sees them. CUDA
/// and OpenCL derive from GpuProgram; compilers and caches are theirs.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace crt::gpu {

/// An entry point, by its bit in CRT_ENTRIES of kernels.h.
enum class Entry : std::uint32_t { Render = 1, Trace = 2, Shade = 4, Choose = 8 };

/// Its name there.
inline const char* entryName(Entry entry) {
    switch (entry) {
        case Entry::Trace: return "crt_trace";
        case Entry::Shade: return "crt_shade_queue";
        case Entry::Choose: return "crt_choose_queue";
        case Entry::Render: break;
    }
    return "crt_render";
}

struct KernelSpec {
    Entry entry = Entry::Render;
    std::uint64_t features = 0;
    bool operator==(const KernelSpec& other) const {
        return entry == other.entry && features == other.features;
    }
};

using Specs = std::vector<KernelSpec>;

/// The whole text that a compiler gets: the host's text of kernel/schedule/wavefront.h, the words of one
/// language (`dialect`, whose errors name the file `dialect_name`), and kernels.h.
std::string kernelText(const std::string& wavefront_text, const char* dialect_name, const char* dialect);

/// A compiled entry point on a device.
struct GpuKernel {
    KernelSpec spec;
    std::shared_ptr<void> module;       ///< Keeps it loaded.
    void* entry = nullptr;              ///< That of spec.entry: a CUfunction or a cl_kernel.
    void* add_slices = nullptr;         ///< crt_add_slices; null: launches are not divided into slices.
    std::uint64_t resident_blocks = 1;  ///< Blocks of it that the device holds at once.
    std::uint32_t registers = 0, spill_bytes = 0;  ///< 0: not known.
};

/// Used by one thread at a time, the device current.
class GpuProgram {
public:
    explicit GpuProgram(Specs wanted) : wanted_(std::move(wanted)) {}
    virtual ~GpuProgram() = default;
    GpuProgram(const GpuProgram&) = delete;
    GpuProgram& operator=(const GpuProgram&) = delete;

    /// The kernels to be launched by now: those wanted, in their order, or crt_render alone while they are
    /// compiled or if they are not available. All give the same bits.
    virtual const std::vector<GpuKernel>& current() = 0;
    /// Goes on with crt_render, because the kernels of waves cannot run.
    virtual void giveUpWaves(const std::string& why) = 0;
    /// For people: the kernels that ran.
    virtual std::string description() const = 0;

    const Specs& wanted() const { return wanted_; }
    /// True if all kernels wanted came from the disk cache.
    bool fromCache() const { return from_cache_; }
    double compileSeconds() const { return compile_seconds_; }
    double cacheSeconds() const { return cache_seconds_; }

protected:
    Specs wanted_;
    bool from_cache_ = false;
    double compile_seconds_ = 0, cache_seconds_ = 0;
};

/// Measures from its construction.
class Stopwatch {
public:
    double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace crt::gpu
