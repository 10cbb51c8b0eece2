#include "base/log.h"

#include <spdlog/logger.h>
#include <spdlog/sinks/ansicolor_sink.h>

#include <atomic>
#include <cstdlib>
#include <memory>
#include <mutex>

namespace crt {
namespace {

spdlog::level::level_enum spdlogLevel(LogLevel level) {
    switch (level) {
        case LogLevel::Debug: return spdlog::level::debug;
        case LogLevel::Info: return spdlog::level::info;
        case LogLevel::Warning: return spdlog::level::warn;
        case LogLevel::Error: return spdlog::level::err;
        case LogLevel::Off: break;
    }
    return spdlog::level::off;
}

/// https://no-color.org: present and not empty means no colour, whatever the value.
bool colourForbidden() {
    const char* no_color = std::getenv("NO_COLOR");
    return no_color != nullptr && *no_color != '\0';
}

struct Log {
    // One lock over message and hooks together: a progress bar is cleared, the message written and the bar
    // redrawn before another thread's message may come between. The sink needs no lock of its own.
    std::mutex mutex;
    spdlog::logger logger;
    LogHook hook = nullptr;
    void* hook_user = nullptr;
    std::atomic<int> warnings{0};

    Log()
        // Automatic means: only when stderr is a terminal that knows colour.
        : logger("crt", std::make_shared<spdlog::sinks::ansicolor_stderr_sink_st>(
                            colourForbidden() ? spdlog::color_mode::never : spdlog::color_mode::automatic)) {
        logger.set_pattern("crt: %^%l%$: %v");
        logger.set_level(spdlog::level::info);
        logger.flush_on(spdlog::level::trace);
    }
};

/// Made at the first message and never destroyed, so that destructors of static objects and threads still
/// running while the process ends may log.
Log& log() {
    static Log* const instance = new Log;
    return *instance;
}

}  // namespace

void setLogLevel(LogLevel level) { log().logger.set_level(spdlogLevel(level)); }

void logMessage(LogLevel level, std::string_view message) {
    Log& l = log();
    if (level == LogLevel::Warning) l.warnings.fetch_add(1, std::memory_order_relaxed);
    const spdlog::level::level_enum spd = spdlogLevel(level);
    if (level == LogLevel::Off || !l.logger.should_log(spd)) return;

    const std::lock_guard lock(l.mutex);
    if (l.hook != nullptr) l.hook(true, l.hook_user);
    l.logger.log(spd, spdlog::string_view_t(message.data(), message.size()));
    if (l.hook != nullptr) l.hook(false, l.hook_user);
}

int warningCount() { return log().warnings.load(std::memory_order_relaxed); }

void setLogHook(LogHook hook, void* user) {
    Log& l = log();
    // Under the lock: when this returns no thread is inside the old hook, and what it points to may go.
    const std::lock_guard lock(l.mutex);
    l.hook = hook;
    l.hook_user = user;
}

}  // namespace crt
