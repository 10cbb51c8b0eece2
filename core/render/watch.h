/// Lets a caller follow long work and end it early.
#pragma once

#include "film/error_estimate.h"

#include <cstdint>
#include <optional>
#include <string>

namespace crt {

/// Progress of a render.
struct ProgressState {
    double samples = 0;  ///< Per pixel, with those of a resumed film; a fraction while a chunk runs.
    std::uint64_t target = 0;       ///< Samples per pixel to reach; 0: until the time is up.
    double start_samples = 0;       ///< Per pixel, in the film before this run.
    double elapsed_seconds = 0;     ///< Of this run.
    double time_limit_seconds = 0;  ///< 0: none.
    std::uint64_t pixels = 0;       ///< Of the crop window.
    std::string label;  ///< Instead of the samples, for work that is not one render. With target 0
                        ///< its length is unknown.
    double target_error = 0;        ///< half_width_95 to stop at; 0: none.
    std::optional<ErrorEstimate> error;  ///< Of the image so far.
    bool light_is_missing = false;       ///< Light that the stated error does not include.

    /// Camera paths per second of this run; 0 while unknown.
    double pathsPerSecond() const;
    /// Part done, in [0,1]: of the samples or of the time, whichever ends the render first.
    double fraction() const;
    /// Seconds until the samples are there or the time is up; negative while unknown.
    double secondsLeft() const;
};

/// A request to stop after the chunk that is being rendered, unless it takes too long (sampling.h).
struct StopRequest {
    std::string cause;  ///< For the report and the log: "SIGINT", "the caller".
    int exit_code = 1;  ///< A command that is stopped in this way returns it.
};

/// The base class watches nothing and never stops.
class Watch {
public:
    Watch() = default;
    virtual ~Watch() = default;
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;

    /// Samples are about to be rendered: from now on a stop must not lose them.
    virtual void renderingBegins() {}
    /// No more samples follow. Called without renderingBegins() where none was missing.
    virtual void renderingEnds() {}
    /// Called often; cheap in every implementation. [any thread]
    virtual void progress(const ProgressState&) {}
    /// Asked between chunks, and within long ones. Nothing: go on. [any thread]
    virtual std::optional<StopRequest> stopRequested() { return std::nullopt; }
};

/// Begins and ends rendering for a Watch.
class WatchedRendering {
public:
    explicit WatchedRendering(Watch& watch) : watch_(watch) { watch_.renderingBegins(); }
    ~WatchedRendering() { watch_.renderingEnds(); }
    WatchedRendering(const WatchedRendering&) = delete;
    WatchedRendering& operator=(const WatchedRendering&) = delete;

private:
    Watch& watch_;
};

}  // namespace crt
