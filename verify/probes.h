/// Questions about single rays that any backend answers through its film alone. A camera's rays are known
/// beforehand, bit by bit, because the kernel is the same everywhere; so geometry can be built onto them,
/// and every pixel of the film counts for one ray.
#pragma once

#include "verify/context.h"
#include "verify/shapes.h"

#include <cstdint>

namespace crt::verify {

/// Rays, and those that went wrong.
struct Tally {
    std::uint64_t rays = 0, failures = 0;
    Tally& operator+=(const Tally& other) {
        rays += other.rays;
        failures += other.failures;
        return *this;
    }
};

/// The targets of rays: a vertex, a point of an edge, or anywhere on a mesh.
enum class Aim { Vertex, Edge, Face };
const char* name(Aim aim);

/// Where a test's geometry lies, in the author's units.
struct Place {
    const char* name;
    Vec3d centre;
    double size;
    /// Half extent of the whole scene, centred at `scene_centre`: the ratio to `size` says how coarse floats
    /// are at `centre`.
    Vec3d scene_centre;
    double scene_half;
};
/// About the origin; far from it, where nothing is round (the place is that of Embree's own tests); and
/// there in a scene as large as that distance.
extern const Place kPlaces[3];

/// Rays from one point to the vertices, edges or faces of a connected mesh that covers the whole film, at
/// most one in a pixel's sample: failures are rays that meet nothing. One film of resolution² rays, or
/// `samples` times as many for faces.
Tally missesOfAimedRays(Context& context, Aim aim, const Place& place, int resolution, std::uint64_t seed,
                        std::uint64_t samples = 1);

/// One random triangle, in a random place of a scene `extent` times as large, and rays that scatter off it
/// by the cosine: failures meet the triangle that they leave. Lengths in the author's units. One film of
/// resolution² rays, of which those count that meet the triangle.
Tally selfHits(Context& context, double size, double extent, int resolution, std::uint64_t seed);

/// Two parallel squares of edge `size`, `gap` apart, in a random place and pose of a scene `extent` times as
/// large; rays pass through the first, whose index is 1. Failures miss the second.
Tally skippedLayers(Context& context, double size, double gap, double extent, int resolution,
                    std::uint64_t seed);

/// Films of one question until `rays` have been asked.
template <class Film>
Tally collect(std::uint64_t rays, Film film) {
    Tally all;
    // A pose in which nothing is seen brings no rays: it must not go on for ever.
    for (std::uint64_t seed = 1; seed < 1000000 && all.rays < rays; ++seed) all += film(seed);
    return all;
}

/// Adds the outcome: at most `bound` of rays fail, by the 99.9 % interval; with too few rays for that to be
/// provable, none at all may fail.
void rareFailures(Context& context, const std::string& what, const Tally& tally, double bound,
                  const std::string& physics);

}  // namespace crt::verify
