/// The loop at the heart of a render: sample ranges in chunks, until the samples are there, the time is up,
/// a signal comes or the device fails. Because a sample's value depends on nothing but scene, seed, pixel
/// and index, where it stops never shows in the image.
#pragma once

#include "base/error.h"
#include "film/error_estimate.h"
#include "film/film.h"
#include "render/device_film.h"
#include "render/watch.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace crt {

/// A sample index no render reaches: the end of "as many as the time allows".
inline constexpr std::uint64_t kEndlessSamples = std::uint64_t{1} << 53;

/// The part of `wanted` that `there` lacks, in order.
std::vector<SampleRange> missingSamples(SampleRange wanted, const SampleRanges& there);

/// Reason why sampling ended.
enum class StopReason {
    Samples,      ///< Every sample asked for is there.
    Time,         ///< --time is up.
    Target,       ///< The target error is reached.
    Interrupted,  ///< The Watch asked for it.
    Failed,       ///< The backend failed; the images hold what was rendered before.
    Overtaken,    ///< Another backend is faster, and is to render the rest.
};

/// The speed of a render, between two chunks.
struct SamplingPace {
    double seconds = 0;                             ///< Of the render so far.
    double seconds_left = 0;                        ///< Expected; negative while unknown.
    double samples_per_second = 0;                  ///< Per pixel, of the last chunk.
    std::uint64_t pixels = 0;                       ///< Of the film.
    std::uint64_t next_sample = 0, end_sample = 0;  ///< The range that is rendered next.
};

struct SamplingPlan {
    std::vector<SampleRange> ranges;     ///< To render, in order.
    SampleRange on_devices{0, 0};        ///< Rendered by the devices, and not yet in the film.
    std::uint64_t target = 0;  ///< Samples per pixel in the film when all ranges are there; 0: endless.
    double time_limit_seconds = 0;       ///< 0: none. Looked at between chunks, as a Watch is.
    PathFacts paths;                     ///< For the error of the film.
    bool light_is_missing = false;       ///< The error does not contain it: said with it.
    double target_error = 0;  ///< Stop when half_width_95 (error_estimate.h) is at most this; 0: never.
    std::uint64_t chunk = 0;             ///< Samples per chunk; 0: adaptive, at most half a second.
    double checkpoint_interval_seconds = 0;  ///< 0: never call `checkpoint`.
    std::function<bool()>
        checkpoint_possible{};  ///< When set and false, a checkpoint that is due waits for the next chunk.
    std::function<bool(const SamplingPace&)>
        overtaken{};  ///< When set, asked between chunks; true stops with StopReason::Overtaken.
};

struct SamplingResult {
    StopReason stop = StopReason::Samples;
    StopRequest request;            ///< With StopReason::Interrupted.
    std::optional<Error> failure;   ///< With StopReason::Failed.
    std::uint64_t rendered = 0;     ///< Samples per pixel added to the film.
    std::uint64_t chunks = 0;
    double seconds = 0;
    bool gave_up = false;  ///< A chunk was not waited for: the devices need the scene again.
};

/// The target error is looked at when the film holds a power of two of samples per pixel, at least 64 and a
/// million paths in all: looking all the time would stop at the luckiest moment, and looking early before a
/// caustic or a hidden lamp has been met at all.
std::uint64_t nextTargetCheck(std::uint64_t samples, std::uint64_t pixels);

/// True if half_width_95 is known and at most `target` for the image, and for its even and for its odd
/// pixels: the two independent halves guard against stopping by luck. An error that is not known
/// (error_estimate.h) stops nothing; and the wider the pixels' variances scatter, the farther the half-width
/// lies above the estimate.
bool reachesTarget(const Film& film, double target, const PathFacts& paths = {});

/// Adds the plan's samples to `film`. When the last device fails, `film` holds what was last read from it,
/// at most a small part of the run behind: a backend that failed cannot be asked for its film any more.
/// `checkpoint` may save the film, which is up to date when it is called. In bands (device_film.h) chunks
/// are longer: what a chunk costs besides its samples shall be no more than a fifth of it.
///
/// A chunk that runs when the render is to stop is finished. It is given up, and `film` holds the chunks
/// before it, where it stands still for 5 s, or takes longer after that moment than before it and a minute.
/// Where the time is up and `film` has no sample yet, that is a failure.
SamplingResult sampleFilm(DeviceFilm& devices, Film& film, const SamplingPlan& plan, Watch& watch,
                          const std::function<void()>& checkpoint);

}  // namespace crt
