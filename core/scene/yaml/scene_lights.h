/// The lights of a scene that have no surface.
#pragma once

#include "scene/scene.h"
#include "scene/yaml/scene_spectra.h"

namespace crt {

/// Reads the list `lights`. The scene's integrator must have been read: it decides what can shine.
void readLights(const YamlNode& list, Diagnostics& out, SceneFiles& files, SpectrumReader& spectra,
                Scene& scene);

}  // namespace crt
