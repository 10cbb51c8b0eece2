/// A scene's tree as text again: for programs that want to read, change or store what a scene file, its
/// includes and `--set` say together.
#pragma once

#include "scene/yaml/scene_reader.h"
#include "scene/yaml/yaml_reader.h"

#include <string>

namespace crt {

/// JSON, which is YAML too. Aliases are written out, and the files that `files` has located have absolute
/// paths, so that the text means the same in every directory.
std::string composedText(const YamlNode& root, const SceneFiles& files);

}  // namespace crt
