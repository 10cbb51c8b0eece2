#include "cli/frames.h"

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/words.h"
#include "cli/arguments.h"

#include <fmt/format.h>
#include <muParser.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string_view>

namespace crt {
namespace {

constexpr std::int64_t kMostFrames = 1'000'000;

bool isNamePart(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

/// True if the name `frame` stands in it.
bool hasFrame(std::string_view text) {
    constexpr std::string_view kName = "frame";
    for (std::size_t at = text.find(kName); at != text.npos; at = text.find(kName, at + 1)) {
        const bool begins = at == 0 || !isNamePart(text[at - 1]);
        const std::size_t end = at + kName.size();
        if (begins && (end == text.size() || !isNamePart(text[end]))) return true;
    }
    return false;
}

double valueOf(const std::string& expression, std::int64_t frame, const std::string& path) {
    const auto refuse = [&](const std::string& why) {
        return Error(ErrorKind::Usage, fmt::format("--set {}: '{}' {}", path, expression, why));
    };
    double value = 0;
    try {
        mu::Parser parser;
        parser.DefineConst("pi", std::numbers::pi);
        parser.DefineConst("frame", static_cast<double>(frame));
        parser.SetExpr(expression);
        value = parser.Eval();
    } catch (const mu::Parser::exception_type& error) {
        std::string why = error.GetMsg();
        if (why.ends_with('.')) why.pop_back();
        throw refuse(
            fmt::format("is not an expression of 'frame': {}; a text with this word stands in quotes", why));
    }
    if (!std::isfinite(value)) throw refuse(fmt::format("is not a number in frame {}", frame));
    return value;
}

/// Length of what stands before the next part of a YAML value: to a quote, a bracket, a comma or the colon
/// of a key that are not in parentheses.
std::size_t lengthOfPart(std::string_view text) {
    int depth = 0;
    bool is_choice = false;  // "a ? b : c"
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '(') ++depth;
        if (c == ')') --depth;
        if (c == '?') is_choice = true;
        const bool ends_key = c == ':' && !is_choice && (i + 1 == text.size() || text[i + 1] == ' ');
        if (depth <= 0 && (std::string_view("[]{},'\"").find(c) != std::string_view::npos || ends_key))
            return i;
    }
    return text.size();
}

std::size_t lengthOfQuoted(std::string_view text) {
    const std::size_t end = text.find(text.front(), 1);
    return end == text.npos ? text.size() : end + 1;
}

std::string_view withoutBlanks(std::string_view text) {
    while (text.starts_with(' ')) text.remove_prefix(1);
    while (text.ends_with(' ')) text.remove_suffix(1);
    return text;
}

}  // namespace

FrameRange parseFrames(const std::string& text, const std::string& option) {
    const std::vector<std::string> parts = splitAt(text, ':');
    std::vector<std::int64_t> numbers;
    for (const std::string& part : parts)
        if (const Parsed<std::int64_t> number = parseInteger(part); number.value)
            numbers.push_back(*number.value);
    const bool whole = numbers.size() == parts.size() && (parts.size() == 2 || parts.size() == 3);
    FrameRange frames;
    if (whole) frames = {numbers[0], numbers[1], numbers.size() == 3 ? numbers[2] : 1};
    if (!whole || frames.first < 0 || frames.end <= frames.first || frames.step < 1 ||
        frames.end > kMostFrames)
        throw Error(
            ErrorKind::Usage,
            fmt::format("{} needs the first frame and one past the last, such as 0:24, or with a step "
                        "0:240:10, up to {}; found '{}'",
                        option, kMostFrames, text));
    return frames;
}

SceneOverride changeOfFrame(const SceneOverride& change, std::int64_t frame) {
    SceneOverride made{change.path, {}};
    std::string_view left = change.value;
    while (!left.empty()) {
        const bool quoted = left.front() == '\'' || left.front() == '"';
        // At least one character: a bracket or a comma stands for itself.
        const std::size_t length =
            quoted ? lengthOfQuoted(left) : std::max(lengthOfPart(left), std::size_t{1});
        const std::string_view part = left.substr(0, length);
        left.remove_prefix(length);
        if (!quoted && hasFrame(part))
            made.value += fmt::format("{}{}", part.substr(0, part.find_first_not_of(' ')),
                                      valueOf(std::string(withoutBlanks(part)), frame, change.path));
        else
            made.value += part;
    }
    return made;
}

std::string fileOfFrame(const std::string& name, std::int64_t frame) {
    if (isStandardOutput(name)) return name;
    constexpr std::size_t kUsualDigits = 4;
    const std::size_t last = name.find_last_of('#');
    if (last == name.npos) {
        const std::filesystem::path path(name);
        const std::string number = fmt::format(".{:0{}}", frame, kUsualDigits);
        return (path.parent_path() / (path.stem().string() + number + path.extension().string())).string();
    }
    std::size_t first = last;
    while (first > 0 && name[first - 1] == '#') --first;
    return name.substr(0, first) + fmt::format("{:0{}}", frame, last + 1 - first) + name.substr(last + 1);
}

}  // namespace crt
