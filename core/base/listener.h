/// Receives what the core reports while it works: messages (log.h) and stages of long work (stage.h). There
/// is no log of the process: the caller listens on the thread that does the work.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace crt {

enum class LogLevel : int { Debug = 0, Info = 1, Warning = 2, Error = 3, Off = 4 };

/// Takes a message, one line without its end. A Listener calls it for one message at a time. [any thread]
using LogSink = std::function<void(LogLevel, std::string_view)>;
/// Takes the name of a stage as it begins, "reading bunny.obj", one at a time. [any thread]
using StageSink = std::function<void(const std::string& what)>;

struct ListenerState;
/// The part of a Listener that threads hold. It may outlive the Listener; then nothing reaches the sinks any
/// more.
using ListenerRef = std::shared_ptr<ListenerState>;

/// Owns the two sinks, a level, and a count of warnings.
class Listener {
public:
    explicit Listener(LogSink messages, LogLevel level = LogLevel::Info, StageSink stages = {});
    /// When it returns no thread is inside a sink, and none will be.
    ~Listener();
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;

    const ListenerRef& ref() const { return state_; }
    /// Warnings so far, also those below the level.
    int warnings() const;

private:
    ListenerRef state_;
};

/// The listener of this thread; null where there is none: then warnings and errors go to stderr, one line
/// each, and the rest is dropped.
ListenerRef currentListener();

/// Makes a listener that of this thread for as long as the scope lives. Scopes nest, and end on the thread
/// that they began on. A thread that the core starts for a caller takes the caller's listener along:
///
///     std::async([listener = currentListener()] { const ListenerScope scope(listener); … });
class ListenerScope {
public:
    explicit ListenerScope(ListenerRef listener);
    explicit ListenerScope(const Listener& listener) : ListenerScope(listener.ref()) {}
    ~ListenerScope();
    ListenerScope(const ListenerScope&) = delete;
    ListenerScope& operator=(const ListenerScope&) = delete;

private:
    friend ListenerRef currentListener();

    const ListenerRef listener_;
    const ListenerScope* const outer_;
};

/// A sink that writes "crt: warning: …" to stderr, coloured on a terminal.
LogSink standardErrorSink();

}  // namespace crt
