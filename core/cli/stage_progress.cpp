#include "cli/stage_progress.h"

#include "base/listener.h"
#include "base/log.h"
#include "base/stage.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace crt {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLook{100};
constexpr std::chrono::milliseconds kSilence{400};      // Shorter work needs no line.
constexpr std::chrono::milliseconds kLogSilence{1500};  // The same for a log, which keeps every line.
constexpr std::chrono::milliseconds kLogStage{500};     // A stage that a log should name takes longer.
constexpr std::chrono::seconds kLogInterval{10};
constexpr double kParts = 1e6;  // ProgressState counts in whole numbers.

}  // namespace

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
        const ListenerScope scope(listener);
        std::unique_lock lock(mutex);
        while (!wake.wait_for(lock, kLook, [this] { return ended; })) show();
    }

    void show() {
        const Clock::time_point now = Clock::now();
        const std::optional<StageState> stage = innermostStage();
        if (!stage) return;
        ProgressState state;
        state.label = stage->what;
        state.elapsed_seconds = std::chrono::duration<double>(now - stage->start).count();
        if (stage->amount > 0) {
            state.target = static_cast<std::uint64_t>(kParts);
            state.samples = kParts * std::clamp(stage->done / stage->amount, 0.0, 1.0);
        }
        if (progress.mode() == ProgressMode::Bar) {
            if (now - start >= kSilence) progress.update(state);
            return;
        }
        const bool is_new = state.label != said && now - stage->start >= kLogStage;
        if (now - start < kLogSilence || (!is_new && now - said_at < kLogInterval)) return;
        said = state.label;
        said_at = now;
        logInfo("{}", progressLine(state));
    }

    const ListenerRef listener = currentListener();
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
