/// Triangles as the kernels test them: flattened scene → arrays of the blob.
#pragma once

#include "compile/accelerator.h"
#include "compile/coplanar.h"
#include "compile/flatten.h"
#include "kernel/dialect/layout.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace crt {

/// In the coordinates of the compiled scene, in double.
Vec3d vertexOf(const FlatScene& flat, std::size_t id, std::size_t vertex);
double areaOf(const FlatScene& flat, std::size_t id);
Corners cornersOf(const FlatScene& flat, std::size_t triangle);

/// Fill in one a triangle or shape, by slot.
void compileTriangles(const FlatScene& flat, const AcceleratorPart& accelerator,
                      std::span<kernel::CrtTriangle> triangles);
void compileFaces(const FlatScene& flat, const AcceleratorPart& accelerator,
                  std::span<kernel::CrtFace> faces);

/// Triangles side by side for the brute-force loops, which keep the author's order: slot and id are one.
std::vector<kernel::CrtTriangle8> compileTriangles8(const FlatScene& flat,
                                                    const std::vector<std::uint32_t>& ids);
/// The same triangles, two at a time where one that follows lies in the other's plane beside it, for loops
/// that take one ray in a lane.
std::vector<kernel::CrtPatch> compilePatches(const FlatScene& flat, const std::vector<std::uint32_t>& ids);
/// The ids of all triangles.
std::vector<std::uint32_t> trianglesOf(const FlatScene& flat);
/// The triangles that can come between two points of the scene; all of them where there are so many that
/// asking would take long.
std::vector<std::uint32_t> occludersOf(const FlatScene& flat);

/// Boxes of the placements, for the paper's culling and for the bounding-box view. Their triangles are
/// adjacent unless a BVH moved them.
std::vector<kernel::CrtObject> compileObjects(const FlatScene& flat);

}  // namespace crt
