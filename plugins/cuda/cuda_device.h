/// The CUDA driver, found at run time, and its devices: listing, judging and choosing them, and what every
/// other file here names it.
///
/// Nothing is linked: libcuda.so.1 belongs to the display driver, and a plugin that needs it to load could
/// not say that it is missing (docs/decisions/0006-cuda-driver-api.md).
#pragma once

#include "backend/crt_backend.h"

#include <cuda.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace crt::cuda {

// cuda.h turns some of these names into versioned ones (cuMemAlloc into cuMemAlloc_v2), here and wherever
// they are called.
#define CRT_CUDA_DRIVER_FUNCTIONS(F)                                                                  \
    F(cuInit) F(cuDriverGetVersion) F(cuGetErrorName) F(cuGetErrorString)                             \
    F(cuDeviceGetCount) F(cuDeviceGet) F(cuDeviceGetName) F(cuDeviceGetAttribute) F(cuDeviceTotalMem) \
    F(cuDevicePrimaryCtxRetain) F(cuDevicePrimaryCtxRelease) F(cuCtxSetCurrent)                       \
    F(cuModuleLoadData) F(cuModuleUnload) F(cuModuleGetFunction)                                      \
    F(cuFuncGetAttribute) F(cuFuncSetCacheConfig) F(cuOccupancyMaxActiveBlocksPerMultiprocessor)      \
        F(cuLaunchKernel)                                                                             \
    F(cuMemAlloc) F(cuMemFree) F(cuMemGetInfo) F(cuMemcpyHtoD) F(cuMemcpyDtoH) F(cuMemsetD8)          \
    F(cuEventCreate) F(cuEventDestroy) F(cuEventRecord) F(cuEventSynchronize) F(cuEventElapsedTime)

/// The driver's functions, initialised. One for the process; never closed, as drivers leave threads behind.
struct Driver {
#define CRT_CUDA_MEMBER(name) decltype(&::name) name = nullptr;
    CRT_CUDA_DRIVER_FUNCTIONS(CRT_CUDA_MEMBER)
#undef CRT_CUDA_MEMBER

    int cuda_version = 0;  ///< 1000 · major + 10 · minor, of the CUDA that it supports.
    std::string version;   ///< For humans: "580.65.06, CUDA 13.0".

    /// Throws unless `result` is CUDA_SUCCESS: one sentence that begins with `what` and names the error.
    void check(CUresult result, const std::string& what) const;
};

/// Opens the driver at the first call. Throws PluginError(CRT_NO_DEVICE) with one sentence where there is
/// none, or too old a one. [any thread]
const Driver& driver();

/// One GPU, usable or not.
struct Device {
    CUdevice id = 0;
    std::uint32_t index = 0;  ///< As CUDA counts, so CUDA_VISIBLE_DEVICES applies.
    std::string name;
    int arch = 0;  ///< 10 · major + minor of its compute capability.
    std::uint32_t multiprocessors = 0;
    std::uint64_t memory_bytes = 0;
    std::string unusable;  ///< Reason why it cannot be used; empty if it can.

    CrtDevice describe() const;
};

/// The GPUs that can be used. Throws PluginError(CRT_NO_DEVICE) that says why when there is none.
std::vector<Device> usableDevices();

/// The device that --device means (crt::plugin::chooseDevice).
Device chooseDevice(const char* wanted);

/// The device's primary context, held open. All CUDA calls of an integrator are made while it is current.
class Context {
public:
    explicit Context(const Device& device);
    ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    /// Makes it the calling thread's: at the start of every verb, since the owner thread may be another one
    /// each time.
    void makeCurrent() const;
    /// The same for a destructor: when it fails the device is lost, and there is nothing to give back.
    void tryMakeCurrent() const noexcept { driver().cuCtxSetCurrent(context_); }

private:
    CUdevice device_;
    CUcontext context_ = nullptr;
};

/// Throws PluginError(CRT_OUT_OF_MEMORY), with the numbers, where the current device has less than `bytes`
/// free. A larger amount of free memory is no promise: memory is shared with other programs.
void requireFree(std::uint64_t bytes, const Device& device, const char* what);

/// Plain device memory.
class Memory {
public:
    Memory() = default;
    Memory(std::uint64_t bytes, const Device& device, const char* what);
    Memory(Memory&& other) noexcept
        : address_(std::exchange(other.address_, 0)), bytes_(std::exchange(other.bytes_, 0)) {}
    Memory& operator=(Memory&& other) noexcept {
        std::swap(address_, other.address_);
        std::swap(bytes_, other.bytes_);
        return *this;
    }
    ~Memory();

    CUdeviceptr address() const { return address_; }
    std::uint64_t bytes() const { return bytes_; }

    void fill(unsigned char value) const;
    void upload(const void* from) const;
    void download(void* to) const;

private:
    CUdeviceptr address_ = 0;
    std::uint64_t bytes_ = 0;
};

/// "12.3 MB".
std::string megabytes(std::uint64_t bytes);

}  // namespace crt::cuda
