/// The surroundings of a scene: a radiance, an image or a sky.
#pragma once

#include "scene/scene.h"
#include "scene/yaml/scene_spectra.h"

#include <optional>
#include <vector>

namespace crt {

/// Reads the section `environment`. Nothing, with an error, when it is wrong. Images are looked for, and
/// read later (compile/environment_image.h). The sun of a clear sky is added to `lights`.
std::optional<Environment> readEnvironment(const SectionReader& section, SpectrumReader& spectra,
                                           SceneFiles& files, std::vector<PointLight>& lights);

}  // namespace crt
