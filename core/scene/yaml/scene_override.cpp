#include "scene/yaml/scene_override.h"

#include "base/words.h"
#include "scene/yaml/scene_exclusion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>

namespace crt {
namespace {

/// One `--set` argument on its way down the tree.
class OverrideWalk {
public:
    OverrideWalk(const SceneOverride& change, const YamlSource& source, Diagnostics& out)
        : path_(change.path), source_(source), out_(out) {}

    /// Puts `value` where the path leads. Nodes on the way are copied first, because aliases share them.
    /// Maps that the file leaves out are made; the check of the whole scene then finds keys that do not
    /// exist, with the place in the argument.
    void apply(YamlNodePtr& slot, const YamlNodePtr& value) {
        const KeySchema scene{.name = "the scene", .kind = ValueKind::Section};
        apply(slot, value, 0, {&scene});
    }

private:
    static constexpr int kDeepestPath = 64;  // As deep as YAML may be.

    /// The row of the table that a value stands under; null where there is none.
    struct Row {
        const KeySchema* key = nullptr;
        bool named = false;  ///< Below the free name of an entry.

        bool holdsNames() const { return key != nullptr && key->shape == ValueShape::Map && !named; }
    };

    void apply(YamlNodePtr& slot, const YamlNodePtr& value, std::size_t at, Row row) {
        if (++parts_ > kDeepestPath) {
            out_.error(place(0, path_.size()),
                       fmt::format("a path of more than {} parts cannot exist in a scene", kDeepestPath));
            return;
        }
        slot = std::make_shared<YamlNode>(*slot);
        if (slot->kind == YamlKind::Null) slot->kind = YamlKind::Map;
        switch (slot->kind) {
            case YamlKind::Map: return applyToMap(*slot, value, at, row);
            case YamlKind::List: return applyToList(*slot, value, at, row);
            case YamlKind::Scalar:
            case YamlKind::Null: break;
        }
        const std::string_view before = std::string_view(path_).substr(0, at > 0 ? at - 1 : 0);
        out_.error(place(at, path_.size() - at),
                   fmt::format("'{}' is {} here and has no keys", before,
                               describeNode(*slot)),
                   fmt::format("set '{}' as a whole", before));
    }

    YamlPlace place(std::size_t at, std::size_t length) const {
        return {&source_, 1, static_cast<int>(at) + 1, static_cast<int>(std::max<std::size_t>(length, 1))};
    }

    /// Length of the next part of the path. Names may hold dots ("Material.001"), so a key that is there
    /// wins over the first dot.
    std::size_t partLength(const YamlNode& map, std::size_t at) const {
        const std::string_view rest = std::string_view(path_).substr(at);
        std::size_t longest = 0;
        for (const YamlEntry& e : map.entries)
            if (rest.starts_with(e.key) && (rest.size() == e.key.size() || rest[e.key.size()] == '.'))
                longest = std::max(longest, e.key.size());
        return longest > 0 ? longest : std::min(rest.find('.'), rest.size());
    }

    void applyToMap(YamlNode& map, const YamlNodePtr& value, std::size_t at, Row row) {
        const std::size_t length = partLength(map, at);
        const std::string key = path_.substr(at, length);
        const bool last = at + length == path_.size();
        const SectionSchema* const section =
            row.key != nullptr && !row.holdsNames() ? sectionOfMap(*row.key, map, key) : nullptr;
        const Row below =
            row.holdsNames() ? Row{row.key, true} : Row{section != nullptr ? section->find(key) : nullptr};
        if (last && value->kind == YamlKind::Null && section != nullptr && isOptional(below))
            return remove(map, goingWith(*section, key, givenIn(map)));
        const auto entry = std::find_if(map.entries.begin(), map.entries.end(),
                                        [&](const YamlEntry& e) { return e.key == key; });
        if (entry != map.entries.end()) {
            if (!last) return apply(entry->value, value, at + length + 1, below);
            entry->key_place = place(at, length);
            entry->place = value->place;
            entry->value = value;
            return;
        }
        if (!last && row.holdsNames()) {
            std::vector<std::string> names;
            for (const YamlEntry& e : map.entries) names.push_back(e.key);
            out_.error(place(at, length),
                       fmt::format("there is no '{}' in '{}'", key, path_.substr(0, at - 1)),
                       didYouMean(key, names));
            return;
        }
        YamlNodePtr node = value;
        if (!last) {
            node = std::make_shared<YamlNode>();
            node->place = place(at, length);
            apply(node, value, at + length + 1, below);
        }
        map.entries.push_back({key, place(at, length), node->place, node});
        if (section == nullptr) return;
        remove(map, givingWay(*section, givenIn(map)));
        if (variantWord(*section) == key) remove(map, keysOfOtherKinds(*section, givenIn(map)));
    }

    /// Keys that come from the command line: they do not give way to one another, so that a contradiction is
    /// reported.
    static IsGiven givenIn(const YamlNode& map) {
        return [&map](const std::string& key) {
            const YamlEntry* entry = map.find(key);
            return entry != nullptr && entry->key_place.source != nullptr &&
                   entry->key_place.source->command_line;
        };
    }

    /// True if null removes a key, as if the file left it out. Of keys for which null is a value it is that
    /// value.
    static bool isOptional(Row row) {
        return row.key != nullptr && !row.named && !row.key->required && !row.key->nullable;
    }

    static void remove(YamlNode& map, const std::set<std::string>& keys) {
        std::erase_if(map.entries, [&keys](const YamlEntry& entry) { return keys.contains(entry.key); });
    }

    static std::string nameOf(const YamlNode& item) {
        const YamlEntry* const name = item.kind == YamlKind::Map ? item.find("name") : nullptr;
        return name != nullptr && name->value->kind == YamlKind::Scalar ? name->value->text : std::string();
    }

    /// The items of a list whose name the path goes on with, as far as the longest name does. `length` gets
    /// how long that is.
    std::vector<std::size_t> itemsNamed(const YamlNode& list, std::size_t at, std::size_t& length) const {
        const std::string_view rest = std::string_view(path_).substr(at);
        std::vector<std::size_t> found;
        std::size_t longest = 0;
        for (std::size_t i = 0; i < list.items.size(); ++i) {
            const std::string name = nameOf(*list.items[i]);
            const bool fits = !name.empty() && rest.starts_with(name) &&
                              (rest.size() == name.size() || rest[name.size()] == '.');
            if (!fits || name.size() < longest) continue;
            if (name.size() > longest) found.clear();
            longest = name.size();
            found.push_back(i);
        }
        if (longest > 0) length = longest;
        return found;
    }

    void refuseItem(const YamlNode& list, std::size_t at, std::size_t length) {
        const std::string list_name = path_.substr(0, at > 0 ? at - 1 : 0), part = path_.substr(at, length);
        if (list.items.empty())
            return out_.error(place(at, length), fmt::format("'{}' is an empty list", list_name));
        std::vector<std::string> names;
        for (const YamlNodePtr& item : list.items)
            if (std::string name = nameOf(*item); !name.empty()) names.push_back(std::move(name));
        out_.error(place(at, length),
                   fmt::format("'{}' is a list; expected an index from 0 to {}{}, found '{}'", list_name,
                               list.items.size() - 1, names.empty() ? "" : " or an item's name", part),
                   didYouMean(part, names));
    }

    /// By its index, or by the name that an item has.
    void applyToList(YamlNode& list, const YamlNodePtr& value, std::size_t at, Row row) {
        std::size_t length = std::min(path_.find('.', at), path_.size()) - at;
        const Parsed<std::uint64_t> index = parseUnsigned(path_.substr(at, length));
        std::vector<std::size_t> which;
        if (index.value && *index.value < list.items.size())
            which = {*index.value};
        else
            which = itemsNamed(list, at, length);
        if (which.empty()) return refuseItem(list, at, length);
        if (which.size() > 1)
            return out_.error(
                place(at, length),
                fmt::format("{} items are called '{}'", which.size(), path_.substr(at, length)),
                fmt::format("write the index of one: {}", fmt::join(which, ", ")));
        YamlNodePtr& item = list.items[which.front()];
        if (at + length == path_.size())
            item = value;
        else
            apply(item, value, at + length + 1, row);
    }

    std::string path_;
    const YamlSource& source_;
    Diagnostics& out_;
    int parts_ = 0;
};

}  // namespace

void applyOverrides(YamlNodePtr& root, const std::vector<SceneOverride>& overrides,
                    std::deque<YamlSource>& sources, Diagnostics& out) {
    for (const SceneOverride& change : overrides) {
        const YamlSource& source = sources.emplace_back(fmt::format("--set {}", change.path),
                                                        change.path + "=" + change.value, true);
        const std::size_t before = out.count();
        if (change.path == "include" || change.path.starts_with("include.")) {
            out.error({&source, 1, 1, static_cast<int>(change.path.size())},
                      "--set cannot change 'include': it applies to the combined scene");
            continue;
        }
        const YamlNodePtr value =
            readYaml(source, change.value, out, static_cast<int>(change.path.size()) + 1);
        if (value)
            OverrideWalk(change, source, out).apply(root, value);
        else if (out.count() == before)
            out.error({&source, 1, static_cast<int>(change.path.size()) + 1, 1},
                      "the value after '=' is missing; use null for none");
    }
}

}  // namespace crt
