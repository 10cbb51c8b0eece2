/// Words of the command line → values, with messages that say what was expected.
#pragma once

#include "film/film.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace crt {

/// A whole number of at least `least`; 1e3 is one. `option` stands in the message of the crt::Error(Usage),
/// here and below.
std::uint64_t parseCount(const std::string& text, const std::string& option, std::uint64_t least);

/// A number of at least zero.
double parseTolerance(const std::string& text, const std::string& option);

/// "1%" or "0.01": above 0, below 1.
double parseFraction(const std::string& text, const std::string& option);

/// "90", "90s", "1.5m", "2h", "1h30m", "250ms" in seconds; above zero.
double parseDuration(const std::string& text, const std::string& option);

/// "0:512": first sample, and one past the last.
SampleRange parseSampleRange(const std::string& text, const std::string& option);

/// "x0,y0,x1,y1".
std::array<int, 4> parseRectangle(const std::string& text, const std::string& option);

/// Expands abbreviations in the program's arguments (without its name): a first word that is none of
/// `commands` is preceded by "render"; "--resume FILE.crtfilm" becomes "--resume=FILE.crtfilm" and
/// "--resume" before anything else "--resume=auto", so that it never swallows the scene; the same with
/// compare's "--json FILE.json", or "--json=-". Throws crt::Error(Usage) for a first word that is a command
/// misspelt.
std::vector<std::string> writtenOut(std::vector<std::string> arguments,
                                    const std::vector<std::string>& commands);

}  // namespace crt
