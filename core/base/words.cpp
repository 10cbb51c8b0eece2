#include "base/words.h"

#include "base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>
#include <type_traits>

namespace crt {
namespace {

std::string lowerCase(std::string_view text) {
    std::string lower(text);
    for (char& c : lower)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return lower;
}

/// Reason why `text` is not a decimal number, or nothing.
std::string notDecimal(const std::string& text) {
    std::string_view body = text;
    if (!body.empty() && (body.front() == '+' || body.front() == '-')) body.remove_prefix(1);
    const std::string lower = lowerCase(body);
    if (lower == "nan" || lower == ".nan" || lower == "inf" || lower == ".inf" || lower == "infinity")
        return "NaN and infinity have no place in a scene";
    if (lower.starts_with('+') || lower.starts_with('-')) return "it is not a number";
    if (lower.starts_with("0x") || lower.starts_with("0o") || lower.starts_with("0b"))
        return "write it in decimal";
    if (lower.size() > 1 && lower[0] == '0' && lower[1] >= '0' && lower[1] <= '9') {
        const std::size_t first = std::min(lower.find_first_not_of('0'), lower.size() - 1);
        return fmt::format("leading zeros mean octal to some YAML readers; write {}{}",
                           text[0] == '-' ? "-" : "", lower.substr(first));
    }
    // from_chars would take "inf" and "nan" in more spellings, so let only what can be in a decimal number
    // through.
    if (lower.empty() || lower.find_first_not_of("0123456789.e+-") != std::string::npos ||
        lower.find_first_of("0123456789") == std::string::npos)
        return "it is not a number";
    return {};
}

std::string_view withoutPlus(std::string_view text) {
    if (text.starts_with('+')) text.remove_prefix(1);
    return text;
}

template <class T>
Parsed<T> parseWhole(const std::string& text) {
    if (std::string problem = notDecimal(text); !problem.empty()) return {{}, std::move(problem)};
    const std::string_view body = withoutPlus(text);
    T value{};
    if (const auto [end, ec] = std::from_chars(body.data(), body.data() + body.size(), value);
        ec == std::errc{} && end == body.data() + body.size())
        return {value, {}};
    const Parsed<double> real = parseNumber(text);
    if (!real.value) return {{}, real.problem};
    if (*real.value != std::floor(*real.value)) return {{}, "it is not whole"};
    // Beyond 2^53 a double no longer says which whole number was meant; digits alone were handled above.
    if (*real.value < 0 && std::is_unsigned_v<T>) return {{}, "it is negative"};
    if (std::abs(*real.value) > 9007199254740992.0) return {{}, "it is too large"};
    return {static_cast<T>(*real.value), {}};
}

/// Damerau–Levenshtein distance with transpositions of neighbours (optimal string alignment).
std::size_t editDistance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), now(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        now[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            now[j] = std::min({last[j] + 1, now[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                now[j] = std::min(now[j], before[j - 2] + 1);
        }
        before.swap(last);
        last.swap(now);
    }
    return last[b.size()];
}

}  // namespace

Parsed<double> parseNumber(const std::string& text) {
    if (std::string problem = notDecimal(text); !problem.empty()) return {{}, std::move(problem)};
    const std::string_view body = withoutPlus(text);
    double value = 0;
    const auto [end, ec] = std::from_chars(body.data(), body.data() + body.size(), value);
    if (ec == std::errc::result_out_of_range) return {{}, "it is outside the range of a double"};
    if (ec != std::errc{} || end != body.data() + body.size()) return {{}, "it is not a number"};
    return {value, {}};
}

Parsed<std::int64_t> parseInteger(const std::string& text) { return parseWhole<std::int64_t>(text); }
Parsed<std::uint64_t> parseUnsigned(const std::string& text) { return parseWhole<std::uint64_t>(text); }

std::size_t utf8Length(std::string_view s) {
    const auto byte = [&](std::size_t i) { return i < s.size() ? static_cast<unsigned char>(s[i]) : 0u; };
    const auto tail = [&](std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < to; ++i)
            if ((byte(i) & 0xc0u) != 0x80u) return false;
        return true;
    };
    const unsigned a = byte(0), b = byte(1);
    if (a < 0x80u) return 1;
    if (a >= 0xc2u && a <= 0xdfu) return tail(1, 2) ? 2 : 0;
    if (a >= 0xe0u && a <= 0xefu) {
        const bool odd = (a == 0xe0u && b < 0xa0u) || (a == 0xedu && b > 0x9fu);
        return tail(1, 3) && !odd ? 3 : 0;
    }
    if (a >= 0xf0u && a <= 0xf4u) {
        const bool odd = (a == 0xf0u && b < 0x90u) || (a == 0xf4u && b > 0x8fu);
        return tail(1, 4) && !odd ? 4 : 0;
    }
    return 0;
}

std::string printable(std::string_view text) {
    // C0 and DEL, and C1, which UTF-8 writes in two bytes: terminals know U+009B as the start of a sequence.
    const auto isControl = [](std::string_view character) {
        const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(character[i]); };
        if (character.size() == 1) return byte(0) == 0x7fu || (byte(0) < 0x20u && byte(0) != '\n');
        return character.size() == 2 && byte(0) == 0xc2u && byte(1) < 0xa0u;
    };
    std::string clean;
    clean.reserve(text.size());
    while (!text.empty()) {
        const std::size_t length = utf8Length(text);
        const std::string_view character = text.substr(0, std::max<std::size_t>(length, 1));
        clean += length == 0 || isControl(character) ? std::string_view("\ufffd") : character;
        text.remove_prefix(character.size());
    }
    return clean;
}

bool looksLikeNumber(std::string_view text) {
    const Parsed<double> parsed = parseNumber(std::string(text));
    return parsed.value || parsed.problem != "it is not a number";
}

std::optional<std::string> nearestWord(std::string_view word, const std::vector<std::string>& candidates) {
    const std::string lower = lowerCase(word);
    const std::size_t limit = word.size() <= 3 ? 1 : std::max<std::size_t>(2, word.size() / 3);
    std::optional<std::string> best;
    std::size_t best_distance = limit + 1;
    for (const std::string& candidate : candidates) {
        if (candidate == word) continue;
        // Case counts less than any letter, so that 'gaussian' is found from 'Gaussian' and 'Au' from 'au'.
        const std::size_t distance = editDistance(lower, lowerCase(candidate));
        if (distance < best_distance && distance < std::max(word.size(), candidate.size())) {
            best = candidate;
            best_distance = distance;
        }
    }
    return best;
}

std::string didYouMean(std::string_view word, const std::vector<std::string>& candidates) {
    const std::optional<std::string> best = nearestWord(word, candidates);
    return best ? fmt::format("did you mean '{}'?", *best) : std::string();
}

std::vector<std::string> splitAt(const std::string& text, char separator) {
    std::vector<std::string> parts;
    for (std::size_t begin = 0;;) {
        const std::size_t end = text.find(separator, begin);
        parts.push_back(text.substr(begin, end - begin));
        if (end == std::string::npos) return parts;
        begin = end + 1;
    }
}

std::vector<std::string> parseList(const std::string& text, const std::string& option) {
    std::vector<std::string> words = splitAt(text, ',');
    for (const std::string& word : words)
        if (word.empty())
            throw Error(ErrorKind::Usage,
                        fmt::format("{} takes names separated by commas, such as cuda,embree, not '{}'",
                                    option, text));
    return words;
}

}  // namespace crt
