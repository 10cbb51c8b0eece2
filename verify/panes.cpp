// Group G, the part about light that crosses panes: shadow rays and scattered rays see it alike.
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"

#include "base/temporary_folder.h"
#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <string>

namespace crt::verify {
namespace {

constexpr double kIndex = 1.5;
constexpr const char* kPane = "{type: thin_dielectric, ior: 1.5}";

/// A white floor under `panes` panes, seen at the origin from below them. They hide all of the sky but 4e-4,
/// and are no larger: a ray goes on a clearance behind a pane, which grows with its size.
Stage floorUnderPanes(int panes, const std::string& material, const std::string& integrator = kDirect) {
    Stage stage("{position: [0, 0.1, 0.1], target: [0, 0, 0], fov: 0.001}", integrator);
    stage.material("white", "{type: diffuse, reflectance: 1}")
        .material("black", "{type: diffuse, reflectance: 0}")
        .material("pane", kPane)
        .material("it", material)
        .quad("floor", "[[-2,0,-2],[-2,0,2],[2,0,2],[2,0,-2]]", "white");
    for (int i = 0; i < panes; ++i)
        stage.quad(fmt::format("pane {}", i),
                   fmt::format("[[-20,{0},-20],[-20,{0},20],[20,{0},20],[20,{0},-20]]", 0.3 + 0.05 * i),
                   "it");
    return stage;
}

double ratioOfTwo(const std::vector<Film>& films) { return luminance(films[0]) / luminance(films[1]); }

void lightsBehindPanes(Context& context) {
    const TemporaryFolder folder;
    const std::string ies = std::string(folder.path()) + "/even.ies";
    std::ofstream(ies) << "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 180\n0\n100 100\n";
    for (const double degrees : {0.0, 30.0, 60.0, 80.0}) {
        const double x = std::sin(degrees * kDegree), y = std::cos(degrees * kDegree);
        const std::string at = fmt::format("position: [{:.17g}, {:.17g}, 0]", 9 * x, 9 * y),
                          aim = fmt::format("direction: [{:.17g}, {:.17g}, 0]", -x, -y);
        for (const auto& [kind, light] :
             {std::pair{"point", fmt::format("{{type: point, {}, radiant_intensity: 1}}", at)},
              {"spot", fmt::format("{{type: spot, {}, {}, radiant_intensity: 1}}", at, aim)},
              {"IES", fmt::format("{{type: ies, file: '{}', spectrum: 1, {}}}", ies, at)},
              {"beam", fmt::format("{{type: beam, {}, {}, radius: 0.5, irradiance: 1}}", at, aim)},
              {"directional", fmt::format("{{type: directional, {}, irradiance: 1}}", aim)}})
            for (const int panes : {1, 2, 7}) {
                // A shadow ray starts a clearance off the floor: it is turned by 1e-5 at most, and
                // ln T changes by less than tan θ a radian.
                const auto film = [&, light = light](int count) {
                    return context.render(
                        floorUnderPanes(count, kPane).set("lights", "[" + light + "]").yaml(),
                        {.samples = 16});
                };
                const double once = paneTransmittance(y, kIndex), r = fresnelDielectric(y, kIndex);
                context.relative(fmt::format("{} light at {}° behind {}", kind, degrees, panes),
                                 luminance(film(panes)) / luminance(film(0)), std::pow(once, panes),
                                 1e-5 * (1 + panes * x / y),
                                 {{0, "shadow rays do not pass panes"},
                                  {1, "panes take nothing of a shadow ray"},
                                  {once, "shadow rays pass one pane"},
                                  {std::pow((1 - r) / (1 + r), panes), "polarisation is lost in a pane"}});
            }
    }
    // Every way of finding surfaces finds all panes of every form, and the surfaces among them.
    const std::string sun = "[{type: directional, direction: [0, -1, 0], irradiance: 1}]";
    const std::string sphere =
                          "{sphere: {radius: 0.1}, transform: [{translate: [0, 0.6, 0]}], material: it}",
                      lying = "{rotate: {axis: [1, 0, 0], angle_deg: 90}}",
                      disks = "{disk: {radius: 1}, transforms: [[" + lying +
                              ", {translate: [0, 0.5, 0]}], [" + lying +
                              ", {translate: [0, 0.8, 0]}]], material: it}",
                      disk = "{disk: {radius: 1}, transform: [" + lying +
                             ", {translate: [0, 0.5, 0]}], material: it}",
                      wall = "{mesh: {positions: [[-1,0.7,-1],[-1,0.7,1],[1,0.7,1],[1,0.7,-1]], "
                             "faces: [[0,1,2,3]]}, material: black}";
    for (const char* accelerator : {"bvh", "aabb", "none"})
        for (const auto& [what, panes, objects, crossings, stopped] :
             {std::tuple{"a sphere", 0, std::vector{sphere}, 2, false},
              {"a disk", 0, std::vector{disk}, 1, false},
              {"a pane and a sphere", 1, std::vector{sphere}, 3, false},
              {"a pane and a sphere between two disks", 1, std::vector{disks, sphere}, 5, false},
              {"a pane, two disks and a wall between them", 1, std::vector{disks, wall}, 0, true}}) {
            const auto film = [&, panes = panes, objects = objects](bool empty) {
                Stage stage = floorUnderPanes(empty ? 0 : panes, kPane,
                                              fmt::format("{{max_depth: 1, accelerator: {}}}", accelerator));
                stage.set("lights", sun);
                for (const std::string& object : objects)
                    if (!empty) stage.object(object.substr(1, object.size() - 2));
                return luminance(context.render(stage.yaml(), {.samples = 16}));
            };
            context.absolute(fmt::format("{}, accelerator {}", what, accelerator), film(false) / film(true),
                             stopped ? 0 : std::pow(12.0 / 13, crossings), 2e-5,
                             {{std::pow(12.0 / 13, crossings - 1), "shadow rays miss a surface"},
                              {std::pow(12.0 / 13, crossings + 1), "shadow rays meet a surface twice"}});
        }
    // A mix with a pane, or a pane with an opacity: each surface has a separate chance.
    constexpr double once = 12.0 / 13;
    for (const auto& [what, material, through] :
         {std::tuple{"half a pane, half black", "{type: mix, materials: [pane, black], amount: 0.5}",
                     once / 2},
          {"a pane half of which is there", "{type: thin_dielectric, ior: 1.5, opacity: 0.5}",
           (1 + once) / 2}})
        for (const int panes : {1, 2})
            context.estimate(fmt::format("{}, {} of them", what, panes),
                             {floorUnderPanes(panes, material).set("lights", sun).yaml(),
                              floorUnderPanes(0, material).set("lights", sun).yaml()},
                             ratioOfTwo, std::pow(through, panes), 0.003, {.samples = 256, .most = 65536},
                             {{through, "all surfaces decide alike"}});
    // A film on one side, as seen by an eye.
    const auto filmed = [&](double degrees) {
        const Spectrum& eye = cieObserver()[1];
        double seen = 0, all = 0;
        for (std::size_t i = 0; i < kSpectrumSize; ++i) {
            seen += eye[i] * paneTransmittance(std::cos(degrees * kDegree), kIndex, 2.2, 300,
                                               kWavelengthMin_nm + static_cast<double>(i));
            all += eye[i];
        }
        return seen / all;
    };
    for (const double degrees : {0.0, 60.0}) {
        const std::string slanting =
            fmt::format("[{{type: directional, direction: [{:.17g}, {:.17g}, 0], irradiance: 1}}]",
                        -std::sin(degrees * kDegree), -std::cos(degrees * kDegree));
        const std::string material =
            "{type: thin_dielectric, ior: 1.5, thin_film: {thickness_nm: 300, ior: 2.2}}";
        context.estimate(fmt::format("under a film, at {}°", degrees),
                         {floorUnderPanes(1, material).set("lights", slanting).yaml(),
                          floorUnderPanes(0, material).set("lights", slanting).yaml()},
                         ratioOfTwo, filmed(degrees), 0.002, {.samples = 256, .most = 65536},
                         {{paneTransmittance(std::cos(degrees * kDegree), kIndex), "there is no film"}});
    }
}

void techniquesThroughPanes(Context& context) {
    const auto power = [](double cosine, int panes) {
        return std::pow(paneTransmittance(cosine, kIndex), panes);
    };
    const Effort effort{.samples = 256, .most = 262144};
    for (const int panes : {1, 3}) {
        const double sky =
            rectangleIntegral([&](double c, double) { return 2 * c * power(c, panes); }, 0, 1, 0, 1);
        // A square of side 2 at height 1: the cosines over π and the squared distance are 1/(π r⁴).
        const double lamp = rectangleIntegral(
            [&](double u, double v) {
                const double squared = 1 + u * u + v * v;
                return power(1 / std::sqrt(squared), panes) / (kPi * squared * squared);
            },
            -1, 1, -1, 1);
        const double sun_solid_angle = 2 * kPi * (1 - std::cos(1.0 * kDegree));
        for (const auto& [technique, integrator] : kDirectTechniques) {
            context.estimate(fmt::format("a sky through {}, {}", panes, technique),
                             floorUnderPanes(panes, kPane, integrator)
                                 .set("environment", "{radiance: 1, light_sampling: true}")
                                 .yaml(),
                             meanRadiance, sky, 0.003, effort,
                             {{1, "panes take nothing"}, {2 * sky, "both techniques count in full"}});
            context.estimate(
                fmt::format("a square lamp through {}, {}", panes, technique),
                floorUnderPanes(panes, kPane, integrator)
                    .quad("lamp", "[[-1,1,-1],[1,1,-1],[1,1,1],[-1,1,1]]", "black", "1, two_sided: true")
                    .yaml(),
                meanRadiance, lamp, 0.003, effort, {{2 * lamp, "both techniques count in full"}});
            if (std::string(technique) != "scattered rays")
                context.estimate(fmt::format("a sun at 60° through {}, {}", panes, technique),
                                 floorUnderPanes(panes, kPane, integrator)
                                     .set("lights",
                                          "[{type: sun, direction: [-0.86602540378, -0.5, 0], "
                                          "angular_diameter_deg: 2, radiance: 1000}]")
                                     .yaml(),
                                 meanRadiance, 500 * sun_solid_angle / kPi * power(0.5, panes), 0.003,
                                 effort);
        }
    }
}

void stackOfPanes(Context& context) {
    const auto stack = [](int panes, const char* integrator, const char* more) {
        Stage stage("{position: [0, 3, 3], target: [0, 0, 0], fov: 0.001}", integrator);
        stage.set("environment", "{radiance: 1}")
            .material("pane", kPane)
            .material("black", "{type: diffuse, reflectance: 0}");
        for (int i = 0; i < panes; ++i)
            stage.quad(fmt::format("pane {}", i),
                       fmt::format("[[-20,{0},-20],[-20,{0},20],[20,{0},20],[20,{0},-20]]", 0.05 * i),
                       "pane", more);
        return stage.yaml();
    };
    const double none = radiance(context.render(stack(0, "{max_depth: 0}", ""), {.samples = 64}));
    context.relative(
        "30 panes in light from everywhere",
        radiance(context.render(stack(30, "{max_depth: 4000, roulette: false}", ""), {.samples = 64})) /
            none,
        1, 2e-6, {{0, "panes are opaque"}});
    // To pass is no scattering event.
    const double once = paneTransmittance(std::sqrt(0.5), kIndex);
    const auto seen = [&](const char* what, int panes, const char* more, double expected) {
        context.estimate(what, {stack(panes, "{max_depth: 0}", more), stack(0, "{max_depth: 0}", "")},
                         ratioOfTwo, expected, 0.01, {.samples = 256, .most = 65536},
                         {{0, "panes are opaque"}});
    };
    seen("the sky behind 15 panes, without scattering", 15, "", std::pow(once, 15));
    seen("a pane that shines, and the sky behind it", 1, "0.5, two_sided: true", once + 0.5);
}

}  // namespace

std::vector<Case> paneCases() {
    constexpr std::uint64_t floor = CRT_FEATURE_DIFFUSE | CRT_FEATURE_NEE | CRT_FEATURE_THIN_DIELECTRIC;
    return {
        row("G53", "lights-behind-panes",
            "A floor lit by a point, a spot, an IES lamp, a beam and a directional light behind 1, 2 and 7 "
            "panes, at 0°, 30°, 60° and 80°; panes that are there in part, in a mix, under a film; a "
            "sphere and disks of panes, and a wall among them, found by each accelerator",
            "Tⁿ, T = (1 − R)/(1 + R) of each polarisation", "Fresnel's equations; Stokes (1862)",
            "1e-5 (1 + n tan θ); ± 0.3 %", Level::Commit, floor | CRT_FEATURE_POINT_LIGHT,
            lightsBehindPanes),
        row("G54", "techniques-through-panes",
            "A floor lit by a sky, a square lamp and a sun through 1 and 3 panes; with light sampling, "
            "scattered rays, and both",
            "the same of all: ∫ Tⁿ over the light", "quadrature in double", "± 0.3 %", Level::Commit,
            floor | CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_ENVIRONMENT_LIGHT | CRT_FEATURE_AREA_LIGHT,
            techniquesThroughPanes),
        row("G55", "stack-of-panes",
            "30 panes in light from everywhere; the sky behind 15 panes at max_depth 0; a pane that shines",
            "1; T¹⁵; T + what it emits", "conservation of energy", "2e-6; ± 1 %", Level::Commit,
            CRT_FEATURE_ENVIRONMENT | CRT_FEATURE_THIN_DIELECTRIC, stackOfPanes),
    };
}

}  // namespace crt::verify
