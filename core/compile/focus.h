/// Chooses where single-precision coordinates are finest: at the camera or at what it looks at, if the
/// middle of the scene is too far away (docs/decisions/0055-digits-where-one-looks.md).
#pragma once

#include "base/vec3d.h"
#include "compile/placements.h"
#include "compile/shapes.h"
#include "scene/scene.h"

#include <optional>
#include <vector>

namespace crt {

/// In the units of the scene file.
struct Focus {
    Vec3d centre;
    /// Size of the smallest details there: the radius of the least ball around the centre that holds a whole
    /// triangle, shape or instance.
    double detail;
};

/// Nothing if the middle of the scene will do: for objects larger than 2^-8 of the scene's half extent,
/// which lose at most eight bits there. An object counts as a whole, however fine its triangles are.
/// Otherwise the position of the camera, or the point in the middle of its view, whichever has the finer
/// details around it. The result moves with the scene by representable amounts, scales with powers of two,
/// and does not depend on the order of triangles.
std::optional<Focus> focusOf(const Scene& scene, const std::vector<Placement>& placements,
                             const std::vector<PlacedShape>& shapes);

}  // namespace crt
