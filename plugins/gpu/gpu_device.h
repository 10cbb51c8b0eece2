/// An opened device that works in launches, as the common host code (gpu_integrator.h) sees it. CUDA and
/// OpenCL derive from it.
#pragma once

#include "gpu_program.h"

#include "backend/crt_backend.h"
#include "backend/sdk/plugin_guard.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace crt::gpu {

/// Memory on a device.
struct GpuBuffer {
    std::shared_ptr<void> owner;  ///< Gives it back.
    void* handle = nullptr;       ///< A CUdeviceptr or a cl_mem; null: no memory.
    std::uint64_t bytes = 0;
};

/// An argument of an entry point: a reference to a value, which must outlive the launch.
struct GpuArgument {
    const void* value;
    std::size_t bytes;
    GpuArgument(const GpuBuffer& buffer) : value(&buffer.handle), bytes(sizeof(void*)) {}
    template <class T, class = std::enable_if_t<std::is_trivially_copyable_v<T>>>
    GpuArgument(const T& number_or_struct) : value(&number_or_struct), bytes(sizeof(T)) {}
};
using GpuArguments = std::vector<GpuArgument>;

struct GpuGrid {
    std::uint64_t blocks;
    std::uint32_t threads;   ///< Of a block.
    std::uint32_t rows = 1;  ///< Each has that many blocks.
    /// Launches of different lanes may run at the same time, but for lane 0: its launches begin when all
    /// launches before have ended, and end before any launch after begins.
    std::uint32_t lane = 0;
};

/// Properties that decide how the common code works on a device.
struct DeviceTraits {
    std::string backend;  ///< "cuda", for messages.
    std::string name;
    std::uint64_t memory_bytes = 0;
    std::uint64_t largest_buffer_bytes = UINT64_MAX;
    bool own_memory = true;  ///< False: its memory is the host's.
    /// True if structs with pointers may be arguments: the first arguments are then those of cuda_dialect.h,
    /// else those of opencl_dialect.h.
    bool struct_arguments = false;
    std::uint32_t block_width = 1, block_height = 1;  ///< Pixels of a block of crt_render.
    double launch_seconds = 0.05;                     ///< Wanted duration of a launch of crt_render.
    std::uint64_t first_paths = 0, least_paths = 1;   ///< As LaunchPacer takes them.
};

/// Failures are thrown as PluginError. One thread at a time.
class GpuDevice {
public:
    virtual ~GpuDevice() = default;
    const DeviceTraits& traits() const { return traits_; }

    /// At the start of every verb, since the owner thread may be another one each time.
    virtual void makeCurrent() const {}

    /// The kernels of a scene. `wanted`: the lean ones; with CRT_KERNEL_FULL none is lean.
    virtual std::unique_ptr<GpuProgram> makeProgram(const plugin::Host& host, const Specs& wanted,
                                                    CrtKernelChoice choice) = 0;
    /// True if scenes of many materials are rendered in waves here (backend/sdk/gpu_schedule.h).
    virtual bool takesWaves(std::uint32_t /*max_depth*/) const { return true; }

    /// No promise: memory is shared with other programs.
    virtual std::uint64_t freeBytes() const = 0;
    /// Throws PluginError(CRT_OUT_OF_MEMORY), with the numbers, where less than `bytes` is free.
    void requireFree(std::uint64_t bytes, const char* what) const;
    /// `what`: the purpose, for the sentence if there is no room.
    GpuBuffer allocate(std::uint64_t bytes, const char* what);

    virtual void fill(const GpuBuffer& buffer, unsigned char value, std::uint64_t first,
                      std::uint64_t bytes) const = 0;
    void fill(const GpuBuffer& buffer, unsigned char value) const { fill(buffer, value, 0, buffer.bytes); }
    /// All of the buffer.
    virtual void write(const GpuBuffer& buffer, const void* from) const = 0;
    /// Waits for the launches before.
    virtual void read(const GpuBuffer& buffer, void* to, std::uint64_t first, std::uint64_t bytes) const = 0;
    void read(const GpuBuffer& buffer, void* to) const { read(buffer, to, 0, buffer.bytes); }

    /// Starts an entry point; `entry` as in GpuKernel, `name` for messages.
    virtual void launch(void* entry, const char* name, const GpuGrid& grid,
                        const GpuArguments& arguments) = 0;
    /// Seconds that the device took for the launches that `start` makes. Waits for their end.
    virtual double seconds(const std::function<void()>& start) = 0;

protected:
    DeviceTraits traits_;

private:
    /// The handle of new memory; null where there is not enough.
    virtual std::shared_ptr<void> take(std::uint64_t bytes) = 0;
    [[noreturn]] void refuse(std::uint64_t bytes, const char* what) const;
};

}  // namespace crt::gpu
