/// Divides large triangles, because the rounding error of a triangle grows with its size. Near the focus of
/// the scene, no piece is much larger than its distance from the focus
/// (docs/decisions/0055-digits-where-one-looks.md).
#pragma once

#include "compile/focus.h"
#include "compile/placements.h"

#include <vector>

namespace crt {

/// Meshes that replace those of objects with triangles that are too large. Edges decide: an edge is halved
/// if it is longer than twice the sum of two lengths: the distance of its nearest point from the focus, and
/// the size of details there. Both triangles at an edge therefore get the same corners on it, whatever
/// object they belong to, and no gap opens. A triangle that contains the focus always has an edge that long
/// (Weitzenböck 1919: a² + b² + c² ≥ 4√3 · area), so pieces there have edges of up to five times
/// that sum.
///
/// Not divided: triangles that emit, because each is a light; objects that are placed several times; and
/// meshes with vertex colours, which the kernel does not interpolate linearly. Their neighbours do not
/// halve the common edges either.
DividedMeshes dividedMeshes(const Scene& scene, const std::vector<Placement>& placements,
                            const Focus& focus);

}  // namespace crt
