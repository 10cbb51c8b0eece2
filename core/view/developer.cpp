#include "view/developer.h"

#include "base/listener.h"
#include "base/log.h"
#include "base/parallel.h"
#include "film/error_estimate.h"
#include "scene/aov.h"

#include <algorithm>
#include <exception>
#include <utility>

namespace crt {

Developer::Developer(ViewState& state, unsigned threads)
    : state_(state), thread_([this, threads, listener = currentListener()] {
          const ListenerScope scope(listener);
          runWithThreads(threads, [this] { run(); });
      }) {}

Developer::~Developer() {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    changed_.notify_all();
}

void Developer::take(Snapshot snapshot) {
    {
        const std::lock_guard lock(mutex_);
        newest_ = std::move(snapshot);
        stale_ = true;
    }
    changed_.notify_all();
}

void Developer::setDisplay(const Display& display) {
    {
        const std::lock_guard lock(mutex_);
        display_ = display;
        stale_ = true;
    }
    changed_.notify_all();
}

Display Developer::display() const {
    const std::lock_guard lock(mutex_);
    return display_;
}

std::optional<Snapshot> Developer::newest() const {
    const std::lock_guard lock(mutex_);
    return newest_;
}

void Developer::run() {
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [&] { return stopping_ || (stale_ && newest_); });
        if (stopping_) return;
        stale_ = false;
        const Snapshot snapshot = *newest_;
        const Display display = display_;
        lock.unlock();
        try {
            develop(snapshot, display);
        } catch (const std::exception& error) {
            logWarning("the image cannot be shown: {}", error.what());
        }
        lock.lock();
    }
}

void Developer::develop(const Snapshot& snapshot, const Display& display) {
    if (aovsLacking(*snapshot.film, display.plane) != 0) return;  // A film that has the plane is on its way.
    state_.show(pictureOf(snapshot, display));
    if (std::exchange(run_, snapshot.run) != snapshot.run) {
        state_.update([](Status& status) { status.errors.clear(); });
        estimated_.reset();
    }
    if (snapshot.divisor == 1) estimate(snapshot);
}

/// At the end, and before that so often that it takes a tenth of the time.
void Developer::estimate(const Snapshot& snapshot) {
    constexpr double kLeastPause = 0.1, kShare = 0.1;
    constexpr std::size_t kMostPoints = 600;
    const double pause = std::max(kLeastPause, estimate_seconds_ / kShare);
    if (estimated_ && estimated_->seconds() < pause && !snapshot.complete) return;
    const Stopwatch watch;
    const auto error = estimateError(*snapshot.film, PixelSet::All, snapshot.seen->paths);
    estimate_seconds_ = watch.seconds();
    // The first samples do not know it yet; the chart begins with the first that do.
    constexpr std::uint64_t kFirstSamples = 8;
    const bool known = error && error->known();
    if (known || snapshot.film->samples.count() > kFirstSamples) estimated_.emplace();
    if (!known) return;
    const ErrorPoint point{.seconds = snapshot.seconds,
                           .samples = static_cast<double>(snapshot.film->samples.count()),
                           .error = error->relative_rmse,
                           .lower = error->relative_rmse_95.lower,
                           .upper = error->relative_rmse_95.upper};
    state_.update([&](Status& status) {
        // The same film shown in other colours has no new error.
        if (!status.errors.empty() && status.errors.back().samples == point.samples) return;
        status.errors.push_back(point);
        if (status.errors.size() <= kMostPoints) return;
        // Every other one, the first and the last among them.
        for (std::size_t i = 1; 2 * i <= kMostPoints; ++i) status.errors[i] = status.errors[2 * i];
        status.errors.resize(kMostPoints / 2 + 1);
    });
}

}  // namespace crt
