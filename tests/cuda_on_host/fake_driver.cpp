// A libcuda.so.1 for tests: a device with 1 GB whose memory is the host's and whose kernels are those of
// host_kernels.cpp. With it the real CUDA plugin runs on a machine without a GPU: opening the driver,
// allocating, choosing slices, passing arguments, going over from the precompiled kernel to NVRTC's, running
// out of memory. It checks what a driver would check: sizes, handles, and that memory is given back.
//
// CRT_FAKE_CUDA says what is to go wrong: "no_device", "old" (a driver for CUDA 11), "launch" (every launch
// fails), "little_memory" (other programs have taken all but a few megabytes) or "overtaken" (they take it
// after cuMemGetInfo was asked).
// CRT_FAKE_CUDA_DEVICES: number of devices instead of one.
// CRT_FAKE_CUDA_MEMORY: bytes of each that other programs leave.
// CRT_FAKE_CUDA_LAUNCH_MEMORY: bytes that must be free for a launch, as a kernel's local memory is.
// CRT_FAKE_CUDA_LOST=D:N,…: the N-th launch on device D fails, and whatever is asked of it after that.
// Devices that are not to be lost launch nothing until it has happened, or all work could be done without D.
// CRT_FAKE_CUDA_PEAK: a file, to which the most bytes that were ever allocated are written in the end.
#include "host_kernels.h"

#include <cuda.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>
#include <string>
#include <thread>

namespace {

constexpr std::size_t kMemory = std::size_t{1} << 30;
constexpr int kMultiprocessors = 8;

struct Allocation {
    std::size_t bytes;
    CUcontext owner;
};

std::mutex mutex;
std::map<CUdeviceptr, Allocation> allocations;
std::size_t allocated = 0, most_allocated = 0;  // On all devices.

bool goesWrong(const char* how) {
    const char* wanted = std::getenv("CRT_FAKE_CUDA");
    return wanted != nullptr && std::strcmp(wanted, how) == 0;
}

std::size_t number(const char* variable, std::size_t otherwise) {
    const char* value = std::getenv(variable);
    return value != nullptr ? std::strtoull(value, nullptr, 10) : otherwise;
}

/// The part of a device's memory that this program can have.
std::size_t ownMemory() {
    return number("CRT_FAKE_CUDA_MEMORY", goesWrong("little_memory") ? std::size_t{8} << 20 : kMemory);
}

/// The launch at which a device is lost; 0: never.
std::size_t lostAt(int device) {
    const char* value = std::getenv("CRT_FAKE_CUDA_LOST");
    const std::string text = value != nullptr ? ',' + std::string(value) : "";
    const std::size_t at = text.find(',' + std::to_string(device) + ':');
    return at == std::string::npos ? 0 : std::strtoull(text.c_str() + text.find(':', at) + 1, nullptr, 10);
}

/// True if [address, address + bytes) lies in one allocation.
bool isAllocated(CUdeviceptr address, std::size_t bytes) {
    const std::lock_guard<std::mutex> lock(mutex);
    auto next = allocations.upper_bound(address);
    if (next == allocations.begin()) return false;
    const auto& [start, allocation] = *--next;
    return address + bytes <= start + allocation.bytes;
}

void* host(CUdeviceptr address) { return reinterpret_cast<void*>(address); }

int modules_loaded = 0;
bool lost = false;  // A device, whose memory cannot be given back then.
double clockSeconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Looks for what was not given back when the process ends.
struct LeakCheck {
    ~LeakCheck() {
        if (const char* name = std::getenv("CRT_FAKE_CUDA_PEAK")) {
            if (std::FILE* file = std::fopen(name, "w")) {
                std::fprintf(file, "%zu\n", most_allocated);
                std::fclose(file);
            }
        }
        if (lost || (allocated == 0 && modules_loaded == 0)) return;
        std::fprintf(stderr, "fake CUDA driver: %zu bytes and %d modules were not given back\n", allocated,
                     modules_loaded);
        std::_Exit(99);
    }
} leak_check;

}  // namespace

// Definitions that cuda.h leaves open: an event is the time of its recording, a function its name.
struct CUstream_st {};
struct CUevent_st {
    double seconds = 0;
};
struct CUfunc_st {
    std::string name;
};
struct CUmod_st {
    CUfunc_st functions[5] = {
        {"crt_render"}, {"crt_add_slices"}, {"crt_trace"}, {"crt_choose_queue"}, {"crt_shade_queue"}};
};
struct CUctx_st {
    int users = 0;
    std::size_t allocated = 0, launches = 0;
    bool lost = false;
};

static constexpr int kMostDevices = 8;
static CUctx_st contexts[kMostDevices];
static thread_local CUcontext current = nullptr;
static std::condition_variable device_lost;

/// True if a device will be lost that is not yet.
static bool lossIsAwaited() {
    for (int device = 0; device < kMostDevices; ++device)
        if (lostAt(device) != 0 && !contexts[device].lost) return true;
    return false;
}

/// The first message of every call.
static CUresult stateOfDevice() {
    if (current == nullptr) return CUDA_ERROR_INVALID_CONTEXT;
    const std::lock_guard<std::mutex> lock(mutex);
    return current->lost ? CUDA_ERROR_LAUNCH_FAILED : CUDA_SUCCESS;
}
#define CRT_FAKE_NEEDS_DEVICE() \
    if (const CUresult state = stateOfDevice(); state != CUDA_SUCCESS) return state

extern "C" {

#define CRT_FAKE __attribute__((visibility("default"))) CUresult

CRT_FAKE cuInit(unsigned) { return goesWrong("no_device") ? CUDA_ERROR_NO_DEVICE : CUDA_SUCCESS; }
CRT_FAKE cuDriverGetVersion(int* version) {
    *version = goesWrong("old") ? 11080 : CUDA_VERSION;
    return CUDA_SUCCESS;
}
CRT_FAKE cuGetErrorName(CUresult result, const char** name) {
    *name = result == CUDA_ERROR_LAUNCH_FAILED   ? "CUDA_ERROR_LAUNCH_FAILED"
            : result == CUDA_ERROR_OUT_OF_MEMORY ? "CUDA_ERROR_OUT_OF_MEMORY"
                                                 : "CUDA_ERROR_OTHER";
    return CUDA_SUCCESS;
}
CRT_FAKE cuGetErrorString(CUresult, const char** text) {
    *text = "told by the fake driver";
    return CUDA_SUCCESS;
}
// NVRTC opens the driver too, and asks for its inner tables: a driver may have none.
CRT_FAKE cuGetExportTable(const void** table, const CUuuid*) {
    *table = nullptr;
    return CUDA_ERROR_NOT_FOUND;
}
CRT_FAKE cuDeviceGetCount(int* count) {
    *count = static_cast<int>(std::min<std::size_t>(number("CRT_FAKE_CUDA_DEVICES", 1), kMostDevices));
    return CUDA_SUCCESS;
}
CRT_FAKE cuDeviceGet(CUdevice* device, int index) {
    *device = index;
    return index >= 0 && index < kMostDevices ? CUDA_SUCCESS : CUDA_ERROR_INVALID_DEVICE;
}
CRT_FAKE cuDeviceGetName(char* name, int size, CUdevice) {
    std::snprintf(name, static_cast<std::size_t>(size), "Fake GPU");
    return CUDA_SUCCESS;
}
CRT_FAKE cuDeviceGetAttribute(int* value, CUdevice_attribute what, CUdevice) {
    switch (what) {
        case CU_DEVICE_ATTRIBUTE_MULTIPROCESSOR_COUNT: *value = kMultiprocessors; break;
        case CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR: *value = 9; break;
        case CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR: *value = 0; break;
        case CU_DEVICE_ATTRIBUTE_COMPUTE_MODE: *value = CU_COMPUTEMODE_DEFAULT; break;
        default: return CUDA_ERROR_INVALID_VALUE;
    }
    return CUDA_SUCCESS;
}
CRT_FAKE cuDeviceTotalMem(std::size_t* bytes, CUdevice) {
    *bytes = kMemory;
    return CUDA_SUCCESS;
}

CRT_FAKE cuDevicePrimaryCtxRetain(CUcontext* retained, CUdevice device) {
    const std::lock_guard<std::mutex> lock(mutex);
    ++contexts[device].users;
    *retained = &contexts[device];
    return CUDA_SUCCESS;
}
CRT_FAKE cuDevicePrimaryCtxRelease(CUdevice device) {
    const std::lock_guard<std::mutex> lock(mutex);
    --contexts[device].users;
    return CUDA_SUCCESS;
}
CRT_FAKE cuCtxSetCurrent(CUcontext made_current) {
    current = made_current;
    return CUDA_SUCCESS;
}

CRT_FAKE cuModuleLoadData(CUmodule* module, const void* image) {
    CRT_FAKE_NEEDS_DEVICE();
    unsigned magic = 0;
    std::memcpy(&magic, image, sizeof magic);
    const bool elf = magic == 0x464c457fu, fat_binary = magic == 0xba55ed50u;
    if (!elf && !fat_binary) return CUDA_ERROR_INVALID_IMAGE;
    *module = new CUmod_st;
    const std::lock_guard<std::mutex> lock(mutex);
    ++modules_loaded;
    return CUDA_SUCCESS;
}
CRT_FAKE cuModuleUnload(CUmodule module) {
    CRT_FAKE_NEEDS_DEVICE();
    delete module;
    const std::lock_guard<std::mutex> lock(mutex);
    --modules_loaded;
    return CUDA_SUCCESS;
}
CRT_FAKE cuModuleGetFunction(CUfunction* function, CUmodule module, const char* name) {
    if (!crt::cuda_on_host::hasKernel(name)) return CUDA_ERROR_NOT_FOUND;
    for (CUfunc_st& known : module->functions)
        if (known.name == name) *function = &known;
    return CUDA_SUCCESS;
}
CRT_FAKE cuFuncGetAttribute(int* value, CUfunction_attribute what, CUfunction) {
    *value = what == CU_FUNC_ATTRIBUTE_NUM_REGS ? 128 : 0;
    return CUDA_SUCCESS;
}
CRT_FAKE cuFuncSetCacheConfig(CUfunction, CUfunc_cache) { return CUDA_SUCCESS; }
CRT_FAKE cuOccupancyMaxActiveBlocksPerMultiprocessor(int* blocks, CUfunction, int, std::size_t) {
    *blocks = 4;
    return CUDA_SUCCESS;
}
CRT_FAKE cuLaunchKernel(CUfunction function, unsigned grid_x, unsigned grid_y, unsigned grid_z,
                        unsigned block_x, unsigned block_y, unsigned block_z, unsigned shared_bytes,
                        CUstream, void** arguments, void** extra) {
    CRT_FAKE_NEEDS_DEVICE();
    if (goesWrong("launch")) return CUDA_ERROR_LAUNCH_FAILED;
    {
        std::unique_lock<std::mutex> lock(mutex);
        const std::size_t last_launch = lostAt(static_cast<int>(current - contexts));
        static bool patient = true;
        if (last_launch == 0 && patient)
            patient = device_lost.wait_for(lock, std::chrono::seconds(2), [] { return !lossIsAwaited(); });
        if (++current->launches == last_launch) {
            lost = current->lost = true;
            device_lost.notify_all();
        }
        if (current->lost) return CUDA_ERROR_LAUNCH_FAILED;
        if (number("CRT_FAKE_CUDA_LAUNCH_MEMORY", 0) > ownMemory() - current->allocated)
            return CUDA_ERROR_OUT_OF_MEMORY;
    }
    if (grid_x == 0 || grid_y == 0 || grid_y > 65535 || grid_z != 1 || block_y != 1 || block_z != 1 ||
        shared_bytes != 0 || extra != nullptr)
        return CUDA_ERROR_INVALID_VALUE;
    static const unsigned threads = std::max(1u, std::thread::hardware_concurrency());  // Reads files.
    return crt::cuda_on_host::launchByName(function->name.c_str(), grid_x, grid_y, block_x, arguments,
                                           threads)
               ? CUDA_SUCCESS
               : CUDA_ERROR_INVALID_VALUE;
}

CRT_FAKE cuMemAlloc(CUdeviceptr* address, std::size_t bytes) {
    CRT_FAKE_NEEDS_DEVICE();
    if (bytes == 0) return CUDA_ERROR_INVALID_VALUE;
    const std::lock_guard<std::mutex> lock(mutex);
    if (bytes > ownMemory() - current->allocated) return CUDA_ERROR_OUT_OF_MEMORY;
    void* memory = std::aligned_alloc(256, (bytes + 255) / 256 * 256);
    if (memory == nullptr) return CUDA_ERROR_OUT_OF_MEMORY;
    std::memset(memory, 0xcd, bytes);  // code that relies on cleared memory shall fail
    *address = reinterpret_cast<CUdeviceptr>(memory);
    allocations[*address] = {bytes, current};
    current->allocated += bytes;
    allocated += bytes;
    most_allocated = std::max(most_allocated, allocated);
    return CUDA_SUCCESS;
}
CRT_FAKE cuMemFree(CUdeviceptr address) {
    CRT_FAKE_NEEDS_DEVICE();
    const std::lock_guard<std::mutex> lock(mutex);
    const auto found = allocations.find(address);
    if (found == allocations.end() || found->second.owner != current) return CUDA_ERROR_INVALID_VALUE;
    allocated -= found->second.bytes;
    current->allocated -= found->second.bytes;
    allocations.erase(found);
    std::free(host(address));
    return CUDA_SUCCESS;
}
CRT_FAKE cuMemGetInfo(std::size_t* free_bytes, std::size_t* all_bytes) {
    CRT_FAKE_NEEDS_DEVICE();
    const std::lock_guard<std::mutex> lock(mutex);
    *free_bytes = (goesWrong("overtaken") ? kMemory : ownMemory()) - current->allocated;
    *all_bytes = kMemory;
    return CUDA_SUCCESS;
}
CRT_FAKE cuMemcpyHtoD(CUdeviceptr to, const void* from, std::size_t bytes) {
    CRT_FAKE_NEEDS_DEVICE();
    if (!isAllocated(to, bytes)) return CUDA_ERROR_INVALID_VALUE;
    std::memcpy(host(to), from, bytes);
    return CUDA_SUCCESS;
}
CRT_FAKE cuMemcpyDtoH(void* to, CUdeviceptr from, std::size_t bytes) {
    CRT_FAKE_NEEDS_DEVICE();
    if (!isAllocated(from, bytes)) return CUDA_ERROR_INVALID_VALUE;
    std::memcpy(to, host(from), bytes);
    return CUDA_SUCCESS;
}
CRT_FAKE cuMemsetD8(CUdeviceptr to, unsigned char value, std::size_t bytes) {
    CRT_FAKE_NEEDS_DEVICE();
    if (!isAllocated(to, bytes)) return CUDA_ERROR_INVALID_VALUE;
    std::memset(host(to), value, bytes);
    return CUDA_SUCCESS;
}

/// Launches run when they are made, so that all streams are in order.
CRT_FAKE cuStreamCreate(CUstream* stream, unsigned flags) {
    CRT_FAKE_NEEDS_DEVICE();
    if (flags != CU_STREAM_DEFAULT) return CUDA_ERROR_INVALID_VALUE;  // It must wait for the default one.
    *stream = new CUstream_st;
    return CUDA_SUCCESS;
}
CRT_FAKE cuStreamDestroy(CUstream stream) {
    delete stream;
    return CUDA_SUCCESS;
}
CRT_FAKE cuEventCreate(CUevent* event, unsigned) {
    *event = new CUevent_st;
    return CUDA_SUCCESS;
}
CRT_FAKE cuEventDestroy(CUevent event) {
    delete event;
    return CUDA_SUCCESS;
}
CRT_FAKE cuEventRecord(CUevent event, CUstream) {
    event->seconds = clockSeconds();
    return CUDA_SUCCESS;
}
CRT_FAKE cuEventSynchronize(CUevent) { return CUDA_SUCCESS; }
CRT_FAKE cuEventElapsedTime(float* milliseconds, CUevent start, CUevent end) {
    *milliseconds = static_cast<float>((end->seconds - start->seconds) * 1e3);
    return CUDA_SUCCESS;
}

}  // extern "C"
