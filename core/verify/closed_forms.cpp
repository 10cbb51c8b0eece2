// Group A: scenes whose radiance is known in closed form, or by deterministic quadrature.
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"

#include "kernel/features.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace crt::verify {
namespace {

constexpr double kPi = std::numbers::pi;

/// E (1 − ρ^(k+1)) / (1 − ρ): a closed room of emitting walls after k scattering events.
double furnaceRadiance(double albedo, int depth) { return (1 - std::pow(albedo, depth + 1)) / (1 - albedo); }

Cube furnace(double albedo, int depth, bool nee = false) {
    Cube cube;
    cube.reflectance = fmt::format("{}", albedo);
    cube.integrator = fmt::format("{{max_depth: {}, roulette: false, nee: {}}}", depth, nee);
    return cube;
}

/// Largest relative deviation of a pixel of `film` from `factor` times the same pixel of `unit`.
double worstRatio(const Film& film, const Film& unit, double factor) {
    double worst = 1;
    for (std::uint32_t y = 0; y < film.shape().height; ++y)
        for (std::uint32_t x = 0; x < film.shape().width; ++x) {
            const double ratio = film.mean(x, y, 1) / unit.mean(x, y, 1) / factor;
            if (!(std::abs(ratio - 1) <= std::abs(worst - 1))) worst = ratio;
        }
    return worst;
}

void whiteFurnace(Context& context) {
    // Every path brings the same radiance whatever its directions and wavelengths, so the image at depth k is the image at depth 0, the emitted
    // radiance alone, times the closed form: no statistics, only rounding. 2e-6 is 16 roundings of a sum of up to 65 terms.
    for (const double albedo : {0.5, 0.8}) {
        const Film emitted = context.render(yaml(furnace(albedo, 0)), {.samples = 4});
        for (const int depth : {1, 2, 8, 64}) {
            const double expected = furnaceRadiance(albedo, depth);
            const double measured = expected * worstRatio(context.render(yaml(furnace(albedo, depth)), {.samples = 4}), emitted, expected);
            context.relative(fmt::format("albedo {}, depth {}: the worst pixel", albedo, depth), measured, expected, 2e-6,
                             {{furnaceRadiance(albedo, depth - 1), "one scattering event too few: is the depth counted from 1?"},
                              {furnaceRadiance(albedo, depth + 1), "one scattering event too many: is the depth counted from -1?"},
                              {furnaceRadiance(albedo * kPi, depth), "every surface is 3.1416 times too bright: is a division by pi missing?"},
                              {furnaceRadiance(albedo / kPi, depth), "every surface reflects 3.1416 times too little: is it divided by pi twice?"},
                              {1, "walls emit but do not reflect"}});
        }
    }
    context.estimate("with light sampling, albedo 0.5, depth 8", yaml(furnace(0.5, 8, true)), [](const Film& f) { return radiance(f); },
                     furnaceRadiance(0.5, 8), 0.002, {.samples = 64, .most = 4096},
                     {{furnaceRadiance(0.5, 8) + 1, "emission is counted twice: by light sampling and by what is hit"}});
}

std::vector<Mistake> squareMistakes(double x) {
    // From (x, 0, 0) towards (u, 1, v): cosines at floor and lamp are both 1/r, the geometry factor 1/r⁴.
    const auto integral = [x](double power) {
        return rectangleIntegral([=](double u, double v) { return std::pow(1 + (u - x) * (u - x) + v * v, -power / 2); }, -0.5, 0.5, -0.5, 0.5) / kPi;
    };
    const double right = squareFormFactor(x, 0.5);
    return {{integral(3), "one of the two cosines is missing: the light's irradiance is not weighted by the angle at which it arrives on the floor, or leaves the lamp"},
            {integral(2), "both cosines are missing"},
            {integral(5), "a cosine is applied twice"},
            {right * kPi, "the floor is 3.1416 times too bright: is the division of Lambert's law by pi missing?"},
            {right / kPi, "the floor is 3.1416 times too dark: is Lambert's law divided by pi twice?"},
            {right * 2, "the lamp is counted twice: are light sampling and chance hits not weighted against each other, or both halves of the quad taken as the whole?"},
            {right / 2, "half of the lamp is missing: is one of its two triangles never sampled, or its area halved?"}};
}

void squareLight(Context& context) {
    const auto probe = [&](double x, double delta) {
        context.estimate(fmt::format("receiver at offset {}", x), squareOverFloor(x), [](const Film& f) { return radiance(f); }, squareFormFactor(x, 0.5), delta,
                         {.samples = 256, .most = 16384}, squareMistakes(x));
    };
    for (const double x : {0.0, 1.0, 2.0}) probe(x, 0.001);
}

}  // namespace

std::vector<Case> closedFormCases() {
    return {
        {.id = "A01",
         .name = "furnace",
         .title = "A closed box whose walls emit 1 and reflect 0.5 or 0.8, at depths 1, 2, 8 and 64",
         .expected = "E (1 − ρ^(k+1)) / (1 − ρ) in every pixel",
         .source = "geometric series",
         .tolerance = "2e-6 without light sampling, which has no variance; ± 0.2 % with it",
         .level = Level::Commit,
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT,
         .run = whiteFurnace},
        {.id = "A03",
         .name = "square-light",
         .title = "Unit square light at height 1 over a white floor, seen at offsets 0, 1, 2 and 20",
         .expected = "the form factor: 0.2394564705, 0.0843536644, 0.0139237174, 1.982807681e-6",
         .source = "rectangle formula (Howell B-3), and Lambert's polygon formula to 12 digits",
         .tolerance = "± 0.1 %; ± 0.5 % at 20",
         .level = Level::Commit,
         .needs = CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE,
         .run = squareLight},
    };
}

}  // namespace crt::verify
