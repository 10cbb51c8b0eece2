#include "film/error_text.h"

#include "base/unit_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace crt {

std::string expectedErrorText(const ErrorEstimate& error) {
    if (error.knowledge == ErrorKnowledge::NotYet) return "error not yet known";
    if (error.knowledge == ErrorKnowledge::Bound) return "error below " + percentText(error.relative_rmse);
    const double lower = error.relative_rmse_95.lower * 100, upper = error.relative_rmse_95.upper * 100;
    const int digits =
        std::clamp(-static_cast<int>(std::floor(std::log10(std::max(upper - lower, 1e-6)))), 1, 6);
    return fmt::format("error {:.{}f} % ({:.{}f}-{:.{}f})", error.relative_rmse * 100, digits, lower, digits,
                       upper, digits);
}

std::string errorText(const ErrorEstimate& error) {
    const std::string expected = expectedErrorText(error);
    return error.known() ? fmt::format("{} expected, of this image at most {}", expected,
                                       percentText(error.half_width_95))
                         : expected;
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
