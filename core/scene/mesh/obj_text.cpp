#include "scene/mesh/obj_text.h"

#include "base/input_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <limits>

namespace crt {
namespace {

bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

/// UTF-16 with its mark of order as UTF-8. Surrogates stay apart: they stand in names at most, and the same
/// name gives the same bytes.
std::string fromUtf16(std::string_view text) {
    const bool big_endian = text.starts_with("\xFE\xFF");
    std::string utf8;
    for (std::size_t i = 2; i + 1 < text.size(); i += 2) {
        const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[i + k]); };
        const unsigned unit = big_endian ? byte(0) * 256u + byte(1) : byte(1) * 256u + byte(0);
        const auto put = [&](unsigned bits) { utf8 += static_cast<char>(bits); };
        if (unit < 0x80) {
            put(unit);
        } else if (unit < 0x800) {
            put(0xC0 | unit >> 6), put(0x80 | (unit & 0x3F));
        } else {
            put(0xE0 | unit >> 12), put(0x80 | (unit >> 6 & 0x3F)), put(0x80 | (unit & 0x3F));
        }
    }
    return utf8;
}

}  // namespace

std::string readTextFile(const std::string& path, const char* kind, std::uint64_t most_bytes,
                         const SourcePlace& named_at) {
    try {
        std::string text = readInput(path, most_bytes);
        return text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF") ? fromUtf16(text) : text;
    } catch (const InputRefused& refused) {
        throw Error(ErrorKind::Scene, fmt::format("{} '{}' {}", kind, path, refused.what()), named_at);
    }
}

std::string_view nextField(std::string_view& line) {
    const char *at = line.data(), *const end = at + line.size();
    while (at != end && isBlank(*at)) ++at;
    if (at != end && *at == '#') at = end;
    const char* const first = at;
    while (at != end && !isBlank(*at)) ++at;
    line = {at, static_cast<std::size_t>(end - at)};
    return {first, static_cast<std::size_t>(at - first)};
}

std::string_view trimmed(std::string_view text) {
    const auto isEdge = [](char c) { return isBlank(c) || c == '\r'; };
    while (!text.empty() && isEdge(text.back())) text.remove_suffix(1);
    while (!text.empty() && isEdge(text.front())) text.remove_prefix(1);
    return text;
}

std::string inQuotes(std::string_view name) {
    constexpr std::size_t kLongest = 120;
    return name.size() <= kLongest ? fmt::format("'{}'", name)
                                   : fmt::format("'{}…'", name.substr(0, kLongest));
}

std::optional<double> numberOf(std::string_view field) {
    const std::string_view digits = field.substr(field.starts_with('+') ? 1 : 0);
    double number = 0.0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (end != digits.data() + digits.size() || error == std::errc::invalid_argument) return std::nullopt;
    // Beyond a double: with a negative exponent that is zero, else infinite.
    if (error == std::errc::result_out_of_range)
        return digits.find('-', 1) != std::string_view::npos ? 0.0 : std::numeric_limits<double>::infinity();
    return number;
}

TextLines::TextLines(std::string_view text, bool start_of_file) : rest_(text) {
    if (start_of_file && rest_.starts_with("\xEF\xBB\xBF")) rest_.remove_prefix(3);
}

/// Takes one line of the file off the text.
std::string_view TextLines::physicalLine() {
    std::size_t end = 0;
    while (end < rest_.size() && rest_[end] != '\n' && rest_[end] != '\r') ++end;
    const std::string_view line = trimmed(rest_.substr(0, end));
    rest_.remove_prefix(end);
    rest_.remove_prefix(rest_.starts_with("\r\n") ? 2 : std::min<std::size_t>(1, rest_.size()));
    ++lines_taken_;
    return line;
}

bool TextLines::next() {
    while (!rest_.empty()) {
        number_ = lines_taken_ + 1;
        std::string_view line = physicalLine();
        if (line.empty() || line.starts_with('#')) continue;
        if (line.ends_with('\\')) {
            joined_.clear();
            for (bool more = true; more; line = more ? physicalLine() : line) {
                more = line.ends_with('\\') && !rest_.empty();
                joined_ += line.substr(0, line.size() - (line.ends_with('\\') ? 1 : 0));
                joined_ += ' ';
            }
            line = trimmed(joined_);
        }
        keyword_ = line.substr(
            0, static_cast<std::size_t>(std::find_if(line.begin(), line.end(), isBlank) - line.begin()));
        arguments_ = trimmed(line.substr(keyword_.size()));
        if (!keyword_.empty()) return true;
    }
    return false;
}

}  // namespace crt
