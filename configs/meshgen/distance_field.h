/// Signed distances to round shapes, and their smooth union.
#pragma once

#include "vectors.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace crt::meshgen {

/// Minimum with a fillet of about width k where the two are equal.
double smoothMin(double a, double b, double k);
/// Distance to a cone from `a` to `b` with round ends of radius ra and rb: a bone.
double roundCone(Vec p, Vec a, Vec b, double ra, double rb);
/// Close to the distance to an axis-aligned ellipsoid: exact on it, and with the right slope there.
double ellipsoid(Vec p, Vec centre, Vec radii);
/// Distance to a box with edges rounded by r.
double roundBox(Vec p, Vec centre, Vec half, double r);
/// Distance to a triangle thickened by r: a piece of skin.
double membrane(Vec p, Vec a, Vec b, Vec c, double r);

/// Shapes put together one after the other, each blended into those before it.
class Field {
public:
    using Distance = std::function<double(Vec)>;

    void add(double blend, Distance distance) { parts_.push_back({blend, false, std::move(distance)}); }
    void carve(double blend, Distance distance) { parts_.push_back({blend, true, std::move(distance)}); }
    void addBone(Vec a, Vec b, double ra, double rb, double blend) {
        add(blend, [=](Vec p) { return roundCone(p, a, b, ra, rb); });
    }
    void addBall(Vec centre, Vec radii, double blend) {
        add(blend, [=](Vec p) { return ellipsoid(p, centre, radii); });
    }

    /// The parts that matter within `radius` of `centre`: most of a figure is far from any one place.
    std::vector<std::uint32_t> partsNear(Vec centre, double radius) const {
        std::vector<double> distance(parts_.size());
        double nearest = 1e30;
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            distance[i] = parts_[i].distance(centre);
            if (!parts_[i].carved) nearest = std::min(nearest, distance[i]);
        }
        std::vector<std::uint32_t> near;
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            const double reach = parts_[i].blend + 3.0 * radius;
            if (distance[i] < (parts_[i].carved ? reach : nearest + reach))
                near.push_back(static_cast<std::uint32_t>(i));
        }
        return near;
    }

    /// Negative inside. Everything below the ground is cut off.
    double operator()(Vec p, const std::vector<std::uint32_t>& near) const {
        double d = 1e30;
        for (const std::uint32_t i : near) {
            const Part& part = parts_[i];
            d = part.carved ? -smoothMin(-d, part.distance(p), part.blend)
                            : smoothMin(d, part.distance(p), part.blend);
        }
        return std::max(d, -p.y);
    }

private:
    struct Part {
        double blend;
        bool carved;
        Distance distance;
    };
    std::vector<Part> parts_;
};

}  // namespace crt::meshgen
