#include "embree_integrator.h"

#include "kernel/dialect/features.h"
#include "system/huge_pages.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <fstream>
#include <mutex>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace crt::embree {
namespace {

using kernel::u64;  // CRT_ARRAY computes with it
using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// The model name that Linux gives the processor.
std::string processorName() {
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);)
        if (line.rfind("model name", 0) == 0 && line.find(':') != std::string::npos)
            return line.substr(line.find(':') + 2);
    return "CPU";
}

/// The kernels are compiled for AVX2 and FMA (x86-64-v3).
bool processorFits() { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }

}  // namespace

std::vector<CrtDevice> probeDevices(const plugin::Host&) {
    if (!processorFits())
        throw plugin::PluginError(CRT_NO_DEVICE,
                                  "this processor has no AVX2 and FMA, which the Embree backend is compiled "
                                  "for; use the opencl backend");
    const auto threads = static_cast<double>(tbb::this_task_arena::max_concurrency());
    return {plugin::makeDevice(0, processorName(), "Embree " + Device::version(), 0, threads)};
}

EmbreeIntegrator::EmbreeIntegrator(const plugin::Host& host, const CrtCreateInfo& info)
    : host_(host),
      info_(info),
      threads_(info.threads != 0 ? info.threads
                                 : static_cast<unsigned>(tbb::this_task_arena::max_concurrency())),
      parallelism_(tbb::global_control::max_allowed_parallelism, threads_),
      arena_(static_cast<int>(threads_)) {
    plugin::chooseDevice(probeDevices(host), info.device);
    info_.device = nullptr;  // the host's string is not ours to keep
}

/// True if the scene that is set is given again with another camera or another size or window of the film,
/// as viewers and bands do: then its tree is the same.
bool EmbreeIntegrator::differsInViewAlone(const CrtSceneBlob& given) const {
    if (!blob_ || blob_bytes_ != given.size_bytes) return false;
    const auto* const bytes = static_cast<const unsigned char*>(given.data);
    kernel::CrtScene header = *reinterpret_cast<const kernel::CrtScene*>(bytes);
    header.camera = scene().camera;
    header.film_width = scene().film_width;
    header.film_height = scene().film_height;
    header.crop_x = scene().crop_x;
    header.crop_y = scene().crop_y;
    header.width = scene().width;
    header.height = scene().height;
    return std::memcmp(&header, blob(), sizeof header) == 0 &&
           std::memcmp(bytes + sizeof header, blob() + sizeof header, blob_bytes_ - sizeof header) == 0;
}

void EmbreeIntegrator::setScene(const CrtSceneBlob& scene_blob) {
    const bool same_tree = differsInViewAlone(scene_blob);
    if (!same_tree) {
        program_.reset();
        tree_.reset();
        blob_.reset();
    }
    build_seconds_ = render_seconds_ = 0;
    paths_ = 0;
    rays_ = {};

    // From the caller's blob, before it is copied: building takes more memory than what is built.
    const auto* const bytes = static_cast<const unsigned char*>(scene_blob.data);
    const auto& given = *reinterpret_cast<const kernel::CrtScene*>(bytes);
    if ((given.features & CRT_FEATURE_BVH) != 0 && !same_tree) {
        const auto start = Clock::now();
        if (!device_) device_ = std::make_unique<Device>();
        const auto progress = [this](double done) { host_.cancelled(done); };
        arena_.execute([&] { tree_ = std::make_unique<Tree>(*device_, bytes, progress); });
        build_seconds_ = secondsSince(start);
    }
    if (same_tree)
        std::memcpy(blob_.get(), bytes, sizeof(kernel::CrtScene));
    else
        copyBlob(bytes, scene_blob.size_bytes);
    if (!program_ || !same_tree)
        program_ = std::make_unique<EmbreeProgram>(host_, scene().features, info_.kernel);

    const std::size_t pixels = static_cast<std::size_t>(scene().width) * scene().height;
    const std::size_t numbers = pixels * scene().channels * 2;
    sums_.clear();
    sums_.reserve(numbers);
    adviseHugePages(sums_.data(), numbers * sizeof(double));
    sums_.assign(numbers, 0.0);
    counts_.assign(pixels, 0);
    primitives_.assign((scene().aovs & CRT_AOV_PRIMITIVE) != 0 ? pixels : 0, CRT_NONE);
    splats_.assign(pixels * crt_splat_words(&scene()), 0);
}

/// By all threads: the system's giving the memory takes longer than the copy.
void EmbreeIntegrator::copyBlob(const unsigned char* bytes, std::size_t size) {
    constexpr std::size_t kPart = std::size_t{2} << 20;
    // Not a vector: it would write zeros over hundreds of megabytes first.
    blob_.reset(new Line[(size + sizeof(Line) - 1) / sizeof(Line)]);
    blob_bytes_ = size;
    auto* const to = reinterpret_cast<unsigned char*>(blob_.get());
    adviseHugePages(to, size);
    arena_.execute([&] {
        tbb::parallel_for(std::size_t{0}, (size + kPart - 1) / kPart, [&](std::size_t i) {
            std::memcpy(to + i * kPart, bytes + i * kPart, std::min(kPart, size - i * kPart));
        });
    });
}

std::uint32_t EmbreeIntegrator::tileSize(const CrtRenderRange& range) const {
    if (info_.tile_size != 0) return info_.tile_size;
    // Large enough to be cache friendly, small enough that every thread gets several.
    std::uint32_t size = 16;
    const auto tiles = [&] {
        return static_cast<std::uint64_t>((range.x1 - range.x0 + size - 1) / size) *
               ((range.y1 - range.y0 + size - 1) / size);
    };
    while (size > 1 && tiles() < 8ull * threads_) size /= 2;
    return size;
}

bool EmbreeIntegrator::render(const CrtRenderRange& range) {
    const auto start = Clock::now();
    const std::uint32_t size = tileSize(range);
    const std::uint32_t columns = (range.x1 - range.x0 + size - 1) / size;
    const std::uint32_t rows = (range.y1 - range.y0 + size - 1) / size;
    // Samples of one job: a tile with more is done in several, so that progress moves and a cancel is
    // obeyed.
    constexpr std::uint64_t kSamplesPerJob = 64;

    std::atomic<std::uint64_t> closest{0}, shadow{0}, done{0};
    std::atomic<bool> cancelled{false};
    std::mutex progress_mutex;
    const double all = static_cast<double>(columns) * rows *
                       static_cast<double>(std::max<std::uint64_t>(range.sample_count, 1));
    // One thread at a time calls the host, so that the others need not wait.
    const auto tell = [&] {
        const std::unique_lock lock(progress_mutex, std::try_to_lock);
        if (lock.owns_lock()) {
            if (host_.cancelled(static_cast<double>(done.load()) / all)) cancelled = true;
            program_->poll((render_seconds_ + secondsSince(start)) * threads_);
        }
        return cancelled.load(std::memory_order_relaxed);
    };
    arena_.execute([&] {
        tbb::parallel_for(
            tbb::blocked_range<std::uint32_t>(0, columns * rows, 1),
            [&](const tbb::blocked_range<std::uint32_t>& tiles) {
                for (std::uint32_t tile = tiles.begin(); tile != tiles.end(); ++tile) {
                    TileJob job{};
                    job.blob = blob();
                    job.tree = tree_ ? tree_->root() : 0;
                    job.x0 = range.x0 + tile % columns * size;
                    job.y0 = range.y0 + tile / columns * size;
                    job.x1 = std::min(job.x0 + size, range.x1);
                    job.y1 = std::min(job.y0 + size, range.y1);
                    job.sums = sums_.data();
                    job.counts = counts_.data();
                    job.primitives = primitives_.empty() ? nullptr : primitives_.data();
                    job.splats = splats_.empty() ? nullptr : splats_.data();
                    job.cancelled = [](void* host) { return (*static_cast<decltype(tell)*>(host))(); };
                    job.host = const_cast<void*>(static_cast<const void*>(&tell));
                    for (std::uint64_t s = 0;
                         s < range.sample_count && !cancelled.load(std::memory_order_relaxed);
                         s += kSamplesPerJob) {
                        job.first_sample = range.first_sample + s;
                        job.sample_count =
                            static_cast<std::uint32_t>(std::min(kSamplesPerJob, range.sample_count - s));
                        const RayTotals rays = program_->current()(job);
                        closest += rays.closest;
                        shadow += rays.shadow;
                        done += job.sample_count;
                        tell();
                    }
                }
            },
            tbb::simple_partitioner());
    });
    render_seconds_ += secondsSince(start);
    rays_.closest += closest;
    rays_.shadow += shadow;
    if (cancelled) return false;
    paths_ += static_cast<std::uint64_t>(range.x1 - range.x0) * (range.y1 - range.y0) * range.sample_count;
    return true;
}

void EmbreeIntegrator::readFilm(const CrtFilmView& film) {
    std::copy(sums_.begin(), sums_.end(), film.sums);
    std::copy(counts_.begin(), counts_.end(), film.counts);
    if (film.primitives != nullptr) std::copy(primitives_.begin(), primitives_.end(), film.primitives);
    if (film.splats != nullptr) std::copy(splats_.begin(), splats_.end(), film.splats);
}

void EmbreeIntegrator::report(CrtBackendReport& report) {
    plugin::writeText(report.device, processorName());
    if (program_) {
        plugin::writeText(report.kernel, program_->description());
        report.kernel_features = program_->features();
        report.kernel_from_cache = program_->fromCache() ? 1 : 0;
        report.compile_seconds = program_->compileSeconds();
        report.cache_seconds = program_->cacheSeconds();
    }
    report.build_seconds = build_seconds_;
    report.render_seconds = render_seconds_;
    report.paths = paths_;
    report.closest_rays = rays_.closest;
    report.shadow_rays = rays_.shadow;
}

}  // namespace crt::embree
