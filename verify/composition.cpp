// Group G, the part about surfaces that are there in part, and materials made of others.
#include "base/temporary_folder.h"
#include "base/vec3d.h"
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"

#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace crt::verify {
namespace {

constexpr const char* kDown = "{position: [0.1, 2, 0.05], target: [0.1, 0, 0.05], up: [0, 0, 1], fov: 0.01}";

/// A square with (u, v) = ((x + 8) / 16, (z + 8) / 16), at height y.
Stage& sheet(Stage& stage, double y, const char* material, const char* radiance = "") {
    return stage.mesh(fmt::format("sheet at {}", y),
                      fmt::format("[[-8,{0},-8],[-8,{0},8],[8,{0},8],[8,{0},-8]], uvs: [[0,0],[0,1],[1,1],"
                                  "[1,0]]",
                                  y),
                      "[[0,1,2,3]]", material, radiance);
}

std::string black(const std::string& opacity) {
    return fmt::format("{{type: diffuse, reflectance: 0, opacity: {}}}", opacity);
}

void sheets(Context& context) {
    const Effort effort{.samples = 64, .most = 65536};
    // Camera rays pass sheets without being scattered, so a depth of 0 suffices.
    for (const int count : {1, 4})
        for (const double opacity : {0.0, 0.3, 1.0}) {
            Stage stage(kDown, "{max_depth: 0}");
            stage.set("environment", "{radiance: 1}").material("veil", black(fmt::format("{}", opacity)));
            for (int i = 0; i < count; ++i) sheet(stage, 0.1 * i, "veil");
            if (opacity == 1)
                context.relative(fmt::format("{} opaque sheets", count),
                                 radiance(context.render(stage.yaml())), 0, 0);
            else context.estimate(fmt::format("{} sheets of opacity {}, seen through", count, opacity),
                             stage.yaml(), meanRadiance, std::pow(1 - opacity, count), 0.005, effort,
                             {{1 - opacity, "one sheet alone stops light, or all decide alike"}});
        }
    // Sheets between a floor and its light: a lamp, a light without a surface, the surroundings.
    for (const auto& [name, integrator] : kDirectTechniques)
        for (const int count : {3, 1}) {
            constexpr double kOpacity = 0.4;
            if (count == 1 && !context.atLeast(Level::Merge)) continue;
            const auto lit = [&, integrator = integrator](const std::string& opacity, const char* lamp) {
                Stage stage("{position: [9, 0.05, 0], target: [0.1, 0, 0], fov: 0.01}", integrator);
                stage.material("floor", "{type: diffuse, reflectance: 1}").material("veil", black(opacity))
                    .material("black", "{type: diffuse, reflectance: 0}")
                    .quad("floor", "[[-9,0,-9],[-9,0,9],[9,0,9],[9,0,-9]]", "floor");
                for (int i = 0; i < count; ++i) sheet(stage, 0.2 + 0.2 * i, "veil");
                if (lamp[0] == '{') return stage.set("lights", fmt::format("[{}]", lamp)).yaml();
                if (lamp[0] == 'r') return stage.set("environment", fmt::format("{{{}}}", lamp)).yaml();
                return stage.quad("lamp", "[[-1,1,-1],[1,1,-1],[1,1,1],[-1,1,1]]", "black", lamp).yaml();
            };
            const auto ratio = [](const std::vector<Film>& f) { return radiance(f[0]) / radiance(f[1]); };
            for (const char* lamp : {"1", "radiance: 1, light_sampling: true",
                                     "{type: point, position: [0, 1, 0], radiant_intensity: 1}"}) {
                if (lamp[0] == '{' && name[0] == 's') continue;  // scattered rays find no points
                const double kept = std::pow(1 - kOpacity, count);
                context.estimate(fmt::format("through {} sheets, lit by {{{}}}, {}", count, lamp, name),
                                 {lit(fmt::format("{}", kOpacity), lamp), lit("0", lamp)}, ratio, kept,
                                 0.02, effort,
                                 {{0, "shadow rays do not pass what others pass"},
                                  {1, "shadow rays pass everything"},
                                  {1 - kOpacity, "shadow rays pass all but one sheet"}});
            }
        }
}

void texturedOpacity(Context& context) {
    // Squares of a quarter: 0.25 where the camera looks down, 0.75 where the light comes down.
    const char* checker = "{checker: [0.25, 0.75], scale: 32}";
    const auto expectedAt = [](double x, double z) {
        const double s = std::floor((x + 8) * 2), t = std::floor((z + 8) * 2);
        return std::fmod(s + t, 2) == 0 ? 0.25 : 0.75;
    };
    const Effort effort{.samples = 64, .most = 65536};
    for (const double x : {0.1, 0.6, 1.1}) {
        Stage stage(fmt::format("{{position: [{0}, 2, 0.05], target: [{0}, 0, 0.05], up: [0, 0, 1], fov: "
                                "0.01}}",
                                x),
                    "{max_depth: 0}");
        sheet(stage.set("environment", "{radiance: 1}").material("veil", black(checker)), 1, "veil");
        context.estimate(fmt::format("a checker at x = {}, seen through", x), stage.yaml(), meanRadiance,
                         1 - expectedAt(x, 0.05), 0.005, effort,
                         {{expectedAt(x, 0.05), "opacity is transparency"}});
        // Seen from the side, below the sheet, under a light from straight above.
        Stage below(fmt::format("{{position: [{0}, 0.5, -0.5], target: [{0}, 0, 0.05], fov: 0.01}}", x));
        below.set("lights", "[{type: directional, direction: [0, -1, 0], irradiance: 1}]")
            .material("veil", black(checker))
            .material("floor", "{type: diffuse, reflectance: 1}")
            .quad("floor", "[[-8,0,-8],[-8,0,8],[8,0,8],[8,0,-8]]", "floor");
        context.estimate(fmt::format("a checker at x = {}, lit through", x),
                         sheet(below, 1, "veil").yaml(), meanRadiance, (1 - expectedAt(x, 0.05)) / kPi,
                         0.005, effort, {{expectedAt(x, 0.05) / kPi, "opacity is transparency"}});
    }
}

void cutoffs(Context& context) {
    // Texels of 0.25, 0.5 and 0.75, those from 0.5 on there by 0.6; between the first two half of that.
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/leaf.pfm";
    std::vector<float> rgb;
    for (const float grey : {0.25f, 0.5f, 0.75f}) rgb.insert(rgb.end(), 3, grey);
    writeRgb(path, OutputFormat::Pfm, 3, 1, rgb);
    struct Place {
        double u, there, before;  ///< The opacity; and were it cut off after filtering, or not at all.
    };
    for (const Place& place :
         {Place{1.0 / 6, 0, 0.15}, {1.0 / 2, 0.6, 0.3}, {5.0 / 6, 0.6, 0.45}, {1.0 / 3, 0.3, 0}}) {
        const double x = 16 * place.u - 8;
        Stage stage(fmt::format("{{position: [{0}, 2, 0.05], target: [{0}, 0, 0.05], up: [0, 0, 1], fov: "
                                "1e-4}}",
                                x),
                    "{max_depth: 0}");
        stage.set("environment", "{radiance: 1}")
            .material("leaf",
                      black(fmt::format("{{texture: '{}', cutoff: 0.5, factor: 0.6, wrap: clamp}}", path)));
        context.estimate(fmt::format("a cutoff of 0.5 at u = {:.3f}, seen through", place.u),
                         sheet(stage, 1, "leaf").yaml(), meanRadiance, 1 - place.there, 0.005,
                         {.samples = 64, .most = 65536},
                         {{1 - place.before, "texels are not cut off, or after they are filtered"}});
    }
}

void emittersWithHoles(Context& context) {
    const Effort effort{.samples = 64, .most = 65536};
    constexpr double kOpacity = 0.3;
    for (const auto& [name, integrator] : kDirectTechniques) {
        const auto lit = [&, integrator = integrator](double opacity) {
            Stage stage("{position: [9, 0.05, 0], target: [0.1, 0, 0], fov: 0.01}", integrator);
            stage.material("floor", "{type: diffuse, reflectance: 1}")
                .material("lamp", black(fmt::format("{}", opacity)))
                .quad("floor", "[[-9,0,-9],[-9,0,9],[9,0,9],[9,0,-9]]", "floor")
                .quad("lamp", "[[-1,1,-1],[1,1,-1],[1,1,1],[-1,1,1]]", "lamp", "1");
            return stage.yaml();
        };
        context.estimate(fmt::format("a lamp of opacity {}, {}", kOpacity, name), {lit(kOpacity), lit(1)},
                         [](const std::vector<Film>& f) { return radiance(f[0]) / radiance(f[1]); },
                         kOpacity, 0.01, effort,
                         {{1, "light sampling does not know of holes in lamps"},
                          {kOpacity * kOpacity, "holes in lamps count twice"}});
    }
    // Ends of the range: all of it, and none.
    const auto room = [](const char* opacity) {
        Stage stage("{position: [0.2, 3, 4], target: [0, 0.4, 0], fov: 20}",
                    "{max_depth: 3, roulette: false}");
        stage.set("film", "{resolution: [8, 8]}").set("environment", "{radiance: 1}")
            .material("floor", "{type: diffuse, reflectance: 0.5}")
            .quad("floor", "[[-8,-0.5,-8],[-8,-0.5,8],[8,-0.5,8],[8,-0.5,-8]]", "floor")
            .quad("wall", "[[-8,1,-8],[-8,-0.5,-8],[8,-0.5,-8],[8,1,-8]]", "floor");
        if (opacity[0] != '-')
            stage.material("red", fmt::format("{{type: diffuse, reflectance: 0.8{}}}", opacity))
                .box("box", {-0.5, 0, -0.5}, {0.5, 0.8, 0.5}, "red");
        return stage.yaml();
    };
    context.sameBits("opacity 1, and none", context.render(room(", opacity: 1")), context.render(room("")),
                     "an opacity of 1 is not the default");
    const Film absent = context.render(room("-")), holes = context.render(room(", opacity: 0"));
    context.relative("opacity 0 over nothing there", radiance(holes) / radiance(absent), 1, 1e-4);
}

void mixes(Context& context) {
    const auto floor = [](const char* integrator, const std::string& material, const char* light = "") {
        Stage stage("{position: [0.3, 0.6, 0.2], target: [0, 0, 0], fov: 0.01}", integrator);
        stage.material("light", "{type: diffuse, reflectance: 0.8}")
            .material("dark", "{type: diffuse, reflectance: 0.2}")
            .material("gold", "{type: conductor, eta: 0.4, k: 2.5}")
            .material("satin", "{type: rough_conductor, eta: 0.4, k: 2.5, roughness: 0.5}")
            .material("inner", "{type: mix, materials: [light, dark], amount: 0.75}")
            .material("it", material)
            .mesh("it", "[[-8,0,-8],[-8,0,8],[8,0,8],[8,0,-8]], uvs: [[0,0],[0,1],[1,1],[1,0]]",
                  "[[0,1,2,3]]", "it");
        if (light[0] == 'r') return stage.set("environment", fmt::format("{{{}}}", light)).yaml();
        return stage.material("black", "{type: diffuse, reflectance: 0}")
            .mesh("room", "[[-2,0,-2],[2,0,-2],[-2,1,-2],[2,1,-2],[-2,0,2],[2,0,2],[-2,1,2],[2,1,2]]",
                  "[[0,1,3,2],[4,6,7,5],[2,3,7,6],[0,2,6,4],[1,5,7,3]]", "black", "1, two_sided: true")
            .yaml();
    };
    const double cosine = 0.6 / std::sqrt(0.3 * 0.3 + 0.6 * 0.6 + 0.2 * 0.2);
    const double metal = fresnelConductor(cosine, 0.4, 2.5);
    const double satin = roughConductorAlbedo(cosine, 0.4, 2.5, 0.5);
    struct Mix {
        const char* what;
        std::string material;
        double albedo;
        std::vector<Mistake> mistakes;
    };
    const Mix all[] = {
        {"two Lambertian", "{type: mix, materials: [light, dark], amount: 0.25}", 0.65,
         {{0.35, "the amount is that of the first"}, {0.5, "the amount is not asked"}}},
        {"one in another", "{type: mix, materials: [dark, inner], amount: 0.5}",
         0.5 * 0.2 + 0.5 * (0.25 * 0.8 + 0.75 * 0.2), {{0.2, "the inner mix is not asked"}}},
        {"a mirroring metal and Lambert", "{type: mix, materials: [gold, dark], amount: 0.4}",
         0.6 * metal + 0.4 * 0.2, {{0.4 * metal + 0.6 * 0.2, "the amount is that of the first"}}},
        {"a rough metal and Lambert", "{type: mix, materials: [satin, light], amount: 0.4}",
         0.6 * satin + 0.4 * 0.8, {{0.4 * satin + 0.6 * 0.8, "the amount is that of the first"}}},
        {"by a checker", "{type: mix, materials: [light, dark], amount: {checker: [0.25, 0.75]}}", 0.65,
         {{0.35, "the amount is that of the first"}}},
        {"sides", "{type: two_sided, front: light, back: dark}", 0.8, {{0.2, "the sides are swapped"}}},
    };
    const Effort effort{.samples = 64, .most = 65536};
    for (const Mix& mix : all) {
        context.estimate(fmt::format("{}, in light from everywhere", mix.what),
                         floor(kDirect, mix.material, "radiance: 1"), meanRadiance, mix.albedo, 0.005,
                         effort, mix.mistakes);
        for (const auto& [name, integrator] : kDirectTechniques)
            context.estimate(fmt::format("{}, in a glowing room, {}", mix.what, name),
                             floor(integrator, mix.material), meanRadiance, mix.albedo, 0.01, effort,
                             mix.mistakes);
    }
}

}  // namespace

std::vector<Case> compositionCases() {
    constexpr std::uint64_t light =
        CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE | CRT_FEATURE_ENVIRONMENT;
    return {
        row("G21", "cutoff", "Texels of an opacity below, at and above its cutoff, and between two of them",
            "0 below, 1 from it on, times the factor; linear between texels", "docs/scene.md",
            "± 0.5 %", Level::Commit, light | CRT_FEATURE_OPACITY | CRT_FEATURE_TEXTURE, cutoffs),
        row("G24", "opacity",
            "Stacked sheets of opacity 0 to 1 before a sky, and over a floor that is lit by lamps, points "
            "and a sky, by light sampling and without",
            "(1 − a)^k of the light", "independent decisions", "± 0.5 %, 2 %", Level::Commit,
            light | CRT_FEATURE_OPACITY | CRT_FEATURE_POINT_LIGHT | CRT_FEATURE_ENVIRONMENT_LIGHT, sheets),
        row("G25", "textured-opacity", "A checker of opacities, seen through and lit through",
            "1 − a at the place", "independent decisions", "± 0.5 %", Level::Commit,
            light | CRT_FEATURE_OPACITY | CRT_FEATURE_POINT_LIGHT | CRT_FEATURE_TEXTURE, texturedOpacity),
        row("G26", "opacity-limits",
            "A lamp of opacity .3, with and without light sampling; a box of opacity 1 and 0",
            "0.3 of the light; the same as without; nothing", "conservation of energy",
            "± 1 %; same bits; 1e-4", Level::Commit, light | CRT_FEATURE_OPACITY, emittersWithHoles),
        row("G27", "mix",
            "Mixes of Lambertian and metallic materials, one in another, by a texture, and two sides; in "
            "light from everywhere and in a glowing room, by light sampling and without",
            "the mean of the albedos, by their shares", "linearity in the BSDF; Fresnel's equations",
            "± 0.5 %, 1 %", Level::Commit,
            light | CRT_FEATURE_MIX | CRT_FEATURE_CONDUCTOR | CRT_FEATURE_ROUGH_CONDUCTOR |
                CRT_FEATURE_TEXTURE,
            mixes),
    };
}

}  // namespace crt::verify
