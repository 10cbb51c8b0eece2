#include "stage.h"

#include "log.h"

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace crt {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLook{100};
constexpr std::chrono::milliseconds kSilence{400};      // What is done sooner needs no line.
constexpr std::chrono::milliseconds kLogSilence{1500};  // The same for a log, which keeps every line.
constexpr std::chrono::milliseconds kLogStage{500};     // A stage that a log should name takes longer.
constexpr std::chrono::seconds kLogInterval{10};
constexpr double kParts = 1e6;  // ProgressState counts in whole numbers.

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

struct StageProgress::Shown {
    explicit Shown(ProgressMode mode) : progress(mode) {
        if (progress.mode() != ProgressMode::None) thread = std::thread([this] { run(); });
    }
    ~Shown() {
        if (!thread.joinable()) return;
        {
            const std::lock_guard lock(mutex);
            ended = true;
        }
        wake.notify_all();
        thread.join();
    }

    void run() {
        std::unique_lock lock(mutex);
        while (!wake.wait_for(lock, kLook, [this] { return ended; })) show();
    }

    void show() {
        const Clock::time_point now = Clock::now();
        const Stage* stage = nullptr;
        ProgressState state;
        Clock::time_point stage_start;
        {
            const std::lock_guard lock(registry().mutex);
            if (registry().stages.empty()) return;
            stage = registry().stages.back();
            stage_start = stage->start_;
            state.label = stage->what_;
            state.elapsed_seconds = std::chrono::duration<double>(now - stage_start).count();
            const double amount = stage->amount_, done = stage->done_;
            if (amount > 0) {
                state.target = static_cast<std::uint64_t>(kParts);
                state.samples = kParts * std::clamp(done / amount, 0.0, 1.0);
            }
        }
        if (progress.mode() == ProgressMode::Bar) {
            if (now - start >= kSilence) progress.update(state);
            return;
        }
        const bool is_new = state.label != said && now - stage_start >= kLogStage;
        if (now - start < kLogSilence || (!is_new && now - said_at < kLogInterval)) return;
        said = state.label;
        said_at = now;
        logInfo("{}", progressLine(state));
    }

    Progress progress;
    const Clock::time_point start = Clock::now();
    std::string said;
    Clock::time_point said_at = start;
    std::mutex mutex;
    std::condition_variable wake;
    bool ended = false;
    std::thread thread;
};

StageProgress::StageProgress(ProgressMode mode) : shown_(std::make_unique<Shown>(mode)) {}
StageProgress::~StageProgress() = default;

}  // namespace crt
