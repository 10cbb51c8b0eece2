// The test double: a backend that keeps every promise of crt_backend.h and renders fake_pattern.h instead of
// a scene, so that job, film, checkpoints and resume can be tested in microseconds.
//
// CRT_FAKE_FAULT makes the next render calls go wrong:
//   oom     out of device memory, half-way through the range
//   device  the device fails, half-way through the range
//   nan     every seventh sample is not a number
//   slow    2 ms a row, with a look at cancel after each
//   hang    never comes back
//   endless from sample 4 on a path without end, which looks at cancel
//   talk    a thread of the plugin warns
//   nan_film, count_film   the film that is handed over holds a NaN, or more samples than were asked for
//   scene_oom, read   set_scene or read_film fails
// CRT_FAKE_FAULT_DEVICE: only that device has the fault.
// CRT_FAKE_MEMORY: bytes for film and scene of each device, or with "1000,2000" each its own.
// CRT_FAKE_SCENE_SECONDS: so long takes set_scene, which says how far it is.
// CRT_FAKE_FIRST_START_MS: so long takes the first integrator of a process, as a driver does that is not
// loaded yet.
// CRT_FAKE_SAMPLE_MS, in CMakeLists.txt: so long takes a sample of all pixels, at least.
#include "backend/sdk/plugin_guard.h"

#include "fake_pattern.h"
#include "kernel/dialect/features.h"
#include "kernel/dialect/layout.h"

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <thread>

#ifndef CRT_FAKE_SAMPLE_MS
#define CRT_FAKE_SAMPLE_MS 0
#endif

namespace {

using crt::plugin::PluginError;

std::vector<CrtDevice> listDevices(const crt::plugin::Host&) {
    return {crt::plugin::makeDevice(0, "pattern", "", 0, 1.0),
            crt::plugin::makeDevice(1, "second pattern", "", 0, 0.5)};
}

/// Adds `value` to an unevaluated pair hi + lo without losing a bit that the pair can hold (Knuth's
/// two-sum).
void addTo(double* pair, double value) {
    const double sum = pair[0] + value;
    const double part = sum - pair[0];
    pair[1] += (pair[0] - (sum - part)) + (value - part);
    pair[0] = sum;
}

class FakeIntegrator {
public:
    FakeIntegrator(const crt::plugin::Host& host, const CrtCreateInfo& info)
        : host_(host), device_(crt::plugin::chooseDevice(listDevices(host), info.device)) {
        static bool started = false;
        const char* delay = std::getenv("CRT_FAKE_FIRST_START_MS");
        if (delay != nullptr && !started)
            std::this_thread::sleep_for(std::chrono::milliseconds(std::atoi(delay)));
        started = true;
    }

    void setScene(const CrtSceneBlob& blob) {
        if (wantedFault() == "scene_oom")
            throw PluginError(CRT_OUT_OF_MEMORY, "the scene needs 12 bytes more than there are");
        std::memcpy(&scene_, blob.data, sizeof(scene_));
        paths_ = 0;
        seconds_ = 0;
        requireRoom(blob.size_bytes);
        const char* seconds = std::getenv("CRT_FAKE_SCENE_SECONDS");
        for (int i = 0; seconds != nullptr && i < 100; ++i) {
            host_.cancelled(i / 100.0);
            std::this_thread::sleep_for(std::chrono::duration<double>(std::atof(seconds) / 100));
        }
        const std::size_t pixels = std::size_t{scene_.width} * scene_.height;
        sums_.assign(pixels * scene_.channels * 2, 0.0);
        counts_.assign(pixels, 0);
        primitives_.assign(pixels, CRT_NONE);
    }

    bool render(const CrtRenderRange& range) {
        const std::string fault = wantedFault();
        while (fault == "hang") std::this_thread::sleep_for(std::chrono::seconds(1));
        if (fault == "talk")
            std::thread([this] { host_.log(CRT_LOG_WARNING, "a thread of the fake"); }).join();
        const auto start = std::chrono::steady_clock::now();
        const std::uint64_t seed = (std::uint64_t{scene_.seed.high} << 32) | scene_.seed.low;
        for (std::uint32_t y = range.y0; y < range.y1; ++y) {
            const double done = double(y - range.y0) / (range.y1 - range.y0);
            const bool half_way = done >= 0.5 || range.y1 - range.y0 == 1;
            if (half_way && fault == "oom")
                throw PluginError(CRT_OUT_OF_MEMORY, "the device has no memory left for 12 more rows");
            if (half_way && fault == "device")
                throw PluginError(CRT_DEVICE_FAILED, "the device fell off the bus");
            const auto samples = std::chrono::milliseconds(CRT_FAKE_SAMPLE_MS) * range.sample_count;
            std::this_thread::sleep_for(samples / (range.y1 - range.y0));
            if (fault == "slow") std::this_thread::sleep_for(std::chrono::milliseconds(2));
            if (fault == "endless" && half_way && range.first_sample + range.sample_count > 4) {
                while (!host_.cancelled(done)) std::this_thread::sleep_for(std::chrono::milliseconds(10));
                return false;
            }
            if (host_.cancelled(done)) return false;
            for (std::uint32_t x = range.x0; x < range.x1; ++x)
                renderPixel(range, seed, x, y, fault == "nan");
        }
        host_.cancelled(1.0);
        seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        return true;
    }

    void readFilm(const CrtFilmView& film) {
        if (wantedFault() == "read") throw PluginError(CRT_DEVICE_FAILED, "the device does not answer");
        std::copy(sums_.begin(), sums_.end(), film.sums);
        std::copy(counts_.begin(), counts_.end(), film.counts);
        if (film.primitives != nullptr) std::copy(primitives_.begin(), primitives_.end(), film.primitives);
        if (film.splats != nullptr)
            std::fill_n(film.splats, counts_.size() * crt::kernel::crt_splat_words(&scene_), 0);
        if (wantedFault() == "nan_film")
            film.sums[sums_.size() / 2] = std::numeric_limits<double>::quiet_NaN();
        if (wantedFault() == "count_film") film.counts[0] += 1;
    }

    void report(CrtBackendReport& report) {
        crt::plugin::writeText(report.device, std::string(device_.name));
        crt::plugin::writeText(report.kernel, std::string("pattern"));
        report.kernel_features = CRT_FEATURES_ALL;
        report.render_seconds = seconds_;
        report.paths = report.closest_rays = paths_;
    }

private:
    std::string wantedFault() const {
        const char *value = std::getenv("CRT_FAKE_FAULT"), *only = std::getenv("CRT_FAKE_FAULT_DEVICE");
        if (value == nullptr || (only != nullptr && only != std::to_string(device_.index))) return "";
        return value;
    }

    void requireRoom(std::uint64_t scene_bytes) const {
        const char* text = std::getenv("CRT_FAKE_MEMORY");
        if (text == nullptr) return;
        char* next = nullptr;
        std::uint64_t memory = std::strtoull(text, &next, 10);
        for (std::uint32_t i = 0; i < device_.index && *next == ','; ++i)
            memory = std::strtoull(next + 1, &next, 10);
        const std::uint64_t film_bytes = std::uint64_t{scene_.width} * scene_.height *
                                         (16 * std::uint64_t{scene_.channels} + sizeof(std::uint64_t));
        if (film_bytes + scene_bytes <= memory) return;
        const std::string needs = scene_bytes > memory
                                      ? "the scene needs " + std::to_string(scene_bytes)
                                      : "the film needs " + std::to_string(film_bytes);
        throw PluginError(CRT_OUT_OF_MEMORY, needs + " bytes, and there are " + std::to_string(memory));
    }

    void renderPixel(const CrtRenderRange& range, std::uint64_t seed, std::uint32_t x, std::uint32_t y,
                     bool with_invalid) {
        const std::uint32_t film_x = scene_.crop_x + x, film_y = scene_.crop_y + y;
        const std::size_t pixel = std::size_t{y} * scene_.width + x;
        primitives_[pixel] = crt::fake::primitiveAt(film_x, film_y);
        for (std::uint64_t i = 0; i < range.sample_count; ++i) {
            const std::uint64_t sample = range.first_sample + i;
            ++paths_;
            if (with_invalid && crt::fake::isInvalid(film_x, film_y, sample)) continue;
            ++counts_[pixel];
            const std::uint32_t without =
                scene_.replicate_shift != 0 ? scene_.replicate_channel : scene_.channels;
            const auto add = [&](std::uint32_t channel, std::uint32_t value) {
                addTo(&sums_[(pixel * scene_.channels + channel) * 2],
                      CRT_FAKE_FACTOR * crt::fake::sampleValue(seed, film_x, film_y, sample, value));
            };
            for (std::uint32_t c = 0; c < without; ++c) add(c, c);
            // Y of the replicate whose turn it is; the last has no channel.
            const auto replicate =
                static_cast<std::uint32_t>(sample % (std::uint64_t{1} << scene_.replicate_shift));
            if (without + replicate < scene_.channels) add(without + replicate, 1);
        }
    }

    crt::plugin::Host host_;
    CrtDevice device_;
    crt::kernel::CrtScene scene_{};
    std::vector<double> sums_;
    std::vector<std::uint64_t> counts_;
    std::vector<std::uint32_t> primitives_;
    std::uint64_t paths_ = 0;
    double seconds_ = 0;
};

}  // namespace

CRT_DEFINE_BACKEND(FakeIntegrator, listDevices, CRT_FAKE_NAME, CRT_HEADERS_VERSION, CRT_FEATURES_ALL)
