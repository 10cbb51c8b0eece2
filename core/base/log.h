/// Levelled log. Messages go to the listener of the thread (listener.h). spdlog stays inside listener.cpp:
/// nothing else in the core includes it, so that its ABI crosses no border.
#pragma once

#include "base/listener.h"

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <utility>

namespace crt {

/// The least level that reaches the sink of this thread's listener; messages below `level` are dropped.
/// Throws crt::Error(Internal) where there is no listener.
void setLogLevel(LogLevel level);

/// Gives one line, made printable, to the listener of this thread. [any thread]
void logMessage(LogLevel level, std::string_view message);

template <class... Args>
void logDebug(fmt::format_string<Args...> text, Args&&... args) {
    logMessage(LogLevel::Debug, fmt::format(text, std::forward<Args>(args)...));
}
template <class... Args>
void logInfo(fmt::format_string<Args...> text, Args&&... args) {
    logMessage(LogLevel::Info, fmt::format(text, std::forward<Args>(args)...));
}
template <class... Args>
void logWarning(fmt::format_string<Args...> text, Args&&... args) {
    logMessage(LogLevel::Warning, fmt::format(text, std::forward<Args>(args)...));
}

/// Number of warnings that this thread's listener heard so far, 0 without one; the report repeats it so that
/// a warning is never lost in a scroll-back.
int warningCount();

/// Called around each message by the owner of the terminal (the progress bar): first to clear its line, then
/// to redraw.
using LogHook = void (*)(bool before_message, void* user);
/// When it returns no thread is inside the old hook, and what it points to may go. Does nothing for null.
void setLogHook(const ListenerRef& listener, LogHook hook, void* user);

}  // namespace crt
