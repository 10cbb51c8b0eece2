// Group G, the part about thin sheets that scatter light to both of their sides.
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

constexpr double kReflected = 0.5, kPassed = 0.3, kIndex = 1.5;
constexpr Effort kSheetEffort{.samples = 256, .most = 65536};
/// The first values are where it is seen.
constexpr const char* kForms[] = {
    "reflectance: 0.5, transmittance: 0.3",
    "reflectance: {checker: [0.5, 0.1]}, transmittance: {checker: [0.3, 0.6]}"};

/// Light from everywhere comes back from one side, and through from the other.
void inTheOpen(Context& context, const char* form, double degrees) {
    const double cosine = std::cos(degrees * kDegree);
    context.estimate(fmt::format("a sheet, {}, at {}°", form, degrees),
                     checkeredFloor(fmt::format("{{type: translucent, {}}}", form), degrees), meanRadiance,
                     kReflected + kPassed, 2e-3, kSheetEffort, {{kReflected, "nothing passes"}});
    for (const double roughness : {0.0, 0.5})
        context.estimate(
            fmt::format("a glossy sheet of roughness {}, {}, at {}°", roughness, form, degrees),
            checkeredFloor(fmt::format("{{type: plastic, roughness: {}, {}}}", roughness, form), degrees),
            meanRadiance, plasticAlbedo(cosine, kReflected + kPassed, kIndex, roughness), 2e-3, kSheetEffort,
            {{plasticAlbedo(cosine, kReflected, kIndex, roughness), "nothing passes"}});
}

/// Shares of what enters that leave on this side and on the other, round by round.
std::pair<double, double> sidesOf(double reflected, double passed, double returned) {
    double here = 0, there = 0, up = reflected, down = passed;
    for (int i = 0; i < 1000; ++i) {
        here += (1 - returned) * up;
        there += (1 - returned) * down;
        const double next = returned * (reflected * up + passed * down);
        down = returned * (passed * up + reflected * down);
        up = next;
    }
    return {here, there};
}

/// A floor in a beam, seen from above or from below, over white paper seen from above.
double overPaper(Context& context, const std::string& material, double light_degrees, double view_degrees,
                 bool from_below) {
    const auto seen = [&](const std::string& of, bool below) {
        const double up = below ? -1 : 1;
        Stage stage(eyeAt({std::sin(view_degrees * kDegree), up * std::cos(view_degrees * kDegree), 0.1},
                          "[0, 0, 1]"));
        stage.material("it", of)
            .quad("it", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "it")
            .set("lights",
                 fmt::format("[{{type: directional, direction: [{:.17g}, {:.17g}, 0], irradiance: "
                             "1}}]",
                             std::sin(light_degrees * kDegree), -std::cos(light_degrees * kDegree)));
        return radiance(context.render(stage.yaml(), {.samples = 64}));
    };
    return seen(material, from_below) / seen("{type: diffuse, reflectance: 1}", false);
}

void inBeams(Context& context, double light, double view) {
    for (const bool below : {false, true}) {
        const std::string where =
            fmt::format("lit from {}°, seen from {} at {}°", light, below ? "below" : "above", view);
        context.relative(fmt::format("a sheet {}", where),
                         overPaper(context, "{type: translucent, reflectance: 0.5, transmittance: 0.3}",
                                   light, view, below),
                         below ? kPassed : kReflected, 1e-4,
                         {{below ? kReflected : kPassed, "the sides are exchanged"}});
        const double internal = internalReflectance(kIndex, 0);
        const auto [here, there] = sidesOf(kReflected, kPassed, internal);
        // The eye is a little off the plane of the light.
        const double eye = std::cos(view * kDegree) / std::hypot(1, 0.1);
        const double coats = (1 - fresnelDielectric(std::cos(light * kDegree), kIndex)) *
                             (1 - fresnelDielectric(eye, kIndex)) / ((1 - internal) * kIndex * kIndex);
        context.relative(
            fmt::format("a glossy sheet {}", where),
            overPaper(context, "{type: plastic, reflectance: 0.5, transmittance: 0.3}", light, view, below),
            coats * (below ? there : here), 1e-3,
            {{coats * (below ? kPassed : kReflected), "its coats send nothing back"}});
    }
}

/// A disk of radius 1/2 shines down on a curtain from 1/2 above; it is seen from below.
void behindACurtain(Context& context, const char* name, const char* integrator) {
    Stage stage(eyeAt({0, -1, 0}, "[0, 0, 1]"), integrator);
    stage.material("sheet", "{type: translucent, reflectance: 0.5, transmittance: 0.3}")
        .material("lamp", "{type: diffuse, reflectance: 0}")
        .quad("sheet", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "sheet")
        .object(
            "disk: {radius: 0.5}, material: lamp, emission: {radiance: 2}, transform: [{rotate: {axis: "
            "[1, 0, 0], angle_deg: 90}}, {translate: [0, 0.5, 0]}]");
    context.estimate(fmt::format("a lamp behind a curtain, {}", name), stage.yaml(), meanRadiance,
                     2 * kPassed * 0.5, 2e-3, kSheetEffort, {{0, "light sampling sees one side alone"}});
}

void sheets(Context& context) {
    for (const double degrees : {60.0, 0.0, 80.0}) {
        if (degrees != 60 && !context.atLeast(Level::Merge)) break;
        for (const char* form : kForms) inTheOpen(context, form, degrees);
        inBeams(context, degrees, 25);
    }
    for (const auto& [name, integrator] : kDirectTechniques) behindACurtain(context, name, integrator);
    // Nothing is lost, in a tent and about normals that lean.
    const char* white = "{type: translucent, reflectance: 0.4, transmittance: 0.6}";
    Stage tent("{position: [0.5, 0.5, 0.5], target: [1, 0.4, 0.3], fov: 60}",
               "{max_depth: 64, roulette: false}");
    tent.material("sheet", white)
        .box("tent", {0, 0, 0}, {1, 1, 1}, "sheet")
        .set("environment", "{radiance: 1}");
    context.estimate("a white tent in light from everywhere", tent.yaml(), meanRadiance, 1, 2e-3,
                     kSheetEffort);
    Stage leaning(eyeAt({std::sin(60 * kDegree), std::cos(60 * kDegree), 0}, "[0, 0, 1]"));
    leaning.material("sheet", white)
        .set("environment", "{radiance: 1}")
        .object(
            "mesh: {positions: [[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]], normals: "
            "[[-0.6,0.8,0],[-0.6,0.8,0],[-0.6,0.8,0],[-0.6,0.8,0]], faces: [[0,1,2,3]]}, material: "
            "sheet");
    context.estimate("a sheet about a normal that leans by 37°", leaning.yaml(), meanRadiance, 1, 2e-3,
                     kSheetEffort, {{0.96, "what is passed to above the face is lost"}});
}

}  // namespace

std::vector<Case> sheetCases() {
    return {
        row("G47", "sheets",
            "Thin sheets, bare and under a smooth or rough gloss, of numbers and of textures, in light from "
            "everywhere and in a beam, seen from both sides; a lamp behind a curtain, by MIS and by each "
            "technique alone; a white tent; a white sheet about a normal that leans",
            "reflectance and transmittance; all rounds between a base and its two coats, one by one; the "
            "form factor of a disk; 1",
            "Lambert; Jakob et al. 2022", "± 0.2 %, ± 0.01 %", Level::Commit,
            CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_POINT_LIGHT | CRT_FEATURE_TRANSLUCENT |
                CRT_FEATURE_TEXTURE | CRT_FEATURE_PLASTIC | CRT_FEATURE_DIFFUSE | CRT_FEATURE_TABLE |
                CRT_FEATURE_SHAPES | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE | CRT_FEATURE_SMOOTH_NORMALS,
            sheets)};
}

}  // namespace crt::verify
