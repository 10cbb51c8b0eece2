#include "base/listener.h"

#include "base/listener_state.h"

#include <spdlog/logger.h>
#include <spdlog/sinks/ansicolor_sink.h>

#include <cstdlib>
#include <utility>

namespace crt {
namespace {

/// The innermost scope of this thread. Nothing to destroy: destructors of static objects may log.
thread_local const ListenerScope* innermost_scope = nullptr;

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

}  // namespace

Listener::Listener(LogSink messages, LogLevel level, StageSink stages)
    : state_(std::make_shared<ListenerState>()) {
    state_->messages = std::move(messages);
    state_->level = level;
    state_->stage_sink = std::move(stages);
}

Listener::~Listener() {
    {
        const std::lock_guard lock(state_->message_mutex);
        state_->messages = nullptr;
    }
    const std::lock_guard lock(state_->stage_sink_mutex);
    state_->stage_sink = nullptr;
}

int Listener::warnings() const { return state_->warnings.load(std::memory_order_relaxed); }

ListenerRef currentListener() { return innermost_scope != nullptr ? innermost_scope->listener_ : nullptr; }

ListenerScope::ListenerScope(ListenerRef listener)
    : listener_(std::move(listener)), outer_(innermost_scope) {
    innermost_scope = this;
}

ListenerScope::~ListenerScope() { innermost_scope = outer_; }

LogSink standardErrorSink() {
    // The listener locks, so the sink needs no lock. Automatic means: only when stderr is a terminal that
    // knows colour.
    const auto logger = std::make_shared<spdlog::logger>(
        "crt", std::make_shared<spdlog::sinks::ansicolor_stderr_sink_st>(
                   colourForbidden() ? spdlog::color_mode::never : spdlog::color_mode::automatic));
    logger->set_pattern("crt: %^%l%$: %v");
    logger->set_level(spdlog::level::trace);
    logger->flush_on(spdlog::level::trace);
    return [logger](LogLevel level, std::string_view message) {
        logger->log(spdlogLevel(level), spdlog::string_view_t(message.data(), message.size()));
    };
}

}  // namespace crt
