#include "scene/yaml/scene_include.h"

#include "base/input_file.h"
#include "scene/yaml/scene_exclusion.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <utility>

namespace crt {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostOpen = 16, kMostFiles = 256;

std::string identityOf(const std::string& path) {
    std::error_code unknown;
    const fs::path canonical = fs::weakly_canonical(path, unknown);
    return unknown ? path : canonical.string();
}

/// The version comes first so that a reader of another version can stop before it meets a key it does not
/// know.
void checkFirstKey(const YamlNode& root, Diagnostics& out) {
    if (root.kind != YamlKind::Map) return;
    const YamlEntry* version = root.find("crt");
    if (version != nullptr && version != &root.entries.front())
        out.error(version->key_place, "'crt' must be the first key of a scene");
}

/// Errors that the check of the merged scene would miss, since that has its own version key.
void checkIncluded(const YamlNode& root, Diagnostics& out) {
    if (root.kind != YamlKind::Map) {
        out.error(root.place, fmt::format("an included file is a scene, which is a map; this is {}",
                                          describeNode(root)));
        return;
    }
    const YamlEntry* version = root.find("crt");
    if (version == nullptr) {
        out.error(root.place, "'crt' is missing in this included scene", "begin it with 'crt: 1'");
        return;
    }
    std::int64_t number = 0;
    readScalar(out, *version->value, version->place, *schemaSection("").find("crt"), "'crt'", number);
}

/// Lists that grow: what an included room holds is there beside what the scene adds.
bool isJoined(const std::string& key) { return key == "objects" || key == "lights"; }

YamlNodePtr joined(const YamlNode& below, const YamlNode& above) {
    auto list = std::make_shared<YamlNode>(above);
    list->items = below.items;
    list->items.insert(list->items.end(), above.items.begin(), above.items.end());
    list->size = below.size + above.size;
    return list;
}

/// Keys of both; where both have one, that of `above`.
YamlNodePtr keyByKey(const YamlNode& below, const YamlNode& above, const std::set<std::string>& gone = {}) {
    auto map = std::make_shared<YamlNode>(above);
    map->entries = below.entries;
    std::erase_if(map->entries, [&gone](const YamlEntry& entry) { return gone.contains(entry.key); });
    map->size = below.size + above.size;
    for (const YamlEntry& entry : above.entries) {
        const auto known = std::find_if(map->entries.begin(), map->entries.end(),
                                        [&](const YamlEntry& e) { return e.key == entry.key; });
        if (known != map->entries.end())
            *known = entry;
        else
            map->entries.push_back(entry);
    }
    return map;
}

/// The keys that `below` loses to a key of the scene in one section; the other sections exclude nothing.
std::set<std::string> lostBelow(const std::string& key, const YamlNode& above) {
    const KeySchema* schema = schemaSection("").find(key);
    const bool section = schema != nullptr && schema->kind == ValueKind::Section &&
                         schema->shape == ValueShape::One;
    if (!section) return {};
    return givingWay(schemaSection(schema->section),
                     [&above](const std::string& name) { return above.find(name) != nullptr; });
}

/// Lengths of two files under two units would not fit together.
void checkUnits(const YamlNode& below, const YamlNode& above, Diagnostics& out) {
    const YamlEntry *lower = below.find("unit"), *upper = above.find("unit");
    if (lower == nullptr || upper == nullptr || lower->value->text == upper->value->text) return;
    out.error(upper->place,
              fmt::format("the unit is '{}' here and '{}' in {}: all files of a scene must use the same "
                          "unit",
                          upper->value->text, lower->value->text, lower->place.resolved().text()),
              "remove one of them, and scale the lengths of its file");
}

/// Two scenes as one. Sections, `spectra` and `materials` key by key, `objects` and `lights` joined;
/// everything else is that of `above` where it has it.
YamlNodePtr merged(const YamlNode& below, const YamlNode& above) {
    const YamlNodePtr scene = keyByKey(below, above);
    for (YamlEntry& entry : scene->entries) {
        const YamlEntry *lower = below.find(entry.key), *upper = above.find(entry.key);
        if (lower == nullptr || upper == nullptr) continue;
        if (lower->value->kind == YamlKind::Map && upper->value->kind == YamlKind::Map)
            entry.value = keyByKey(*lower->value, *upper->value, lostBelow(entry.key, *upper->value));
        else if (isJoined(entry.key) && lower->value->kind == YamlKind::List &&
                 upper->value->kind == YamlKind::List)
            entry.value = joined(*lower->value, *upper->value);
    }
    return scene;
}

}  // namespace

YamlNodePtr SceneIncludes::read(const std::string& name, std::string_view text, const std::string& path) {
    const YamlSource& source = sources_.emplace_back(name, text);
    if (!path.empty()) open_.push_back(identityOf(path));
    YamlNodePtr root = readSource(source, text);
    if (!root && !out_.failed())
        out_.error({&source, 0, 0, 1}, "there is nothing in this file; a scene begins with 'crt: 1'");
    open_.clear();
    return root;
}

YamlNodePtr SceneIncludes::readSource(const YamlSource& source, std::string_view text) {
    YamlNodePtr root = readYaml(source, text, out_);
    if (!root) return nullptr;
    checkFirstKey(*root, out_);
    return withIncludes(std::move(root));
}

YamlNodePtr SceneIncludes::withIncludes(YamlNodePtr root) {
    if (root->kind != YamlKind::Map || root->find("include") == nullptr) return root;
    const YamlEntry include = *root->find("include");
    std::vector<std::pair<std::string, YamlPlace>> names;
    const auto addName = [&](const YamlNode& node, const YamlPlace& place) {
        std::string name;
        if (readText(out_, node, place, "'include'", name)) names.emplace_back(std::move(name), place);
    };
    if (include.value->kind == YamlKind::List)
        for (const YamlNodePtr& item : include.value->items) addName(*item, item->place);
    else
        addName(*include.value, include.place);

    YamlNodePtr below;
    for (const auto& [name, place] : names) {
        const YamlNodePtr part = readIncluded(name, place);
        if (!part || part->kind != YamlKind::Map) continue;
        if (below) checkUnits(*below, *part, out_);
        below = below ? merged(*below, *part) : part;
    }
    auto own = std::make_shared<YamlNode>(*root);
    std::erase_if(own->entries, [](const YamlEntry& entry) { return entry.key == "include"; });
    if (!below) return own;
    checkUnits(*below, *own, out_);
    return merged(*below, *own);
}

YamlNodePtr SceneIncludes::readIncluded(const std::string& name, const YamlPlace& place) {
    const std::optional<std::string> path = files_.locateBeside(name, place, out_);
    if (!path) return nullptr;
    const std::string identity = identityOf(*path);
    if (std::find(open_.begin(), open_.end(), identity) != open_.end()) {
        out_.error(place, fmt::format("'{}' includes itself, directly or through other files", *path));
        return nullptr;
    }
    if (complete_.contains(identity)) return nullptr;
    if (open_.size() > kMostOpen || complete_.size() >= kMostFiles) {
        out_.error(place, open_.size() > kMostOpen
                              ? fmt::format("files are included more than {} deep", kMostOpen)
                              : fmt::format("more than {} files are included", kMostFiles));
        return nullptr;
    }
    std::string text;
    try {
        text = readInput(*path, kMostSceneBytes);
    } catch (const InputRefused& refused) {
        out_.error(place, fmt::format("'{}' {}", *path, refused.what()));
        return nullptr;
    }
    files_.note(*path);
    YamlSource& source = sources_.emplace_back(*path, text);
    source.included = true;
    source.rank = static_cast<int>(sources_.size()) - 1;
    const std::string folder = fs::path(*path).parent_path().string();
    source.directory = folder.empty() ? "." : folder;
    open_.push_back(identity);
    const std::size_t errors = out_.count();
    YamlNodePtr root = readSource(source, text);
    open_.pop_back();
    complete_.insert(identity);
    if (!root && out_.count() == errors)
        out_.error({&source, 0, 0, 1},
                   "there is nothing in this file; an included scene begins with 'crt: 1'");
    if (root) checkIncluded(*root, out_);
    return root;
}

}  // namespace crt
