/// The files that a scene is made of: the scene itself and what it includes, merged into one tree.
#pragma once

#include "scene/yaml/scene_reader.h"
#include "scene/yaml/yaml_reader.h"

#include <deque>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

class SceneIncludes {
public:
    /// The files that are read are added to `files`, errors to `out`. Both live as long as this.
    SceneIncludes(Diagnostics& out, SceneFiles& files) : out_(out), files_(files) {}

    /// The tree of a scene, with everything that it includes; null when nothing usable is there. `path` is
    /// its file, empty where it is text of another origin. Nodes point into this object.
    YamlNodePtr read(const std::string& name, std::string_view text, const std::string& path);

private:
    YamlNodePtr readSource(const YamlSource& source, std::string_view text);
    /// Null, with an error, when it cannot be used, and without one when it is included already.
    YamlNodePtr readIncluded(const std::string& name, const YamlPlace& place);
    YamlNodePtr withIncludes(YamlNodePtr root);

    Diagnostics& out_;
    SceneFiles& files_;
    std::deque<YamlSource> sources_;   ///< Places point to them: they must not move.
    std::vector<std::string> open_;    ///< Files on the way from the scene to the one that is read now.
    std::set<std::string> complete_;   ///< Files that are in the tree: each counts once.
};

}  // namespace crt
