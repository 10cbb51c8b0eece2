/// The part of the scene schema (scene_schema.h) that is about thin films.
#pragma once

#include "scene/yaml/scene_schema.h"

#include <vector>

namespace crt {

/// Of the materials that may have one.
KeySchema thinFilmKey();

void addThinFilm(std::vector<SectionSchema>& all);

}  // namespace crt
