#include "gpu_integrator.h"

#include "film_slices.h"

#include "backend/sdk/gpu_schedule.h"
#include "kernel/dialect/features.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

namespace crt::gpu {

using plugin::PluginError;

namespace {

/// Wanted duration of a wave: long, because its last passes have few paths left.
constexpr double kWaveSeconds = 0.6;
/// The size of a launch over that of the one before, at most. A wave looks in between if it should stop.
constexpr double kLaunchGrowth = 4, kWaveGrowth = 16;
/// Pairs of ray counters, as in kernels.h.
constexpr std::uint32_t kRayCounters = 1024;

LaunchPacer pacerFor(bool waves, const DeviceTraits& device) {
    return LaunchPacer(waves ? kWaveSeconds : device.launch_seconds, device.first_paths,
                       waves ? CRT_WAVE_BLOCK_HEIGHT : device.block_height, device.least_paths,
                       waves ? kWaveGrowth : kLaunchGrowth);
}

/// Thrown out of a launch when the host wants to stop.
struct LaunchCancelled {};

}  // namespace

GpuIntegrator::GpuIntegrator(const plugin::Host& host, const CrtCreateInfo& info,
                             std::unique_ptr<GpuDevice> device)
    : host_(host),
      device_(std::move(device)),
      kernel_choice_(info.kernel),
      tile_size_(info.tile_size),
      pacer_(pacerFor(false, device_->traits())) {}

GpuIntegrator::~GpuIntegrator() {
    // For the members, whose memory and kernels are given back after this.
    try {
        device_->makeCurrent();
    } catch (const PluginError&) {
        // The device is lost, and there is nothing to give back.
    }
}

void GpuIntegrator::log(CrtLogLevel level, const std::string& line) const {
    host_.log(level, device_->traits().backend + ": " + line);
}

GpuBuffer GpuIntegrator::allocateFilled(std::uint64_t bytes, unsigned char value, const char* what) {
    GpuBuffer buffer = device_->allocate(bytes, what);
    device_->fill(buffer, value);
    return buffer;
}

GpuFilm GpuIntegrator::allocateFilm(std::uint64_t copies, const char* what) {
    const std::uint64_t pixels = copies * scene_.width * scene_.height;
    const std::uint64_t sums = pixels * scene_.channels * 2 * sizeof(double);
    const std::uint64_t counts = pixels * sizeof(std::uint64_t);
    const std::uint64_t primitives = scene_.aovs & CRT_AOV_PRIMITIVE ? pixels * sizeof(std::uint32_t) : 0;
    // Of the whole, or the sentence would have the numbers of whichever part came too late.
    device_->requireFree(sums + counts + primitives, what);
    GpuFilm film;
    film.sums = allocateFilled(sums, 0, what);
    film.counts = allocateFilled(counts, 0, what);
    if (primitives != 0) film.primitives = allocateFilled(primitives, 0xff, what);  // CRT_NONE
    return film;
}

void GpuIntegrator::noteMemory() {
    peak_bytes_ = std::max(peak_bytes_, blob_.bytes + rays_.bytes + splats_.bytes + film_.bytes() +
                                            slices_.bytes() + (wavefront_ ? wavefront_->bytes() : 0));
}

void GpuIntegrator::setScene(const CrtSceneBlob& blob) {
    device_->makeCurrent();
    const auto& scene = *static_cast<const kernel::CrtScene*>(blob.data);

    // The old film goes first: two need not fit side by side. Until all of the new one is there, there is no
    // scene.
    blob_ = GpuBuffer();
    film_ = GpuFilm();
    slices_ = GpuFilm();
    slice_count_ = 0;
    rays_ = GpuBuffer();
    splats_ = GpuBuffer();
    wavefront_.reset();
    render_seconds_ = 0;
    paths_ = 0;
    scene_ = scene;

    const bool full = kernel_choice_ == CRT_KERNEL_FULL;
    if (!full && wantsWavefront(scene.features, scene.max_depth) && device_->takesWaves(scene.max_depth))
        wavefront_.emplace(*device_, blob.data);
    // Its measurements hold for the next scene, too, or for the next band of a film.
    if (paced_for_waves_ != wavefront_.has_value()) {
        paced_for_waves_ = wavefront_.has_value();
        pacer_ = pacerFor(paced_for_waves_, device_->traits());
    }
    const KernelSpec render{Entry::Render, full ? std::uint64_t{CRT_FEATURES_ALL} : scene.features};
    useKernels(wavefront_ ? wavefront_->plan().kernels : Specs{render}, mayOutlastLaunch(scene.max_depth));

    const Stopwatch uploading;
    const std::uint64_t splat_words = kernel::crt_splat_words(&scene);
    const std::uint64_t splat_bytes = splat_words * scene.width * scene.height * sizeof(std::uint64_t);
    if (splat_bytes != 0) splats_ = allocateFilled(splat_bytes, 0, "the film's splats");
    film_ = allocateFilm(1, "the film");
    rays_ = allocateFilled(kRayCounters * 2 * sizeof(std::uint64_t), 0, "the ray counters");
    GpuBuffer uploaded = device_->allocate(blob.size_bytes, "the scene");
    device_->write(uploaded, blob.data);
    blob_ = std::move(uploaded);
    upload_seconds_ += uploading.seconds();
    noteMemory();
}

void GpuIntegrator::useKernels(const Specs& wanted, bool waits_for_them) {
    if (program_ && program_->wanted() == wanted) return;
    if (program_) {
        compile_seconds_ += program_->compileSeconds();
        cache_seconds_ += program_->cacheSeconds();
    }
    // While waves are compiled, the kernel that takes a path to its end may render.
    const bool waits = kernel_choice_ == CRT_KERNEL_LEAN && waits_for_them;
    program_ = device_->makeProgram(host_, wanted, waits ? CRT_KERNEL_LEAN_ONLY : kernel_choice_);
}

std::uint32_t GpuIntegrator::ensureSlices(std::uint32_t slices) {
    if (slices <= std::max(slice_count_, 1u)) return slices;
    // Others may have taken memory since the device was opened. Slices only make a render faster: it must
    // not fail for want of them.
    const std::uint64_t budget =
        sliceBudget(device_->traits().memory_bytes, device_->freeBytes() + slices_.bytes());
    slices = static_cast<std::uint32_t>(
        std::min<std::uint64_t>(slices, budget / std::max<std::uint64_t>(film_.bytes(), 1)));
    if (slices <= std::max(slice_count_, 1u)) return std::max(slice_count_, 1u);
    slices_ = GpuFilm();
    slice_count_ = 0;
    try {
        slices_ = allocateFilm(slices, "the film's slices");
    } catch (const PluginError& error) {
        // Another process took the memory first, or the free memory is fragmented.
        if (error.status() != CRT_OUT_OF_MEMORY) throw;
        log(CRT_LOG_DEBUG, std::string("continuing without slices: ") + error.what());
        return 1;
    }
    slice_count_ = slices;
    noteMemory();
    return slices;
}

void GpuIntegrator::launchRender(const GpuKernel& kernel, const Launch& launch, std::uint32_t slices,
                                 const LaunchTarget& target) {
    const DeviceTraits& device = device_->traits();
    GpuArguments arguments;  // CRT_SCENE_ARGUMENTS, then those of crt_render
    if (device.struct_arguments) arguments.push_back(target.scene);
    arguments.insert(arguments.end(), {target.blob, launch.x0, launch.y0, launch.x1, launch.y1,
                                       launch.first_sample, launch.sample_count, target.film.sums,
                                       target.film.counts, target.film.primitives, splats_, target.rays});
    const std::uint64_t blocks = divideUp(launch.x1 - launch.x0, device.block_width) *
                                 divideUp(launch.y1 - launch.y0, device.block_height);
    device_->launch(kernel.entry, "crt_render", {blocks, device.block_width * device.block_height, slices},
                    arguments);
}

void GpuIntegrator::addSlices(const GpuKernel& kernel, const Launch& launch, std::uint32_t slices) {
    const DeviceTraits& device = device_->traits();
    const std::uint32_t block = device.block_width * device.block_height;
    device_->launch(
        kernel.add_slices, "crt_add_slices", {divideUp(launch.pixels() * scene_.channels, block), block},
        {launch.x0, launch.y0, launch.x1, launch.y1, scene_.width, scene_.height, scene_.channels, slices,
         film_.sums, film_.counts, film_.primitives, slices_.sums, slices_.counts, slices_.primitives});
}

void GpuIntegrator::launchKernels(const std::vector<GpuKernel>& kernels, const Launch& launch) {
    const GpuKernel& first = kernels.front();
    const bool waves = first.spec.entry == Entry::Trace;
    const DeviceTraits& device = device_->traits();
    std::uint32_t slices = 1;
    if (first.add_slices != nullptr) {
        // Blocks of crt_render and of waves have the same size where launches are divided.
        const std::uint64_t across = divideUp(launch.x1 - launch.x0, device.block_width);
        const std::uint64_t blocks = across * divideUp(launch.y1 - launch.y0, device.block_height);
        const std::uint64_t fitting =
            waves ? wavefront_->mostSlices(across) : std::numeric_limits<std::uint32_t>::max();
        const std::uint64_t most = sliceBudget(device.memory_bytes, device.memory_bytes) /
                                   std::max<std::uint64_t>(film_.bytes(), 1);
        const std::uint64_t fillings = waves ? kWaveFillings : kFillings;
        slices = ensureSlices(chooseSlices(blocks, first.resident_blocks, fillings, launch.sample_count,
                                           std::min(most, fitting)));
        slices = static_cast<std::uint32_t>(std::min<std::uint64_t>(slices, fitting));
    }

    const LaunchTarget target{scene_, blob_, slices > 1 ? slices_ : film_, rays_};
    auto looked_at = std::chrono::steady_clock::now();
    const auto look = [&] {  // now and then, if the host wants to stop
        const auto now = std::chrono::steady_clock::now();
        if (now - looked_at < std::chrono::milliseconds(100)) return;
        looked_at = now;
        if (host_.cancelled(pacer_.done())) throw LaunchCancelled();
    };
    if (waves)
        wavefront_->launch(kernels, launch, slices, target, look);
    else
        launchRender(first, launch, slices, target);
    if (slices > 1) addSlices(first, launch, slices);
}

double GpuIntegrator::launch(const Launch& launch) {
    return device_->seconds([&] {
        try {
            launchKernels(program_->current(), launch);
        } catch (const PluginError& error) {
            // Waves only make a render faster: it must not fail for want of memory for them.
            if (error.status() != CRT_OUT_OF_MEMORY || !wavefront_ || wavefront_->bytes() != 0) throw;
            program_->giveUpWaves(error.what());
            launchKernels(program_->current(), launch);
        }
        noteMemory();
    });
}

bool GpuIntegrator::render(const CrtRenderRange& range) {
    device_->makeCurrent();
    pacer_.begin(range, tile_size_);
    if (host_.cancelled(0.0)) return false;
    for (Launch next; pacer_.next(next);) {
        double seconds = 0;
        try {
            seconds = launch(next);
        } catch (const LaunchCancelled&) {
            return false;
        }
        pacer_.finished(next, seconds);
        render_seconds_ += seconds;
        paths_ += next.paths();
        if (host_.cancelled(pacer_.done())) return false;
    }
    return true;
}

void GpuIntegrator::readFilm(const CrtFilmView& film) {
    device_->makeCurrent();
    device_->read(film_.sums, film.sums);
    device_->read(film_.counts, film.counts);
    if (film.primitives != nullptr) device_->read(film_.primitives, film.primitives);
    if (film.splats != nullptr) device_->read(splats_, film.splats);
}

void GpuIntegrator::report(CrtBackendReport& report) {
    device_->makeCurrent();
    plugin::writeText(report.device, device_->traits().name);
    report.compile_seconds = compile_seconds_;
    report.cache_seconds = cache_seconds_;
    if (program_) {
        const std::vector<GpuKernel>& kernels = program_->current();
        plugin::writeText(report.kernel, program_->description());
        report.kernel_from_cache = program_->fromCache() ? 1 : 0;
        report.kernel_features = kernels.front().spec.features;
        report.compile_seconds += program_->compileSeconds();
        report.cache_seconds += program_->cacheSeconds();
        for (const GpuKernel& kernel : kernels) {
            report.registers = std::max(report.registers, kernel.registers);
            report.spill_bytes = std::max(report.spill_bytes, kernel.spill_bytes);
        }
    }
    report.upload_seconds = upload_seconds_;
    report.render_seconds = render_seconds_;
    report.paths = paths_;
    report.peak_memory_bytes = device_->traits().own_memory ? peak_bytes_ : 0;
    if (rays_.bytes != 0) {
        std::vector<std::uint64_t> counts(kRayCounters * 2);
        device_->read(rays_, counts.data());
        for (std::size_t i = 0; i < counts.size(); i += 2) {
            report.closest_rays += counts[i];
            report.shadow_rays += counts[i + 1];
        }
    }
}

}  // namespace crt::gpu
