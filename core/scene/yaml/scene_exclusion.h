/// The keys that give way where others override a map: an included section under the
/// scene's own, a scene under `--set`. One rule for both, made of the rules in the table of keys.
#pragma once

#include "scene/yaml/scene_schema.h"
#include "scene/yaml/yaml_reader.h"

#include <functional>
#include <set>
#include <string>
#include <string_view>

namespace crt {

/// True if a key is among the overriding keys.
using IsGiven = std::function<bool(const std::string&)>;

/// Keys that the map below loses: those that exclude a given one, and what goes together with them. An
/// included focal_length and its sensor give way to a fov. Of keys of which one is required the last stays,
/// so that the contradiction is reported, unless a given one takes its place.
std::set<std::string> givingWay(const SectionSchema& section, const IsGiven& given);

/// Keys that are of no use without `key`: they go with it when it is taken away.
std::set<std::string> goingWith(const SectionSchema& section, const std::string& key, const IsGiven& given);

/// The section that a map under `key` is read by, as it will be when it has the key `added`. Null where it
/// is one of several kinds and does not tell which.
const SectionSchema* sectionOfMap(const KeySchema& key, const YamlNode& map, std::string_view added);

/// For a variant that its first key selects: keys of the other variants, which a map loses when it becomes
/// this one.
std::set<std::string> keysOfOtherKinds(const SectionSchema& kind, const IsGiven& given);

}  // namespace crt
