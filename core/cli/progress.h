/// Tells how far a render is: a bar on a terminal, otherwise a line every ten seconds.
#pragma once

#include "base/listener.h"
#include "film/error_text.h"
#include "render/watch.h"

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>

namespace crt {

enum class ProgressMode {
    Auto,  ///< A bar when stderr is a terminal that can move its cursor, else lines.
    Bar,
    Lines,  ///< At most one per ten seconds, through the log. Never a carriage return: log files keep every
            ///< one.
    None,
};

/// "43 %  28/64 spp  12.3 Mpaths/s  0:42 left  error 1.90 % (1.86-1.94)  1 % at 54-110 spp, in 0:40-2:12"; a
/// target error stands instead of 1 %.
std::string progressText(const ProgressState& state);
/// The same for a log: not aligned.
std::string progressLine(const ProgressState& state);
/// The same behind a bar, fitted into `columns`.
std::string progressBar(const ProgressState& state, int columns);

/// Draws. While one with a bar lives it owns the last line of the terminal: messages of the listener of the
/// thread that made it go above.
class Progress {
public:
    explicit Progress(ProgressMode mode);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// Shows `state` if the last one has been shown long enough. Cheap otherwise. [any thread]
    void update(const ProgressState& state);

    /// Never Auto.
    ProgressMode mode() const { return mode_; }

private:
    using Clock = std::chrono::steady_clock;
    static void aroundMessage(bool before_message, void* user);
    void draw();
    void clear();

    ProgressMode mode_;
    const ListenerRef listener_;
    std::mutex mutex_;
    Clock::time_point shown_at_;
    std::string text_;       ///< Text of the bar; empty before the first update.
};

}  // namespace crt
