#include "scene/ies_file.h"

#include "base/error.h"
#include "base/input_file.h"
#include "scene/eulumdat_file.h"
#include "scene/photometric_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <numbers>

namespace crt {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Reads over the labels. Returns what TILT is.
std::string_view tilt(PhotometricText& text) {
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

/// ∫ (linear from a at x to b at y) sin θ dθ.
double ringIntegral(double x, double y, double a, double b) {
    const double slope = (b - a) / (y - x);
    // ∫ θ sin θ dθ = sin θ − θ cos θ.
    const double moment = (std::sin(y) - y * std::cos(y)) - (std::sin(x) - x * std::cos(x));
    return (a - slope * x) * (std::cos(x) - std::cos(y)) + slope * moment;
}

}  // namespace

IesProfile parseIes(std::string_view text_of_file, const std::string& name) {
    PhotometricText text(text_of_file, name);
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
    const PhotometricColumns columns = allRound(text, text.line(), planes);
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
    spread(columns, measured, profile);
    return profile;
}

IesProfile readPhotometricFile(const std::string& path) {
    std::string end = std::filesystem::path(path).extension().string();
    std::transform(end.begin(), end.end(), end.begin(), [](unsigned char c) { return std::tolower(c); });
    try {
        const std::string text = readInput(path, kMostIesBytes);
        return end == ".ldt" ? parseEulumdat(text, path) : parseIes(text, path);
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
