#include "base/unit_text.h"
#include "film/error_text.h"
#include "judge/converge/quantity_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace crt::converge {
namespace {

struct Unit {
    double size;
    const char* name;
};

Unit unitOfSeconds(double seconds) {
    const double s = std::abs(seconds);
    if (s < 0.9995e-3) return {1e-6, " µs"};
    if (s < 0.9995) return {1e-3, " ms"};
    if (s < 299.5) return {1, " s"};
    if (s < 5970) return {60, " min"};
    return {3600, " h"};
}

std::string superscript(int value) {
    static const char* const digits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    std::string text = value < 0 ? "⁻" : "";
    for (const char c : std::to_string(std::abs(value))) text += digits[c - '0'];
    return text;
}

/// A true minus sign, as wide as a plus.
std::string withMinus(std::string text) {
    if (!text.empty() && text[0] == '-') text.replace(0, 1, "−");
    return text;
}

std::string estimateText(const Estimate& e, const Unit& unit, int digits) {
    if (!std::isfinite(e.value)) return "–";
    const std::string value = numberText(e.value / unit.size, digits) + unit.name;
    if (!std::isfinite(e.low) || !std::isfinite(e.high)) return value + " (no interval)";
    // "−1.2 to 3.4" rather than "−1.2–3.4".
    const char* to = e.low < 0 ? " to " : "–";
    return fmt::format("{} ({}{}{})", value, numberText(e.low / unit.size, digits), to,
                       numberText(e.high / unit.size, digits));
}

}  // namespace

std::string numberText(double value, int digits) {
    if (!std::isfinite(value)) return "–";
    if (value == 0) return "0";
    // Rounded first, so that 0.9996 has the digits of 1.00.
    const int exponent = static_cast<int>(std::floor(std::log10(std::abs(value)) + 1e-12));
    const double unit = std::pow(10.0, exponent - digits + 1);
    const double rounded = std::round(value / unit) * unit;
    const int magnitude = static_cast<int>(std::floor(std::log10(std::abs(rounded)) + 1e-9));
    if (magnitude < -4 || magnitude >= 6)
        return withMinus(fmt::format("{:.{}f}", rounded / std::pow(10.0, magnitude), digits - 1)) + "·10" +
               superscript(magnitude);
    return withMinus(fmt::format("{:.{}f}", rounded, std::max(0, digits - 1 - magnitude)));
}

std::string percentText(double value, int digits) { return numberText(100 * value, digits) + " %"; }

std::string secondsText(double seconds, int digits) {
    const Unit unit = unitOfSeconds(seconds);
    return numberText(seconds / unit.size, digits) + unit.name;
}

std::string secondsText(const Estimate& estimate, int digits) {
    return estimateText(estimate, unitOfSeconds(estimate.value), digits);
}
std::string percentText(const Estimate& estimate, int digits) {
    return estimateText(estimate, {0.01, " %"}, digits);
}
std::string numberText(const Estimate& estimate, int digits) {
    return estimateText(estimate, {1, ""}, digits);
}

std::string errorText(const Estimate& e, int digits) {
    if (!std::isfinite(e.value) || e.low > 0 || !std::isfinite(e.high)) return percentText(e, digits);
    return "below " + percentText(e.high, digits);
}

}  // namespace crt::converge
