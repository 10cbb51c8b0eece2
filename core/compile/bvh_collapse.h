/// A binary tree made four children wide, so that rays cost least: Ylitie, Karras and Laine 2017, "Efficient
/// Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", section 3.1.
#pragma once

#include "compile/bvh_tree.h"
#include "kernel/dialect/layout.h"

namespace crt {

struct WideTree {
    std::vector<kernel::CrtNode4> nodes;  ///< Root first.
    std::vector<std::uint32_t> order;     ///< order[slot] is the triangle in that slot.
    int depth = 0;                        ///< Levels of nodes.
};

/// `order` says which triangle is at the places that the tree's leaves name; `padding` is added around every
/// box. A tree of more levels than `most_levels` is given up: its depth is more, its nodes are not complete.
WideTree collapse(const BinaryTree& tree, const std::vector<std::uint32_t>& order, float padding,
                  int most_levels);

}  // namespace crt
