#include "compile/shapes.h"

#include "base/error.h"
#include "base/vec3d.h"
#include "kernel/geometry/shapes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace crt {
namespace {

/// Bounds of an arc's, a circle's or a point's sweep around the axis: of one coordinate, whose unit vector
/// has the component `along` on the axis.
struct Reach {
    double lower, upper;
};

Reach reachOf(const Quadric& shape, double from_z, double to_z, double radius, double along) {
    const double across = std::sqrt(std::max(0.0, 1 - along * along));
    // Extent of the surface in this direction, with the axis pointing `cosine` along it.
    const auto farthest = [&](double cosine) {
        if (shape.type == QuadricType::Disk) return radius * across;
        if (shape.type == QuadricType::Cylinder)
            return std::max(from_z * cosine, to_z * cosine) + radius * across;
        const double z = std::clamp(radius * cosine, std::max(from_z, -radius), std::min(to_z, radius));
        return z * cosine + std::sqrt(std::max(0.0, radius * radius - z * z)) * across;
    };
    return {-farthest(-along), farthest(along)};
}

PlacedShape placed(const Object& object, const Matrix4d& m, std::uint32_t placement) {
    const Quadric& shape = *object.shape;
    const std::optional<double> scale = evenScaleOf(m);
    if (!scale)
        throw Error(ErrorKind::Scene, std::string(wordOf(shape.type)) + " " + kShapesStayShapes,
                    object.place);
    PlacedShape p{};
    p.object = &object;
    p.placement = placement;
    p.centre = {m[3], m[7], m[11]};
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d column{m[k], m[4 + k], m[8 + k]};
        p.axes[k] = column * (1 / length(column));
    }
    p.radius = shape.radius * *scale;
    p.from_z = shape.from_z * *scale;
    p.to_z = shape.to_z * *scale;
    for (std::size_t k = 0; k < 3; ++k) {
        const Reach reach = reachOf(shape, p.from_z, p.to_z, p.radius, p.axes[2][k]);
        p.lower[k] = p.centre[k] + reach.lower;
        p.upper[k] = p.centre[k] + reach.upper;
        if (!std::isfinite(p.lower[k]) || !std::isfinite(p.upper[k]) || !std::isfinite(p.centre[k]))
            throw Error(ErrorKind::Scene, "a transform moves a shape beyond the range of single precision",
                                          object.place);
    }
    return p;
}

}  // namespace

std::vector<PlacedShape> placedShapes(const Scene& scene) {
    std::vector<PlacedShape> shapes;
    std::uint32_t placement = 0;
    for (const Object& object : scene.objects)
        for (const Matrix4d& transform : object.transforms) {
            if (object.shape) shapes.push_back(placed(object, transform, placement));
            ++placement;
        }
    return shapes;
}

double areaOf(const FlatShape& shape) {
    const auto radius = static_cast<double>(shape.record.radius);
    auto from = static_cast<double>(shape.record.from_z), to = static_cast<double>(shape.record.to_z);
    if (shape.record.kind == CRT_SHAPE_DISK) return std::numbers::pi * radius * radius;
    if (shape.record.kind == CRT_SHAPE_SPHERE) {
        from = std::max(from, -radius);
        to = std::min(to, radius);
    }
    return 2 * std::numbers::pi * radius * (to - from);
}

FlatShape flatShape(const PlacedShape& shape, const Vec3d& centre, int scale_exponent) {
    const double scale = std::ldexp(1.0, scale_exponent);
    FlatShape flat{};
    kernel::CrtShape& record = flat.record;
    double coordinate = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        record.centre[k] = static_cast<float>((shape.centre[k] - centre[k]) * scale);
        record.x[k] = static_cast<float>(shape.axes[0][k]);
        record.y[k] = static_cast<float>(shape.axes[1][k]);
        record.z[k] = static_cast<float>(shape.axes[2][k]);
        for (const double end : {shape.lower[k], shape.upper[k], shape.centre[k]})
            coordinate = std::max(coordinate, std::abs(end - centre[k]) * scale);
    }
    const Quadric& own = *shape.object->shape;
    const bool sphere = own.type == QuadricType::Sphere, cylinder = own.type == QuadricType::Cylinder;
    const double radius = shape.radius * scale;
    double from_z = shape.from_z * scale, to_z = shape.to_z * scale;
    const double height = cylinder ? std::max(std::abs(from_z), std::abs(to_z)) : 0;
    flat.clearance =
        kernel::crt_shape_clearance(static_cast<float>(coordinate), static_cast<float>(radius + height));
    // Where paths start is drawn in from an edge by a clearance, or, of what is small, an eighth of it.
    const double extent = own.type == QuadricType::Disk
                              ? radius
                              : std::min(to_z, radius + height) - std::max(from_z, -radius - height);
    // Surfaces that end in one circle shall overlap by rounding rather than leave a gap; but by less than
    // the clearance of the neighbour, whose rays would meet the lip.
    const float rounding =
        kernel::crt_shape_clearance(static_cast<float>(coordinate), static_cast<float>(radius + height / 4));
    flat.lip = static_cast<float>(std::min(static_cast<double>(rounding) / 2, extent / 8));
    flat.margin = static_cast<float>(std::min(static_cast<double>(flat.clearance), extent / 8));
    if (sphere && own.from_z <= -own.radius) from_z = -2 * radius;
    if (sphere && own.to_z >= own.radius) to_z = 2 * radius;
    record.kind = sphere ? CRT_SHAPE_SPHERE : cylinder ? CRT_SHAPE_CYLINDER : CRT_SHAPE_DISK;
    record.radius = static_cast<float>(radius);
    record.from_z = static_cast<float>(from_z);
    record.to_z = static_cast<float>(to_z);
    record.met_from = record.from_z;
    record.met_to = own.type == QuadricType::Disk ? record.radius : record.to_z;
    record.facing = own.inward ? -1.0f : 1.0f;
    for (std::size_t k = 0; k < 3; ++k) {
        const float lower = static_cast<float>((shape.lower[k] - centre[k]) * scale) - 2 * flat.clearance;
        const float upper = static_cast<float>((shape.upper[k] - centre[k]) * scale) + 2 * flat.clearance;
        flat.box[3 * k] = flat.box[3 * k + 2] = lower;
        flat.box[3 * k + 1] = upper;
    }
    return flat;
}

}  // namespace crt
