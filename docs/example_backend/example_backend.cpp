// A complete crt backend in one file: the light transport of kernel/schedule/pixel.h compiled as plain
// C++ and run pixel by pixel on one thread. It gives the same bits as every other backend, only slowly.
// Copy it to begin your own.
#include "backend/sdk/plugin_guard.h"
#include "kernel/schedule/pixel.h"

#include <chrono>

namespace {

using crt::plugin::Host;

// The entries of `crt plugins`. A backend that finds nothing to run on throws
// crt::plugin::PluginError(CRT_NO_DEVICE, "why").
std::vector<CrtDevice> listDevices(const Host&) {
    // The score decides between devices and tells how much is to be expected: a CPU about its number of
    // threads.
    return {crt::plugin::makeDevice(0, "portable C++, one thread", "", 0, 1.0)};
}

class ExampleIntegrator {
public:
    // Opens the device that `info` asks for.
    ExampleIntegrator(const Host& host, const CrtCreateInfo& info)
        : host_(host), device_(crt::plugin::chooseDevice(listDevices(host), info.device)) {}

    // The scene is one block of bytes without pointers: copied as it is, or uploaded to a device in one
    // copy. Film and report start empty.
    void setScene(const CrtSceneBlob& scene) {
        scene_.resize((scene.size_bytes + sizeof(Block) - 1) / sizeof(Block));
        std::memcpy(scene_.data(), scene.data, scene.size_bytes);
        const std::size_t pixels = std::size_t{header().width} * header().height;
        sums_.assign(pixels * header().channels * 2, 0.0);
        counts_.assign(pixels, 0);
        primitives_.assign((header().aovs & CRT_AOV_PRIMITIVE) != 0 ? pixels : 0, CRT_NONE);
        splats_.assign(pixels * crt::kernel::crt_splat_words(&header()), 0);
        paths_ = closest_rays_ = shadow_rays_ = 0;
        seconds_ = 0;
    }

    // Adds samples to the film. In which order, on how many threads, in what pieces: that is the backend's
    // own affair, because the value of a sample depends on the scene, the pixel and its number alone.
    bool render(const CrtRenderRange& range) {
        const auto start = std::chrono::steady_clock::now();
        const crt::kernel::CrtContext context{blob(), &header()};
        for (std::uint32_t y = range.y0; y < range.y1; ++y) {
            if (host_.cancelled(double(y - range.y0) / (range.y1 - range.y0))) return false;
            for (std::uint32_t x = range.x0; x < range.x1; ++x) {
                // The kernel counts the rays of one call in 32 bits.
                for (std::uint64_t done = 0; done < range.sample_count;) {
                    const auto count = static_cast<std::uint32_t>(
                        std::min<std::uint64_t>(range.sample_count - done, 1u << 16));
                    crt::kernel::CrtRayCount rays{};
                    crt::kernel::crt_render_pixel(&context, x, y, range.first_sample + done, count,
                                                  sums_.data(), counts_.data(),
                                                  primitives_.empty() ? nullptr : primitives_.data(),
                                                  splats_.empty() ? nullptr : splats_.data(), &rays);
                    closest_rays_ += rays.closest;
                    shadow_rays_ += rays.shadow;
                    paths_ += count;
                    done += count;
                }
            }
        }
        host_.cancelled(1.0);
        seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        return true;
    }

    void readFilm(const CrtFilmView& film) {
        std::copy(sums_.begin(), sums_.end(), film.sums);
        std::copy(counts_.begin(), counts_.end(), film.counts);
        if (film.primitives != nullptr) std::copy(primitives_.begin(), primitives_.end(), film.primitives);
        if (film.splats != nullptr) std::copy(splats_.begin(), splats_.end(), film.splats);
    }

    void report(CrtBackendReport& report) {
        crt::plugin::writeText(report.device, std::string(device_.name));
        crt::plugin::writeText(report.kernel, std::string("portable C++, all features"));
        report.kernel_features = CRT_FEATURES;
        report.render_seconds = seconds_;
        report.paths = paths_;
        report.closest_rays = closest_rays_;
        report.shadow_rays = shadow_rays_;
    }

private:
    struct alignas(64) Block {
        unsigned char bytes[64];
    };

    const unsigned char* blob() const { return reinterpret_cast<const unsigned char*>(scene_.data()); }
    const crt::kernel::CrtScene& header() const {
        return *reinterpret_cast<const crt::kernel::CrtScene*>(blob());
    }

    Host host_;
    CrtDevice device_;
    std::vector<Block> scene_;
    std::vector<double> sums_;
    std::vector<std::uint64_t> counts_;
    std::vector<std::uint32_t> primitives_;
    std::vector<std::uint64_t> splats_;
    std::uint64_t paths_ = 0, closest_rays_ = 0, shadow_rays_ = 0;
    double seconds_ = 0;
};

}  // namespace

CRT_DEFINE_BACKEND(ExampleIntegrator, listDevices, "example", "1.0.0", CRT_FEATURES_ALL)
