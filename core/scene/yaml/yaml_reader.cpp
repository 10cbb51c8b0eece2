// Over 450 lines: a tree and the excerpts of its text, which know the same places.
#include "scene/yaml/yaml_reader.h"

#include "base/words.h"
#include "scene/scene_limits.h"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <istream>
#include <iterator>
#include <streambuf>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace crt {
namespace {

constexpr std::size_t kMaxDepth = 64;  // A scene needs 8; the bound keeps every later recursion safe.
constexpr std::size_t kMaxErrorsShown = 50;
constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

bool isContinuationByte(char c) { return (static_cast<unsigned char>(c) & 0xc0u) == 0x80u; }

/// Number of characters (code points) in the first `bytes` bytes.
std::size_t characters(std::string_view text, std::size_t bytes) {
    text = text.substr(0, std::min(bytes, text.size()));
    return text.size() -
           static_cast<std::size_t>(std::count_if(text.begin(), text.end(), isContinuationByte));
}

// ---- The text itself ------------------------------------------------------------------------------------

/// Reports the first byte that cannot be in a text file. A picture or a mesh given by mistake ends here,
/// with its reason.
bool checkText(const YamlSource& source, std::string_view text, Diagnostics& out) {
    int line = 1, column = 1;
    for (std::size_t i = 0; i < text.size();) {
        const auto c = static_cast<unsigned char>(text[i]);
        const std::size_t length = utf8Length(text.substr(i));
        if (c == 0x7fu || (c < 0x20u && c != '\t' && c != '\n' && c != '\r') || length == 0) {
            out.error({&source, line, column, 1},
                      fmt::format("byte 0x{:02x} at offset {} is not text: a scene is a YAML file in UTF-8",
                                  c, i));
            return false;
        }
        column += static_cast<int>(length);
        if (c == '\n') ++line, column = 1;
        i += length;
    }
    return true;
}

/// A stream over memory that is already there; std::istringstream would copy a scene of hundreds of
/// megabytes.
class MemoryBuffer : public std::streambuf {
public:
    explicit MemoryBuffer(std::string_view text) {
        char* begin = const_cast<char*>(text.data());  // The get area is declared mutable but only read.
        setg(begin, begin, begin + text.size());
    }
};

// ---- Events → tree
// --------------------------------------------------------------------------------------

/// yaml-cpp blames what follows a tab, not the tab.
std::string tabHint(const YamlSource& source, int line) {
    if (line < 1 || static_cast<std::size_t>(line) > source.lines.size()) return {};
    const std::string& text = source.lines[static_cast<std::size_t>(line) - 1];
    const std::size_t first = text.find_first_not_of(' ');
    return first != std::string::npos && text[first] == '\t' ? "indent with spaces; YAML does not allow "
                                                               "tabs there"
                                                             : "";
}

/// Thrown out of yaml-cpp's parser when going on makes no sense; the error is already recorded.
struct StopParsing {};

class TreeBuilder final : public YAML::EventHandler {
public:
    TreeBuilder(const YamlSource& source, std::size_t text_bytes, Diagnostics& out, int first_column)
        : source_(source), out_(out), first_column_(first_column), limit_(text_bytes) {}

    YamlNodePtr root() const { return root_; }

    YamlPlace placeOf(const YAML::Mark& mark, std::size_t length = 1) const {
        if (mark.is_null()) return {&source_, 0, 0, 1};
        const int shift = mark.line == 0 ? first_column_ : 0;
        return {&source_, mark.line + 1, mark.column + 1 + shift,
                static_cast<int>(std::max<std::size_t>(length, 1))};
    }

    void OnDocumentStart(const YAML::Mark& mark) override {
        if (!root_) return;
        out_.error(placeOf(mark), "a second YAML document begins here; a scene is one document");
        throw StopParsing{};
    }
    void OnDocumentEnd() override {}

    void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
        auto node = make(YamlKind::Null, placeOf(mark));
        // An empty value has the mark of whatever comes next; its key is the better place.
        if (!stack_.empty() && stack_.back().key_pending) node->place = stack_.back().key_place;
        remember(anchor, node);
        attach(std::move(node), "an empty key");
    }

    void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  const std::string& value) override {
        const bool quoted = tag == "!";
        auto node = make(YamlKind::Scalar,
                         placeOf(mark, value.substr(0, value.find('\n')).size() + (quoted ? 2 : 0)));
        node->text = value;
        node->quoted = quoted;
        if (!quoted) refuseTag(tag, node->place);
        remember(anchor, node);
        attach(std::move(node), {});
    }

    void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
        const YamlPlace place = placeOf(mark);
        const auto found = anchors_.find(anchor);
        const bool cyclic = found != anchors_.end() && open_anchors_.contains(anchor);
        if (cyclic) out_.error(place, "this alias is inside its own value: a cycle has no end");
        if (found == anchors_.end() || cyclic) {
            auto node = make(YamlKind::Null, place);
            node->reported = cyclic;
            attach(std::move(node), "an alias as a key");
            return;
        }
        attach(found->second, "an alias as a key", place);
    }

    void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                         YAML::EmitterStyle::value) override {
        open(YamlKind::List, mark, tag, anchor);
    }
    void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                    YAML::EmitterStyle::value) override {
        open(YamlKind::Map, mark, tag, anchor);
    }
    void OnSequenceEnd() override { close(); }
    void OnMapEnd() override { close(); }

private:
    /// Finds a key among the entries of a map: in a few by looking, in many by hash.
    class KeyIndex {
    public:
        const YamlEntry* find(const std::vector<YamlEntry>& entries, std::string_view key) {
            constexpr std::size_t kFew = 16;
            if (entries.size() <= kFew) {
                const auto found = std::find_if(entries.begin(), entries.end(),
                                                [&](const YamlEntry& entry) { return entry.key == key; });
                return found != entries.end() ? &*found : nullptr;
            }
            for (; indexed_ < entries.size(); ++indexed_)
                by_hash_.emplace(hash(entries[indexed_].key), static_cast<std::uint32_t>(indexed_));
            const auto [first, end] = by_hash_.equal_range(hash(key));
            for (auto it = first; it != end; ++it)
                if (entries[it->second].key == key) return &entries[it->second];
            return nullptr;
        }

    private:
        static std::size_t hash(std::string_view key) { return std::hash<std::string_view>()(key); }

        std::size_t indexed_ = 0;
        std::unordered_multimap<std::size_t, std::uint32_t> by_hash_;
    };

    struct Frame {
        YamlNodePtr node;
        YAML::anchor_t anchor = 0;
        bool is_key = false;       // A list or map where a key should stand: read, then dropped.
        bool key_pending = false;  // Maps: the key is read, its value comes next.
        std::string key;
        YamlPlace key_place;
        bool key_bad = false;
        KeyIndex keys;
    };

    YamlNodePtr make(YamlKind kind, const YamlPlace& place) {
        ++written_;
        auto node = std::make_shared<YamlNode>();
        node->kind = kind;
        node->place = place;
        return node;
    }

    void remember(YAML::anchor_t anchor, const YamlNodePtr& node) {
        if (anchor != 0) anchors_[anchor] = node;
    }

    void refuseTag(const std::string& tag, const YamlPlace& place) {
        if (tag.empty() || tag == "?" || tag == "!") return;
        out_.error(place, fmt::format("a scene has no YAML tags; remove '{}'", tag));
    }

    bool expectsKey() const {
        return !stack_.empty() && stack_.back().node->kind == YamlKind::Map && !stack_.back().key_pending;
    }

    void open(YamlKind kind, const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor) {
        const YamlPlace place = placeOf(mark);
        if (stack_.size() >= kMaxDepth) {
            out_.error(place, fmt::format("nested more than {} levels deep", kMaxDepth));
            throw StopParsing{};
        }
        refuseTag(tag, place);
        Frame frame;
        frame.node = make(kind, place);
        frame.anchor = anchor;
        frame.is_key = expectsKey();
        remember(anchor, frame.node);
        if (anchor != 0) open_anchors_.insert(anchor);
        stack_.push_back(std::move(frame));
    }

    void close() {
        if (stack_.back().anchor != 0) open_anchors_.erase(stack_.back().anchor);
        YamlNodePtr node = std::move(stack_.back().node);
        stack_.pop_back();
        const bool list = node->kind == YamlKind::List;
        attach(std::move(node), list ? "a list as a key" : "a map as a key");
    }

    /// Puts a finished value where it belongs. `not_a_key` says what it would be if it stood in the place of
    /// a key.
    void attach(YamlNodePtr node, std::string_view not_a_key) {
        const YamlPlace place = node->place;
        attach(std::move(node), not_a_key, place);
    }
    void attach(YamlNodePtr node, std::string_view not_a_key, const YamlPlace& place) {
        if (stack_.empty()) {
            root_ = std::move(node);
            return;
        }
        Frame& frame = stack_.back();
        if (expectsKey()) {
            frame.key_pending = true;
            frame.key_place = place;
            frame.key_bad = true;
            if (!not_a_key.empty()) {
                out_.error(place, fmt::format("{} is not possible here: keys must be plain names",
                                              not_a_key));
                return;
            }
            frame.key = node->text;
            if (frame.key == "<<" && !node->quoted) {
                out_.error(place, "merge keys ('<<') are not part of a scene; write the keys out");
            } else if (const YamlEntry* same = frame.keys.find(frame.node->entries, frame.key)) {
                out_.error(place, fmt::format("duplicate key '{}', already given in line {}", frame.key,
                                              same->key_place.line));
            } else {
                frame.key_bad = false;
            }
            return;
        }
        grow(*frame.node, node->size, place);
        if (frame.node->kind == YamlKind::List) {
            frame.node->items.push_back(std::move(node));
            return;
        }
        frame.key_pending = false;
        if (!frame.key_bad)
            frame.node->entries.push_back({std::move(frame.key), frame.key_place, place, std::move(node)});
        frame.key.clear();
    }

    void grow(YamlNode& parent, std::uint64_t added, const YamlPlace& place) {
        // Stops "billion laughs" before anything walks them.
        parent.size += added;
        if (parent.size <= written_) return;
        const std::string why =
            limit_.refusal(parent.size - written_, "values behind aliases", kBytesPerAliasedValue);
        if (why.empty()) return;
        out_.error(place, why);
        throw StopParsing{};
    }

    const YamlSource& source_;
    Diagnostics& out_;
    int first_column_;
    ExpansionLimit limit_;
    std::uint64_t written_ = 0;  ///< Values in the text itself.
    YamlNodePtr root_;
    std::vector<Frame> stack_;
    std::unordered_map<YAML::anchor_t, YamlNodePtr> anchors_;
    std::unordered_set<YAML::anchor_t> open_anchors_;
};

// ---- Messages -------------------------------------------------------------------------------------------

/// The line with the caret below it. Long lines (tables, meshes) are cut to a window around the place.
std::string excerpt(const YamlPlace& place, const std::string& suggestion) {
    constexpr std::size_t kWindow = 100, kBefore = 60;
    const std::string& line = place.source->lines[static_cast<std::size_t>(place.line) - 1];
    const auto at = std::min(static_cast<std::size_t>(place.column) - 1, line.size());
    std::size_t begin = at > kBefore ? at - kBefore : 0;
    while (begin > 0 && isContinuationByte(line[begin])) --begin;
    std::size_t end = std::min(begin + kWindow, line.size());
    while (end < line.size() && isContinuationByte(line[end])) ++end;

    std::string shown = line.substr(begin, end - begin);
    std::replace(shown.begin(), shown.end(), '\t', ' ');
    const char* const before = begin > 0 ? "…" : "";
    const std::size_t indent = characters(shown, at - begin) + (begin > 0 ? 1 : 0);
    const std::size_t marked_end = std::min(at + static_cast<std::size_t>(place.length), end);
    const std::size_t marked =
        marked_end > at ? characters(std::string_view(line).substr(at), marked_end - at) : 1;

    const std::string number = place.source->command_line ? std::string() : std::to_string(place.line);
    return fmt::format("\n{:>5} | {}{}{}\n      | {:{}}^{:~<{}}{}{}", number, before, shown,
                       end < line.size() ? "…" : "", "", indent, "", marked > 0 ? marked - 1 : 0,
                       suggestion.empty() ? "" : " ", suggestion);
}

}  // namespace

YamlSource::YamlSource(std::string name_, std::string_view text, bool command_line_)
    : name(std::move(name_)), command_line(command_line_) {
    if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
    while (true) {
        const std::size_t end = text.find('\n');
        std::string_view line = text.substr(0, end);
        if (line.ends_with('\r')) line.remove_suffix(1);
        lines.emplace_back(line);
        if (end == std::string_view::npos) break;
        text.remove_prefix(end + 1);
    }
    for (std::size_t row = 0; row < lines.size(); ++row) {
        if (lines[row].size() <= kCounted) continue;
        std::vector<std::size_t>& counts = counts_[row];
        std::size_t before = 0;
        for (std::size_t at = 0; at <= lines[row].size(); at += kCounted) {
            counts.push_back(before);
            before += characters(std::string_view(lines[row]).substr(at), kCounted);
        }
    }
}

std::size_t YamlSource::charactersBefore(std::size_t row, std::size_t bytes) const {
    const std::string_view line = lines[row];
    const auto counted = counts_.find(row);
    if (counted == counts_.end()) return characters(line, bytes);
    const std::size_t part = std::min(bytes / kCounted, counted->second.size() - 1);
    return counted->second[part] + characters(line.substr(part * kCounted), bytes - part * kCounted);
}

SourcePlace YamlPlace::resolved() const {
    if (source == nullptr) return {};
    if (source->command_line || line <= 0) return {source->name, 0, 0};
    const auto row = static_cast<std::size_t>(line);
    if (row > source->lines.size()) return {source->name, line, column};
    return {source->name, line,
            static_cast<int>(source->charactersBefore(row - 1, static_cast<std::size_t>(column) - 1)) + 1};
}

const YamlEntry* YamlNode::find(std::string_view key) const {
    for (const YamlEntry& entry : entries)
        if (entry.key == key) return &entry;
    return nullptr;
}

void Diagnostics::error(const YamlPlace& place, std::string message, std::string suggestion,
                        std::string note) {
    // A named spectrum used twice is checked twice; say once what is wrong with it.
    for (const Entry& e : errors_)
        if (e.place.source == place.source && e.place.line == place.line && e.place.column == place.column &&
            e.message == message)
            return;
    // A mesh of a million NaNs needs no million messages: beyond the bound they are only counted.
    if (errors_.size() >= 4 * kMaxErrorsShown) {
        ++not_kept_;
        return;
    }
    errors_.push_back({place, std::move(message), std::move(suggestion), std::move(note)});
}

void Diagnostics::throwIfFailed() const {
    if (errors_.empty()) return;
    std::vector<const Entry*> order;
    for (const Entry& e : errors_) order.push_back(&e);
    std::stable_sort(order.begin(), order.end(), [](const Entry* a, const Entry* b) {
        const auto key = [](const Entry* e) {
            const YamlSource* source = e->place.source;
            return std::tuple(source != nullptr && source->command_line,
                              source != nullptr ? source->rank : 0, e->place.line, e->place.column);
        };
        return key(a) < key(b);
    });
    std::string text;
    for (std::size_t i = 0; i < order.size() && i < kMaxErrorsShown; ++i) {
        const Entry& e = *order[i];
        const SourcePlace at = e.place.resolved();
        if (i > 0) text += '\n';
        text += fmt::format("{}: error: {}", at.text(), e.message);
        const bool has_line = e.place.source != nullptr && e.place.line > 0 && e.place.column > 0 &&
                              static_cast<std::size_t>(e.place.line) <= e.place.source->lines.size();
        if (has_line)
            text += excerpt(e.place, e.suggestion);
        else if (!e.suggestion.empty())
            text += fmt::format(" ({})", e.suggestion);
        if (!e.note.empty()) text += fmt::format("\n      = {}", e.note);
    }
    if (order.size() > kMaxErrorsShown)
        text += fmt::format("\n… and {} more errors", count() - kMaxErrorsShown);
    throw Error(ErrorKind::Scene, text, order.front()->place.resolved());
}

YamlNodePtr readYaml(const YamlSource& source, std::string_view text, Diagnostics& out, int first_column) {
    if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
    if (!checkText(source, text, out)) return nullptr;
    MemoryBuffer buffer(text);
    std::istream stream(&buffer);
    TreeBuilder builder(source, text.size(), out, first_column);
    try {
        YAML::Parser parser(stream);
        while (parser.HandleNextDocument(builder)) {
        }
    } catch (const StopParsing&) {
        return nullptr;
    } catch (const YAML::Exception& e) {
        const YamlPlace place = builder.placeOf(e.mark);
        out.error(place, fmt::format("not valid YAML: {}", e.msg), tabHint(source, place.line));
        return nullptr;
    }
    return builder.root();
}

std::string describeNode(const YamlNode& node) {
    switch (node.kind) {
        case YamlKind::Null: return "nothing";
        case YamlKind::List: return fmt::format("a list of {}", node.items.size());
        case YamlKind::Map: return "a map";
        case YamlKind::Scalar: break;
    }
    constexpr std::size_t kLongest = 40;
    const std::string text = node.text.size() > kLongest ? node.text.substr(0, kLongest) + "…" : node.text;
    return node.quoted ? fmt::format("the text \"{}\"", text) : fmt::format("'{}'", text);
}

}  // namespace crt
