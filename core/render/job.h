/// One render from scene file to images: the whole way through crt, on one page (job.cpp).
#pragma once

#include "render/render.h"
#include "render/watch.h"
#include "scene/yaml/scene_yaml.h"

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace crt {

/// A scene file, and what the command line changes in it.
struct SceneRequest {
    std::string file;
    std::vector<SceneOverride> overrides;
    std::optional<std::uint64_t> seed;       ///< Instead of the scene's.
    std::optional<std::array<int, 4>> crop;  ///< Instead of the scene's; x0, y0, x1, y1, half open.
};

/// Reads it. Throws crt::Error.
Scene loadScene(const SceneRequest& request);

/// The options of the command line, checked as far as possible without the scene.
struct Job : RenderOptions {
    SceneRequest scene;

    bool resume = false;
    std::string resume_file;                 ///< Empty: the checkpoint of this job.
    bool resume_where_possible = false;      ///< Resume if there is a checkpoint of this job.
    std::string
        checkpoint_file;  ///< Empty: beside the first output, and only when resuming or when stopped short.
    double checkpoint_interval_seconds = 600;
    bool overwrite = false;                  ///< Also a film of more samples, or what is no film.

    std::vector<std::string> outputs;        ///< Instead of the scene's.
    /// Gives every output its name in this job, those of the scene too. Empty: it stays.
    std::function<std::string(const std::string&)> output_name{};
    bool expose_automatically = false;       ///< By the film, instead of the scene's exposure.
    std::optional<std::string> report_file;  ///< Unset: beside the first output. Empty: none.
    std::string command;                     ///< As typed, for the report.
    /// Gets the film, once all is written, and the names of the denoised images. Where it is set, the film
    /// is kept. Empty: the images are not denoised.
    std::function<void(const std::string& film, const std::vector<std::string>& denoised)> denoise{};
    std::string frame;                       ///< The request of a frame, for its report; else empty.
};

/// Where the report of a job goes that has its usual place, by the outputs of the command line or the scene.
std::string reportOf(const Job& job, const Scene& scene);

/// Runs the job and returns the exit code: 0, or that of the StopRequest that ended the sampling early.
/// Throws crt::Error for everything that goes wrong; when the device fails while rendering, after what there
/// was has been saved.
int runJob(const Job& job, Watch& watch);

}  // namespace crt
