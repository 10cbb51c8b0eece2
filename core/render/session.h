/// An open backend with its devices. Everything in crt that renders has one.
#pragma once

#include "backend/device_group.h"
#include "backend/integrator.h"
#include "backend/loader.h"
#include "compile/compile.h"
#include "film/film.h"
#include "scene/scene.h"

#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <vector>

namespace crt {

/// Opens a backend and its devices once, for one scene after another. Sessions share nothing: each thread
/// may have its own. Throws crt::Error as Integrator does.
class Session {
public:
    /// Loads the plugin: a name, a path, or "auto".
    explicit Session(const std::string& backend, const IntegratorOptions& options = {});
    explicit Session(LoadedBackend backend, const IntegratorOptions& options = {});

    const LoadedBackend& backend() const { return backend_; }

    /// Opens the device, or the devices, unless they are open.
    void openDevice();
    /// Begins to, on a thread of its own, and returns at once: opening a driver takes as long as compiling a
    /// scene. What goes wrong is thrown by openDevice().
    void beginOpeningDevice();
    /// Of the backend, best first. Requires openDevice().
    const std::vector<CrtDevice>& devices() const { return devices_; }

    /// Without what this backend brings itself.
    CompiledScene compile(const Scene& scene, std::uint32_t aovs = 0) const;

    /// The devices, which render. Requires openDevice().
    DeviceGroup& group();
    CrtBackendReport report() { return group().report(); }

private:
    struct Opened {
        std::vector<CrtDevice> devices;
        std::unique_ptr<DeviceGroup> group;
    };
    static Opened open(const LoadedBackend& backend, const IntegratorOptions& options);

    LoadedBackend backend_;
    IntegratorOptions options_;
    std::vector<CrtDevice> devices_;
    std::unique_ptr<DeviceGroup> group_;
    std::future<Opened> opening_;  ///< Last: its end is waited for first.
};

/// One range of samples of one scene.
struct FilmRequest {
    std::uint64_t samples = 0;       ///< Per pixel.
    std::uint64_t first_sample = 0;
    std::uint32_t aovs = 0;          ///< Bits of Aov.
};

/// Compiles, sets the scene, renders the range as one, reads the film.
Film renderFilm(Session& session, const Scene& scene, const FilmRequest& request,
                const std::function<void(double)>& progress = {});

}  // namespace crt
