/// The render loop of backends that work in launches: GPUs, and OpenCL on processors.
#pragma once

#include "backend/sdk/launch_pacer.h"
#include "backend/sdk/plugin_guard.h"

#include <cstdint>

namespace crt::plugin {

/// Of all launches of a scene so far.
struct LaunchTotals {
    double seconds = 0;
    std::uint64_t paths = 0;
};

/// Renders `range` in launches of about the pacer's wanted time; `launch(const Launch&)` does one and
/// returns its seconds. The host hears of every one and may cancel between them: then false is returned.
template <class LaunchFunction>
bool renderInLaunches(const Host& host, LaunchPacer& pacer, const CrtRenderRange& range,
                      std::uint32_t tile_size, LaunchTotals& totals, LaunchFunction&& launch) {
    pacer.begin(range, tile_size);
    if (host.cancelled(0.0)) return false;
    for (Launch next; pacer.next(next);) {
        const double seconds = launch(next);
        pacer.finished(next, seconds);
        totals.seconds += seconds;
        totals.paths += next.paths();
        if (host.cancelled(pacer.done())) return false;
    }
    return true;
}

}  // namespace crt::plugin
