#include "cli/arguments.h"

#include "base/error.h"
#include "base/words.h"
#include "film/checkpoint.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string_view>

namespace crt {
namespace {

[[noreturn]] void refuse(const std::string& option, const char* expected, const std::string& text) {
    throw Error(ErrorKind::Usage, fmt::format("{} takes {}, not '{}'", option, expected, text));
}

bool endsWith(const std::string& text, std::string_view end) {
    return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// "option word" → "option=word" where the word ends in `extension`, else "option=otherwise": an option
/// whose value may be left out must not swallow what comes after it.
void giveValue(std::vector<std::string>& arguments, const char* option, std::string_view extension,
               const char* otherwise) {
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        if (arguments[i] == "--") break;
        if (arguments[i] != option) continue;
        if (i + 1 < arguments.size() && endsWith(arguments[i + 1], extension)) {
            arguments[i] += "=" + arguments[i + 1];
            arguments.erase(arguments.begin() + static_cast<std::ptrdiff_t>(i) + 1);
        } else {
            arguments[i] += fmt::format("={}", otherwise);
        }
    }
}

}  // namespace

std::uint64_t parseCount(const std::string& text, const std::string& option, std::uint64_t least) {
    const Parsed<std::uint64_t> number = parseUnsigned(text);
    if (!number.value || *number.value < least)
        refuse(option,
               least == 0 ? "a whole number" : fmt::format("a whole number of at least {}", least).c_str(),
               text);
    return *number.value;
}

double parseTolerance(const std::string& text, const std::string& option) {
    const Parsed<double> number = parseNumber(text);
    if (!number.value || *number.value < 0) refuse(option, "a number of at least 0", text);
    return *number.value;
}

double parseFraction(const std::string& text, const std::string& option) {
    const bool percent = !text.empty() && text.back() == '%';
    const Parsed<double> number = parseNumber(percent ? text.substr(0, text.size() - 1) : text);
    const double fraction = number.value ? *number.value * (percent ? 0.01 : 1) : 0;
    if (!(fraction > 0 && fraction < 1)) refuse(option, "an error such as 1% or 0.01", text);
    return fraction;
}

double parseDuration(const std::string& text, const std::string& option) {
    constexpr const char* kExpected = "a duration such as 90s, 30m, 2h or 1h30m";
    double seconds = 0;
    double last_unit = std::numeric_limits<double>::infinity();
    const char* at = text.data();
    const char* const end = at + text.size();
    do {
        double value = 0;
        const auto [after, error] = std::from_chars(at, end, value, std::chars_format::fixed);
        if (error != std::errc{} || !(value >= 0)) refuse(option, kExpected, text);
        const char* unit_end =
            std::find_if(after, end, [](char c) { return (c >= '0' && c <= '9') || c == '.'; });
        const std::string_view unit(after, static_cast<std::size_t>(unit_end - after));
        const double unit_seconds = unit == "h"                    ? 3600
                                    : unit == "m" || unit == "min" ? 60
                                    : unit == "s" || unit.empty()  ? 1
                                    : unit == "ms"                 ? 1e-3
                                                                   : 0;
        // Larger units first, and a number without a unit only alone: "1h30" could mean minutes or seconds.
        const bool alone = at == text.data() && unit_end == end;
        if (unit_seconds == 0 || unit_seconds >= last_unit || (unit.empty() && !alone))
            refuse(option, kExpected, text);
        seconds += value * unit_seconds;
        last_unit = unit_seconds;
        at = unit_end;
    } while (at != end);
    if (!(seconds > 0) || seconds > 1e9) refuse(option, kExpected, text);
    return seconds;
}

SampleRange parseSampleRange(const std::string& text, const std::string& option) {
    const std::vector<std::string> parts = splitAt(text, ':');
    const auto first = parseUnsigned(parts.front()), end = parseUnsigned(parts.back());
    if (parts.size() != 2 || !first.value || !end.value || *first.value >= *end.value)
        refuse(option, "the first sample and one past the last, such as 0:512", text);
    return {*first.value, *end.value};
}

std::array<int, 4> parseRectangle(const std::string& text, const std::string& option) {
    const std::vector<std::string> parts = splitAt(text, ',');
    std::array<int, 4> rectangle{};
    if (parts.size() != rectangle.size()) refuse(option, "four pixel numbers x0,y0,x1,y1", text);
    for (std::size_t i = 0; i < rectangle.size(); ++i) {
        const auto number = parseUnsigned(parts[i]);
        if (!number.value || *number.value > std::numeric_limits<int>::max())
            refuse(option, "four pixel numbers x0,y0,x1,y1", text);
        rectangle[i] = static_cast<int>(*number.value);
    }
    return rectangle;
}

std::vector<std::string> writtenOut(std::vector<std::string> arguments,
                                    const std::vector<std::string>& commands) {
    if (arguments.empty()) return arguments;
    const std::string first = arguments.front();
    const bool for_all = first == "-h" || first == "--help" || first == "--version";
    if (!for_all && std::find(commands.begin(), commands.end(), first) == commands.end()) {
        const std::filesystem::path path(first);
        std::error_code unreadable;
        // A word that is no file and does not look like one was meant as a command.
        const bool word = first[0] != '-' && !path.has_extension() && !path.has_parent_path() &&
                          !std::filesystem::exists(path, unreadable);
        if (word) {
            const std::string hint = didYouMean(first, commands);
            throw Error(ErrorKind::Usage, fmt::format("'{}' is neither a command nor a scene file{}", first,
                                                      hint.empty() ? "" : "; " + hint));
        }
        arguments.insert(arguments.begin(), "render");
    }
    if (arguments.front() == "render") giveValue(arguments, "--resume", kCheckpointExtension, "auto");
    if (arguments.front() == "compare") giveValue(arguments, "--json", ".json", "-");
    return arguments;
}

}  // namespace crt
