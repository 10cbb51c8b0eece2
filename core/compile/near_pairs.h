/// Finds out in linear time, without a BVH, that no surface of a scene is too near to another.
#pragma once

#include "compile/compile.h"

namespace crt {

/// False only if findCoplanarLight and findNearSurfaces (near_surfaces.h) find nothing in a scene without
/// nodes, as in nearly all scenes. True if they may find something, or if it takes long to find out.
bool mayHaveNearSurfaces(const CompiledScene& scene);

}  // namespace crt
