#include "compile/rims.h"

#include "compile/box.h"
#include "compile/coplanar.h"
#include "compile/geometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <span>
#include <vector>

namespace crt {
namespace {

constexpr std::size_t kPoints = 16;  ///< Of a rim that are asked whether they lie on another surface.

/// In the lengths of the compiled scene, before they are rounded: how exactly two rims meet is not lost.
struct Rim {
    std::uint32_t shape;
    bool upper;  ///< At to_z, or a disk's.
    Box box;
    std::array<Vec3d, kPoints> points;
};

class Rims {
public:
    Rims(FlatScene& flat, const std::vector<PlacedShape>& shapes)
        : flat_(flat), shapes_(shapes), scale_(std::ldexp(1.0, flat.scale_exponent)) {
        for (std::uint32_t i = 0; i < shapes.size(); ++i) {
            const PlacedShape& shape = shapes[i];
            const QuadricType type = shape.object->shape->type;
            const bool sphere = type == QuadricType::Sphere;
            if (type != QuadricType::Disk && !(sphere && shape.from_z <= -shape.radius))
                add(i, shape.from_z, false);
            if (!(sphere && shape.to_z >= shape.radius)) add(i, shape.to_z, true);
        }
    }

    void close() {
        if (rims_.empty()) return;
        std::vector<std::uint32_t> all(flat_.positions.size());
        std::iota(all.begin(), all.end(), 0u);
        tests_ = kLeastTests + kTestsEach * (all.size() + rims_.size());
        close(rims_, all);
    }

private:
    /// If thousands of rims and surfaces lie at one place, each could touch each. After this number of
    /// tests, the remaining rims are assumed to be touched.
    static constexpr std::uint64_t kLeastTests = 1000000, kTestsEach = 64;

    void add(std::uint32_t index, double z, bool upper) {
        const PlacedShape& shape = shapes_[index];
        const double radius = shape.object->shape->type == QuadricType::Sphere
                                  ? std::sqrt(std::max(0.0, shape.radius * shape.radius - z * z))
                                  : shape.radius;
        Rim rim{.shape = index, .upper = upper, .box = {}, .points = {}};
        for (std::size_t i = 0; i < kPoints; ++i) {
            const double angle = 2 * std::numbers::pi * (static_cast<double>(i) + 0.5) / kPoints;
            const Vec3d p = shape.centre + shape.axes[0] * (radius * std::cos(angle)) +
                            shape.axes[1] * (radius * std::sin(angle)) + shape.axes[2] * z;
            rim.points[i] = (p - flat_.centre) * scale_;
            rim.box.add(rim.points[i], clearanceOf(index));
        }
        rims_.push_back(rim);
    }

    double clearanceOf(std::size_t shape) const {
        return static_cast<double>(flat_.shapes[shape].clearance);
    }

    /// The bounding box of a surface. The vertices of a shape or an instance span its padded box.
    Box boxOf(std::uint32_t id) const {
        Box box;
        for (std::size_t v = 0; v < 3; ++v) box.add(vertexOf(flat_, id, v));
        return box;
    }

    /// Halves the rims as long as there are many, and takes along what is near them.
    void close(std::span<Rim> rims, const std::vector<std::uint32_t>& surfaces) {
        Box bounds;
        for (const Rim& rim : rims) bounds.add(rim.box);
        std::vector<std::uint32_t> near;
        for (const std::uint32_t id : surfaces)
            if (boxOf(id).meets(bounds)) near.push_back(id);
        tests_ -= std::min<std::uint64_t>(tests_, surfaces.size());
        if (near.empty()) return;
        if (tests_ == 0 || rims.size() == 1) {
            for (const Rim& rim : rims)
                if (tests_ == 0 || std::any_of(near.begin(), near.end(),
                                               [&](std::uint32_t id) { return touches(rim, id); }))
                    setLip(rim);
            return;
        }
        std::size_t axis = 0;
        for (std::size_t k = 1; k < 3; ++k)
            if (bounds.upper[k] - bounds.lower[k] > bounds.upper[axis] - bounds.lower[axis]) axis = k;
        const std::size_t half = rims.size() / 2;
        std::nth_element(
            rims.begin(), rims.begin() + static_cast<std::ptrdiff_t>(half), rims.end(),
            [axis](const Rim& a, const Rim& b) { return a.box.lower[axis] < b.box.lower[axis]; });
        close(rims.first(half), near);
        close(rims.subspan(half), near);
    }

    void setLip(const Rim& rim) {
        FlatShape& shape = flat_.shapes[rim.shape];
        if (rim.upper) shape.record.met_to += shape.lip;
        else shape.record.met_from -= shape.lip;
    }

    /// True if a point of the rim lies on the surface, within the clearances of both.
    bool touches(const Rim& rim, std::uint32_t id) const {
        if (id == flat_.firstShape() + rim.shape) return false;
        if (id >= flat_.firstInstance()) {
            const Box box = boxOf(id);
            return std::any_of(rim.points.begin(), rim.points.end(), [&](const Vec3d& p) {
                Box point;
                point.add(p, clearanceOf(rim.shape));
                return box.meets(point);
            });
        }
        if (id >= flat_.firstShape()) {
            const std::size_t other = id - flat_.firstShape();
            const double room = clearanceOf(rim.shape) + clearanceOf(other);
            return std::any_of(rim.points.begin(), rim.points.end(),
                               [&](const Vec3d& p) { return isOnShape(p, shapes_[other], room); });
        }
        const Corners corners = cornersOf(flat_, id);
        const double room = clearanceOf(rim.shape) + corners.clearance;
        return std::any_of(rim.points.begin(), rim.points.end(),
                           [&](const Vec3d& p) { return isOn(p, corners, room); });
    }

    bool isOnShape(const Vec3d& p, const PlacedShape& shape, double room) const {
        const Vec3d q = p - (shape.centre - flat_.centre) * scale_;
        const double x = dot(q, shape.axes[0]), y = dot(q, shape.axes[1]), z = dot(q, shape.axes[2]);
        const double radius = shape.radius * scale_, across = std::sqrt(x * x + y * y);
        const QuadricType type = shape.object->shape->type;
        if (type == QuadricType::Disk) return std::abs(z) <= room && across <= radius + room;
        const double off = (type == QuadricType::Sphere ? length(q) : across) - radius;
        return std::abs(off) <= room && z >= shape.from_z * scale_ - room && z <= shape.to_z * scale_ + room;
    }

    FlatScene& flat_;
    const std::vector<PlacedShape>& shapes_;
    double scale_;
    std::vector<Rim> rims_;
    std::uint64_t tests_ = 0;
};

}  // namespace

void closeRims(FlatScene& flat, const std::vector<PlacedShape>& shapes) { Rims(flat, shapes).close(); }

}  // namespace crt
