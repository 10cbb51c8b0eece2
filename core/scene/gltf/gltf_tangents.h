/// Tangents of a glTF file beside those that texture coordinates make.
#pragma once

#include "scene/scene.h"

#include <array>
#include <vector>

namespace crt {

/// True if more than 1 % of the corners of the mesh have a tangent, of those of its vertices, that differs
/// from what its texture coordinates say: by more than 15 degrees, or in the side to which the other one
/// turns.
bool hasOtherTangents(const Mesh& mesh, const std::vector<std::array<double, 4>>& tangents);

}  // namespace crt
