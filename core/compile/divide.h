/// Large triangles in pieces: what rounding does to a triangle grows with its size, so near the focus of the
/// scene none is much larger than its distance from there (docs/decisions/0055-digits-where-one-looks.md).
#pragma once

#include "compile/focus.h"
#include "compile/placements.h"

#include <vector>

namespace crt {

/// Meshes in place of those of objects that have triangles to be divided. Edges decide: one is halved where
/// it is longer than twice the distance of its nearest point from the focus and the size of details there
/// together. So both triangles at an edge have the same corners on it, whatever objects they are of, and
/// nothing opens. Of a triangle that the focus is over some edge is always that long (Weitzenböck 1919:
/// a² + b² + c² ≥ 4√3 · area): pieces there have edges of up to five times that sum.
///
/// Left whole: what emits, whose triangles are lights; objects that are placed several times; and meshes
/// with colours of vertices, between which the kernel does not interpolate linearly. Their edges stay whole
/// in their neighbours, too.
DividedMeshes dividedMeshes(const Scene& scene, const std::vector<Placement>& placements,
                            const Focus& focus);

}  // namespace crt
