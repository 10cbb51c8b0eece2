#include "cuda_device.h"

#include "cuda_program.h"

#include "backend/sdk/plugin_guard.h"
#include "gpu/device_list.h"

#include <dlfcn.h>

#include <cstddef>
#include <fstream>
#include <utility>

namespace crt::cuda {

using plugin::PluginError;

namespace {

constexpr char kNoneUsable[] = "no GPU can be used";
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
                          "no NVIDIA driver is installed: the libcuda.so.1 that was found is the one of the "
                          "CUDA toolkit, which serves linking alone; install the driver");
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
    if (count == 0) throw PluginError(CRT_NO_DEVICE, "the NVIDIA driver is installed but sees no GPU");
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

std::vector<Device> usableDevices() { return gpu::usable(listDevices(), kNoneUsable); }

namespace {

/// The device's primary context, held open, and made current.
std::shared_ptr<CUctx_st> openContext(const Device& device) {
    const Driver& cuda = driver();
    CUcontext context = nullptr;
    cuda.check(cuda.cuDevicePrimaryCtxRetain(&context, device.id), "opening '" + device.name + "'");
    std::shared_ptr<CUctx_st> held(context,
                                   [id = device.id](CUcontext) { driver().cuDevicePrimaryCtxRelease(id); });
    cuda.check(cuda.cuCtxSetCurrent(context), "making the device current");
    return held;
}

std::shared_ptr<CUevent_st> makeEvent() {
    CUevent event = nullptr;
    // Waiting asleep: the host's cores have a kernel to compile.
    driver().check(driver().cuEventCreate(&event, CU_EVENT_BLOCKING_SYNC), "creating an event");
    return {event, [](CUevent made) { driver().cuEventDestroy(made); }};
}

std::shared_ptr<CUstream_st> makeStream() {
    CUstream stream = nullptr;
    driver().check(driver().cuStreamCreate(&stream, CU_STREAM_DEFAULT), "creating a stream");
    return {stream, [](CUstream made) { driver().cuStreamDestroy(made); }};
}

CUdeviceptr addressOf(const GpuBuffer& buffer) { return reinterpret_cast<CUdeviceptr>(buffer.handle); }

}  // namespace

CudaDevice::CudaDevice(const plugin::Host& host, const CrtCreateInfo& info)
    : opening_compiler_(info.kernel == CRT_KERNEL_FULL ? std::jthread() : std::jthread(openCompiler)),
      device_(gpu::choose(listDevices(), kNoneUsable, info.device)),
      context_(openContext(device_)),
      start_(makeEvent()),
      end_(makeEvent()) {
    if (info.threads != 0) host.log(CRT_LOG_DEBUG, "cuda: the number of threads does not apply");
    traits_.backend = "cuda";
    traits_.name = device_.name;
    traits_.memory_bytes = device_.memory_bytes;
    traits_.struct_arguments = true;
    traits_.block_width = kBlockWidth;
    traits_.block_height = kBlockHeight;
    traits_.launch_seconds = 0.03;
    traits_.first_paths = 1u << 18;
    // One warp for each of the four schedulers of a multiprocessor: none waits for another's turn, so that a
    // launch of this many paths takes as long as its longest one. Paths of 100,000 bounces take a second.
    traits_.least_paths = std::uint64_t{4 * 32} * device_.multiprocessors;
}

void CudaDevice::makeCurrent() const {
    driver().check(driver().cuCtxSetCurrent(context_.get()), "making the device current");
}

std::unique_ptr<gpu::GpuProgram> CudaDevice::makeProgram(const plugin::Host& host, const gpu::Specs& wanted,
                                                         CrtKernelChoice choice) {
    return std::make_unique<CudaProgram>(host, device_, wanted, choice);
}

std::uint64_t CudaDevice::freeBytes() const {
    std::size_t free_bytes = 0, all_bytes = 0;
    driver().check(driver().cuMemGetInfo(&free_bytes, &all_bytes), "querying free memory");
    return free_bytes;
}

std::shared_ptr<void> CudaDevice::take(std::uint64_t bytes) {
    CUdeviceptr address = 0;
    const CUresult result = driver().cuMemAlloc(&address, bytes);
    if (result == CUDA_ERROR_OUT_OF_MEMORY) return nullptr;
    driver().check(result, "allocating " + std::to_string(bytes) + " bytes");
    return {reinterpret_cast<void*>(address), [address](void*) { driver().cuMemFree(address); }};
}

void CudaDevice::fill(const GpuBuffer& to, unsigned char value, std::uint64_t first,
                      std::uint64_t bytes) const {
    driver().check(driver().cuMemsetD8(addressOf(to) + first, value, bytes), "clearing device memory");
}

void CudaDevice::write(const GpuBuffer& to, const void* from) const {
    driver().check(driver().cuMemcpyHtoD(addressOf(to), from, to.bytes), "uploading");
}

void CudaDevice::read(const GpuBuffer& from, void* to, std::uint64_t first, std::uint64_t bytes) const {
    driver().check(driver().cuMemcpyDtoH(to, addressOf(from) + first, bytes),
                   "reading from '" + device_.name + "'");
}

void CudaDevice::launch(void* entry, const char* name, const gpu::GpuGrid& grid,
                        const gpu::GpuArguments& arguments) {
    pointers_.clear();
    for (const gpu::GpuArgument& argument : arguments)
        pointers_.push_back(const_cast<void*>(argument.value));
    // The default stream waits for the others, and they for it.
    while (lanes_.size() < grid.lane) lanes_.push_back(makeStream());
    const CUresult result =
        driver().cuLaunchKernel(static_cast<CUfunction>(entry), static_cast<unsigned>(grid.blocks),
                                grid.rows, 1, grid.threads, 1, 1, 0,
                                grid.lane == 0 ? nullptr : lanes_[grid.lane - 1].get(), pointers_.data(),
                                nullptr);
    if (result != CUDA_SUCCESS) driver().check(result, std::string("launching ") + name);
}

double CudaDevice::seconds(const std::function<void()>& start) {
    const Driver& cuda = driver();
    cuda.check(cuda.cuEventRecord(start_.get(), nullptr), "recording an event");
    start();
    cuda.check(cuda.cuEventRecord(end_.get(), nullptr), "recording an event");
    cuda.check(cuda.cuEventSynchronize(end_.get()), "rendering on '" + device_.name + "'");
    float milliseconds = 0;
    cuda.check(cuda.cuEventElapsedTime(&milliseconds, start_.get(), end_.get()),
               "reading the kernel's time");
    return milliseconds * 1e-3;
}

}  // namespace crt::cuda
