/// Applies `--vary` to a scene, and sets its size.
#pragma once

#include "render/job.h"
#include "scene/scene.h"

#include <string>
#include <vector>

namespace crt::converge {

/// "sampler=sobol,independent": a key of the scene, or a short name of one, and the values it takes.
struct Vary {
    std::string key;   ///< As written, for labels.
    std::string path;  ///< In the scene: "sampler.type".
    std::vector<std::string> values;
};
/// Throws crt::Error(Usage).
Vary parseVary(const std::string& text);

/// One combination of what varies, as label and changes of the scene.
struct Variant {
    std::string label;
    std::vector<SceneOverride> changes;
};
std::vector<Variant> variantsOf(const std::vector<Vary>& vary);

/// The scene, its longer side of `resolution` pixels where no size was asked for (0: as it is): error
/// against time does not need 2 million pixels.
Scene loadSmall(SceneRequest request, const std::vector<SceneOverride>& changes, int resolution);

}  // namespace crt::converge
