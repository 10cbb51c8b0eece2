/// Suggestions of messages beyond the nearest word: for values in the form of another program, or with a
/// missing level.
#pragma once

#include "scene/yaml/scene_schema.h"
#include "scene/yaml/yaml_reader.h"

#include <string>
#include <string_view>

namespace crt {

/// A word that other programs use where crt has another, or another way: of a key of the section, or of what
/// follows `type` in the family. Empty where nothing is known of it.
std::string hintOfForeignWord(std::string_view section_or_family, std::string_view word);

/// "write {radiance: 5}", of a value where the map of a section is expected. Empty where none of its keys
/// takes the value.
std::string hintOfMissingMap(const SectionSchema& section, const YamlNode& node);

/// "write {rgb: [0.7, 0.7, 0.7]}", of a list of three numbers, and of #b3b3b3 without quotes, which YAML
/// takes for a comment. Empty where the value is no colour.
std::string hintOfColor(const YamlNode& node, const YamlPlace& place);
/// The same of "red" and "#ff0000".
std::string hintOfColorName(std::string_view name);

}  // namespace crt
