/// The thread that reads the scene, and reads it again whenever a file that it was made of changes.
#pragma once

#include "render/job.h"
#include "view/view_state.h"

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace crt {

class SceneSource {
public:
    /// `take` gets each scene that could be read, on the source's thread. The errors of an invalid scene
    /// stay in the state until a valid one is read.
    SceneSource(SceneRequest request, ViewState& state,
                std::function<void(std::shared_ptr<const Scene>)> take);
    ~SceneSource();
    SceneSource(const SceneSource&) = delete;
    SceneSource& operator=(const SceneSource&) = delete;

private:
    void run();
    void read(std::vector<std::string>& files);

    const SceneRequest request_;
    ViewState& state_;
    const std::function<void(std::shared_ptr<const Scene>)> take_;
    std::mutex mutex_;
    std::condition_variable stopped_;
    bool stopping_ = false;
    std::jthread thread_;  ///< Last: it uses all others.
};

/// The files that a message about a scene points to: "NAME:LINE:COLUMN: error: …".
std::vector<std::string> filesNamedIn(const std::string& message);

}  // namespace crt
