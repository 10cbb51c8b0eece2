/// For scenes that were compiled without a BVH: what near_surfaces.h asks about, with a BVH over that alone.
#pragma once

#include "compile/compile.h"

namespace crt {

/// `scene`, which is without nodes, reduced to the triangles that can lie near those that near_surfaces.h
/// asks about, with nodes. Ids are those of `scene`, and near_surfaces.h finds in it what it finds in the
/// whole scene with a BVH.
CompiledScene nearScene(const CompiledScene& scene);

}  // namespace crt
