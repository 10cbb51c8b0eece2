#include "compile/bvh_reinsert.h"

#include <cmath>
#include <numeric>
#include <utility>

namespace crt {
namespace {

// By the cost of collapse (bvh_collapse.cpp) the dragon of 100,000 triangles has 20.1 before. Three passes
// over the 8,192 largest of its subtrees give 17.8 in 0.03 s; over all 95,000 they give 17.6 in 0.3 s. A
// fourth pass gives nothing.
constexpr int kPasses = 3;
constexpr std::size_t kMostMoved = 8192;
constexpr std::uint32_t kMostVisited = 1024;  // nodes a search

class Reinsertion {
public:
    explicit Reinsertion(BinaryTree& tree) : tree_(tree), parent_(tree.size(), 0) {
        for (std::uint32_t i = 0; i < tree_.size(); ++i)
            if (!tree_[i].isLeaf()) parent_[tree_[i].left] = parent_[tree_[i].right] = i;
    }

    void pass() {
        for (const std::uint32_t node : largest()) {
            if (parent_[node] == 0) continue;  // Above its parent is nothing that could take its place.
            const std::uint32_t target = bestPlace(node);
            if (target != 0) move(node, target);
        }
    }

private:
    /// A subtree of the search, and by how much the surface becomes smaller if all nodes above it grow to
    /// hold what is moved.
    struct Candidate {
        float gain;
        std::uint32_t node;
    };

    std::uint32_t sibling(std::uint32_t node) const {
        const BinaryNode& parent = tree_[parent_[node]];
        return parent.left == node ? parent.right : parent.left;
    }

    std::vector<std::uint32_t> largest() const {
        std::vector<std::uint32_t> nodes(tree_.size() - 1);
        std::iota(nodes.begin(), nodes.end(), 1u);
        const auto area = [this](std::uint32_t node) {
            const float half_area = tree_[node].box.halfArea();
            return std::isnan(half_area) ? 0.0f : half_area;  // 0 · ∞: as large as floats can say
        };
        const auto isLarger = [&area](std::uint32_t a, std::uint32_t b) {
            return area(a) != area(b) ? area(a) > area(b) : a < b;
        };
        const std::size_t kept = std::min(nodes.size(), kMostMoved);
        const auto end = nodes.begin() + static_cast<std::ptrdiff_t>(kept);
        if (end != nodes.end()) std::nth_element(nodes.begin(), end, nodes.end(), isLarger);
        nodes.resize(kept);
        std::sort(nodes.begin(), nodes.end(), isLarger);
        return nodes;
    }

    /// The node beside which `node` is best put; 0: where it is. Seen from its parent upwards, the subtree
    /// beside each node of the way is searched, branches that cannot gain more than what was found left out.
    std::uint32_t bestPlace(std::uint32_t node) {
        const BvhBox box = tree_[node].box;
        const float area = box.halfArea();
        const std::uint32_t parent = parent_[node];
        std::uint32_t best = 0, visited = 0;
        float best_gain = 0;
        std::uint32_t pivot = parent, beside = sibling(node);
        float gain = tree_[parent].box.halfArea();  // The parent goes away with the node.
        BvhBox rest = tree_[beside].box;            // The box of the pivot without the node.
        for (;;) {
            candidates_.push_back({gain, beside});
            while (!candidates_.empty()) {
                const Candidate candidate = candidates_.back();
                candidates_.pop_back();
                if (candidate.gain - area <= best_gain || visited == kMostVisited) continue;
                ++visited;
                const BinaryNode& there = tree_[candidate.node];
                const float here = candidate.gain - unionOf(there.box, box).halfArea();
                if (here > best_gain) {
                    best_gain = here;
                    best = candidate.node;
                }
                if (there.isLeaf()) continue;
                const float below = here + there.box.halfArea();
                candidates_.push_back({below, there.left});
                candidates_.push_back({below, there.right});
            }
            if (pivot == 0) break;
            if (pivot != parent) {
                rest.grow(tree_[beside].box);
                gain += tree_[pivot].box.halfArea() - rest.halfArea();
            }
            beside = sibling(pivot);
            pivot = parent_[pivot];
        }
        return best == sibling(node) ? 0 : best;
    }

    void replaceChild(std::uint32_t parent, std::uint32_t child, std::uint32_t by) {
        (tree_[parent].left == child ? tree_[parent].left : tree_[parent].right) = by;
        parent_[by] = parent;
    }

    /// The sibling takes the place of the parent, and the parent joins `node` with `target`.
    void move(std::uint32_t node, std::uint32_t target) {
        const std::uint32_t joint = parent_[node], above = parent_[joint];
        replaceChild(above, joint, sibling(node));
        const std::uint32_t new_above = parent_[target];
        replaceChild(new_above, target, joint);
        tree_[joint].left = target;
        tree_[joint].right = node;
        parent_[target] = joint;
        refit(above);
        refit(joint);
    }

    void refit(std::uint32_t node) {
        for (;;) {
            tree_[node].box = unionOf(tree_[tree_[node].left].box, tree_[tree_[node].right].box);
            if (node == 0) return;
            node = parent_[node];
        }
    }

    BinaryTree& tree_;
    std::vector<std::uint32_t> parent_;  ///< 0 of the root, which is that of its children, too.
    std::vector<Candidate> candidates_;
};

}  // namespace

void reinsert(BinaryTree& tree) {
    Reinsertion reinsertion(tree);
    for (int pass = 0; pass < kPasses; ++pass) reinsertion.pass();
}

}  // namespace crt
