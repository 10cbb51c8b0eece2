/// The text and the angles of photometric files, for their readers.
#pragma once

#include "base/error.h"
#include "scene/ies_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

namespace crt {

/// A text line by line, or number by number.
class PhotometricText {
public:
    PhotometricText(std::string_view text, const std::string& name) : text_(text), name_(name) {}

    [[noreturn]] void fail(const std::string& what) const { failAt(line_, what); }
    [[noreturn]] void failAt(int line, const std::string& what) const {
        throw Error(ErrorKind::Scene, what, {name_, line, 0});
    }

    /// Without its end; false at the end of the file.
    bool nextLine(std::string_view& line) {
        if (at_ >= text_.size()) return false;
        const std::size_t end = std::min(text_.find_first_of("\r\n", at_), text_.size());
        line = text_.substr(at_, end - at_);
        at_ = end;
        if (text_.substr(at_, 2) == "\r\n")
            at_ += 2;
        else if (at_ < text_.size())
            at_ += 1;
        ++line_;
        return true;
    }

    /// The next number; `what` as in messages.
    double number(const std::string& what) {
        const std::string_view word = nextWord();
        if (word.empty()) fail(fmt::format("the file ends where {} should stand", what));
        double value = 0;
        const std::size_t sign = word.front() == '+' ? 1 : 0;  // A sign that from_chars does not accept.
        const auto [end, problem] = std::from_chars(word.data() + sign, word.data() + word.size(), value);
        if (problem != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
            fail(fmt::format("expected {}, a number, found '{}'", what, shown(word)));
        return value;
    }

    std::size_t count(const std::string& what, std::size_t most) {
        const double value = number(what);
        if (!(value >= 1 && value <= static_cast<double>(most)) || value != std::floor(value))
            fail(fmt::format("{} is {}; it must be a whole number from 1 to {}", what, value, most));
        return static_cast<std::size_t>(value);
    }

    std::vector<double> numbers(std::size_t how_many, const std::string& what) {
        // A number takes two bytes at least: a count that the file cannot hold takes no memory.
        if (how_many > (rest_.size() + text_.size() - at_) / 2 + 1)
            fail(fmt::format("the file is too short for {} {}s", how_many, what));
        std::vector<double> all(how_many);
        for (std::size_t i = 0; i < how_many; ++i)
            all[i] = number(fmt::format("{} {} of {}", what, i + 1, how_many));
        return all;
    }

    int line() const { return line_; }
    bool atEnd() { return nextWord().empty(); }

private:
    static bool isBetween(char c) { return c == ' ' || c == '\t' || c == ',' || c == '\0'; }

    std::string_view nextWord() {
        while (rest_.empty()) {
            if (!nextLine(rest_)) return {};
            skip();
        }
        const auto* end = std::find_if(rest_.begin(), rest_.end(), isBetween);
        const auto length = static_cast<std::size_t>(end - rest_.begin());
        const std::string_view word = rest_.substr(0, length);
        rest_.remove_prefix(length);
        skip();
        return word;
    }
    void skip() {
        while (!rest_.empty() && isBetween(rest_.front())) rest_.remove_prefix(1);
    }
    static std::string shown(std::string_view word) {
        std::string text(word.substr(0, 40));
        for (char& c : text)
            if (c < ' ' || c > '~') c = '?';
        return text;
    }

    std::string_view text_, rest_;
    std::string name_;
    std::size_t at_ = 0;
    int line_ = 0;
};

/// The columns of a file, by their horizontal angles.
struct PhotometricColumns {
    std::vector<double> angles;
    std::vector<std::size_t> of;  ///< The column of the file for each of them.
};

/// Throw crt::Error(Scene), at `line`, for angles that photometry of type C does not have.
void checkVertical(const PhotometricText& text, int line, const std::vector<double>& angles);
/// All round: adds what the file leaves out because it is symmetric.
PhotometricColumns allRound(const PhotometricText& text, int line, const std::vector<double>& angles);

/// The columns of `measured`, one after the other, into a profile that has its vertical angles.
void spread(const PhotometricColumns& columns, const std::vector<double>& measured, IesProfile& profile);

}  // namespace crt
