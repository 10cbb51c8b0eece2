/// Warns of geometry that single precision cannot tell apart: surfaces nearer to each other than a ray's
/// start is known.
#pragma once

#include "compile/bvh_build.h"
#include "compile/compile.h"
#include "kernel/dialect/context.h"
#include "kernel/dialect/layout.h"
#include "kernel/geometry/hit.h"
#include "kernel/geometry/ray.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace crt {

struct NearSurfaces {
    std::uint64_t asked = 0;  ///< Triangles that were looked at: all, or an even choice of them.
    std::uint64_t near = 0;   ///< Of those: with another surface nearer than the clearance of either
                              ///< (kernel/geometry/surface.h), yet not touching.
    double nearest_clearance =
        0;  ///< The largest clearance that was too large for its neighbour, in the author's units.
};

/// Ids of the triangles that findNearSurfaces asks about, in its order.
std::vector<std::uint32_t> askedTriangles(std::uint64_t triangles);
/// Ids of the triangles of emitters that findCoplanarLight asks about: all, or an even choice of them.
std::vector<std::uint32_t> askedEmitters(const CompiledScene& scene);

/// Of this number of faces; 0 if there are none.
float largestClearance(const kernel::CrtFace* faces, std::size_t count);

/// The distance from a triangle within which all surfaces lie that are near to it: rays go as far as the
/// largest clearance, and begin some epsilon off.
inline float reachOf(float largest_clearance) { return 2 * largest_clearance + 64 * CRT_EPSILON; }
/// The middle of a triangle, and `reach` to all sides.
TriangleBounds aroundMiddle(const kernel::CrtTriangle& triangle, float reach);

/// A ray by which findNearSurfaces looks for neighbours of a triangle.
struct NormalRay {
    kernel::CrtRay ray;
    float touching;  ///< The ray begins at this distance from the triangle, beyond what touches it.
};
/// To both sides, as far as `reach`; nothing for a triangle without area.
std::optional<std::array<NormalRay, 2>> normalRays(const kernel::CrtContext& context, std::uint32_t slot,
                                                   float reach);
/// The clearance that is too large for the distance of the triangle to what its ray hits, if it is.
std::optional<float> clearanceBeyond(const kernel::CrtContext& context, std::uint32_t slot,
                                     const NormalRay& from, const kernel::CrtHit& hit);

/// A lamp in the plane of another surface, which it overlaps: rays meet both at one distance but for
/// rounding, and see now one, now the other.
struct CoplanarLight {
    std::uint32_t light = 0, surface = 0;  ///< Primitive ids of one such pair.
    double least_gap = 0;  ///< So far apart, in the author's units, they would be told apart.
};

/// One such pair; nothing where there is none. Of very many emitters, or of many on one spot, an even choice
/// is looked at: the time is bounded, whatever the scene.
std::optional<CoplanarLight> findCoplanarLight(const CompiledScene& scene);

/// From the middle of each triangle along its normal, to both sides. Surfaces within a few ulp of each other
/// touch, as a box does that stands on a floor; that is what an author means, and is safe. The time is
/// bounded as above; `asked` says how many it was enough for.
NearSurfaces findNearSurfaces(const CompiledScene& scene);

/// Emitters whose size is rounded by more than a thousandth, because they are small and far from the centre
/// of the scene.
struct CoarseLights {
    std::uint64_t lights = 0, asked = 0;  ///< Triangles and shapes.
    double rounding = 0;                  ///< The largest, over the light's height or radius.
};
CoarseLights findCoarseLights(const CompiledScene& scene);

}  // namespace crt
