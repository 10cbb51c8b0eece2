/// Long work before the first sample, and how far it is: reading meshes, building the BVH, setting up the
/// device. Whoever works says so with a Stage; whoever owns the terminal shows it with a StageProgress.
#pragma once

#include "progress.h"

#include <atomic>
#include <chrono>
#include <memory>
#include <string>

namespace crt {

/// One piece of work, for as long as it lives. Cheap: nothing is drawn here. [any thread]
class Stage {
public:
    /// `what` as in "reading bunny.obj". `amount` is how much there is to do, in any unit; 0: how far it is
    /// cannot be told.
    explicit Stage(std::string what, double amount = 0);
    ~Stage();
    Stage(const Stage&) = delete;
    Stage& operator=(const Stage&) = delete;

    /// So much of the amount is done by now.
    void at(double done) noexcept { done_.store(done, std::memory_order_relaxed); }
    /// The amount, where it is known only later.
    void setAmount(double amount) noexcept { amount_.store(amount, std::memory_order_relaxed); }

private:
    friend class StageProgress;
    using Clock = std::chrono::steady_clock;

    const std::string what_;
    std::atomic<double> amount_, done_{0};
    const Clock::time_point start_ = Clock::now();
};

/// Shows the innermost stage while it lives: on a terminal the line that rendering has too, in a log a line
/// for each stage that takes long and one every ten seconds. Work that is done at once is not mentioned.
class StageProgress {
public:
    explicit StageProgress(ProgressMode mode);
    ~StageProgress();
    StageProgress(const StageProgress&) = delete;
    StageProgress& operator=(const StageProgress&) = delete;

private:
    struct Shown;
    std::unique_ptr<Shown> shown_;
};

}  // namespace crt
