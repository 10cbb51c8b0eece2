/// One device of a backend, or several, at work on one scene.
#pragma once

#include "backend/integrator.h"
#include "base/error.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace crt {

/// Result of one device of a group.
struct DeviceShare {
    std::string selector;       ///< As --device names it, of several its index: equal GPUs have one name.
    std::string name;           ///< Empty until the device is open.
    std::uint64_t samples = 0;  ///< Per pixel, that it added to the film.
    double seconds = 0;         ///< In its render calls.
    std::string failure;        ///< Reason why it was dropped; empty while it works.
};

/// The members of `devices` that --device selects: "all", indices as "0,2", or else one, as it stands, which
/// the backend itself looks up. Throws crt::Error(Usage) for an index that is there twice or not at all.
std::vector<std::string> devicesNamed(const std::string& text, const std::vector<CrtDevice>& devices);

/// The verbs of an Integrator for all devices together.
///
/// Each device adds sample ranges to its own film, as many as its speed allows, and films merge
/// exactly: which device rendered what never shows in the image. A device that fails is dropped, with a
/// warning, and the others render again what only its own memory had. Errors of the kind Device are thrown
/// when the last one has failed, all others at once. [owner thread]
class DeviceGroup {
public:
    /// Opens them. Of "all", those that cannot be opened are left out with a warning.
    DeviceGroup(const LoadedBackend& backend, const IntegratorOptions& options,
                const std::vector<CrtDevice>& devices);
    ~DeviceGroup();
    DeviceGroup(const DeviceGroup&) = delete;
    DeviceGroup& operator=(const DeviceGroup&) = delete;

    /// Integrator::setScene. `progress` gets [0,1]. A device that has no room for the scene is left out
    /// until the next; when none has, the error says so (Error::lacksMemory).
    void setScene(const CompiledScene& scene, const std::function<void(double)>& progress = {});
    /// The same scene once more, with another window of its film: what devices have done by now still
    /// counts in shares() and report(), and what was not read is lost.
    void setWindow(const CompiledScene& scene);
    /// Divides a range among the devices. `progress` gets [0,1].
    void render(const RenderRange& range, const std::function<void(double)>& progress = {});
    /// Adds what all films hold to `film`, as Integrator::readFilm does. With several devices the host keeps
    /// a copy of each one's film, so that the samples of a device that fails later are not lost.
    void readFilm(Film& film);

    /// Of all devices together: counts are sums, times those of the slowest.
    CrtBackendReport report();
    /// In the order in which they were named; also those that were dropped.
    std::vector<DeviceShare> shares() const;

private:
    struct Member;
    struct Assignment;

    std::vector<Member*> working();
    void loadScene(const CompiledScene& scene, const std::function<void(double)>& progress);
    void readmitThoseWithoutRoom();
    void inParallel(const std::vector<Member*>& members, const std::function<void(Member&)>& work,
                    bool may_fail = true);
    std::vector<Assignment> divide(std::vector<RenderRange> ranges);
    std::vector<RenderRange> collectLost();
    void renderAll(std::vector<RenderRange> ranges, const std::function<void(double)>& progress);

    std::vector<std::unique_ptr<Member>> members_;
    std::optional<Error> last_failure_;
    std::uint64_t window_pixels_ = 0, film_pixels_ = 1;  ///< Of the scene that is set, and of all of it.
};

}  // namespace crt
