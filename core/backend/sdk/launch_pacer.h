/// Cuts a render range into launches of a wanted duration, so that progress shows and a cancel is obeyed in
/// time whatever the scene costs. Header-only and free of the core: a backend that works in launches
/// includes it. Never changes the image.
#pragma once

#include "backend/crt_backend.h"

#include <algorithm>
#include <cstdint>

namespace crt {

/// Samples [first_sample, first_sample + sample_count) of the pixels [x0,x1) × [y0,y1).
struct Launch {
    std::uint32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    std::uint32_t sample_count = 0;
    std::uint64_t first_sample = 0;

    std::uint64_t pixels() const { return std::uint64_t{x1 - x0} * (y1 - y0); }
    std::uint64_t paths() const { return pixels() * sample_count; }
};

/// Seconds that a launch took, from the clock of its device (nanoseconds, at its start and end) and the time
/// that the host waited for it. Some drivers give the same moment twice, or none in order. So the device is
/// believed within what the wait allows: no more than the wait, and no less than a sixteenth of it, which is
/// what the launch itself may cost beside a short kernel. A launch then takes at most sixteen times the
/// wanted time, whatever the device says.
inline double launchSeconds(std::uint64_t start_ns, std::uint64_t end_ns, double waited_seconds) {
    constexpr double kLeastShareOfWait = 1.0 / 16;
    if (end_ns <= start_ns) return waited_seconds;
    return std::clamp(static_cast<double>(end_ns - start_ns) * 1e-9, kLeastShareOfWait * waited_seconds,
                      waited_seconds);
}

/// Learns from every launch how many paths fit into the wanted time, and keeps that from one range to the
/// next.
///
///     pacer.begin(range, tile_size);
///     for (Launch launch; pacer.next(launch);) {
///         …
///         pacer.finished(launch, seconds);
///         progress(pacer.done());
///     }
class LaunchPacer {
public:
    /// `first_paths` is the size of the very first launch: small enough to be quick on the slowest device.
    /// Launches are cut between rows that are multiples of `row_step` apart where the budget allows it, for
    /// devices that work on blocks of pixels. `least_paths` is how many paths the device traces beside each
    /// other in about the time of the longest: smaller launches would be more, and none of them shorter.
    /// `most_growth`: a launch over the one before, since neighbouring parts of an image may differ much in
    /// cost. A launch that can be stopped in between may grow faster.
    LaunchPacer(double target_seconds, std::uint64_t first_paths, std::uint32_t row_step = 1,
                std::uint64_t least_paths = 1, double most_growth = 4)
        : target_seconds_(target_seconds),
          least_(static_cast<double>(least_paths)),
          budget_(std::max(static_cast<double>(first_paths), least_)),
          most_growth_(most_growth),
          row_step_(row_step) {}

    /// Starts a range. `tile_size` 0 works through it in the largest pieces that the budget allows.
    void begin(const CrtRenderRange& range, std::uint32_t tile_size) {
        range_ = range;
        width_ = range.x1 - range.x0;
        height_ = range.y1 - range.y0;
        tile_width_ = tile_size != 0 ? std::min(tile_size, width_) : width_;
        tile_height_ = tile_size != 0 ? std::min(tile_size, height_) : height_;
        sample_ = finished_ = 0;
        total_ = std::uint64_t{width_} * height_ * range.sample_count;
        beginPass();
    }

    /// The next launch, or false when the range is covered.
    bool next(Launch& launch) {
        if (total_ == 0 || sample_ >= range_.sample_count) return false;
        launch.first_sample = range_.first_sample + sample_;
        launch.sample_count = chunk_;
        launch.x0 = range_.x0 + x_;
        launch.x1 = launch.x0 + std::min(tile_width_, width_ - x_);
        launch.y0 = range_.y0 + y_;
        launch.y1 = launch.y0 + rows();
        advance(launch.y1 - launch.y0);
        return true;
    }

    /// Tells how long a launch took. A time that is not above 0 is none, and changes nothing.
    void finished(const Launch& launch, double seconds) {
        const double paths = static_cast<double>(launch.paths());
        finished_ += launch.paths();
        if (!(seconds > 0)) return;
        const double fitting = paths * target_seconds_ / std::max(seconds, 1e-6);
        // A launch much below the budget says little about larger ones: its fixed cost hides the rate.
        if (paths < 0.4 * budget_ && seconds < target_seconds_) return;
        // Half-way, because one part of an image says little about the next.
        budget_ =
            std::max(std::clamp(0.5 * (budget_ + fitting), 0.25 * budget_, most_growth_ * budget_), least_);
    }

    /// Share of the range that is finished.
    double done() const {
        return total_ == 0 ? 1.0 : static_cast<double>(finished_) / static_cast<double>(total_);
    }

private:
    /// Samples per pixel and launch where a pass over all pixels exceeds the budget: enough that reading and
    /// writing a pixel's sums costs nothing beside its paths.
    static constexpr std::uint64_t kWorthwhileSamples = 16;

    static std::uint64_t divideUp(std::uint64_t a, std::uint64_t b) { return (a + b - 1) / b; }

    /// Divides `left` into equal parts of at most about `wanted`, so that no small remainder is launched by
    /// itself; the size of the next.
    static std::uint64_t evenPart(std::uint64_t left, std::uint64_t wanted) {
        wanted = std::clamp<std::uint64_t>(wanted, 1, left);
        return divideUp(left, divideUp(left, wanted));
    }

    /// Chooses the samples per pixel of the next pass over all pixels.
    void beginPass() {
        x_ = y_ = row_in_tile_ = 0;
        if (total_ == 0 || sample_ >= range_.sample_count) return;
        const std::uint64_t left = range_.sample_count - sample_;
        const auto budget = static_cast<std::uint64_t>(budget_);
        std::uint64_t chunk = budget / (std::uint64_t{tile_width_} * tile_height_);
        if (chunk < kWorthwhileSamples)  // then in bands of rows, of one row at least
            chunk = std::min(kWorthwhileSamples, budget / (std::uint64_t{tile_width_} * row_step_));
        chunk_ = static_cast<std::uint32_t>(evenPart(left, std::min<std::uint64_t>(chunk, 0x40000000u)));
    }

    /// Rows of the launch at (x_, y_): as many as the budget allows, within the tile.
    std::uint32_t rows() const {
        const std::uint32_t left = std::min(tile_height_ - row_in_tile_, height_ - y_);
        const std::uint64_t wanted =
            static_cast<std::uint64_t>(budget_) / (std::uint64_t{tile_width_} * chunk_);
        const std::uint64_t even = divideUp(evenPart(left, wanted), row_step_) * row_step_;
        return static_cast<std::uint32_t>(std::min<std::uint64_t>(even, left));
    }

    void advance(std::uint32_t rows_taken) {
        y_ += rows_taken;
        row_in_tile_ += rows_taken;
        if (row_in_tile_ < tile_height_ && y_ < height_) return;
        y_ -= row_in_tile_;  // the top of the tile to the right
        row_in_tile_ = 0;
        x_ += tile_width_;
        if (x_ < width_) return;
        x_ = 0;
        y_ += tile_height_;
        if (y_ < height_) return;
        sample_ += chunk_;
        beginPass();
    }

    double target_seconds_;
    double least_;   ///< Paths of the smallest launch that is worth one.
    double budget_;  ///< Paths that one launch should trace.
    double most_growth_;
    std::uint32_t row_step_;

    CrtRenderRange range_{};
    std::uint32_t width_ = 0, height_ = 0, tile_width_ = 0, tile_height_ = 0;
    std::uint32_t x_ = 0, y_ = 0,
                  row_in_tile_ = 0;           ///< Where the next launch starts, from the range's corner.
    std::uint32_t chunk_ = 0;                 ///< Samples per pixel of this pass.
    std::uint64_t sample_ = 0;                ///< First sample of this pass, from the range's first.
    std::uint64_t finished_ = 0, total_ = 0;  ///< Paths.
};

}  // namespace crt
