/// From a feature mask to a kernel that can be launched: text, options, compiler, disk cache.
#pragma once

#include "opencl_device.h"

#include "backend/sdk/plugin_guard.h"

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

/// A built kernel and what it cost to get it.
struct Program {
    ProgramHandle program;
    Kernel render;
    std::uint64_t features = 0;
    bool from_cache = false;
    double compile_seconds = 0;
    double cache_seconds = 0;
};

/// Options that a mask and a device are compiled with. No option that relaxes arithmetic: OpenCL's defaults
/// keep IEEE rounding.
std::string buildOptions(const Device& device, std::uint64_t features);

/// Compiles the kernel for `features`, or takes it from the host's cache.
Program buildProgram(const plugin::Host& host, const Device& device, const Session& session,
                     std::uint64_t features);

}  // namespace crt::opencl
