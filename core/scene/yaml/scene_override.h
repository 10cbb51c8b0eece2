/// Values of the command line (`--set`) put into the tree of a scene, before it is read.
#pragma once

#include "scene/yaml/scene_yaml.h"
#include "scene/yaml/yaml_reader.h"

#include <deque>
#include <vector>

namespace crt {

/// Puts each value where its path leads. A key that is set takes the place of those that exclude it, as a
/// scene's own does over an included one; null takes an optional key away. `sources` gets the texts that
/// messages point into. The check of the whole scene decides whether keys exist.
void applyOverrides(YamlNodePtr& root, const std::vector<SceneOverride>& overrides,
                    std::deque<YamlSource>& sources, Diagnostics& out);

}  // namespace crt
