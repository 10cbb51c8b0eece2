#include "plant.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>

namespace crt::meshgen {
namespace {

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

/// A point of the wood, and the way to it from the ground.
struct Joint {
    Vec place;
    std::size_t parent = kNone;
    std::vector<std::size_t> children{};
    double radius = 0;
};
using Skeleton = std::vector<Joint>;

constexpr double kStep = 0.021;
constexpr double kReached = 0.036;  // A point of the crown that is nearer than this has its twig.
constexpr double kSeen = 0.30;      // One that is farther does not draw.
constexpr double kTwig = 0.0008;    // Radius of the last twigs.
constexpr double kLeafy = 0.0026;   // Wood thicker than this has no leaves.

std::size_t addJoint(Skeleton& wood, std::size_t parent, Vec place) {
    wood.push_back({place, parent});
    if (parent != kNone) wood[parent].children.push_back(wood.size() - 1);
    return wood.size() - 1;
}

/// Distance from the middle of the crown, 1 at its rim.
double crownDistance(Vec p) {
    constexpr double kMiddle = 0.60, kBelow = 0.31, kAbove = 0.40, kWide = 0.29;
    const double up = (p.y - kMiddle) / (p.y < kMiddle ? kBelow : kAbove);
    return std::sqrt((p.x * p.x + p.z * p.z) / (kWide * kWide) + up * up);
}

/// Twigs end at these: most of them near the rim, in clumps with gaps between them.
std::vector<Vec> crownPoints(Random& random) {
    constexpr std::size_t kClumps = 130, kPoints = 2600;
    std::vector<Vec> clumps, points;
    while (clumps.size() < kClumps) {
        const Vec p = 0.42 * random.direction() + Vec{0, 0.6, 0};
        const Vec at = mix({0, 0.58, 0}, p, random.between(.5, 1));
        if (crownDistance(at) < 0.97) clumps.push_back(at);
    }
    while (points.size() < kPoints) {
        const Vec clump = clumps[static_cast<std::size_t>(random.number() * kClumps)];
        const double away = random.between(.01, .095);
        const Vec p = clump + away * random.direction();
        if (crownDistance(p) < 1) points.push_back(p);
    }
    return points;
}

/// Each joint that is the nearest of some point goes on towards its points.
Skeleton grown(Random& random) {
    Skeleton wood;
    Vec lean = 0.12 * random.heading();
    for (std::size_t joint = addJoint(wood, kNone, {}); wood[joint].place.y < 0.30;) {
        lean = lean + 0.05 * random.heading() - 0.1 * lean;
        joint = addJoint(wood, joint, wood[joint].place + kStep * unit(Vec{0, 1, 0} + lean));
    }

    struct Goal {
        Vec place;
        std::size_t nearest;
        double square;
    };
    std::vector<Goal> goals;
    for (const Vec& p : crownPoints(random)) goals.push_back({p, kNone, kSeen * kSeen});
    for (std::size_t seen = 0; seen < wood.size();) {
        for (Goal& goal : goals)
            for (std::size_t j = seen; j < wood.size(); ++j) {
                const Vec way = goal.place - wood[j].place;
                if (const double square = dot(way, way); square < goal.square)
                    goal = {goal.place, j, square};
            }
        std::erase_if(goals, [](const Goal& goal) { return goal.square < kReached * kReached; });
        seen = wood.size();
        std::vector<Vec> pull(seen);
        for (const Goal& goal : goals)
            if (goal.nearest != kNone)
                pull[goal.nearest] = pull[goal.nearest] + unit(goal.place - wood[goal.nearest].place);
        for (std::size_t j = 0; j < seen; ++j) {
            if (dot(pull[j], pull[j]) < 1e-6) continue;
            const Vec way = unit(unit(pull[j]) + 0.22 * random.direction() + Vec{0, 0.08, 0});
            const Vec next = wood[j].place + kStep * way;
            // Points on two sides of a joint could draw it to the same place for ever.
            const bool is_there =
                std::any_of(wood[j].children.begin(), wood[j].children.end(),
                            [&](std::size_t child) { return length(wood[child].place - next) < kStep / 2; });
            if (!is_there) addJoint(wood, j, next);
        }
    }
    return wood;
}

/// The cross-section of a branch is that of all twigs beyond together (Leonardo da Vinci).
void setRadii(Skeleton& wood) {
    for (std::size_t j = wood.size(); j-- > 0;) {  // Children come after their parents.
        double square = 0;
        for (const std::size_t child : wood[j].children) square += wood[child].radius * wood[child].radius;
        wood[j].radius = wood[j].children.empty() ? kTwig : std::sqrt(square);
    }
    for (Joint& joint : wood)
        if (constexpr double kFlare = 0.06; joint.place.y < kFlare) {
            const double down = 1 - joint.place.y / kFlare;
            joint.radius *= 1 + 0.7 * down * down;
        }
}

unsigned sidesOf(double radius) {
    return radius > 0.014 ? 14 : radius > 0.006 ? 8 : radius > 0.0025 ? 5 : 3;
}

/// A limb goes on into the thickest branch at every fork; the others begin within it.
void addLimbs(Plant& plant, const Skeleton& wood) {
    std::vector<std::size_t> beginnings{0};
    while (!beginnings.empty()) {
        std::size_t joint = beginnings.back();
        beginnings.pop_back();
        std::vector<Vec> points;
        std::vector<double> radii;
        if (wood[joint].parent != kNone) {
            points.push_back(wood[wood[joint].parent].place);
            radii.push_back(wood[joint].radius);
        }
        const unsigned sides = sidesOf(wood[joint].radius);
        for (std::size_t count = 0;; ++count) {
            const Joint& here = wood[joint];
            // Thin limbs have every second joint.
            if (here.radius > kLeafy || count % 2 == 1 || here.children.empty() || points.empty()) {
                points.push_back(here.place);
                radii.push_back(here.radius);
            }
            if (here.children.empty()) break;
            const std::size_t next = *std::max_element(
                here.children.begin(), here.children.end(),
                [&](std::size_t a, std::size_t b) { return wood[a].radius < wood[b].radius; });
            for (const std::size_t child : here.children)
                if (child != next) beginnings.push_back(child);
            joint = next;
        }
        plant.addLimb(points, radii, sides);
    }
}

}  // namespace

Plant broadleaf(std::uint64_t seed, std::size_t triangles) {
    Random random(seed);
    Skeleton wood = grown(random);
    setRadii(wood);
    Plant plant;
    addLimbs(plant, wood);
    if (plant.triangles() >= triangles)
        throw std::runtime_error("the wood of this tree has " + std::to_string(plant.triangles()) +
                                 " triangles; leaves need more than that");

    std::vector<std::size_t> twigs;
    for (std::size_t j = 1; j < wood.size(); ++j)
        if (wood[j].radius < kLeafy) twigs.push_back(j);
    for (std::size_t i = 0; plant.triangles() < triangles; ++i) {
        const Joint& twig = wood[twigs[i % twigs.size()]];
        const Vec along = twig.place - wood[twig.parent].place;
        const Vec stalk = wood[twig.parent].place + random.number() * along;
        const Vec outward = random.direction();
        const Vec base = stalk + random.between(.002, .030) * outward;
        const Vec axis = unit(outward + 0.5 * unit(along) + 0.6 * random.direction() - Vec{0, 0.35, 0});
        const Vec upper = unit(Vec{0, 1, 0} + 0.55 * random.direction());
        const double size = random.between(.0105, .0170);
        plant.addLeaf(base, axis, upper, size, 0.62 * size, random.between(-.16, .06));
    }
    plant.normalise();
    return plant;
}

}  // namespace crt::meshgen
