// The OpenCL backend: its ABI table and its list of devices.
#include "opencl_device.h"

#include "backend/sdk/plugin_guard.h"
#include "gpu/device_list.h"
#include "gpu/gpu_integrator.h"
#include "kernel/dialect/features.h"

static std::vector<CrtDevice> probeDevices(const crt::plugin::Host&) {
    return crt::gpu::describe(crt::opencl::usableDevices());
}

CRT_DEFINE_BACKEND_BUILT_WITH(crt::gpu::GpuPlugin<crt::opencl::OpenClDevice>, probeDevices, "opencl",
                              CRT_HEADERS_VERSION, CRT_COMPILER_TEXT ", OpenCL 1.2", CRT_FEATURES_ALL)
