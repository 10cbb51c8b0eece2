#include "compile/light_tree.h"

#include "base/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

namespace crt {
namespace {

using std::numbers::pi;
constexpr std::size_t kBuckets = 12;
/// Below, nodes are halved by number: no arrangement of lights makes a tree deeper than that and their
/// logarithm.
constexpr int kDepth = 48;

double angleBetween(const Vec3d& a, const Vec3d& b) {
    const Vec3d across = cross(a, b);
    return std::atan2(std::sqrt(dot(across, across)), dot(a, b));
}

/// Unit a, turned towards unit b by an angle.
Vec3d turned(const Vec3d& a, const Vec3d& b, double angle) {
    const Vec3d rest = b - a * dot(a, b);
    const Vec3d axis = a * std::cos(angle) + rest * (std::sin(angle) / std::sqrt(dot(rest, rest)));
    return axis * (1 / std::sqrt(dot(axis, axis)));
}

/// The cone of normals around both.
void uniteCones(const LightBounds& a, const LightBounds& b, LightBounds& both) {
    both.axis = a.axis;
    both.theta_o = a.theta_o;
    const double between = angleBetween(a.axis, b.axis);
    if (std::min(between + b.theta_o, pi) <= a.theta_o) return;
    both.axis = b.axis;
    both.theta_o = b.theta_o;
    if (std::min(between + a.theta_o, pi) <= b.theta_o) return;
    const double spread = (a.theta_o + between + b.theta_o) / 2;
    both.theta_o = std::min(spread, pi);
    // Opposite axes: any plane would do, and all directions are as good.
    if (spread >= pi || between > pi - 1e-9)
        both.theta_o = pi;
    else
        both.axis = turned(a.axis, b.axis, spread - a.theta_o);
}

double surfaceOf(const LightBounds& b) {
    const Vec3d d = b.upper - b.lower;
    return 2 * (d[0] * d[1] + d[1] * d[2] + d[2] * d[0]);
}

/// Directions that are lit, weighed by the cosine (Conty Estevez and Kulla 2018, equation 1).
double orientationOf(const LightBounds& b) {
    const double o = b.theta_o, w = std::min(o + b.theta_e, pi);
    return 2 * pi * (1 - std::cos(o)) + pi / 2 * (2 * w * std::sin(o) - std::cos(o - 2 * w) -
                                                    2 * o * std::sin(o) + std::cos(o));
}

double costOf(const LightBounds& b) { return b.power * orientationOf(b) * surfaceOf(b); }

Vec3d middleOf(const LightBounds& b) { return (b.lower + b.upper) * 0.5; }

/// Halves lights until they are alone; of that binary tree nodes of four children are made.
class LightTreeBuilder {
public:
    explicit LightTreeBuilder(const std::vector<LightBounds>& lights)
        : lights_(lights), order_(lights.size()) {
        std::iota(order_.begin(), order_.end(), 0u);
        halves_.resize(2 * lights.size() - 1);
        for (const LightBounds& light : lights) whole_ += light.power;
        halve(0, 0, lights.size(), 0);
        tree_.leaf_of.resize(lights.size());
        join(0, 0);
    }
    LightTree take() { return std::move(tree_); }

private:
    /// Of the binary tree.
    struct Half {
        LightBounds bounds;
        std::uint32_t left = 0, right = 0;  ///< 0: one light alone.
        std::uint32_t light = 0;
        std::size_t lights = 1;
    };

    /// Behind a half lie those of its left part, 2 n - 1 of n lights, and then those of its right one.
    void halve(std::uint32_t self, std::size_t first, std::size_t end, int depth) {
        constexpr std::size_t kOfThread = 512;
        Half& half = halves_[self];
        half.lights = end - first;
        if (half.lights == 1) {
            half.light = order_[first];
            half.bounds = lights_[half.light];
            return;
        }
        const std::size_t middle = split(first, end, depth);
        half.left = self + 1;
        half.right = self + static_cast<std::uint32_t>(2 * (middle - first));
        const auto left = [&] { halve(half.left, first, middle, depth + 1); };
        const auto right = [&] { halve(half.right, middle, end, depth + 1); };
        if (half.lights > kOfThread) {
            parallelInvoke(left, right);
        } else {
            left();
            right();
        }
        half.bounds = boundsOfBoth(halves_[half.left].bounds, halves_[half.right].bounds);
    }

    /// Up to four of the halves below one: again and again that is opened which costs most.
    std::vector<std::uint32_t> childrenOf(std::uint32_t half) const {
        std::vector<std::uint32_t> children{half};
        while (children.size() < 4) {
            auto most = children.end();
            for (auto i = children.begin(); i != children.end(); ++i) {
                if (halves_[*i].left == 0) continue;
                // Lights on a line, or in a point, have no surface, and cost nothing.
                const auto cost = [&](auto at) {
                    return std::pair(costOf(halves_[*at].bounds), halves_[*at].lights);
                };
                if (most == children.end() || cost(i) > cost(most)) most = i;
            }
            if (most == children.end()) break;
            const Half& opened = halves_[*most];
            *most = opened.left;
            children.insert(most + 1, opened.right);
        }
        return children;
    }

    void join(std::uint32_t half, std::uint32_t parent) {
        const auto self = static_cast<std::uint32_t>(tree_.nodes.size());
        tree_.nodes.emplace_back();
        tree_.nodes[self].parent = parent;
        const std::vector<std::uint32_t> children = childrenOf(half);
        for (std::uint32_t lane = 0; lane < children.size(); ++lane) {
            const Half& child = halves_[children[lane]];
            setChild(child.bounds, lane, tree_.nodes[self]);
            if (child.left == 0) {
                tree_.nodes[self].child[lane] = CRT_LIGHT_LEAF + child.light;
                tree_.leaf_of[child.light] = 4 * self + lane;
            } else {
                tree_.nodes[self].child[lane] = static_cast<std::uint32_t>(tree_.nodes.size());
                join(children[lane], 4 * self + lane);
            }
        }
    }

    void setChild(const LightBounds& bounds, std::uint32_t lane, kernel::CrtLightNode& node) const {
        const Vec3d centre = middleOf(bounds), half = (bounds.upper - bounds.lower) * 0.5;
        float* const centres[] = {node.centre_x, node.centre_y, node.centre_z};
        float* const axes[] = {node.axis_x, node.axis_y, node.axis_z};
        for (std::size_t k = 0; k < 3; ++k) {
            centres[k][lane] = static_cast<float>(centre[k]);
            axes[k][lane] = static_cast<float>(bounds.axis[k]);
        }
        // And the rounding of both.
        const double size = std::sqrt(dot(half, half)), far = std::sqrt(dot(centre, centre));
        node.radius[lane] = static_cast<float>(size * (1 + 0x1p-20) + (size > 0 ? far * 0x1p-22 : 0));
        // A light as dim as can be is a light.
        node.power[lane] = std::max(static_cast<float>(bounds.power / whole_), 1e-30f);
        node.cos_o[lane] = static_cast<float>(std::cos(bounds.theta_o));
        node.sin_o[lane] = static_cast<float>(std::sin(bounds.theta_o));
        node.cos_e[lane] = static_cast<float>(std::cos(bounds.theta_e));
        node.back[lane] = bounds.two_sided ? -1.0f : 1.0f;
    }

    struct Split {
        double cost = std::numeric_limits<double>::infinity();
        std::size_t axis = 0, bucket = 0;
    };

    /// Start of the second half; the order of lights is changed so that halves lie together.
    std::size_t split(std::size_t first, std::size_t end, int depth) {
        const auto begin = order_.begin();
        const auto from = begin + static_cast<std::ptrdiff_t>(first),
                   to = begin + static_cast<std::ptrdiff_t>(end);
        Vec3d lower = middleOf(lights_[*from]), upper = lower;
        LightBounds all = lights_[*from];
        for (auto i = from + 1; i != to; ++i) {
            const Vec3d middle = middleOf(lights_[*i]);
            for (std::size_t k = 0; k < 3; ++k) {
                lower[k] = std::min(lower[k], middle[k]);
                upper[k] = std::max(upper[k], middle[k]);
            }
            for (std::size_t k = 0; k < 3; ++k) {
                all.lower[k] = std::min(all.lower[k], lights_[*i].lower[k]);
                all.upper[k] = std::max(all.upper[k], lights_[*i].upper[k]);
            }
        }
        const Vec3d size = all.upper - all.lower;
        const double longest = std::max({size[0], size[1], size[2]});
        Split best;
        for (std::size_t axis = 0; axis < 3 && depth < kDepth; ++axis)
            if (upper[axis] > lower[axis])
                bestOfAxis(first, end, axis, lower[axis], upper[axis], longest / size[axis], best);
        if (!(best.cost < std::numeric_limits<double>::infinity())) return first + (end - first) / 2;
        const auto middle = std::stable_partition(from, to, [&](std::uint32_t light) {
            return bucketOf(light, best.axis, lower[best.axis], upper[best.axis]) <= best.bucket;
        });
        return static_cast<std::size_t>(middle - begin);
    }

    std::size_t bucketOf(std::uint32_t light, std::size_t axis, double lower, double upper) const {
        const double t = (middleOf(lights_[light])[axis] - lower) / (upper - lower);
        return std::min(static_cast<std::size_t>(t * kBuckets), kBuckets - 1);
    }

    void bestOfAxis(std::size_t first, std::size_t end, std::size_t axis, double lower, double upper,
                    double thinness, Split& best) const {
        std::array<LightBounds, kBuckets> buckets, rest;
        std::array<bool, kBuckets> used{};
        for (std::size_t i = first; i < end; ++i) {
            const std::size_t b = bucketOf(order_[i], axis, lower, upper);
            buckets[b] = used[b] ? boundsOfBoth(buckets[b], lights_[order_[i]]) : lights_[order_[i]];
            used[b] = true;
        }
        // The first and the last bucket have lights: of the middles at both ends.
        rest[kBuckets - 1] = buckets[kBuckets - 1];
        for (std::size_t b = kBuckets - 1; b-- > 0;)
            rest[b] = used[b] ? boundsOfBoth(buckets[b], rest[b + 1]) : rest[b + 1];
        LightBounds before = buckets[0];
        for (std::size_t b = 0; b + 1 < kBuckets; ++b) {
            if (b > 0 && used[b]) before = boundsOfBoth(before, buckets[b]);
            const double cost = thinness * (costOf(before) + costOf(rest[b + 1]));
            if (cost < best.cost) best = {cost, axis, b};
        }
    }

    const std::vector<LightBounds>& lights_;
    std::vector<std::uint32_t> order_;
    std::vector<Half> halves_;  ///< The whole first.
    LightTree tree_;
    double whole_ = 0;
};

}  // namespace

LightBounds boundsOfBoth(const LightBounds& a, const LightBounds& b) {
    LightBounds both;
    for (std::size_t k = 0; k < 3; ++k) {
        both.lower[k] = std::min(a.lower[k], b.lower[k]);
        both.upper[k] = std::max(a.upper[k], b.upper[k]);
    }
    uniteCones(a, b, both);
    both.theta_e = std::max(a.theta_e, b.theta_e);
    both.power = a.power + b.power;
    both.two_sided = a.two_sided || b.two_sided;
    return both;
}

LightTree buildLightTree(const std::vector<LightBounds>& lights) { return LightTreeBuilder(lights).take(); }

}  // namespace crt
