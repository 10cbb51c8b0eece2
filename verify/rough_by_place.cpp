// Group G, the part about gloss and coats whose roughness depends on the place.
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

constexpr Effort kEffort{.samples = 256, .most = 65536};
constexpr double kGlossIndex = 1.5;

/// One value on the square that is seen, another on its neighbours.
struct ByPlace {
    double here, elsewhere;

    std::string text() const { return fmt::format("{{checker: [{}, {}]}}", here, elsewhere); }
};

std::string plasticOf(double base, const std::string& roughness) {
    return fmt::format("{{type: plastic, reflectance: {}, roughness: {}}}", base, roughness);
}

std::string coated(const std::string& base, const std::string& roughness) {
    return fmt::format("{{type: openpbr, {}, coat_weight: 1, coat_ior: 1.4, coat_roughness: {}}}", base,
                       roughness);
}

/// Between the tables, on one of them, in the first interval and where the coat is smooth.
constexpr ByPlace kGlosses[] = {{0.36, 0.9}, {0.5625, 0.2}, {0.05, 0.6}, {0.02, 0.6}};

void glosses(Context& context, double degrees) {
    const double cosine = std::cos(degrees * kDegree);
    for (const ByPlace& rough : kGlosses) {
        context.estimate(fmt::format("plastic of roughness {} here, {} elsewhere, at {}°", rough.here,
                                     rough.elsewhere, degrees),
                         checkeredFloor(plasticOf(0.5, rough.text()), degrees), meanRadiance,
                         plasticAlbedo(cosine, 0.5, kGlossIndex, rough.here), 2e-3, kEffort,
                         {{0.5, "there is no coat"}});
        context.estimate(fmt::format("white plastic of roughness {} here, {} elsewhere, at {}°", rough.here,
                                     rough.elsewhere, degrees),
                         checkeredFloor(plasticOf(1, rough.text()), degrees), meanRadiance, 1, 2e-3,
                         kEffort);
    }
    // Of a black base the gloss alone is seen.
    for (const ByPlace& rough : kGlosses) {
        const auto gloss = [&](double roughness) {
            return microfacetShares(cosine, kGlossIndex, roughness).reflected;
        };
        context.estimate(fmt::format("gloss of roughness {} on black, at {}°", rough.here, degrees),
                         checkeredFloor(plasticOf(0, rough.text()), degrees), meanRadiance,
                         gloss(rough.here), 5e-3, kEffort, {{0, "there is no gloss"}});
    }
}

void coats(Context& context, double degrees) {
    const double cosine = std::cos(degrees * kDegree);
    for (const auto& [base, coat] : {std::pair{ByPlace{0.3, 0.7}, ByPlace{0.55, 0.1}},
                                     {ByPlace{0.1, 0.1}, ByPlace{0.8, 0.2}},
                                     {ByPlace{0.2, 0.9}, ByPlace{0.4, 0.4}}}) {
        const Lacquer lacquer{.ior = 1.4, .roughness = coat.here, .base_roughness = base.here};
        const double gloss = lacquer.mirrored(cosine);
        const auto on_metal = [&](double roughness) {
            return gloss + (1 - gloss) * lacquer.darkened(cosine, 0.9 * 0.6) *
                               tintedMetalAlbedo(cosine, 0.6, 0.3, 0.9, roughness);
        };
        context.estimate(
            fmt::format("metal of roughness {} under a coat of roughness {}, at {}°", base.here, coat.here,
                        degrees),
            checkeredFloor(coated(fmt::format("base_color: 0.6, base_metalness: 1, specular_color: 0.3, "
                                              "specular_weight: 0.9, specular_roughness: {}",
                                              base.text()),
                                  coat.text()),
                           degrees),
            meanRadiance, on_metal(widened(base.here, coat.here)), 2e-3, kEffort,
            {{(1 - gloss) * lacquer.darkened(cosine, 0.9 * 0.6) *
                  tintedMetalAlbedo(cosine, 0.6, 0.3, 0.9, base.here),
              "the coat reflects nothing"}});
        // Gloss: its roughness counts for the light that the coat sends back by what it reflects straight
        // on.
        const double ratio = 2.4 / 1.4, f0 = fresnelDielectric(1, ratio);
        const auto on_gloss = [&](double base_roughness) {
            const Lacquer over{.ior = 1.4, .roughness = coat.here, .base_roughness = base_roughness};
            const auto mirrored = [&](double at) {
                return microfacetShares(at, ratio, widened(base.here, coat.here)).reflected;
            };
            const auto sent = [](double by_gloss) { return by_gloss + 0.5 * (1 - by_gloss); };
            const double dark = over.darkened(cosine, sent(mirrored(1)));
            return gloss + (1 - gloss) * dark * sent(mirrored(cosine));
        };
        context.estimate(
            fmt::format("gloss, roughness {} under a coat of {}, at {}°", base.here, coat.here, degrees),
            checkeredFloor(coated(fmt::format("base_color: 0.5, specular_ior: 2.4, "
                                              "specular_roughness: {}",
                                              base.text()),
                                  coat.text()),
                           degrees),
            meanRadiance, on_gloss(std::lerp(1.0, base.here, f0)), 2e-3, kEffort,
            {{on_gloss(base.here), "the base counts as rough as its gloss"}});
        for (const char* white :
             {"base_color: 1, specular_weight: 0", "base_color: 1", "base_color: 1, base_metalness: 1"})
            context.estimate(
                fmt::format("{}, of roughness {} under a coat of roughness {}, at {}°", white, base.here,
                            coat.here, degrees),
                checkeredFloor(
                    coated(fmt::format("{}, specular_roughness: {}", white, base.text()), coat.text()),
                    degrees),
                meanRadiance, 1, 2e-3, kEffort);
    }
}

void roughByPlace(Context& context) {
    for (const double degrees : {60.0, 0.0, 80.0}) {
        if (degrees != 60 && !context.atLeast(Level::Merge)) break;
        glosses(context, degrees);
        coats(context, degrees);
    }
    // On a table a texture says what a number says.
    const auto same = [&](const char* what, const std::string& by_place, const std::string& by_number) {
        context.sameBits(what, context.render(checkeredFloor(by_place, 40)),
                         context.render(checkeredFloor(by_number, 40)),
                         "a texture of one roughness gives different bits");
    };
    same("plastic", plasticOf(0.5, ByPlace{0.5625, 0.5625}.text()), plasticOf(0.5, "0.5625"));
    same("polished plastic", plasticOf(0.5, ByPlace{0, 0}.text()), plasticOf(0.5, "0"));
    same("a coat", coated("base_color: 0.5, specular_weight: 0", ByPlace{0.25, 0.25}.text()),
         coated("base_color: 0.5, specular_weight: 0", "0.25"));
}

}  // namespace

std::vector<Case> roughByPlaceCases() {
    return {row(
        "G45", "rough-by-place",
        "Gloss on plastic and coats on white, on gloss and on metal, in light from everywhere: their "
        "roughness is a checkerboard, seen in one of its squares from 60°, from level merge on also "
        "from two further angles; a checkerboard of one roughness",
        "what is mirrored, passed and darkened at the roughness of the square, by quadrature over "
        "normals; 1 for white; the bits of a number",
        "Walter et al. 2007; OpenPBR Surface 1.1", "± 0.2 %, ± 0.5 %; 0", Level::Commit,
        CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_COAT_TEXTURE | CRT_FEATURE_TEXTURE | CRT_FEATURE_CLEARCOAT |
            CRT_FEATURE_PLASTIC | CRT_FEATURE_ROUGH_CONDUCTOR | CRT_FEATURE_TABLE,
        roughByPlace)};
}

}  // namespace crt::verify
