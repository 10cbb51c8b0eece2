/// What a scene may ask for, where the file itself is fine: radiance that single precision carries, and memory in proportion to the files.
#pragma once

#include "scene.h"

#include <cstdint>
#include <string>
#include <vector>

namespace crt {

/// W·m⁻²·sr⁻¹·nm⁻¹. A float goes from 1e-38 to 3e38; what lies between these bounds and those is room for the factors that a path multiplies
/// radiance by (areas over squared distances, 1/pdf), so that neither a bright sample becomes infinite nor a dim one zero.
inline constexpr double kMostRadiance = 1e25;
inline constexpr double kLeastRadiance = 1e-25;

/// Throws crt::Error(Scene), with the place, when a light of the scene is above kMostRadiance or the brightest is below kLeastRadiance: the image
/// would be wrong or black without a word. Warns of a lamp that is too dim beside others to shine at all.
void checkRadiance(const Scene& scene);

}  // namespace crt
