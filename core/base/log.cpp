#include "base/log.h"

#include "base/error.h"
#include "base/listener_state.h"
#include "base/words.h"

#include <cstdio>

namespace crt {
namespace {

/// For a thread without a listener: a warning may not be lost.
void writeToStandardError(LogLevel level, std::string_view message) {
    if (level != LogLevel::Warning && level != LogLevel::Error) return;
    const std::string line =
        fmt::format("crt: {}: {}\n", level == LogLevel::Warning ? "warning" : "error", message);
    std::fwrite(line.data(), 1, line.size(), stderr);
}

}  // namespace

void setLogLevel(LogLevel level) {
    const ListenerRef listener = currentListener();
    if (!listener) throw Error(ErrorKind::Internal, "a log level needs a listener");
    listener->level = level;
}

void logMessage(LogLevel level, std::string_view text) {
    const std::string message = printable(text);
    const ListenerRef listener = currentListener();
    if (!listener) return writeToStandardError(level, message);
    ListenerState& l = *listener;
    if (level == LogLevel::Warning) l.warnings.fetch_add(1, std::memory_order_relaxed);
    if (level == LogLevel::Off || level < l.level.load(std::memory_order_relaxed)) return;

    const std::lock_guard lock(l.message_mutex);
    if (!l.messages) return writeToStandardError(level, message);
    if (l.hook != nullptr) l.hook(true, l.hook_user);
    l.messages(level, message);
    if (l.hook != nullptr) l.hook(false, l.hook_user);
}

int warningCount() {
    const ListenerRef listener = currentListener();
    return listener ? listener->warnings.load(std::memory_order_relaxed) : 0;
}

void setLogHook(const ListenerRef& listener, LogHook hook, void* user) {
    if (!listener) return;
    const std::lock_guard lock(listener->message_mutex);
    listener->hook = hook;
    listener->hook_user = user;
}

}  // namespace crt
