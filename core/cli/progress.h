/// Tells how far a render is: a bar on a terminal, otherwise a line every ten seconds.
#pragma once

#include "error_estimate.h"

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>

namespace crt {

enum class ProgressMode {
    Auto,   ///< A bar when stderr is a terminal that can move its cursor, else lines.
    Bar,
    Lines,  ///< At most one per ten seconds, through the log. Never a carriage return: log files keep every one.
    None,
};

/// Where a render stands.
struct ProgressState {
    double samples = 0;              ///< Per pixel, those of a resumed checkpoint included; a fraction while a chunk runs.
    std::uint64_t target = 0;        ///< Samples per pixel to reach; 0 means until the time is up.
    double start_samples = 0;        ///< Per pixel, there before this run began.
    double elapsed_seconds = 0;      ///< Of this run.
    double time_limit_seconds = 0;   ///< 0: none.
    std::uint64_t pixels = 0;        ///< Of the crop window.
    std::string label;               ///< In place of the samples, for work that is not one render; with target 0 how far
                                     ///< it is cannot be told.
    double target_error = 0;         ///< half_width_95 to stop at; 0: none.
    std::optional<ErrorEstimate> error;  ///< Of the image so far.

    /// Camera paths per second of this run; 0 while unknown.
    double pathsPerSecond() const;
    /// Part done, in [0,1]: of the samples or of the time, whichever ends the render first.
    double fraction() const;
    /// Seconds until the samples are there or the time is up, or negative while unknown.
    double secondsLeft() const;
};

/// "43 %  28/64 spp  12.3 Mpaths/s  0:42 left  error 1.90 % (1.86-1.94)  1 % at 54-110 spp, in 0:40-2:12"; a target error stands instead of 1 %.
std::string progressText(const ProgressState& state);
/// The same for a log: not aligned.
std::string progressLine(const ProgressState& state);
/// The same behind a bar, fitted into `columns`.
std::string progressBar(const ProgressState& state, int columns);

/// "0:42", "12:05", "3:07:15".
std::string clockText(double seconds);
/// "850 ms", "12.3 s", "4 min 10 s".
std::string durationText(double seconds);
/// "12.3 Mpaths/s": a rate with the prefix that suits it.
std::string rateText(double per_second, const char* unit);
/// "1.9 %"
std::string percentText(double fraction);
/// "error 1.90 % (1.86-1.94)": relative root mean square error with its 95 % interval; "error below 9 %" where only a
/// bound is known; "error not yet known" where too few paths carry the light. ASCII, so that bytes are columns.
std::string errorText(const ErrorEstimate& error);
/// "1200-3400": an interval of numbers of samples, two digits each.
std::string sampleCountText(const stats::Interval& samples);
/// "138 MB"
std::string bytesText(double bytes);

/// Draws. While one with a bar lives it owns the last line of the terminal: log messages go above it.
class Progress {
public:
    explicit Progress(ProgressMode mode);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// Shows `state` if the last one has been shown long enough. Cheap otherwise. [any thread]
    void update(const ProgressState& state);

    /// Never Auto.
    ProgressMode mode() const { return mode_; }

private:
    using Clock = std::chrono::steady_clock;
    static void aroundMessage(bool before_message, void* user);
    void draw();
    void clear();

    ProgressMode mode_;
    std::mutex mutex_;
    Clock::time_point shown_at_;
    std::string text_;       ///< What the bar shows; empty before the first update.
};

}  // namespace crt
