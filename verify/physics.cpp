#include "verify/physics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace crt::verify {
namespace {

/// Factors that a forgotten or repeated term leaves behind.
struct Factor {
    double ratio;
    const char* physics;
};
constexpr Factor kFactors[] = {
    {std::numbers::pi, "{:.4g} times too bright: is a division by pi missing?"},
    {std::numbers::inv_pi, "{:.4g} of what it should be: is it divided by pi twice?"},
    {2, "{:.4g} times too bright: is the emission counted twice, by light sampling and by chance hits?"},
    {0.5,
     "{:.4g} of what it should be: is half of the light lost, one of two sampling techniques or one side of "
     "the lamp?"},
    {4, "{:.4g} times too bright: is the share of each of the four wavelengths missing?"},
    {0.25, "{:.4g} of what it should be: is only one of the four wavelengths counted?"},
    {2.25, "{:.4g} times too bright: is radiance not divided by n² (1.5² here) on the way into glass?"},
    {1 / 2.25, "{:.4g} of what it should be: is radiance divided by n² (1.5² here) once too often?"},
};

constexpr double kMatch = 0.01;

}  // namespace

std::string diagnose(double measured, double expected, double uncertainty,
                     const std::vector<Mistake>& mistakes) {
    if (!std::isfinite(measured))
        return "not a finite number: a division by zero, or a square root of a negative number, on the way";
    const Mistake* best = nullptr;
    double distance = std::numeric_limits<double>::infinity();
    for (const Mistake& m : mistakes) {
        const double d = std::abs(measured - m.value);
        if (d <= std::max(kMatch * std::abs(m.value), uncertainty) && d < distance) {
            best = &m;
            distance = d;
        }
    }
    if (best != nullptr) return best->physics;
    if (measured == expected) return "";
    if (expected == 0)
        return measured > 0
                   ? "light where there can be none: does something leak, or is something not occluded?"
                   : "less than nothing";
    if (measured == 0) return "black: no light arrives at all";
    const double ratio = measured / expected;
    for (const Factor& f : kFactors)
        if (std::abs(ratio / f.ratio - 1) <= std::max(kMatch, std::abs(uncertainty / measured)))
            return fmt::format(fmt::runtime(f.physics), ratio);
    const double excess = ratio - 1;
    if (std::abs(excess) > 0.5) return fmt::format("{:.4g} times what it should be", ratio);
    return fmt::format("{:.3g} % too {}", 100 * std::abs(excess),
                       excess > 0
                           ? "bright: is something counted more than once, or a probability too small?"
                           : "dark: is something lost, or a probability too large?");
}

}  // namespace crt::verify
