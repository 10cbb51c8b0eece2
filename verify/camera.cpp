// Group J, the part about the lens and the pixel filter.
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"

#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

namespace crt::verify {
namespace {

/// Share of a disk of radius 1 that lies beyond a chord at distance h from its centre.
double beyondChord(double h) {
    if (std::abs(h) >= 1) return h < 0 ? 1 : 0;
    return (std::acos(h) - h * std::sqrt(1 - h * h)) / kPi;
}

/// A glowing half plane, x > edge or y > edge, at the depth z before a camera at the origin that looks along
/// z. Lengths are in units of `unit`.
std::string glowingHalf(const std::string& camera, const std::string& film, bool along_x, double edge,
                        double z, double unit = 1) {
    const double a = edge * unit, b = 9 * unit, d = z * unit;
    return Stage(camera, "{max_depth: 0}")
        .set("film", film)
        .material("black", "{type: diffuse, reflectance: 0}")
        .quad("half",
              along_x ? fmt::format("[[{0},-{1},{2}],[{1},-{1},{2}],[{1},{1},{2}],[{0},{1},{2}]]", a, b, d)
                      : fmt::format("[[-{1},{0},{2}],[{1},{0},{2}],[{1},{1},{2}],[-{1},{1},{2}]]", a, b, d),
              "black", "1, two_sided: true")
        .yaml();
}

void lens(Context& context) {
    // Rays of one film point meet at the focal plane. At the depth z they fill a disk of radius
    // R |1 − z/f|: the lens, seen from that point (Potmesil and Chakravarty 1981).
    constexpr double radius = 0.1;
    const char* pixel = "{resolution: [4, 4]}";
    for (const double unit : {1.0, 1e-3, 1e4})
        for (const auto& [focus, depth] : {std::pair{2.0, 3.0}, std::pair{2.0, 0.5}, std::pair{1.0, 2.0}})
            for (const auto& [along_x, edge] :
                 {std::pair{true, 0.4}, std::pair{true, -0.7}, std::pair{false, 0.4}}) {
                if (unit != 1 && (edge < 0 || depth == 0.5)) continue;
                const double blur = radius * std::abs(1 - depth / focus);
                const double expected = beyondChord(edge);
                context.estimate(
                    fmt::format("a lens of {}, sharp at {}: an edge at {} along {}, {} from the middle",
                                radius * unit, focus * unit, depth * unit, along_x ? "x" : "y",
                                edge * blur * unit),
                    glowingHalf(fmt::format("{{position: [0, 0, 0], target: [0, 0, {}], fov: 0.0001, "
                                            "aperture_radius: {}, focus_distance: {}}}",
                                            unit, radius * unit, focus * unit),
                                pixel, along_x, edge * blur, depth, unit),
                    meanRadiance, expected, 0.005, {.samples = 256, .most = 16384},
                    {{beyondChord(edge / 2), "the lens is twice as wide"},
                     {beyondChord(2 * edge), "the lens is half as wide: is its radius a diameter?"},
                     {edge < 0 ? 1.0 : 0.0, "there is no lens"}});
            }
    // A point in focus is sharp: an edge a twentieth of the lens beside the point does not reach it.
    // Without focus_distance the target is in focus.
    for (const char* focus : {"target: [0, 0, 1], focus_distance: 2.5", "target: [0, 0, 2.5]"})
        for (const double side : {1.0, -1.0})
            context.estimate(
                fmt::format("in focus at 2.5, by {{{}}}: an edge {} from the middle", focus, side * 0.005),
                {glowingHalf(
                     fmt::format("{{position: [0, 0, 0], {}, fov: 0.0001, aperture_radius: 0.1}}", focus),
                     pixel, true, side * 0.005, 2.5),
                 glowingHalf("{position: [0, 0, 0], target: [0, 0, 1], fov: 0.0001}", pixel, true, -1, 1)},
                // 1 + the share of light: never 0, since no interval is relative to 0.
                [](const std::vector<Film>& f) { return 1 + radiance(f[0]) / radiance(f[1]); },
                side > 0 ? 1 : 2, 1e-4, {.samples = 256, .most = 256},
                {{1.5, "the lens is focused elsewhere"}});
    // A plane is in focus, not a sphere: the pixel at the left edge of a wide film.
    context.estimate("in focus at the edge of a film of 90°",
                     glowingHalf("{position: [0, 0, 0], target: [0, 0, 1], fov: 90, aperture_radius: 0.2, "
                                 "focus_distance: 1}",
                                 "{resolution: [64, 64], crop: [0, 31, 1, 32]}", true, 0.95, 1),
                     meanRadiance, 1, 0.001, {.samples = 256, .most = 16384},
                     {{0.8, "the distance of focus is taken along the ray"}});
}

/// A filter of one axis that is 0 beyond `radius`, by its values within; in pixels.
struct Filter {
    std::string film;
    double radius;
    std::function<double(double)> value;

    double integral(double from, double to) const {
        constexpr int panels = 16;
        double sum = 0;
        for (int i = 0; i < panels; ++i)
            sum += boost::math::quadrature::gauss<double, 15>::integrate(
                value, from + (to - from) * i / panels, from + (to - from) * (i + 1) / panels);
        return sum;
    }
    /// Its share below x.
    double below(double x) const {
        return integral(-radius, std::clamp(x, -radius, radius)) / integral(-radius, radius);
    }
};

Filter gaussianFilter(double radius, double sigma) {
    // Shifted down to 0 at its end, as Pharr, Jakob and Humphreys (PBRT 4e, 8.8.3) have it.
    const auto bell = [sigma](double x) { return std::exp(-x * x / (2 * sigma * sigma)); };
    return {fmt::format("{{type: gaussian, radius: {}, sigma: {}}}", radius, sigma), radius,
            [=](double x) { return bell(x) - bell(radius); }};
}

Filter blackmanHarrisFilter(double radius) {
    // Four terms (Harris 1978, table 1), with the middle at 0.
    return {fmt::format("{{type: blackman-harris, radius: {}}}", radius), radius, [=](double x) {
                const double t = kPi * x / radius;
                return 0.35875 + 0.48829 * std::cos(t) + 0.14128 * std::cos(2 * t) +
                       0.01168 * std::cos(3 * t);
            }};
}

void pixelFilters(Context& context) {
    // A glowing quarter plane with its corner near the middle of the film, and not on a pixel's: filters are
    // products, so a pixel's value is the share of the filter in x times that in y.
    constexpr int size = 8;
    constexpr double pixel = 2.0 / size, corner_x = 0.06, corner_y = -0.1;
    const std::vector<Filter> filters{{"box", 0.5, [](double) { return 1.0; }},
                                      {"{type: box, radius: 1.25}", 1.25, [](double) { return 1.0; }},
                                      gaussianFilter(1.5, 0.5),
                                      gaussianFilter(2.5, 1),
                                      blackmanHarrisFilter(1.5),
                                      blackmanHarrisFilter(3)};
    for (const Filter& filter : filters) {
        const std::string scene =
            Stage("{position: [0, 0, 0], target: [0, 0, 1], fov: 90}", "{max_depth: 0}")
                .set("film", fmt::format("{{resolution: [{0}, {0}], filter: {1}}}", size, filter.film))
                .material("black", "{type: diffuse, reflectance: 0}")
                .quad("quarter",
                      fmt::format("[[{0},{1},1],[9,{1},1],[9,9,1],[{0},9,1]]", corner_x, corner_y), "black",
                      "1, two_sided: true")
                .yaml();
        std::vector<Quantity> quantities;
        for (std::uint32_t y = 0; y < size; ++y)
            for (std::uint32_t x = 0; x < size; ++x) {
                // Image right is −x. 1 + the share of light: no interval is relative to 0.
                const double in_x = filter.below((1 - pixel * (x + 0.5) - corner_x) / pixel),
                             in_y = filter.below((1 - pixel * (y + 0.5) - corner_y) / pixel);
                if (x + y < 5 || x + y > 9) continue;
                quantities.push_back(
                    {fmt::format("filter {}, pixel ({}, {})", filter.film, x, y),
                     [x, y](const std::vector<Film>& f) { return 1 + radiance(f[0], x, y); },
                     1 + in_x * in_y});
            }
        std::vector<Outcome> outcomes =
            context.estimated(quantities, {scene}, 0.005, {.samples = 64, .most = 16384}, {});
        // Of each filter the worst pixel; one that fails before one that passes.
        const auto off = [](const Outcome& o) { return std::abs(*o.measured - *o.expected); };
        const auto worst =
            std::max_element(outcomes.begin(), outcomes.end(), [&](const Outcome& a, const Outcome& b) {
                return failed(a.verdict) == failed(b.verdict) ? off(a) < off(b) : failed(b.verdict);
            });
        worst->what += fmt::format(", the worst of {}", outcomes.size());
        context.add(std::move(*worst));
    }
}

}  // namespace

std::vector<Case> cameraCases() {
    return {
        row("J09", "thin-lens",
            "Edges before, in and behind the plane that a lens of radius 0.1 is focused at, along x and y, "
            "in three units of length; at the edge of a wide film",
            "the share of a disk of radius R |1 − z/f| beyond the edge; what is in focus is sharp",
            "the thin lens (Potmesil and Chakravarty 1981); a circle's segment", "± 0.5 %; 1e-4; ± 0.1 %",
            Level::Commit, CRT_FEATURE_LENS | CRT_FEATURE_AREA_LIGHT, lens),
        row("J10", "pixel-filters",
            "A glowing quarter plane through a box, a gaussian and a Blackman–Harris filter of two widths "
            "each, in the pixels about its corner",
            "in each pixel the share of the filter in x times that in y",
            "quadrature in double; Harris (1978)", "± 0.5 % of 1 + the share", Level::Commit,
            CRT_FEATURE_FILTER | CRT_FEATURE_AREA_LIGHT, pixelFilters),
    };
}

}  // namespace crt::verify
