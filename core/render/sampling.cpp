#include "render/sampling.h"

#include "base/log.h"
#include "base/stopwatch.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <mutex>
#include <new>
#include <system_error>
#include <utility>

namespace crt {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kChunkSeconds =
    0.4;  // Aimed at, so that the promised half second holds when a chunk is dearer than the last.
constexpr double kFixedShare = 0.2;  // Of a chunk may go into what does not depend on its samples.
constexpr std::uint64_t kChunkGrowth =
    8;  // The first chunk may hold a kernel's warm-up; it says little about the next.
constexpr double kReadShare =
    0.02;  // Of the time may go into reading the film back for safety and for the error estimate.
constexpr double kReadBytesPerSecond = 2e9; // First guess of what reading costs; measured from then on.

/// Thrown through a chunk that is not waited for any more.
struct ChunkGivenUp {};

/// Number of samples of the next chunk.
class ChunkSizer {
public:
    explicit ChunkSizer(std::uint64_t fixed) : fixed_(fixed) {}

    std::uint64_t next(double seconds_left) const {
        if (fixed_ > 0) return fixed_;
        if (last_count_ == 0) return 1;
        const double per_sample = std::max(last_seconds_, 1e-7) / static_cast<double>(last_count_);
        const double sampling = std::max(kChunkSeconds, fixed_seconds_ * (1 / kFixedShare - 1));
        const double affordable =
            std::min(std::min(sampling, seconds_left - fixed_seconds_) / per_sample, 1e15);
        if (affordable < 1) return 1;
        return std::clamp<std::uint64_t>(static_cast<std::uint64_t>(affordable), 1,
                                         last_count_ * kChunkGrowth);
    }

    /// Per second, in the last chunk; 0 before there is one.
    double rate() const {
        return last_count_ > 0 ? static_cast<double>(last_count_) / std::max(last_seconds_, 1e-9) : 0;
    }

    /// `fixed_seconds` of `seconds` would have been the same with any other count.
    void finished(std::uint64_t count, double seconds, double fixed_seconds) {
        last_count_ = count;
        last_seconds_ = seconds - fixed_seconds;
        fixed_seconds_ = fixed_seconds;
    }

private:
    std::uint64_t fixed_;
    std::uint64_t last_count_ = 0;
    double last_seconds_ = 0, fixed_seconds_ = 0;
};

/// Decides that a chunk is given up: one that goes on too long after something has asked it to stop. A
/// sample may take hours, and a path without end never comes back.
class Patience {
public:
    explicit Patience(std::function<bool()> asked_to_stop) : asked_to_stop_(std::move(asked_to_stop)) {}

    void chunkBegins() {
        const std::lock_guard lock(mutex_);
        began_at_ = advanced_at_ = Clock::now();
        furthest_ = -1;
        stop_at_.reset();
    }

    /// Throws ChunkGivenUp. `done`: of the chunk. [any thread]
    void look(double done) {
        const std::lock_guard lock(mutex_);
        const Clock::time_point now = Clock::now();
        if (done > furthest_) {
            furthest_ = done;
            advanced_at_ = now;
        }
        // Shorter ones end by themselves.
        if (now - began_at_ < kShortChunk) return;
        if (!stop_at_) {
            if (!asked_to_stop_()) return;
            stop_at_ = now;
        }
        const bool stands_still = now - std::max(advanced_at_, *stop_at_) >= kStandstill;
        const bool takes_too_long = now - *stop_at_ >= kLongest + (*stop_at_ - began_at_);
        if (stands_still || takes_too_long) throw ChunkGivenUp();
    }

private:
    static constexpr std::chrono::seconds kShortChunk{1}, kStandstill{5}, kLongest{60};

    std::function<bool()> asked_to_stop_;
    std::mutex mutex_;
    Clock::time_point began_at_, advanced_at_;
    double furthest_ = -1;
    std::optional<Clock::time_point> stop_at_;
};

/// The film on the host, kept close behind the one on the device.
class FilmReader {
public:
    FilmReader(DeviceFilm& devices, Film& film, const PathFacts& paths)
        : devices_(devices),
          film_(film),
          paths_(paths),
          read_seconds_(static_cast<double>(film.sums.size() * sizeof(double)) / kReadBytesPerSecond) {
        // A film that begins empty need not be kept twice, nor one that only ever grows.
        if (film.samples.count() > 0 && !devices.inBands()) before_ = film;
    }

    /// film = what was there before + what the device has by now.
    void read() {
        const Stopwatch reading;
        copy();
        estimate();
        read_seconds_ = reading.seconds();
    }

    /// The same without looking at the error: the device waits for no more than the copy.
    void copy() {
        current_ = true;
        unread_.clear();
        if (devices_.inBands()) {
            before_.reset();
            devices_.readFilm(film_);
            return;
        }
        if (film_.samples.count() == 0) {
            devices_.readFilm(film_);
        } else {
            // Beside the last one, which must stay whole should the device fail now.
            if (!next_) next_.emplace(film_.shape());
            next_->samples = SampleRanges();
            devices_.readFilm(*next_);
            if (before_) next_->add(*before_);
            std::swap(film_, *next_);
        }
        since_read_ = Stopwatch();
    }

    void deviceAdvanced(SampleRange samples) {
        current_ = false;
        unread_.push_back(samples);
    }
    /// The samples that the device has rendered since the last read.
    std::vector<SampleRange> takeUnread() { return std::exchange(unread_, {}); }
    /// The device's film is empty again.
    void deviceRestarted() {
        current_ = true;
        before_.reset();
        if (film_.samples.count() > 0) before_ = film_;
    }
    /// Is it time to read again, within the share of time that reading may take?
    bool due() const { return !current_ && since_read_.seconds() >= read_seconds_ / kReadShare; }
    bool current() const { return current_; }
    const std::optional<ErrorEstimate>& error() const { return error_; }

private:
    void estimate() {
        error_ = estimateError(film_, PixelSet::All, paths_);
        since_read_ = Stopwatch();
    }

    DeviceFilm& devices_;
    Film& film_;
    PathFacts paths_;
    std::optional<Film> before_, next_;
    double read_seconds_;
    std::optional<ErrorEstimate> error_;
    std::vector<SampleRange> unread_;
    Stopwatch since_read_;
    bool current_ = true;  // The device's film begins empty.
};

}  // namespace

std::uint64_t nextTargetCheck(std::uint64_t samples, std::uint64_t pixels) {
    constexpr std::uint64_t kFirstCheck = 64, kPaths = 1u << 20;
    const std::uint64_t first =
        std::bit_ceil(std::max(kFirstCheck, kPaths / std::max<std::uint64_t>(pixels, 1)));
    return samples < first ? first : std::bit_floor(samples) * 2;
}

bool reachesTarget(const Film& film, double target, const PathFacts& paths) {
    const auto reached = [&](PixelSet which) {
        const std::optional<ErrorEstimate> error = estimateError(film, which, paths);
        return error && error->known() && error->half_width_95 <= target;
    };
    const bool one_pixel = film.counts.size() == 1;
    return reached(PixelSet::All) && reached(PixelSet::Even) && (one_pixel || reached(PixelSet::Odd));
}

std::vector<SampleRange> missingSamples(SampleRange wanted, const SampleRanges& there) {
    std::vector<SampleRange> missing;
    std::uint64_t next = wanted.first;
    for (const auto& [first, end] : there.ranges()) {
        if (first >= wanted.second) break;
        if (first > next) missing.emplace_back(next, first);
        next = std::max(next, end);
    }
    if (next < wanted.second) missing.emplace_back(next, wanted.second);
    return missing;
}

SamplingResult sampleFilm(DeviceFilm& devices, Film& film, const SamplingPlan& plan, Watch& watch,
                          const std::function<void()>& checkpoint) {
    const Stopwatch sampling;
    Stopwatch since_checkpoint;
    SamplingResult result;
    ChunkSizer sizer(plan.chunk);
    FilmReader reader(devices, film, plan.paths);
    if (plan.on_devices.second > plan.on_devices.first) reader.deviceAdvanced(plan.on_devices);
    result.rendered = plan.on_devices.second - plan.on_devices.first;

    ProgressState state;
    const std::uint64_t resumed = film.samples.count();
    state.start_samples = static_cast<double>(resumed);
    state.samples = static_cast<double>(resumed + result.rendered);
    state.target = plan.target;
    state.time_limit_seconds = plan.time_limit_seconds;
    state.target_error = plan.target_error;
    state.light_is_missing = plan.light_is_missing;
    state.pixels = film.counts.size();

    const std::uint64_t begun = resumed + result.rendered;
    std::uint64_t check_at = nextTargetCheck(begun > 0 ? begun - 1 : 0, film.counts.size());
    const auto targetReached = [&] {
        if (plan.target_error <= 0 || resumed + result.rendered < check_at) return false;
        check_at = nextTargetCheck(resumed + result.rendered, film.counts.size());
        if (!reader.current()) reader.read();
        return reachesTarget(film, plan.target_error, plan.paths);
    };

    // Reason to stop before all samples are taken, even within a chunk; nothing if there is none.
    const auto reasonToHurry = [&]() -> std::optional<StopReason> {
        if (const std::optional<StopRequest> request = watch.stopRequested()) {
            result.request = *request;
            return StopReason::Interrupted;
        }
        if (plan.time_limit_seconds > 0 && sampling.seconds() >= plan.time_limit_seconds)
            return StopReason::Time;
        return std::nullopt;
    };
    const auto reasonToStop = [&]() -> std::optional<StopReason> {
        if (const auto reason = reasonToHurry()) return reason;
        if (targetReached()) return StopReason::Target;
        return std::nullopt;
    };
    const auto paceBefore = [&](std::uint64_t next, std::uint64_t end) {
        ProgressState now = state;
        now.elapsed_seconds = sampling.seconds();
        double left = now.secondsLeft();
        if (state.error && state.error->known() && plan.target_error > 0) {
            // An error falls with the root of the number of samples.
            const double times = std::pow(state.error->half_width_95 / plan.target_error, 2);
            const double until_target = now.elapsed_seconds * std::max(0.0, times - 1);
            left = left < 0 ? until_target : std::min(left, until_target);
        }
        return SamplingPace{now.elapsed_seconds, left, sizer.rate(), state.pixels, next, end};
    };
    Patience patience([&] { return reasonToHurry().has_value(); });

    const auto renderChunk = [&](std::uint64_t first, std::uint64_t count) {
        const Stopwatch chunk;
        // Called from the plugin's threads: works on its own copy of the state.
        const auto show = [&watch, &patience, &sampling, count, before = state](double done) {
            patience.look(done);
            ProgressState now = before;
            now.samples += std::clamp(done, 0.0, 1.0) * static_cast<double>(count);
            now.elapsed_seconds = sampling.seconds();
            watch.progress(now);
        };
        patience.chunkBegins();
        show(0);
        devices.render({.first_sample = first, .sample_count = count}, show);
        patience.chunkBegins();  // Finished samples are kept.
        show(1);  // Of a plugin's threads the last to finish need not be the last to have said so.
        reader.deviceAdvanced({first, first + count});
        // In bands nothing of it is on the devices any more, and a failure later shall not cost it.
        const bool due = reader.due();
        if (devices.inBands()) reader.copy();
        sizer.finished(count, chunk.seconds(), devices.inBands() ? devices.fixedSeconds() : 0);
        result.rendered += count;
        ++result.chunks;
        if (due) reader.read();
        if (plan.checkpoint_interval_seconds > 0 &&
            since_checkpoint.seconds() >= plan.checkpoint_interval_seconds &&
            (!plan.checkpoint_possible || plan.checkpoint_possible())) {
            const Stopwatch pause;
            if (!reader.current()) reader.copy();
            checkpoint();
            since_checkpoint = Stopwatch();
            logDebug("checkpoint: the device waited for {:.3f} s", pause.seconds());
        }
        state.samples = state.start_samples + static_cast<double>(result.rendered);
        state.error = reader.error();
    };

    const auto renderAll = [&]() -> StopReason {
        for (const auto& [first, end] : plan.ranges)
            for (std::uint64_t next = first; next < end;) {
                if (const auto reason = reasonToStop()) return *reason;
                if (plan.overtaken && plan.overtaken(paceBefore(next, end))) return StopReason::Overtaken;
                const double left = plan.time_limit_seconds > 0
                                        ? plan.time_limit_seconds - sampling.seconds()
                                        : kChunkSeconds;
                std::uint64_t count = std::min(sizer.next(left), end - next);
                if (plan.target_error > 0) count = std::min(count, check_at - (resumed + result.rendered));
                renderChunk(next, count);
                next += count;
            }
        return StopReason::Samples;
    };

    // A device whose chunk was given up holds a part of it, and cannot be read: what it had before is
    // rendered again, which takes no longer than it did.
    const auto recoverUnread = [&] {
        const std::vector<SampleRange> lost = reader.takeUnread();
        if (lost.empty() || devices.inBands()) return;
        devices.setScene();
        reader.deviceRestarted();
        for (const auto& [first, end] : lost) {
            patience.chunkBegins();
            devices.render({.first_sample = first, .sample_count = end - first},
                           [&patience](double done) { patience.look(done); });
            reader.deviceAdvanced({first, end});
        }
        reader.copy();
    };
    const auto loseUnread = [&] { result.rendered = film.samples.count() - resumed; };
    const auto fail = [&](const Error& error) {
        result.stop = StopReason::Failed;
        result.failure = error;
        loseUnread();
    };
    try {
        result.stop = renderAll();
        if (!reader.current()) reader.copy();
    } catch (const ChunkGivenUp&) {
        result.gave_up = true;
        result.stop = reasonToHurry().value_or(StopReason::Time);
        try {
            recoverUnread();
        } catch (const ChunkGivenUp&) {
            logDebug("some earlier samples are lost, too");
        } catch (const std::exception& error) {
            logWarning("some earlier samples are lost, too: {}", error.what());
        }
        loseUnread();
        if (film.samples.count() == 0 && result.stop == StopReason::Time)
            fail(Error(ErrorKind::Usage,
                       fmt::format("not all pixels have a sample after {:.0f} s, and the time is up; give "
                                   "more --time, or lower integrator.max_depth or film.resolution",
                                   sampling.seconds())));
        else
            logWarning("the samples in progress are left out: they took too long after the render was "
                       "stopped");
    } catch (const Error& error) {
        fail(error);
    } catch (const std::bad_alloc&) {
        fail(Error(ErrorKind::Device, "out of memory on the host: a smaller film needs less"));
    } catch (const std::system_error& error) {  // A thread that cannot be started.
        fail(Error(ErrorKind::Device,
                   fmt::format("the operating system refused a resource: {}", error.what())));
    }
    result.seconds = sampling.seconds();
    return result;
}

}  // namespace crt
