#include "compile/focus.h"

#include "base/parallel.h"
#include "compile/box.h"
#include "compile/instances.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <utility>

namespace crt {
namespace {

constexpr double kNowhere = std::numeric_limits<double>::infinity();
constexpr double kMostLost = 256;  ///< The half extent over the size of details that the middle will do for.
constexpr int kSnap = 20;          ///< Bits of the way to the point that the camera looks at.
constexpr std::size_t kSeenAtATime = std::size_t{1} << 14;

/// Radius of the smallest ball around `centre` that contains a whole object: all triangles of one placement.
double wholeObject(const std::vector<Placement>& placements, const Vec3d& centre) {
    std::vector<double> reach(placements.size(), kNowhere);
    parallelFor(placements.size(), 1, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) {
            double squared = 0;
            for (const Vec3d& p : placements[i].mesh->positions) {
                const Vec3d way = transformPoint(placements[i].transform, p) - centre;
                squared = std::max(squared, dot(way, way));
            }
            if (!placements[i].mesh->triangles.empty()) reach[i] = std::sqrt(squared);
        }
    });
    return reach.empty() ? kNowhere : *std::min_element(reach.begin(), reach.end());
}

/// Bounding boxes of shapes and of instances.
std::vector<Box> boxesOf(const Scene& scene, const std::vector<PlacedShape>& shapes) {
    std::vector<Box> boxes;
    for (const PlacedShape& shape : shapes) boxes.push_back({shape.lower, shape.upper});
    for (const Object& object : scene.objects) {
        if (!sharesMesh(scene, object)) continue;
        Box mesh;
        for (const Vec3d& p : scene.meshes[object.mesh].positions) mesh.add(p);
        for (const Matrix4d& transform : object.transforms) {
            if (!canInstance(transform)) continue;
            Box placed;
            for (std::size_t i = 0; i < 8; ++i) placed.add(transformPoint(transform, mesh.corner(i)));
            boxes.push_back(placed);
        }
    }
    return boxes;
}

/// Distance from the origin to the triangle along the unit vector `way`; kNowhere where the ray misses it
/// (Möller and Trumbore 1997).
double distanceOf(const std::array<Vec3d, 3>& p, const Vec3d& way) {
    const Vec3d a = p[1] - p[0], b = p[2] - p[0], across = cross(way, b);
    const double determinant = dot(a, across);
    const Vec3d o = p[0] * -1, turned = cross(o, a);
    const double u = dot(o, across) / determinant, v = dot(way, turned) / determinant,
                 t = dot(b, turned) / determinant;
    return u >= 0 && v >= 0 && u + v <= 1 && t > 0 ? t : kNowhere;  // NaN: none
}

double distanceOf(const Box& box, const Vec3d& way) {
    double enter = 0, leave = kNowhere;
    for (std::size_t k = 0; k < 3; ++k) {
        const double a = box.lower[k] / way[k], b = box.upper[k] / way[k];
        if (way[k] == 0 ? box.lower[k] > 0 || box.upper[k] < 0 : false) return kNowhere;
        if (way[k] == 0) continue;
        enter = std::max(enter, std::min(a, b));
        leave = std::min(leave, std::max(a, b));
    }
    return enter > 0 && enter <= leave ? enter : kNowhere;
}

/// Radius of the smallest ball around `centre` that contains the triangle or box.
double ballAround(const std::array<Vec3d, 3>& p, const Vec3d& centre) {
    const Vec3d n = cross(p[1] - p[0], p[2] - p[0]);
    if (!(dot(n, n) > 0)) return kNowhere;  // no area, so it is invisible
    double squared = 0;
    for (const Vec3d& corner : p) squared = std::max(squared, dot(corner - centre, corner - centre));
    return std::sqrt(squared);
}
double ballAround(const Box& box, const Vec3d& centre) {
    double reach = 0;
    for (std::size_t i = 0; i < 8; ++i) reach = std::max(reach, length(box.corner(i) - centre));
    return reach;
}

/// Properties of a set of triangles and boxes, relative to the camera, in units of 1 / scale.
struct Seen {
    Box box;
    double ahead = kNowhere;   ///< Distance to what the middle of the view shows.
    double detail = kNowhere;  ///< As in Focus, around a given place.

    void add(const Seen& other) {
        box.add(other.box);
        ahead = std::min(ahead, other.ahead);
        detail = std::min(detail, other.detail);
    }
};

class Sight {
public:
    Sight(const Scene& scene, const std::vector<Placement>& placements,
          const std::vector<PlacedShape>& shapes)
        : placements_(placements), boxes_(boxesOf(scene, shapes)), eye_(scene.camera.position) {
        const Vec3d to = scene.camera.target - eye_;
        const double most = std::max({std::abs(to[0]), std::abs(to[1]), std::abs(to[2])});
        way_ = to * (1 / most);
        way_ = way_ * (1 / length(way_));
    }

    std::optional<Focus> focus() {
        const Box box = ofAll([](Seen& seen, const auto& thing) { addTo(seen.box, thing); }).box;
        double half_extent = 0, farthest = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            half_extent = std::max(half_extent, (box.upper[k] - box.lower[k]) / 2);
            farthest = std::max({farthest, std::abs(box.lower[k]), std::abs(box.upper[k])});
        }
        if (!(half_extent > 0) || !std::isfinite(farthest)) return std::nullopt;
        int exponent = 0;
        std::frexp(half_extent, &exponent);  // squares of lengths neither overflow nor vanish
        half_extent = std::ldexp(half_extent, -exponent);
        scale_ = std::ldexp(1.0, -exponent);

        const Seen here = ofAll([this](Seen& seen, const auto& thing) {
            seen.ahead = std::min(seen.ahead, distanceOf(thing, way_));
            seen.detail = std::min(seen.detail, ballAround(thing, {}));
        });
        Vec3d centre{};
        double detail = here.detail;
        if (here.ahead < kNowhere) {
            const Vec3d looked_at = snapped(way_ * here.ahead, here.ahead);
            const Seen there = ofAll([&](Seen& seen, const auto& thing) {
                seen.detail = std::min(seen.detail, ballAround(thing, looked_at));
            });
            if (there.detail < detail) {
                centre = looked_at;
                detail = there.detail;
            }
        }
        if (!(detail * kMostLost < half_extent)) return std::nullopt;
        const double unit = std::ldexp(1.0, exponent);
        const Vec3d focus = eye_ + centre * unit;
        double object = wholeObject(placements_, focus) / unit;
        for (const Box& thing : boxes_)
            object = std::min(object, ballAround(fromEye(thing), centre));
        // Fine triangles alone are no reason: the objects that they form lose nothing visible.
        if (!(object * kMostLost < half_extent)) return std::nullopt;
        return Focus{focus, detail * unit};
    }

private:
    static void addTo(Box& box, const std::array<Vec3d, 3>& p) {
        for (const Vec3d& corner : p) box.add(corner);
    }
    static void addTo(Box& box, const Box& thing) { box.add(thing); }

    /// Rounds so that the sum with any camera position is exact.
    static Vec3d snapped(const Vec3d& v, double size) {
        const double step = std::ldexp(1.0, std::ilogb(size) - kSnap);
        return {std::rint(v[0] / step) * step, std::rint(v[1] / step) * step, std::rint(v[2] / step) * step};
    }

    Box fromEye(const Box& box) const { return {fromEye(box.lower), fromEye(box.upper)}; }
    Vec3d fromEye(const Vec3d& p) const { return (p - eye_) * scale_; }

    /// look(seen, thing) of all triangles and boxes.
    template <class Look>
    Seen ofAll(const Look& look) const {
        const std::size_t triangles =
            placements_.empty() ? 0 : placements_.back().first + placements_.back().mesh->triangles.size();
        std::vector<Seen> parts(partsOf(triangles, kSeenAtATime));
        parallelFor(triangles, kSeenAtATime, [&](std::size_t first, std::size_t end) {
            Seen& part = parts[first / kSeenAtATime];
            forEachTriangle(placements_, first, end,
                            [&](std::size_t, const Placement& placement, std::size_t triangle) {
                                std::array<Vec3d, 3> p = placement.corners(triangle);
                                for (Vec3d& corner : p) corner = fromEye(corner);
                                look(part, p);
                            });
        });
        Seen all;
        for (const Seen& part : parts) all.add(part);
        for (const Box& box : boxes_) look(all, fromEye(box));
        return all;
    }

    const std::vector<Placement>& placements_;
    const std::vector<Box> boxes_;
    const Vec3d eye_;
    Vec3d way_{};
    double scale_ = 1;  ///< A power of two.
};

}  // namespace

std::optional<Focus> focusOf(const Scene& scene, const std::vector<Placement>& placements,
                             const std::vector<PlacedShape>& shapes) {
    return Sight(scene, placements, shapes).focus();
}

}  // namespace crt
