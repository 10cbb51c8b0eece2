/// `crt converge`: error against run time for scenes × backends × variants, within a budget of time.
/// Replicates of all configurations take turns, so that a machine that slows down slows all of them. This
/// file renders; fits.h says what it means, summary.json has it, and python/crt/report shows it.
#pragma once

#include "judge/converge/reference.h"
#include "judge/converge/variants.h"
#include "render/job.h"
#include "render/watch.h"

#include <cstdint>
#include <string>
#include <vector>

namespace crt::converge {

struct ConvergeRequest {
    std::vector<SceneRequest> scenes;
    std::vector<std::string> backends{"embree", "opencl", "cuda"};
    std::vector<Vary> vary;
    std::vector<std::string> references;   ///< Files, each matched with its scene, or one number.
    double seconds = 60;                   ///< For everything, start-up and report included.
    std::uint32_t replicates = 16;         ///< At least; more where time is left.
    std::uint64_t max_samples = std::uint64_t{1} << 24;
    int resolution = 128;  ///< Longer side in pixels where no reference and no --set says otherwise; 0: as
                           ///< the scene has it.
    IntegratorOptions integrator;
    std::string output = "converge";       ///< Folder.
    bool resume = false;
    std::string command;
};

/// Renders, fits, writes the report; the exit code: 0, 7 when a configuration's verdict is FAIL, that of the
/// StopRequest when interrupted (what there is is reported). Throws crt::Error.
int converge(const ConvergeRequest& request, Watch& watch);

}  // namespace crt::converge
