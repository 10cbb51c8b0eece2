#include "plant.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>

namespace crt::meshgen {
namespace {

/// A twig that needles stand on.
struct Spray {
    Vec from, to;
};

/// A branch of a conifer and its twigs, to both sides and shorter towards the end. Without twigs where it is
/// dead.
void addBranch(Plant& plant, std::vector<Spray>& sprays, Random& random, Vec from, Vec heading, double reach,
               bool is_alive) {
    constexpr std::size_t kPieces = 6;
    // High branches rise, low ones hang; all turn up at their ends.
    const double rise = from.y * 0.95 - 0.45 + random.between(-.1, .1), sag = 0.30 - 0.25 * from.y;
    std::vector<Vec> points;
    std::vector<double> radii;
    const Vec sideways = turned(heading, 90);
    const double bend = random.between(-.12, .12);
    for (std::size_t i = 0; i <= kPieces; ++i) {
        const double t = static_cast<double>(i) / kPieces;
        points.push_back(from + reach * (t * heading + (bend * t * t) * sideways +
                                         Vec{0, rise * t - sag * t * (1 - t) + 0.12 * t * t * t, 0}));
        radii.push_back((0.0012 + 0.016 * reach) * (1 - 0.9 * t));
    }
    plant.addLimb(points, radii, 4);
    if (!is_alive) return;
    sprays.push_back({points[kPieces - 2], points[kPieces]});
    const auto twigs = static_cast<std::size_t>(5 + 60 * reach);
    for (std::size_t i = 0; i < twigs; ++i) {
        const double t =
            0.16 + 0.80 * (static_cast<double>(i) + random.number()) / static_cast<double>(twigs);
        const auto piece = std::min(static_cast<std::size_t>(t * kPieces), kPieces - 1);
        const Vec root = mix(points[piece], points[piece + 1], t * kPieces - static_cast<double>(piece));
        const Vec along = unit(points[piece + 1] - points[piece]);
        const double side = i % 2 == 0 ? 1 : -1;
        const double length = (0.42 * reach * (1 - t) + 0.018) * random.between(.7, 1.15);
        const double aside = side * random.between(.7, 1.2);
        const Vec way = unit(along + aside * sideways - Vec{0, random.between(.05, .4), 0});
        sprays.push_back({root, root + length * way});
    }
}

}  // namespace

Plant conifer(std::uint64_t seed, std::size_t triangles) {
    Random random(seed);
    Plant plant;
    std::vector<Vec> trunk;
    std::vector<double> radii;
    constexpr std::size_t kPieces = 24;
    Vec lean = 0.004 * random.heading();
    for (std::size_t i = 0; i <= kPieces; ++i) {
        const double up = static_cast<double>(i) / kPieces, down = std::max(0.0, 1 - up / 0.05);
        trunk.push_back(Vec{0, up, 0} + (i == 0 || i == kPieces ? 0.0 : 1.0) * lean);
        radii.push_back((0.0165 * (1 - up) + 0.0008) * (1 + 0.6 * down * down));
        lean = lean + 0.0015 * random.heading() - 0.2 * lean;
    }
    plant.addLimb(trunk, radii, 12);

    std::vector<Spray> sprays;
    double heading = random.between(0, 360);
    for (double up = 0.09; up < 0.965;) {
        const unsigned branches = up < 0.85 ? 7 : 5;
        for (unsigned i = 0; i < branches; ++i) {
            const double share = (1 - up) * (1.25 - 0.35 * (1 - up)) * 0.235 + 0.004;
            // Shade kills the lowest.
            const bool is_alive = random.number() < (up - 0.05) * 4.5;
            const double at = std::min(up + random.between(0, .014), .985);
            const std::size_t piece = std::min(static_cast<std::size_t>(at * kPieces), kPieces - 1);
            const Vec from = mix(trunk[piece], trunk[piece + 1], at * kPieces - static_cast<double>(piece));
            const double reach = share * random.between(.72, 1.12) * (is_alive ? 1 : 0.5);
            const double turn = heading + 360.0 / branches * i + random.between(-14, 14);
            addBranch(plant, sprays, random, from, onCircle(turn), reach, is_alive);
        }
        heading += 137.5;
        up += 0.030 - 0.012 * up;
    }
    sprays.push_back({mix(trunk[kPieces - 1], trunk[kPieces], .2), trunk[kPieces]});
    if (plant.triangles() >= triangles)
        throw std::runtime_error("the wood of this tree has " + std::to_string(plant.triangles()) +
                                 " triangles; needles need more than that");

    std::vector<double> along{0};
    for (const Spray& spray : sprays) along.push_back(along.back() + length(spray.to - spray.from));
    const std::size_t needles = (triangles - plant.triangles() + 1) / 2;
    for (std::size_t i = 0; i < needles; ++i) {
        const double at =
            (static_cast<double>(i) + random.number()) / static_cast<double>(needles) * along.back();
        const auto after = std::upper_bound(along.begin() + 1, along.end() - 1, at);
        const auto number = static_cast<std::size_t>(after - along.begin()) - 1;
        const Spray& spray = sprays[number];
        const double size = along[number + 1] - along[number];
        const Vec way = (1 / size) * (spray.to - spray.from);
        const Vec base = spray.from + (at - along[number]) * way;
        const Vec axis = unit(way + 0.95 * random.direction());
        const Vec upper = unit(Vec{0, 1, 0} + 0.8 * random.direction());
        const double needle = random.between(.011, .018);
        plant.addLeaf(base, axis, upper, needle, random.between(.0028, .0044), 0);
    }
    plant.normalise();
    return plant;
}

}  // namespace crt::meshgen
