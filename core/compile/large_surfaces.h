/// Finds surfaces whose size makes single precision falsify the light of a lamp near them.
#pragma once

#include "base/vec3d.h"
#include "compile/compile.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace crt {

/// Rays leave a surface at its clearance (kernel/geometry/surface.h), which grows with the surface. A light
/// at a distance h is then too bright or too dark by some 2 · clearance / h; a light that is larger than h,
/// by some 2 · clearance / its radius.
struct LargeSurface {
    std::uint32_t surface = 0;         ///< Primitive id; of an instance that of its mesh.
    double clearance = 0, height = 0;  ///< And h, in the author's units.
    double error = 0;
};

/// The surface with the largest error above a thousandth; nothing where there is none. `lights`: the
/// positions of point lights, in the author's units. Asked are an even choice of 4,096 of these and of the
/// objects that emit, and the 64 surfaces with the largest clearance, among them the eight largest triangles
/// of each mesh that is instanced.
std::optional<LargeSurface> findLargeSurface(const CompiledScene& scene, const std::vector<Vec3d>& lights);

}  // namespace crt
