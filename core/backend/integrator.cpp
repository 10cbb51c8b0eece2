#include "backend/integrator.h"

#include "backend/kernel_source.h"
#include "base/error.h"
#include "base/listener.h"
#include "base/log.h"
#include "kernel/dialect/layout.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <exception>
#include <limits>
#include <mutex>
#include <utility>
#include <vector>

namespace crt {
namespace {

ErrorKind kindOf(CrtStatus status) {
    switch (status) {
        case CRT_NO_DEVICE:
        case CRT_UNSUPPORTED: return ErrorKind::Backend;
        case CRT_OUT_OF_MEMORY:
        case CRT_DEVICE_FAILED: return ErrorKind::Device;
        default: return ErrorKind::Internal;
    }
}

/// For a plugin that says nothing itself.
const char* statusText(CrtStatus status) {
    switch (status) {
        case CRT_CANCELLED: return "cancelled";
        case CRT_INVALID_ARGUMENT: return "refused an argument";
        case CRT_NO_DEVICE: return "no usable device";
        case CRT_OUT_OF_MEMORY: return "out of memory";
        case CRT_DEVICE_FAILED: return "the device failed";
        case CRT_UNSUPPORTED: return "the scene is not supported";
        case CRT_INTERNAL: return "internal error";
        default: return "unknown status";
    }
}

}  // namespace

/// Lives on the heap and never moves: the plugin keeps the address of the host table.
struct Integrator::Impl {
    LoadedBackend backend;
    const CrtHost plain_host;  ///< Its functions report to the listener of the thread that calls them.
    CrtHost host;
    CrtIntegrator table{};
    bool created = false;

    bool has_scene = false;
    FilmShape shape;
    SampleRanges samples;  ///< In the backend's film.
    /// A cancelled or failed render leaves part of a range in the backend's film: nothing can be read until
    /// the next setScene.
    bool film_is_whole = true;

    // Of the call in progress. Plugins may report from any of their threads; the caller's function sees one
    // at a time.
    std::mutex progress_mutex;
    std::mutex caller_mutex;
    /// That of the thread which made the last call. Plugins log from any of their threads, also between
    /// calls.
    ListenerRef caller;
    const std::function<bool(double)>* progress = nullptr;
    bool cancelled = false;
    std::exception_ptr progress_error;
    std::exception_ptr kernel_error;

    Impl(const LoadedBackend& loaded, const IntegratorOptions& options)
        : backend(loaded), plain_host(makeHost(options.use_cache)), host(plain_host) {
        host.user = this;
        host.progress = onProgress;
        host.log = onLog;
        host.kernel_source = onKernelSource;

        CrtCreateInfo info{};
        info.struct_size = sizeof(info);
        info.threads = options.threads;
        info.device = options.device.c_str();
        info.kernel = options.kernel;
        info.tile_size = options.tile_size;

        // Says how much room there is; the plugin fills in its own verbs and leaves the rest alone.
        table.struct_size = sizeof(table);
        char reason[1024] = "";
        const CrtStatus status = call(
            "create", [&] { return backend.table->create(&host, &info, &table, reason, sizeof(reason)); });
        reason[sizeof(reason) - 1] = '\0';
        tellKernelError(status);
        if (status != CRT_OK) {
            throw Error(kindOf(status), fmt::format("backend '{}' cannot be used: {}", backend.name,
                                                    *reason != '\0' ? reason : statusText(status)));
        }
        created = true;
        constexpr std::size_t first_size = offsetof(CrtIntegrator, destroy) + sizeof(CrtIntegrator::destroy);
        if (table.struct_size < first_size || !table.set_scene || !table.render || !table.read_film ||
            !table.get_report || !table.last_error || !table.destroy) {
            destroy();  // a constructor that throws gets no destructor call
            throw Error(
                ErrorKind::Internal,
                fmt::format("backend '{}' broke the contract: its integrator lacks verbs", backend.name));
        }
    }

    ~Impl() { destroy(); }
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    /// Not a call(): messages of a plugin while it ends go to the maker of the last call.
    void destroy() noexcept {
        if (!std::exchange(created, false) || table.destroy == nullptr) return;
        try {
            table.destroy(table.state);
        } catch (...) {
            try {
                logWarning("backend '{}' broke the contract: an exception crossed the border from destroy",
                           backend.name);
            } catch (...) {
                // Not even that can be said; a destructor may not throw.
            }
        }
    }

    /// Calls into the plugin; what is thrown there is a bug there.
    template <class Call>
    CrtStatus call(const char* verb, Call&& body) {
        {
            const std::lock_guard lock(caller_mutex);
            caller = currentListener();
        }
        try {
            return body();
        } catch (const std::exception& error) {
            film_is_whole = false;
            throw Error(
                ErrorKind::Internal,
                fmt::format("backend '{}' broke the contract: an exception crossed the border from {} ({})",
                            backend.name, verb, error.what()));
        } catch (...) {
            film_is_whole = false;
            throw Error(
                ErrorKind::Internal,
                fmt::format("backend '{}' broke the contract: an exception crossed the border from {}",
                            backend.name, verb));
        }
    }

    void listen(const std::function<bool(double)>* listener) {
        const std::lock_guard lock(progress_mutex);
        progress = listener;
        if (listener == nullptr) return;
        cancelled = false;
        progress_error = nullptr;
    }

    /// The same, while what the plugin reports goes to `listener`.
    template <class Call>
    CrtStatus whileListening(const std::function<bool(double)>& listener, const char* verb, Call&& body) {
        listen(&listener);
        try {
            const CrtStatus status = call(verb, body);
            listen(nullptr);
            return status;
        } catch (...) {
            listen(nullptr);
            throw;
        }
    }

    /// Reason why the plugin got no kernel text, if any: thrown if the verb failed, because it is the cause,
    /// and logged if the plugin continues without the text.
    void tellKernelError(CrtStatus status) {
        std::exception_ptr error;
        {
            const std::lock_guard lock(caller_mutex);
            error = std::exchange(kernel_error, nullptr);
        }
        if (!error) return;
        if (status != CRT_OK) std::rethrow_exception(error);
        try {
            std::rethrow_exception(error);
        } catch (const std::exception& refused) {
            logMessage(LogLevel::Error, refused.what());
        }
    }

    /// Throws unless the verb succeeded, with the plugin's sentence.
    void check(CrtStatus status) {
        tellKernelError(status);
        if (status == CRT_OK) return;
        const char* sentence = nullptr;
        call("last_error", [&] {
            sentence = table.last_error(table.state);
            return CrtStatus{CRT_OK};
        });
        Error error(kindOf(status),
                    fmt::format("backend '{}': {}", backend.name,
                                sentence != nullptr && *sentence != '\0' ? sentence : statusText(status)));
        throw status == CRT_OUT_OF_MEMORY ? std::move(error).lackingMemory() : std::move(error);
    }

    /// A plugin leaves out samples that are no numbers and counts what it keeps (crt_backend.h). One pixel
    /// that is none, once in a checkpoint, would stay there for good.
    void checkContents(const Film& part) const {
        const std::uint64_t asked = part.samples.count();
        const std::size_t values = shape.channels * std::size_t{2};
        for (std::size_t pixel = 0; pixel < part.counts.size(); ++pixel) {
            const double* const sums = &part.sums[pixel * values];
            bool finite = true;  // Without a way out of the loop, so that it becomes one of vectors: films
                                 // have hundreds of millions of sums.
            for (std::size_t i = 0; i < values; ++i) finite &= std::isfinite(sums[i]);
            if (finite && part.counts[pixel] <= asked) continue;
            const std::string what =
                finite ? fmt::format("has {} samples instead of {}", part.counts[pixel], asked)
                       : "is not a number";
            throw Error(ErrorKind::Internal,
                        fmt::format("backend '{}' broke the contract: pixel {},{} of "
                                    "its film {}; the samples rendered before it are "
                                    "kept",
                                    backend.name, pixel % shape.width, pixel / shape.width, what));
        }
    }

    /// film = what the backend's film holds; when that fails, anything.
    void fill(Film& film) {
        CrtFilmView view{};
        view.struct_size = sizeof(view);
        view.width = shape.width;
        view.height = shape.height;
        view.channels = shape.channels;
        view.sums = film.sums.data();
        view.counts = film.counts.data();
        view.primitives = film.primitives.empty() ? nullptr : film.primitives.data();
        view.splats = film.splats.empty() ? nullptr : film.splats.data();
        check(call("read_film", [&] { return table.read_film(table.state, &view); }));
        film.samples = samples;
        checkContents(film);
    }

    ListenerRef lastCaller() {
        const std::lock_guard lock(caller_mutex);
        return caller;
    }
    static void onLog(void* user, CrtLogLevel level, const char* message) noexcept {
        Impl& self = *static_cast<Impl*>(user);
        const ListenerScope scope(self.lastCaller());
        self.plain_host.log(nullptr, level, message);
    }
    static const char* onKernelSource(void* user, const char* name) noexcept {
        Impl& self = *static_cast<Impl*>(user);
        const ListenerScope scope(self.lastCaller());
        try {
            return name != nullptr ? kernelSource(name) : nullptr;
        } catch (...) {
            // Must not pass through the plugin, which says only that it has no text.
            const std::lock_guard lock(self.caller_mutex);
            self.kernel_error = std::current_exception();
            return nullptr;
        }
    }
    static std::int32_t onProgress(void* user, double done) noexcept {
        Impl& self = *static_cast<Impl*>(user);
        const std::lock_guard lock(self.progress_mutex);
        // Once cancelled it stays so: a plugin's other threads must hear it too.
        if (self.progress == nullptr || self.cancelled) return self.cancelled ? 1 : 0;
        try {
            self.cancelled = *self.progress && (*self.progress)(std::clamp(done, 0.0, 1.0));
        } catch (...) {
            // Must not pass through the plugin: it waits here until render is back.
            self.progress_error = std::current_exception();
            self.cancelled = true;
        }
        return self.cancelled ? 1 : 0;
    }
};

Integrator::Integrator(const LoadedBackend& backend, const IntegratorOptions& options)
    : impl_(std::make_unique<Impl>(backend, options)) {}
Integrator::~Integrator() = default;
Integrator::Integrator(Integrator&&) noexcept = default;
Integrator& Integrator::operator=(Integrator&&) noexcept = default;

std::optional<CrtKernelChoice> kernelNamed(std::string_view word) {
    const auto found = std::find(kKernelWords.begin(), kKernelWords.end(), word);
    if (found == kKernelWords.end()) return std::nullopt;
    return static_cast<CrtKernelChoice>(found - kKernelWords.begin());
}

CompileOptions compileOptionsFor(const LoadedBackend& backend) {
    return {.accelerator_reach = acceleratorReach(backend)};
}

FilmShape filmShapeOf(const CompiledScene& compiled) {
    const kernel::CrtScene& header = compiled.header();
    return {header.width, header.height, header.channels, header.aovs, compiled.spectral_channels,
            header.splat_scale};
}

void Integrator::setScene(const CompiledScene& scene, const std::function<void(double)>& progress) {
    Impl& self = *impl_;
    const std::uint64_t lacking = scene.header().features & ~self.backend.table->features;
    if (lacking != 0) {
        throw Error(ErrorKind::Backend, fmt::format("backend '{}' cannot render this scene: it lacks {}",
                                                    self.backend.name, featureNames(lacking)));
    }
    if (scene.without_nodes && acceleratorReach(self.backend) == 0) {
        throw Error(
            ErrorKind::Internal,
            fmt::format("backend '{}' needs the BVH, and this scene was compiled without it",
                        self.backend.name));
    }
    CrtSceneBlob blob{};
    blob.struct_size = sizeof(blob);
    blob.data = scene.data();
    blob.size_bytes = scene.size_bytes;

    self.has_scene = false;
    const std::function<bool(double)> show = [&progress](double done) {
        if (progress) progress(done);
        return false;  // A scene is always set as a whole.
    };
    const CrtStatus status = self.whileListening(
        show, "set_scene", [&] { return self.table.set_scene(self.table.state, &blob); });
    if (self.progress_error) std::rethrow_exception(std::exchange(self.progress_error, nullptr));
    self.check(status);
    self.shape = filmShapeOf(scene);
    self.samples = {};
    self.film_is_whole = true;
    self.has_scene = true;
}

bool Integrator::render(const RenderRange& range, const std::function<bool(double)>& progress) {
    Impl& self = *impl_;
    if (!self.has_scene) throw Error(ErrorKind::Internal, "render was called before setScene");
    if (!self.film_is_whole)
        throw Error(ErrorKind::Internal,
                    "render was called after a cancelled or failed one without setScene between");
    if (range.sample_count > std::numeric_limits<std::uint64_t>::max() - range.first_sample) {
        throw Error(ErrorKind::Usage, fmt::format("{} samples from sample {} exceed 64 bits",
                                                  range.sample_count, range.first_sample));
    }
    if (range.sample_count == 0) return true;
    SampleRanges samples = self.samples;
    samples.add({range.first_sample, range.first_sample + range.sample_count});

    CrtRenderRange request{};
    request.struct_size = sizeof(request);
    request.x1 = self.shape.width;
    request.y1 = self.shape.height;
    request.first_sample = range.first_sample;
    request.sample_count = range.sample_count;

    self.film_is_whole = false;  // until the range is in it as a whole
    const CrtStatus status = self.whileListening(
        progress, "render", [&] { return self.table.render(self.table.state, &request); });
    if (self.progress_error) std::rethrow_exception(std::exchange(self.progress_error, nullptr));
    if (status == CRT_CANCELLED && self.cancelled) return false;
    self.check(status);
    self.samples = std::move(samples);
    self.film_is_whole = true;
    // Asked to stop just as the last sample was done: the range is complete and counts.
    return true;
}

void Integrator::readFilm(Film& film) {
    Impl& self = *impl_;
    if (!self.has_scene) throw Error(ErrorKind::Internal, "readFilm was called before setScene");
    if (!self.film_is_whole)
        throw Error(ErrorKind::Internal,
                    "the film holds part of a cancelled or failed range and cannot be read");
    const FilmShape &shape = film.shape(), &own = self.shape;
    if (shape.width != own.width || shape.height != own.height || shape.channels != own.channels ||
        ((shape.aovs ^ own.aovs) & (kAovPrimitive | kAovSplats)) != 0) {
        throw Error(ErrorKind::Internal, "readFilm got a film whose shape differs from the scene's");
    }

    if (film.samples.count() > 0) {
        Film part(shape);
        self.fill(part);
        film.add(part);
        return;
    }
    // Films are large: into an empty one nothing need be added, so it is filled where it lies.
    try {
        self.fill(film);
    } catch (...) {
        film = Film(shape);
        throw;
    }
}

CrtBackendReport Integrator::report() {
    Impl& self = *impl_;
    CrtBackendReport report{};
    report.struct_size = sizeof(report);
    self.check(self.call("get_report", [&] { return self.table.get_report(self.table.state, &report); }));
    report.device[sizeof(report.device) - 1] = '\0';
    report.kernel[sizeof(report.kernel) - 1] = '\0';
    return report;
}

}  // namespace crt
