#include "cuda_integrator.h"

#include "backend/sdk/gpu_schedule.h"
#include "kernel/dialect/features.h"

#include <algorithm>
#include <chrono>
#include <vector>

namespace crt::cuda {

using plugin::divideUp;

namespace {

constexpr double kLaunchSeconds = 0.03;
/// Of a wave, whose last passes have few paths left.
constexpr double kWaveSeconds = 0.2;
constexpr std::uint64_t kFirstPaths = 1u << 18;
/// One warp for each of the four schedulers of a multiprocessor: none waits for another's turn, so that a
/// launch of this many paths takes as long as its longest one. Paths of 100,000 bounces take a second.
constexpr std::uint64_t kPathsAtOnce = 4 * 32;

LaunchPacer pacerFor(bool waves, const Device& device) {
    return LaunchPacer(waves ? kWaveSeconds : kLaunchSeconds, kFirstPaths, kBlockHeight,
                       kPathsAtOnce * device.multiprocessors);
}

double now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

CudaIntegrator::CudaIntegrator(const plugin::Host& host, const CrtCreateInfo& info)
    : host_(host),
      opening_compiler_(info.kernel == CRT_KERNEL_FULL ? std::jthread() : std::jthread(openCompiler)),
      device_(chooseDevice(info.device)),
      context_(device_),
      kernel_choice_(info.kernel),
      tile_size_(info.tile_size),
      pacer_(pacerFor(false, device_)) {
    if (info.threads != 0) host_.log(CRT_LOG_DEBUG, "cuda: the number of threads does not apply");
    context_.makeCurrent();
    const Driver& cuda = driver();
    // Waiting asleep: the host's cores have a kernel to compile.
    cuda.check(cuda.cuEventCreate(&start_, CU_EVENT_BLOCKING_SYNC), "creating an event");
    const CUresult result = cuda.cuEventCreate(&end_, CU_EVENT_BLOCKING_SYNC);
    if (result != CUDA_SUCCESS) cuda.cuEventDestroy(start_);
    cuda.check(result, "creating an event");
}

CudaIntegrator::~CudaIntegrator() {
    context_.tryMakeCurrent();  // for the members too, whose memory and modules are given back after this
    driver().cuEventDestroy(start_);
    driver().cuEventDestroy(end_);
}

CudaIntegrator::DeviceFilm CudaIntegrator::allocateFilm(std::uint64_t copies, const char* what) {
    const std::uint64_t pixels = copies * scene_.width * scene_.height;
    const std::uint64_t bytes = pixels * (scene_.channels * 2 * sizeof(double) + sizeof(std::uint64_t) +
                                          (scene_.aovs & CRT_AOV_PRIMITIVE ? sizeof(std::uint32_t) : 0));
    // Of the whole, or the sentence would have the numbers of whichever part came too late.
    requireFree(bytes, device_, what);
    DeviceFilm film;
    film.sums = Memory(pixels * scene_.channels * 2 * sizeof(double), device_, what);
    film.counts = Memory(pixels * sizeof(std::uint64_t), device_, what);
    film.sums.fill(0);
    film.counts.fill(0);
    if (scene_.aovs & CRT_AOV_PRIMITIVE) {
        film.primitives = Memory(pixels * sizeof(std::uint32_t), device_, what);
        film.primitives.fill(0xff);  // CRT_NONE
    }
    return film;
}

void CudaIntegrator::noteMemory() {
    peak_bytes_ = std::max(peak_bytes_, blob_.bytes() + rays_.bytes() + film_.bytes() + slices_.bytes() +
                                            (wavefront_ ? wavefront_->bytes() : 0));
}

void CudaIntegrator::setScene(const CrtSceneBlob& blob) {
    context_.makeCurrent();
    const auto& scene = *static_cast<const kernel::CrtScene*>(blob.data);

    // The old film goes first: two need not fit side by side. Until all of the new one is there, there is no
    // scene.
    blob_ = Memory();
    film_ = DeviceFilm();
    slices_ = DeviceFilm();
    slice_count_ = 0;
    rays_ = Memory();
    wavefront_.reset();
    launched_ = {};
    scene_ = scene;

    std::vector<KernelSpec> wanted;
    if (kernel_choice_ != CRT_KERNEL_FULL && wantsWavefront(scene.features, scene.max_depth)) {
        wavefront_.emplace(device_, blob.data);
        wanted = wavefront_->plan().kernels;
    } else if (kernel_choice_ != CRT_KERNEL_FULL) {
        wanted = {{Entry::Render, scene.features}};
    }
    // Its measurements hold for the next scene, too, or for the next band of a film.
    if (paced_for_waves_ != wavefront_.has_value()) {
        paced_for_waves_ = wavefront_.has_value();
        pacer_ = pacerFor(paced_for_waves_, device_);
    }
    if (!program_ || program_->wanted() != wanted) {
        if (program_) {
            compile_seconds_ += program_->compileSeconds();
            cache_seconds_ += program_->cacheSeconds();
        }
        // While waves are compiled, the kernel that takes a path to its end renders.
        const bool waits = kernel_choice_ == CRT_KERNEL_LEAN && mayOutlastLaunch(scene.max_depth);
        program_ = std::make_unique<CudaProgram>(host_, device_, wanted,
                                                 waits ? CRT_KERNEL_LEAN_ONLY : kernel_choice_);
    }

    const double start = now();
    film_ = allocateFilm(1, "the film");
    rays_ = Memory(kRayCounters * 2 * sizeof(std::uint64_t), device_, "the ray counters");
    rays_.fill(0);
    Memory uploaded(blob.size_bytes, device_, "the scene");
    uploaded.upload(blob.data);
    blob_ = std::move(uploaded);
    upload_seconds_ += now() - start;
    noteMemory();
}

std::uint32_t CudaIntegrator::ensureSlices(std::uint32_t slices) {
    if (slices <= std::max(slice_count_, 1u)) return slices;
    // Others may have taken memory since the device was opened. Slices only make a render faster: it must
    // not fail for want of them.
    std::size_t free_bytes = 0, all_bytes = 0;
    driver().check(driver().cuMemGetInfo(&free_bytes, &all_bytes), "querying free memory");
    const std::uint64_t film_bytes = std::max<std::uint64_t>(film_.bytes(), 1);
    const std::uint64_t affordable =
        plugin::sliceBudget(device_.memory_bytes, free_bytes + slices_.bytes()) / film_bytes;
    slices = static_cast<std::uint32_t>(std::min<std::uint64_t>(slices, affordable));
    if (slices <= std::max(slice_count_, 1u)) return std::max(slice_count_, 1u);
    slices_ = DeviceFilm();
    slice_count_ = 0;
    try {
        slices_ = allocateFilm(slices, "the film's slices");
    } catch (const plugin::PluginError& error) {
        // Another process took the memory first, or the free memory is fragmented.
        if (error.status() != CRT_OUT_OF_MEMORY) throw;
        host_.log(CRT_LOG_DEBUG, std::string("cuda: continuing without slices: ") + error.what());
        return 1;
    }
    slice_count_ = slices;
    noteMemory();
    return slices;
}

void CudaIntegrator::launchRender(const Module& module, const Launch& launch, std::uint32_t slices,
                                  const WaveTarget& target) {
    const std::uint64_t blocks =
        divideUp(launch.x1 - launch.x0, kBlockWidth) * divideUp(launch.y1 - launch.y0, kBlockHeight);
    Launch range = launch;
    kernel::CrtScene scene = scene_;
    WaveTarget to = target;
    void* arguments[] = {&scene,    &to.blob,   &range.x0,           &range.y0,
                         &range.x1, &range.y1,  &range.first_sample, &range.sample_count,
                         &to.sums,  &to.counts, &to.primitives,      &to.rays};
    driver().check(driver().cuLaunchKernel(module.kernel(), static_cast<unsigned>(blocks), slices, 1, kBlock,
                                           1, 1, 0, nullptr, arguments, nullptr),
                   "launching the kernel");
}

void CudaIntegrator::addSlices(const Module& module, const Launch& launch, std::uint32_t slices) {
    Launch range = launch;
    kernel::CrtScene scene = scene_;
    CUdeviceptr sums = film_.sums.address(), counts = film_.counts.address(),
                primitives = film_.primitives.address();
    CUdeviceptr slice_sums = slices_.sums.address(), slice_counts = slices_.counts.address(),
                slice_primitives = slices_.primitives.address();
    void* arguments[] = {
        &range.x0, &range.y0, &range.x1, &range.y1,   &scene.width, &scene.height, &scene.channels,
        &slices,   &sums,     &counts,   &primitives, &slice_sums,  &slice_counts, &slice_primitives};
    const std::uint64_t threads = launch.pixels() * scene_.channels;
    driver().check(
        driver().cuLaunchKernel(module.addSlices(), static_cast<unsigned>(divideUp(threads, kBlock)), 1, 1,
                                kBlock, 1, 1, 0, nullptr, arguments, nullptr),
        "launching the sum of the slices");
}

void CudaIntegrator::launchKernels(const std::vector<Module>& kernels, const Launch& launch) {
    const Module& module = kernels.front();
    const bool waves = module.spec().entry == Entry::Trace;
    const std::uint64_t across = divideUp(launch.x1 - launch.x0, kBlockWidth);
    const std::uint64_t blocks = across * divideUp(launch.y1 - launch.y0, kBlockHeight);
    std::uint64_t most = plugin::sliceBudget(device_.memory_bytes, device_.memory_bytes) /
                         std::max<std::uint64_t>(film_.bytes(), 1);
    if (waves) most = std::min<std::uint64_t>(most, wavefront_->mostSlices(across));
    std::uint32_t slices = ensureSlices(
        plugin::chooseSlices(blocks, std::uint64_t{module.residentBlocks()} * device_.multiprocessors,
                             launch.sample_count, most));
    if (waves) slices = std::min(slices, wavefront_->mostSlices(across));

    const DeviceFilm& film = slices > 1 ? slices_ : film_;
    const WaveTarget target{blob_.address(), film.sums.address(), film.counts.address(),
                            film.primitives.address(), rays_.address()};
    plugin::LaunchWatch watch(host_, pacer_.done());
    if (waves)
        wavefront_->launch(kernels, scene_, launch, slices, target, [&watch] { watch.look(); });
    else
        launchRender(module, launch, slices, target);
    if (slices > 1) addSlices(module, launch, slices);
}

double CudaIntegrator::launch(const Launch& launch) {
    const Driver& cuda = driver();
    cuda.check(cuda.cuEventRecord(start_, nullptr), "recording an event");
    try {
        launchKernels(program_->current(), launch);
    } catch (const plugin::PluginError& error) {
        // Waves only make a render faster: it must not fail for want of memory for them.
        if (error.status() != CRT_OUT_OF_MEMORY || !wavefront_ || wavefront_->bytes() != 0) throw;
        program_->giveUp(std::string("continuing with the precompiled kernel: ") + error.what());
        launchKernels(program_->current(), launch);
    }
    noteMemory();
    cuda.check(cuda.cuEventRecord(end_, nullptr), "recording an event");
    cuda.check(cuda.cuEventSynchronize(end_), "rendering on '" + device_.name + "'");

    float milliseconds = 0;
    cuda.check(cuda.cuEventElapsedTime(&milliseconds, start_, end_), "reading the kernel's time");
    return milliseconds * 1e-3;
}

bool CudaIntegrator::render(const CrtRenderRange& range) {
    context_.makeCurrent();
    return plugin::renderInLaunches(host_, pacer_, range, tile_size_, launched_,
                                    [this](const Launch& next) { return launch(next); });
}

void CudaIntegrator::readFilm(const CrtFilmView& film) {
    context_.makeCurrent();
    film_.sums.download(film.sums);
    film_.counts.download(film.counts);
    if (film.primitives != nullptr) film_.primitives.download(film.primitives);
}

void CudaIntegrator::report(CrtBackendReport& report) {
    context_.makeCurrent();
    plugin::writeText(report.device, device_.name);
    report.compile_seconds = compile_seconds_;
    report.cache_seconds = cache_seconds_;
    if (program_) {
        const std::vector<Module>& kernels = program_->current();
        plugin::writeText(report.kernel, program_->description());
        report.kernel_from_cache = program_->fromCache() ? 1 : 0;
        report.kernel_features = kernels.front().spec().features;
        report.compile_seconds += program_->compileSeconds();
        report.cache_seconds += program_->cacheSeconds();
        for (const Module& kernel : kernels) {
            report.registers = std::max(report.registers, kernel.registers());
            report.spill_bytes = std::max(report.spill_bytes, kernel.spillBytes());
        }
    }
    report.upload_seconds = upload_seconds_;
    report.render_seconds = launched_.seconds;
    report.paths = launched_.paths;
    report.peak_memory_bytes = peak_bytes_;
    if (rays_.bytes() != 0) {
        std::vector<std::uint64_t> counts(kRayCounters * 2);
        rays_.download(counts.data());
        for (std::size_t i = 0; i < counts.size(); i += 2) {
            report.closest_rays += counts[i];
            report.shadow_rays += counts[i + 1];
        }
    }
}

}  // namespace crt::cuda
