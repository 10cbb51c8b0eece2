// The way from a binary tree to a four-wide one: what improves a tree, and what makes it wide.

#include "catch.h"

#include "compile/bvh_build.h"
#include "compile/bvh_collapse.h"
#include "compile/bvh_reinsert.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <random>

using crt::BinaryNode;
using crt::BinaryTree;
using crt::BvhBox;

namespace {

BvhBox boxAt(float x, float y, float z, float size) {
    BvhBox box;
    box.lower = {x, y, z};
    box.upper = {x + size, y + size, z + size};
    return box;
}

std::uint32_t addLeaf(BinaryTree& tree, const BvhBox& box, std::uint32_t& triangles, std::uint32_t count) {
    BinaryNode node;
    node.box = box;
    node.first = triangles;
    node.count = count;
    triangles += count;
    tree.push_back(node);
    return static_cast<std::uint32_t>(tree.size() - 1);
}

void join(BinaryTree& tree, std::uint32_t at, std::uint32_t left, std::uint32_t right) {
    tree[at].box = crt::unionOf(tree[left].box, tree[right].box);
    tree[at].left = left;
    tree[at].right = right;
}

/// Of boxes at random places, joined without regard to where they are: as bad as a tree can be.
BinaryTree randomTree(std::mt19937& random, std::uint32_t leaves, std::uint32_t& triangles,
                      float size = 0.2f) {
    std::uniform_real_distribution<float> place(0, 1);
    std::uniform_int_distribution<std::uint32_t> count(1, 3);
    BinaryTree tree(1);
    std::vector<std::uint32_t> roots;
    triangles = 0;
    for (std::uint32_t i = 0; i < leaves; ++i)
        roots.push_back(addLeaf(tree,
                                boxAt(place(random), place(random), place(random), size * place(random)),
                                triangles, count(random)));
    while (roots.size() > 1) {
        std::shuffle(roots.begin(), roots.end(), random);
        const std::uint32_t left = roots.back(), right = roots[roots.size() - 2];
        roots.resize(roots.size() - 2);
        std::uint32_t at = 0;
        if (!roots.empty()) {
            at = static_cast<std::uint32_t>(tree.size());
            tree.emplace_back();
        }
        join(tree, at, left, right);
        roots.push_back(at);
    }
    return tree;
}

/// All boxes that are not leaves: what the search makes small.
double innerSurface(const BinaryTree& tree) {
    double sum = 0;
    for (const BinaryNode& node : tree)
        if (!node.isLeaf()) sum += node.box.halfArea();
    return sum;
}

/// Every node is reached once from the root, and each inner box is that of its two children.
void checkTree(const BinaryTree& tree) {
    std::vector<int> seen(tree.size());
    std::vector<std::uint32_t> open{0};
    int wrong_boxes = 0;
    while (!open.empty()) {
        const BinaryNode& node = tree[open.back()];
        ++seen[open.back()];
        open.pop_back();
        if (node.isLeaf()) continue;
        const BvhBox both = crt::unionOf(tree[node.left].box, tree[node.right].box);
        wrong_boxes += both.lower != node.box.lower || both.upper != node.box.upper;
        open.push_back(node.left);
        open.push_back(node.right);
        REQUIRE(open.size() <= tree.size());
    }
    CHECK(std::all_of(seen.begin(), seen.end(), [](int n) { return n == 1; }));
    CHECK(wrong_boxes == 0);
}

/// Cheapest wide tree by trying all ways to cut, with the costs of Ylitie et al. 2017: 1.5 a node, 1 a
/// triangle, leaves of at most 4 triangles joined.
class AllCuts {
public:
    explicit AllCuts(const BinaryTree& tree) : tree_(tree) {}

    double asChild(std::uint32_t node) const {
        const double area = tree_[node].box.halfArea();
        const std::uint32_t count = triangles(node);
        if (tree_[node].isLeaf()) return area * count;
        const double as_node = asNode(node);
        return count <= 4 ? std::min(area * count, as_node) : as_node;
    }

private:
    double asNode(std::uint32_t node) const {
        double best = std::numeric_limits<double>::infinity();
        for (const auto& children : frontiers(node, 4)) {
            if (children.size() < 2) continue;
            double sum = 0;
            for (const std::uint32_t child : children) sum += asChild(child);
            best = std::min(best, sum);
        }
        return 1.5 * tree_[node].box.halfArea() + best;
    }
    /// All sets of at most `most` nodes of a subtree that cover its leaves once.
    std::vector<std::vector<std::uint32_t>> frontiers(std::uint32_t node, std::size_t most) const {
        std::vector<std::vector<std::uint32_t>> all{{node}};
        if (most < 2 || tree_[node].isLeaf()) return all;
        for (const auto& left : frontiers(tree_[node].left, most - 1))
            for (const auto& right : frontiers(tree_[node].right, most - left.size())) {
                all.push_back(left);
                all.back().insert(all.back().end(), right.begin(), right.end());
            }
        return all;
    }
    std::uint32_t triangles(std::uint32_t node) const {
        const BinaryNode& n = tree_[node];
        return n.isLeaf() ? n.count : triangles(n.left) + triangles(n.right);
    }

    const BinaryTree& tree_;
};

double costOf(const crt::WideTree& wide, const BvhBox& root) {
    double cost = 1.5 * root.halfArea();
    for (const crt::kernel::CrtNode4& node : wide.nodes)
        for (std::size_t c = 0; c < 4; ++c) {
            if (node.bounds[0][c] > node.bounds[1][c]) continue;
            BvhBox box;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                box.lower[axis] = node.bounds[2 * axis][c];
                box.upper[axis] = node.bounds[2 * axis + 1][c];
            }
            const std::uint32_t count = node.child[c] & 15u;
            cost += box.halfArea() * (count > 0 ? count : 1.5);
        }
    return cost;
}

std::vector<std::uint32_t> numbers(std::uint32_t count) {
    std::vector<std::uint32_t> all(count);
    std::iota(all.begin(), all.end(), 0u);
    return all;
}

}  // namespace

TEST_CASE("a leaf that hangs in the wrong half of a tree is put where it belongs", "[bvh]") {
    // Eight boxes on the left, eight on the right; one that lies on the right is among those on the left.
    std::mt19937 random(3);
    std::uint32_t triangles = 0;
    BinaryTree tree(1);
    const auto half = [&](float x, float stray) {
        std::vector<std::uint32_t> roots;
        for (int i = 0; i < 8; ++i)
            roots.push_back(
                addLeaf(tree, boxAt(i == 5 ? stray : x, static_cast<float>(i), 0, 0.5f), triangles, 1));
        while (roots.size() > 1) {
            std::vector<std::uint32_t> above;
            for (std::size_t i = 0; i < roots.size(); i += 2) {
                tree.emplace_back();
                above.push_back(static_cast<std::uint32_t>(tree.size() - 1));
                join(tree, above.back(), roots[i], roots[i + 1]);
            }
            roots = above;
        }
        return roots[0];
    };
    const std::uint32_t left = half(0, 100), right = half(100, 100);
    join(tree, 0, left, right);

    const double before = innerSurface(tree);
    crt::reinsert(tree);
    checkTree(tree);
    CHECK(innerSurface(tree) < before);
    // Its place is in a box as narrow as itself.
    const auto stray = std::find_if(tree.begin(), tree.end(),
                                    [](const BinaryNode& n) { return n.isLeaf() && n.first == 5; });
    const auto number = static_cast<std::uint32_t>(stray - tree.begin());
    const auto parent = std::find_if(tree.begin(), tree.end(), [number](const BinaryNode& n) {
        return !n.isLeaf() && (n.left == number || n.right == number);
    });
    CHECK(parent->box.upper[0] - parent->box.lower[0] == 0.5f);
}

TEST_CASE("moving subtrees keeps a tree one, and makes it much cheaper", "[bvh]") {
    std::mt19937 random(5);
    for (const std::uint32_t leaves : {1u, 2u, 3u, 4u, 7u, 50u, 3000u}) {
        std::uint32_t triangles = 0;
        BinaryTree tree = leaves == 1 ? BinaryTree(1) : randomTree(random, leaves, triangles);
        if (leaves == 1) tree[0].count = 1;
        const double before = innerSurface(tree);
        const std::size_t nodes = tree.size();
        crt::reinsert(tree);
        checkTree(tree);
        CHECK(tree.size() == nodes);
        CHECK(innerSurface(tree) <= before);
        // Random joins have boxes of the whole cube at all levels.
        if (leaves == 3000) CHECK(innerSurface(tree) < before / 5);
    }
}

TEST_CASE("a tree is moved about in bounded time where all boxes are alike, huge or without size", "[bvh]") {
    for (const float size : {0.0f, 1.0f, 3e38f}) {
        std::mt19937 random(6);
        std::uint32_t triangles = 0;
        BinaryTree tree = randomTree(random, 20000, triangles);
        for (BinaryNode& node : tree) node.box = boxAt(size == 3e38f ? -3e38f : 0, 0, 0, size);
        crt::reinsert(tree);
        std::uint32_t leaves = 0;
        for (const BinaryNode& node : tree) leaves += node.isLeaf();
        CHECK(leaves == 20000);
    }
}

TEST_CASE("a tree is made wide in the cheapest of all ways", "[bvh]") {
    std::mt19937 random(7);
    int joined = 0;
    for (int i = 0; i < 300; ++i) {
        std::uint32_t triangles = 0;
        BinaryTree tree = randomTree(random, 2 + i % 13, triangles, i % 3 == 0 ? 20.0f : 0.2f);
        if (i % 2 == 0) crt::reinsert(tree);  // Good trees are cut otherwise than bad ones.
        const crt::WideTree wide = crt::collapse(tree, numbers(triangles), 0.0f, 31);
        CHECK(wide.order.size() == triangles);
        const double best = AllCuts(tree).asChild(0);
        if (wide.nodes.size() == 1 && (wide.nodes[0].child[0] & 15u) == triangles) {
            ++joined;  // One leaf: there is a node because a tree has a root.
            CHECK(costOf(wide, tree[0].box) - 1.5 * tree[0].box.halfArea() == Approx(best).epsilon(1e-5));
        } else {
            CHECK(costOf(wide, tree[0].box) == Approx(best).epsilon(1e-5));
        }
    }
    CHECK(joined > 3);
    CHECK(joined < 150);
}

TEST_CASE("a tree with more levels than are allowed says so, however many there are", "[bvh]") {
    // Each box holds the one before: a chain.
    const auto chainOf = [](int leaves, std::uint32_t& triangles) {
        triangles = 0;
        BinaryTree tree(1);
        std::uint32_t inner = addLeaf(tree, boxAt(0, 0, 0, 1), triangles, 4);
        for (int i = 1; i < leaves; ++i) {
            const std::uint32_t leaf =
                addLeaf(tree, boxAt(0, 0, 0, 1 + static_cast<float>(i)), triangles, 4);
            const std::uint32_t at = i == leaves - 1 ? 0 : static_cast<std::uint32_t>(tree.size());
            if (at != 0) tree.emplace_back();
            join(tree, at, inner, leaf);
            inner = at;
        }
        return tree;
    };
    std::uint32_t triangles = 0;
    const BinaryTree tree = chainOf(200, triangles);
    CHECK(crt::collapse(tree, numbers(triangles), 0.0f, 10).depth > 10);
    const crt::WideTree enough = crt::collapse(tree, numbers(triangles), 0.0f, 200);
    CHECK(enough.depth >= 199 / 3);
    CHECK(enough.order.size() == triangles);

    const BinaryTree endless = chainOf(1'000'000, triangles);
    CHECK(crt::collapse(endless, numbers(triangles), 0.0f, 31).depth == 32);
}
