#include "film/error_text.h"

#include "base/unit_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace crt {

namespace {

std::string withMissingLight(std::string text, bool light_is_missing) {
    return light_is_missing ? std::move(text) + " + missing light" : text;
}

std::string expectedText(const ErrorEstimate& error) {
    if (error.knowledge == ErrorKnowledge::NotYet) return "error not yet known";
    if (error.knowledge == ErrorKnowledge::Bound) return "error below " + percentText(error.relative_rmse);
    const double lower = error.relative_rmse_95.lower * 100, upper = error.relative_rmse_95.upper * 100;
    const int digits =
        std::clamp(-static_cast<int>(std::floor(std::log10(std::max(upper - lower, 1e-6)))), 1, 6);
    return fmt::format("error {:.{}f} % ({:.{}f}-{:.{}f})", error.relative_rmse * 100, digits, lower, digits,
                       upper, digits);
}

}  // namespace

std::string expectedErrorText(const ErrorEstimate& error, bool light_is_missing) {
    return withMissingLight(expectedText(error), light_is_missing);
}

std::string errorText(const ErrorEstimate& error, bool light_is_missing) {
    std::string text = expectedText(error);
    if (error.known())
        text += fmt::format(" expected; this image: at most {}", percentText(error.half_width_95));
    return withMissingLight(std::move(text), light_is_missing);
}

std::string sampleCountText(const stats::Interval& samples) {
    // Two significant digits: more would claim what the interval does not know.
    const auto rounded = [](double value) {
        const double unit = std::pow(10.0, std::max(0.0, std::floor(std::log10(std::max(value, 1.0))) - 1));
        return std::ceil(value / unit) * unit;
    };
    return fmt::format("{:.0f}-{:.0f}", rounded(samples.lower), rounded(samples.upper));
}

}  // namespace crt
