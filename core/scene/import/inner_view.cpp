#include "scene/import/inner_view.h"

#include "scene/import/scene_text.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <set>
#include <utility>

namespace crt {
namespace {

using Materials = std::set<std::uint32_t>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPi = std::numbers::pi;

struct Hit {
    double distance = kInfinity;  ///< Infinite: none.
    std::uint32_t material = 0;
    bool front = false;

    bool any() const { return distance < kInfinity; }
};

Vec3d wide(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

Bounds boundsOf(const PaintedTriangle& triangle) {
    const Vec3d corner = wide(triangle.corner);
    Bounds bounds;
    bounds.add(corner);
    bounds.add(corner + wide(triangle.to_second));
    bounds.add(corner + wide(triangle.to_third));
    return bounds;
}

/// By Möller and Trumbore (1997).
void testTriangle(const PaintedTriangle& triangle, const Vec3d& origin, const Vec3d& direction, Hit& hit) {
    const Vec3d second = wide(triangle.to_second), third = wide(triangle.to_third);
    const Vec3d p = cross(direction, third), s = origin - wide(triangle.corner), q = cross(s, second);
    const double det = dot(second, p);
    const double u = dot(s, p) / det, v = dot(direction, q) / det, t = dot(third, q) / det;
    if (u >= 0 && v >= 0 && u + v <= 1 && t > 0 && t < hit.distance) hit = {t, triangle.material, det > 0};
}

/// A tree of boxes, each halved by number along its longest side: little to build, and enough for the few
/// rays that are asked for.
class Tree {
public:
    /// `rays`: about as many are asked for.
    Tree(const std::vector<PaintedTriangle>& triangles, std::uint64_t rays)
        : triangles_(triangles), most_steps_(rays * kStepsOfRay) {
        order_.resize(triangles.size());
        std::iota(order_.begin(), order_.end(), 0u);
        nodes_.reserve(2 * triangles.size() / kLeaf + 1);
        build(0, triangles.size());
    }

    Hit nearest(const Vec3d& origin, const Vec3d& direction) const {
        Hit hit;
        const Vec3d inverse{1 / direction[0], 1 / direction[1], 1 / direction[2]};
        visit(0, origin, direction, inverse, hit);
        return hit;
    }
    const Bounds& bounds() const { return nodes_[0].bounds; }

    /// True if the rays took more steps than allowed, as when all triangles lie at one place. Further ones
    /// find nothing.
    bool isExhausted() const { return steps_ > most_steps_; }

private:
    static constexpr std::size_t kLeaf = 4;
    /// Nodes visited and triangles tested: three times what large buildings take.
    static constexpr std::uint64_t kStepsOfRay = 1000;

    struct Node {
        Bounds bounds;
        std::size_t begin, end;  // Of its triangles, in `order_`.
        std::size_t second = 0;  // Its other child; the first comes behind it. 0: a leaf.
    };

    std::size_t build(std::size_t begin, std::size_t end);
    void visit(std::size_t number, const Vec3d& origin, const Vec3d& direction, const Vec3d& inverse,
               Hit& hit) const;
    /// Distance at which the ray enters the box; infinite if it does not before `limit`.
    static double entry(const Bounds& bounds, const Vec3d& origin, const Vec3d& inverse, double limit);

    const std::vector<PaintedTriangle>& triangles_;
    const std::uint64_t most_steps_;
    std::vector<std::uint32_t> order_;
    std::vector<Node> nodes_;
    mutable std::uint64_t steps_ = 0;
};

std::size_t Tree::build(std::size_t begin, std::size_t end) {
    const std::size_t number = nodes_.size();
    nodes_.push_back({{}, begin, end});
    Bounds bounds;
    for (std::size_t i = begin; i < end; ++i) {
        const Bounds own = boundsOf(triangles_[order_[i]]);
        bounds.add(own.lower);
        bounds.add(own.upper);
    }
    nodes_[number].bounds = bounds;
    if (end - begin <= kLeaf) return number;
    const Vec3d extent = bounds.upper - bounds.lower;
    const auto axis =
        static_cast<std::size_t>(std::max_element(extent.begin(), extent.end()) - extent.begin());
    const auto place = [&](std::uint32_t i) {
        const PaintedTriangle& t = triangles_[i];
        return 3 * t.corner[axis] + t.to_second[axis] + t.to_third[axis];
    };
    const std::size_t middle = begin + (end - begin) / 2;
    const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
        return std::pair(place(a), a) < std::pair(place(b), b);
    });
    build(begin, middle);
    const std::size_t second = build(middle, end);
    nodes_[number].second = second;
    return number;
}

double Tree::entry(const Bounds& bounds, const Vec3d& origin, const Vec3d& inverse, double limit) {
    double enter = 0, leave = limit;
    for (std::size_t k = 0; k < 3; ++k) {
        // Along a side of the box both may be no number, which these comparisons pass over.
        const double one = (bounds.lower[k] - origin[k]) * inverse[k],
                     other = (bounds.upper[k] - origin[k]) * inverse[k];
        enter = std::max(enter, std::min(one, other));
        leave = std::min(leave, std::max(one, other));
    }
    return enter <= leave ? enter : kInfinity;
}

void Tree::visit(std::size_t number, const Vec3d& origin, const Vec3d& direction, const Vec3d& inverse,
                 Hit& hit) const {
    const Node& node = nodes_[number];
    steps_ += 1 + (node.second == 0 ? node.end - node.begin : 0);
    if (isExhausted()) return;
    if (node.second == 0) {
        for (std::size_t i = node.begin; i < node.end; ++i)
            testTriangle(triangles_[order_[i]], origin, direction, hit);
        return;
    }
    std::pair<double, std::size_t> near{entry(nodes_[number + 1].bounds, origin, inverse, hit.distance),
                                        number + 1},
        far{entry(nodes_[node.second].bounds, origin, inverse, hit.distance), node.second};
    if (far < near) std::swap(near, far);
    if (near.first < hit.distance) visit(near.second, origin, direction, inverse, hit);
    if (far.first < hit.distance) visit(far.second, origin, direction, inverse, hit);
}

Vec3d unit(const Vec3d& v) { return v * (1 / length(v)); }

/// The directions of a picture from the left to the right and from above, through `side` × `side` points.
/// `across` and `up` are half of its width and height at the distance 1.
template <class Do>
void forPicture(const Vec3d& ahead, double across, double up, int side, Do&& what) {
    const Vec3d right = unit(cross(ahead, {0, 1, 0})), above = cross(right, ahead);
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x)
            what(right * (across * ((2 * x + 1.0) / side - 1)) + above * (up * (1 - (2 * y + 1.0) / side)));
}

/// Materials whose front sides are seen from around, in parallel projection.
Materials seenFromAround(const Tree& tree) {
    constexpr int kViews = 8, kSide = 48;
    const double radius = tree.bounds().radius();
    Materials seen;
    for (int view = 0; view < kViews; ++view) {
        const Vec3d back = backOfChosenCamera(kChosenTurn_deg + 360.0 / kViews * view);
        const Vec3d middle = tree.bounds().centre() + back * (2 * radius);
        forPicture(back * -1, radius, radius, kSide, [&](const Vec3d& beside) {
            if (const Hit hit = tree.nearest(middle + beside, back * -1); hit.any() && hit.front)
                seen.insert(hit.material);
        });
    }
    return seen;
}

constexpr int kAround = 256;

/// The directions of a spiral of equal solid angles.
Vec3d directionAround(int i, int count = kAround) {
    const double y = 1 - (2 * i + 1.0) / count, flat = std::sqrt(1 - y * y),
                 turn = i * kPi * (3 - std::sqrt(5.0));
    return {flat * std::cos(turn), y, flat * std::sin(turn)};
}

/// The value that this share of them is below.
double quantileOf(std::vector<double> values, double share) {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size()));
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

/// True if single precision, in which triangles are kept, holds them. Only then may a tree be built: what is
/// not a number has no order.
bool isOfUsualSize(const std::vector<PaintedTriangle>& triangles) {
    Bounds bounds;
    for (const PaintedTriangle& t : triangles) {
        const Bounds own = boundsOf(t);
        bounds.add(own.lower);
        bounds.add(own.upper);
    }
    const double radius = bounds.radius();
    return radius > 1e-15 && radius < 1e15;
}

/// The view from a place.
struct Place {
    Vec3d position;
    Materials seen;
};

/// A place that is within something, in the open there, and shows more than `least` materials.
std::optional<Place> placeAt(const Tree& tree, const Vec3d& position, std::size_t least) {
    constexpr double kLeastFronts = 0.6;  // Of all rays: a court is open above.
    constexpr double kMostBacks = 0.02;   // More are within a body.
    constexpr double kClearance = 0.01;   // Of the radius.
    const double clearance = kClearance * tree.bounds().radius();
    Place place{position, {}};
    int fronts = 0, backs = 0;
    for (int i = 0; i < kAround; ++i) {
        const Hit hit = tree.nearest(position, directionAround(i));
        if (!hit.any()) continue;
        if (hit.distance < clearance) return std::nullopt;
        ++(hit.front ? fronts : backs);
        if (hit.front) place.seen.insert(hit.material);
        if (backs > kMostBacks * kAround) return std::nullopt;
    }
    if (fronts < kLeastFronts * kAround || place.seen.size() <= least) return std::nullopt;
    return place;
}

/// A level view; the better, the more materials it has, and of those with as many the farther it goes.
struct Candidate {
    InnerView view;
    std::size_t materials = 0;
    double depth = 0;

    bool operator<(const Candidate& other) const {
        return std::pair(materials, depth) < std::pair(other.materials, other.depth);
    }
};

Candidate viewFrom(const Tree& tree, const Vec3d& position, const Vec3d& ahead, double aspect) {
    constexpr int kSide = 20;
    constexpr double kFov_deg = 60;
    const double shorter = std::tan(kFov_deg / 2 * kPi / 180);
    Materials seen;
    std::vector<double> distances;
    Candidate candidate;
    forPicture(ahead, shorter * std::max(aspect, 1.0), shorter * std::max(1 / aspect, 1.0), kSide,
               [&](const Vec3d& beside) {
                   const Hit hit = tree.nearest(position, unit(ahead + beside));
                   if (!hit.any()) return;
                   distances.push_back(hit.distance);
                   candidate.depth += std::log(hit.distance / tree.bounds().radius()) / (kSide * kSide);
                   if (hit.front) seen.insert(hit.material);
               });
    if (distances.empty()) return candidate;
    const double half = quantileOf(std::move(distances), 0.5);
    candidate.view = {position, position + ahead * half, kFov_deg, half};
    candidate.materials = seen.size();
    return candidate;
}

}  // namespace

PaintedTriangle::PaintedTriangle(const Vec3d& a, const Vec3d& b, const Vec3d& c, std::uint32_t painted)
    : material(painted) {
    for (std::size_t k = 0; k < 3; ++k) {
        corner[k] = static_cast<float>(a[k]);
        to_second[k] = static_cast<float>(b[k] - a[k]);
        to_third[k] = static_cast<float>(c[k] - a[k]);
    }
}

std::optional<InnerView> innerView(const std::vector<PaintedTriangle>& triangles, double aspect) {
    constexpr std::size_t kMoreThan = 2;  // Times what is seen from around.
    constexpr int kPlaces = 9;            // Along each side of the box.
    constexpr std::size_t kBest = 8;
    constexpr int kAzimuths = 16;
    Materials all;
    for (const PaintedTriangle& t : triangles) all.insert(t.material);
    if (all.size() < kFewestMaterialsOfBuildings || !isOfUsualSize(triangles)) return std::nullopt;
    const Tree tree(triangles, 300'000);
    const std::size_t around = std::max<std::size_t>(seenFromAround(tree).size(), 1);
    if (all.size() <= kMoreThan * around) return std::nullopt;
    std::vector<Place> places;
    for (int i = 0; i < kPlaces * kPlaces * kPlaces; ++i) {
        const std::array<int, 3> at{i % kPlaces, i / kPlaces % kPlaces, i / (kPlaces * kPlaces)};
        const Bounds& bounds = tree.bounds();
        Vec3d position = bounds.lower;
        for (std::size_t k = 0; k < 3; ++k)
            position[k] += (bounds.upper[k] - bounds.lower[k]) * (at[k] + 0.5) / kPlaces;
        if (auto place = placeAt(tree, position, kMoreThan * around)) places.push_back(std::move(*place));
    }
    std::stable_sort(places.begin(), places.end(),
                     [](const Place& a, const Place& b) { return a.seen.size() > b.seen.size(); });
    if (places.size() > kBest) places.resize(kBest);
    Candidate best;
    for (const Place& place : places)
        for (int i = 0; i < kAzimuths; ++i) {
            const double turn = 2 * kPi * i / kAzimuths;
            best =
                std::max(best, viewFrom(tree, place.position, {std::sin(turn), 0, -std::cos(turn)}, aspect));
        }
    return best.materials > 0 && !tree.isExhausted() ? std::optional(best.view) : std::nullopt;
}

std::optional<double> distanceWithin(const std::vector<PaintedTriangle>& triangles, const Vec3d& position,
                                     const Vec3d& ahead, double fov) {
    constexpr int kFine = 64 * kAround;
    constexpr double kLeastFov = 0.1;  // It still holds 10 directions.
    constexpr double kNearest = 0.25;  // Before the dome of a sky there are things to look at.
    if (triangles.empty() || !isOfUsualSize(triangles)) return std::nullopt;
    const Tree tree(triangles, kAround + kFine);
    for (int i = 0; i < kAround; ++i)
        if (!tree.nearest(position, directionAround(i)).any()) return std::nullopt;
    const double seen = std::cos(std::max(fov, kLeastFov) / 2);
    std::vector<double> distances;
    for (int i = 0; i < kFine; ++i)
        if (const Vec3d direction = directionAround(i, kFine); dot(direction, ahead) > seen)
            distances.push_back(tree.nearest(position, direction).distance);
    if (tree.isExhausted()) return std::nullopt;
    return quantileOf(std::move(distances), kNearest);
}

}  // namespace crt
