/// The report of a run as JSON: enough to repeat it, to compare two machines, and to see its features and
/// costs.
#pragma once

#include "backend/crt_backend.h"
#include "backend/device_group.h"
#include "compile/compile.h"
#include "film/error_estimate.h"
#include "film/film.h"
#include "render/sampling.h"
#include "scene/scene.h"

#include <cstdint>
#include <string>
#include <vector>

namespace crt {

/// Everything the report says that is not in Scene or CompiledScene. Times in seconds on the wall clock.
struct RunFacts {
    std::string command;  ///< As typed, quoted for a shell.
    std::string frame;    ///< Of a frame of a sequence; else empty.

    std::string backend_name, backend_path, backend_version, backend_build;
    std::string driver;
    CrtBackendReport backend{};
    std::vector<DeviceShare> devices;

    double open_seconds = 0;      ///< Loading the plugin and opening its device.
    double prepare_seconds = 0;   ///< All of set_scene: upload, acceleration structure, kernel.
    double sampling_seconds = 0;  ///< From the first chunk to the last, reading the film included.
    double write_seconds = 0;     ///< Images and checkpoints.
    double total_seconds = 0;     ///< From the command line to this report.

    std::uint64_t target_samples = 0;   ///< Per pixel; 0 means as many as the time allowed.
    std::uint64_t resumed_samples = 0;  ///< Per pixel, from the checkpoint.
    std::uint64_t rendered_samples = 0; ///< Per pixel, by this run.
    SampleRanges samples;               ///< All that are in the film.
    std::uint64_t chunks = 0;
    std::uint64_t film_bands = 1;       ///< In which the film was rendered; 1: as a whole.
    std::uint64_t invalid_samples = 0;
    std::uint64_t dropped_splats = 0;  ///< NaN, infinite or too large (kernel/film/splat.h).
    std::optional<ErrorEstimate> error; ///< Of the film, by all replicates; nothing while unknown.
    std::optional<ErrorEstimate> even_pixels,
        odd_pixels;  ///< With a target error: both must reach it.
    double target_error = 0;            ///< 0: none.

    StopReason stop = StopReason::Samples;
    bool gave_up = false;  ///< SamplingResult::gave_up
    StopRequest request;  ///< With StopReason::Interrupted.
    std::string failure;  ///< The sentence, when something failed.
    int exit_code = 0;
    int warnings = 0;
    std::vector<std::string> outputs;  ///< Files written.
};

/// The report as JSON text.
std::string reportJson(const Scene& scene, const CompiledScene& compiled, const RunFacts& facts);

/// featureNames(), one by one.
std::vector<std::string> featureList(std::uint64_t mask);

}  // namespace crt
