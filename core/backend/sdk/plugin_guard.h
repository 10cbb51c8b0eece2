/// plugin_guard.h: writing a backend as a C++ class. Header-only; belongs to the plugin's side of the
/// border.
///
///     class MyIntegrator {
///     public:
///         MyIntegrator(const crt::plugin::Host& host, const CrtCreateInfo& info);  // opens the device
///         void setScene(const CrtSceneBlob& scene);       // copies what it needs, clears the film
///         bool render(const CrtRenderRange& range);       // adds to the film; false: the host cancelled
///         void readFilm(const CrtFilmView& film);
///         void report(CrtBackendReport& report);          // all zero when it comes in
///     };
///     std::vector<CrtDevice> probeDevices(const crt::plugin::Host& host);
///
///     CRT_DEFINE_BACKEND(MyIntegrator, probeDevices, "mine", "1.0.0", CRT_FEATURES_ALL)
///
/// An integrator with an acceleration structure of its own says so, and gets no BVH in scenes whose rays all
/// start within reach (CRT_BRINGS_ACCELERATOR):
///
///         static constexpr double kAcceleratorReach = 4;
///
/// Any of these may throw: PluginError for a failure with its own status and sentence, std::bad_alloc, or
/// anything. The table made here turns every exception into a status and a message, so that none crosses the
/// border. It also looks after struct_size in both directions: the class always sees whole structs of the
/// headers it was compiled with, and the host's are never overrun. And the class only sees calls that make
/// sense: setScene with a blob that begins with a scene, render of a rectangle within that scene's film,
/// readFilm into a view of its size.
#pragma once

#include "backend/crt_backend.h"
#include "backend/crt_layout_hash.h"
#include "kernel/dialect/bits_version.h"
#include "kernel/dialect/layout.h"

#include <algorithm>
#include <cfenv>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <new>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

/// True if the writer of the sized struct `*pointer` knew `member`.
#define CRT_HAS_MEMBER(pointer, member)                                                     \
    ((pointer)->struct_size >=                                                              \
        offsetof(std::remove_cv_t<std::remove_reference_t<decltype(*(pointer))>>, member) + \
                                   sizeof((pointer)->member))

/// Compiler of this translation unit, for CrtBackend::build.
#if defined(__clang__)
#define CRT_COMPILER_TEXT __VERSION__
#else
#define CRT_COMPILER_TEXT "g++ " __VERSION__
#endif

namespace crt::plugin {

/// A failure that the plugin can name. The sentence is for the user: no final full stop, no newline.
class PluginError : public std::exception {
public:
    PluginError(CrtStatus status, std::string sentence) : status_(status), sentence_(std::move(sentence)) {}
    CrtStatus status() const noexcept { return status_; }
    const char* what() const noexcept override { return sentence_.c_str(); }

private:
    CrtStatus status_;
    std::string sentence_;
};

/// Copies `text` into a fixed buffer, NUL-terminated; what does not fit is cut between characters, not
/// within one.
inline void writeText(char* buffer, std::size_t size, const char* text) noexcept {
    if (buffer == nullptr || size == 0) return;
    std::size_t length = std::strlen(text);
    if (length >= size) {
        length = size - 1;
        while (length > 0 && (static_cast<unsigned char>(text[length]) & 0xc0u) == 0x80u) --length;
    }
    std::memcpy(buffer, text, length);
    buffer[length] = '\0';
}
template <std::size_t N>
void writeText(char (&buffer)[N], const std::string& text) noexcept {
    writeText(buffer, N, text.c_str());
}

/// Size of each struct in the first minor revision of this ABI: a smaller one breaks the contract.
template <class T> constexpr std::size_t kFirstSize = 0;
template <>
inline constexpr std::size_t kFirstSize<CrtHost> = offsetof(CrtHost, kernel_source) +
                                                   sizeof(CrtHost::kernel_source);
template <>
inline constexpr std::size_t kFirstSize<CrtDevice> = offsetof(CrtDevice, score) + sizeof(CrtDevice::score);
template <>
inline constexpr std::size_t kFirstSize<CrtCreateInfo> = offsetof(CrtCreateInfo, tile_size) +
                                                         sizeof(CrtCreateInfo::tile_size);
template <>
inline constexpr std::size_t kFirstSize<CrtSceneBlob> = offsetof(CrtSceneBlob, size_bytes) +
                                                        sizeof(CrtSceneBlob::size_bytes);
template <> inline constexpr std::size_t kFirstSize<CrtRenderRange> =
    offsetof(CrtRenderRange, sample_count) + sizeof(CrtRenderRange::sample_count);
template <>
inline constexpr std::size_t kFirstSize<CrtFilmView> = offsetof(CrtFilmView, primitives) +
                                                       sizeof(CrtFilmView::primitives);
template <> inline constexpr std::size_t kFirstSize<CrtBackendReport> =
    offsetof(CrtBackendReport, spill_bytes) + sizeof(CrtBackendReport::spill_bytes);
template <>
inline constexpr std::size_t kFirstSize<CrtIntegrator> = offsetof(CrtIntegrator, destroy) +
                                                         sizeof(CrtIntegrator::destroy);

template <class T>
void requireSized(const T* from_host, const char* what) {
    if (from_host == nullptr) throw PluginError(CRT_INVALID_ARGUMENT, std::string(what) + " is null");
    if (from_host->struct_size < kFirstSize<T>) {
        throw PluginError(CRT_INVALID_ARGUMENT, std::string(what) + " has struct_size " +
                                                    std::to_string(from_host->struct_size) +
                                                    ", too small for any revision of this ABI");
    }
}

/// The host's struct as this plugin knows it: members that the host does not have are zero, those that only
/// the host has are dropped.
template <class T>
T readSized(const T* from_host, const char* what) {
    requireSized(from_host, what);
    T copy{};
    std::memcpy(static_cast<void*>(&copy), from_host,
                std::min<std::size_t>(from_host->struct_size, sizeof(T)));
    copy.struct_size = static_cast<std::uint32_t>(sizeof(T));
    return copy;
}

/// The other way: fills the host's struct as far as both sides know it, and says in struct_size how far that
/// is.
template <class T>
void writeSized(T* to_host, const T& value) noexcept {
    const std::size_t size = std::min<std::size_t>(to_host->struct_size, sizeof(T));
    std::memcpy(static_cast<void*>(to_host), &value, size);
    to_host->struct_size = static_cast<std::uint32_t>(size);
}

/// Functions of the host. Cheap to copy; valid as long as the integrators created with it.
class Host {
public:
    explicit Host(const CrtHost* table) : table_(table) { requireSized(table, "the host table"); }

    /// One line for the user's log. [any thread]
    void log(CrtLogLevel level, const std::string& line) const noexcept {
        if (table_->log != nullptr) table_->log(table_->user, level, line.c_str());
    }
    /// Reports `done` in [0,1] of the running render. True: the host wants it stopped. [any thread]
    bool cancelled(double done) const noexcept {
        return table_->progress != nullptr && table_->progress(table_->user, done) != 0;
    }
    /// Null when caching is off.
    const char* cacheDirectory() const noexcept { return table_->cache_directory; }
    /// Text of a kernel header with its includes expanded. Throws PluginError when the host has none of that
    /// name.
    const char* kernelSource(const char* name) const {
        const char* text =
            table_->kernel_source != nullptr ? table_->kernel_source(table_->user, name) : nullptr;
        if (text == nullptr)
            throw PluginError(CRT_INTERNAL, std::string("the host has no kernel source named ") + name);
        return text;
    }

private:
    const CrtHost* table_;
};

/// A device as probe() lists it.
inline CrtDevice makeDevice(std::uint32_t index, const std::string& name, const std::string& driver,
                            std::uint64_t memory_bytes, double score) {
    CrtDevice device{};
    device.struct_size = sizeof(CrtDevice);
    device.index = index;
    writeText(device.name, name);
    writeText(device.driver, driver);
    device.memory_bytes = memory_bytes;
    device.score = score;
    return device;
}

/// The rounding mode and treatment of subnormals that the kernel is written for, whatever the host's thread
/// has set; put back at the end.
class DefaultFloatEnvironment {
public:
    DefaultFloatEnvironment() noexcept {
        std::fegetenv(&hosts_);
        std::fesetenv(FE_DFL_ENV);
    }
    ~DefaultFloatEnvironment() { std::fesetenv(&hosts_); }
    DefaultFloatEnvironment(const DefaultFloatEnvironment&) = delete;
    DefaultFloatEnvironment& operator=(const DefaultFloatEnvironment&) = delete;

private:
    std::fenv_t hosts_;
};

/// Runs `body`, which returns a status, and lets no exception out: its text goes to `text`, its kind becomes
/// the status.
template <class Body>
CrtStatus guarded(char* text, std::size_t text_size, Body&& body) noexcept {
    const DefaultFloatEnvironment environment;
    try {
        return body();
    } catch (const PluginError& error) {
        writeText(text, text_size, error.what());
        // An error that claims success would be lost.
        return error.status() == CRT_OK ? CRT_INTERNAL : error.status();
    } catch (const std::bad_alloc&) {
        writeText(text, text_size, "out of host memory");
        return CRT_OUT_OF_MEMORY;
    } catch (const std::exception& error) {
        writeText(text, text_size, error.what());
        return CRT_INTERNAL;
    } catch (...) {
        writeText(text, text_size, "an exception of unknown type was thrown");
        return CRT_INTERNAL;
    }
}

/// The verbs of CrtIntegrator for the class `I`. The host's CrtIntegratorState is an object of this class.
template <class I>
class IntegratorVerbs {
public:
    static CrtStatus create(const CrtHost* host, const CrtCreateInfo* info, CrtIntegrator* integrator,
                            char* reason, std::uint32_t reason_size) noexcept {
        return guarded(reason, reason_size, [&] {
            requireSized(integrator, "the integrator to fill");
            const Host face(host);
            auto* self = new IntegratorVerbs(face, readSized(info, "the create info"));
            CrtIntegrator table{};
            table.struct_size = sizeof(CrtIntegrator);
            table.state = reinterpret_cast<CrtIntegratorState*>(self);
            table.set_scene = setScene;
            table.render = render;
            table.read_film = readFilm;
            table.get_report = getReport;
            table.last_error = lastError;
            table.destroy = destroy;
            writeSized(integrator, table);
            return CrtStatus{CRT_OK};
        });
    }

private:
    IntegratorVerbs(const Host& host, const CrtCreateInfo& info) : integrator_(host, info) {}

    static IntegratorVerbs& from(CrtIntegratorState* state) noexcept {
        return *reinterpret_cast<IntegratorVerbs*>(state);
    }

    template <class Body>
    static CrtStatus verb(CrtIntegratorState* state, Body&& body) noexcept {
        if (state == nullptr) return CRT_INVALID_ARGUMENT;
        IntegratorVerbs& self = from(state);
        self.error_[0] = '\0';
        return guarded(self.error_, sizeof(self.error_), [&]() -> CrtStatus { return body(self); });
    }

    static CrtStatus setScene(CrtIntegratorState* state, const CrtSceneBlob* scene) noexcept {
        return verb(state, [&](IntegratorVerbs& self) {
            const CrtSceneBlob blob = readSized(scene, "the scene");
            if (blob.data == nullptr || reinterpret_cast<std::uintptr_t>(blob.data) % 64 != 0) {
                throw PluginError(CRT_INVALID_ARGUMENT,
                                  "the scene's data is null or not aligned to 64 bytes");
            }
            const auto& header = *static_cast<const kernel::CrtScene*>(blob.data);
            if (blob.size_bytes < sizeof header || header.magic != CRT_SCENE_MAGIC) {
                throw PluginError(CRT_INVALID_ARGUMENT, "the scene blob does not begin with a scene");
            }
            self.film_ = FilmShape{};  // until the integrator has the new scene as a whole
            self.integrator_.setScene(blob);
            self.film_ = {header.width, header.height, header.channels,
                          (header.aovs & CRT_AOV_PRIMITIVE) != 0, (header.aovs & CRT_AOV_SPLATS) != 0};
            return CRT_OK;
        });
    }
    static CrtStatus render(CrtIntegratorState* state, const CrtRenderRange* range) noexcept {
        return verb(state, [&](IntegratorVerbs& self) {
            const CrtRenderRange r = readSized(range, "the range");
            if (self.film_.channels == 0)
                throw PluginError(CRT_INVALID_ARGUMENT, "render was called before set_scene");
            if (r.x0 > r.x1 || r.y0 > r.y1 || r.x1 > self.film_.width || r.y1 > self.film_.height) {
                throw PluginError(CRT_INVALID_ARGUMENT, "the range's rectangle is not within the film");
            }
            return self.integrator_.render(r) ? CRT_OK : CRT_CANCELLED;
        });
    }
    static CrtStatus readFilm(CrtIntegratorState* state, const CrtFilmView* film) noexcept {
        return verb(state, [&](IntegratorVerbs& self) {
            const CrtFilmView view = readSized(film, "the film view");
            if (view.sums == nullptr || view.counts == nullptr) {
                throw PluginError(CRT_INVALID_ARGUMENT, "the film view has no sums or no counts");
            }
            if (self.film_.channels == 0)
                throw PluginError(CRT_INVALID_ARGUMENT, "read_film was called before set_scene");
            if (view.width != self.film_.width || view.height != self.film_.height ||
                view.channels != self.film_.channels) {
                throw PluginError(CRT_INVALID_ARGUMENT, "the size of the film view differs from the "
                                                        "scene's");
            }
            if (view.primitives != nullptr && !self.film_.primitives) {
                throw PluginError(CRT_INVALID_ARGUMENT,
                                  "the film view has primitives, but the scene does not request them");
            }
            if ((view.splats != nullptr) != self.film_.splats) {
                throw PluginError(CRT_INVALID_ARGUMENT,
                                  "the film view must have splats where the scene does, and nowhere else");
            }
            self.integrator_.readFilm(view);
            return CRT_OK;
        });
    }
    static CrtStatus getReport(CrtIntegratorState* state, CrtBackendReport* report) noexcept {
        return verb(state, [&](IntegratorVerbs& self) {
            requireSized(report, "the report to fill");
            CrtBackendReport full{};
            full.struct_size = sizeof(CrtBackendReport);
            self.integrator_.report(full);
            full.struct_size = sizeof(CrtBackendReport);
            writeSized(report, full);
            return CRT_OK;
        });
    }
    static const char* lastError(CrtIntegratorState* state) noexcept {
        return state != nullptr ? from(state).error_ : "no integrator";
    }
    static void destroy(CrtIntegratorState* state) noexcept {
        // A destructor that throws ends the process (noexcept): no caller is left to receive it.
        if (state != nullptr) delete &from(state);
    }

    /// Of the scene that the integrator has; no channels before there is one.
    struct FilmShape {
        std::uint32_t width = 0, height = 0, channels = 0;
        bool primitives = false, splats = false;
    };

    I integrator_;
    FilmShape film_;
    char error_[1024] = {};  // fixed, so that "out of memory" needs no memory
};

/// probe() over a function that returns the devices; none is CRT_NO_DEVICE.
template <std::vector<CrtDevice> (*List)(const Host&)>
CrtStatus probe(const CrtHost* host, CrtDevice* devices, std::uint32_t capacity, std::uint32_t* count,
                char* reason, std::uint32_t reason_size) noexcept {
    return guarded(reason, reason_size, [&]() -> CrtStatus {
        if (count == nullptr || (devices == nullptr && capacity != 0)) {
            throw PluginError(CRT_INVALID_ARGUMENT, "probe was called without memory for its result");
        }
        *count = 0;
        const std::vector<CrtDevice> found = List(Host(host));
        if (found.empty()) throw PluginError(CRT_NO_DEVICE, "no device found");
        if (capacity != 0) requireSized(devices, "the device to fill");
        // The host's CrtDevice may be longer or shorter than ours: its size is the stride of its array.
        const std::size_t stride = capacity != 0 ? devices->struct_size : 0;
        for (std::size_t i = 0; i < found.size() && i < capacity; ++i) {
            auto* slot = reinterpret_cast<CrtDevice*>(reinterpret_cast<char*>(devices) + i * stride);
            slot->struct_size = static_cast<std::uint32_t>(stride);
            writeSized(slot, found[i]);
        }
        *count = static_cast<std::uint32_t>(found.size());
        return CRT_OK;
    });
}

/// I::kAcceleratorReach; 0 for a class that has none.
template <class I, class = void>
constexpr double kAcceleratorReachOf = 0;
template <class I>
inline constexpr double kAcceleratorReachOf<I, std::void_t<decltype(I::kAcceleratorReach)>> =
    I::kAcceleratorReach;

/// The table of a backend whose integrator is the class `I`.
template <class I, std::vector<CrtDevice> (*List)(const Host&)>
constexpr CrtBackend makeBackend(const char* name, const char* version, const char* build,
                                 std::uint64_t features) noexcept {
    CrtBackend table{};
    table.struct_size = sizeof(CrtBackend);
    table.abi_major = CRT_ABI_MAJOR;
    table.abi_minor = CRT_ABI_MINOR;
    table.layout_hash = CRT_LAYOUT_HASH;
    table.name = name;
    table.version = version;
    table.build = build;
    table.features = features;
    table.probe = probe<List>;
    table.create = IntegratorVerbs<I>::create;
    table.bits_version = CRT_BITS_VERSION;
    table.brings = kAcceleratorReachOf<I> > 0 ? CRT_BRINGS_ACCELERATOR : 0;
    table.accelerator_reach = kAcceleratorReachOf<I>;
    return table;
}

/// The device that --device selects: "" or null the best score, digits an index, else the first (best) whose
/// name holds the text, in upper or lower case. Throws PluginError(CRT_NO_DEVICE) that lists what there is.
inline const CrtDevice& chooseDevice(const std::vector<CrtDevice>& devices, const char* wanted) {
    const std::string text = wanted != nullptr ? wanted : "";
    const bool is_index = !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
    const auto lower = [](std::string s) {
        // ASCII only, and the same in every locale.
        for (char& c : s) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
        return s;
    };
    const CrtDevice* best = nullptr;
    for (const CrtDevice& device : devices) {
        const bool matches =
            text.empty() || (is_index ? std::to_string(device.index) == text
                                      : lower(device.name).find(lower(text)) != std::string::npos);
        if (matches && (best == nullptr || device.score > best->score)) best = &device;
    }
    if (best != nullptr) return *best;
    if (devices.empty()) throw PluginError(CRT_NO_DEVICE, "no device found");
    std::string list;
    for (const CrtDevice& device : devices) {
        list += (list.empty() ? "" : ", ") + std::to_string(device.index) + " '" + device.name + "'";
    }
    throw PluginError(CRT_NO_DEVICE, "no device matches '" + text + "'; there is " + list);
}

}  // namespace crt::plugin

/// Defines the entry symbol of the library. `features` is the mask of kernel/dialect/features.h that the
/// backend can run.
#define CRT_DEFINE_BACKEND(Integrator, list_devices, name, version, features) \
    CRT_DEFINE_BACKEND_BUILT_WITH(Integrator, list_devices, name, version, CRT_COMPILER_TEXT, features)

/// The same with a text about compiler and libraries, such as CRT_COMPILER_TEXT ", Embree 3.13.5".
#define CRT_DEFINE_BACKEND_BUILT_WITH(Integrator, list_devices, name, version, build, features)      \
    extern "C" CRT_EXPORT const CrtBackend* crt_backend_v1(void) {                                   \
        static constexpr CrtBackend table = crt::plugin::makeBackend<Integrator, list_devices>(name, \
            version, build, features);                                                               \
        return &table;                                                                               \
    }
