/// The reference for errors: a known number, or a render that shares as little as possible with the images
/// that it judges.
///
/// A reference file is an EXR with the mean in R, G, B and, in Fold.0.R … Fold.7.B, the means of eight
/// independent eighths of its samples: its variance and the spread between eighths follow from them.
/// Metadata say how it was made and of which scene.
#pragma once

#include "backend/integrator.h"
#include "film/error_estimate.h"
#include "judge/converge/measurement.h"
#include "judge/stats/image_tests.h"
#include "render/job.h"
#include "render/watch.h"
#include "scene/scene.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace crt::converge {

inline constexpr std::uint32_t kFolds = 8;

/// The options of `crt reference`.
struct ReferenceRequest {
    SceneRequest scene;
    std::string backend = "auto";
    IntegratorOptions integrator;
    std::string output;
    std::uint64_t samples = 0;      ///< Per pixel in all; 0: as many as `seconds` allow.
    double seconds = 60;
    bool same_estimator =
        false;  ///< Keep integrator.nee as the scene has it: less noise, less independence.
};

/// Renders it and returns the exit code. Throws crt::Error.
int makeReference(const ReferenceRequest& request, Watch& watch);

/// The same for a scene that is read already; `request.scene` does not matter. Its costs and its noise, or
/// nothing if the Watch stopped it.
struct MadeReference {
    std::uint64_t samples = 0;  ///< Per pixel.
    std::string estimator;
    double seconds = 0;
    std::optional<ErrorEstimate> error;
    bool light_is_missing = false;  ///< Light that the error does not include (scene/missing_light.h).
};
std::optional<MadeReference> renderReference(Scene scene, const ReferenceRequest& request, Watch& watch);

/// The scene as a reference renders it: independent samples, another seed, no roulette, and light sampling
/// switched; but it stays on where the scene has lights that nothing else finds.
Scene referenceScene(Scene scene, bool same_estimator);

/// Hash of what is to be seen, without how: two scenes with it have the same expected light on the film.
/// Their images are the same when colourText() is, too.
std::string hashOfContent(const Scene& scene);

/// The development settings of the image: "exposure 0 EV, linear sRGB, no white balance".
std::string colourText(const Scene& scene);

/// A reference in memory, of the film's size.
struct Reference {
    ReferenceInfo info;
    std::uint32_t width = 0, height = 0;   ///< 0: one value for all pixels.
    std::vector<float> rgb;                ///< [height][width][3]; empty with one value.
    std::vector<float> luminance;          ///< [height][width]; one value when all pixels have it.
    std::vector<std::vector<float>> fold_luminance;        ///< kFolds planes; empty with one value.
    std::vector<std::vector<double>> fold_rgb;  ///< kFolds images, [height][width][3]; empty with one value.
};

/// "0.2394564705" is the luminance that every pixel has (a closed form); anything else a file of
/// makeReference's, which must be of this scene. Throws crt::Error(Usage).
Reference readReference(const std::string& text, const Scene& scene);

}  // namespace crt::converge
