/// The identity of a film: the scene as the samples see it, its settings, and the version of the bits. Data
/// that only speed up the search for hits are left out, so that existing films can be continued with another
/// accelerator, a better tree or a smaller kernel.
#pragma once

#include "kernel/dialect/layout.h"

#include <array>
#include <string>
#include <vector>

namespace crt {

/// 32 hex digits: XXH3-128 of the header's settings, of the triangles by id, of all arrays but those that
/// accelerate, and of CRT_BITS_VERSION. `positions` are those of the triangles, by id (FlatScene); `blob`
/// begins with the header.
std::string sceneIdentity(const unsigned char* blob, const std::vector<std::array<float, 9>>& positions);

}  // namespace crt
