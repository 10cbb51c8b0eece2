/// The part of MeshReader that reads `parts` of objects.
#include "scene/yaml/scene_meshes.h"

#include "scene/mesh/obj_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace crt {

std::vector<PartUse> MeshReader::readMeshParts(const SectionReader& object) {
    std::vector<PartUse> parts;
    const YamlNode* map = object.map("parts");
    if (map == nullptr) return parts;
    for (const YamlEntry& entry : map->entries) {
        const std::string subject = fmt::format("part '{}' of {}", entry.key, object.subject());
        if (entry.value->kind != YamlKind::Map) {
            expected(out_, entry.place, "a map such as {material: NAME}", subject, *entry.value);
            continue;
        }
        const SectionReader section(out_, *entry.value, entry.place, schemaSection("part"), subject);
        PartUse part{.pattern = entry.key};
        section.readEnum("by", part.by);
        std::string material;
        if (section.read("material", material))
            part.material = materials_.find(material, section.place("material"), false).value_or(-1);
        part.emission = materials_.readEmission(section, part.material, material, {}).value_or(-1);
        if (!section.has("material") && !section.has("emission"))
            out_.error(entry.place,
                       fmt::format("{} has no effect: give it a 'material' or an 'emission'", subject));
        parts.push_back(std::move(part));
    }
    return parts;
}

/// Of names that no face has.
void MeshReader::tellUnknownParts(const SectionReader& object, const PartFinder& parts) const {
    const std::vector<std::string>& names = parts.names();
    constexpr std::size_t kMostNamed = 12;
    std::vector<std::string> shown;
    for (std::size_t i = 0; i < std::min(names.size(), kMostNamed); ++i) shown.push_back(inQuotes(names[i]));
    const std::size_t more = names.size() - shown.size();
    const std::string list = names.empty() ? "its faces have no names"
                                           : fmt::format("its faces have {}{}", fmt::join(shown, ", "),
                                                         more > 0 ? fmt::format(" and {} more", more) : "");
    static constexpr const char* kKinds[] = {"group, object or material", "group", "object", "material"};
    const std::vector<PartUse>& uses = parts.uses();
    for (std::size_t i = 0; i < uses.size(); ++i) {
        if (parts.used(i)) continue;
        const YamlEntry* entry = object.map("parts")->find(uses[i].pattern);
        out_.error(entry->key_place,
                   fmt::format("no face of '{}' belongs to a {} '{}'", object.find("obj")->value->text,
                               kKinds[static_cast<std::size_t>(uses[i].by)], uses[i].pattern),
                   out_.worthSuggesting(names.size()) ? didYouMean(uses[i].pattern, names) : std::string(),
                   list);
    }
}

}  // namespace crt
