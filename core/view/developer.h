/// The thread that makes pictures of films while the device goes on: the newest film, as it shall be shown.
#pragma once

#include "base/stopwatch.h"
#include "view/view_state.h"
#include "view/planes.h"
#include "view/snapshot.h"

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

namespace crt {

class Developer {
public:
    /// Takes at most `threads` threads, 0: one a processor.
    Developer(ViewState& state, unsigned threads);
    ~Developer();
    Developer(const Developer&) = delete;
    Developer& operator=(const Developer&) = delete;

    /// The film from now on. [any thread]
    void take(Snapshot snapshot);
    /// [any thread]
    void setDisplay(const Display& display);
    Display display() const;
    /// Nothing: no film yet. [any thread]
    std::optional<Snapshot> newest() const;

private:
    void run();
    void develop(const Snapshot& snapshot, const Display& display);
    void estimate(const Snapshot& snapshot);

    ViewState& state_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::optional<Snapshot> newest_;
    Display display_;
    bool stale_ = false;  ///< The picture is not of both.
    bool stopping_ = false;

    // Of the thread.
    std::uint64_t run_ = 0;  ///< The film whose errors the state has.
    double estimate_seconds_ = 0;
    std::optional<Stopwatch> estimated_;  ///< Since then.
    std::jthread thread_;                 ///< Last: it uses all others.
};

}  // namespace crt
