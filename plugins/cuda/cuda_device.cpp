#include "cuda_device.h"

#include "backend/sdk/plugin_guard.h"

#include <dlfcn.h>

#include <cstdio>
#include <fstream>

namespace crt::cuda {

using plugin::PluginError;

namespace {

constexpr int kLeastArch = 75;  // the oldest that CUDA 13 compiles for, and the PTX that is always embedded

std::string cudaVersionText(int version) {
    return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

/// Version of the kernel module, as nvidia-smi shows it: the CUDA version alone does not tell one driver
/// from the next.
std::string moduleVersion() {
    std::string version;
    std::ifstream("/sys/module/nvidia/version") >> version;
    return version;
}

Driver openDriver() {
    void* library = dlopen("libcuda.so.1", RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr)
        throw PluginError(CRT_NO_DEVICE, std::string("no NVIDIA driver is installed: ") + dlerror());

    Driver driver;
#define CRT_CUDA_TEXT_OF(name) #name
#define CRT_CUDA_TEXT(name) CRT_CUDA_TEXT_OF(name)  // expands the versioned name first
#define CRT_CUDA_LOAD(name)                                                                            \
    driver.name = reinterpret_cast<decltype(driver.name)>(dlsym(library, CRT_CUDA_TEXT(name)));        \
    if (driver.name == nullptr)                                                                        \
        throw PluginError(CRT_NO_DEVICE, "the NVIDIA driver is too old: it lacks " CRT_CUDA_TEXT(name) \
            ", and this backend needs one for CUDA " +                                                 \
                                             cudaVersionText(CUDA_VERSION) + " or newer");
    CRT_CUDA_DRIVER_FUNCTIONS(CRT_CUDA_LOAD)
#undef CRT_CUDA_LOAD

    // The version may be asked for before cuInit, which an old driver refuses with less to say.
    if (driver.cuDriverGetVersion(&driver.cuda_version) == CUDA_SUCCESS &&
        driver.cuda_version / 1000 < CUDA_VERSION / 1000)
        throw PluginError(CRT_NO_DEVICE, "the NVIDIA driver is too old: it supports CUDA " +
                                             cudaVersionText(driver.cuda_version) +
                                             ", and this backend needs one for CUDA " +
                                             std::to_string(CUDA_VERSION / 1000) + " or newer");
    const CUresult started = driver.cuInit(0);
    if (started == CUDA_ERROR_NO_DEVICE)
        throw PluginError(CRT_NO_DEVICE, "the NVIDIA driver is installed but sees no GPU");
    if (started == CUDA_ERROR_STUB_LIBRARY)
        throw PluginError(CRT_NO_DEVICE,
                          "no NVIDIA driver is installed: the libcuda.so.1 that was found is the toolkit's "
                          "stub, which is meant for linking only");
    if (started != CUDA_SUCCESS) {
        const char* text = nullptr;
        driver.cuGetErrorString(started, &text);
        throw PluginError(CRT_NO_DEVICE,
                          "the NVIDIA driver does not start: " +
                              (text != nullptr ? std::string(text) : "error " + std::to_string(started)));
    }
    const std::string module = moduleVersion();
    driver.version = (module.empty() ? "" : module + ", ") + "CUDA " + cudaVersionText(driver.cuda_version);
    return driver;
}

int attribute(CUdevice device, CUdevice_attribute what) {
    int value = 0;
    driver().check(driver().cuDeviceGetAttribute(&value, what, device), "querying a device's properties");
    return value;
}

std::vector<Device> listDevices() {
    const Driver& cuda = driver();
    int count = 0;
    cuda.check(cuda.cuDeviceGetCount(&count), "counting CUDA devices");
    std::vector<Device> devices;
    for (int index = 0; index < count; ++index) {
        Device device;
        device.index = static_cast<std::uint32_t>(index);
        cuda.check(cuda.cuDeviceGet(&device.id, index), "opening CUDA device " + std::to_string(index));
        char name[128] = "";
        cuda.check(cuda.cuDeviceGetName(name, sizeof name, device.id), "querying a device's name");
        device.name = name;
        std::size_t bytes = 0;
        cuda.check(cuda.cuDeviceTotalMem(&bytes, device.id), "querying a device's memory");
        device.memory_bytes = bytes;
        device.multiprocessors =
            static_cast<std::uint32_t>(attribute(device.id, CU_DEVICE_ATTRIBUTE_MULTIPROCESSOR_COUNT));
        device.arch = 10 * attribute(device.id, CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR) +
                      attribute(device.id, CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR);
        if (device.arch < kLeastArch)
            device.unusable = "has compute capability " + std::to_string(device.arch / 10) + "." +
                              std::to_string(device.arch % 10) + ", and 7.5 or newer is needed";
        else if (attribute(device.id, CU_DEVICE_ATTRIBUTE_COMPUTE_MODE) == CU_COMPUTEMODE_PROHIBITED)
            device.unusable = "is closed to computing (nvidia-smi --compute-mode)";
        devices.push_back(device);
    }
    return devices;
}

}  // namespace

void Driver::check(CUresult result, const std::string& what) const {
    if (result == CUDA_SUCCESS) return;
    const char *name = nullptr, *text = nullptr;
    cuGetErrorName(result, &name);
    cuGetErrorString(result, &text);
    const bool memory = result == CUDA_ERROR_OUT_OF_MEMORY || result == CUDA_ERROR_LAUNCH_OUT_OF_RESOURCES;
    throw PluginError(memory ? CRT_OUT_OF_MEMORY : CRT_DEVICE_FAILED,
                      what +
                          " failed: " + (name != nullptr ? name : "CUDA error " + std::to_string(result)) +
                          (text != nullptr ? std::string(" (") + text + ")" : std::string()));
}

const Driver& driver() {
    // A throw leaves it unset, so that the next call tries, and explains, again.
    static const Driver opened = openDriver();
    return opened;
}

CrtDevice Device::describe() const {
    // Above the same GPU's score as an OpenCL device.
    return plugin::makeDevice(index, name, driver().version, memory_bytes, 3000.0 + multiprocessors);
}

std::vector<Device> usableDevices() {
    std::vector<Device> usable;
    std::string others;
    for (const Device& device : listDevices()) {
        if (device.unusable.empty())
            usable.push_back(device);
        else
            others += (others.empty() ? "" : ", ") + std::to_string(device.index) + " '" + device.name +
                      "' " + device.unusable;
    }
    if (usable.empty())
        throw PluginError(CRT_NO_DEVICE, others.empty() ? "the NVIDIA driver is installed but sees no GPU"
                                                        : "no GPU can be used: " + others);
    return usable;
}

Device chooseDevice(const char* wanted) {
    const std::vector<Device> usable = usableDevices();
    std::vector<CrtDevice> described;
    for (const Device& device : usable) described.push_back(device.describe());
    const CrtDevice& chosen = plugin::chooseDevice(described, wanted);
    return usable[static_cast<std::size_t>(&chosen - described.data())];
}

Context::Context(const Device& device) : device_(device.id) {
    driver().check(driver().cuDevicePrimaryCtxRetain(&context_, device_), "opening '" + device.name + "'");
}

Context::~Context() { driver().cuDevicePrimaryCtxRelease(device_); }

void Context::makeCurrent() const {
    driver().check(driver().cuCtxSetCurrent(context_), "making the device current");
}

namespace {

[[noreturn]] void refuseFor(std::uint64_t bytes, std::size_t free_bytes, std::size_t all_bytes,
                            const Device& device, const char* what) {
    throw PluginError(CRT_OUT_OF_MEMORY, std::string(what) + " needs " + megabytes(bytes) + ", but '" +
                                             device.name + "' has only " + megabytes(free_bytes) +
                                             " of its " + megabytes(all_bytes) + " free");
}

}  // namespace

void requireFree(std::uint64_t bytes, const Device& device, const char* what) {
    std::size_t free_bytes = 0, all_bytes = 0;
    driver().check(driver().cuMemGetInfo(&free_bytes, &all_bytes), "querying free memory");
    if (bytes > free_bytes) refuseFor(bytes, free_bytes, all_bytes, device, what);
}

Memory::Memory(std::uint64_t bytes, const Device& device, const char* what) {
    const Driver& cuda = driver();
    const CUresult result = cuda.cuMemAlloc(&address_, bytes);
    if (result == CUDA_ERROR_OUT_OF_MEMORY) {
        std::size_t free_bytes = 0, all_bytes = 0;
        cuda.cuMemGetInfo(&free_bytes, &all_bytes);
        refuseFor(bytes, free_bytes, all_bytes, device, what);
    }
    cuda.check(result, "allocating " + megabytes(bytes) + " for " + what);
    bytes_ = bytes;
}

Memory::~Memory() {
    if (address_ != 0) driver().cuMemFree(address_);
}

void Memory::fill(unsigned char value) const {
    driver().check(driver().cuMemsetD8(address_, value, bytes_), "clearing device memory");
}

void Memory::upload(const void* from) const {
    driver().check(driver().cuMemcpyHtoD(address_, from, bytes_), "uploading");
}

void Memory::download(void* to) const {
    driver().check(driver().cuMemcpyDtoH(to, address_, bytes_), "reading back");
}

std::string megabytes(std::uint64_t bytes) {
    char text[32];
    std::snprintf(text, sizeof text, "%.1f MB", static_cast<double>(bytes) / 1e6);
    return text;
}

}  // namespace crt::cuda
