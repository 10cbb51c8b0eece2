/// Levelled log. spdlog stays inside log.cpp: nothing else in the core includes it, so that its ABI crosses
/// no border.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <utility>

namespace crt {

enum class LogLevel : int { Debug = 0, Info = 1, Warning = 2, Error = 3, Off = 4 };

/// Sets what reaches stderr; messages below `level` are dropped. [any thread]
void setLogLevel(LogLevel level);

/// Writes one line to stderr, "crt: warning: …", without tearing a progress bar apart. [any thread]
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

/// Number of warnings logged so far; the report repeats it so that a warning is never lost in a scroll-back.
int warningCount();

/// Called around each message by whoever draws on the terminal (the progress bar): first to clear its line,
/// then to redraw.
using LogHook = void (*)(bool before_message, void* user);
void setLogHook(LogHook hook, void* user);

}  // namespace crt
