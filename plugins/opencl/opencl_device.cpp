#include "opencl_device.h"

#include "opencl_caches.h"
#include "opencl_program.h"

#include "backend/sdk/gpu_schedule.h"
#include "backend/sdk/launch_pacer.h"
#include "backend/sdk/plugin_guard.h"
#include "gpu/device_list.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <map>
#include <mutex>

namespace crt::opencl {

using plugin::PluginError;

namespace {

// Of the loader's extension (cl_icd.h does not give it to programs): the loader is there, but no platform is
// installed.
constexpr cl_int kPlatformNotFound = -1001;

std::string trimmed(std::string text) {
    while (!text.empty() && (text.back() == '\0' || std::isspace(static_cast<unsigned char>(text.back()))))
        text.pop_back();
    text.erase(0, std::min(text.find_first_not_of(" \t\r\n"), text.size()));
    return text;
}

template <class T>
T deviceInfo(cl_device_id device, cl_device_info what) {
    T value{};
    // A query that a device does not know leaves zero: for all that is asked here, zero means "no" or
    // "none".
    clGetDeviceInfo(device, what, sizeof value, &value, nullptr);
    return value;
}

/// `query`: clGetDeviceInfo, clGetPlatformInfo.
template <class Query, class Object>
std::string infoText(Query query, Object object, cl_uint what) {
    std::size_t size = 0;
    if (query(object, what, 0, nullptr, &size) != CL_SUCCESS) return {};
    std::string text(size, '\0');
    if (query(object, what, size, text.data(), nullptr) != CL_SUCCESS) return {};
    return trimmed(text);
}

/// Features that a device lacks for the same bits as every other backend; empty if there are none.
std::string whatIsMissing(cl_device_id id, bool is_cpu) {
    if (!deviceInfo<cl_bool>(id, CL_DEVICE_AVAILABLE)) return "is not available";
    if (!deviceInfo<cl_bool>(id, CL_DEVICE_COMPILER_AVAILABLE)) return "has no compiler";
    if (!deviceInfo<cl_bool>(id, CL_DEVICE_ENDIAN_LITTLE)) return "is big-endian";
    if (deviceInfo<cl_device_fp_config>(id, CL_DEVICE_DOUBLE_FP_CONFIG) == 0)
        return "has no double precision, in which the film is summed";
    const auto single = deviceInfo<cl_device_fp_config>(id, CL_DEVICE_SINGLE_FP_CONFIG);
    if (!(single & CL_FP_DENORM)) return "flushes subnormal numbers to zero";
    // A CPU divides by its IEEE instruction whether or not its driver says so.
    if (!is_cpu && !(single & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT))
        return "has no correctly rounded division and square root";
    return {};
}

Device describe(cl_platform_id platform, cl_device_id id, std::uint32_t index) {
    Device device;
    device.id = id;
    device.index = index;
    device.name = infoText(clGetDeviceInfo, id, CL_DEVICE_NAME);
    device.driver = infoText(clGetDeviceInfo, id, CL_DRIVER_VERSION) + ", " +
                    infoText(clGetPlatformInfo, platform, CL_PLATFORM_VERSION);
    device.is_cpu = (deviceInfo<cl_device_type>(id, CL_DEVICE_TYPE) & CL_DEVICE_TYPE_CPU) != 0;
    device.has_correct_division_option = (deviceInfo<cl_device_fp_config>(id, CL_DEVICE_SINGLE_FP_CONFIG) &
                                          CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT) != 0;
    device.compute_units = deviceInfo<cl_uint>(id, CL_DEVICE_MAX_COMPUTE_UNITS);
    device.address_bits = deviceInfo<cl_uint>(id, CL_DEVICE_ADDRESS_BITS);
    device.memory_bytes = deviceInfo<cl_ulong>(id, CL_DEVICE_GLOBAL_MEM_SIZE);
    device.largest_buffer_bytes = deviceInfo<cl_ulong>(id, CL_DEVICE_MAX_MEM_ALLOC_SIZE);
    device.unusable = whatIsMissing(id, device.is_cpu);
    return device;
}

}  // namespace

// Errors of OpenCL 1.2, without CL_; those of images are left out.
#define CRT_CL_ERRORS(F) \
    F(SUCCESS) F(DEVICE_NOT_FOUND) F(DEVICE_NOT_AVAILABLE) F(COMPILER_NOT_AVAILABLE)                  \
    F(MEM_OBJECT_ALLOCATION_FAILURE) F(OUT_OF_RESOURCES) F(OUT_OF_HOST_MEMORY)                        \
    F(PROFILING_INFO_NOT_AVAILABLE) F(BUILD_PROGRAM_FAILURE) F(MISALIGNED_SUB_BUFFER_OFFSET)          \
    F(EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST) F(COMPILE_PROGRAM_FAILURE) F(LINKER_NOT_AVAILABLE)   \
    F(LINK_PROGRAM_FAILURE) F(DEVICE_PARTITION_FAILED) F(KERNEL_ARG_INFO_NOT_AVAILABLE)               \
    F(INVALID_VALUE) F(INVALID_DEVICE_TYPE) F(INVALID_PLATFORM) F(INVALID_DEVICE) F(INVALID_CONTEXT)  \
    F(INVALID_QUEUE_PROPERTIES) F(INVALID_COMMAND_QUEUE) F(INVALID_HOST_PTR) F(INVALID_MEM_OBJECT)    \
    F(INVALID_BINARY) F(INVALID_BUILD_OPTIONS) F(INVALID_PROGRAM) F(INVALID_PROGRAM_EXECUTABLE)       \
    F(INVALID_KERNEL_NAME) F(INVALID_KERNEL_DEFINITION) F(INVALID_KERNEL) F(INVALID_ARG_INDEX)        \
    F(INVALID_ARG_VALUE) F(INVALID_ARG_SIZE) F(INVALID_KERNEL_ARGS) F(INVALID_WORK_DIMENSION)         \
    F(INVALID_WORK_GROUP_SIZE) F(INVALID_WORK_ITEM_SIZE) F(INVALID_GLOBAL_OFFSET)                     \
    F(INVALID_EVENT_WAIT_LIST) F(INVALID_EVENT) F(INVALID_OPERATION) F(INVALID_BUFFER_SIZE)           \
    F(INVALID_GLOBAL_WORK_SIZE) F(INVALID_PROPERTY) F(INVALID_COMPILER_OPTIONS)                       \
    F(INVALID_LINKER_OPTIONS) F(INVALID_DEVICE_PARTITION_COUNT)

std::string errorName(cl_int error) {
#define CRT_CL_ERROR(name) case CL_##name: return "CL_" #name;
    switch (error) {
        CRT_CL_ERRORS(CRT_CL_ERROR)
        case kPlatformNotFound: return "CL_PLATFORM_NOT_FOUND_KHR";
        default: return "OpenCL error " + std::to_string(error);
    }
#undef CRT_CL_ERROR
}

void check(cl_int result, const std::string& what) {
    if (result == CL_SUCCESS) return;
    const bool memory = result == CL_MEM_OBJECT_ALLOCATION_FAILURE || result == CL_OUT_OF_RESOURCES ||
                        result == CL_OUT_OF_HOST_MEMORY;
    throw PluginError(memory ? CRT_OUT_OF_MEMORY : CRT_DEVICE_FAILED,
                      what + " failed: " + errorName(result));
}

double Device::score() const {
    // A GPU's compute unit is worth dozens of CPU threads.
    return is_cpu ? compute_units : 2000.0 + compute_units;
}

CrtDevice Device::describe() const { return plugin::makeDevice(index, name, driver, memory_bytes, score()); }

namespace {

constexpr char kNoneUsable[] = "no OpenCL device can be used";

/// Every device of every platform, the unusable too. Throws when there is not one.
std::vector<Device> listDevices() {
    keepKernelsFromOthers();
    cl_uint platform_count = 0;
    const cl_int listed = clGetPlatformIDs(0, nullptr, &platform_count);
    if (listed != CL_SUCCESS && listed != kPlatformNotFound)
        throw PluginError(CRT_NO_DEVICE, "the OpenCL platforms cannot be listed: " + errorName(listed));
    if (platform_count == 0)
        throw PluginError(CRT_NO_DEVICE,
                          "no OpenCL platform is installed (for a CPU: the package pocl-opencl-icd; for a "
                          "GPU: its vendor's driver)");
    std::vector<cl_platform_id> platforms(platform_count);
    check(clGetPlatformIDs(platform_count, platforms.data(), nullptr), "listing the OpenCL platforms");

    std::vector<Device> devices;
    std::string empty_platforms;
    for (cl_platform_id platform : platforms) {
        cl_uint count = 0;
        std::vector<cl_device_id> ids;
        if (clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 0, nullptr, &count) == CL_SUCCESS)
            ids.resize(count);
        if (ids.empty() ||
            clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, count, ids.data(), nullptr) != CL_SUCCESS) {
            empty_platforms += (empty_platforms.empty() ? "'" : ", '") +
                               infoText(clGetPlatformInfo, platform, CL_PLATFORM_NAME) + "'";
            continue;
        }
        for (cl_device_id id : ids)
            devices.push_back(describe(platform, id, static_cast<std::uint32_t>(devices.size())));
    }
    if (devices.empty())
        throw PluginError(CRT_NO_DEVICE, "no OpenCL platform has a device: " + empty_platforms);
    return devices;
}

}  // namespace

std::vector<Device> usableDevices() { return gpu::usable(listDevices(), kNoneUsable); }

const Session& openSession(const Device& device, std::uint32_t threads) {
    const bool divided = device.is_cpu && threads != 0 && threads < device.compute_units;
    const std::uint32_t compute_units = divided ? threads : device.compute_units;

    // Not destroyed at exit either, when the driver may be gone before.
    static std::mutex& mutex = *new std::mutex;
    static auto& sessions = *new std::map<std::pair<cl_device_id, std::uint32_t>, Session>;
    const std::lock_guard<std::mutex> lock(mutex);
    const auto known = sessions.find({device.id, compute_units});
    if (known != sessions.end()) return known->second;

    Session session;
    session.target = device.id;
    session.compute_units = compute_units;
    if (divided) {
        const cl_device_partition_property by_counts[] = {
            CL_DEVICE_PARTITION_BY_COUNTS, static_cast<cl_device_partition_property>(compute_units),
            CL_DEVICE_PARTITION_BY_COUNTS_LIST_END, 0};
        check(clCreateSubDevices(device.id, by_counts, 1, &session.target, nullptr),
              "taking " + std::to_string(compute_units) + " of the " + std::to_string(device.compute_units) +
                  " compute units of '" + device.name + "'");
        session.part = SubDevice(session.target);
    }
    cl_int result = CL_SUCCESS;
    session.context = Context(clCreateContext(nullptr, 1, &session.target, nullptr, nullptr, &result));
    check(result, "opening '" + device.name + "'");
    session.queue = Queue(
        clCreateCommandQueue(session.context.get(), session.target, CL_QUEUE_PROFILING_ENABLE, &result));
    check(result, "creating a command queue on '" + device.name + "'");
    return sessions.emplace(std::pair(device.id, compute_units), std::move(session)).first->second;
}

namespace {

cl_mem memoryOf(const GpuBuffer& buffer) { return static_cast<cl_mem>(buffer.handle); }

}  // namespace

OpenClDevice::OpenClDevice(const plugin::Host& host, const CrtCreateInfo& info)
    : device_(gpu::choose(listDevices(), kNoneUsable, info.device)),
      session_(openSession(device_, info.threads)) {
    if (info.threads != 0 && !device_.is_cpu)
        host.log(CRT_LOG_DEBUG,
                 "opencl: '" + device_.name + "' is not a CPU: the number of threads does not apply");
    traits_.backend = "opencl";
    traits_.name = device_.name;
    traits_.memory_bytes = device_.memory_bytes;
    traits_.largest_buffer_bytes = device_.largest_buffer_bytes;
    traits_.own_memory = !device_.is_cpu;
    traits_.block_width = blockSide(device_);
    traits_.block_height = blockSide(device_);
    // Every device traces these first paths in far less than a second.
    traits_.first_paths = device_.is_cpu ? 4096 : 65536;
}

std::unique_ptr<gpu::GpuProgram> OpenClDevice::makeProgram(const plugin::Host& host,
                                                           const gpu::Specs& wanted,
                                                           CrtKernelChoice choice) {
    return std::make_unique<OpenClProgram>(host, device_, session_, wanted, choice);
}

bool OpenClDevice::takesWaves(std::uint32_t max_depth) const {
    // Pointers of 8 bytes, as the host's CrtWave has them.
    if (device_.address_bits != 64) return false;
    const char* requested = std::getenv("CRT_OPENCL_WAVES");
    return !device_.is_cpu || mayOutlastLaunch(max_depth) ||
           (requested != nullptr && std::string(requested) == "1");
}

std::uint64_t OpenClDevice::freeBytes() const {
    return device_.memory_bytes - std::min(device_.memory_bytes, allocated_bytes_);
}

std::shared_ptr<void> OpenClDevice::take(std::uint64_t bytes) {
    if (bytes > freeBytes()) return nullptr;
    cl_int result = CL_SUCCESS;
    const cl_mem memory = clCreateBuffer(session_.context.get(), CL_MEM_READ_WRITE, bytes, nullptr, &result);
    check(result, "allocating " + std::to_string(bytes) + " bytes on '" + device_.name + "'");
    allocated_bytes_ += bytes;
    return {static_cast<void*>(memory), [this, memory, bytes](void*) {
                clReleaseMemObject(memory);
                allocated_bytes_ -= bytes;
            }};
}

void OpenClDevice::fill(const GpuBuffer& to, unsigned char value, std::uint64_t first,
                        std::uint64_t bytes) const {
    const cl_uint pattern = 0x01010101u * value;
    check(clEnqueueFillBuffer(session_.queue.get(), memoryOf(to), &pattern, sizeof pattern, first, bytes, 0,
                              nullptr, nullptr),
          "clearing device memory");
}

void OpenClDevice::write(const GpuBuffer& to, const void* from) const {
    check(clEnqueueWriteBuffer(session_.queue.get(), memoryOf(to), CL_TRUE, 0, to.bytes, from, 0, nullptr,
                               nullptr),
          "uploading");
}

void OpenClDevice::read(const GpuBuffer& from, void* to, std::uint64_t first, std::uint64_t bytes) const {
    check(clEnqueueReadBuffer(session_.queue.get(), memoryOf(from), CL_TRUE, first, bytes, to, 0, nullptr,
                              nullptr),
          "reading from '" + device_.name + "'");
}

void OpenClDevice::launch(void* entry, const char* name, const gpu::GpuGrid& grid,
                          const gpu::GpuArguments& arguments) {
    const auto kernel = static_cast<cl_kernel>(entry);
    for (cl_uint i = 0; i < arguments.size(); ++i) {
        const cl_int result = clSetKernelArg(kernel, i, arguments[i].bytes, arguments[i].value);
        if (result != CL_SUCCESS) check(result, "setting argument " + std::to_string(i) + " of " + name);
    }
    const std::size_t local[2] = {grid.threads, 1}, global[2] = {grid.blocks * grid.threads, grid.rows};
    cl_event event = nullptr;
    const cl_int result = clEnqueueNDRangeKernel(session_.queue.get(), kernel, 2, nullptr, global, local, 0,
                                                 nullptr, launches_ == 0 ? &event : nullptr);
    if (result != CL_SUCCESS) check(result, std::string("launching ") + name);
    if (launches_++ == 0) first_launch_ = Event(event);
}

double OpenClDevice::seconds(const std::function<void()>& start) {
    launches_ = 0;
    const gpu::Stopwatch waiting;
    start();
    const cl_event event = first_launch_.get();
    check(launches_ == 1 ? clWaitForEvents(1, &event) : clFinish(session_.queue.get()),
          "rendering on '" + device_.name + "'");
    const double waited = waiting.seconds();
    if (launches_ != 1) return waited;
    cl_ulong began = 0, ended = 0;
    check(clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_START, sizeof began, &began, nullptr),
          "reading the kernel's start");
    check(clGetEventProfilingInfo(event, CL_PROFILING_COMMAND_END, sizeof ended, &ended, nullptr),
          "reading the kernel's end");
    return launchSeconds(began, ended, waited);
}

}  // namespace crt::opencl
