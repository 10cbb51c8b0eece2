// A backend for tests: the CUDA kernels on the host's processor, so that the conformance suite sees the very
// entry points that a GPU runs.
#include "host_kernels.h"

#include "backend/sdk/launch_pacer.h"
#include "backend/sdk/plugin_guard.h"
#include "kernel/dialect/features.h"
#include "kernel/dialect/layout.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <memory>
#include <thread>
#include <vector>

namespace crt::cuda_on_host {
namespace {

std::vector<CrtDevice> probeDevices(const plugin::Host&) {
    const unsigned threads = std::max(1u, std::thread::hardware_concurrency());
    return {plugin::makeDevice(0, "CUDA kernels on the host", "none", 0, threads)};
}

class HostIntegrator {
public:
    HostIntegrator(const plugin::Host& host, const CrtCreateInfo& info)
        : host_(host),
          tile_size_(info.tile_size),
          threads_(info.threads != 0 ? info.threads : std::max(1u, std::thread::hardware_concurrency())) {
        plugin::chooseDevice(probeDevices(host),
                             info.device);  // there is one, but another may have been asked for
    }

    void setScene(const CrtSceneBlob& blob) {
        const auto& scene = *static_cast<const kernel::CrtScene*>(blob.data);
        blob_.resize((blob.size_bytes + sizeof(Line) - 1) / sizeof(Line));
        std::memcpy(blob_.data(), blob.data, blob.size_bytes);
        film_ = HostFilm(1, scene);
        slices_ = HostFilm(kSlices, scene);
        splats_.assign(film_.counts.size() * kernel::crt_splat_words(&scene), 0);
        rays_.assign(2 * rayCounterPairs(), 0);
        paths_ = 0;
    }

    bool render(const CrtRenderRange& range) {
        pacer_.begin(range, tile_size_);
        if (host_.cancelled(0.0)) return false;
        for (Launch launch; pacer_.next(launch);) {
            const auto start = std::chrono::steady_clock::now();
            // Both schedules in turn, each with slices where there are samples for them and without where
            // there are not: all ways of the real backend.
            const bool slices = launch.sample_count >= kSlices;
            const auto take = launches_++ % 2 == 0 || !hasWaves() ? launchRender : launchWave;
            HostFilm& film = slices ? slices_ : film_;
            take(blob_.data(), launch, slices ? kSlices : 1, film.pointers(splats_), rays_.data(), threads_);
            if (slices)
                launchAddSlices(blob_.data(), launch, kSlices, film_.pointers(splats_),
                                slices_.pointers(splats_), threads_);
            const double seconds =
                std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
            pacer_.finished(launch, seconds);
            render_seconds_ += seconds;
            paths_ += launch.paths();
            if (host_.cancelled(pacer_.done())) return false;
        }
        return true;
    }

    void readFilm(const CrtFilmView& film) {
        std::copy(film_.sums.begin(), film_.sums.end(), film.sums);
        std::copy(film_.counts.begin(), film_.counts.end(), film.counts);
        if (film.primitives != nullptr)
            std::copy(film_.primitives.begin(), film_.primitives.end(), film.primitives);
        if (film.splats != nullptr) std::copy(splats_.begin(), splats_.end(), film.splats);
    }

    void report(CrtBackendReport& report) {
        plugin::writeText(report.device, "CUDA kernels on the host");
        plugin::writeText(report.kernel,
                          "precompiled, both schedules, " + std::to_string(kSlices) + " slices");
        report.kernel_features = CRT_FEATURES_ALL;
        report.render_seconds = render_seconds_;
        report.paths = paths_;
        for (std::size_t i = 0; i < rays_.size(); i += 2) {
            report.closest_rays += rays_[i];
            report.shadow_rays += rays_[i + 1];
        }
    }

private:
    static constexpr std::uint32_t kSlices = 3;

    /// Waves know the path tracer alone.
    bool hasWaves() const {
        return reinterpret_cast<const kernel::CrtScene*>(blob_.data())->integrator == CRT_INTEGRATOR_PATH;
    }

    struct alignas(64) Line {
        unsigned char bytes[64];
    };

    struct HostFilm {
        HostFilm() = default;
        HostFilm(std::size_t copies, const kernel::CrtScene& scene) {
            const std::size_t pixels = copies * scene.width * scene.height;
            sums.resize(pixels * scene.channels * 2);
            counts.resize(pixels);
            if (scene.aovs & CRT_AOV_PRIMITIVE) primitives.assign(pixels, CRT_NONE);
        }
        FilmPointers pointers(std::vector<std::uint64_t>& splats) {
            return {sums.data(), counts.data(), primitives.empty() ? nullptr : primitives.data(),
                    splats.empty() ? nullptr : splats.data()};
        }

        std::vector<double> sums;
        std::vector<std::uint64_t> counts;
        std::vector<std::uint32_t> primitives;
    };

    plugin::Host host_;
    std::uint32_t tile_size_;
    unsigned threads_;
    LaunchPacer pacer_{0.05, 4096, 8};
    std::vector<Line> blob_;
    HostFilm film_, slices_;
    std::vector<std::uint64_t> splats_, rays_;
    double render_seconds_ = 0;
    std::uint64_t paths_ = 0, launches_ = 0;
};

}  // namespace
}  // namespace crt::cuda_on_host

CRT_DEFINE_BACKEND(crt::cuda_on_host::HostIntegrator, crt::cuda_on_host::probeDevices, "cuda_on_host",
                   CRT_HEADERS_VERSION, CRT_FEATURES_ALL)
