/// Parts of a mesh by the names that its file gives them, and what a scene puts on them.
#pragma once

#include "scene/mesh/mesh_io.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace crt {

/// The kind of name of a face.
enum class PartBy { Any, Group, Object, Material };

/// The material and emission that a scene gives to the faces of a part; −1: none.
struct PartUse {
    std::string pattern;  ///< A name, in which '*' stands for any letters and '?' for one.
    PartBy by = PartBy::Any;
    std::int32_t material = -1;  ///< Index into Scene::materials.
    std::int32_t emission = -1;  ///< Index into Scene::emissions.

    auto operator<=>(const PartUse&) const = default;
};

bool matchesPattern(std::string_view pattern, std::string_view name);

/// Finds what a triangle gets of the parts that it belongs to: of several, the last one that says it.
class PartFinder {
public:
    PartFinder(const LoadedMesh& loaded, const std::vector<PartUse>& uses);

    struct Found {
        std::int32_t material = -1, emission = -1;  ///< As of PartUse.
    };
    /// Of triangle `t` with the file's material `own`.
    Found find(std::int32_t own, std::size_t t);

    /// Goes through all triangles, after which the following can be asked.
    void lookAt(const Mesh& mesh);
    const std::vector<PartUse>& uses() const { return uses_; }
    /// True if a triangle belongs to the part.
    bool used(std::size_t use) const { return used_[use]; }
    /// True if a triangle keeps this material of the file; always without parts.
    bool keeps(std::size_t own) const { return uses_.empty() || keeps_[own]; }
    bool anyMaterial() const { return any_material_; }
    bool anyEmission() const { return any_emission_; }
    /// The names that triangles have, each once, in the order in which they do.
    const std::vector<std::string>& names() const { return names_; }

private:
    bool belongs(const PartUse& use, std::int32_t own, std::int32_t part) const;

    const LoadedMesh& loaded_;
    const std::vector<PartUse>& uses_;
    std::unordered_map<std::uint64_t, Found> known_;  ///< By material of the file and part.
    std::uint64_t last_key_ = 0;
    Found last_;
    bool any_last_ = false, any_material_ = false, any_emission_ = false;
    std::vector<bool> used_, keeps_;
    std::vector<std::string> names_;
};

}  // namespace crt
