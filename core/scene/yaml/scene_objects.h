/// Objects of a scene: names looked up, placements multiplied out.
#pragma once

#include "scene/scene.h"
#include "scene/yaml/scene_materials.h"
#include "scene/yaml/scene_meshes.h"

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace crt {

class ObjectReader {
public:
    ObjectReader(Diagnostics& out, MaterialReader& materials, MeshReader& meshes, SceneRoom& room,
                 Scene& scene)
        : out_(out), materials_(materials), meshes_(meshes), room_(room), scene_(scene) {}

    void read(const YamlNode& list);

private:
    void readObject(const YamlNode& node, const YamlPlace& place, std::size_t number);
    /// Warns of an object whose mesh shows nothing.
    void tellLeftOut(const Object& object, const std::string& subject) const;
    std::optional<Matrix4d> readPlacement(const YamlNode& list, const YamlPlace& place,
                                          const std::string& subject);
    std::vector<Matrix4d> readPlacements(const SectionReader& object);

    Diagnostics& out_;
    MaterialReader& materials_;
    MeshReader& meshes_;
    SceneRoom& room_;
    Scene& scene_;
    /// By node: what an alias repeats is read once.
    std::map<const YamlNode*, std::optional<Matrix4d>> written_placements_;
};

}  // namespace crt
