/// The render loop of backends that work in launches: GPUs, and OpenCL on processors.
#pragma once

#include "backend/sdk/launch_pacer.h"
#include "backend/sdk/plugin_guard.h"

#include <chrono>
#include <cstdint>

namespace crt::plugin {

/// Of all launches of a scene so far.
struct LaunchTotals {
    double seconds = 0;
    std::uint64_t paths = 0;
};

/// Thrown out of a launch where the host wants to stop.
struct LaunchCancelled {};

/// Asks the host within a launch of many kernels whether it wants to stop, now and then.
class LaunchWatch {
public:
    /// `done`: of the range, before the launch.
    LaunchWatch(const Host& host, double done) : host_(host), done_(done) {}

    /// Throws LaunchCancelled.
    void look() {
        const Clock::time_point now = Clock::now();
        if (now - looked_at_ < std::chrono::milliseconds(100)) return;
        looked_at_ = now;
        if (host_.cancelled(done_)) throw LaunchCancelled();
    }

private:
    using Clock = std::chrono::steady_clock;
    const Host& host_;
    double done_;
    Clock::time_point looked_at_ = Clock::now();
};

/// Renders `range` in launches of about the pacer's wanted time; `launch(const Launch&)` does one and
/// returns its seconds. The host hears of every one and may cancel between them, and where a launch asks it
/// (LaunchWatch): then false is returned.
template <class LaunchFunction>
bool renderInLaunches(const Host& host, LaunchPacer& pacer, const CrtRenderRange& range,
                      std::uint32_t tile_size, LaunchTotals& totals, LaunchFunction&& launch) {
    pacer.begin(range, tile_size);
    if (host.cancelled(0.0)) return false;
    for (Launch next; pacer.next(next);) {
        double seconds = 0;
        try {
            seconds = launch(next);
        } catch (const LaunchCancelled&) {
            return false;
        }
        pacer.finished(next, seconds);
        totals.seconds += seconds;
        totals.paths += next.paths();
        if (host.cancelled(pacer.done())) return false;
    }
    return true;
}

}  // namespace crt::plugin
