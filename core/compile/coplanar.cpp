#include "compile/coplanar.h"

#include "kernel/dialect/layout.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace crt {

Corners cornersOf(const unsigned char* blob, std::uint32_t slot) {
    using namespace kernel;
    const auto& scene = *reinterpret_cast<const CrtScene*>(blob);
    const CrtTriangle& triangle = CRT_ARRAY(CrtTriangle, blob, scene.triangles)[slot];
    const CrtFace& face = CRT_ARRAY(CrtFace, blob, scene.faces)[slot];
    Corners c;
    for (std::size_t v = 0; v < 3; ++v) c.p[v] = {triangle.p[v], triangle.p[3 + v], triangle.p[6 + v]};
    c.normal = {face.normal[0], face.normal[1], face.normal[2]};
    c.clearance = static_cast<double>(face.clearance);
    return c;
}

double largestEdge(const Corners& c) {
    double squared = 0;
    for (std::size_t v = 0; v < 3; ++v) {
        const Vec3d edge = c.p[(v + 1) % 3] - c.p[v];
        squared = std::max(squared, dot(edge, edge));
    }
    return std::sqrt(squared);
}

bool inOnePlane(const Corners& a, const Corners& b) {
    const Corners &large = largestEdge(a) < largestEdge(b) ? b : a, &small = &large == &a ? b : a;
    return std::all_of(small.p.begin(), small.p.end(), [&](const Vec3d& corner) {
        return std::abs(dot(large.normal, corner - large.p[0])) <= std::max(a.clearance, b.clearance);
    });
}

bool isOn(const Vec3d& point, const Corners& c, double room) {
    if (!(dot(c.normal, c.normal) > 0) || std::abs(dot(c.normal, point - c.p[0])) > room) return false;
    for (std::size_t v = 0; v < 3; ++v) {
        const Vec3d edge = c.p[(v + 1) % 3] - c.p[v];
        if (dot(cross(c.normal, edge), point - c.p[v]) < -room * length(edge)) return false;
    }
    return true;
}

bool overlap(const Corners& a, const Corners& b) {
    const auto apart = [](const Corners& of, const Corners& other) {
        for (std::size_t v = 0; v < 3; ++v) {
            const Vec3d edge = of.p[(v + 1) % 3] - of.p[v];
            const Vec3d inwards = cross(of.normal, edge) * (1 / std::sqrt(dot(edge, edge)));
            double farthest = -std::numeric_limits<double>::infinity();
            for (const Vec3d& corner : other.p)
                farthest = std::max(farthest, dot(inwards, corner - of.p[v]));
            if (farthest <= std::max(of.clearance, other.clearance)) return true;
        }
        return false;
    };
    return dot(a.normal, a.normal) > 0 && dot(b.normal, b.normal) > 0 && !apart(a, b) && !apart(b, a);
}

}  // namespace crt
