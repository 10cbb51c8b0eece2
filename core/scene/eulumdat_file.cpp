#include "scene/eulumdat_file.h"

#include "base/log.h"
#include "scene/photometric_text.h"

#include <array>
#include <cstdlib>

namespace crt {
namespace {

/// A text line by line: each holds a value.
class Lines {
public:
    Lines(std::string_view text, const std::string& name) : text_(text, name) {}

    const PhotometricText& text() const { return text_; }

    void skip(int lines, const char* what) {
        for (int i = 0; i < lines; ++i) next(what);
    }
    /// Some programs write a comma for the point.
    double number(const char* what) {
        std::string word(next(what));
        while (!word.empty() && (word.back() == ' ' || word.back() == '\t')) word.pop_back();
        const std::size_t first = word.find_first_not_of(" \t+");
        word.erase(0, std::min(first, word.size()));
        std::replace(word.begin(), word.end(), ',', '.');
        double value = 0;
        const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), value);
        if (problem != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
            text_.fail(fmt::format("expected {}, a number", what));
        return value;
    }
    std::size_t whole(const char* what, std::size_t least, std::size_t most) {
        const double value = number(what);
        if (!(value >= static_cast<double>(least) && value <= static_cast<double>(most)) ||
            value != std::floor(value))
            text_.fail(
                fmt::format("{} is {}; it must be a whole number from {} to {}", what, value, least, most));
        return static_cast<std::size_t>(value);
    }
    std::vector<double> numbers(std::size_t count, const char* what) {
        std::vector<double> all;
        for (std::size_t i = 0; i < count; ++i)
            all.push_back(number(what));  // The file ends before memory does.
        return all;
    }
    bool atEnd() {
        std::string_view line;
        while (text_.nextLine(line))
            if (line.find_first_not_of(std::string_view(" \t\0\x1a", 4)) != line.npos) return false;
        return true;
    }

private:
    std::string_view next(const char* what) {
        std::string_view line;
        if (!text_.nextLine(line)) text_.fail(fmt::format("the file ends where {} should stand", what));
        return line;
    }
    PhotometricText text_;
};

/// Of the luminaire, by the file's code.
enum Symmetry : std::size_t { kNone, kAboutAxis, kAcrossC0, kAcrossC90, kAcrossBoth };

/// The number of planes that the file has.
std::size_t planesOf(const Lines& lines, std::size_t symmetry, std::size_t all) {
    const std::size_t parts = symmetry == kAcrossBoth                       ? 4
                              : symmetry == kNone || symmetry == kAboutAxis ? 1
                                                                            : 2;
    if (all % parts != 0)
        lines.text().fail(fmt::format("{} C planes cannot have symmetry {}", all, symmetry));
    return symmetry == kNone ? all : symmetry == kAboutAxis ? 1 : all / parts + 1;
}

/// The angles of the planes that the file has. `order` gets the column of each: those of symmetry 3 go from
/// 270 through 0 to 90, and mirror from 90 through 180 to 270.
std::vector<double> anglesOf(const std::vector<double>& all, std::size_t symmetry, std::size_t planes,
                             std::vector<std::size_t>& order) {
    std::vector<double> angles;
    for (std::size_t i = 0; i < planes; ++i) order.push_back(symmetry == kAcrossC90 ? planes - 1 - i : i);
    if (symmetry == kAboutAxis) return {0};
    if (symmetry == kAcrossC90) {
        for (const std::size_t column : order) {
            const double angle = all[(all.size() * 3 / 4 + column) % all.size()];
            angles.push_back(angle > 180 ? 540 - angle : 180 - angle);
        }
        return angles;
    }
    for (std::size_t i = 0; i < planes; ++i) angles.push_back(all[i]);
    if (symmetry == kNone) {
        angles.push_back(360);
        order.push_back(0);
    }
    return angles;
}

}  // namespace

IesProfile parseEulumdat(std::string_view text_of_file, const std::string& name) {
    Lines lines(text_of_file, name);
    lines.skip(1, "the manufacturer");
    lines.whole("the type of the luminaire", 0, 3);
    const std::size_t symmetry = lines.whole("the symmetry", 0, 4);
    const std::size_t all_planes = lines.whole("the number of C planes", 1, kMostIesAngles);
    lines.number("the distance of C planes");
    const std::size_t vertical = lines.whole("the number of intensities of a plane", 2, kMostIesAngles);
    lines.number("the distance of intensities");
    lines.skip(5, "the names of the luminaire");
    lines.skip(9, "the sizes of the luminaire");
    lines.skip(2, "the shares of light");
    const double conversion = lines.number("the factor of conversion");
    lines.skip(1, "the tilt");
    const std::size_t sets = lines.whole("the number of sets of lamps", 1, 100);
    double lumens = 0;
    for (std::size_t i = 0; i < sets; ++i) {
        lines.skip(2, "the lamps");
        const double of_set = lines.number("the lumens of the lamps");
        if (i == 0) lumens = of_set;
        lines.skip(3, "the colour and power of the lamps");
    }
    if (sets > 1) logWarning("'{}' has {} sets of lamps; the first one counts", name, sets);
    lines.skip(10, "the utilisation factors");
    const double factor = conversion * lumens / 1000;
    if (!(conversion > 0 && lumens > 0) || !std::isfinite(factor))
        lines.text().fail(
            fmt::format("the factor of conversion is {} and the lamps have {} lm; both must be "
                        "above 0",
                        conversion, lumens));

    const std::vector<double> c = lines.numbers(all_planes, "a C angle");
    const std::size_t planes = planesOf(lines, symmetry, all_planes);
    IesProfile profile;
    std::vector<std::size_t> order;
    const std::vector<double> angles = anglesOf(c, symmetry, planes, order);
    const PhotometricColumns columns = allRound(lines.text(), lines.text().line(), angles);
    profile.vertical_deg = lines.numbers(vertical, "a G angle");
    checkVertical(lines.text(), lines.text().line(), profile.vertical_deg);
    if (columns.angles.size() * vertical > kMostIesValues)
        lines.text().fail(fmt::format("{} × {} values are more than {}", columns.angles.size(),
                                      vertical, kMostIesValues));
    const std::vector<double> in_file = lines.numbers(planes * vertical, "an intensity");
    std::vector<double> measured;
    for (const std::size_t column : order)
        for (std::size_t i = 0; i < vertical; ++i) {
            const double value = factor * in_file[column * vertical + i];
            if (!(value >= 0) || !std::isfinite(value))
                lines.text().fail(fmt::format("an intensity is {}; it must be 0 or more", value));
            measured.push_back(value);
        }
    if (!lines.atEnd())
        lines.text().fail("the file continues after the last intensity; is a count too small?");
    spread(columns, measured, profile);
    return profile;
}

}  // namespace crt
