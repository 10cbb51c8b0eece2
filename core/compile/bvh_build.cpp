#include "compile/bvh_build.h"

#include "base/stage.h"
#include "kernel/bvh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace crt {
namespace {

static_assert(3 * (kMaxBvhDepth + 1) <= CRT_BVH_STACK);

constexpr int kBins = 16;
constexpr std::uint32_t kLeafSize = 4;
constexpr std::uint32_t kLargestLeaf = 15;  // what a child reference can count
constexpr float kTraversalCost = 1.2f;      // of a box test in triangle tests; flat between 0.8 and 2

struct Box {
    std::array<float, 3> lower{std::numeric_limits<float>::infinity(),
                               std::numeric_limits<float>::infinity(),
                               std::numeric_limits<float>::infinity()};
    std::array<float, 3> upper{-std::numeric_limits<float>::infinity(),
                               -std::numeric_limits<float>::infinity(),
                               -std::numeric_limits<float>::infinity()};

    void grow(const TriangleBounds& b) {
        for (std::size_t k = 0; k < 3; ++k) {
            lower[k] = std::min(lower[k], b.lower[k]);
            upper[k] = std::max(upper[k], b.upper[k]);
        }
    }
    void grow(const Box& b) {
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
    float halfArea() const {
        const float x = upper[0] - lower[0], y = upper[1] - lower[1], z = upper[2] - lower[2];
        return x < 0 ? 0.0f : x * y + y * z + z * x;
    }
};

struct BinaryNode {
    Box box;
    std::uint32_t left = 0, right = 0;  // children, when count is 0
    std::uint32_t first = 0, count = 0;
};

struct Split {
    int axis = -1;
    float position = 0;
    float cost = std::numeric_limits<float>::infinity();
};

class Builder {
public:
    Builder(const std::vector<TriangleBounds>& triangles, bool median_only, Stage& stage)
        : triangles_(triangles),
          median_only_(median_only),
          stage_(stage),
          order_(triangles.size()),
          centroids_(triangles.size()) {
        std::iota(order_.begin(), order_.end(), 0u);
        for (std::size_t i = 0; i < triangles.size(); ++i)
            for (std::size_t k = 0; k < 3; ++k)
                centroids_[i][k] = 0.5f * (triangles[i].lower[k] + triangles[i].upper[k]);
        nodes_.reserve(triangles.size());
        build(0, static_cast<std::uint32_t>(triangles.size()));
    }

    const std::vector<BinaryNode>& nodes() const { return nodes_; }
    std::vector<std::uint32_t>& order() { return order_; }

private:
    // Depth is bounded by the caller's retry with median splits, so recursion is safe: a median tree has at
    // most 31 levels, and a SAH split always leaves triangles on both sides.
    std::uint32_t build(std::uint32_t begin, std::uint32_t end, int depth = 0) {
        stage_.at(begin);  // what lies before it is done
        const auto index = static_cast<std::uint32_t>(nodes_.size());
        nodes_.emplace_back();
        Box box, centroid_box;
        for (std::uint32_t i = begin; i < end; ++i) {
            box.grow(triangles_[order_[i]]);
            centroid_box.grow(centroids_[order_[i]]);
        }
        nodes_[index].box = box;
        const std::uint32_t count = end - begin;
        const Split split =
            count > 1 && !median_only_ && depth < kSahDepth ? findSplit(begin, end, centroid_box) : Split{};
        const float leaf_cost = static_cast<float>(count) * box.halfArea();
        const bool split_pays = split.axis >= 0 && split.cost + kTraversalCost * box.halfArea() < leaf_cost;
        if (count <= kLeafSize && (count == 1 || !split_pays)) {
            nodes_[index].first = begin;
            nodes_[index].count = count;
            return index;
        }
        std::uint32_t middle = begin;
        if (split.axis >= 0 && (split_pays || count > kLargestLeaf)) {
            const auto axis = static_cast<std::size_t>(split.axis);
            middle = static_cast<std::uint32_t>(
                std::partition(order_.begin() + begin, order_.begin() + end,
                               [&](std::uint32_t t) { return centroids_[t][axis] < split.position; }) -
                order_.begin());
        } else if (count <= kLargestLeaf && !median_only_ && split.axis >= 0) {
            nodes_[index].first = begin;
            nodes_[index].count = count;
            return index;
        }
        if (middle == begin || middle == end) middle = medianSplit(begin, end, centroid_box);
        const std::uint32_t left = build(begin, middle, depth + 1);
        const std::uint32_t right = build(middle, end, depth + 1);
        nodes_[index].left = left;
        nodes_[index].right = right;
        return index;
    }

    Split findSplit(std::uint32_t begin, std::uint32_t end, const Box& centroid_box) const {
        Split best;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const float lower = centroid_box.lower[axis], extent = centroid_box.upper[axis] - lower;
            if (!(extent > 0)) continue;
            const float scale = static_cast<float>(kBins) / extent;
            std::array<Box, kBins> boxes;
            std::array<std::uint32_t, kBins> counts{};
            for (std::uint32_t i = begin; i < end; ++i) {
                const std::uint32_t t = order_[i];
                const auto bin = static_cast<std::size_t>(
                    std::clamp(static_cast<int>((centroids_[t][axis] - lower) * scale), 0, kBins - 1));
                boxes[bin].grow(triangles_[t]);
                ++counts[bin];
            }
            std::array<float, kBins> right_cost{};
            Box box;
            std::uint32_t count = 0;
            for (std::size_t b = kBins - 1; b > 0; --b) {
                box.grow(boxes[b]);
                count += counts[b];
                right_cost[b] = static_cast<float>(count) * box.halfArea();
            }
            box = Box{};
            count = 0;
            for (std::size_t b = 1; b < kBins; ++b) {
                box.grow(boxes[b - 1]);
                count += counts[b - 1];
                if (count == 0 || count == end - begin) continue;
                const float cost = static_cast<float>(count) * box.halfArea() + right_cost[b];
                if (cost < best.cost)
                    best = {static_cast<int>(axis), lower + static_cast<float>(b) / scale, cost};
            }
        }
        return best;
    }

    // Halves by the widest axis of the centroids; ids decide ties, so that the tree is the same on every
    // machine.
    std::uint32_t medianSplit(std::uint32_t begin, std::uint32_t end, const Box& centroid_box) {
        std::size_t axis = 0;
        for (std::size_t k = 1; k < 3; ++k)
            if (centroid_box.upper[k] - centroid_box.lower[k] >
                centroid_box.upper[axis] - centroid_box.lower[axis])
                axis = k;
        const std::uint32_t middle = begin + (end - begin) / 2;
        std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                         [&](std::uint32_t a, std::uint32_t b) {
                             return centroids_[a][axis] != centroids_[b][axis]
                                        ? centroids_[a][axis] < centroids_[b][axis]
                                        : a < b;
                         });
        return middle;
    }

    static constexpr int kSahDepth = 40;

    const std::vector<TriangleBounds>& triangles_;
    bool median_only_;
    Stage& stage_;
    std::vector<std::uint32_t> order_;
    std::vector<std::array<float, 3>> centroids_;
    std::vector<BinaryNode> nodes_;
};

class Collapser {
public:
    Collapser(const std::vector<BinaryNode>& binary, float padding) : binary_(binary), padding_(padding) {
        nodes_.emplace_back();
        if (binary_[0].count > 0)
            writeNode(0, {0u});
        else
            collapse(0, 0, 1);
    }
    std::vector<kernel::CrtNode4> take() { return std::move(nodes_); }
    int depth() const { return depth_; }

private:
    void collapse(std::uint32_t binary_node, std::uint32_t target, int depth) {
        depth_ = std::max(depth_, depth);
        if (depth > kMaxBvhDepth) return;  // the caller sees depth() and builds again with median splits
        std::vector<std::uint32_t> children{binary_[binary_node].left, binary_[binary_node].right};
        while (children.size() < 4) {
            // Open the inner child that rays enter most.
            auto widest = children.end();
            for (auto c = children.begin(); c != children.end(); ++c)
                if (binary_[*c].count == 0 && (widest == children.end() ||
                                               binary_[*c].box.halfArea() > binary_[*widest].box.halfArea()))
                    widest = c;
            if (widest == children.end()) break;
            const std::uint32_t opened = *widest;
            *widest = binary_[opened].left;
            children.push_back(binary_[opened].right);
        }
        const auto references = writeNode(target, children);
        for (std::size_t i = 0; i < children.size(); ++i)
            if (binary_[children[i]].count == 0) collapse(children[i], references[i], depth + 1);
    }

    std::array<std::uint32_t, 4> writeNode(std::uint32_t target,
                                           const std::vector<std::uint32_t>& children) {
        kernel::CrtNode4 node{};
        std::array<std::uint32_t, 4> references{};
        for (std::size_t c = 0; c < 4; ++c) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                node.bounds[2 * axis][c] = std::numeric_limits<float>::infinity();
                node.bounds[2 * axis + 1][c] = -std::numeric_limits<float>::infinity();
            }
            if (c >= children.size()) continue;
            const BinaryNode& child = binary_[children[c]];
            for (std::size_t axis = 0; axis < 3; ++axis) {
                node.bounds[2 * axis][c] = child.box.lower[axis] - padding_;
                node.bounds[2 * axis + 1][c] = child.box.upper[axis] + padding_;
            }
            if (child.count > 0) {
                node.child[c] = child.first << 4 | child.count;
            } else {
                references[c] = static_cast<std::uint32_t>(nodes_.size());
                node.child[c] = references[c] << 4;
                nodes_.emplace_back();
            }
        }
        nodes_[target] = node;
        return references;
    }

    const std::vector<BinaryNode>& binary_;
    float padding_;
    std::vector<kernel::CrtNode4> nodes_;
    int depth_ = 1;
};

}  // namespace

Bvh buildBvh(const std::vector<TriangleBounds>& triangles, float padding, const std::string& what) {
    Stage stage(what, static_cast<double>(triangles.size()));
    for (const bool median_only : {false, true}) {
        Builder builder(triangles, median_only, stage);
        Collapser collapser(builder.nodes(), padding);
        if (collapser.depth() > kMaxBvhDepth) continue;
        Bvh bvh;
        bvh.depth = collapser.depth();
        bvh.nodes = collapser.take();
        bvh.order = std::move(builder.order());
        return bvh;
    }
    return {};  // a median tree of 2^31 triangles has 31 levels
}

}  // namespace crt
