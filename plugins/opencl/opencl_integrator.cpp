#include "opencl_integrator.h"

#include "kernel/features.h"
#include "kernel/layout.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>

namespace crt::opencl {

using plugin::PluginError;

namespace {

constexpr double kLaunchSeconds = 0.05;

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string megabytes(std::uint64_t bytes) {
    char text[32];
    std::snprintf(text, sizeof text, "%.1f MB", static_cast<double>(bytes) / 1e6);
    return text;
}

template <class T>
void setArgument(cl_kernel kernel, cl_uint index, const T& value) {
    check(clSetKernelArg(kernel, index, sizeof value, &value),
          "setting kernel argument " + std::to_string(index));
}

}  // namespace

OpenClIntegrator::OpenClIntegrator(const plugin::Host& host, const CrtCreateInfo& info)
    : host_(host),
      device_(chooseDevice(info.device)),
      session_(openSession(device_, info.threads)),
      kernel_choice_(info.kernel),
      tile_size_(info.tile_size),
      // Every device has traced these in far less than a second.
      pacer_(kLaunchSeconds, device_.is_cpu ? 4096 : 65536, groupSize(device_).y) {
    if (info.threads != 0 && !device_.is_cpu)
        host_.log(CRT_LOG_DEBUG,
                  "opencl: '" + device_.name + "' is not a CPU: the number of threads does not apply");
}

Buffer OpenClIntegrator::allocate(cl_mem_flags flags, std::uint64_t bytes, const void* content,
                                  const char* what) {
    if (bytes > device_.largest_buffer_bytes)
        throw PluginError(CRT_OUT_OF_MEMORY, std::string(what) + " needs " + megabytes(bytes) + ", but '" +
                                                 device_.name + "' gives at most " +
                                                 megabytes(device_.largest_buffer_bytes) + " in one buffer");
    if (allocated_bytes_ + bytes > device_.memory_bytes)
        throw PluginError(CRT_OUT_OF_MEMORY, std::string(what) + " needs " + megabytes(bytes) +
                                                 " beside the " + megabytes(allocated_bytes_) +
                                                 " in use, but '" + device_.name + "' has only " +
                                                 megabytes(device_.memory_bytes));
    cl_int result = CL_SUCCESS;
    Buffer buffer(clCreateBuffer(session_.context.get(),
                                 flags | (content != nullptr ? CL_MEM_COPY_HOST_PTR : 0), bytes,
                                 const_cast<void*>(content), &result));
    check(result, "allocating " + megabytes(bytes) + " on '" + device_.name + "' for " + what);
    allocated_bytes_ += bytes;
    peak_bytes_ = std::max(peak_bytes_, allocated_bytes_);
    return buffer;
}

void OpenClIntegrator::fill(const Buffer& buffer, std::uint64_t bytes, cl_uint pattern) {
    check(clEnqueueFillBuffer(session_.queue.get(), buffer.get(), &pattern, sizeof pattern, 0, bytes, 0,
                              nullptr, nullptr),
          "clearing the film");
}

void OpenClIntegrator::setScene(const CrtSceneBlob& blob) {
    const auto& scene = *static_cast<const kernel::CrtScene*>(blob.data);
    const std::uint64_t features = kernel_choice_ == CRT_KERNEL_FULL ? CRT_FEATURES_ALL : scene.features;
    if (!program_.render || program_.features != features) {
        const double compile_seconds = program_.compile_seconds, cache_seconds = program_.cache_seconds;
        program_ = buildProgram(host_, device_, session_, features);
        program_.compile_seconds += compile_seconds;
        program_.cache_seconds += cache_seconds;
    }

    // The old film goes first: two need not fit side by side.
    for (Buffer* buffer : {&scene_, &sums_, &counts_, &primitives_, &rays_}) *buffer = Buffer();
    allocated_bytes_ = 0;
    launched_ = {};
    const double start = now();
    const std::uint64_t pixels = std::uint64_t{scene.width} * scene.height;
    const std::uint64_t sums_bytes = pixels * scene.channels * 2 * sizeof(cl_double);
    scene_ = allocate(CL_MEM_READ_ONLY, blob.size_bytes, blob.data, "the scene");
    sums_ = allocate(CL_MEM_READ_WRITE, sums_bytes, nullptr, "the film");
    counts_ = allocate(CL_MEM_READ_WRITE, pixels * sizeof(cl_ulong), nullptr, "the film's sample counts");
    rays_ = allocate(CL_MEM_READ_WRITE, 4 * sizeof(cl_uint), nullptr, "the ray counters");
    fill(sums_, sums_bytes, 0);
    fill(counts_, pixels * sizeof(cl_ulong), 0);
    fill(rays_, 4 * sizeof(cl_uint), 0);
    if (scene.aovs & CRT_AOV_PRIMITIVE) {
        primitives_ =
            allocate(CL_MEM_READ_WRITE, pixels * sizeof(cl_uint), nullptr, "the film's primitives");
        fill(primitives_, pixels * sizeof(cl_uint), CRT_NONE);
    }
    check(clFinish(session_.queue.get()), "uploading the scene");
    upload_seconds_ += now() - start;

    setArgument(program_.render.get(), 0, scene_.get());
    setArgument(program_.render.get(), 1, sums_.get());
    setArgument(program_.render.get(), 2, counts_.get());
    setArgument(program_.render.get(), 3, primitives_.get());
    setArgument(program_.render.get(), 4, rays_.get());
}

double OpenClIntegrator::launch(const Launch& launch) {
    const cl_kernel kernel = program_.render.get();
    setArgument(kernel, 5, static_cast<cl_uint>(launch.x0));
    setArgument(kernel, 6, static_cast<cl_uint>(launch.y0));
    setArgument(kernel, 7, static_cast<cl_uint>(launch.x1));
    setArgument(kernel, 8, static_cast<cl_uint>(launch.y1));
    setArgument(kernel, 9, static_cast<cl_ulong>(launch.first_sample));
    setArgument(kernel, 10, static_cast<cl_uint>(launch.sample_count));

    const GroupSize group = groupSize(device_);
    const std::size_t local[2] = {group.x, group.y};
    const std::size_t global[2] = {(launch.x1 - launch.x0 + local[0] - 1) / local[0] * local[0],
                                   (launch.y1 - launch.y0 + local[1] - 1) / local[1] * local[1]};
    const double enqueued_at = now();
    cl_event enqueued = nullptr;
    check(clEnqueueNDRangeKernel(session_.queue.get(), kernel, 2, nullptr, global, local, 0, nullptr,
                                 &enqueued),
          "launching the kernel");
    const Event event(enqueued);
    check(clWaitForEvents(1, &enqueued), "rendering on '" + device_.name + "'");

    const double waited = now() - enqueued_at;
    cl_ulong start = 0, end = 0;
    check(clGetEventProfilingInfo(enqueued, CL_PROFILING_COMMAND_START, sizeof start, &start, nullptr),
          "reading the kernel's start");
    check(clGetEventProfilingInfo(enqueued, CL_PROFILING_COMMAND_END, sizeof end, &end, nullptr),
          "reading the kernel's end");
    return launchSeconds(start, end, waited);
}

bool OpenClIntegrator::render(const CrtRenderRange& range) {
    return plugin::renderInLaunches(host_, pacer_, range, tile_size_, launched_,
                                    [this](const Launch& next) { return launch(next); });
}

void OpenClIntegrator::readFilm(const CrtFilmView& film) {
    const std::size_t pixels = std::size_t{film.width} * film.height;
    const auto read = [&](const Buffer& buffer, std::size_t bytes, void* to) {
        check(clEnqueueReadBuffer(session_.queue.get(), buffer.get(), CL_TRUE, 0, bytes, to, 0, nullptr,
                                  nullptr),
              "reading the film back");
    };
    read(sums_, pixels * film.channels * 2 * sizeof(double), film.sums);
    read(counts_, pixels * sizeof(std::uint64_t), film.counts);
    if (film.primitives != nullptr) read(primitives_, pixels * sizeof(std::uint32_t), film.primitives);
}

void OpenClIntegrator::report(CrtBackendReport& report) {
    plugin::writeText(report.device, device_.name);
    plugin::writeText(report.kernel, std::string(kernel_choice_ == CRT_KERNEL_FULL ? "full" : "lean") +
                                         " kernel, " + std::to_string(session_.compute_units) + " of " +
                                         std::to_string(device_.compute_units) + " compute units");
    report.kernel_from_cache = program_.from_cache ? 1 : 0;
    report.kernel_features = program_.features;
    report.compile_seconds = program_.compile_seconds;
    report.cache_seconds = program_.cache_seconds;
    report.upload_seconds = upload_seconds_;
    report.render_seconds = launched_.seconds;
    report.paths = launched_.paths;
    report.peak_memory_bytes = device_.is_cpu ? 0 : peak_bytes_;
    if (rays_) {
        cl_uint counts[4] = {};
        check(clEnqueueReadBuffer(session_.queue.get(), rays_.get(), CL_TRUE, 0, sizeof counts, counts, 0,
                                  nullptr, nullptr),
              "reading the ray counters");
        report.closest_rays = (std::uint64_t{counts[1]} << 32) | counts[0];
        report.shadow_rays = (std::uint64_t{counts[3]} << 32) | counts[2];
    }
}

}  // namespace crt::opencl
