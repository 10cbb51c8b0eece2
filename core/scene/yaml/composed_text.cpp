#include "scene/yaml/composed_text.h"

#include "base/input_file.h"
#include "base/words.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>

namespace crt {
namespace {

std::string quoted(const std::string& text) { return nlohmann::json(text).dump(); }

/// YAML has more forms of a number than JSON, such as `+1` and `.5`.
std::string numberText(const std::string& text) {
    if (nlohmann::json::accept(text)) return text;
    if (const Parsed<std::int64_t> whole = parseInteger(text); whole.value)
        return fmt::format("{}", *whole.value);
    const Parsed<double> number = parseNumber(text);
    return number.value ? fmt::format("{}", *number.value) : quoted(text);
}

class TextWriter {
public:
    explicit TextWriter(const SceneFiles& files) : files_(files) {}

    /// `place` is where the text has this value, which an alias may have elsewhere too.
    void write(const YamlNode& node, const YamlPlace& place) {
        switch (node.kind) {
            case YamlKind::Null: text_ += "null"; return;
            case YamlKind::Scalar: text_ += scalar(node, place); return;
            case YamlKind::List: return list(node);
            case YamlKind::Map: return map(node);
        }
    }
    std::string take() { return std::move(text_); }

private:
    std::string scalar(const YamlNode& node, const YamlPlace& place) const {
        if (const std::string* path = files_.pathAt(place))
            return quoted(plainPath(std::filesystem::absolute(*path)));
        if (node.quoted) return quoted(node.text);
        if (node.text == "true" || node.text == "false") return node.text;
        return looksLikeNumber(node.text) ? numberText(node.text) : quoted(node.text);
    }

    void list(const YamlNode& node) {
        const char* before = "[";
        for (const YamlNodePtr& item : node.items) {
            text_ += std::exchange(before, ", ");
            write(*item, item->place);
        }
        text_ += node.items.empty() ? "[]" : "]";
    }

    void map(const YamlNode& node) {
        const char* before = "{";
        for (const YamlEntry& entry : node.entries) {
            text_ += std::exchange(before, ", ");
            text_ += quoted(entry.key) + ": ";
            write(*entry.value, entry.place);
        }
        text_ += node.entries.empty() ? "{}" : "}";
    }

    const SceneFiles& files_;
    std::string text_;
};

}  // namespace

std::string composedText(const YamlNode& root, const SceneFiles& files) {
    TextWriter writer(files);
    writer.write(root, root.place);
    return writer.take();
}

}  // namespace crt
