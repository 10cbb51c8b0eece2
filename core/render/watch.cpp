#include "render/watch.h"

#include <algorithm>

namespace crt {

double ProgressState::pathsPerSecond() const {
    return elapsed_seconds > 0 ? (samples - start_samples) * static_cast<double>(pixels) / elapsed_seconds
                               : 0;
}

double ProgressState::fraction() const {
    double part = 0;
    if (target > 0) part = samples / static_cast<double>(target);
    if (time_limit_seconds > 0) part = std::max(part, elapsed_seconds / time_limit_seconds);
    return std::clamp(part, 0.0, 1.0);
}

double ProgressState::secondsLeft() const {
    double left = -1;
    const double here = samples - start_samples;
    if (target > 0 && here > 0)
        left = std::max(0.0, (static_cast<double>(target) - samples) * elapsed_seconds / here);
    if (time_limit_seconds > 0) {
        const double until_limit = std::max(0.0, time_limit_seconds - elapsed_seconds);
        left = left < 0 ? until_limit : std::min(left, until_limit);
    }
    return left;
}

}  // namespace crt
