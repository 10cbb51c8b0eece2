#include "base/stage.h"

#include "base/listener_state.h"
#include "base/words.h"

#include <algorithm>

namespace crt {

Stage::Stage(const std::string& what, double amount)
    : listener_(currentListener()), what_(printable(what)), amount_(amount) {
    if (!listener_) return;
    {
        // First: what throws here leaves no stage behind.
        const std::lock_guard lock(listener_->stage_sink_mutex);
        if (listener_->stage_sink) listener_->stage_sink(what_);
    }
    const std::lock_guard lock(listener_->stage_mutex);
    listener_->stages.push_back(this);
}

Stage::~Stage() {
    if (!listener_) return;
    const std::lock_guard lock(listener_->stage_mutex);
    auto& stages = listener_->stages;
    stages.erase(std::find(stages.begin(), stages.end(), this));
}

std::optional<StageState> innermostStage() {
    const ListenerRef listener = currentListener();
    if (!listener) return std::nullopt;
    const std::lock_guard lock(listener->stage_mutex);
    if (listener->stages.empty()) return std::nullopt;
    const Stage& stage = *listener->stages.back();
    return StageState{stage.what_, stage.amount_, stage.done_, stage.start_};
}

}  // namespace crt
