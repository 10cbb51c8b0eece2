// Group G, the part about openpbr materials: metals by their colours, glossy bases, and that what is left
// when weights are 0 or 1 is crt's own material.
#include "verify/context.h"
#include "verify/floors.h"
#include "verify/references.h"
#include "verify/scenes.h"
#include "verify/shapes.h"

#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

namespace crt::verify {
namespace {

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
    // Light out of a gloss has the colour of the scene file; light that the gloss reflects is white, and
    // comes first.
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
                     2e-3, {.samples = 256, .most = 65536});
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
}

/// Luminance that a number of the film is of, cd/m²: Y is in units of 683 lm/W · ∫ȳ dλ.
constexpr double kUnitLuminance = 683.002 * 106.856895;

void emission(Context& context) {
    const auto lamp = [](const std::string& keys) {
        return "{type: openpbr, base_color: 0, specular_weight: 0, " + keys + "}";
    };
    const auto sheet = [&](const std::string& material, const char* camera) {
        return Stage(camera)
            .material("it", material)
            .quad("it", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "it")
            .yaml();
    };
    constexpr const char* above = "{position: [0, 3, 1], target: [0, 0, 0], fov: 1}";
    constexpr const char* below = "{position: [0, -3, 1], target: [0, 0, 0], fov: 1}";
    const Render how{.samples = 1u << 12};
    const auto candela_m2 = [&](const std::string& yaml) {
        return luminance(context.render(yaml, how)) * kUnitLuminance;
    };
    context.relative("300 cd/m² of white, seen from the front",
                     candela_m2(sheet(lamp("emission_luminance: 300"), above)), 300, 2e-3,
                     {{300 * kUnitLuminance, "the luminance is taken for the radiance"}});
    context.relative(
        "an emission_color of Y 0.3",
        candela_m2(sheet(lamp("emission_luminance: 300, "
                             "emission_color: {rgb: [0.3, 0.3, 0.3], space: linear}"),
                         above)),
        90, 2e-3, {{300, "the luminance is that of the colour, whatever it is"}});
    context.absolute("from behind", candela_m2(sheet(lamp("emission_luminance: 300"), below)), 0, 0);
    // A lamp of the material is one of the object: light sampling finds it.
    for (const auto& [technique, integrator] : kDirectTechniques) {
        Stage stage("{position: [0, 1, 3], target: [0, 0, 0], fov: 0.01}", integrator);
        stage.material("it", lamp("emission_luminance: 300"))
            .material("floor", "{type: diffuse, reflectance: 1}")
            .quad("it", "[[-0.5,1,-0.5],[0.5,1,-0.5],[0.5,1,0.5],[-0.5,1,0.5]]", "it")
            .quad("floor", "[[-9,0,-9],[-9,0,9],[9,0,9],[9,0,-9]]", "floor");
        context.estimate(fmt::format("a floor under it, {}", technique), stage.yaml(),
                         [](const Film& film) { return luminance(film); },
                         300 / kUnitLuminance * squareFormFactor(0, 0.5), 2e-3,
                         {.samples = 256, .most = 65536});
    }
}

void roughDiffuse(Context& context) {
    const Render how{.samples = 1u << 12};
    const Vec3d view = unit({0.6, 0.2, 0.5});
    // From where the viewer is, beside him, and from the other side.
    for (const Vec3d& light : {unit({0.5, 0.3, 0.4}), unit({-0.3, 0.5, 1}), unit({-0.9, -0.2, 0.3})})
        for (const auto& [rho, r] : {std::pair{0.8, 1.0}, std::pair{1.0, 0.3}}) {
            const auto floor = [&](const std::string& material) {
                return inBeam(context, material, view, light);
            };
            const double expected = eonReflection(view, light, rho, r);
            context.relative(
                fmt::format("reflectance {}, roughness {}, a beam {:.0f}° from the view", rho, r,
                            std::acos(dot(view, light)) / kDegree),
                floor(fmt::format("{{type: diffuse, reflectance: {}, roughness: {}}}", rho, r)), expected,
                2e-4, {{rho * light[2] / std::numbers::pi, "the surface is Lambert's"}});
            context.relative(
                "the same by openpbr",
                floor(fmt::format("{{type: openpbr, specular_weight: 0, base_color: {}, "
                                  "base_diffuse_roughness: {}}}",
                                  rho, r)),
                expected, 2e-4);
        }
    for (const double r : {0.2, 1.0})
        for (const double degrees : {0.0, 60.0, 85.0}) {
            const double cosine = std::cos(degrees * kDegree);
            const auto seen = [&](const char* material, double rho) {
                return radiance(
                    context.render(floorOf(fmt::format(fmt::runtime(material), rho, r), degrees), how));
            };
            constexpr const char* bare = "{{type: diffuse, reflectance: {}, roughness: {}}}";
            constexpr const char* gloss = "{{type: openpbr, base_color: {}, base_diffuse_roughness: {}, "
                                          "specular_roughness: 0}}";
            constexpr const char* satin = "{{type: openpbr, base_color: {}, base_diffuse_roughness: {}, "
                                          "specular_roughness: 0.5}}";
            context.relative(fmt::format("roughness {}, white, at {}°", r, degrees), seen(bare, 1), 1,
                             2e-3);
            context.relative(fmt::format("roughness {}, 0.5, at {}°", r, degrees), seen(bare, 0.5),
                             eonAlbedo(cosine, 0.5, r), 2e-3);
            context.relative(fmt::format("roughness {} under a gloss, white, at {}°", r, degrees),
                             seen(gloss, 1), 1, 2e-3);
            context.relative(fmt::format("roughness {} under satin, white, at {}°", r, degrees),
                             seen(satin, 1), 1, 2e-3);
            context.relative(fmt::format("roughness {} under a gloss, 0.5, at {}°", r, degrees),
                             seen(gloss, 0.5), glossyEonAlbedo(cosine, 0.5, r, 1.5), 2e-3);
        }
}

void fuzz(Context& context) {
    const Vec3d view = unit({0.6, 0.2, 0.5});
    const double weight = 0.75, color = 0.8;
    const auto on = [&](const char* base, double w, double c, double roughness) {
        return fmt::format("{{type: openpbr, {}, fuzz_weight: {}, fuzz_color: {}, fuzz_roughness: {}}}",
                           base, w, c, roughness);
    };
    constexpr const char* black = "base_color: 0, specular_weight: 0";
    constexpr const char* white = "base_color: 1, specular_weight: 0";
    for (const double roughness : {0.2, 0.5, 1.0})
        for (const Vec3d& light : {unit({0.5, 0.3, 0.4}), unit({-0.3, 0.5, 1}), unit({-0.9, -0.2, 0.3})}) {
            const double angle = std::acos(dot(view, light)) / kDegree;
            const double taken = weight * sheenAlbedo(view[2], roughness);
            const double sheen = color * taken * sheenDensity(view, light, roughness);
            const auto seen = [&](const char* base) {
                return inBeam(context, on(base, weight, color, roughness), view, light);
            };
            context.relative(fmt::format("on black, roughness {}, a beam {:.0f}° from the view", roughness,
                                         angle),
                             seen(black), sheen, 2e-4,
                             {{sheen / weight, "fuzz_weight is left out"}});
            context.relative(fmt::format("on white, roughness {}, a beam {:.0f}° from the view", roughness,
                                         angle),
                             seen(white), sheen + (1 - taken) * light[2] / std::numbers::pi, 2e-4,
                             {{sheen + light[2] / std::numbers::pi, "the base is not darkened"}});
        }
    const Render how{.samples = 1u << 12};
    constexpr const char* kBases[] = {"base_color: 1", white,
                                      "base_metalness: 1, base_color: 1, specular_roughness: 0",
                                      "base_metalness: 1, base_color: 1, specular_roughness: 0.6",
                                      "transmission_weight: 1, specular_roughness: 0",
                                      "transmission_weight: 1, specular_roughness: 0.5"};
    for (const double degrees : {0.0, 60.0, 85.0})
        for (const double roughness : {0.3, 1.0}) {
            for (const char* base : kBases) {
                const bool clear = std::string_view(base).starts_with("transmission");
                const double angle = degrees * kDegree;
                Stage stage(eyeAt({std::sin(angle), std::cos(angle), 0}, "[0, 0, 1]"),
                            clear ? "{max_depth: 400, roulette: false}" : kDirect);
                stage.set("environment", "{radiance: 1, light_sampling: true}")
                    .material("it", on(base, 1, 1, roughness));
                if (clear && !context.atLeast(Level::Merge)) continue;
                if (clear) stage.box("it", {-2, -1, -2}, {2, 0, 2}, "it");
                else stage.quad("it", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "it");
                context.estimate(fmt::format("white on {}, roughness {}, at {}°", base, roughness, degrees),
                                 stage.yaml(), meanRadiance, 1, 5e-3, {.samples = 256, .most = 65536});
            }
            context.relative(fmt::format("grey on black, roughness {}, at {}°", roughness, degrees),
                             radiance(context.render(floorOf(on(black, weight, color, roughness), degrees),
                                                     how)),
                             weight * color * sheenAlbedo(std::cos(degrees * kDegree), roughness), 2e-3);
        }
    // From inside there is none: of a clear body of index 1 black fuzz takes its share once, where light
    // comes in, and nothing of what is seen by an eye within.
    for (const double degrees : {0.0, 50.0}) {
        const double cosine = std::cos(degrees * kDegree);
        const double kept = 1 - weight * sheenAlbedo(cosine, 0.5);
        const auto body = [&, degrees = degrees](double distance) {
            Stage stage(
                fmt::format("{{position: [{:.17g}, {:.17g}, 0], target: [0, 0, 0], up: [0, 0, 1], fov: "
                            "0.001}}",
                            distance * std::sin(degrees * kDegree), distance * cosine),
                "{max_depth: 8, roulette: false}");
            return stage.set("environment", "{radiance: 1}")
                .material("it", on("transmission_weight: 1, specular_roughness: 0, specular_ior: 1", weight,
                                   0, 0.5))
                .box("it", {-4, -1, -4}, {4, 0, 4}, "it")
                .yaml();
        };
        context.estimate(fmt::format("black on a clear body, at {}°", degrees), body(1), meanRadiance, kept,
                         5e-3, {.samples = 256, .most = 65536},
                         {{kept * kept, "there is fuzz on the inside, too"}});
        context.estimate(fmt::format("black on a clear body, seen from within, at {}°", degrees),
        body(-0.5),
                         meanRadiance, 1, 1e-3, {.samples = 256, .most = 65536},
                         {{kept, "there is fuzz on the inside, too"}});
    }
    // A mirror under fuzz is seen by light sampling, too.
    for (const auto& [technique, integrator] : kDirectTechniques) {
        Stage stage(eyeAt({view[1], view[2], view[0]}, "[0.6, 0.3, 0.1]"), integrator);
        stage.material("it", on("base_metalness: 1, base_color: 1, specular_roughness: 0", 1, 1, 0.5))
            .quad("it", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "it")
            .set("environment", "{radiance: 1, light_sampling: true}");
        context.estimate(fmt::format("on a mirror, {}", technique), stage.yaml(), meanRadiance, 1, 5e-3,
                         {.samples = 256, .most = 65536});
    }
}

/// The index at a wavelength of Cauchy's two terms that have n_d and Abbe's number
/// V = (n_d − 1)/(n_F − n_C); lines at 587.6, 486.1 and 656.3 nm.
double cauchyOfAbbe(double n_d, double abbe, double nm) {
    const auto inverse_square = [](double line) { return 1e6 / (line * line); };
    const double b = (n_d - 1) / abbe / (inverse_square(486.1) - inverse_square(656.3));
    return n_d + b * (inverse_square(nm) - inverse_square(587.6));
}

void dispersion(Context& context) {
    // The light that a floor mirrors straight on gives its index in each bin; black below it absorbs the
    // rest.
    constexpr double kMiddle = 1.5, kAbbe = 4, kScale = 0.5, kFrom = 400, kTo = 700;
    constexpr std::uint32_t kBins = 6;
    const std::string scene =
        Stage(eyeAt({0, 1, 0}, "[0, 0, 1]"), kDirect)
            .set("film",
                 fmt::format("{{resolution: [4, 4], spectral: {{from_nm: {}, to_nm: {}, bins: {}}}}}", kFrom,
                             kTo, kBins))
            .set("environment", "{radiance: 1}")
            .material("it", fmt::format("{{type: openpbr, transmission_weight: 1, specular_roughness: 0, "
                                        "specular_ior: {}, transmission_dispersion_scale: {}, "
                                        "transmission_dispersion_abbe_number: {}}}",
                                        kMiddle, kScale, kAbbe))
            .material("black", "{type: diffuse, reflectance: 0}")
            .quad("it", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "it")
            .quad("bottom", "[[-9,-1,-9],[-9,-1,9],[9,-1,9],[9,-1,-9]]", "black")
            .yaml();
    std::vector<Quantity> quantities;
    for (std::uint32_t bin = 0; bin < kBins; ++bin) {
        const double width = (kTo - kFrom) / kBins, lower = kFrom + bin * width;
        double expected = 0;
        constexpr int kParts = 50;
        for (int i = 0; i < kParts; ++i)
            expected += fresnelDielectric(
                            1, cauchyOfAbbe(kMiddle, kAbbe / kScale, lower + width * (i + 0.5) / kParts)) /
                        kParts;
        quantities.push_back(
            {fmt::format("Abbe's number {} / {}, {:.0f} to {:.0f} nm", kAbbe, kScale, lower, lower + width),
             [bin](const std::vector<Film>& films) { return meanOfBin(films[0], bin); }, expected});
    }
    context.estimate(quantities, {scene}, 0.01, {.samples = 256, .most = 65536},
                     {{fresnelDielectric(1, kMiddle), "the index is the same at all wavelengths"}});
}

}  // namespace

std::vector<Case> openPbrCases() {
    return {
        row("G22", "openpbr-dispersion",
            "A clear floor of index 1.5 and Abbe's number 4 at a scale of 0.5: what it mirrors straight on "
            "in six bins of wavelengths",
            "Fresnel's reflectance at Cauchy's index of Abbe's number 8",
            "OpenPBR Surface 1.1; the definition of Abbe's number", "± 1 %", Level::Commit,
            CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_DIELECTRIC | CRT_FEATURE_DISPERSION |
                CRT_FEATURE_SPECTRAL_FILM,
            dispersion),
        row("G32", "openpbr-metal",
            "Metals by base_color, specular_color and their weights, polished at four angles, one of them "
            "82°; rough at three; white ones",
            "F82-tint's curve; its quadrature over the normals, what is lost given back; 1",
            "OpenPBR Surface 1.1; Kutz, Hasan and Edmondson (2021)", "1e-5; ± 0.2 %", Level::Commit,
            CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_ROUGH_CONDUCTOR, metals),
        row("G33", "openpbr-limits",
            "Glossy bases at three angles, a mix with metal; what is left when weights are 0 or 1, beside "
            "crt's own material",
            "E + (1 − E) · base_color; shares of the mix; the same bits",
            "OpenPBR Surface 1.1",
            "± 0.2 %; 0", Level::Commit,
            CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_PLASTIC | CRT_FEATURE_ROUGH_CONDUCTOR | CRT_FEATURE_MIX |
                CRT_FEATURE_DIFFUSE | CRT_FEATURE_DIELECTRIC | CRT_FEATURE_ROUGH_DIELECTRIC |
                CRT_FEATURE_ANISOTROPY | CRT_FEATURE_MEDIA | CRT_FEATURE_THIN_FILM | CRT_FEATURE_TABLE,
            limits),
        row("G36", "openpbr-emission",
            "A sheet of emission_luminance 300 seen from both sides, white and of a darker emission_color; "
            "a floor under it, by light sampling, scattered rays and both",
            "cd/m² over 683 lm/W and the integral of ȳ; the form factor of a square",
            "OpenPBR Surface 1.1; CIE 15:2018", "± 0.2 %; 0", Level::Commit,
            CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_DIFFUSE | CRT_FEATURE_NEE, emission),
        row("G37", "rough-diffuse",
            "Rough diffuse floors under beams from three directions; bare, under a gloss and under satin at "
            "three angles in light from everywhere, white and grey",
            "EON's closed forms; 1 for white; quadrature over directions under a gloss",
            "Portsmouth, Kutz and Hill (2025)", "± 0.02 %, ± 0.2 %", Level::Commit,
            CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_PLASTIC | CRT_FEATURE_ROUGH_BASE |
                CRT_FEATURE_POINT_LIGHT | CRT_FEATURE_TABLE,
            roughDiffuse),
        row("G38", "fuzz",
            "Fuzz on black and white floors under beams from three directions; on what is diffuse, glossy, "
            "metal and, from level merge on, clear, at three angles in light from everywhere; on a mirror, "
            "by "
            "light sampling, scattered rays and both; on a clear body, and seen from within it",
            "the linearly transformed cosine and its albedo; what is below times 1 less that; 1; "
            "nothing from within",
            "Zeltner, Burley and Chiang (2022); OpenPBR Surface 1.1", "± 0.02 %, ± 0.2 %, ± 0.5 %",
            Level::Commit,
            CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_ENVIRONMENT_LIGHT | CRT_FEATURE_FUZZ |
                CRT_FEATURE_POINT_LIGHT | CRT_FEATURE_DIFFUSE | CRT_FEATURE_ROUGH_CONDUCTOR |
                CRT_FEATURE_DIELECTRIC,
            fuzz),
    };
}

}  // namespace crt::verify
