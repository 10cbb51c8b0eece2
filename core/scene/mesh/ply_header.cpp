#include "scene/mesh/ply_header.h"

#include "base/error.h"
#include "scene/mesh/obj_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <utility>

namespace crt {
namespace {

std::optional<PlyType> typeOf(std::string_view word) {
    static constexpr std::pair<std::string_view, PlyType> kTypes[] = {
        {"char", PlyType::Int8},      {"int8", PlyType::Int8},       {"uchar", PlyType::Uint8},
        {"uint8", PlyType::Uint8},    {"short", PlyType::Int16},     {"int16", PlyType::Int16},
        {"ushort", PlyType::Uint16},  {"uint16", PlyType::Uint16},   {"int", PlyType::Int32},
        {"int32", PlyType::Int32},    {"uint", PlyType::Uint32},     {"uint32", PlyType::Uint32},
        {"float", PlyType::Float32},  {"float32", PlyType::Float32}, {"double", PlyType::Float64},
        {"float64", PlyType::Float64}};
    for (const auto& [name, type] : kTypes)
        if (word == name) return type;
    return std::nullopt;
}

/// Names with blanks or '#' are none: fields end there.
class HeaderReader {
public:
    HeaderReader(std::string_view content, const std::string& path) : content_(content), path_(path) {}

    PlyHeader read() {
        const std::size_t end = content_.find_first_of("\r\n");
        // After the header of a binary file each byte counts, so one kind of line end holds throughout.
        two_ = content_.substr(std::min(end, content_.size()), 2) == "\r\n";
        header_.line_end = end != std::string_view::npos && !two_ ? content_[end] : '\n';
        (void)line();  // "ply"
        for (;;) {
            std::string_view rest = line();
            const std::string_view keyword = nextField(rest);
            if (keyword == "end_header") break;
            statement(keyword, trimmed(rest));
        }
        if (!format_) fail("the header of this PLY lacks the format");
        header_.bytes = at_;
        header_.lines = line_;
        return std::move(header_);
    }

private:
    static constexpr std::size_t kMost = 1000;  // Elements and properties are looked for by name.

    [[noreturn]] void fail(const std::string& sentence) const {
        throw Error(ErrorKind::Scene, sentence, {path_, line_});
    }

    std::string_view line() {
        ++line_;
        const std::size_t end = content_.find(header_.line_end, at_);
        if (end == std::string_view::npos)
            fail("the header of this PLY does not end: there is no end_header");
        const std::string_view line = content_.substr(at_, end - at_);
        at_ = end + 1;
        return trimmed(line);
    }

    void statement(std::string_view keyword, std::string_view rest) {
        constexpr std::string_view kTexture = "TextureFile";
        if (keyword == "comment") {
            if (rest.starts_with(kTexture))
                header_.textures.emplace_back(trimmed(rest.substr(kTexture.size())));
        } else if (keyword == "obj_info" || keyword.empty()) {
            return;
        } else if (keyword == "format") {
            format(rest);
        } else if (keyword == "element") {
            element(rest);
        } else if (keyword == "property") {
            property(rest);
        } else {
            fail(fmt::format("{} is not a statement of a PLY header", inQuotes(keyword)));
        }
    }

    void format(std::string_view rest) {
        const std::string_view word = nextField(rest), version = nextField(rest);
        if (word == "ascii")
            header_.format = PlyFormat::Ascii;
        else if (word == "binary_little_endian")
            header_.format = PlyFormat::LittleEndian;
        else if (word == "binary_big_endian")
            header_.format = PlyFormat::BigEndian;
        else
            fail(fmt::format(
                "the format of a PLY is ascii, binary_little_endian or binary_big_endian, not {}",
                inQuotes(word)));
        if (version != "1.0") fail(fmt::format("crt reads version 1.0 of PLY, not {}", inQuotes(version)));
        format_ = true;
    }

    void element(std::string_view rest) {
        PlyElement element;
        element.name = nextField(rest);
        element.line = line_;
        const std::string_view digits = nextField(rest);
        const auto [end, error] =
            std::from_chars(digits.data(), digits.data() + digits.size(), element.count);
        if (element.name.empty() || digits.empty() || error != std::errc() ||
            end != digits.data() + digits.size())
            fail("an element needs a name and a number: 'element vertex 8'");
        if (header_.find(element.name) != nullptr)
            fail(fmt::format("the element {} occurs twice", inQuotes(element.name)));
        if (header_.elements.size() == kMost) fail("more than a thousand elements");
        header_.elements.push_back(std::move(element));
    }

    PlyType type(std::string_view word) const {
        const std::optional<PlyType> known = typeOf(word);
        if (!known)
            fail(fmt::format("{} is not a PLY type (char, uchar, short, ushort, int, uint, float, double)",
                             inQuotes(word)));
        return *known;
    }

    void property(std::string_view rest) {
        if (header_.elements.empty()) fail("a property precedes the first element");
        PlyElement& element = header_.elements.back();
        std::string_view word = nextField(rest);
        std::optional<PlyType> count;
        if (word == "list") {
            count = type(nextField(rest));
            if (!isInteger(*count)) fail("the length of a list is an integer, not a float");
            word = nextField(rest);
        }
        const PlyType of = type(word);
        const std::string name(nextField(rest));
        if (name.empty()) fail("a property needs a type and a name: 'property float x'");
        if (element.find(name) != nullptr)
            fail(
                fmt::format("the property {} of {} occurs twice", inQuotes(name), inQuotes(element.name)));
        if (element.properties.size() == kMost) fail("an element with more than a thousand properties");
        element.properties.push_back({name, of, count});
    }

    std::string_view content_;
    const std::string& path_;
    PlyHeader header_;
    std::size_t at_ = 0;
    int line_ = 0;
    bool two_ = false, format_ = false;
};

}  // namespace

const PlyProperty* PlyElement::find(std::string_view property) const {
    const auto found = std::find_if(properties.begin(), properties.end(),
                                    [&](const PlyProperty& p) { return p.name == property; });
    return found == properties.end() ? nullptr : &*found;
}

std::uint64_t PlyElement::leastBytes() const {
    std::uint64_t bytes = 0;
    for (const PlyProperty& p : properties) bytes += bytesOf(p.count.value_or(p.type));
    return bytes;
}

bool PlyElement::hasLists() const {
    return std::any_of(properties.begin(), properties.end(),
                       [](const PlyProperty& p) { return p.count.has_value(); });
}

const PlyElement* PlyHeader::find(std::string_view element) const {
    const auto found = std::find_if(elements.begin(), elements.end(),
                                    [&](const PlyElement& e) { return e.name == element; });
    return found == elements.end() ? nullptr : &*found;
}

bool beginsAsPly(std::string_view content) {
    return content.starts_with("ply") && content.size() > 3 && (content[3] == '\n' || content[3] == '\r');
}

PlyHeader readPlyHeader(std::string_view content, const std::string& path) {
    return HeaderReader(content, path).read();
}

}  // namespace crt
