/// A better tree out of a given one: subtrees are taken out and put in where they cost rays least.
/// Bittner, Hapala and Havran 2013, "Fast Insertion-Based Optimization of Bounding Volume Hierarchies"; the
/// search is that of Meister and Bittner 2018, "Parallel Reinsertion for Bounding Volume Hierarchy
/// Optimization", section 4.1.
#pragma once

#include "compile/bvh_tree.h"

namespace crt {

/// Moves the subtrees with the largest boxes, which rays meet most, one by one to where the surface of all
/// boxes together becomes least. The nodes keep their number, the root its place, leaves their triangles;
/// children may then lie before their parents. The work is bounded whatever the tree.
void reinsert(BinaryTree& tree);

}  // namespace crt
