/// Light of a scene that its image lacks however many samples it takes, because no path can find it. The
/// stated error is of the light that is found (docs/decisions/0054-missing-light.md).
#pragma once

#include "scene/scene.h"

#include <string>
#include <vector>

namespace crt {

/// Lights that scattered rays never meet: they have no size. Suns have one. None that is black.
std::vector<const PointLight*> lightsWithoutSize(const Scene& scene);

/// The missing light, each a part of a sentence: "light of point and spot lights that smooth glass refracts
/// or reflects". Empty: nothing that follows from the kinds of lights and surfaces and from the settings. It
/// depends on the geometry, which is not examined, whether light takes such a path at all.
std::vector<std::string> missingLight(const Scene& scene);

/// "the image lacks …; …", and what to do. One sentence, for what missingLight(scene) says, not empty.
std::string missingLightText(const std::vector<std::string>& missing, const Scene& scene);

}  // namespace crt
