/// Chooses how a GPU schedules the vertices of paths, from the features of the scene. Header-only and free
/// of the core. Never changes the image.
#pragma once

#include "kernel/dialect/features.h"

#include <bit>
#include <cstdint>

namespace crt {

/// True if paths of this number of scattering events may take longer than one launch should, as between
/// mirrors without roulette. Nothing can interrupt a launch: only between launches can a render stop.
inline bool mayOutlastLaunch(std::uint32_t max_depth) { return max_depth > 1u << 16; }

/// True if tracing and shading should be separate kernels, with paths sorted by the kind of material at
/// their hit (kernel/schedule/wavefront.h), rather than one kernel that takes each path to its end. Where
/// there are several kinds, or one of many instructions, a warp otherwise runs the code of all of them for a
/// few lanes each (docs/decisions/0042-wavefront.md has the measurements). Paths without end are taken a
/// vertex a launch, too. Views and integrators that splat are not: waves know the path tracer alone.
inline bool wantsWavefront(std::uint64_t features, std::uint32_t max_depth) {
    constexpr std::uint64_t kLong = CRT_FEATURE_ROUGH_CONDUCTOR | CRT_FEATURE_ROUGH_DIELECTRIC |
                                    CRT_FEATURE_PLASTIC | CRT_FEATURE_CLEARCOAT | CRT_FEATURE_FUZZ |
                                    CRT_FEATURE_ROUGH_BASE | CRT_FEATURE_THIN_FILM;
    if ((features & (CRT_FEATURE_VIEW | CRT_FEATURE_SPLAT)) != 0) return false;
    if ((features & kLong) != 0 || mayOutlastLaunch(max_depth)) return true;
    return (features & CRT_FEATURE_BVH) != 0 && std::popcount(features & CRT_FEATURES_MATERIALS) > 1;
}

}  // namespace crt
