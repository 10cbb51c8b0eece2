/// The part of ObjectReader that reads `parts` of objects, and the emission of surfaces.
#include "scene/yaml/scene_objects.h"

#include "scene/mesh/obj_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace crt {

/// Of a surface with the scene's material `material`, −1 none, that is called `material_name`.
std::optional<std::int32_t> ObjectReader::readEmission(const SectionReader& section, std::int32_t material,
                                                       const std::string& material_name) {
    const std::optional<SectionReader> light =
        section.section("emission", fmt::format("the emission of {}", section.subject()));
    if (!light) return std::nullopt;
    Emission emission;
    light->read("two_sided", emission.two_sided);
    if (std::optional<Spectrum> radiance = spectra_.read(*light, "radiance", SpectrumUse::Emission))
        emission.radiance = *std::move(radiance);
    if (material >= 0 && scene_.materials[static_cast<std::size_t>(material)].emission >= 0)
        section.error("emission", fmt::format("material '{}' emits light already", material_name),
                      "leave 'emission' or the material's 'emission_luminance' out");
    scene_.emissions.push_back(std::move(emission));
    return static_cast<std::int32_t>(scene_.emissions.size() - 1);
}

std::vector<PartUse> ObjectReader::readMeshParts(const SectionReader& object) {
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
            part.material = findMaterial(material, section.place("material"), false).value_or(-1);
        part.emission = readEmission(section, part.material, material).value_or(-1);
        if (!section.has("material") && !section.has("emission"))
            out_.error(entry.place,
                       fmt::format("{} has no effect: give it a 'material' or an 'emission'", subject));
        parts.push_back(std::move(part));
    }
    return parts;
}

/// Of names that no face has.
void ObjectReader::tellUnknownParts(const SectionReader& object, const PartFinder& parts) const {
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
