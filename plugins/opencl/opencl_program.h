/// From a feature mask to a kernel that can be launched: text, options, compiler, disk cache.
#pragma once

#include "opencl_device.h"

#include "backend/sdk/plugin_guard.h"
#include "common/kernel_spec.h"

#include <cstdint>
#include <string>

namespace crt::opencl {

/// Sides of a work-group, in pixels.
struct GroupSize {
    std::uint32_t x = 1, y = 1;
};

/// One pixel a group on a CPU: paths part at once, so work-items side by side share nothing, and PoCL's loop
/// over them costs a fifth to a third of the speed (measured with groups of 8 × 1 to 16 × 16). A GPU gets
/// the square that two warps or one wavefront fill.
GroupSize groupSize(const Device& device);

/// Places of ray counters, of two counters of two words each, as in kernels.cl.
constexpr std::uint32_t kRayCounters = 256;

/// A built kernel and what it cost to get it.
struct Program {
    ProgramHandle program;
    Kernel kernel;
    plugin::KernelSpec spec;
    bool from_cache = false;
    double compile_seconds = 0;
    double cache_seconds = 0;
};

/// Options that a kernel and a device are compiled with. No option that relaxes arithmetic: OpenCL's
/// defaults keep IEEE rounding.
std::string buildOptions(const Device& device, const plugin::KernelSpec& spec);

/// Compiles a kernel, or takes it from the host's cache.
Program buildProgram(const plugin::Host& host, const Device& device, const Session& session,
                     const plugin::KernelSpec& spec);

}  // namespace crt::opencl
