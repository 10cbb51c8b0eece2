#include "opencl_device.h"

#include "opencl_caches.h"

#include "backend/sdk/plugin_guard.h"

#include <algorithm>
#include <cctype>
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

std::string deviceText(cl_device_id device, cl_device_info what) {
    std::size_t size = 0;
    if (clGetDeviceInfo(device, what, 0, nullptr, &size) != CL_SUCCESS) return {};
    std::string text(size, '\0');
    if (clGetDeviceInfo(device, what, size, text.data(), nullptr) != CL_SUCCESS) return {};
    return trimmed(text);
}

std::string platformText(cl_platform_id platform, cl_platform_info what) {
    std::size_t size = 0;
    if (clGetPlatformInfo(platform, what, 0, nullptr, &size) != CL_SUCCESS) return {};
    std::string text(size, '\0');
    if (clGetPlatformInfo(platform, what, size, text.data(), nullptr) != CL_SUCCESS) return {};
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
    device.name = deviceText(id, CL_DEVICE_NAME);
    device.driver = deviceText(id, CL_DRIVER_VERSION) + ", " + platformText(platform, CL_PLATFORM_VERSION);
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

/// "0 'name' has no compiler, …" for each that cannot be used.
std::string listUnusable(const std::vector<Device>& devices) {
    std::string list;
    for (const Device& device : devices)
        if (!device.unusable.empty())
            list += (list.empty() ? "" : ", ") + std::to_string(device.index) + " '" + device.name + "' " +
                    device.unusable;
    return list;
}

}  // namespace

std::string errorName(cl_int error) {
#define CRT_CL_ERROR(name) \
    case name: return #name
    switch (error) {
        CRT_CL_ERROR(CL_SUCCESS);
        CRT_CL_ERROR(CL_DEVICE_NOT_FOUND);
        CRT_CL_ERROR(CL_DEVICE_NOT_AVAILABLE);
        CRT_CL_ERROR(CL_COMPILER_NOT_AVAILABLE);
        CRT_CL_ERROR(CL_MEM_OBJECT_ALLOCATION_FAILURE);
        CRT_CL_ERROR(CL_OUT_OF_RESOURCES);
        CRT_CL_ERROR(CL_OUT_OF_HOST_MEMORY);
        CRT_CL_ERROR(CL_PROFILING_INFO_NOT_AVAILABLE);
        CRT_CL_ERROR(CL_BUILD_PROGRAM_FAILURE);
        CRT_CL_ERROR(CL_MISALIGNED_SUB_BUFFER_OFFSET);
        CRT_CL_ERROR(CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST);
        CRT_CL_ERROR(CL_COMPILE_PROGRAM_FAILURE);
        CRT_CL_ERROR(CL_LINKER_NOT_AVAILABLE);
        CRT_CL_ERROR(CL_LINK_PROGRAM_FAILURE);
        CRT_CL_ERROR(CL_DEVICE_PARTITION_FAILED);
        CRT_CL_ERROR(CL_KERNEL_ARG_INFO_NOT_AVAILABLE);
        CRT_CL_ERROR(CL_INVALID_VALUE);
        CRT_CL_ERROR(CL_INVALID_DEVICE_TYPE);
        CRT_CL_ERROR(CL_INVALID_PLATFORM);
        CRT_CL_ERROR(CL_INVALID_DEVICE);
        CRT_CL_ERROR(CL_INVALID_CONTEXT);
        CRT_CL_ERROR(CL_INVALID_QUEUE_PROPERTIES);
        CRT_CL_ERROR(CL_INVALID_COMMAND_QUEUE);
        CRT_CL_ERROR(CL_INVALID_HOST_PTR);
        CRT_CL_ERROR(CL_INVALID_MEM_OBJECT);
        CRT_CL_ERROR(CL_INVALID_BINARY);
        CRT_CL_ERROR(CL_INVALID_BUILD_OPTIONS);
        CRT_CL_ERROR(CL_INVALID_PROGRAM);
        CRT_CL_ERROR(CL_INVALID_PROGRAM_EXECUTABLE);
        CRT_CL_ERROR(CL_INVALID_KERNEL_NAME);
        CRT_CL_ERROR(CL_INVALID_KERNEL_DEFINITION);
        CRT_CL_ERROR(CL_INVALID_KERNEL);
        CRT_CL_ERROR(CL_INVALID_ARG_INDEX);
        CRT_CL_ERROR(CL_INVALID_ARG_VALUE);
        CRT_CL_ERROR(CL_INVALID_ARG_SIZE);
        CRT_CL_ERROR(CL_INVALID_KERNEL_ARGS);
        CRT_CL_ERROR(CL_INVALID_WORK_DIMENSION);
        CRT_CL_ERROR(CL_INVALID_WORK_GROUP_SIZE);
        CRT_CL_ERROR(CL_INVALID_WORK_ITEM_SIZE);
        CRT_CL_ERROR(CL_INVALID_GLOBAL_OFFSET);
        CRT_CL_ERROR(CL_INVALID_EVENT_WAIT_LIST);
        CRT_CL_ERROR(CL_INVALID_EVENT);
        CRT_CL_ERROR(CL_INVALID_OPERATION);
        CRT_CL_ERROR(CL_INVALID_BUFFER_SIZE);
        CRT_CL_ERROR(CL_INVALID_GLOBAL_WORK_SIZE);
        CRT_CL_ERROR(CL_INVALID_PROPERTY);
        CRT_CL_ERROR(CL_INVALID_COMPILER_OPTIONS);
        CRT_CL_ERROR(CL_INVALID_LINKER_OPTIONS);
        CRT_CL_ERROR(CL_INVALID_DEVICE_PARTITION_COUNT);
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
            empty_platforms +=
                (empty_platforms.empty() ? "'" : ", '") + platformText(platform, CL_PLATFORM_NAME) + "'";
            continue;
        }
        for (cl_device_id id : ids)
            devices.push_back(describe(platform, id, static_cast<std::uint32_t>(devices.size())));
    }
    if (devices.empty())
        throw PluginError(CRT_NO_DEVICE, "no OpenCL platform has a device: " + empty_platforms);
    return devices;
}

std::vector<Device> usableDevices() {
    const std::vector<Device> devices = listDevices();
    std::vector<Device> usable;
    for (const Device& device : devices)
        if (device.unusable.empty()) usable.push_back(device);
    if (usable.empty())
        throw PluginError(CRT_NO_DEVICE, "no OpenCL device can be used: " + listUnusable(devices));
    return usable;
}

Device chooseDevice(const char* wanted) {
    const std::vector<Device> usable = usableDevices();
    std::vector<CrtDevice> described;
    for (const Device& device : usable) described.push_back(device.describe());
    try {
        const CrtDevice& chosen = plugin::chooseDevice(described, wanted);
        return usable[static_cast<std::size_t>(&chosen - described.data())];
    } catch (const PluginError& error) {
        const std::string others = listUnusable(listDevices());
        if (others.empty()) throw;
        throw PluginError(error.status(), error.what() + ("; not usable: " + others));
    }
}

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

}  // namespace crt::opencl
