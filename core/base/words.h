/// Words and numbers as people type them: text → number, and the word that was probably meant.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

/// Result of reading a number from text: the number, or the reason why there is none.
template <class T>
struct Parsed {
    std::optional<T> value;
    std::string problem;  ///< Follows "expected a number, found '012': ".
};

/// Decimal numbers by std::from_chars: no octal or hexadecimal, no NaN, no infinity, no overflow.
Parsed<double> parseNumber(const std::string& text);
/// The same for whole numbers; 1e3 and 3.0 count as whole.
Parsed<std::int64_t> parseInteger(const std::string& text);
Parsed<std::uint64_t> parseUnsigned(const std::string& text);
/// Length of the valid UTF-8 sequence at the start of `text`, 0 when it is not one (overlong forms and
/// surrogates included).
std::size_t utf8Length(std::string_view text);

/// The text with U+FFFD in place of what is no UTF-8 and of control characters, ends of lines excepted.
/// Messages quote what files hold: a zero byte would end them, an escape sequence would act on the terminal.
std::string printable(std::string_view text);

/// Does this plain scalar look like a number (and so cannot be a name)?
bool looksLikeNumber(std::string_view text);

/// The parts between separators; one part where there is none.
std::vector<std::string> splitAt(const std::string& text, char separator);

/// "cuda,embree": words between commas, none of them empty. `option` stands in the message of the
/// crt::Error(Usage).
std::vector<std::string> parseList(const std::string& text, const std::string& option);

/// The candidate nearest to `word` by Damerau–Levenshtein distance, if it is within 2 or a third of the
/// length (1 for words of up to three letters).
std::optional<std::string> nearestWord(std::string_view word, const std::vector<std::string>& candidates);
/// "did you mean 'x'?" or nothing.
std::string didYouMean(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace crt
