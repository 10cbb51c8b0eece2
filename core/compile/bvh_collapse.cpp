#include "compile/bvh_collapse.h"

#include <utility>

namespace crt {
namespace {

constexpr std::uint32_t kWidth = 4;
constexpr float kNodeCost = 1.5f;             // of a wide node in triangle tests; flat between 1 and 2.5
constexpr std::uint32_t kJoinedLeafSize = 4;  // of leaves that are joined here

/// The best way to make a subtree the children of a wide node.
struct Cut {
    /// Of 2, 3 and 4 children, how many of them its left side is to have.
    std::array<std::uint8_t, kWidth - 1> left{1, 1, 1};
    /// As one child it is a leaf.
    bool is_leaf = true;
};

/// Cost of rays that meet a subtree, made into at most 1 to 4 children: a node's or triangle's cost times
/// the surface of the box around it.
struct Costs {
    std::array<float, kWidth> of;
    std::uint32_t triangles;
};

class Collapse {
public:
    Collapse(const BinaryTree& tree, const std::vector<std::uint32_t>& order, float padding, int most_levels)
        : tree_(tree), order_(order), padding_(padding), most_levels_(most_levels), cuts_(tree.size()) {
        cutAll();
        wide_.order.reserve(order.size());
        wide_.nodes.emplace_back();
        if (cuts_[0].is_leaf)
            write(0, {0u}, 1);
        else
            write(0, childrenOf(0), 1);
    }
    WideTree take() { return std::move(wide_); }

private:
    /// From the leaves up. Children may lie before their parents, and a tree may be deep: no recursion.
    void cutAll() {
        std::vector<std::pair<std::uint32_t, bool>> open{{0u, false}};
        std::vector<Costs> known;
        while (!open.empty()) {
            const auto [node, children_are_known] = open.back();
            open.pop_back();
            if (tree_[node].isLeaf()) {
                known.push_back(costsOfLeaf(node));
            } else if (children_are_known) {
                const Costs right = known.back();
                known.pop_back();
                known.back() = cut(node, known.back(), right);
            } else {
                open.push_back({node, true});
                open.push_back({tree_[node].right, false});
                open.push_back({tree_[node].left, false});
            }
        }
    }

    Costs costsOfLeaf(std::uint32_t node) const {
        Costs costs{{}, tree_[node].count};
        costs.of.fill(tree_[node].box.halfArea() * static_cast<float>(costs.triangles));
        return costs;
    }

    Costs cut(std::uint32_t node, const Costs& left, const Costs& right) {
        Cut& cheapest = cuts_[node];
        Costs costs{{}, left.triangles + right.triangles};
        for (std::uint32_t children = 2; children <= kWidth; ++children) {
            float& least = costs.of[children - 1];
            least = std::numeric_limits<float>::infinity();
            for (std::uint32_t k = 1; k < children; ++k) {
                const float cost = left.of[k - 1] + right.of[children - k - 1];
                if (cost >= least) continue;
                least = cost;
                cheapest.left[children - 2] = static_cast<std::uint8_t>(k);
            }
        }
        const float half_area = tree_[node].box.halfArea();
        const float as_node = kNodeCost * half_area + costs.of[kWidth - 1];
        const float as_leaf = half_area * static_cast<float>(costs.triangles);
        cheapest.is_leaf = costs.triangles <= kJoinedLeafSize && as_leaf <= as_node;
        costs.of[0] = cheapest.is_leaf ? as_leaf : as_node;
        return costs;
    }

    std::vector<std::uint32_t> childrenOf(std::uint32_t node) const {
        std::vector<std::uint32_t> children;
        open(node, kWidth, children);
        return children;
    }
    /// More children are never dearer: their boxes are no larger than that around them.
    void open(std::uint32_t node, std::uint32_t room, std::vector<std::uint32_t>& children) const {
        const std::uint32_t left = cuts_[node].left[room - 2];
        for (const auto& [child, share] :
             {std::pair{tree_[node].left, left}, std::pair{tree_[node].right, room - left}})
            if (share == 1 || tree_[child].isLeaf())
                children.push_back(child);
            else
                open(child, share, children);
    }

    void write(std::uint32_t target, const std::vector<std::uint32_t>& children, int level) {
        wide_.depth = std::max(wide_.depth, level);
        if (level > most_levels_) return;
        kernel::CrtNode4 node{};
        std::array<std::uint32_t, kWidth> inner{};
        for (std::size_t c = 0; c < kWidth; ++c) {
            const BvhBox box = c < children.size() ? tree_[children[c]].box : BvhBox();
            for (std::size_t axis = 0; axis < 3; ++axis) {
                node.bounds[2 * axis][c] = box.lower[axis] - padding_;
                node.bounds[2 * axis + 1][c] = box.upper[axis] + padding_;
            }
            if (c >= children.size()) continue;
            if (cuts_[children[c]].is_leaf) {
                const auto first = static_cast<std::uint32_t>(wide_.order.size());
                takeTriangles(children[c]);
                node.child[c] = first << 4 | (static_cast<std::uint32_t>(wide_.order.size()) - first);
            } else {
                inner[c] = static_cast<std::uint32_t>(wide_.nodes.size());
                node.child[c] = inner[c] << 4;
                wide_.nodes.emplace_back();
            }
        }
        wide_.nodes[target] = node;
        for (std::size_t c = 0; c < children.size(); ++c)
            if (inner[c] != 0) write(inner[c], childrenOf(children[c]), level + 1);
    }

    /// Of a leaf, or of a subtree that becomes one: it has few levels.
    void takeTriangles(std::uint32_t node) {
        const BinaryNode& from = tree_[node];
        if (from.isLeaf()) {
            const auto first = order_.begin() + from.first;
            wide_.order.insert(wide_.order.end(), first, first + from.count);
        } else {
            takeTriangles(from.left);
            takeTriangles(from.right);
        }
    }

    const BinaryTree& tree_;
    const std::vector<std::uint32_t>& order_;
    const float padding_;
    const int most_levels_;
    std::vector<Cut> cuts_;
    WideTree wide_;
};

}  // namespace

WideTree collapse(const BinaryTree& tree, const std::vector<std::uint32_t>& order, float padding,
                  int most_levels) {
    return Collapse(tree, order, padding, most_levels).take();
}

}  // namespace crt
