/// A YAML map read against its section of the schema: the ground that all parts of the scene reader stand
/// on. Errors go to Diagnostics and the value keeps its default, so reading always continues.
#pragma once

#include "base/error.h"
#include "scene/yaml/scene_schema.h"
#include "scene/yaml/yaml_reader.h"
#include "spectra/spectra.h"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

namespace crt {

/// Single values against their row of the table. `what` names the value in messages: "'fov'", "component 2
/// of 'up'".
bool readScalar(Diagnostics& out, const YamlNode& node, const YamlPlace& place, const KeySchema& key,
                const std::string& what, double& value);
bool readScalar(Diagnostics& out, const YamlNode& node, const YamlPlace& place, const KeySchema& key,
                const std::string& what, std::int64_t& value);
bool readScalar(Diagnostics& out, const YamlNode& node, const YamlPlace& place, const KeySchema& key,
                const std::string& what, std::uint64_t& value);
bool readText(Diagnostics& out, const YamlNode& node, const YamlPlace& place, const std::string& what,
              std::string& value);
/// Index into key.choices. `hint` goes before the nearest of them.
bool readChoice(Diagnostics& out, const YamlNode& node, const YamlPlace& place, const KeySchema& key,
                const std::string& what, std::size_t& value, const std::string& hint = {});
/// A list of numbers with key.count_min to key.count_max members.
bool readNumbers(Diagnostics& out, const YamlNode& node, const YamlPlace& place, const KeySchema& key,
                 const std::string& what, std::vector<double>& values);

/// One map. Checks its keys when made; the read functions then leave their target alone unless the key is
/// there and right.
class SectionReader {
public:
    /// `subject` is what messages call this map: "film", "material 'white'".
    SectionReader(Diagnostics& out, const YamlNode& node, const YamlPlace& place,
                  const SectionSchema& schema, std::string subject);

    Diagnostics& diagnostics() const { return *out_; }
    const SectionSchema& schema() const { return *schema_; }
    const std::string& subject() const { return subject_; }
    /// Of the map itself.
    const YamlPlace& place() const { return place_; }
    /// Of the value of `key`, or of the map when it is not there.
    YamlPlace place(std::string_view key) const;

    /// The key with its value, unless it is absent or a permitted `null`.
    const YamlEntry* find(std::string_view key) const;
    bool has(std::string_view key) const { return find(key) != nullptr; }

    bool read(std::string_view key, double& value) const;
    bool read(std::string_view key, int& value) const;
    bool read(std::string_view key, std::uint64_t& value) const;
    bool read(std::string_view key, bool& value) const;
    bool read(std::string_view key, std::string& value) const;
    bool read(std::string_view key, Vec3d& value) const;
    bool read(std::string_view key, std::vector<double>& values) const;
    bool read(std::string_view key, std::vector<int>& values) const;
    /// The choices of the table are in the order of the enumeration.
    template <class Enum>
    bool readEnum(std::string_view key, Enum& value) const {
        std::size_t index = 0;
        if (!readIndex(key, index)) return false;
        value = static_cast<Enum>(index);
        return true;
    }
    /// The word of a choice.
    bool readWord(std::string_view key, std::string& value) const;
    /// The map under `key`, as the section that the table names.
    std::optional<SectionReader> section(std::string_view key, std::string subject) const;
    /// The items under `key`; null, with an error, when it is not a list. Null without error when it is
    /// absent.
    const YamlNode* list(std::string_view key) const;
    const YamlNode* map(std::string_view key) const;

    void error(std::string_view key, std::string message, std::string suggestion = {},
               std::string note = {}) const;

private:
    bool readIndex(std::string_view key, std::size_t& index) const;
    const KeySchema& row(std::string_view key) const;
    void checkKeys() const;
    void checkRules() const;

    Diagnostics* out_;
    const YamlNode* node_;
    YamlPlace place_;
    const SectionSchema* schema_;
    std::string subject_;
};

/// Reads a map as whichever of the sections "family/…" it turns out to be; nothing, with an error, when it
/// is none.
std::optional<SectionReader> openVariant(Diagnostics& out, const YamlNode& node, const YamlPlace& place,
                                         std::string_view family, const std::string& subject);

/// "expected …, found …" at a place, and what to write instead where that is known.
void expected(Diagnostics& out, const YamlPlace& place, std::string_view wanted, const std::string& what,
              const YamlNode& node, std::string hint = {});

/// Warns about names that nothing uses: the first by name and place, the others by their number. Not about
/// those of included files, which are made to be chosen from.
class UnusedNames {
public:
    UnusedNames(std::string one, std::string many) : one_(std::move(one)), many_(std::move(many)) {}
    void add(const std::string& name, const YamlPlace& place);
    void finish() const;

private:
    std::string one_, many_;
    std::size_t count_ = 0;
};

/// The files a scene names: where they are looked for, and which were read.
class SceneFiles {
public:
    explicit SceneFiles(std::string directory) : directory_(std::move(directory)) {}

    /// The path of a readable file: beside the file that names it, then in the mesh directories. Reports an
    /// error at `place` when there is none.
    std::optional<std::string> locate(const std::string& name, const YamlPlace& place, Diagnostics& out);
    /// The same of a file that can only be beside the one that names it.
    std::optional<std::string> locateBeside(const std::string& name, const YamlPlace& place,
                                            Diagnostics& out);
    /// The file that was found for the name at `place`; null if none was searched for.
    const std::string* pathAt(const YamlPlace& place) const;
    /// Notes that a file went into the scene; every file once.
    void note(const std::string& path);
    const std::vector<std::string>& read() const { return read_; }

private:
    /// By source, line and column of the name.
    using Located = std::map<std::tuple<const YamlSource*, int, int>, std::string>;

    std::string directoryOf(const YamlPlace& place) const;
    std::optional<std::string> noted(std::optional<std::string> path, const YamlPlace& place);

    std::string directory_;
    std::vector<std::string> read_;
    Located located_;
};

/// The sentence of an error from a file reader, led by the file's own line where that is known.
std::string sentenceWithPlace(const Error& error);

}  // namespace crt
