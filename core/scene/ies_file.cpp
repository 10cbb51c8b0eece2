#include "scene/ies_file.h"

#include "base/error.h"
#include "base/input_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

namespace crt {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// The text line by line up to TILT, then number by number.
class IesText {
public:
    IesText(std::string_view text, const std::string& name) : text_(text), name_(name) {}

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

/// Reads over the labels. Returns what TILT is.
std::string_view tilt(IesText& text) {
    std::string_view line;
    constexpr std::string_view kTilt = "TILT=";
    constexpr int kMostLabels = 100'000;
    for (int i = 0; i < kMostLabels && text.nextLine(line); ++i) {
        const std::size_t begin = line.find_first_not_of(" \t");
        if (begin == std::string_view::npos || !line.substr(begin).starts_with(kTilt)) continue;
        line.remove_prefix(begin + kTilt.size());
        return line.substr(0, line.find_last_not_of(" \t") + 1);
    }
    text.fail("this is not an IES file: the line 'TILT=' is missing");
}

void requireIncreasing(const IesText& text, int line, const std::vector<double>& angles, const char* kind) {
    for (std::size_t i = 1; i < angles.size(); ++i)
        if (!(angles[i] > angles[i - 1]))
            text.failAt(line, fmt::format("{} angles must increase, but {} follows {}", kind, angles[i],
                                          angles[i - 1]));
}

void checkVertical(const IesText& text, int line, const std::vector<double>& angles) {
    requireIncreasing(text, line, angles, "vertical");
    const double first = angles.front(), last = angles.back();
    if ((first != 0 && first != 90) || (last != 90 && last != 180) || first == last)
        text.failAt(line, fmt::format("vertical angles go from {} to {}; photometry of type C has 0 to 90, "
                                      "0 to 180 or 90 to 180",
                                      first, last));
}

/// The columns of a file, by their horizontal angles.
struct Columns {
    std::vector<double> angles;
    std::vector<std::size_t> of;  ///< The column of the file for each of them.
};

/// Values that the file leaves out because it is symmetric.
Columns allRound(const IesText& text, int line, const std::vector<double>& angles) {
    requireIncreasing(text, line, angles, "horizontal");
    const double first = angles.front(), last = angles.back();
    Columns all;
    for (std::size_t i = 0; i < angles.size(); ++i) {
        all.angles.push_back(angles[i]);
        all.of.push_back(i);
    }
    // Adds the columns there are, mirrored in the last one.
    const auto mirror = [&all](double in) {
        for (std::size_t i = all.angles.size() - 1; i-- > 0;) {
            all.angles.push_back(2 * in - all.angles[i]);
            all.of.push_back(all.of[i]);
        }
    };
    if (first == 90 && last == 270) {
        // Symmetric in the plane of 90 and 270 degrees: what lies at φ also lies at 180 − φ.
        Columns turned;
        const auto add = [&](double angle, std::size_t column) {
            turned.angles.push_back(angle);
            turned.of.push_back(column);
        };
        for (std::size_t i = angles.size(); i-- > 0;)  // 0 to 90: from 180 to 90.
            if (angles[i] <= 180) add(180 - angles[i], i);
        const bool has_zero = turned.angles.front() == 0;
        for (std::size_t i = 1; i + 1 < angles.size(); ++i) add(angles[i], i);
        for (std::size_t i = angles.size(); i-- > 0;)  // 270 to 360: from 270 to 180.
            if (angles[i] >= 180) add(540 - angles[i], i);
        if (!has_zero)
            text.failAt(line, "horizontal angles from 90 to 270 degrees must have 180 among them");
        return turned;
    }
    if (first != 0 || (last != 0 && last != 90 && last != 180 && last != 360))
        text.failAt(line, fmt::format("horizontal angles go from {} to {}; photometry of type C has 0 "
                                      "alone, 0 to 90, 0 to 180, 90 to 270 or 0 to 360",
                                      first, last));
    if (last == 90) mirror(90);
    if (last == 90 || last == 180) mirror(180);
    return all;
}

/// ∫ (linear from a at x to b at y) sin θ dθ.
double ringIntegral(double x, double y, double a, double b) {
    const double slope = (b - a) / (y - x);
    // ∫ θ sin θ dθ = sin θ − θ cos θ.
    const double moment = (std::sin(y) - y * std::cos(y)) - (std::sin(x) - x * std::cos(x));
    return (a - slope * x) * (std::cos(x) - std::cos(y)) + slope * moment;
}

}  // namespace

IesProfile parseIes(std::string_view text_of_file, const std::string& name) {
    IesText text(text_of_file, name);
    const std::string_view how = tilt(text);
    if (how == "INCLUDE") {
        text.number("the lamp's position");
        const std::size_t angles = text.count("the number of tilt angles", kMostIesAngles);
        text.numbers(angles, "tilt angle");
        text.numbers(angles, "tilt factor");
    } else if (how != "NONE") {
        text.fail(fmt::format("TILT={} is not read; expected NONE or INCLUDE", how.substr(0, 40)));
    }
    text.number("the number of lamps");
    text.number("lumens per lamp");
    const double multiplier = text.number("the multiplier");
    const std::size_t vertical = text.count("the number of vertical angles", kMostIesAngles);
    const std::size_t horizontal = text.count("the number of horizontal angles", kMostIesAngles);
    const double type = text.number("the photometric type");
    if (type == 2 || type == 3)
        text.fail(fmt::format("photometry of type {} (goniometer turned about another axis) is not read; "
                              "only type C is, 1 here",
                              type == 2 ? 'B' : 'A'));
    if (type != 1) text.fail(fmt::format("the photometric type is {}; it must be 1, 2 or 3", type));
    text.number("the units type");
    for (const char* what : {"the width", "the length", "the height"}) text.number(what);
    const double ballast = text.number("the ballast factor");
    const double ballast_lamp = text.number("the ballast-lamp factor");
    text.number("the input watts");
    const double factor = multiplier * ballast * ballast_lamp;
    if (!(multiplier > 0 && ballast > 0 && ballast_lamp > 0) || !std::isfinite(factor))
        text.fail(fmt::format("multiplier and ballast factors are {}, {} and {}; they must be above 0",
                              multiplier, ballast, ballast_lamp));
    if (vertical < 2) text.fail("there is one vertical angle; a distribution has two or more");

    IesProfile profile;
    profile.vertical_deg = text.numbers(vertical, "vertical angle");
    checkVertical(text, text.line(), profile.vertical_deg);
    const std::vector<double> planes = text.numbers(horizontal, "horizontal angle");
    const Columns columns = allRound(text, text.line(), planes);
    if (columns.angles.size() * vertical > kMostIesValues)
        text.fail(fmt::format("{} × {} values, written out, are more than {}", columns.angles.size(),
                              vertical, kMostIesValues));
    std::vector<double> measured(horizontal * vertical);
    for (std::size_t i = 0; i < measured.size(); ++i) {
        measured[i] = factor * text.number("a candela value");
        if (!(measured[i] >= 0) || !std::isfinite(measured[i]))
            text.fail(fmt::format("a candela value is {}; it must be 0 or more", measured[i]));
    }
    if (!text.atEnd()) text.fail("the file continues after the last candela value; is a count too small?");
    profile.horizontal_deg = columns.angles;
    for (const std::size_t column : columns.of)
        profile.candela.insert(profile.candela.end(),
                               measured.begin() + static_cast<std::ptrdiff_t>(column * vertical),
                               measured.begin() + static_cast<std::ptrdiff_t>((column + 1) * vertical));
    return profile;
}

IesProfile readIesFile(const std::string& path) {
    try {
        return parseIes(readInput(path, kMostIesBytes), path);
    } catch (const InputRefused& refused) {
        throw Error(ErrorKind::Scene, fmt::format("'{}' {}", path, refused.what()), {path});
    }
}

double luminousFlux_lm(const IesProfile& profile) {
    const std::vector<double>& vertical = profile.vertical_deg;
    const auto ring = [&](std::size_t column) {
        double sum = 0;
        const double* candela = &profile.candela[column * vertical.size()];
        for (std::size_t v = 0; v + 1 < vertical.size(); ++v)
            sum += ringIntegral(vertical[v] * kDegree, vertical[v + 1] * kDegree, candela[v],
                                candela[v + 1]);
        return sum;
    };
    const std::vector<double>& horizontal = profile.horizontal_deg;
    if (horizontal.size() == 1) return 2 * std::numbers::pi * ring(0);
    double flux = 0;
    for (std::size_t h = 0; h + 1 < horizontal.size(); ++h)
        flux += (horizontal[h + 1] - horizontal[h]) * kDegree * 0.5 * (ring(h) + ring(h + 1));
    return flux;
}

}  // namespace crt
