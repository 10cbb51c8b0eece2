#include "scene/mesh/mesh_parts.h"

#include "scene/mesh/obj_text.h"

#include <algorithm>
#include <set>

namespace crt {
namespace {

/// A group by the whole of what follows g, blanks among it, or by one of its words: the statement may name
/// several groups.
bool matchesGroup(std::string_view pattern, std::string_view group) {
    if (matchesPattern(pattern, group)) return true;
    for (std::string_view word = nextField(group); !word.empty(); word = nextField(group))
        if (matchesPattern(pattern, word)) return true;
    return false;
}

}  // namespace

bool matchesPattern(std::string_view pattern, std::string_view name) {
    std::size_t p = 0, n = 0, star = std::string_view::npos, taken = 0;
    while (n < name.size()) {
        if (p < pattern.size() && pattern[p] == '*') {
            star = p++;
            taken = n;
        } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == name[n])) {
            ++p, ++n;
        } else if (star != std::string_view::npos) {
            p = star + 1;
            n = ++taken;
        } else {
            return false;
        }
    }
    while (p < pattern.size() && pattern[p] == '*') ++p;
    return p == pattern.size();
}

PartFinder::PartFinder(const LoadedMesh& loaded, const std::vector<PartUse>& uses)
    : loaded_(loaded), uses_(uses), used_(uses.size()), keeps_(loaded.materials.size()) {}

bool PartFinder::belongs(const PartUse& use, std::int32_t own, std::int32_t part) const {
    const auto asked = [&](PartBy by) { return use.by == PartBy::Any || use.by == by; };
    if (own >= 0 && asked(PartBy::Material) &&
        matchesPattern(use.pattern, loaded_.materials[static_cast<std::size_t>(own)].name))
        return true;
    if (part < 0) return false;
    const MeshPart& names = loaded_.parts[static_cast<std::size_t>(part)];
    return (asked(PartBy::Group) && !names.group.empty() && matchesGroup(use.pattern, names.group)) ||
           (asked(PartBy::Object) && !names.object.empty() && matchesPattern(use.pattern, names.object));
}

PartFinder::Found PartFinder::find(std::int32_t own, std::size_t t) {
    if (uses_.empty()) return {};
    const std::int32_t part = loaded_.part.empty() ? -1 : loaded_.part[t];
    const std::uint64_t key =
        std::uint64_t{static_cast<std::uint32_t>(own)} << 32 | static_cast<std::uint32_t>(part);
    if (any_last_ && key == last_key_) return last_;  // Neighbours are alike.
    const auto [known, fresh] = known_.try_emplace(key);
    if (fresh)
        for (std::size_t i = 0; i < uses_.size(); ++i) {
            if (!belongs(uses_[i], own, part)) continue;
            used_[i] = true;
            if (uses_[i].material >= 0) known->second.material = uses_[i].material;
            if (uses_[i].emission >= 0) known->second.emission = uses_[i].emission;
        }
    any_last_ = true;
    last_key_ = key;
    return last_ = known->second;
}

void PartFinder::lookAt(const Mesh& mesh) {
    std::set<std::string> named;
    const auto add = [&](const std::string& name) {
        if (!name.empty() && named.insert(name).second) names_.push_back(name);
    };
    std::size_t combinations = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const std::int32_t own = mesh.material.empty() ? -1 : mesh.material[t];
        const Found found = find(own, t);
        any_material_ |= found.material >= 0;
        any_emission_ |= found.emission >= 0;
        if (own >= 0 && found.material < 0) keeps_[static_cast<std::size_t>(own)] = true;
        if (known_.size() == combinations) continue;
        combinations = known_.size();
        if (own >= 0) add(loaded_.materials[static_cast<std::size_t>(own)].name);
        if (loaded_.part.empty() || loaded_.part[t] < 0) continue;
        const MeshPart& part = loaded_.parts[static_cast<std::size_t>(loaded_.part[t])];
        add(part.group);
        add(part.object);
    }
}

}  // namespace crt
