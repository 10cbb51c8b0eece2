// The OpenCL backend: its ABI table and its list of devices.
#include "opencl_integrator.h"

#include "backend/sdk/plugin_guard.h"
#include "kernel/dialect/features.h"

namespace {

std::vector<CrtDevice> probeDevices(const crt::plugin::Host&) {
    std::vector<CrtDevice> devices;
    for (const crt::opencl::Device& device : crt::opencl::usableDevices())
        devices.push_back(device.describe());
    return devices;
}

}  // namespace

CRT_DEFINE_BACKEND_BUILT_WITH(crt::opencl::OpenClIntegrator, probeDevices, "opencl", CRT_HEADERS_VERSION,
                              CRT_COMPILER_TEXT ", OpenCL 1.2", CRT_FEATURES_ALL)
