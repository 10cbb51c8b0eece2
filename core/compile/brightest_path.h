/// Luminance of the brightest paths of a scene, which an image may not have sampled yet.
#pragma once

#include "compile/compile.h"

#include <limits>

namespace crt {

struct BrightestPath {
    /// Approximate luminance Y that one path can add to the film. Infinite if it is not known.
    double luminance = std::numeric_limits<double>::infinity();
    /// True if only paths of a narrow range of directions are as bright, because surfaces mirror a small
    /// light or scatter it into a narrow lobe. An image with few samples may contain none of them.
    bool rare = false;

    bool operator==(const BrightestPath&) const = default;
};

/// Evaluates about two thousand surface points with the kernels' functions, each from the mirror direction
/// of a light. Shadow rays exclude occluded lights while a budget of tests lasts; instances occlude nothing.
/// The result does not depend on the acceleration structure.
BrightestPath brightestPathOf(const CompiledScene& scene);

}  // namespace crt
