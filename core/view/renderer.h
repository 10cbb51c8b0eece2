/// The thread that renders: it makes its device, its scene and its film those that are wished for, again and
/// again, and hands on a film after each chunk.
#pragma once

#include "backend/integrator.h"
#include "base/listener.h"
#include "render/device_film.h"
#include "render/session.h"
#include "view/board.h"
#include "view/camera_moves.h"
#include "view/pace.h"
#include "view/snapshot.h"

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace crt {

/// What is to be rendered, by what.
struct RenderWishes {
    std::shared_ptr<const Scene> scene;  ///< Null: nothing yet.
    CameraPose pose;
    std::uint32_t aovs = 0;     ///< That the film shall hold.
    std::uint64_t samples = 0;  ///< Per pixel; 0: the scene's number.
    bool paused = false;
    std::string backend = "auto";
    IntegratorOptions integrator;

    std::uint64_t samplesWanted() const { return samples > 0 ? samples : scene->sampler.samples; }
    /// Whether the same samples of the same film answer both.
    bool samePicture(const RenderWishes& other) const;
    bool sameDevice(const RenderWishes& other) const;
};

class Renderer {
public:
    /// `hand_on` is called on the renderer's thread.
    Renderer(RenderWishes wishes, Board& board, std::function<void(Snapshot)> hand_on);
    /// Cancels what runs and waits for it.
    ~Renderer();
    Renderer(const Renderer&) = delete;
    Renderer& operator=(const Renderer&) = delete;

    /// [any thread]
    void wish(const std::function<void(RenderWishes&)>& change);
    /// Asks the thread to end, without waiting. [any thread]
    void stop();

private:
    struct Cancelled {};

    void run();
    bool waitForWork(RenderWishes& wanted);
    bool hasWork() const;
    void work(const RenderWishes& wanted);
    void recover(const std::string& what);
    void openBackend(const RenderWishes& wanted);
    void compile(const RenderWishes& wanted, const Scene& scene);
    void seeScene(const RenderWishes& wanted);
    void setView(const RenderWishes& wanted, unsigned divisor);
    void renderChunk(const RenderWishes& wanted, std::uint64_t count);
    void cancelWhereStale(const RenderWishes& wanted);
    void handOn(const RenderWishes& wanted);
    std::shared_ptr<Film> spareFilm(const FilmShape& shape);

    Board& board_;
    const std::function<void(Snapshot)> hand_on_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    RenderWishes wishes_;
    std::atomic<std::uint64_t> revision_{0};  ///< Of the wishes.
    std::atomic<bool> stopping_{false};

    // Of the thread.
    std::uint64_t taken_ = 0;              ///< The revision that is worked on.
    std::optional<std::uint64_t> failed_;  ///< The revision that went wrong: it is not tried again.
    std::optional<RenderWishes> applied_;  ///< What the film on the devices is of; nothing: there is none.
    std::unique_ptr<Session> session_;
    std::optional<CompiledScene> compiled_;
    std::shared_ptr<const Scene> compiled_of_;
    std::uint32_t compiled_aovs_ = 0;
    std::optional<DeviceFilm> devices_;
    std::shared_ptr<const PrimitiveNames> names_;
    PathFacts paths_;
    std::shared_ptr<const SeenScene> seen_;
    std::vector<std::shared_ptr<Film>> films_;  ///< Kept, as memory that is new costs as much as filling it.
    Pace pace_;
    unsigned divisor_ = 1;       ///< Of the film on the devices.
    std::uint64_t samples_ = 0;  ///< In it.
    std::uint64_t runs_ = 0;     ///< Restarts.
    bool shown_ = false;         ///< Something of this run was handed on.
    double seconds_ = 0;         ///< Of this run.
    std::jthread thread_;        ///< Last: it uses all others.
};

}  // namespace crt
