// Group G, the part about the coats of openpbr materials.
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

namespace crt::verify {
namespace {

constexpr Effort kEffort{.samples = 256, .most = 65536};

std::string under(const Lacquer& coat, const std::string& base, double weight = 1) {
    return fmt::format("{{type: openpbr, {}, coat_weight: {}, coat_color: {}, coat_roughness: {}, "
                       "coat_ior: {}, coat_darkening: {}}}",
                       base, weight, coat.color, coat.roughness, coat.ior, coat.darkening);
}

/// Coats on Lambert's law, lit by beams.
void beamsOnCoats(Context& context) {
    const Vec3d view = unit({0.6, 0.2, 0.5});
    const double base = 0.7;
    const std::string lambert = fmt::format("specular_weight: 0, base_color: {}", base);
    for (const Lacquer& coat : {Lacquer{.ior = 1.6, .color = 0.4},
                                Lacquer{.ior = 1.3, .roughness = 0.5, .color = 0.8, .darkening = 0.5},
                                Lacquer{.ior = 1.8, .roughness = 1, .darkening = 0},
                                Lacquer{.ior = 1, .color = 0.5}})
        for (const Vec3d& light : {unit({0.5, 0.3, 0.4}), unit({-0.3, 0.5, 1}), unit({-0.9, -0.2, 0.3})}) {
            const double gloss = coat.roughness > 0 ? coat.reflection(view, light) : 0;
            const double diffuse = base * light[2] / std::numbers::pi;
            const double through = coat.below(view, light, base);
            const auto with = [&](double factor) { return gloss + factor * diffuse; };
            Lacquer bright = coat, plain = coat;
            bright.darkening = 0;
            plain.color = 1;
            context.relative(
                fmt::format("index {}, roughness {}, colour {}, darkening {}, a beam {:.0f}° from the view",
                            coat.ior, coat.roughness, coat.color, coat.darkening,
                            std::acos(dot(view, light)) / kDegree),
                inBeam(context, under(coat, lambert), view, light), with(through), 5e-4,
                {{with(bright.below(view, light, base)), "coat_darkening is left out"},
                 {with(plain.below(view, light, base) * coat.color),
                  "the coat's colour does not depend on the angle"},
                 {with(1), "the base is seen as without a coat"},
                 {through * diffuse, "the coat reflects nothing"}});
        }
    // Fuzz lies on the coat, and takes as much of it as of the base.
    const Lacquer coat{.ior = 1.5, .roughness = 0.6, .color = 0.6};
    const Vec3d light = unit({-0.3, 0.5, 1});
    const double taken = 0.75 * sheenAlbedo(view[2], 0.5);
    const double below = coat.reflection(view, light) +
                         coat.below(view, light, base) * base * light[2] / std::numbers::pi;
    context.relative("under fuzz",
                     inBeam(context,
                            under(coat, lambert + ", fuzz_weight: 0.75, fuzz_color: 0.8"), view, light),
                     0.8 * taken * sheenDensity(view, light, 0.5) + (1 - taken) * below, 5e-4,
                     {{0.8 * taken * sheenDensity(view, light, 0.5) + below, "the fuzz takes nothing"}});
}

/// In uniform light: nothing is lost over white, and the stated share over other colours.
void skies(Context& context) {
    constexpr const char* kWhite[] = {"base_color: 1", "base_color: 1, specular_weight: 0",
                                      "base_color: 1, base_metalness: 1, specular_roughness: 0",
                                      "base_color: 1, base_metalness: 1, specular_roughness: 0.6",
                                      "base_color: 1, base_diffuse_roughness: 1, fuzz_weight: 0.5"};
    const auto seen = [&](const std::string& what, const std::string& material, double degrees,
                          double expected) {
        context.estimate(fmt::format("{}, at {}°", what, degrees), floorOf(material, degrees), meanRadiance,
                         expected, 2e-3, kEffort);
    };
    for (const double degrees : {60.0, 0.0, 85.0}) {
        if (degrees != 60 && !context.atLeast(Level::Merge)) break;
        const double cosine = std::cos(degrees * kDegree);
        for (const double roughness : {0.0, 0.5}) {
            const Lacquer clear{.ior = 1.7, .roughness = roughness};
            for (const char* base : kWhite)
                seen(fmt::format("{} under a clear coat of roughness {}", base, roughness),
                     under(clear, base), degrees, 1);
            const Lacquer amber{.ior = 1.5, .roughness = roughness, .color = 0.5, .darkening = 0.75};
            seen(fmt::format("diffuse, 0.6, under an amber coat of roughness {}", roughness),
                 under(amber, "base_color: 0.6, specular_weight: 0"), degrees, amber.albedo(cosine, 0.6));
            // Metals: their roughness counts twice, for the light that they reflect and for the light that
            // the coat sends back.
            Lacquer coat{.ior = 1.4, .roughness = roughness, .base_roughness = 0.4};
            const double metal =
                tintedMetalAlbedo(cosine, 0.6, 0.3, 0.9, widened(coat.base_roughness, roughness));
            const auto on_metal = [&] {
                const double gloss = coat.mirrored(cosine);
                return gloss + (1 - gloss) * coat.darkened(cosine, 0.9 * 0.6) * metal;
            };
            seen(fmt::format("rough metal under a coat of roughness {}", roughness),
                 under(coat, "base_color: 0.6, base_metalness: 1, specular_color: 0.3, specular_weight: "
                             "0.9, specular_roughness: 0.4"),
                 degrees, on_metal());
        }
        // A mirror sends light back the way that it came, as far from the normal.
        const Lacquer red{.ior = 1.6, .color = 0.5, .base_roughness = 0};
        const double gloss = red.mirrored(cosine), passed = red.passed(cosine);
        seen("a polished metal under a tinted coat",
             under(red, "base_color: 0.8, base_metalness: 1, specular_roughness: 0"), degrees,
             gloss + (1 - gloss) * red.darkened(cosine, 0.8) * passed * passed * f82Tint(cosine, 0.8, 1));
        // Of the two ratios of the indices a gloss below the coat has the larger one. Its roughness, 0,
        // counts by what it reflects.
        for (const double ior : {2.4, 1.2}) {
            const double ratio = std::max(ior / 1.6, 1.6 / ior), f0 = fresnelDielectric(1, ratio);
            const Lacquer coat{.base_roughness = 1 - f0};
            const double mirrored = coat.mirrored(cosine), below = fresnelDielectric(cosine, ratio);
            const double base = f0 + 0.5 * (1 - f0);
            const auto with = [&](double through) {
                return mirrored + (1 - mirrored) * coat.darkened(cosine, base) * through;
            };
            seen(fmt::format("a gloss of index {} under a coat of 1.6", ior),
                 under(coat, fmt::format("base_color: 0.5, specular_roughness: 0, specular_ior: {}", ior)),
                 degrees, with(below + 0.5 * (1 - below)));
        }
        // A coat on part of the surface: the rest is bare.
        const Lacquer clear{.roughness = 0.5};
        seen("a quarter of a coat", under(clear, "base_color: 0.5, specular_weight: 0", 0.25), degrees,
             0.75 * 0.5 + 0.25 * clear.albedo(cosine, 0.5));
        // coat_darkening 0 keeps the colour of the base straight on, as the specification defines it.
        const Lacquer bright{.darkening = 0};
        seen("coat_darkening 0", under(bright, "base_color: 0.3, specular_weight: 0"), degrees,
             bright.mirrored(cosine) + (1 - bright.mirrored(cosine)) * 0.3);
    }
    // Both lobes are seen by light sampling, too.
    for (const auto& [technique, integrator] : kDirectTechniques) {
        Stage stage(eyeAt({0.2, 0.5, 0.6}, "[0.6, 0.3, 0.1]"), integrator);
        stage.material("it", under({.roughness = 0.5}, "base_metalness: 1, base_color: 1, "
                                                       "specular_roughness: 0"))
            .quad("it", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "it")
            .set("environment", "{radiance: 1, light_sampling: true}");
        context.estimate(fmt::format("on polished metal, {}", technique), stage.yaml(), meanRadiance, 1,
                         5e-3, kEffort);
    }
}

void coats(Context& context) {
    beamsOnCoats(context);
    skies(context);
    const Render how{.samples = 64};
    const auto same = [&](const char* what, const std::string& material, const std::string& without) {
        context.absolute(what,
                         radiance(context.render(floorOf(material, 40), how)) -
                             radiance(context.render(floorOf(without, 40), how)),
                         0, 0);
    };
    same("coat_weight 0", under({.roughness = 0.5, .color = 0.5}, "base_color: 0.5", 0),
         "{type: openpbr, base_color: 0.5}");
    same("a coat of the base's index has no gloss below",
         under({.ior = 1.5, .roughness = 0.5}, "base_color: 0.5, specular_roughness: 0.1"),
         under({.ior = 1.5, .roughness = 0.5}, "base_color: 0.5, specular_weight: 0"));
}

}  // namespace

std::vector<Case> openPbrCoatCases() {
    return {row(
        "G39", "openpbr-coat",
        "Coats, smooth and rough, clear and tinted, on diffuse floors under beams from three directions; "
        "on white of five kinds, on metals, glosses and in part in light from everywhere, from 60° and "
        "from level merge on also from two further angles; on metal, by light sampling, scattered rays and "
        "both; "
        "none",
        "the specification's formulas of what is mirrored, passed and darkened, by quadrature over normals "
        "and directions; 1 for white; the bare surface's bits",
        "OpenPBR Surface 1.1", "± 0.05 %, ± 0.2 %, ± 0.5 %; 0", Level::Commit,
        CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_ENVIRONMENT_LIGHT | CRT_FEATURE_POINT_LIGHT |
            CRT_FEATURE_CLEARCOAT | CRT_FEATURE_FUZZ | CRT_FEATURE_DIFFUSE | CRT_FEATURE_PLASTIC |
            CRT_FEATURE_ROUGH_CONDUCTOR | CRT_FEATURE_ROUGH_BASE | CRT_FEATURE_MIX | CRT_FEATURE_TABLE,
        coats)};
}

}  // namespace crt::verify
