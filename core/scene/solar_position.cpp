#include "scene/solar_position.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace crt {
namespace {

constexpr double kDegrees = std::numbers::pi / 180;

double sine(double degrees) { return std::sin(degrees * kDegrees); }
double cosine(double degrees) { return std::cos(degrees * kDegrees); }
double angle(double y, double x) { return std::atan2(y, x) / kDegrees; }
double turned(double degrees) { return degrees - 360 * std::floor(degrees / 360); }

/// Days since noon of 1 January 2000, Universal Time (Meeus, chapter 7).
double daysSince2000(const Moment& when) {
    const int a = (14 - when.month) / 12, y = when.year + 4800 - a, m = when.month + 12 * a - 3;
    const long noon = when.day + (153L * m + 2) / 5 + 365L * y + y / 4 - y / 100 + y / 400 - 32045;
    return static_cast<double>(noon - 2451545) - 0.5 + when.hours / 24;
}

/// The ecliptic's angles on a day; degrees.
struct Ecliptic {
    double longitude;  ///< Of the sun, apparent.
    double obliquity;
    double nutation;  ///< In longitude: its largest term.
};

Ecliptic eclipticOf(double days) {
    const double t = days / 36525;
    const double mean = 280.46646 + t * (36000.76983 + t * 0.0003032);
    const double anomaly = 357.52911 + t * (35999.05029 - t * 0.0001537);
    const double centre = sine(anomaly) * (1.914602 - t * (0.004817 + t * 0.000014)) +
                          sine(2 * anomaly) * (0.019993 - t * 0.000101) + sine(3 * anomaly) * 0.000289;
    const double node = 125.04 - 1934.136 * t;
    const double nutation = -0.00478 * sine(node);
    const double aberration = -0.00569;
    const double obliquity = 23 + (26 + (21.448 - t * (46.8150 + t * (0.00059 - t * 0.001813))) / 60) / 60;
    return {mean + centre + aberration + nutation, obliquity + 0.00256 * cosine(node), nutation};
}

SolarCoordinates coordinatesOf(const Ecliptic& e) {
    return {std::asin(sine(e.obliquity) * sine(e.longitude)) / kDegrees,
            turned(angle(cosine(e.obliquity) * sine(e.longitude), cosine(e.longitude)))};
}

}  // namespace

SolarCoordinates solarCoordinates(const Moment& when) {
    return coordinatesOf(eclipticOf(daysSince2000(when)));
}

SolarPosition solarPosition(const Moment& when, double latitude_deg, double longitude_deg) {
    const double days = daysSince2000(when);
    const Ecliptic ecliptic = eclipticOf(days);
    const SolarCoordinates sun = coordinatesOf(ecliptic);
    const double sidereal =
        280.46061837 + 360.98564736629 * days + ecliptic.nutation * cosine(ecliptic.obliquity);
    const double hour_angle = sidereal + longitude_deg - sun.right_ascension_deg;
    const double east = -cosine(sun.declination_deg) * sine(hour_angle);
    const double north = sine(sun.declination_deg) * cosine(latitude_deg) -
                         cosine(sun.declination_deg) * cosine(hour_angle) * sine(latitude_deg);
    const double up = sine(sun.declination_deg) * sine(latitude_deg) +
                      cosine(sun.declination_deg) * cosine(hour_angle) * cosine(latitude_deg);
    return {angle(up, std::hypot(east, north)), turned(angle(east, north))};
}

bool isDate(int year, int month, int day) {
    constexpr std::array<int, 12> kDays{31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    if (month < 1 || month > 12 || day < 1) return false;
    const bool leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    return day <= kDays[static_cast<std::size_t>(month - 1)] + (month == 2 && leap ? 1 : 0);
}

}  // namespace crt
