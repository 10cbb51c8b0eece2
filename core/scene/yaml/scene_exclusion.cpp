#include "scene/yaml/scene_exclusion.h"

#include <algorithm>
#include <vector>

namespace crt {
namespace {

void addMissing(const KeyRule& rule, const IsGiven& given, std::set<std::string>& gone) {
    for (const std::string& key : rule.keys)
        if (!given(key)) gone.insert(key);
}

/// Keys that belong to keys that were removed.
void addCompanions(const SectionSchema& section, const IsGiven& given, std::set<std::string>& gone) {
    const auto is_gone = [&gone](const std::string& key) { return gone.contains(key); };
    for (const KeyRule& rule : section.rules)
        if (rule.kind == KeyRule::Kind::Together && std::any_of(rule.keys.begin(), rule.keys.end(), is_gone))
            addMissing(rule, given, gone);
}

/// The part before '/'; of a section without variants its name.
std::string familyNameOf(const SectionSchema& section) {
    return section.name.substr(0, section.name.find('/'));
}

const SectionSchema* variantOf(std::string_view family, const YamlNode& map, std::string_view added) {
    const std::vector<const SectionSchema*> variants = schemaVariants(family);
    if (variants.empty() || variants.front()->name == family)
        return variants.empty() ? nullptr : variants.front();
    const auto named = [&variants](std::string_view word) -> const SectionSchema* {
        for (const SectionSchema* variant : variants)
            if (variantWord(*variant) == word) return variant;
        return nullptr;
    };
    if (variantByType(*variants.front())) {
        const YamlEntry* type = map.find("type");
        return type != nullptr ? named(type->value->text) : nullptr;
    }
    if (const SectionSchema* becomes = named(added)) return becomes;
    for (const YamlEntry& entry : map.entries)
        if (const SectionSchema* is = named(entry.key)) return is;
    return nullptr;
}

}  // namespace

std::set<std::string> givingWay(const SectionSchema& section, const IsGiven& given) {
    std::set<std::string> gone;
    for (const KeyRule& rule : section.rules)
        if (rule.kind != KeyRule::Kind::Together && std::any_of(rule.keys.begin(), rule.keys.end(), given))
            addMissing(rule, given, gone);
    for (const KeyRule& rule : section.rules)
        if (rule.kind == KeyRule::Kind::ExactlyOne &&
            std::none_of(rule.keys.begin(), rule.keys.end(), given))
            for (const std::string& key : rule.keys) gone.erase(key);
    addCompanions(section, given, gone);
    return gone;
}

std::set<std::string> goingWith(const SectionSchema& section, const std::string& key, const IsGiven& given) {
    std::set<std::string> gone{key};
    addCompanions(section, given, gone);
    return gone;
}

const SectionSchema* sectionOfMap(const KeySchema& key, const YamlNode& map, std::string_view added) {
    if (key.kind == ValueKind::Spectrum)
        if (const SectionSchema* spectrum = variantOf("spectrum", map, added)) return spectrum;
    const bool no_map = key.section.empty() && key.kind != ValueKind::Section;
    return no_map ? nullptr : variantOf(key.section, map, added);
}

std::set<std::string> keysOfOtherKinds(const SectionSchema& kind, const IsGiven& given) {
    std::set<std::string> keys;
    if (variantByType(kind)) return keys;
    for (const SectionSchema* other : schemaVariants(familyNameOf(kind)))
        for (const KeySchema& key : other->keys)
            if (kind.find(key.name) == nullptr && !given(key.name)) keys.insert(key.name);
    return keys;
}

}  // namespace crt
