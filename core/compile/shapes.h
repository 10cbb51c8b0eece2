/// Spheres, disks and cylinders: objects with a shape → records of the blob.
#pragma once

#include "kernel/dialect/layout.h"
#include "scene/scene.h"

#include <array>
#include <cstdint>
#include <vector>

namespace crt {

/// A shape as one of its object's transforms places it, in the author's units.
struct PlacedShape {
    const Object* object;
    std::uint32_t placement;  ///< Number of the placement, as of FlatTriangle.
    Vec3d centre;
    std::array<Vec3d, 3> axes;  ///< Unit; x, y and z of its frame.
    double radius;
    double from_z, to_z;  ///< Along its z; of a whole sphere beyond it.
    Vec3d lower, upper;   ///< Its bounding box.
};

/// In the order of their objects. Throws crt::Error(Scene) where a transform does not keep the form of a
/// shape, or moves it to infinity.
std::vector<PlacedShape> placedShapes(const Scene& scene);

/// A shape of the compiled scene.
struct FlatShape {
    kernel::CrtShape record;
    float clearance;  ///< Distance from it at which a ray must start (shapes.h).
    float margin;     ///< Distance from its rims.
    float lip;        ///< Distance beyond a rim at which it is met, if another surface touches it (rims.h).
    std::array<float, 9> box;  ///< As CrtTriangle has it.
};

/// In the lengths of the compiled scene.
double areaOf(const FlatShape& shape);

/// Moved by −centre, then scaled by 2^scale_exponent.
FlatShape flatShape(const PlacedShape& shape, const Vec3d& centre, int scale_exponent);

}  // namespace crt
