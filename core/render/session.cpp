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
    if (!group_) throw Error(ErrorKind::Internal, "the session has not opened this device");
    return *group_;
}

CompiledScene Session::compile(const Scene& scene, std::uint32_t aovs) const {
    return compileScene(scene, aovs, compileOptionsFor(backend_));
}

void Session::setScene(const CompiledScene& compiled, const std::function<void(double)>& progress) {
    openDevice();
    shape_.reset();
    group_->setScene(compiled, progress);
    shape_ = filmShapeOf(compiled);
}

void Session::render(const RenderRange& range, const std::function<void(double)>& progress) {
    group().render(range, progress);
}

Film Session::film() {
    if (!shape_) throw Error(ErrorKind::Internal, "a session without a scene has no film");
    Film film(*shape_);
    group_->readFilm(film);
    return film;
}

Film renderFilm(Session& session, const Scene& scene, const FilmRequest& request,
                const std::function<void(double)>& progress) {
    session.setScene(session.compile(scene, request.aovs));
    session.render({.first_sample = request.first_sample, .sample_count = request.samples}, progress);
    return session.film();
}

}  // namespace crt
