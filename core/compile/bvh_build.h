/// Four-wide BVH over triangles: binned SAH into a binary tree, which is improved and made wide. Built once
/// at load, on the host.
#pragma once

#include "kernel/dialect/layout.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace crt {

struct TriangleBounds {
    std::array<float, 3> lower;
    std::array<float, 3> upper;
};

struct Bvh {
    std::vector<kernel::CrtNode4> nodes;  ///< Root first.
    std::vector<std::uint32_t> order;     ///< order[slot] is the input triangle in that slot.
    int depth = 0;                        ///< Levels of four-wide nodes; at most kMaxBvhDepth.
};

/// The kernel's stack holds three entries a level (CRT_BVH_STACK).
inline constexpr int kMaxBvhDepth = 31;

/// `padding` is added around every box: the triangle test rounds the ray's offset to a vertex to a few 2^-24
/// of the coordinates, and a box must contain whatever the test may accept. At least one triangle. `stage`
/// is what progress calls it (stage.h).
Bvh buildBvh(const std::vector<TriangleBounds>& triangles, float padding,
             const std::string& stage = "building the BVH");

}  // namespace crt
