/// The part of the scene schema (scene_schema.h) that is about how surfaces differ along and across.
#pragma once

#include "scene/yaml/scene_schema.h"

#include <vector>

namespace crt {

/// Adds the keys of anisotropy to the materials that may have it.
void addAnisotropy(std::vector<SectionSchema>& all);

/// Adds the openpbr material, before those that are made of others.
void addOpenPbr(std::vector<SectionSchema>& all);

}  // namespace crt
