/// OpenCL devices: listing, judging and choosing them, and the vocabulary every other file here uses
/// (handles, checked calls).
#pragma once

#include "backend/crt_backend.h"

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace crt::opencl {

/// "CL_BUILD_PROGRAM_FAILURE" for −11, and so on.
std::string errorName(cl_int error);

/// Throws unless `result` is CL_SUCCESS: one sentence that begins with `what` and names the error. Lack of
/// memory has a separate status.
void check(cl_int result, const std::string& what);

/// Owns one OpenCL object.
template <class Object, cl_int (*Release)(Object)>
class Handle {
public:
    Handle() = default;
    explicit Handle(Object object) : object_(object) {}
    Handle(Handle&& other) noexcept : object_(std::exchange(other.object_, nullptr)) {}
    Handle& operator=(Handle&& other) noexcept {
        std::swap(object_, other.object_);
        return *this;
    }
    ~Handle() {
        if (object_ != nullptr) Release(object_);
    }
    Object get() const { return object_; }
    explicit operator bool() const { return object_ != nullptr; }

private:
    Object object_ = nullptr;
};

using Context = Handle<cl_context, clReleaseContext>;
using Queue = Handle<cl_command_queue, clReleaseCommandQueue>;
using Buffer = Handle<cl_mem, clReleaseMemObject>;
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

/// Every device of every platform, the unusable too. Throws when there is not one.
std::vector<Device> listDevices();

/// Those that can be used. Throws PluginError(CRT_NO_DEVICE) that says of each why not when there is none.
std::vector<Device> usableDevices();

/// The device that --device means (crt::plugin::chooseDevice). Throws when there is none, and then also says
/// what is wrong with the others.
Device chooseDevice(const char* wanted);

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

}  // namespace crt::opencl
