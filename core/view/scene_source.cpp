#include "view/scene_source.h"

#include "base/error.h"
#include "base/listener.h"
#include "base/log.h"
#include "view/file_times.h"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <exception>
#include <sstream>
#include <utility>

namespace crt {

SceneSource::SceneSource(SceneRequest request, ViewState& state,
                         std::function<void(std::shared_ptr<const Scene>)> take)
    : request_(std::move(request)),
      state_(state),
      take_(std::move(take)),
      thread_([this, listener = currentListener()] {
          const ListenerScope scope(listener);
          run();
      }) {}

SceneSource::~SceneSource() {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    stopped_.notify_all();
}

void SceneSource::run() {
    constexpr std::chrono::milliseconds kBetweenLooks{250}, kQuiet{60};
    std::vector<std::string> files{request_.file};
    // Noted before it is read: what changes meanwhile is read again.
    FileTimes times(files);
    std::unique_lock lock(mutex_);
    while (!stopping_) {
        lock.unlock();
        const auto began = FileTimes::Time::clock::now();
        read(files);
        times = FileTimes(files, times, began);
        lock.lock();
        while (!stopping_ && !times.changed()) stopped_.wait_for(lock, kBetweenLooks);
        // An editor may be writing still.
        do {
            times = FileTimes(files);
            stopped_.wait_for(lock, kQuiet, [&] { return stopping_; });
        } while (!stopping_ && times.changed());
    }
}

/// `files` are those to watch from then on.
void SceneSource::read(std::vector<std::string>& files) {
    std::string what;
    state_.update([](Status& status) { status.warnings.clear(); });
    try {
        auto scene = std::make_shared<const Scene>(loadScene(request_));
        files = scene->files_read;
        if (std::find(files.begin(), files.end(), request_.file) == files.end())
            files.push_back(request_.file);
        state_.update([](Status& status) {
            status.scene_error.clear();
            status.stage.clear();
        });
        take_(std::move(scene));
        return;
    } catch (const std::bad_alloc&) {
        what = "out of memory on the host while the scene was read";
    } catch (const std::exception& error) {
        what = error.what();
    }
    // The files of the last valid scene, and those with the errors.
    for (std::string& file : filesNamedIn(what))
        if (std::find(files.begin(), files.end(), file) == files.end()) files.push_back(std::move(file));
    logMessage(LogLevel::Error, what);
    state_.update([&](Status& status) {
        status.scene_error = what;
        status.stage.clear();
    });
}

std::vector<std::string> filesNamedIn(const std::string& message) {
    std::vector<std::string> files;
    std::istringstream lines(message);
    for (std::string line; std::getline(lines, line);) {
        const std::size_t error = line.find(": error: ");
        if (error == std::string::npos) continue;
        std::string place = line.substr(0, error);
        for (int part = 0; part < 2; ++part) {
            const std::size_t colon = place.rfind(':');
            const bool is_number = colon != std::string::npos && colon + 1 < place.size() &&
                                   std::all_of(place.begin() + static_cast<std::ptrdiff_t>(colon) + 1,
                                               place.end(), [](unsigned char c) { return std::isdigit(c); });
            if (is_number) place.resize(colon);
        }
        files.push_back(std::move(place));
    }
    return files;
}

}  // namespace crt
