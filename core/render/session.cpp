#include "render/session.h"

#include "base/error.h"
#include "base/listener.h"

#include <utility>

namespace crt {

Session::Session(const std::string& backend, const IntegratorOptions& options)
    : Session(openBackend(backend), options) {}

Session::Session(LoadedBackend backend, const IntegratorOptions& options)
    : backend_(std::move(backend)), options_(options) {}

Session::Opened Session::open(const LoadedBackend& backend, const IntegratorOptions& options) {
    Opened opened;
    opened.devices = probeDevices(backend);  // Says better than a failing create() why there is none.
    opened.group = std::make_unique<DeviceGroup>(backend, options, opened.devices);
    return opened;
}

void Session::beginOpeningDevice() {
    if (group_ || opening_.valid()) return;
    // Of copies: a session may be moved meanwhile.
    opening_ = std::async(std::launch::async,
                          [backend = backend_, options = options_, listener = currentListener()] {
                              const ListenerScope scope(listener);
                              return open(backend, options);
                          });
}

void Session::openDevice() {
    if (group_) return;
    Opened opened = opening_.valid() ? opening_.get() : open(backend_, options_);
    devices_ = std::move(opened.devices);
    group_ = std::move(opened.group);
}

DeviceGroup& Session::group() {
    if (!group_) throw Error(ErrorKind::Internal, "a session is asked for a device that is not open");
    return *group_;
}

CompiledScene Session::compile(const Scene& scene, std::uint32_t aovs) const {
    return compileScene(scene, aovs, compileOptionsFor(backend_));
}

Film renderFilm(Session& session, const Scene& scene, const FilmRequest& request,
                const std::function<void(double)>& progress) {
    session.openDevice();
    const CompiledScene compiled = session.compile(scene, request.aovs);
    DeviceGroup& devices = session.group();
    devices.setScene(compiled);
    devices.render({.first_sample = request.first_sample, .sample_count = request.samples}, progress);
    Film film(filmShapeOf(compiled));
    devices.readFilm(film);
    return film;
}

}  // namespace crt
