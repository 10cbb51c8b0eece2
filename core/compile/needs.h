/// The features that a kernel needs for a scene, as bits of kernel/dialect/features.h, and the reasons for
/// those that it can leave out.
#pragma once

#include "compile/materials.h"
#include "compile/textures.h"
#include "kernel/dialect/layout.h"
#include "scene/scene.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace crt {

/// `header` is complete but for its features. `of_lights`: what the lights need.
std::uint64_t featuresOf(const Scene& scene, const kernel::CrtScene& header, const MaterialPart& materials,
                         const TexturePart& textures, std::uint64_t of_lights);

/// A feature that is left out, and the reason.
using LeftOut = std::vector<std::pair<std::string, std::string>>;
/// `header` is complete. `occluders`: triangles that shadow rays are tested against by the brute-force loop.
LeftOut leftOut(const Scene& scene, const kernel::CrtScene& header, std::size_t occluders,
                bool without_nodes);

}  // namespace crt
