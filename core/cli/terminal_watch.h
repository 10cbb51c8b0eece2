/// A Watch for people at a terminal: stages and samples as progress, Ctrl-C as a request to stop.
#pragma once

#include "cli/process/interrupt.h"
#include "cli/progress.h"
#include "cli/stage_progress.h"
#include "render/watch.h"

#include <optional>

namespace crt {

class TerminalWatch : public Watch {
public:
    enum class Signals {
        WhileRendering,  ///< Before that there is nothing to save: a signal ends the process.
        Always,
        Never,           ///< Nothing is ever saved: a signal ends the process.
    };
    explicit TerminalWatch(ProgressMode mode, Signals signals = Signals::WhileRendering);

    void renderingBegins() override;
    void renderingEnds() override;
    void progress(const ProgressState& state) override;
    std::optional<StopRequest> stopRequested() override;

private:
    ProgressMode mode_;
    Signals signals_;
    std::optional<StageProgress> stages_;
    std::optional<InterruptGuard> interrupt_;
    std::optional<Progress> progress_;
};

}  // namespace crt
