#include "base/unit_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace crt {

std::string clockText(double seconds) {
    const auto s = static_cast<std::uint64_t>(std::llround(std::clamp(seconds, 0.0, 1e9)));
    if (s >= 3600) return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
    return fmt::format("{}:{:02}", s / 60, s % 60);
}

std::string durationText(double seconds) {
    if (seconds < 0.00995) return fmt::format("{:.2f} ms", seconds * 1e3);
    if (seconds < 0.9995) return fmt::format("{:.0f} ms", seconds * 1e3);
    if (seconds < 99.95) return fmt::format("{:.1f} s", seconds);
    const auto s = static_cast<std::uint64_t>(std::llround(seconds));
    if (s < 3600) return fmt::format("{} min {} s", s / 60, s % 60);
    return fmt::format("{} h {} min", s / 3600, s / 60 % 60);
}

std::string rateText(double per_second, const char* unit) {
    // Three significant digits whatever the prefix, so that the field keeps its width.
    struct Prefix {
        double scale;
        const char* letter;
    };
    for (const Prefix prefix : {Prefix{1e9, "G"}, Prefix{1e6, "M"}, Prefix{1e3, "k"}}) {
        const double value = per_second / prefix.scale;
        if (value >= 1)
            return fmt::format("{:.{}f} {}{}", value,
                               value < 9.995   ? 2
                               : value < 99.95 ? 1
                                               : 0,
                               prefix.letter, unit);
    }
    return fmt::format("{:.0f} {}", per_second, unit);
}

std::string percentText(double fraction) {
    const double percent = fraction * 100;
    return fmt::format("{:.{}f} %", percent,
                       percent < 0.0995  ? 3
                       : percent < 0.995 ? 2
                       : percent < 99.5  ? 1
                                         : 0);
}

std::string bytesText(double bytes) {
    for (const auto& [scale, unit] : {std::pair{1e9, "GB"}, {1e6, "MB"}, {1e3, "kB"}}) {
        const double value = bytes / scale;
        if (value >= 1) return fmt::format("{:.{}f} {}", value, value < 9.95 ? 1 : 0, unit);
    }
    return fmt::format("{:.0f} B", bytes);
}

}  // namespace crt
