/// The part of the scene schema (scene_schema.h) that is about glTF files.
#pragma once

#include "scene/yaml/scene_schema.h"

#include <vector>

namespace crt {

/// Adds the form of an object's `gltf`, behind that of objects.
void addGltf(std::vector<SectionSchema>& all);

}  // namespace crt
