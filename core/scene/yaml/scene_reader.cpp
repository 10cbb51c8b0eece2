// Over 450 lines: one class, with a short function for each kind of value that a key can have.
#include "scene/yaml/scene_reader.h"

#include "base/input_file.h"
#include "base/log.h"
#include "base/modules.h"
#include "scene/yaml/scene_hints.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <system_error>

namespace crt {
namespace {

namespace fs = std::filesystem;

template <class T>
bool readNumeric(Diagnostics& out, const YamlNode& node, const YamlPlace& place, const KeySchema& key,
                 const std::string& what, const char* wanted, Parsed<T> (*parse)(const std::string&),
                 T& value) {
    if (node.kind != YamlKind::Scalar || node.quoted) {
        expected(out, place, wanted, what, node);
        return false;
    }
    const Parsed<T> parsed = parse(node.text);
    // The range check decides whether -1 is not a whole number or just too small; its message is better.
    if (!parsed.value) {
        const Parsed<double> real = parseNumber(node.text);
        if (real.value && !key.range.contains(*real.value))
            out.error(place, fmt::format("{} is {}; it must be {}", what, node.text, key.range.text()));
        else
            out.error(place,
                      fmt::format("expected {} for {}, found {}: {}", wanted, what, describeNode(node),
                                  parsed.problem),
                      node.text.starts_with('$') ? "scenes have no variables; use --set" : "");
        return false;
    }
    if (!key.range.contains(static_cast<double>(*parsed.value))) {
        out.error(place, fmt::format("{} is {}; it must be {}", what, node.text, key.range.text()));
        return false;
    }
    value = *parsed.value;
    return true;
}

std::string countText(const KeySchema& key, std::string_view things) {
    if (key.count_min == key.count_max) return fmt::format("a list of {} {}", key.count_min, things);
    if (key.count_max == kUnbounded)
        return key.count_min > 0 ? fmt::format("a list of {} or more {}", key.count_min, things)
                                 : fmt::format("a list of {}", things);
    return fmt::format("a list of {} to {} {}", key.count_min, key.count_max, things);
}

bool checkList(Diagnostics& out, const YamlNode& node, const YamlPlace& place, const KeySchema& key,
               const std::string& what, std::string_view things) {
    const auto count = static_cast<std::int64_t>(node.items.size());
    if (node.kind == YamlKind::List && count >= key.count_min && count <= key.count_max) return true;
    expected(out, place, countText(key, things), what, node);
    return false;
}

/// Members of a list that share a row of the table. Reads all, so that each wrong one is reported.
template <class T>
bool readMembers(Diagnostics& out, const YamlNode& node, const YamlPlace& place, const KeySchema& key,
                 const std::string& what, std::string_view things, std::vector<T>& values) {
    if (!checkList(out, node, place, key, what, things)) return false;
    std::vector<T> read(node.items.size());
    bool good = true;
    for (std::size_t i = 0; i < read.size(); ++i)
        good &= readScalar(out, *node.items[i], node.items[i]->place, key,
                           fmt::format("value {} of {}", i + 1, what), read[i]);
    if (good) values = std::move(read);
    return good;
}

std::string quotedName(std::string_view key) { return fmt::format("'{}'", key); }

/// Files of a directory for the did-you-mean; a huge directory is not worth the time.
void addFileNames(const fs::path& directory, std::vector<std::string>& names) {
    constexpr std::size_t kEnough = 1000;
    std::error_code ec;
    for (fs::directory_iterator it(directory, ec), end; !ec && it != end && names.size() < kEnough;
         it.increment(ec))
        names.push_back(it->path().filename().string());
}

}  // namespace

void expected(Diagnostics& out, const YamlPlace& place, std::string_view wanted, const std::string& what,
              const YamlNode& node, std::string hint) {
    if (node.reported) return;
    if (hint.empty() && node.kind == YamlKind::Scalar && node.quoted && looksLikeNumber(node.text))
        hint = "leave the quotes out";
    out.error(place, fmt::format("expected {} for {}, found {}", wanted, what, describeNode(node)),
              std::move(hint));
}

bool readScalar(Diagnostics& out, const YamlNode& node, const YamlPlace& place, const KeySchema& key,
                const std::string& what, double& value) {
    return readNumeric(out, node, place, key, what, "a number", &parseNumber, value);
}
bool readScalar(Diagnostics& out, const YamlNode& node, const YamlPlace& place, const KeySchema& key,
                const std::string& what, std::int64_t& value) {
    return readNumeric(out, node, place, key, what, "a whole number", &parseInteger, value);
}
bool readScalar(Diagnostics& out, const YamlNode& node, const YamlPlace& place, const KeySchema& key,
                const std::string& what, std::uint64_t& value) {
    return readNumeric(out, node, place, key, what, "a whole number", &parseUnsigned, value);
}

bool readText(Diagnostics& out, const YamlNode& node, const YamlPlace& place, const std::string& what,
              std::string& value) {
    if (node.kind != YamlKind::Scalar) {
        expected(out, place, "text", what, node);
        return false;
    }
    // An editor's schema check sees a number here; agree with it rather than guess.
    if (!node.quoted && (looksLikeNumber(node.text) || node.text == "true" || node.text == "false")) {
        out.error(place, fmt::format("expected text for {}, found {}", what, describeNode(node)),
                  "put it in quotes");
        return false;
    }
    if (node.text.empty()) {
        out.error(place, fmt::format("{} is empty", what));
        return false;
    }
    value = node.text;
    return true;
}

bool readChoice(Diagnostics& out, const YamlNode& node, const YamlPlace& place, const KeySchema& key,
                const std::string& what, std::size_t& value, const std::string& hint) {
    const std::string wanted = key.choices.size() == 1
                                   ? key.choices.front()
                                   : fmt::format("one of {}", fmt::join(key.choices, ", "));
    if (node.kind != YamlKind::Scalar) {
        expected(out, place, wanted, what, node);
        return false;
    }
    const auto found = std::find(key.choices.begin(), key.choices.end(), node.text);
    if (found == key.choices.end()) {
        out.error(place, fmt::format("expected {} for {}, found {}", wanted, what, describeNode(node)),
                  hint.empty() ? didYouMean(node.text, key.choices) : hint);
        return false;
    }
    value = static_cast<std::size_t>(found - key.choices.begin());
    return true;
}

bool readNumbers(Diagnostics& out, const YamlNode& node, const YamlPlace& place, const KeySchema& key,
                 const std::string& what, std::vector<double>& values) {
    return readMembers(out, node, place, key, what, "numbers", values);
}

SectionReader::SectionReader(Diagnostics& out, const YamlNode& node, const YamlPlace& place,
                             const SectionSchema& schema, std::string subject)
    : out_(&out), node_(&node), place_(place), schema_(&schema), subject_(std::move(subject)) {
    if (node.kind != YamlKind::Map) {
        expected(out, place, "a map", subject_, node, hintOfMissingMap(schema, node));
        return;
    }
    checkKeys();
    checkRules();
}

void SectionReader::checkKeys() const {
    const std::vector<std::string> names = schema_->keyNames();
    std::set<std::string> misspelt;  // A key that is there under a wrong name is not missing as well.
    for (const YamlEntry& entry : node_->entries) {
        if (schema_->find(entry.key) != nullptr) continue;
        if (const std::optional<std::string> meant = nearestWord(entry.key, names)) misspelt.insert(*meant);
        std::string suggestion = hintOfForeignWord(schema_->name, entry.key);
        if (suggestion.empty()) suggestion = didYouMean(entry.key, names);
        if (const auto homes = sectionsWithKey(entry.key, schema_->name);
            suggestion.empty() && !homes.empty())
            suggestion = fmt::format("'{}' is a key of {}", entry.key, homes.front());
        out_->error(entry.key_place, fmt::format("unknown key '{}' in {}", entry.key, subject_),
                    std::move(suggestion),
                    fmt::format("keys of {}: {}", schema_->title, fmt::join(names, ", ")));
    }
    for (const KeySchema& key : schema_->keys)
        if (key.required && node_->find(key.name) == nullptr && !misspelt.contains(key.name))
            out_->error(place_, fmt::format("'{}' is missing in {}", key.name, subject_));
}

void SectionReader::checkRules() const {
    for (const KeyRule& rule : schema_->rules) {
        std::vector<std::string> given, missing;
        const YamlEntry* last = nullptr;  // Of those given.
        for (const std::string& key : rule.keys) {
            const YamlEntry* entry = node_->find(key);
            (entry != nullptr ? given : missing).push_back(quotedName(key));
            if (entry != nullptr) last = entry;
        }
        switch (rule.kind) {
            case KeyRule::Kind::ExactlyOne:
                if (given.empty())
                    out_->error(place_, fmt::format("{} needs {}", subject_, fmt::join(rule.keys, " or ")));
                [[fallthrough]];
            case KeyRule::Kind::AtMostOne:
                if (given.size() > 1)
                    out_->error(
                        last->key_place,
                        fmt::format("{} in {} exclude each other", fmt::join(given, " and "), subject_));
                break;
            case KeyRule::Kind::Together:
                if (!given.empty() && !missing.empty())
                    out_->error(place_, fmt::format("{} in {} needs {} too", fmt::join(given, " and "),
                                                    subject_, fmt::join(missing, " and ")));
                break;
        }
    }
}

const KeySchema& SectionReader::row(std::string_view key) const {
    if (const KeySchema* found = schema_->find(key)) return *found;
    throw Error(ErrorKind::Internal,
                fmt::format("the scene schema has no key '{}' in '{}'", key, schema_->name));
}

const YamlEntry* SectionReader::find(std::string_view key) const {
    const KeySchema& schema = row(key);
    const YamlEntry* entry = node_->find(key);
    return entry != nullptr && schema.nullable && entry->value->kind == YamlKind::Null ? nullptr : entry;
}

YamlPlace SectionReader::place(std::string_view key) const {
    const YamlEntry* entry = node_->find(key);
    return entry != nullptr ? entry->place : place_;
}

void SectionReader::error(std::string_view key, std::string message, std::string suggestion,
                          std::string note) const {
    out_->error(place(key), std::move(message), std::move(suggestion), std::move(note));
}

bool SectionReader::read(std::string_view key, double& value) const {
    const YamlEntry* e = find(key);
    return e != nullptr && readScalar(*out_, *e->value, e->place, row(key), quotedName(key), value);
}

bool SectionReader::read(std::string_view key, int& value) const {
    const YamlEntry* e = find(key);
    std::int64_t wide = 0;
    if (e == nullptr || !readScalar(*out_, *e->value, e->place, row(key), quotedName(key), wide))
        return false;
    value = static_cast<int>(wide);  // The table bounds every int key well within an int.
    return true;
}

bool SectionReader::read(std::string_view key, std::uint64_t& value) const {
    const YamlEntry* e = find(key);
    return e != nullptr && readScalar(*out_, *e->value, e->place, row(key), quotedName(key), value);
}

bool SectionReader::read(std::string_view key, bool& value) const {
    const YamlEntry* e = find(key);
    if (e == nullptr) return false;
    const YamlNode& node = *e->value;
    if (node.kind == YamlKind::Scalar && !node.quoted && (node.text == "true" || node.text == "false")) {
        value = node.text == "true";
        return true;
    }
    static const std::vector<std::string> yes{"yes", "Yes",  "YES",  "on", "On",
                                              "ON",  "True", "TRUE", "y",  "1"};
    static const std::vector<std::string> no{"no",  "No",    "NO",    "off", "Off",
                                             "OFF", "False", "FALSE", "n",   "0"};
    std::string suggestion;
    if (node.kind == YamlKind::Scalar) {
        if (std::find(yes.begin(), yes.end(), node.text) != yes.end()) suggestion = "write true";
        if (std::find(no.begin(), no.end(), node.text) != no.end()) suggestion = "write false";
        if (suggestion.empty()) suggestion = didYouMean(node.text, {"true", "false"});
    }
    out_->error(e->place, fmt::format("expected true or false for '{}', found {}", key, describeNode(node)),
                suggestion);
    return false;
}

bool SectionReader::read(std::string_view key, std::string& value) const {
    const YamlEntry* e = find(key);
    return e != nullptr && readText(*out_, *e->value, e->place, quotedName(key), value);
}

bool SectionReader::read(std::string_view key, Vec3d& value) const {
    std::vector<double> values;
    if (!read(key, values)) return false;
    value = {values[0], values[1], values[2]};
    return true;
}

bool SectionReader::read(std::string_view key, std::vector<double>& values) const {
    const YamlEntry* e = find(key);
    return e != nullptr && readNumbers(*out_, *e->value, e->place, row(key), quotedName(key), values);
}

bool SectionReader::read(std::string_view key, std::vector<int>& values) const {
    const YamlEntry* e = find(key);
    std::vector<std::int64_t> wide;
    if (e == nullptr ||
        !readMembers(*out_, *e->value, e->place, row(key), quotedName(key), "whole numbers", wide))
        return false;
    values.assign(wide.begin(), wide.end());
    return true;
}

bool SectionReader::readIndex(std::string_view key, std::size_t& index) const {
    const YamlEntry* e = find(key);
    return e != nullptr && readChoice(*out_, *e->value, e->place, row(key), quotedName(key), index);
}

bool SectionReader::readWord(std::string_view key, std::string& value) const {
    std::size_t index = 0;
    if (!readIndex(key, index)) return false;
    value = row(key).choices[index];
    return true;
}

std::optional<SectionReader> SectionReader::section(std::string_view key, std::string subject) const {
    const YamlEntry* e = find(key);
    if (e == nullptr) return std::nullopt;
    return SectionReader(*out_, *e->value, e->place, schemaSection(row(key).section), std::move(subject));
}

const YamlNode* SectionReader::list(std::string_view key) const {
    const YamlEntry* e = find(key);
    if (e == nullptr) return nullptr;
    if (e->value->kind == YamlKind::List) return e->value.get();
    expected(*out_, e->place, "a list", quotedName(key), *e->value);
    return nullptr;
}

const YamlNode* SectionReader::map(std::string_view key) const {
    const YamlEntry* e = find(key);
    if (e == nullptr) return nullptr;
    if (e->value->kind == YamlKind::Map) return e->value.get();
    expected(*out_, e->place, "a map", quotedName(key), *e->value);
    return nullptr;
}

std::optional<SectionReader> openVariant(Diagnostics& out, const YamlNode& node, const YamlPlace& place,
                                         std::string_view family, const std::string& subject) {
    const std::vector<const SectionSchema*> variants = schemaVariants(family);
    const bool by_type = variantByType(*variants.front());
    if (node.kind != YamlKind::Map) {
        expected(out, place, "a map", subject, node);
        return std::nullopt;
    }
    std::vector<std::string> words;
    for (const SectionSchema* v : variants) words.push_back(variantWord(*v));

    if (by_type) {
        const YamlEntry* type = node.find("type");
        if (type == nullptr) {
            for (const YamlEntry& entry : node.entries)
                if (nearestWord(entry.key, {"type"})) {
                    out.error(entry.key_place, fmt::format("unknown key '{}' in {}", entry.key, subject),
                              "did you mean 'type'?");
                    return std::nullopt;
                }
            out.error(place,
                      fmt::format("'type' is missing in {}: one of {}", subject, fmt::join(words, ", ")));
            return std::nullopt;
        }
        KeySchema any{.name = "type", .kind = ValueKind::Choice, .choices = words};
        std::size_t index = 0;
        if (!readChoice(out, *type->value, type->place, any, "'type'", index,
                        hintOfForeignWord(family, type->value->text)))
            return std::nullopt;
        return SectionReader(out, node, place, *variants[index], subject);
    }

    const SectionSchema* chosen = nullptr;
    for (const YamlEntry& entry : node.entries) {
        const auto word = std::find(words.begin(), words.end(), entry.key);
        if (word == words.end()) continue;
        const SectionSchema* here = variants[static_cast<std::size_t>(word - words.begin())];
        if (chosen != nullptr) {
            out.error(entry.key_place, fmt::format("'{}' and '{}' in {} exclude each other",
                                                   variantWord(*chosen), entry.key, subject));
            return std::nullopt;
        }
        chosen = here;
    }
    if (chosen != nullptr) return SectionReader(out, node, place, *chosen, subject);

    const std::string note = fmt::format("one of: {}", fmt::join(words, ", "));
    if (node.entries.empty()) {
        out.error(place, fmt::format("{} is an empty map", subject), {}, note);
        return std::nullopt;
    }
    const YamlEntry* odd = &node.entries.front();
    for (const YamlEntry& entry :
         node.entries)  // Blame the misspelt key, not a `scale` that happens to stand before it.
        if (nearestWord(entry.key, words)) odd = &entry;
    out.error(odd->key_place, fmt::format("unknown key '{}' in {}", odd->key, subject),
              didYouMean(odd->key, words), note);
    return std::nullopt;
}

constexpr std::size_t kUnusedShown = 20;

void UnusedNames::add(const std::string& name, const YamlPlace& place) {
    if (place.source != nullptr && place.source->included) return;
    if (++count_ > kUnusedShown) return;
    logWarning("{}: {} '{}' is not used", place.resolved().text(), one_, name);
}

void UnusedNames::finish() const {
    if (count_ > kUnusedShown) logWarning("{} more {} are not used", count_ - kUnusedShown, many_);
}

namespace {

/// `name` in the first of the folders that has it.
std::optional<std::string> locateIn(const std::vector<fs::path>& directories, const fs::path& wanted,
                                    const YamlPlace& place, Diagnostics& out) {
    std::error_code ec;
    for (const fs::path& directory : directories) {
        const fs::path path = directory / wanted;  // An absolute name replaces the directory.
        if (fs::is_directory(path, ec)) {
            out.error(place, fmt::format("'{}' is a directory", path.string()));
            return std::nullopt;
        }
        if (fs::exists(path, ec)) return plainPath(path);
    }
    if (wanted.is_absolute()) {
        out.error(place, fmt::format("there is no file '{}'", wanted.string()));
        return std::nullopt;
    }
    std::vector<std::string> tried, near;
    for (const fs::path& directory : directories) {
        tried.push_back(directory.string());
        addFileNames((directory / wanted).parent_path(), near);
    }
    out.error(place,
              fmt::format("cannot find '{}'; searched in {}", wanted.string(), fmt::join(tried, ", ")),
              didYouMean(wanted.filename().string(), near));
    return std::nullopt;
}

}  // namespace

std::string SceneFiles::directoryOf(const YamlPlace& place) const {
    const std::string& own =
        place.source != nullptr && !place.source->directory.empty() ? place.source->directory : directory_;
    return own.empty() ? "." : own;
}

std::optional<std::string> SceneFiles::locate(const std::string& name, const YamlPlace& place,
                                              Diagnostics& out) {
    const fs::path wanted(name);
    if (wanted.is_absolute()) return noted(locateIn({wanted.root_path()}, wanted, place, out), place);
    std::vector<fs::path> directories{directoryOf(place)};
    for (std::string& d : meshDirectories()) directories.emplace_back(std::move(d));
    return noted(locateIn(directories, wanted, place, out), place);
}

std::optional<std::string> SceneFiles::locateBeside(const std::string& name, const YamlPlace& place,
                                                    Diagnostics& out) {
    return noted(locateIn({directoryOf(place)}, name, place, out), place);
}

std::optional<std::string> SceneFiles::noted(std::optional<std::string> path, const YamlPlace& place) {
    if (path) located_[{place.source, place.line, place.column}] = *path;
    return path;
}

const std::string* SceneFiles::pathAt(const YamlPlace& place) const {
    const auto found = located_.find({place.source, place.line, place.column});
    return found == located_.end() ? nullptr : &found->second;
}

void SceneFiles::note(const std::string& path) {
    if (std::find(read_.begin(), read_.end(), path) == read_.end()) read_.push_back(path);
}

std::string sentenceWithPlace(const Error& error) {
    const std::string sentence = error.what();
    const SourcePlace& at = error.place();
    if (at.file.empty() || sentence.starts_with(at.file)) return sentence;
    return fmt::format("{}: {}", at.text(), sentence);
}

}  // namespace crt
