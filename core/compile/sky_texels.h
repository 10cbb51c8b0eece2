/// Skies as images of the environment.
#pragma once

#include "compile/environment_image.h"

namespace crt {

/// Texels of the sky over `unit`, the environment's radiance: all of its colour.
EnvironmentTexels skyTexels(const CieSky& sky, const Spectrum& unit);

/// Each texel has the sky's luminance and, as a sigmoid times `unit`, its colour: X and Z are off by a
/// thousandth of X + Y + Z on average and a hundredth at most, the radiance at the model's wavelengths by 3
/// % on average (tests/unit_clear_sky.cpp). Throws crt::Error(Scene) as ClearSkyModel.
EnvironmentTexels skyTexels(const ClearSky& sky, const Spectrum& unit);

}  // namespace crt
