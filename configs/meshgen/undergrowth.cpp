#include "plant.h"

#include <cmath>
#include <cstddef>

namespace crt::meshgen {

Plant fern(std::uint64_t seed) {
    constexpr std::size_t kFronds = 13, kPieces = 9, kLeaflets = 26;
    struct Leaflet {
        Vec base, axis, upper;
        double length;
    };
    Random random(seed);
    Plant plant;
    std::vector<Leaflet> leaflets;
    for (std::size_t f = 0; f < kFronds; ++f) {
        const Vec heading = onCircle(137.5 * static_cast<double>(f) + random.between(-20, 20));
        const Vec sideways = turned(heading, 90);
        const double reach = random.between(.75, 1.15), height = random.between(.65, 1.15);
        const auto arc = [&](double t) {
            // Up, over, and down again to two fifths of the height.
            return 0.03 * heading + (reach * t * (0.55 + 0.45 * t)) * heading +
                   Vec{0, height * (1.9 * t - 1.45 * t * t), 0};
        };
        std::vector<Vec> points;
        std::vector<double> radii;
        for (std::size_t i = 0; i <= kPieces; ++i) {
            const double t = static_cast<double>(i) / kPieces;
            points.push_back(arc(t));
            radii.push_back(0.008 * (1 - 0.8 * t));
        }
        plant.addLimb(points, radii, 3);
        for (std::size_t i = 0; i < kLeaflets; ++i) {
            const double t = 0.18 + 0.80 * static_cast<double>(i) / kLeaflets;
            const Vec along = unit(arc(t + 0.02) - arc(t));
            const double size = 1.15 * (1 - t) * (0.35 + t) * 0.62 * random.between(.9, 1.1) + 0.02;
            for (const double side : {-1.0, 1.0})
                leaflets.push_back(
                    {arc(t), unit(side * sideways + 0.45 * along - Vec{0, random.between(.05, .25), 0}),
                     cross(along, sideways), size});
        }
    }
    for (const Leaflet& leaflet : leaflets) {
        const Vec upper = leaflet.upper.y < 0 ? -1.0 * leaflet.upper : leaflet.upper;
        plant.addLeaf(leaflet.base, leaflet.axis, unit(upper + 0.25 * random.direction()), leaflet.length,
                      0.055 + 0.06 * leaflet.length, -.1);
    }
    plant.normalise();
    return plant;
}

Plant grass(std::uint64_t seed) {
    constexpr std::size_t kBlades = 1400;
    Random random(seed);
    Plant plant;
    for (std::size_t i = 0; i < kBlades; ++i) {
        const Vec heading = random.heading();
        const double away = 3.2 * std::sqrt(random.number());
        const Vec base = away * random.heading();
        const double lean = random.between(.1, .9);
        const double length = random.between(.35, 1.05);
        plant.addLeaf(base, unit(Vec{0, 1, 0} + lean * heading), -1.0 * heading, length, .05,
                      random.between(-.4, .4));
    }
    plant.normalise();
    return plant;
}

}  // namespace crt::meshgen
