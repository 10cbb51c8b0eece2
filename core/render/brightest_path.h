/// Luminance of the brightest paths of a scene, which an image may not have sampled yet.
#pragma once

#include "compile/compile.h"
#include "film/path_facts.h"

namespace crt {

/// Evaluates about two thousand surface points with the kernels' functions, each from the mirror direction
/// of a light. Shadow rays exclude occluded lights while a budget of tests lasts; instances occlude nothing.
/// The result does not depend on the acceleration structure.
BrightestPath brightestPathOf(const CompiledScene& scene);

}  // namespace crt
