/// Where the sun stands, by date, time and place.
#pragma once

namespace crt {

/// A moment in Universal Time. Months and days from 1.
struct Moment {
    int year = 2000, month = 1, day = 1;  ///< Of the Gregorian calendar.
    double hours = 0;                     ///< Since midnight; may lie outside the day.
};

/// Of the sun's middle. Refraction, which lifts it by half a degree at the horizon and by 0.02° at 45°, is
/// left out.
struct SolarPosition {
    double elevation_deg;  ///< Above the horizon; negative below it.
    double azimuth_deg;    ///< From north by east, 0 to 360.
};

/// By the low-precision formulae of Meeus (Astronomical Algorithms, 2nd ed., chapters 12, 13 and 25), which
/// NOAA's solar calculator uses, too: 0.01° from 1950 to 2050, and 0.002° for the parallax that is left
/// out. Longitudes are positive in the east.
SolarPosition solarPosition(const Moment& when, double latitude_deg, double longitude_deg);

/// Declination and right ascension, apparent and geocentric; degrees.
struct SolarCoordinates {
    double declination_deg, right_ascension_deg;
};
SolarCoordinates solarCoordinates(const Moment& when);

/// True if this day exists.
bool isDate(int year, int month, int day);

}  // namespace crt
