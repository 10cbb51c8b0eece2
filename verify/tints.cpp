// Group G, the part about colours of mirrors, gloss and panes beside those of Fresnel's equations.
#include "verify/context.h"
#include "verify/floors.h"
#include "verify/references.h"
#include "verify/scenes.h"
#include "verify/shapes.h"

#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace crt::verify {
namespace {

constexpr double kPaneIndex = 1.5;
constexpr Effort kTintEffort{.samples = 256, .most = 65536};

/// The first value is where it is seen.
constexpr const char* kForms[] = {"0.6", "{checker: [0.6, 0.1]}"};
constexpr double kTint = 0.6;

void mirrors(Context& context, const char* tint, double degrees) {
    const double cosine = std::cos(degrees * kDegree);
    const auto seen = [&](const std::string& material, double expected, double plain) {
        context.estimate(fmt::format("{} of tint {}, at {}°", material, tint, degrees),
                         checkeredFloor(fmt::format("{{{}, tint: {}}}", material, tint), degrees),
                         meanRadiance, expected, 2e-3, kTintEffort, {{plain, "there is no tint"}});
    };
    seen("type: conductor, eta: 1, k: 1e6", kTint, 1);
    const double rough = tintedMetalAlbedo(cosine, 1, 1, kTint, 0.7);
    context.estimate(
        fmt::format("a rough metal of tint {}, at {}°", tint, degrees),
        checkeredFloor(
            fmt::format("{{type: rough_conductor, eta: 1, k: 1e6, roughness: 0.7, tint: {}}}", tint),
            degrees),
        meanRadiance, rough, 2e-3, kTintEffort,
        {{1, "there is no tint"}, {kTint, "light that several facets reflect has the tint of one"}});
    for (const double roughness : {0.0, 0.5}) {
        const double gloss = microfacetShares(cosine, kPaneIndex, roughness).reflected;
        const double plastic = plasticAlbedo(cosine, 0.5, kPaneIndex, roughness);
        seen(fmt::format("type: plastic, reflectance: 0.5, roughness: {}", roughness),
             plastic - (1 - kTint) * gloss, plastic);
        seen(fmt::format("type: plastic, reflectance: 0, roughness: {}", roughness), kTint * gloss, gloss);
    }
}

/// Light that passes a pane, along a camera's rays and along shadow rays.
void panes(Context& context, const char* tint, double degrees) {
    const double cosine = std::cos(degrees * kDegree);
    const double passed = paneTransmittance(cosine, kPaneIndex);
    const std::string pane = fmt::format("{{type: thin_dielectric, ior: 1.5, tint: {}}}", tint);
    context.estimate(fmt::format("a pane of tint {}, at {}°", tint, degrees), checkeredFloor(pane, degrees),
                     meanRadiance, 1 - passed + kTint * passed, 2e-3, kTintEffort,
                     {{1, "there is no tint"}, {kTint, "the pane mirrors by its tint, too"}});
    const auto floor = [&](bool under) {
        Stage stage("{position: [0, 0.1, 0.1], target: [0, 0, 0], fov: 0.001}");
        stage.material("white", "{type: diffuse, reflectance: 1}")
            .material("pane", pane)
            .quad("floor", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "white")
            .set("lights", fmt::format("[{{type: directional, direction: [{:.17g}, {:.17g}, 0], irradiance: "
                                       "1}}]",
                                       -std::sin(degrees * kDegree), -cosine));
        // Above the eye; the light crosses it where the checkerboard has its first value.
        if (under) stage.object(checkeredSquare("pane", 0.3, 20));
        return luminance(context.render(stage.yaml(), {.samples = 16}));
    };
    context.relative(fmt::format("a floor under a pane of tint {}, lit from {}°", tint, degrees),
                     floor(true) / floor(false), kTint * passed, 1e-4,
                     {{passed, "shadow rays have no tint"}, {kTint, "the pane mirrors nothing"}});
}

void tints(Context& context) {
    for (const double degrees : {60.0, 0.0, 80.0}) {
        if (degrees != 60 && !context.atLeast(Level::Merge)) break;
        for (const char* tint : kForms) {
            mirrors(context, tint, degrees);
            panes(context, tint, degrees);
        }
    }
    // Each wavelength has its own.
    context.estimate(
        "a green mirror over a grey one",
        {checkeredFloor("{type: conductor, eta: 1, k: 1e6, tint: {table: {nm: [360, 830], value: [0, 1]}}}",
                        0),
         checkeredFloor("{type: conductor, eta: 1, k: 1e6}", 0)},
        [](const std::vector<Film>& films) { return luminance(films[0]) / luminance(films[1]); },
        [] {
            double seen = 0, all = 0;
            for (std::size_t i = 0; i < kSpectrumSize; ++i) {
                seen += cieObserver()[1][i] * static_cast<double>(i) / (kSpectrumSize - 1);
                all += cieObserver()[1][i];
            }
            return seen / all;
        }(),
        2e-3, kTintEffort, {{0.5, "the tint is the mean of its wavelengths"}});
    context.sameBits(
        "a tint of 1", context.render(checkeredFloor("{type: plastic, reflectance: 0.5, tint: 1}", 40)),
        context.render(checkeredFloor("{type: plastic, reflectance: 0.5}", 40)), "white is a tint");
}

}  // namespace

std::vector<Case> tintCases() {
    return {
        row("G46", "tints",
            "Metals, plastic and panes with a tint, of a number and of a texture, in light from everywhere, "
            "from 60° and from level merge on also from two further angles; a floor under a tinted pane; a "
            "tint that depends on the wavelength; a tint of 1",
            "Fresnel's shares times the tint, by quadrature over normals; the eye's mean of the tint; the "
            "same bits",
            "Fresnel; Kulla and Conty 2017", "± 0.2 %, ± 0.01 %; 0", Level::Commit,
            CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_POINT_LIGHT | CRT_FEATURE_TINT | CRT_FEATURE_TEXTURE |
                CRT_FEATURE_PLASTIC | CRT_FEATURE_CONDUCTOR | CRT_FEATURE_ROUGH_CONDUCTOR |
                CRT_FEATURE_THIN_DIELECTRIC | CRT_FEATURE_DIFFUSE | CRT_FEATURE_TABLE,
            tints)};
}

}  // namespace crt::verify
