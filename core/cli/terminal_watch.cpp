#include "cli/terminal_watch.h"

namespace crt {

TerminalWatch::TerminalWatch(ProgressMode mode, Signals signals) : mode_(mode), signals_(signals) {
    if (signals == Signals::Always) {
        interrupt_.emplace();
    } else {
        stages_.emplace(mode);
    }
}

void TerminalWatch::renderingBegins() {
    stages_.reset();
    if (!interrupt_ && signals_ != Signals::Never) interrupt_.emplace();
    progress_.emplace(mode_);
}

void TerminalWatch::renderingEnds() {
    stages_.reset();
    progress_.reset();
    if (!interrupt_ && signals_ != Signals::Never)
        interrupt_.emplace();  // The next output must not be cut short.
}

void TerminalWatch::progress(const ProgressState& state) {
    if (progress_) progress_->update(state);
}

std::optional<StopRequest> TerminalWatch::stopRequested() {
    const int signal = InterruptGuard::signalReceived();
    if (signal == 0) return std::nullopt;
    return StopRequest{signalName(signal), signalExitCode(signal)};
}

}  // namespace crt
