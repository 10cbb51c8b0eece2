/// OpenCL devices: listing, judging, choosing and opening them, and the vocabulary every other file here
/// uses (handles, checked calls).
#pragma once

#include "backend/crt_backend.h"
#include "gpu/gpu_device.h"

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

namespace crt::opencl {

using gpu::GpuBuffer;

/// "CL_BUILD_PROGRAM_FAILURE" for −11, and so on.
std::string errorName(cl_int error);

/// Throws unless `result` is CL_SUCCESS: one sentence that begins with `what` and names the error. Lack of
/// memory has a separate status.
void check(cl_int result, const std::string& what);

/// Owns one OpenCL object.
template <auto Release>
struct Releaser {
    template <class Object>
    void operator()(Object* object) const {
        Release(object);
    }
};
template <class Object, auto Release>
using Handle = std::unique_ptr<std::remove_pointer_t<Object>, Releaser<Release>>;

using Context = Handle<cl_context, clReleaseContext>;
using Queue = Handle<cl_command_queue, clReleaseCommandQueue>;
using Event = Handle<cl_event, clReleaseEvent>;
using ProgramHandle = Handle<cl_program, clReleaseProgram>;
using Kernel = Handle<cl_kernel, clReleaseKernel>;
using SubDevice = Handle<cl_device_id, clReleaseDevice>;

/// One device of one platform, usable or not.
struct Device {
    cl_device_id id = nullptr;
    std::uint32_t index =
        0;  ///< Among all devices of all platforms, in the order the ICD loader lists them.
    std::string name;
    std::string driver;    ///< Driver version and platform version.
    bool is_cpu = false;
    bool has_correct_division_option = false;  ///< Takes -cl-fp32-correctly-rounded-divide-sqrt.
    std::uint32_t compute_units = 0, address_bits = 0;
    std::uint64_t memory_bytes = 0;
    std::uint64_t largest_buffer_bytes = 0;
    std::string unusable;  ///< Reason why it cannot give the same bits as the others; empty if it can.

    double score() const;
    CrtDevice describe() const;
};

/// The devices that can be used. Throws PluginError(CRT_NO_DEVICE) that says of each why not when there is
/// none.
std::vector<Device> usableDevices();

/// A device, or some of a CPU's compute units, opened for work.
struct Session {
    SubDevice part;  ///< Empty where all of the device is in use.
    Context context;
    Queue queue;  ///< In order, with profiling.
    cl_device_id target = nullptr;
    std::uint32_t compute_units = 0;
};

/// The session with `threads` compute units (0, or more than there are: all; only a CPU can be divided),
/// opened at the first call and shared from then on until the process ends. It is never closed: PoCL's
/// workers (3.1) look at the queue and the device of a command for a moment after they have reported it
/// complete, and crash when those are gone. [any thread]
const Session& openSession(const Device& device, std::uint32_t threads);

/// A device opened for work: memory and launches.
class OpenClDevice final : public gpu::GpuDevice {
public:
    OpenClDevice(const plugin::Host& host, const CrtCreateInfo& info);

    std::unique_ptr<gpu::GpuProgram> makeProgram(const plugin::Host& host, const gpu::Specs& wanted,
                                                 CrtKernelChoice choice) override;
    /// On GPUs. On a processor the lanes do not wait for each other, and waves cost a fifth to a third
    /// (docs/decisions/0044-waves-for-opencl.md); with CRT_OPENCL_WAVES=1 in the environment it takes them
    /// too, so that tests and measurements can. Everywhere, where a path may outlast a launch.
    bool takesWaves(std::uint32_t max_depth) const override;
    std::uint64_t freeBytes() const override;
    void fill(const GpuBuffer& to, unsigned char value, std::uint64_t first,
              std::uint64_t bytes) const override;
    void write(const GpuBuffer& to, const void* from) const override;
    void read(const GpuBuffer& from, void* to, std::uint64_t first, std::uint64_t bytes) const override;
    void launch(void* entry, const char* name, const gpu::GpuGrid& grid,
                const gpu::GpuArguments& arguments) override;
    double seconds(const std::function<void()>& start) override;

private:
    std::shared_ptr<void> take(std::uint64_t bytes) override;

    Device device_;
    const Session& session_;
    std::uint64_t allocated_bytes_ = 0;
    Event first_launch_;          ///< Since seconds() was called.
    std::uint32_t launches_ = 0;  ///< The same.
};

}  // namespace crt::opencl
