/// The CUDA driver, found at run time, and its devices: listing, judging, choosing and opening them.
///
/// Nothing is linked: libcuda.so.1 belongs to the display driver, and a plugin that needs it to load could
/// not say that it is missing (docs/decisions/0006-cuda-driver-api.md).
#pragma once

#include "backend/crt_backend.h"
#include "gpu/gpu_device.h"

#include <cuda.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace crt::cuda {

using gpu::GpuBuffer;

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
    F(cuStreamCreate) F(cuStreamDestroy)                                                              \
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

/// Threads of a block and the pixels that it covers, as in cuda_dialect.h.
constexpr std::uint32_t kBlock = 128, kBlockWidth = 16, kBlockHeight = 8;

/// A GPU opened for work: its primary context, memory, launches.
class CudaDevice final : public gpu::GpuDevice {
public:
    CudaDevice(const plugin::Host& host, const CrtCreateInfo& info);

    void makeCurrent() const override;
    std::unique_ptr<gpu::GpuProgram> makeProgram(const plugin::Host& host, const gpu::Specs& wanted,
                                                 CrtKernelChoice choice) override;
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

    std::jthread opening_compiler_;  ///< While the device is opened.
    Device device_;
    std::shared_ptr<CUctx_st> context_;
    std::shared_ptr<CUevent_st> start_, end_;
    std::vector<std::shared_ptr<CUstream_st>> lanes_;  ///< From 1 on; 0 is the default stream.
    std::vector<void*> pointers_;  ///< To a launch's arguments.
};

}  // namespace crt::cuda
