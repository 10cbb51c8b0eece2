// Group G, the part about openpbr materials: metals by their colours, glossy bases, and that what is left
// when weights are 0 or 1 is crt's own material.
#include "judge/verify/context.h"
#include "judge/verify/references.h"
#include "judge/verify/scenes.h"

#include "kernel/features.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>

namespace crt::verify {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A floor of the material, seen at an angle in light 1 from everywhere.
std::string floorOf(const std::string& material, double degrees) {
    return Stage(fmt::format("{{position: [{:.17g}, {:.17g}, 0], target: [0, 0, 0], up: [0, 0, 1], "
                             "fov: 0.001}}",
                             std::sin(degrees * kDegree), std::cos(degrees * kDegree)))
        .material("it", material)
        .quad("it", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "it")
        .set("environment", "{radiance: 1}")
        .yaml();
}

void metals(Context& context) {
    const Render how{.samples = 1u << 12};
    const double edge = std::acos(1.0 / 7) / kDegree;
    const auto metal = [](double weight, double color, double tint, double factor, double roughness) {
        return fmt::format("{{type: openpbr, base_metalness: 1, base_weight: {}, base_color: {}, "
                           "specular_color: {}, specular_weight: {}, specular_roughness: {}}}",
                           weight, color, tint, factor, roughness);
    };
    const double weight = 0.5, color = 0.8, tint = 0.3, factor = 0.75;
    const double sky = radiance(
        context.render(Stage("{position: [0, 1, 0], target: [0, 0, 0], up: [0, 0, 1], fov: 0.001}")
                           .set("environment", "{radiance: 1}")
                           .yaml(),
                       how));
    for (const double degrees : {0.0, 60.0, edge, 89.0}) {
        const double cosine = std::cos(degrees * kDegree);
        const double schlick = 0.4 + 0.6 * std::pow(1 - cosine, 5);
        context.relative(
            fmt::format("polished, base 0.5 · 0.8, tint 0.3, weight 0.75, at {:.4g}°", degrees),
            radiance(context.render(floorOf(metal(weight, color, tint, factor, 0), degrees), how)) / sky,
            factor * f82Tint(cosine, 0.4, tint), 1e-5,
            {{f82Tint(cosine, 0.4, tint), "specular_weight is left out"},
             {factor * f82Tint(cosine, 0.8, tint), "base_weight is left out"},
             {factor * schlick, "specular_color is left out"}});
        context.relative(fmt::format("polished, white, at {:.4g}°", degrees),
                         radiance(context.render(floorOf(metal(1, 1, 1, 1, 0), degrees), how)) / sky, 1,
                         2e-6);
    }
    for (const double roughness : {0.4, 0.8, 1.0})
        for (const double degrees : {0.0, 60.0, 85.0}) {
            const double cosine = std::cos(degrees * kDegree);
            context.relative(
                fmt::format("roughness {}, tint 0.3, at {}°", roughness, degrees),
                radiance(context.render(floorOf(metal(weight, color, tint, factor, roughness), degrees),
                                        how)),
                tintedMetalAlbedo(cosine, 0.4, tint, factor, roughness), 2e-3,
                {{tintedMetalAlbedo(cosine, 0.4, 1, factor, roughness), "specular_color is left out"}});
            context.relative(
                fmt::format("roughness {}, white, at {}°", roughness, degrees),
                radiance(context.render(floorOf(metal(1, 1, 1, 1, roughness), degrees), how)), 1, 2e-3);
        }
}

void limits(Context& context) {
    // What comes out of a gloss has the colour that is said; what it reflects is white, and comes first.
    const Render how{.samples = 1u << 12};
    for (const double roughness : {0.0, 0.5})
        for (const double degrees : {0.0, 60.0, 80.0})
            for (const double color : {0.5, 1.0}) {
                const double gloss =
                    microfacetShares(std::cos(degrees * kDegree), 1.5, roughness).reflected;
                context.relative(
                    fmt::format("glossy, base_color {}, roughness {}, at {}°", color, roughness, degrees),
                    radiance(context.render(
                        floorOf(fmt::format("{{type: openpbr, base_color: {}, specular_roughness: {}}}",
                                            color, roughness),
                                degrees),
                        how)),
                    gloss + (1 - gloss) * color, 2e-3,
                    {{plasticAlbedo(std::cos(degrees * kDegree), color, 1.5, roughness),
                      "base_color is that of the base, not of what is seen of it"}});
            }
    for (const double weight : {0.25, 2.0})
        context.relative(
            fmt::format("black under a gloss, specular_weight {}, straight on", weight),
            radiance(context.render(
                floorOf(fmt::format(
                            "{{type: openpbr, base_color: 0, specular_roughness: 0, specular_weight: {}}}",
                            weight),
                        0),
                {.samples = 1u << 14})),
            0.04 * weight, 2e-3, {{0.04, "specular_weight is left out"}});
    context.estimate("a quarter of metal",
                     floorOf("{type: openpbr, base_color: 0.6, base_metalness: 0.25, specular_roughness: "
                             "0.5}",
                             60),
                     meanRadiance,
                     [] {
                         const double gloss = microfacetShares(0.5, 1.5, 0.5).reflected;
                         return 0.75 * (gloss + (1 - gloss) * 0.6) +
                                0.25 * tintedMetalAlbedo(0.5, 0.6, 1, 1, 0.5);
                     }(),
                     2e-3, {.samples = 1024, .most = 65536});
    // The same bits, in which nothing is left of the other slabs.
    const auto same = [&](const char* what, const std::string& keys, const std::string& material) {
        const auto seen = [&](const std::string& m) {
            Stage stage("{position: [0.2, 3, 4], target: [0.5, 0.5, 0.5], fov: 20}",
                        "{max_depth: 12, roulette: false}");
            stage.set("environment", "{radiance: {blackbody: 5000}}")
                .set("film", "{resolution: [8, 8]}")
                .material("floor", "{type: diffuse, reflectance: {rgb: [0.8, 0.3, 0.1], space: linear}}")
                .material("it", m)
                .quad("floor", "[[-4,-0.5,-4],[-4,-0.5,4],[4,-0.5,4],[4,-0.5,-4]]", "floor")
                .box("cube", {0, 0, 0}, {1, 1, 1}, "it");
            return radiance(context.render(stage.yaml(), samples(16)));
        };
        context.absolute(what, seen("{type: openpbr, " + keys + "}") - seen(material), 0, 0);
    };
    same("specular_weight 0 is diffuse", "specular_weight: 0, base_color: 0.6",
         "{type: diffuse, reflectance: 0.6}");
    same("a white base is white plastic", "base_color: 1, specular_roughness: 0.4, specular_ior: 1.6",
         "{type: plastic, reflectance: 1, roughness: 0.4, ior: 1.6}");
    same("transmission_weight 1 is glass", "transmission_weight: 1, specular_roughness: 0",
         "{type: dielectric, ior: 1.5}");
    same("rough and anisotropic",
         "transmission_weight: 1, specular_roughness: 0.5, specular_roughness_anisotropy: 0.5",
         "{type: rough_dielectric, ior: 1.5, roughness: 0.5, roughness_anisotropy: 0.5}");
    same("transmission_color 0.5 at depth 2",
         "transmission_weight: 1, specular_roughness: 0.5, transmission_color: 0.5, transmission_depth: 2",
         fmt::format("{{type: rough_dielectric, ior: 1.5, roughness: 0.5, absorption: {:.17g}}}",
                     std::numbers::ln2 / 2));
    same("a film of 0.3 µm",
         "transmission_weight: 1, specular_roughness: 0, thin_film_weight: 1, thin_film_thickness: 0.3, "
         "thin_film_ior: 1.3",
         "{type: dielectric, ior: 1.5, thin_film: {thickness_nm: 300, ior: 1.3}}");
    for (const auto& [key, word] : {std::pair{"subsurface_weight: 0.5", "wanders below"},
                                    std::pair{"coat_weight: 1", "no coats"},
                                    std::pair{"fuzz_weight: 1", "no fuzz"},
                                    std::pair{"emission_luminance: 10", "emission from objects"}})
        context.refused(key, fmt::format("crt: 1\nmaterials: {{it: {{type: openpbr, {}}}}}\n", key), word);
}

}  // namespace

std::vector<Case> openPbrCases() {
    constexpr std::uint64_t seen = CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_OPENPBR;
    return {
        row("G32", "openpbr-metal",
            "Metals by base_color, specular_color and their weights, polished at four angles, one of them "
            "82°; rough at three; white ones",
            "F82-tint's curve; its quadrature over the normals, what is lost given back; 1",
            "OpenPBR Surface 1.1; Kutz, Hasan and Edmondson (2021)", "1e-5; ± 0.2 %", Level::Commit,
            seen | CRT_FEATURE_ROUGH_CONDUCTOR, metals),
        row("G33", "openpbr-limits",
            "Glossy bases at three angles, a mix with metal; what is left when weights are 0 or 1, beside "
            "crt's own material; what crt has not",
            "E + (1 − E) · base_color; shares of the mix; the same bits; a refusal",
            "OpenPBR Surface 1.1", "± 0.2 %; 0", Level::Commit,
            seen | CRT_FEATURE_PLASTIC | CRT_FEATURE_ROUGH_CONDUCTOR | CRT_FEATURE_MIX |
                CRT_FEATURE_DIFFUSE | CRT_FEATURE_DIELECTRIC | CRT_FEATURE_ROUGH_DIELECTRIC |
                CRT_FEATURE_ANISOTROPY | CRT_FEATURE_ABSORPTION | CRT_FEATURE_THIN_FILM |
                CRT_FEATURE_TABLE,
            limits),
    };
}

}  // namespace crt::verify
