/// Lines, fields and numbers of OBJ and MTL files, which share their syntax.
#pragma once

#include "base/error.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace crt {

/// The whole of a file, as UTF-8 where it is UTF-16. Throws crt::Error(Scene) at `named_at` for one that
/// cannot be read or has more than `most_bytes`; `kind` is what the message calls it.
std::string readTextFile(const std::string& path, const char* kind, std::uint64_t most_bytes,
                         const SourcePlace& named_at);

/// Takes the next field off the front of `line`; empty at its end, which a comment makes too.
std::string_view nextField(std::string_view& line);

/// The text without the blanks at both ends.
std::string_view trimmed(std::string_view text);

/// A name in quotes, for messages; of a very long one the beginning.
std::string inQuotes(std::string_view name);

/// A field as a number, correctly rounded; what is too large for a double is infinite. Nothing for "1,5",
/// "-1.#IND00" and the like; "nan" and "inf" are read.
std::optional<double> numberOf(std::string_view field);

/// Logical lines of a text: the ends of lines may be those of any system, a backslash at the end joins a
/// line with the next.
class TextLines {
public:
    /// `text` must live as long as this. A mark of UTF-8 is left out where it is the start of its file.
    explicit TextLines(std::string_view text, bool start_of_file = true);

    /// Goes to the next line that is neither blank nor a comment; false at the end of the text.
    bool next();

    /// Bytes of the text that are still to come.
    std::size_t bytesLeft() const { return rest_.size(); }
    /// Lines that were read so far, blank ones and those joined to others among them.
    int linesTaken() const { return lines_taken_; }
    /// Of the current line, counted from 1; the first of those joined.
    int number() const { return number_; }
    /// Its first word.
    std::string_view keyword() const { return keyword_; }
    /// All that follows the keyword, without blanks at the ends.
    std::string_view arguments() const { return arguments_; }

private:
    std::string_view physicalLine();

    std::string_view rest_;
    std::string_view keyword_, arguments_;
    std::string joined_;
    int number_ = 0;
    int lines_taken_ = 0;
};

}  // namespace crt
