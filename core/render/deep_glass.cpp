#include "render/deep_glass.h"

#include "base/vec3d.h"
#include "compile/placements.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace crt {
namespace {

bool isGlass(const Scene& scene, std::int32_t index) {
    if (index < 0) return false;
    const Material& material = scene.materials[static_cast<std::size_t>(index)];
    if (material.type == MaterialType::Mix)
        return std::any_of(material.parts.begin(), material.parts.end(),
                           [&](std::int32_t part) { return isGlass(scene, part); });
    return material.type == MaterialType::Dielectric || material.type == MaterialType::RoughDielectric;
}

bool isPane(const Scene& scene, std::int32_t index) {
    return index >= 0 &&
           scene.materials[static_cast<std::size_t>(index)].type == MaterialType::ThinDielectric;
}

enum class Seen { Glass, Pane, Opaque };

Seen seenOf(const Scene& scene, std::int32_t material) {
    return isGlass(scene, material) ? Seen::Glass : isPane(scene, material) ? Seen::Pane : Seen::Opaque;
}

/// Triangles and shapes wherever they are placed, of glass or of all.
std::size_t countOf(const Scene& scene, bool glass) {
    std::size_t count = 0;
    for (const Object& object : scene.objects) {
        const Mesh& mesh = scene.meshes[object.mesh];
        const auto wanted = [&](std::int32_t m) { return !glass || seenOf(scene, m) == Seen::Glass; };
        std::size_t own = 0;
        if (object.shape || mesh.material.empty())
            own = wanted(object.material) ? std::max<std::size_t>(mesh.triangles.size(), 1) : 0;
        else
            own = static_cast<std::size_t>(
                std::count_if(mesh.material.begin(), mesh.material.end(), wanted));
        count += own * object.transforms.size();
    }
    return count;
}

/// A ray of unit direction, and the distances at which it meets glass and the nearest opaque surface.
struct Sight {
    Vec3d from, along;
    std::vector<double> glass{};
    double wall = std::numeric_limits<double>::infinity();

    void meet(Seen seen, double t) {
        if (seen == Seen::Glass) glass.push_back(t);
        else if (seen == Seen::Opaque) wall = std::min(wall, t);
    }
    int surfaces() const {
        return static_cast<int>(
            std::count_if(glass.begin(), glass.end(), [this](double t) { return t < wall; }));
    }
};

/// By Möller and Trumbore (1997).
void meetRay(Sight& ray, Seen seen, const std::array<Vec3d, 3>& corners) {
    const Vec3d second = corners[1] - corners[0], third = corners[2] - corners[0];
    const Vec3d p = cross(ray.along, third), s = ray.from - corners[0], q = cross(s, second);
    const double det = dot(second, p);
    const double u = dot(s, p) / det, v = dot(ray.along, q) / det, t = dot(third, q) / det;
    // The edge between two triangles belongs to one of them, in nearly all cases.
    if (u >= 0 && v >= 0 && u + v < 1 && t > 0) ray.meet(seen, t);
}

void meetSphere(std::vector<Sight>& sights, Seen seen, const Vec3d& centre, double radius) {
    for (Sight& ray : sights) {
        const Vec3d to = centre - ray.from;
        const double middle = dot(to, ray.along);
        const double half = radius * radius - (dot(to, to) - middle * middle);
        for (const double t : {middle - std::sqrt(half), middle + std::sqrt(half)})
            if (half > 0 && t > 0) ray.meet(seen, t);
    }
}

/// The rays through the middles of side × side parts of the view, in rows.
class View {
public:
    View(const Camera& camera, int side)
        : side_(side),
          from_(camera.position),
          ahead_(unit(camera.target - camera.position)),
          right_(unit(cross(ahead_, camera.up))),
          above_(cross(right_, ahead_)),
          width_(camera.tan_half_width),
          height_(camera.tan_half_height) {
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x)
                sights.push_back({from_, unit(ahead_ + right_ * (width_ * ((2 * x + 1.0) / side - 1)) +
                                              above_ * (height_ * ((2 * y + 1.0) / side - 1)))});
    }

    void meetTriangle(Seen seen, const std::array<Vec3d, 3>& corners) {
        const Parts parts = partsOf(corners);
        for (int y = parts.first[1]; y <= parts.last[1]; ++y)
            for (int x = parts.first[0]; x <= parts.last[0]; ++x)
                meetRay(sights[static_cast<std::size_t>(y * side_ + x)], seen, corners);
    }

    std::vector<Sight> sights;

private:
    struct Parts {
        std::array<int, 2> first, last;
    };

    static Vec3d unit(const Vec3d& v) { return v * (1 / length(v)); }

    /// The parts whose rays may meet a triangle: all if the camera's plane cuts it, or if it is seen so
    /// nearly from the side that rounding decides which rays meet it.
    Parts partsOf(const std::array<Vec3d, 3>& corners) const {
        constexpr double kLeastSine = 1e-9, kRounding = 0.01;  // The latter in parts.
        const Parts all{{0, 0}, {side_ - 1, side_ - 1}};
        std::array<std::array<double, 2>, 3> at{};
        int ahead = 0, behind = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3d to = corners[k] - from_;
            const double depth = dot(to, ahead_), least = 1e-6 * length(to);
            ahead += depth > least;
            behind += depth < -least;
            at[k] = {dot(to, right_) / (depth * width_), dot(to, above_) / (depth * height_)};
        }
        if (behind == 3) return {{0, 0}, {-1, -1}};
        if (ahead < 3) return all;
        const double ax = at[1][0] - at[0][0], ay = at[1][1] - at[0][1], bx = at[2][0] - at[0][0],
                     by = at[2][1] - at[0][1];
        const double area = ax * by - ay * bx;
        if (!(area * area > kLeastSine * kLeastSine * (ax * ax + ay * ay) * (bx * bx + by * by))) return all;
        Parts parts{};
        for (std::size_t k = 0; k < 2; ++k) {
            // Ray x is at (2 x + 1) / side - 1.
            const auto [least, most] = std::minmax({at[0][k], at[1][k], at[2][k]});
            const auto part = [&](double place) { return ((place + 1) * side_ - 1) / 2; };
            parts.first[k] = static_cast<int>(std::ceil(std::max(part(least) - kRounding, 0.0)));
            parts.last[k] = static_cast<int>(std::floor(std::min(part(most) + kRounding, side_ - 1.0)));
        }
        return parts;
    }

    int side_;
    Vec3d from_, ahead_, right_, above_;
    double width_, height_;
};

void meetScene(View& view, const Scene& scene) {
    for (const Object& object : scene.objects) {
        const Mesh& mesh = scene.meshes[object.mesh];
        for (const Matrix4d& transform : object.transforms) {
            if (object.shape) {
                if (object.shape->type == QuadricType::Sphere)
                    meetSphere(view.sights, seenOf(scene, object.material),
                               transformPoint(transform, {0, 0, 0}),
                               object.shape->radius * evenScaleOf(transform).value_or(0));
                continue;
            }
            for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
                std::array<Vec3d, 3> corners;
                for (std::size_t k = 0; k < 3; ++k)
                    corners[k] = transformPoint(transform, mesh.positions[mesh.triangles[t][k]]);
                view.meetTriangle(seenOf(scene, mesh.material.empty() ? object.material : mesh.material[t]),
                                  corners);
            }
        }
    }
}

}  // namespace

std::optional<DeepGlass> deepGlass(const Scene& scene) {
    constexpr double kMostTests = 6.4e7, kLeastShare = 0.01;
    constexpr int kMostSide = 16, kLeastSide = 4;
    const int depth = scene.integrator.max_depth;
    if (!measuresLight(scene.integrator.type) || depth == 0 || countOf(scene, true) == 0)
        return std::nullopt;
    const double fitting = std::sqrt(kMostTests / static_cast<double>(countOf(scene, false)));
    if (fitting < kLeastSide) return std::nullopt;
    View view(scene.camera, static_cast<int>(std::min<double>(fitting, kMostSide)));
    meetScene(view, scene);
    DeepGlass found;
    double deep = 0;
    for (const Sight& sight : view.sights) {
        const int surfaces = sight.surfaces();
        if (surfaces + surfaces / 4 + 1 <= depth) continue;
        ++deep;
        found.surfaces = std::max(found.surfaces, surfaces);
    }
    found.share = deep / static_cast<double>(view.sights.size());
    return found.share >= kLeastShare ? std::optional(found) : std::nullopt;
}

}  // namespace crt
