/// Where coordinates in single precision are to be finest: at what the camera looks at, where the middle of
/// the scene is too far from it (docs/decisions/0055-digits-where-one-looks.md).
#pragma once

#include "base/vec3d.h"
#include "compile/placements.h"
#include "compile/shapes.h"
#include "scene/scene.h"

#include <optional>
#include <vector>

namespace crt {

/// In the author's units.
struct Focus {
    Vec3d centre;
    /// Size of the smallest details there: the radius of the least ball around the centre that holds a whole
    /// triangle, shape or instance.
    double detail;
};

/// Nothing where the middle of the scene will do: for objects of up to 2^-8 of the scene's half extent,
/// which lose eight bits there. An object counts as a whole, however fine its triangles are. Otherwise the
/// camera's position, or the point in the middle of its view, whichever has the finer details around it.
/// Moving a scene by representable amounts moves the result, scaling it by a power of two scales it, and the
/// order of triangles does not matter.
std::optional<Focus> focusOf(const Scene& scene, const std::vector<Placement>& placements,
                             const std::vector<PlacedShape>& shapes);

}  // namespace crt
