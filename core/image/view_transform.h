/// Curves that bring light brighter than a screen's white onto the screen. For display formats alone.
#pragma once

#include "base/vec3d.h"

#include <array>

namespace crt {

/// None: linear up to white, and clipped above.
/// Filmic: the curve of K. Narkowicz ("ACES Filmic Tone Mapping Curve", 2015), for each of red, green and
/// blue: a fit of the Academy's tone scale, without its change of colours. Agx: T. Sobotka's AgX (2022) with
/// the matrices and the fit of its curve by B. Wrensch ("Minimal AgX Implementation", 2023), in its default
/// look: bright colours turn white.
enum class ViewTransform { None, Filmic, Agx };
inline constexpr std::array<const char*, 3> kViewTransformNames{"none", "filmic", "agx"};

/// The linear sRGB that a screen is to show for light of this linear sRGB. Values in [0, 1] but for None.
Vec3d onScreen(ViewTransform view, const Vec3d& linear_srgb);

}  // namespace crt
