/// Warns of geometry that single precision cannot tell apart: surfaces nearer to each other than a ray's start is known.
#pragma once

#include "compile.h"

#include <cstdint>

namespace crt {

struct NearSurfaces {
    std::uint64_t asked = 0;     ///< Triangles that were looked at: all, or an even choice of them.
    std::uint64_t near = 0;      ///< Of those: with another surface nearer than the clearance of either (kernel/surface.h), yet not touching.
    double nearest_clearance = 0;  ///< The largest clearance that was too large for its neighbour, in the author's units.
};

/// From the middle of each triangle along its normal, to both sides. Surfaces within a few ulp of each other touch, as a box does that stands
/// on a floor; that is what an author means, and is safe.
NearSurfaces findNearSurfaces(const CompiledScene& scene);

}  // namespace crt
