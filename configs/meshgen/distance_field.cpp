#include "distance_field.h"

#include <algorithm>
#include <cmath>

namespace crt::meshgen {

double smoothMin(double a, double b, double k) {
    const double h = std::max(k - std::abs(a - b), 0.0) / k;
    return std::min(a, b) - 0.25 * h * h * k;
}

double roundCone(Vec p, Vec a, Vec b, double ra, double rb) {
    const Vec ba = b - a, pa = p - a;
    const double l2 = dot(ba, ba), rr = ra - rb, a2 = l2 - rr * rr, il2 = 1.0 / l2;
    const double y = dot(pa, ba), z = y - l2;
    const Vec side = l2 * pa - y * ba;
    const double x2 = dot(side, side), y2 = y * y * l2, z2 = z * z * l2;
    const double k = (rr > 0 ? 1.0 : rr < 0 ? -1.0 : 0.0) * rr * rr * x2;
    if ((z > 0 ? 1.0 : -1.0) * a2 * z2 > k) return std::sqrt(x2 + z2) * il2 - rb;
    if ((y > 0 ? 1.0 : -1.0) * a2 * y2 < k) return std::sqrt(x2 + y2) * il2 - ra;
    return (std::sqrt(x2 * a2 * il2) + y * rr) * il2 - ra;
}

double ellipsoid(Vec p, Vec centre, Vec radii) {
    const Vec q = p - centre;
    const Vec s{q.x / radii.x, q.y / radii.y, q.z / radii.z};
    const Vec g{s.x / radii.x, s.y / radii.y, s.z / radii.z};
    const double k0 = length(s), k1 = length(g);
    return k1 > 0.0 ? k0 * (k0 - 1.0) / k1 : -std::min({radii.x, radii.y, radii.z});
}

double roundBox(Vec p, Vec centre, Vec half, double r) {
    const Vec q{std::abs(p.x - centre.x) - half.x + r, std::abs(p.y - centre.y) - half.y + r,
                std::abs(p.z - centre.z) - half.z + r};
    const Vec outside{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
    return length(outside) + std::min(std::max({q.x, q.y, q.z}), 0.0) - r;
}

double membrane(Vec p, Vec a, Vec b, Vec c, double r) {
    const Vec ba = b - a, cb = c - b, ac = a - c, pa = p - a, pb = p - b, pc = p - c;
    const Vec n = cross(ba, ac);
    const auto toEdge = [](Vec e, Vec q) {
        const Vec d = std::clamp(dot(e, q) / dot(e, e), 0.0, 1.0) * e - q;
        return dot(d, d);
    };
    const bool beside =
        dot(cross(ba, n), pa) < 0.0 || dot(cross(cb, n), pb) < 0.0 || dot(cross(ac, n), pc) < 0.0;
    const double d2 = beside ? std::min({toEdge(ba, pa), toEdge(cb, pb), toEdge(ac, pc)})
                             : dot(n, pa) * dot(n, pa) / dot(n, n);
    return std::sqrt(d2) - r;
}

}  // namespace crt::meshgen
