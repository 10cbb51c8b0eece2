/// A scene on its way to pages that look at it: reader, renderer and developer at work, and what pages may
/// ask of them. All functions may be called by any thread.
#pragma once

#include "base/listener.h"
#include "view/board.h"
#include "view/developer.h"
#include "view/messages.h"
#include "view/page_changes.h"
#include "view/renderer.h"
#include "view/reports.h"
#include "view/scene_source.h"

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace crt {

struct ViewOptions {
    SceneRequest scene;
    std::string backend = "auto";
    IntegratorOptions integrator;
    std::uint64_t samples = 0;  ///< Per pixel; 0: the scene's.
};

struct ChangeRequest {
    std::vector<RequestedChange> changes;
    std::string page{};       ///< Empty: its changes have no numbers.
    std::uint64_t first = 0;  ///< Number of the first of the changes.
};

class Viewer {
public:
    /// Starts everything and returns at once. What the parts have to say goes to the pages and to the
    /// listener of the calling thread.
    explicit Viewer(const ViewOptions& options);
    ~Viewer();
    Viewer(const Viewer&) = delete;
    Viewer& operator=(const Viewer&) = delete;

    Board& board() { return board_; }
    const ListenerRef& listener() const { return listener_.ref(); }

    /// Makes the changes in order, and those of a page that numbers them once, however often it sends them.
    /// Then throws crt::Error(Usage) if this scene or film cannot do some of them, which change nothing.
    void change(const ChangeRequest& request);
    /// What the film knows of a pixel of the crop window, as JSON. Throws crt::Error(Usage).
    std::string pixel(std::uint32_t x, std::uint32_t y) const;
    /// The image, and the picture as it is shown, as files. Throws crt::Error, with Usage while the newest
    /// film is not one of the present view.
    SavedFile exr() const;
    SavedFile png() const;
    /// Backends and devices, as JSON. Opens all of them the first time.
    std::string devices();

    /// Asks everybody to end, without waiting for them.
    void stop();

private:
    void hear(LogLevel level, std::string_view message);
    void takeScene(std::shared_ptr<const Scene> scene);
    void changeOnce(const ViewChange& change);
    Snapshot filmOfView() const;
    CameraPose poseAfter(const ViewChange& change) const;
    double focusAt(const std::array<double, 2>& place) const;
    Display displayAfter(const ViewChange& change) const;
    void tellSettings(const RenderWishes& wishes);

    const ListenerRef outer_;
    const std::string file_stem_;
    Board board_;
    Listener listener_;
    const ListenerScope scope_;

    mutable std::mutex mutex_;  ///< Of what follows.
    std::shared_ptr<const Scene> scene_;
    CameraPose pose_;
    std::uint32_t aovs_ = 0;  ///< That were looked at.

    std::mutex order_mutex_;  ///< Of changes.
    PageChanges taken_;

    std::mutex devices_mutex_;
    std::string devices_;

    // In the order of the data; each is gone before those that it hands on to.
    Developer developer_;
    Renderer renderer_;
    SceneSource source_;
};

}  // namespace crt
