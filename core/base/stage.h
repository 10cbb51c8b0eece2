/// Long work before the first sample, and how far it is: reading meshes, building the BVH, setting up the
/// device. Long work announces itself with a Stage; the listener of the thread (listener.h) records it, and
/// the owner of the terminal shows it with a StageProgress.
#pragma once

#include "base/listener.h"

#include <atomic>
#include <chrono>
#include <optional>
#include <string>

namespace crt {

struct StageState;

/// One piece of work, for as long as it lives. Cheap: nothing is drawn here. [any thread]
class Stage {
public:
    /// `what` as in "reading bunny.obj". `amount` is how much there is to do, in any unit; 0: how far it is
    /// cannot be told.
    explicit Stage(const std::string& what, double amount = 0);
    ~Stage();
    Stage(const Stage&) = delete;
    Stage& operator=(const Stage&) = delete;

    /// So much of the amount is done by now.
    void at(double done) noexcept { done_.store(done, std::memory_order_relaxed); }
    /// The amount, where it is known only later.
    void setAmount(double amount) noexcept { amount_.store(amount, std::memory_order_relaxed); }

private:
    friend std::optional<StageState> innermostStage();
    using Clock = std::chrono::steady_clock;

    const ListenerRef listener_;  ///< That of the thread which began it.
    const std::string what_;
    std::atomic<double> amount_, done_{0};
    const Clock::time_point start_ = Clock::now();
};

/// The innermost active stage and its progress.
struct StageState {
    std::string what;
    double amount = 0, done = 0;  ///< As of Stage.
    std::chrono::steady_clock::time_point start;
};
/// Of the listener of this thread. Nothing when no stage lives. [any thread]
std::optional<StageState> innermostStage();

}  // namespace crt
