/// A part of the table of keys: see scene_schema.h.
#pragma once

#include "scene/yaml/scene_schema.h"

#include <vector>

namespace crt {

/// Adds the sections "light/…".
void addLights(std::vector<SectionSchema>& all);

/// Adds the sections "sky" and "clear_sky".
void addSkies(std::vector<SectionSchema>& all);

/// The keys that readTowardsSun (scene_sun.h) reads, and what they have to do with each other.
std::vector<KeySchema> sunKeys();
std::vector<KeyRule> sunRules();

}  // namespace crt
