#include "compile/bvh_build.h"

#include "base/byte_hash.h"
#include "base/frame_cache.h"
#include "base/parallel.h"
#include "base/stage.h"
#include "compile/bvh_collapse.h"
#include "compile/bvh_reinsert.h"
#include "kernel/geometry/bvh.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>

namespace crt {
namespace {

static_assert(3 * (kMaxBvhDepth + 1) <= CRT_BVH_STACK);

constexpr int kBins = 16;
constexpr std::uint32_t kLeafSize = 4;
constexpr std::uint32_t kLargestLeaf = 15;  // what a child reference can count
constexpr float kTraversalCost = 1.2f;      // of a box test in triangle tests; flat between 0.8 and 2

struct Split {
    int axis = -1;
    float position = 0;
    float cost = std::numeric_limits<float>::infinity();
};

constexpr std::uint32_t kTrianglesAtATime = 1u << 14;  // triangles that a thread looks at, at a time
constexpr std::uint32_t kSerial = 1u << 15;  // up to this number, one thread builds the whole tree

/// 0.5 of it is the centre.
float twiceCentroid(const TriangleBounds& b, std::size_t axis) { return b.lower[axis] + b.upper[axis]; }

/// Summary of a range of triangles: its box, and the box of the centroids.
struct Extents {
    BvhBox box, centroids;

    void grow(const TriangleBounds& b) {
        box.grow(b);
        std::array<float, 3> centroid;
        for (std::size_t k = 0; k < 3; ++k) centroid[k] = 0.5f * twiceCentroid(b, k);
        centroids.grow(centroid);
    }
    void grow(const Extents& other) {
        box.grow(other.box);
        centroids.grow(other.centroids);
    }
};

/// Triangles sorted into bins along the three axes, by centroid.
class Bins {
public:
    explicit Bins(const BvhBox& centroids) : lower_(centroids.lower) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float extent = centroids.upper[axis] - lower_[axis];
            scale_[axis] = extent > 0 ? static_cast<float>(kBins) / extent : 0.0f;
        }
    }

    void add(const TriangleBounds& b) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (scale_[axis] == 0.0f) continue;
            const float centroid = 0.5f * twiceCentroid(b, axis);
            const auto bin = static_cast<std::size_t>(
                std::clamp(static_cast<int>((centroid - lower_[axis]) * scale_[axis]), 0, kBins - 1));
            boxes_[axis][bin].grow(b);
            ++counts_[axis][bin];
        }
    }
    void add(const Bins& other) {
        for (std::size_t axis = 0; axis < 3; ++axis)
            for (std::size_t b = 0; b < kBins; ++b) {
                boxes_[axis][b].grow(other.boxes_[axis][b]);
                counts_[axis][b] += other.counts_[axis][b];
            }
    }

    /// The cheapest plane between two bins, of `all` triangles.
    Split best(std::uint32_t all) const {
        Split best;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            if (scale_[axis] == 0.0f) continue;
            std::array<float, kBins> right_cost{};
            BvhBox box;
            std::uint32_t count = 0;
            for (std::size_t b = kBins - 1; b > 0; --b) {
                box.grow(boxes_[axis][b]);
                count += counts_[axis][b];
                right_cost[b] = static_cast<float>(count) * box.halfArea();
            }
            box = BvhBox{};
            count = 0;
            for (std::size_t b = 1; b < kBins; ++b) {
                box.grow(boxes_[axis][b - 1]);
                count += counts_[axis][b - 1];
                if (count == 0 || count == all) continue;
                const float cost = static_cast<float>(count) * box.halfArea() + right_cost[b];
                if (cost < best.cost)
                    best = {static_cast<int>(axis), lower_[axis] + static_cast<float>(b) / scale_[axis],
                            cost};
            }
        }
        return best;
    }

private:
    std::array<float, 3> lower_, scale_{};
    std::array<std::array<BvhBox, kBins>, 3> boxes_;
    std::array<std::array<std::uint32_t, kBins>, 3> counts_{};
};

/// Ways to build a tree: if a better one is too deep for the kernel's stack, the next is used.
enum class Way { Improved, Plain, Median };

/// The choice depends on the number of triangles alone, never on that of threads.
class Builder {
public:
    Builder(const std::vector<TriangleBounds>& triangles, bool median_only, Stage& stage)
        : triangles_(triangles),
          median_only_(median_only),
          stage_(stage),
          order_(triangles.size()),
          scratch_(triangles.size() > kSerial ? triangles.size() : 0) {
        std::iota(order_.begin(), order_.end(), 0u);
        Tree tree;
        build(0, static_cast<std::uint32_t>(triangles.size()), 0, tree);
        nodes_.resize(tree.count());
        std::vector<Copy> copies;
        place(tree, 0, copies);
        parallelFor(copies.size(), 1, [&](std::size_t i, std::size_t) { copy(copies[i]); });
    }

    BinaryTree take() { return std::move(nodes_); }
    const std::vector<std::uint32_t>& order() const { return order_; }

private:
    static constexpr int kSahDepth = 40;

    /// A subtree: built by one thread, or a root over two others.
    struct Tree {
        BinaryTree nodes;  ///< Of one thread's; children are counted from the first.
        BinaryNode root;
        std::unique_ptr<Tree> left, right;

        std::size_t count() const { return left ? 1 + left->count() + right->count() : nodes.size(); }
    };
    struct Copy {
        Tree* tree;
        std::uint32_t to;
    };

    // Depth is bounded by the caller's retry with median splits, so recursion is safe: a median tree has at
    // most 31 levels, and a SAH split always leaves triangles on both sides.
    void build(std::uint32_t begin, std::uint32_t end, int depth, Tree& tree) {
        if (end - begin <= kSerial) {
            buildSerial(begin, end, depth, tree.nodes);
            stage_.at(static_cast<double>(done_ += end - begin));
            return;
        }
        const Extents extents = extentsOf(begin, end);
        const std::uint32_t middle = splitOf(begin, end, depth, extents);
        tree.root.box = extents.box;
        tree.left = std::make_unique<Tree>();
        tree.right = std::make_unique<Tree>();
        parallelInvoke([&] { build(begin, middle, depth + 1, *tree.left); },
                       [&] { build(middle, end, depth + 1, *tree.right); });
    }

    std::uint32_t buildSerial(std::uint32_t begin, std::uint32_t end, int depth, BinaryTree& nodes) {
        const auto index = static_cast<std::uint32_t>(nodes.size());
        nodes.emplace_back();
        const Extents extents = extentsOf(begin, end);
        nodes[index].box = extents.box;
        const std::uint32_t middle = splitOf(begin, end, depth, extents);
        if (middle == begin) {
            nodes[index].first = begin;
            nodes[index].count = end - begin;
            return index;
        }
        const std::uint32_t left = buildSerial(begin, middle, depth + 1, nodes);
        const std::uint32_t right = buildSerial(middle, end, depth + 1, nodes);
        nodes[index].left = left;
        nodes[index].right = right;
        return index;
    }

    /// Sorts the triangles of a range into two; returns where the second begins, or `begin` for a leaf.
    std::uint32_t splitOf(std::uint32_t begin, std::uint32_t end, int depth, const Extents& extents) {
        const std::uint32_t count = end - begin;
        const Split split = count > 1 && !median_only_ && depth < kSahDepth
                                ? binsOf(begin, end, extents.centroids).best(count)
                                : Split{};
        const float half_area = extents.box.halfArea();
        const float leaf_cost = static_cast<float>(count) * half_area;
        const bool split_pays = split.axis >= 0 && split.cost + kTraversalCost * half_area < leaf_cost;
        if (count <= kLeafSize && (count == 1 || !split_pays)) return begin;
        std::uint32_t middle = begin;
        if (split.axis >= 0 && (split_pays || count > kLargestLeaf))
            middle = partition(begin, end, split);
        else if (count <= kLargestLeaf && !median_only_ && split.axis >= 0)
            return begin;
        if (middle == begin || middle == end) middle = medianSplit(begin, end, extents.centroids);
        return middle;
    }

    Extents extentsOf(std::uint32_t begin, std::uint32_t end) const {
        return gather(
            begin, end, Extents(), [](Extents& all, const Extents& part) { all.grow(part); },
            [](Extents& part, const TriangleBounds& b) { part.grow(b); });
    }
    Bins binsOf(std::uint32_t begin, std::uint32_t end, const BvhBox& centroids) const {
        return gather(
            begin, end, Bins(centroids), [](Bins& all, const Bins& part) { all.add(part); },
            [](Bins& part, const TriangleBounds& b) { part.add(b); });
    }
    /// `nothing` with every triangle of the range added, parts of a large one by several threads.
    template <class Result, class Join, class Add>
    Result gather(std::uint32_t begin, std::uint32_t end, const Result& nothing, const Join& join,
                  const Add& add) const {
        if (end - begin <= kSerial) {
            Result result = nothing;
            for (std::uint32_t i = begin; i < end; ++i) add(result, triangles_[order_[i]]);
            return result;
        }
        std::vector<Result> parts(partsOf(end - begin, kTrianglesAtATime), nothing);
        parallelFor(end - begin, kTrianglesAtATime, [&](std::size_t first, std::size_t last) {
            Result part = nothing;
            for (std::size_t i = begin + first; i < begin + last; ++i) add(part, triangles_[order_[i]]);
            parts[first / kTrianglesAtATime] = part;
        });
        Result result = nothing;
        for (const Result& part : parts) join(result, part);
        return result;
    }

    std::uint32_t partition(std::uint32_t begin, std::uint32_t end, const Split& split) {
        const auto axis = static_cast<std::size_t>(split.axis);
        const auto isLeft = [&](std::uint32_t t) {
            return 0.5f * twiceCentroid(triangles_[t], axis) < split.position;
        };
        const auto at = [](std::uint32_t* array, std::size_t i) { return array + i; };
        std::uint32_t* const order = order_.data();
        if (end - begin <= kSerial)
            return static_cast<std::uint32_t>(std::partition(at(order, begin), at(order, end), isLeft) -
                                              order);
        // Stable: how many of each part go left says where its triangles go.
        std::vector<std::uint32_t> left(partsOf(end - begin, kTrianglesAtATime));
        parallelFor(end - begin, kTrianglesAtATime, [&](std::size_t first, std::size_t last) {
            left[first / kTrianglesAtATime] = static_cast<std::uint32_t>(
                std::count_if(at(order, begin + first), at(order, begin + last), isLeft));
        });
        std::uint32_t all_left = 0;
        for (std::uint32_t& count : left) all_left += std::exchange(count, all_left);
        parallelFor(end - begin, kTrianglesAtATime, [&](std::size_t first, std::size_t last) {
            std::size_t to_left = begin + left[first / kTrianglesAtATime];
            std::size_t to_right = begin + all_left + (first - left[first / kTrianglesAtATime]);
            for (std::size_t i = begin + first; i < begin + last; ++i)
                scratch_[isLeft(order[i]) ? to_left++ : to_right++] = order[i];
        });
        parallelFor(end - begin, kTrianglesAtATime, [&](std::size_t first, std::size_t last) {
            std::copy(at(scratch_.data(), begin + first), at(scratch_.data(), begin + last),
                      at(order, begin + first));
        });
        return begin + all_left;
    }

    // Halves by the widest axis of the centroids; ids decide ties, so that the tree is the same on every
    // machine.
    std::uint32_t medianSplit(std::uint32_t begin, std::uint32_t end, const BvhBox& centroid_box) {
        std::size_t axis = 0;
        for (std::size_t k = 1; k < 3; ++k)
            if (centroid_box.upper[k] - centroid_box.lower[k] >
                centroid_box.upper[axis] - centroid_box.lower[axis])
                axis = k;
        const std::uint32_t middle = begin + (end - begin) / 2;
        std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                         [&](std::uint32_t a, std::uint32_t b) {
                             const float left = 0.5f * twiceCentroid(triangles_[a], axis),
                                         right = 0.5f * twiceCentroid(triangles_[b], axis);
                             return left != right ? left < right : a < b;
                         });
        return middle;
    }

    /// Where the nodes of subtrees go: a node, all that is left of it, all that is right of it.
    void place(Tree& tree, std::uint32_t to, std::vector<Copy>& copies) {
        if (!tree.left) {
            copies.push_back({&tree, to});
            return;
        }
        nodes_[to] = tree.root;
        nodes_[to].left = to + 1;
        nodes_[to].right = to + 1 + static_cast<std::uint32_t>(tree.left->count());
        place(*tree.left, nodes_[to].left, copies);
        place(*tree.right, nodes_[to].right, copies);
    }
    void copy(const Copy& copy) {
        const BinaryTree from = std::move(copy.tree->nodes);
        for (std::size_t i = 0; i < from.size(); ++i) {
            BinaryNode node = from[i];
            if (node.count == 0) {
                node.left += copy.to;
                node.right += copy.to;
            }
            nodes_[copy.to + i] = node;
        }
    }

    const std::vector<TriangleBounds>& triangles_;
    bool median_only_;
    Stage& stage_;
    std::atomic<std::uint32_t> done_{0};
    std::vector<std::uint32_t> order_, scratch_;
    BinaryTree nodes_;
};

Bvh build(const std::vector<TriangleBounds>& triangles, float padding, const std::string& what) {
    Stage stage(what, static_cast<double>(triangles.size()));
    for (const Way way : {Way::Improved, Way::Plain, Way::Median}) {
        Builder builder(triangles, way == Way::Median, stage);
        BinaryTree tree = builder.take();
        if (way == Way::Improved) reinsert(tree);
        WideTree wide = collapse(tree, builder.order(), padding, kMaxBvhDepth);
        if (wide.depth > kMaxBvhDepth) continue;
        return {std::move(wide.nodes), std::move(wide.order), wide.depth};
    }
    return {};  // a median tree of 2^31 triangles has 31 levels
}

/// All that a tree is made of, in 128 bits.
std::string digestOf(const std::vector<TriangleBounds>& triangles, float padding) {
    ByteHash hash;
    hash.add(&padding, sizeof padding);
    hash.add(triangles.data(), triangles.size() * sizeof triangles.front());
    return hash.digits128();
}

}  // namespace

Bvh buildBvh(const std::vector<TriangleBounds>& triangles, float padding, const std::string& what) {
    static FrameCache<std::string, Bvh> kept;
    return *kept.of([&] { return digestOf(triangles, padding); },
                    [&] { return build(triangles, padding, what); });
}

}  // namespace crt
