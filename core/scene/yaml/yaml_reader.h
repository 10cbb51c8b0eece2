/// The safe walk of yaml-cpp: text → a tree of our own that keeps the place of every key and value, and
/// the list of everything found wrong on the way.
///
/// yaml-cpp 0.7's Node silently keeps duplicate keys, reads 012 as ten, refuses 1e3 as an integer, calls
/// `no` a boolean and lets an alias close a cycle. So only its events are used here; text becomes numbers in
/// scalar functions below and nowhere else.
#pragma once

#include "base/words.h"

#include "base/error.h"

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

/// A text that messages point into: a scene file, or one `--set` argument.
struct YamlSource {
    YamlSource(std::string name_, std::string_view text, bool command_line_ = false);

    std::string name;  ///< Path of the file, or "--set film.resolution".
    /// In characters of UTF-8: those of the first `bytes` bytes of lines[row].
    std::size_t charactersBefore(std::size_t row, std::size_t bytes) const;

    std::vector<std::string> lines;
    bool command_line = false;  ///< One line, so messages leave line and column out.
    bool included = false;      ///< By a scene, in which not all of it need be used.
    int rank = 0;               ///< Messages come in this order: the scene itself, then what it includes.
    std::string directory{};    ///< The folder for relative names in it; empty: that of the scene.

private:
    /// Of long lines, which programs write: characters before every kCounted-th byte.
    static constexpr std::size_t kCounted = 4096;
    std::map<std::size_t, std::vector<std::size_t>> counts_;
};

/// A stretch of a source. Counts from 1, columns in bytes; line 0 means the source as a whole.
struct YamlPlace {
    const YamlSource* source = nullptr;
    int line = 0;
    int column = 0;
    int length = 1;

    /// The same with the column in characters, as editors count.
    SourcePlace resolved() const;
};

enum class YamlKind { Null, Scalar, List, Map };

struct YamlNode;
using YamlNodePtr = std::shared_ptr<YamlNode>;

struct YamlEntry {
    std::string key;
    YamlPlace key_place;
    YamlPlace place;  ///< Of the value; kept here because an alias puts one node in several places.
    YamlNodePtr value;
};

/// One value of the tree. Aliases share nodes, never in a cycle.
struct YamlNode {
    YamlKind kind = YamlKind::Null;
    YamlPlace place;
    std::string text;     ///< Scalars.
    bool reported =
        false;            ///< A cycle stood here: an error already, so what is missing now is no second one.
    bool quoted = false;  ///< Scalars written with quotes are text whatever they look like.
    std::vector<YamlNodePtr> items;   ///< Lists.
    std::vector<YamlEntry> entries;   ///< Maps, in the order of the file, without duplicates.
    std::uint64_t size = 1;  ///< Nodes below and including this one with aliases written out.

    const YamlEntry* find(std::string_view key) const;
};

/// Everything wrong with one scene. Reading goes on after an error so that one run shows them all.
class Diagnostics {
public:
    /// `suggestion` ends the caret line ("did you mean 'reflectance'?"), `note` stands below it ("keys of
    /// …").
    void error(const YamlPlace& place, std::string message, std::string suggestion = {},
               std::string note = {});
    bool failed() const { return !errors_.empty(); }
    std::size_t count() const { return errors_.size() + not_kept_; }
    /// True if the nearest of this number of names should be searched: the first errors get a suggestion,
    /// however many names there are, but not a hundred thousand errors over a hundred thousand names.
    bool worthSuggesting(std::size_t names) const { return count() * names <= 200'000; }
    /// Throws crt::Error(Scene) with all errors in the order of the text, if there are any.
    void throwIfFailed() const;

private:
    struct Entry {
        YamlPlace place;
        std::string message, suggestion, note;
    };
    std::vector<Entry> errors_;
    std::size_t not_kept_ = 0;
};

/// Parses one YAML document. Syntax errors, binary data, duplicate keys, merge keys, tags, cycles and depth
/// go to `out`. Null when nothing usable is there. `text` begins at byte `first_column` (from 0) of the
/// source's first line.
YamlNodePtr readYaml(const YamlSource& source, std::string_view text, Diagnostics& out,
                     int first_column = 0);

/// "a number", "a list": what a node is, for "expected …, found …".
std::string describeNode(const YamlNode& node);

}  // namespace crt
