/// The part of the scene schema (scene_schema.h) that is about textures.
#pragma once

#include "scene/yaml/scene_schema.h"

#include <span>
#include <vector>

namespace crt {

/// The keys of a pattern that are its numbers: those between its values and the transform.
std::span<const KeySchema> numbersOfPattern(const SectionSchema& section);

/// Beyond this texture coordinates have no digits left for the texel.
inline constexpr double kMostUv = 1e6;

void addTextures(std::vector<SectionSchema>& all);

}  // namespace crt
