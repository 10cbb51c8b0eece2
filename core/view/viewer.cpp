#include "view/viewer.h"

#include "base/error.h"
#include "base/log.h"
#include "render/light_checks.h"
#include "scene/aov.h"
#include "view/http_server.h"
#include "view/planes.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

namespace crt {
namespace {

RenderRequest requestOf(const ViewOptions& options) {
    RenderRequest request;
    request.samples = options.samples;
    request.backend = options.backend;
    request.integrator = options.integrator;
    return request;
}

std::unique_ptr<TevSender> tevOf(const ViewOptions& options, ViewState& state) {
    if (!options.tev) return nullptr;
    const std::string name = std::filesystem::path(options.scene.file).filename().string();
    return std::make_unique<TevSender>(*options.tev, name, state);
}

/// AOVs that each film holds: the surface that a pixel shows, and its distance if a lens can be focused on
/// it.
std::uint32_t basicAovs(const Scene& scene) {
    return kAovPrimitive | (scene.camera.aperture_radius > 0 ? kAovDepth : 0u);
}

}  // namespace

Viewer::Viewer(const ViewOptions& options)
    : outer_(currentListener()),
      file_stem_(std::filesystem::path(options.scene.file).stem().string()),
      listener_(
          [this](LogLevel level, std::string_view message) { hear(level, message); }, LogLevel::Debug,
          [this](const std::string& what) { state_.update([&](Status& status) { status.stage = what; }); }),
      scope_(listener_),
      tev_(tevOf(options, state_)),
      developer_(state_, options.integrator.threads),
      renderer_(requestOf(options), state_,
                [this](Snapshot snapshot) {
                    if (tev_) tev_->take(snapshot);
                    developer_.take(std::move(snapshot));
                }),
      source_(options.scene, state_, [this](auto scene) { takeScene(std::move(scene)); }) {
    state_.update([&, program = randomToken()](Status& status) {
        status.file = options.scene.file;
        status.program = program;
    });
}

Viewer::~Viewer() { stop(); }

void Viewer::stop() {
    state_.close();
    renderer_.stop();
}

void Viewer::hear(LogLevel level, std::string_view message) {
    {
        const ListenerScope scope(outer_);
        logMessage(level, message);
    }
    if (level != LogLevel::Warning) return;
    constexpr std::size_t kMostWarnings = 20;
    state_.update([&](Status& status) {
        std::vector<std::string>& all = status.warnings;
        if (all.size() < kMostWarnings && std::find(all.begin(), all.end(), message) == all.end())
            all.emplace_back(message);
    });
}

void Viewer::takeScene(std::shared_ptr<const Scene> scene) {
    warnOfMissingLight(*scene);
    const std::lock_guard lock(mutex_);
    // A camera that hands have moved stays, unless the file has another one now.
    if (!scene_ || !(poseOf(scene_->camera) == poseOf(scene->camera))) pose_ = poseOf(scene->camera);
    scene_ = std::move(scene);
    Display display = developer_.display();
    const std::vector<std::string> whites = whiteNames(*scene_);
    const bool kelvin = display.white.ends_with(" K");
    if (!kelvin && std::find(whites.begin(), whites.end(), display.white) == whites.end()) {
        logWarning("the scene no longer has the light '{}': the image uses the scene's own white balance",
                   display.white);
        display.white = "scene";
        developer_.setDisplay(display);
    }
    renderer_.request([&](RenderRequest& request) {
        request.scene = scene_;
        request.pose = pose_;
        request.aovs = basicAovs(*scene_) | aovs_;
        tellSettings(request);
    });
}

void Viewer::change(const ChangeRequest& request) {
    const std::lock_guard ordered(order_mutex_);
    std::string refusals;
    for (std::size_t i = 0; i < request.changes.size(); ++i) {
        if (!request.page.empty() && !taken_.take(request.page, request.first + i)) continue;
        const RequestedChange& one = request.changes[i];
        std::string refusal = one.refusal;
        try {
            if (refusal.empty()) changeOnce(one.change);
        } catch (const Error& error) {
            refusal = error.what();
        }
        if (!refusal.empty()) refusals += (refusals.empty() ? "" : "\n") + refusal;
    }
    if (!refusals.empty()) throw Error(ErrorKind::Usage, refusals);
}

void Viewer::changeOnce(const ViewChange& change) {
    const std::lock_guard lock(mutex_);
    const bool of_camera = change.orbit || change.pan || change.dolly || change.focus || change.fov_deg ||
                           change.zoom;
    const bool of_display = change.exposure_ev || change.exposure_step || change.white || change.plane;
    if (!scene_ && (of_camera || of_display))
        throw Error(ErrorKind::Usage, "there is no scene yet");
    // Both may refuse.
    const CameraPose pose = poseAfter(change);
    const Display display = displayAfter(change);
    pose_ = pose;
    // Once looked at, the planes stay in the film: looking at another needs no other render.
    if (aovsOfPlane(display.plane) & kAovsOfFirstHits) aovs_ = kAovsOfFirstHits;
    if (!(display == developer_.display())) developer_.setDisplay(display);
    renderer_.request([&](RenderRequest& request) {
        if (change.paused) request.paused = *change.paused;
        if (change.toggle_paused) request.paused = !request.paused;
        if (change.samples) request.samples = *change.samples;
        if (change.backend) request.backend = *change.backend;
        if (change.backend || change.device) request.integrator.device = change.device.value_or("");
        request.pose = pose_;
        if (scene_) request.aovs = basicAovs(*scene_) | aovs_;
        tellSettings(request);
    });
}

namespace {

/// Throws for a camera so close to its target, or so far from it, compared with the scene's own camera, that
/// its directions would be rounding errors.
void requireReach(const CameraPose& pose, const Camera& camera) {
    constexpr double kMost = 1e9;
    const double own = length(camera.target - camera.position), now = length(pose.target - pose.position),
                 moved = length(pose.target - camera.target);
    if (!(now <= kMost * own && now * kMost >= own && moved <= kMost * own))
        throw Error(ErrorKind::Usage, "the camera goes no farther");
}

}  // namespace

CameraPose Viewer::poseAfter(const ViewChange& change) const {
    CameraPose pose = change.reset_camera && scene_ ? poseOf(scene_->camera) : pose_;
    if (change.focus) pose.focus_distance = focusAt(*change.focus);
    if (change.orbit) orbit(pose, (*change.orbit)[0], (*change.orbit)[1]);
    if (change.pan) pan(pose, withPose(scene_->camera, pose), (*change.pan)[0], (*change.pan)[1]);
    if (change.dolly) dolly(pose, *change.dolly);
    if (change.fov_deg) setFov(pose, scene_->camera, *change.fov_deg);
    if (change.zoom) zoom(pose, scene_->camera, *change.zoom);
    if (scene_) requireReach(pose, scene_->camera);
    return pose;
}

/// The focus distance that makes what lies there sharp.
double Viewer::focusAt(const std::array<double, 2>& place) const {
    if (scene_->camera.aperture_radius <= 0)
        throw Error(ErrorKind::Usage, "the camera is a pinhole without an aperture: everything is in focus");
    const std::optional<Snapshot> now = developer_.newest();
    const std::optional<double> distance = now ? depthAt(*now, place[0], place[1]) : std::nullopt;
    if (!distance) throw Error(ErrorKind::Usage, "there is no surface to focus on");
    const auto& [x0, y0, x1, y1] = scene_->film.crop;
    const double left = x1 > x0 ? x0 : 0, right = x1 > x0 ? x1 : scene_->film.width;
    const double top = y1 > y0 ? y0 : 0, bottom = y1 > y0 ? y1 : scene_->film.height;
    const double x = (left + place[0] * (right - left)) / scene_->film.width;
    const double y = (top + place[1] * (bottom - top)) / scene_->film.height;
    return depthOfRay(now->seen->camera, x, y, *distance);
}

Display Viewer::displayAfter(const ViewChange& change) const {
    Display display = developer_.display();
    if (change.exposure_ev) display.exposure_ev = change.exposure_ev;
    if (change.exposure_step) {
        const double now = display.exposure_ev.value_or(scene_->film.exposure_ev);
        display.exposure_ev = std::clamp(now + *change.exposure_step, -100.0, 100.0);
    }
    if (change.white) {
        display.white = *change.white;
        developmentFor(display, *scene_);  // Refuses a white that is none.
    }
    if (change.plane) {
        const std::vector<std::string>& names = planeNames();
        if (std::find(names.begin(), names.end(), *change.plane) == names.end())
            throw Error(ErrorKind::Usage, fmt::format("there is no plane '{}'; there are {}", *change.plane,
                                                      fmt::join(names, ", ")));
        display.plane = *change.plane;
    }
    return display;
}

/// Before anything is rendered by them.
void Viewer::tellSettings(const RenderRequest& request) {
    const Display display = developer_.display();
    state_.update([&](Status& status) {
        status.paused = request.paused;
        status.white = display.white;
        status.plane = display.plane;
        if (!scene_) return;
        status.title = scene_->title;
        status.has_lens = scene_->camera.aperture_radius > 0;
        status.pose = pose_;
        status.pose_moved = !(pose_ == poseOf(scene_->camera));
        status.fov_moved = pose_.tan_half_fov != poseOf(scene_->camera).tan_half_fov;
        status.exposure_ev = display.exposure_ev.value_or(scene_->film.exposure_ev);
        status.whites = whiteNames(*scene_);
        status.samples_wanted = request.samplesWanted();
    });
}

std::string Viewer::pixel(std::uint32_t x, std::uint32_t y) const {
    const std::optional<Snapshot> now = developer_.newest();
    if (!now) throw Error(ErrorKind::Usage, "there is no image yet");
    return pixelJson(*now, x, y);
}

Snapshot Viewer::filmOfView() const {
    const std::optional<Snapshot> now = developer_.newest();
    if (!now) throw Error(ErrorKind::Usage, "there is no image yet");
    const std::lock_guard lock(mutex_);
    if (now->seen->read != scene_ || !(now->seen->pose == pose_))
        throw Error(ErrorKind::Usage, "the image still shows the previous view: try again in a moment");
    return *now;
}

SavedFile Viewer::exr() const { return exrOf(filmOfView(), file_stem_); }

SavedFile Viewer::png() const { return pngOf(filmOfView(), developer_.display(), file_stem_); }

std::string Viewer::devices() {
    const std::lock_guard lock(devices_mutex_);
    if (devices_.empty()) devices_ = devicesJson();
    return devices_;
}

}  // namespace crt
