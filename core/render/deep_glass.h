/// Finds views through more surfaces of glass than `max_depth` lets paths pass.
#pragma once

#include "scene/scene.h"

#include <optional>

namespace crt {

struct DeepGlass {
    double share = 0;  ///< Of the view: where paths end within the glass, or nearly all do.
    int surfaces = 0;  ///< The most that one ray of the view meets in a row.
};

/// Follows up to 256 rays of the camera straight through smooth and rough glass to the nearest opaque
/// surface. Light that is reflected between the surfaces needs further scattering events: a ray counts if
/// its surfaces, a quarter as many, and the event behind them are more than `max_depth`. Nothing below a
/// hundredth of the view, or in scenes with glass and more than four million triangles, in which looking
/// takes long. Glass disks and cylinders are passed over.
std::optional<DeepGlass> deepGlass(const Scene& scene);

}  // namespace crt
