// The CUDA backend: its ABI table and its list of devices.
#include "cuda_device.h"

#include "backend/sdk/plugin_guard.h"
#include "gpu/device_list.h"
#include "gpu/gpu_integrator.h"
#include "kernel/dialect/features.h"

static std::vector<CrtDevice> probeDevices(const crt::plugin::Host&) {
    return crt::gpu::describe(crt::cuda::usableDevices());
}

CRT_DEFINE_BACKEND_BUILT_WITH(crt::gpu::GpuPlugin<crt::cuda::CudaDevice>, probeDevices, "cuda",
                              CRT_HEADERS_VERSION, CRT_COMPILER_TEXT ", CUDA " CRT_CUDA_TOOLKIT_VERSION,
                              CRT_FEATURES_ALL)
