/// The state of a listener that log.cpp and stage.cpp share.
#pragma once

#include "base/listener.h"
#include "base/log.h"

#include <atomic>
#include <mutex>
#include <vector>

namespace crt {

class Stage;

struct ListenerState {
    std::atomic<LogLevel> level{LogLevel::Info};
    std::atomic<int> warnings{0};

    /// Over sink and hook together: a progress bar is cleared, the message written and the bar redrawn
    /// before another thread's message may come between.
    std::mutex message_mutex;
    LogSink messages;
    LogHook hook = nullptr;
    void* hook_user = nullptr;

    std::mutex stage_mutex;
    std::vector<const Stage*> stages;  ///< The innermost last.
    /// Separate from stage_mutex, because the receiver of a stage may query the innermost one.
    std::mutex stage_sink_mutex;
    StageSink stage_sink;
};

}  // namespace crt
