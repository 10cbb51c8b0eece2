#include "scene/yaml/scene_sun.h"

#include "base/vec3d.h"
#include "scene/solar_position.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

namespace crt {
namespace {

constexpr double kDegrees = std::numbers::pi / 180;

/// `count` whole numbers of two digits or, the first, `first_digits`, with `separator` between them.
std::optional<std::vector<int>> numbersIn(const std::string& text, std::size_t first_digits,
                                          char separator) {
    std::vector<int> numbers;
    std::size_t at = 0;
    for (std::size_t digits = first_digits; at + digits <= text.size(); digits = 2) {
        int number = 0;
        for (std::size_t i = 0; i < digits; ++i) {
            const char c = text[at + i];
            if (c < '0' || c > '9') return std::nullopt;
            number = 10 * number + (c - '0');
        }
        numbers.push_back(number);
        at += digits;
        if (at == text.size()) return numbers;
        if (text[at++] != separator) return std::nullopt;
    }
    return std::nullopt;
}

bool readDate(const SectionReader& section, Moment& when) {
    std::string text;
    if (!section.read("date", text)) return false;
    const std::optional<std::vector<int>> ymd = numbersIn(text, 4, '-');
    if (!ymd || ymd->size() != 3) {
        section.error("date", fmt::format("'{}' is not a date", text), "write 2026-06-21");
        return false;
    }
    if (!isDate((*ymd)[0], (*ymd)[1], (*ymd)[2])) {
        section.error("date", fmt::format("there is no {} in the calendar", text));
        return false;
    }
    constexpr int kFirst = 1950, kLast = 2050;  // Of the formulae's accuracy.
    if ((*ymd)[0] < kFirst || (*ymd)[0] > kLast) {
        section.error("date", fmt::format("crt computes the position of the sun for {} to {}",
                                          kFirst, kLast));
        return false;
    }
    when.year = (*ymd)[0], when.month = (*ymd)[1], when.day = (*ymd)[2];
    return true;
}

bool readTime(const SectionReader& section, Moment& when) {
    std::string text;
    if (section.read("time_h", when.hours)) return true;
    if (!section.read("time", text)) {
        if (section.has("date") && !section.has("time") && !section.has("time_h"))
            section.error("date", "a date needs a time of day: 'time' or 'time_h'");
        return false;
    }
    const std::optional<std::vector<int>> hms = numbersIn(text, 2, ':');
    if (!hms || hms->size() < 2 || hms->size() > 3 || (*hms)[0] > 23 || (*hms)[1] > 59 ||
        (hms->size() == 3 && (*hms)[2] > 59)) {
        section.error("time", fmt::format("'{}' is not a time of day", text), "write 14:30 or 14:30:00");
        return false;
    }
    when.hours = (*hms)[0] + (*hms)[1] / 60.0 + (hms->size() == 3 ? (*hms)[2] / 3600.0 : 0);
    return true;
}

/// The unit vector of a direction of the horizon.
std::optional<Vec3d> towards(const SectionReader& section, const SolarPosition& sun) {
    Vec3d north{0, 0, -1}, up{0, 1, 0};
    section.read("north", north);
    section.read("up", up);
    const std::optional<Vec3d> zenith = unitVector(up), given = unitVector(north);
    if (!zenith || !given) {
        section.error(zenith ? "north" : "up", "a direction cannot have length 0");
        return std::nullopt;
    }
    const Vec3d flat = *given - *zenith * dot(*given, *zenith);
    constexpr double kParallel = 1e-9;
    if (!(length(flat) > kParallel)) {
        section.error(section.has("north") ? "north" : "up",
                      "'north' is parallel to 'up', so it has no direction on the ground");
        return std::nullopt;
    }
    const Vec3d ahead = flat * (1 / length(flat)), east = cross(ahead, *zenith);
    const double h = sun.elevation_deg * kDegrees, a = sun.azimuth_deg * kDegrees;
    return *zenith * std::sin(h) + (ahead * std::cos(a) + east * std::sin(a)) * std::cos(h);
}

}  // namespace

std::optional<Vec3d> unitVector(const Vec3d& v) {
    const double largest = std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
    if (!(largest > 0) || !std::isfinite(largest)) return std::nullopt;
    const Vec3d s{v[0] / largest, v[1] / largest, v[2] / largest};
    return s * (1 / length(s));
}

std::optional<Vec3d> readTowardsSun(const SectionReader& section, double diameter_deg) {
    Vec3d way{};
    if (section.read("direction", way)) {
        const std::optional<Vec3d> unit = unitVector(way);
        if (!unit) section.error("direction", "a direction cannot have length 0");
        return unit ? std::optional(*unit * -1) : std::nullopt;
    }
    Moment when;
    double utc_offset_h = 0, latitude_deg = 0, longitude_deg = 0;
    section.read("utc_offset", utc_offset_h);
    const bool have_date = readDate(section, when), have_time = readTime(section, when),
               have_latitude = section.read("latitude_deg", latitude_deg),
               have_longitude = section.read("longitude_deg", longitude_deg);
    if (!have_date || !have_time || !have_latitude || !have_longitude) return std::nullopt;
    when.hours -= utc_offset_h;
    const SolarPosition sun = solarPosition(when, latitude_deg, longitude_deg);
    if (sun.elevation_deg <= -diameter_deg / 2) {
        section.error(section.has("time") ? "time" : "time_h",
                      fmt::format("the sun is {:.1f} degrees below the horizon then", -sun.elevation_deg),
                      section.has("utc_offset") ? "" : "if 'time' is local time, add 'utc_offset' in hours");
        return std::nullopt;
    }
    return towards(section, sun);
}

}  // namespace crt
