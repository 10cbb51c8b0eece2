/// The binary tree that becomes a four-wide BVH (bvh_build.h): built (bvh_build.cpp), improved
/// (bvh_reinsert.h), and made wide (bvh_collapse.h).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

namespace crt {

struct BvhBox {
    std::array<float, 3> lower{std::numeric_limits<float>::infinity(),
                               std::numeric_limits<float>::infinity(),
                               std::numeric_limits<float>::infinity()};
    std::array<float, 3> upper{-std::numeric_limits<float>::infinity(),
                               -std::numeric_limits<float>::infinity(),
                               -std::numeric_limits<float>::infinity()};

    /// So that it contains another thing with `lower` and `upper`.
    template <class Bounds>
    void grow(const Bounds& b) {
        for (std::size_t k = 0; k < 3; ++k) {
            lower[k] = std::min(lower[k], b.lower[k]);
            upper[k] = std::max(upper[k], b.upper[k]);
        }
    }
    void grow(const std::array<float, 3>& p) {
        for (std::size_t k = 0; k < 3; ++k) {
            lower[k] = std::min(lower[k], p[k]);
            upper[k] = std::max(upper[k], p[k]);
        }
    }
    /// 0 of an empty box.
    float halfArea() const {
        const float x = upper[0] - lower[0], y = upper[1] - lower[1], z = upper[2] - lower[2];
        return x < 0 ? 0.0f : x * y + y * z + z * x;
    }
};

inline BvhBox unionOf(BvhBox a, const BvhBox& b) {
    a.grow(b);
    return a;
}

struct BinaryNode {
    BvhBox box;
    std::uint32_t left = 0, right = 0;   ///< Children, when `count` is 0.
    std::uint32_t first = 0, count = 0;  ///< Triangles of a leaf: places in the order of triangles.

    bool isLeaf() const { return count > 0; }
};

/// Root first.
using BinaryTree = std::vector<BinaryNode>;

}  // namespace crt
