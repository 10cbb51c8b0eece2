#include "gpu_device.h"

#include "gpu_kernel_text.h"

#include <cstdio>
#include <utility>

namespace crt::gpu {
namespace {

/// "12.3 MB".
std::string megabytes(std::uint64_t bytes) {
    char text[32];
    std::snprintf(text, sizeof text, "%.1f MB", static_cast<double>(bytes) / 1e6);
    return text;
}

}  // namespace

std::string kernelText(const std::string& wavefront_text, const char* dialect_name, const char* dialect) {
    return wavefront_text + "\n#line 1 \"" + dialect_name + "\"\n" + dialect + "\n#line 1 \"kernels.h\"\n" +
           kKernelText;
}

void GpuDevice::refuse(std::uint64_t bytes, const char* what) const {
    throw plugin::PluginError(CRT_OUT_OF_MEMORY, std::string(what) + " needs " + megabytes(bytes) +
                                                     ", but '" + traits_.name + "' has only " +
                                                     megabytes(freeBytes()) + " of its " +
                                                     megabytes(traits_.memory_bytes) + " free");
}

void GpuDevice::requireFree(std::uint64_t bytes, const char* what) const {
    if (bytes > freeBytes()) refuse(bytes, what);
}

GpuBuffer GpuDevice::allocate(std::uint64_t bytes, const char* what) {
    if (bytes > traits_.largest_buffer_bytes)
        throw plugin::PluginError(CRT_OUT_OF_MEMORY, std::string(what) + " needs " + megabytes(bytes) +
                                                         ", but '" + traits_.name + "' gives at most " +
                                                         megabytes(traits_.largest_buffer_bytes) +
                                                         " in one buffer");
    std::shared_ptr<void> memory = take(bytes);
    if (memory == nullptr) refuse(bytes, what);
    void* const handle = memory.get();
    return {std::move(memory), handle, bytes};
}

}  // namespace crt::gpu
