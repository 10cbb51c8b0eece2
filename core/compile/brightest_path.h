/// How bright the brightest paths of a scene are: what its images may not have met yet.
#pragma once

#include "compile/compile.h"

#include <limits>

namespace crt {

struct BrightestPath {
    /// Luminance Y that one path may bring, as the film has it, about; infinite where it is not known.
    double luminance = std::numeric_limits<double>::infinity();
    /// True if only paths that happen to take a certain direction are as bright: surfaces mirror a small
    /// light, or scatter it into a narrow lobe. Images with few samples show no trace of such paths.
    bool rare = false;

    bool operator==(const BrightestPath&) const = default;
};

/// Looks at a few thousand places of the scene's surfaces, from where they mirror a light, with the kernels'
/// own code. Light that other surfaces hide counts as far as the time for shadow rays lasts; instances hide
/// none. Does not depend on the order that an acceleration structure gave to surfaces.
BrightestPath brightestPathOf(const CompiledScene& scene);

}  // namespace crt
