#include "scene/scene.h"

#include "base/vec3d.h"

#include <cmath>
#include <numbers>

namespace crt {

const char* wordOf(QuadricType type) {
    switch (type) {
        case QuadricType::Sphere: return "a sphere";
        case QuadricType::Disk: return "a disk";
        case QuadricType::Cylinder: return "a cylinder";
    }
    return "";
}

double areaOf(const Quadric& shape) {
    const double around = 2 * std::numbers::pi * shape.radius;
    // Of a sphere a slice has the area of the cylinder around it (Archimedes).
    return shape.type == QuadricType::Disk ? around * shape.radius / 2
                                           : around * (shape.to_z - shape.from_z);
}

std::optional<double> evenScaleOf(const Matrix4d& m) {
    const Vec3d x{m[0], m[4], m[8]}, y{m[1], m[5], m[9]}, z{m[2], m[6], m[10]};
    const double scale = std::cbrt(std::abs(dot(x, cross(y, z))));
    // A matrix may be written with seven digits.
    constexpr double kRounding = 1e-6;
    const auto near = [&](double value, double wanted) {
        return std::abs(value - wanted * scale * scale) <= kRounding * scale * scale;
    };
    if (!(scale > 0) || !std::isfinite(scale * scale) || !near(dot(x, x), 1) || !near(dot(y, y), 1) ||
        !near(dot(z, z), 1) || !near(dot(x, y), 0) || !near(dot(y, z), 0) || !near(dot(z, x), 0))
        return std::nullopt;
    return length(x);  // exact for powers of two
}

}  // namespace crt
