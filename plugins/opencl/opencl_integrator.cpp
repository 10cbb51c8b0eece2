#include "opencl_integrator.h"

#include "backend/sdk/gpu_schedule.h"
#include "kernel/dialect/features.h"
#include "kernel/dialect/layout.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <future>
#include <string>

namespace crt::opencl {

using plugin::PluginError;

namespace {

constexpr double kLaunchSeconds = 0.05;
/// Of a wave, whose last passes have few paths left.
constexpr double kWaveSeconds = 0.2;

/// Every device has traced these first paths in far less than a second.
LaunchPacer pacerFor(bool waves, const Device& device) {
    return LaunchPacer(waves ? kWaveSeconds : kLaunchSeconds, device.is_cpu ? 4096 : 65536,
                       waves ? CRT_WAVE_BLOCK_HEIGHT : groupSize(device).y);
}

constexpr std::size_t kRayCounterBytes = kRayCounters * 4 * sizeof(cl_uint);

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
      pacer_(pacerFor(false, device_)) {
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
                                                 " in addition to the " + megabytes(allocated_bytes_) +
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
    // The old film goes first: two need not fit side by side.
    for (Buffer* buffer : {&scene_, &sums_, &counts_, &primitives_, &rays_}) *buffer = Buffer();
    wavefront_.reset();
    allocated_bytes_ = 0;
    launched_ = {};
    const double start = now();
    const std::uint64_t pixels = std::uint64_t{scene.width} * scene.height;
    const std::uint64_t sums_bytes = pixels * scene.channels * 2 * sizeof(cl_double);
    scene_ = allocate(CL_MEM_READ_ONLY, blob.size_bytes, blob.data, "the scene");
    sums_ = allocate(CL_MEM_READ_WRITE, sums_bytes, nullptr, "the film");
    counts_ = allocate(CL_MEM_READ_WRITE, pixels * sizeof(cl_ulong), nullptr, "the film's sample counts");
    rays_ = allocate(CL_MEM_READ_WRITE, kRayCounterBytes, nullptr, "the ray counters");
    fill(sums_, sums_bytes, 0);
    fill(counts_, pixels * sizeof(cl_ulong), 0);
    fill(rays_, kRayCounterBytes, 0);
    if (scene.aovs & CRT_AOV_PRIMITIVE) {
        primitives_ =
            allocate(CL_MEM_READ_WRITE, pixels * sizeof(cl_uint), nullptr, "the film's primitives");
        fill(primitives_, pixels * sizeof(cl_uint), CRT_NONE);
    }
    check(clFinish(session_.queue.get()), "uploading the scene");
    upload_seconds_ += now() - start;

    const bool full = kernel_choice_ == CRT_KERNEL_FULL;
    std::vector<plugin::KernelSpec> wanted{
        {plugin::Entry::Render, full ? std::uint64_t{CRT_FEATURES_ALL} : scene.features}};
    if (!full && wantsWavefront(scene.features, scene.max_depth) && takesWaves(device_, scene.max_depth)) {
        const std::uint64_t allocated = allocated_bytes_;
        try {
            wavefront_.emplace(device_, session_, blob.data, [this](std::uint64_t bytes, const char* what) {
                return allocate(CL_MEM_READ_WRITE, bytes, nullptr, what);
            });
            wanted = wavefront_->plan().kernels;
        } catch (const PluginError& error) {
            // Waves only make a render faster: it must not fail for want of memory for them.
            if (error.status() != CRT_OUT_OF_MEMORY) throw;
            host_.log(CRT_LOG_DEBUG, std::string("opencl: continuing without waves: ") + error.what());
            allocated_bytes_ = allocated;
        }
    }
    useKernels(wanted);
    // Its measurements hold for the next scene, too, or for the next band of a film.
    if (paced_for_waves_ != wavefront_.has_value()) {
        paced_for_waves_ = wavefront_.has_value();
        pacer_ = pacerFor(paced_for_waves_, device_);
    }
}

void OpenClIntegrator::useKernels(const std::vector<plugin::KernelSpec>& wanted) {
    const bool there = std::equal(programs_.begin(), programs_.end(), wanted.begin(), wanted.end(),
                                  [](const Program& a, const plugin::KernelSpec& b) { return a.spec == b; });
    if (there) return;
    std::vector<std::future<Program>> building;
    for (const plugin::KernelSpec& spec : wanted)
        building.push_back(std::async(wanted.size() > 1 ? std::launch::async : std::launch::deferred,
                                      [&] { return buildProgram(host_, device_, session_, spec); }));
    std::vector<Program> built;
    double compile_seconds = 0, cache_seconds = 0;
    for (std::future<Program>& program : building) {
        built.push_back(program.get());
        compile_seconds = std::max(compile_seconds, built.back().compile_seconds);
        cache_seconds = std::max(cache_seconds, built.back().cache_seconds);
    }
    programs_ = std::move(built);
    compile_seconds_ += compile_seconds;
    cache_seconds_ += cache_seconds;
}

double OpenClIntegrator::launch(const Launch& launch) {
    return wavefront_ ? launchWave(launch) : launchRender(launch);
}

double OpenClIntegrator::launchWave(const Launch& launch) {
    const double start = now();
    plugin::LaunchWatch watch(host_, pacer_.done());
    wavefront_->launch(programs_, launch,
                       {scene_.get(), sums_.get(), counts_.get(), primitives_.get(), rays_.get()},
                       [&watch] { watch.look(); });
    return now() - start;
}

double OpenClIntegrator::launchRender(const Launch& launch) {
    const cl_kernel kernel = programs_.front().kernel.get();
    setArgument(kernel, 0, scene_.get());
    setArgument(kernel, 1, sums_.get());
    setArgument(kernel, 2, counts_.get());
    setArgument(kernel, 3, primitives_.get());
    setArgument(kernel, 4, rays_.get());
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
    plugin::writeText(report.kernel,
                      std::string(kernel_choice_ == CRT_KERNEL_FULL ? "full" : "lean") +
                          (wavefront_ ? " kernels, paths sorted by material, " : " kernel, ") +
                          std::to_string(session_.compute_units) + " of " +
                          std::to_string(device_.compute_units) + " compute units");
    if (!programs_.empty()) {
        const auto cached = [](const Program& program) { return program.from_cache; };
        report.kernel_from_cache = std::all_of(programs_.begin(), programs_.end(), cached) ? 1 : 0;
        report.kernel_features = programs_.front().spec.features;
    }
    report.compile_seconds = compile_seconds_;
    report.cache_seconds = cache_seconds_;
    report.upload_seconds = upload_seconds_;
    report.render_seconds = launched_.seconds;
    report.paths = launched_.paths;
    report.peak_memory_bytes = device_.is_cpu ? 0 : peak_bytes_;
    if (rays_) {
        std::vector<cl_uint> words(kRayCounterBytes / sizeof(cl_uint));
        check(clEnqueueReadBuffer(session_.queue.get(), rays_.get(), CL_TRUE, 0, kRayCounterBytes,
                                  words.data(), 0, nullptr, nullptr),
              "reading the ray counters");
        for (std::size_t i = 0; i < words.size(); i += 4) {
            report.closest_rays += (std::uint64_t{words[i + 1]} << 32) | words[i];
            report.shadow_rays += (std::uint64_t{words[i + 3]} << 32) | words[i + 2];
        }
    }
}

}  // namespace crt::opencl
