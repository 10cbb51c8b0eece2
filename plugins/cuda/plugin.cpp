// The CUDA backend: its ABI table and its list of devices.
#include "cuda_integrator.h"

#include "backend/sdk/plugin_guard.h"
#include "kernel/dialect/features.h"

namespace {

std::vector<CrtDevice> probeDevices(const crt::plugin::Host&) {
    std::vector<CrtDevice> devices;
    for (const crt::cuda::Device& device : crt::cuda::usableDevices()) devices.push_back(device.describe());
    return devices;
}

}  // namespace

CRT_DEFINE_BACKEND_BUILT_WITH(crt::cuda::CudaIntegrator, probeDevices, "cuda", CRT_HEADERS_VERSION,
                              CRT_COMPILER_TEXT ", CUDA " CRT_CUDA_TOOLKIT_VERSION, CRT_FEATURES_ALL)
