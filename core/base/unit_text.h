/// Quantities as text for people: times, rates, parts and bytes.
#pragma once

#include <string>

namespace crt {

/// "0:42", "12:05", "3:07:15".
std::string clockText(double seconds);
/// "850 ms", "12.3 s", "4 min 10 s".
std::string durationText(double seconds);
/// "12.3 Mpaths/s": a rate with the prefix that suits it.
std::string rateText(double per_second, const char* unit);
/// "1.9 %"
std::string percentText(double fraction);
/// "138 MB"
std::string bytesText(double bytes);

}  // namespace crt
