#include "base/stage.h"

#include <algorithm>
#include <mutex>
#include <utility>
#include <vector>

namespace crt {
namespace {

struct Registry {
    std::mutex mutex;
    std::vector<const Stage*> stages;  ///< The innermost last.
};

/// Never destroyed: threads may outlive static objects.
Registry& registry() {
    static Registry* const instance = new Registry;
    return *instance;
}

}  // namespace

Stage::Stage(std::string what, double amount) : what_(std::move(what)), amount_(amount) {
    const std::lock_guard lock(registry().mutex);
    registry().stages.push_back(this);
}

Stage::~Stage() {
    const std::lock_guard lock(registry().mutex);
    auto& stages = registry().stages;
    stages.erase(std::find(stages.begin(), stages.end(), this));
}

std::optional<StageState> innermostStage() {
    const std::lock_guard lock(registry().mutex);
    if (registry().stages.empty()) return std::nullopt;
    const Stage& stage = *registry().stages.back();
    return StageState{stage.what_, stage.amount_, stage.done_, stage.start_};
}

}  // namespace crt
