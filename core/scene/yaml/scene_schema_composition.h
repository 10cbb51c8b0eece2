/// The part of the scene's schema about materials that are made of others, and surfaces that are there in
/// part.
#pragma once

#include "scene/yaml/scene_schema.h"

#include <vector>

namespace crt {

/// After the other materials, each of which gets the keys that all have.
void addCompositions(std::vector<SectionSchema>& all);

}  // namespace crt
