// Group G, the part about normals other than the geometry's: interpolated, and of images.
#include "base/temporary_folder.h"
#include "base/vec3d.h"
#include "judge/verify/context.h"
#include "judge/verify/references.h"
#include "judge/verify/scenes.h"
#include "judge/verify/shapes.h"

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

/// The corners of a floor, with the normal n at each unless it is the floor's own.
std::string cornersWith(const Vec3d& n) {
    const std::string corners = "[[-8,0,-8],[-8,0,8],[8,0,8],[8,0,-8]]";
    if (n[1] == 1) return corners;
    const std::string normal = fmt::format("[{:.9g}, {:.9g}, {:.9g}]", n[0], n[1], n[2]);
    return fmt::format("{0}, normals: [{1}, {1}, {1}, {1}]", corners, normal);
}

/// A floor with the normal n, in tangent space, everywhere. (u, v) runs along `right` and `up`.
Stage mappedFloor(const std::string& path, const Vec3d& n, const std::string& camera,
                  const char* integrator, const std::string& material, bool mirrored = false,
                  const char* transform = "", const Vec3d& interpolated = {0, 1, 0}) {
    std::vector<float> rgb;
    for (int i = 0; i < 4; ++i)
        for (const double c : n) rgb.push_back(static_cast<float>((c + 1) / 2));
    writeRgb(path, OutputFormat::Pfm, 2, 2, rgb);
    Stage stage(camera, integrator);
    stage.material("it", fmt::format("{{{}, normal_map: {{texture: '{}'{}}}}}", material, path, transform))
        .mesh("it",
              fmt::format("{}, uvs: {}", cornersWith(interpolated),
                          mirrored ? "[[0,0],[0,1],[1,1],[1,0]]" : "[[0,1],[0,0],[1,0],[1,1]]"),
              "[[0,1,2,3]]", "it");
    return stage;
}

Vec3d spherical(double degrees, double azimuth) {
    const double s = std::sin(degrees * kPi / 180);
    return {s * std::cos(azimuth), std::cos(degrees * kPi / 180), s * std::sin(azimuth)};
}

std::string seenFrom(const Vec3d& d, double distance = 1) {
    return fmt::format("{{position: [{:.9g}, {:.9g}, {:.9g}], target: [0, 0, 0], up: [0.3, 0.2, 1], fov: "
                       "0.001}}",
                       d[0] * distance, d[1] * distance, d[2] * distance);
}

constexpr const char* kWhite = "type: diffuse, reflectance: 1";

/// A floor with the interpolated normal n everywhere.
Stage tiltedFloor(const Vec3d& n, const std::string& camera, const char* integrator,
                  const std::string& material) {
    Stage stage(camera, integrator);
    stage.material("it", fmt::format("{{{}}}", material)).mesh("it", cornersWith(n), "[[0,1,2,3]]", "it");
    return stage;
}

/// Seen by the wavelengths of a floor's paths, light of radiance 1.
double white(Context& context) {
    return radiance(
        context.render(Stage(kDown).set("environment", "{radiance: 1}").yaml(), {.samples = 64}));
}

std::string directional(const Vec3d& towards) {
    return fmt::format("[{{type: directional, direction: [{:.9g}, {:.9g}, {:.9g}], irradiance: 1}}]",
                       -towards[0], -towards[1], -towards[2]);
}

/// A glowing room over the floor, or a sky that is sampled.
void surround(Stage& stage, const std::string& with) {
    if (with == "sky")
        stage.set("environment", "{radiance: 1, light_sampling: true}");
    else
        stage.material("black", "{type: diffuse, reflectance: 0}")
            .mesh("room", "[[-2,0,-2],[2,0,-2],[-2,1,-2],[2,1,-2],[-2,0,2],[2,0,2],[-2,1,2],[2,1,2]]",
                  "[[0,1,3,2],[4,6,7,5],[2,3,7,6],[0,2,6,4],[1,5,7,3]]", "black", "1, two_sided: true");
}

void interpolatedNormals(Context& context) {
    const double bright = white(context);
    for (const double tilt : {10.0, 37.0, 75.0})
        for (const double azimuth : {0.7, 3.4})
            for (const double height : {8.0, 60.0})
                for (const double view : {-1.0, 2.5}) {  // before the normal, behind it
                    const Vec3d n = spherical(tilt, azimuth), towards = spherical(90 - height, 0.7);
                    const double lobe = std::max(dot(n, towards), 0.0) / kPi;
                    const double raised = (1 - std::cos(tilt * kPi / 180)) / 2 * towards[1] / kPi;
                    const double mirrored =
                        std::max(dot(n, Vec3d{towards[0], -towards[1], towards[2]}), 0.0) / kPi;
                    const double seen = radiance(context.render(
                        tiltedFloor(n, seenFrom(spherical(75, azimuth + view)), kDirect, kWhite)
                            .set("lights", directional(towards))
                            .yaml(),
                        {.samples = 64}));
                    context.absolute(
                        fmt::format("tilt {}°, light {} it at {}°, seen from azimuth {:.1f}", tilt,
                                    azimuth < 1 ? "before" : "behind", height, azimuth + view),
                        seen / bright, lobe + raised, 1e-5,
                        {{lobe, "what goes below the surface is lost"},
                         {lobe + mirrored, "it is mirrored"},
                         {towards[1] / kPi, "behind the normal the geometry is seen"}});
                }
}

void interpolatedNormalsEnergy(Context& context) {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/normals.pfm";
    struct Subject {
        const char *name, *material;
        bool exact;  ///< Each path brings all of the light.
    };
    constexpr Subject kSubjects[] = {
        {"Lambert", kWhite, true},
        {"mirror", "type: mirror, reflectance: 1", true},
        {"rough metal", "type: rough_conductor, eta: 1, k: 100000, roughness: 0.5", false},
        {"plastic", "type: plastic, reflectance: 1, roughness: 0.3", false},
        {"plastic, smooth", "type: plastic, reflectance: 1, roughness: 0", false},
        {"mapped Lambert", "", false}};
    const double bright = white(context);
    const auto mistakes = [](double tilt) {
        return std::vector<Mistake>{
            {(1 + std::cos(tilt * kPi / 180)) / 2, "what goes below the surface is lost"}};
    };
    for (const Subject& subject : kSubjects)
        for (const double tilt : {20.0, 50.0})
            for (const double view : {0.0, 85.0})
                for (const double azimuth : {0.0, 2.8}) {
                    const Vec3d n = spherical(tilt, azimuth);
                    const std::string camera = seenFrom(spherical(view, 0));
                    const std::string what = fmt::format("white {}, tilt {}° towards {}, seen from {}°",
                                                         subject.name, tilt, azimuth, view);
                    Stage stage = subject.material[0] != 0
                                      ? tiltedFloor(n, camera, kDirect, subject.material)
                                      : mappedFloor(path, {0.5, 0.1, 0.86}, camera, kDirect, kWhite, false,
                                                    "", n);
                    stage.set("environment", "{radiance: 1}");
                    if (subject.exact)
                        context.absolute(
                            what, radiance(context.render(stage.yaml(), {.samples = 64})) / bright, 1, 1e-5,
                            mistakes(tilt));
                    else
                        context.estimate(what, stage.yaml(), meanRadiance, 1, 0.01,
                                         {.samples = 64, .most = 65536}, mistakes(tilt));
                }
    for (const auto& [technique, integrator] : kDirectTechniques)
        for (const double azimuth : {0.0, 2.8})
            for (const char* around : {"room", "sky"})
                for (const Subject& subject : {kSubjects[0], kSubjects[2], kSubjects[3]}) {
                    Stage stage = tiltedFloor(spherical(37, azimuth), seenFrom(spherical(60, 0), 0.5),
                                              integrator, subject.material);
                    surround(stage, around);
                    context.estimate(fmt::format("white {} in a glowing {}, towards {}, {}", subject.name,
                                                 around, azimuth, technique),
                                     stage.yaml(), meanRadiance, 1, 0.02, {.samples = 64, .most = 65536},
                                     mistakes(37));
                }
}

/// A ball of triangles with the normals of a sphere, in light of .5 from everywhere.
Scene roundedBall(int level, Material material) {
    Scene scene = emptyScene(24, 11, {2.2, 1.3, 1.9}, {0, 0, 0}, 0.4);
    scene.integrator.max_depth = 4000;
    scene.environment = Environment{constantSpectrum(0.5)};
    Mesh mesh = icosphere(level, 1, {0, 0, 0});
    for (const Vec3d& p : mesh.positions) mesh.normals.push_back(unit(p));
    mesh.normal_index = mesh.triangles;
    addObject(scene, std::move(mesh), std::move(material));
    return scene;
}

void interpolatedGlass(Context& context) {
    // Each path through clear glass brings exactly the light around it, so every pixel is that of an empty
    // scene.
    for (const int level : {0, 1, 3})
        for (const double index : {1.5, 2.4}) {
            const Scene scene = roundedBall(level, glass(index));
            Scene empty = scene;
            empty.objects.clear();
            context.relative(
                fmt::format("a ball of {} triangles, index {}, the worst pixel", 20 << 2 * level, index),
                worstRatio(context.render(scene, samples(16)), context.render(empty, samples(16))), 1, 2e-5);
        }
    for (const char* technique : {"MIS", "scattered rays alone"}) {
        Material material = glass(1.5);
        material.type = MaterialType::RoughDielectric;
        material.roughness = 0.3;
        Scene scene = roundedBall(0, material);
        scene.environment->light_sampling = true;
        scene.integrator.nee = std::string("MIS") == technique;
        std::vector<double> means;
        for (std::uint64_t seed = 1; seed <= 16; ++seed)
            means.push_back(radiance(context.render(scene, {.samples = 64, .seed = seed})));
        context.equivalent(fmt::format("a ball of 20 triangles, roughness 0.3, {}", technique), means, 0.5,
                           0.003);
    }
    // Tilted normals on a sheet between two skies of 1: glass shows F of one and (1 − F)/n² of the other.
    // A pane shows 1.
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/normals.pfm";
    const double bright = white(context);
    for (const bool mapped : {false, true})
        for (const double tilt : {20.0, 50.0})
            for (const double view : {0.0, 40.0, 70.0})
                for (const double azimuth : {0.0, 2.8}) {
                    const Vec3d n = spherical(tilt, azimuth), eye = spherical(view, 0);
                    // A normal behind the viewer is replaced by that of the floor.
                    const double cosine = dot(n, eye) > 0 ? dot(n, eye) : eye[1];
                    const auto seen = [&](const char* material) {
                        Stage stage = mapped ? mappedFloor(path, {n[0], -n[2], n[1]}, seenFrom(eye), kDirect,
                                                           material)
                                             : tiltedFloor(n, seenFrom(eye), kDirect, material);
                        return stage.set("environment", "{radiance: 1}").yaml();
                    };
                    const double f = fresnelDielectric(cosine, 1.5);
                    const std::string where =
                        fmt::format("{} normals, tilt {}° towards {}, seen from {}°",
                                    mapped ? "mapped" : "interpolated", tilt, azimuth, view);
                    context.estimate("glass, " + where, seen("type: dielectric, ior: 1.5"), meanRadiance,
                                     f + (1 - f) / 2.25, 0.005, {.samples = 256, .most = 65536},
                                     {{(1 - f) / 2.25, "light reflected to below the face is lost"},
                                      {f, "light refracted to above the face is lost"}});
                    context.absolute(
                        "a pane, " + where,
                        radiance(context.render(seen("type: thin_dielectric, ior: 1.5"), {.samples = 64})) /
                            bright,
                        1, 1e-5, {{1 - f, "light reflected to below the face is lost"}});
                }
}

void normalMap(Context& context) {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/normals.pfm";
    const double bright = white(context);
    // A light from one direction: the cosine with the facet, and with it in the mirror that the surface is.
    for (const auto& [slope, azimuth] : {std::pair{25.0, 0.4}, {25.0, 2.5}, {60.0, -1.2}, {60.0, 1.9}})
        for (const bool mirrored : {false, true}) {
            const Vec3d n = spherical(slope, azimuth);  // (x, y, z) = right, up the normal, along v
            // v runs along z where the picture is mirrored, against it otherwise.
            const double v = mirrored ? 1 : -1;
            const auto lit = [&](const Vec3d& normal, const Vec3d& light) {
                const auto positive = [](double x) { return std::max(x, 0.0); };
                const double level = normal[1] * light[1],
                             aside = normal[0] * light[0] + normal[2] * light[2];
                return (positive(aside + level) + positive(aside - level)) / kPi;
            };
            for (const double height : {15.0, 60.0}) {
                const Vec3d towards = spherical(90 - height, 0.7);
                const auto shown = [&](const char* transform) {
                    const double seen = radiance(context.render(
                        mappedFloor(path, {n[0], n[2], n[1]}, seenFrom(spherical(40, -0.5)), kDirect, kWhite,
                                    mirrored, transform)
                            .set("lights", directional(towards))
                            .yaml(),
                        {.samples = 64}));
                    return seen / bright;
                };
                const std::string what =
                    fmt::format("slope {}° towards {}, light at {}°{}", slope, azimuth, height,
                                mirrored ? ", mirrored picture" : "");
                const Vec3d world{n[0], n[1], v * n[2]};
                context.absolute(what, shown(""), lit(world, towards), 1e-4,
                                 {{lit({n[0], n[1], -v * n[2]}, towards), "green points down the picture"},
                                  {lit({0, 1, 0}, towards), "the map is not asked"}});
                // Turned by 90°, the picture's rows run against v.
                context.absolute(what + ", turned by 90°", shown(", rotation_deg: 90"),
                                 lit({n[2], n[1], -v * n[0]}, towards), 1e-4,
                                 {{lit(world, towards), "vectors do not turn with the picture"}});
                // Twice the slopes.
                const double steep = std::sqrt(4 * n[0] * n[0] + n[1] * n[1] + 4 * n[2] * n[2]);
                context.absolute(
                    what + ", strength 2", shown(", strength: 2"),
                    lit({2 * n[0] / steep, n[1] / steep, v * 2 * n[2] / steep}, towards), 1e-4,
                    {{lit(world, towards), "the strength is not asked"}});
            }
        }
    context.refused("a normal map on a mesh without texture coordinates",
                    Stage(kDown)
                        .material("it", fmt::format("{{{}, normal_map: {{texture: '{}'}}}}", kWhite, path))
                        .quad("it", "[[-8,0,-8],[-8,0,8],[8,0,8],[8,0,-8]]", "it")
                        .yaml(),
                    "no texture coordinates");
}

void normalMapEnergy(Context& context) {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/normals.pfm";
    constexpr std::pair<const char*, const char*> kMaterials[] = {
        {"Lambert", "type: diffuse, reflectance: 1"},
        {"mirror", "type: mirror, reflectance: 1"},
        {"plastic", "type: plastic, reflectance: 1, roughness: 0.3"}};
    const auto mistakes = [](double slope) {
        const double kept = (1 + std::cos(slope * kPi / 180)) / 2;
        return std::vector<Mistake>{{kept, "what is scattered below the surface is lost"},
                                    {0, "facets that turn away from the viewer are black"}};
    };
    for (const auto& [name, material] : kMaterials)
        for (const double slope : {20.0, 75.0})
            for (const double view : {0.0, 60.0, 85.0})
                for (const double azimuth : {0.0, 2.8}) {
                    const Vec3d n = spherical(slope, azimuth);
                    context.estimate(
                        fmt::format("white {}, slope {}° towards {}, seen from {}°", name, slope, azimuth,
                                    view),
                        mappedFloor(path, {n[0], n[2], n[1]}, seenFrom(spherical(view, 0)), kDirect,
                                    material)
                            .set("environment", "{radiance: 1}")
                            .yaml(),
                        meanRadiance, 1, 0.01, {.samples = 64, .most = 65536}, mistakes(slope));
                }
    // Light sampling and scattered rays share the work, or one does it alone.
    for (const auto& [technique, integrator] : kDirectTechniques)
        for (const double azimuth : {0.0, 2.8}) {
            const Vec3d n = spherical(50, azimuth);
            for (const char* lamps : {"room", "sky"}) {
                Stage stage = mappedFloor(path, {n[0], n[2], n[1]}, seenFrom(spherical(60, 0), 0.5),
                                          integrator, kMaterials[0].second);
                surround(stage, lamps);
                context.estimate(fmt::format("white Lambert in a glowing {}, towards {}, {}", lamps, azimuth,
                                             technique),
                                 stage.yaml(), meanRadiance, 1, 0.02, {.samples = 64, .most = 65536},
                                 mistakes(50));
            }
        }
}

}  // namespace

std::vector<Case> shadingNormalCases() {
    constexpr std::uint64_t light =
        CRT_FEATURE_DIFFUSE | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE | CRT_FEATURE_ENVIRONMENT;
    return {
        row("G28", "normal-map",
            "A floor whose map has one normal, under a light from one direction: pictures of either "
            "handedness, turned, and steeper",
            "1/π of the facet's cosine with the light, and with the light in the mirror of the floor",
            "vectors in double", "± 1e-4; refused", Level::Commit,
            light | CRT_FEATURE_NORMAL_MAP | CRT_FEATURE_TEXTURE | CRT_FEATURE_POINT_LIGHT, normalMap),
        row("G29", "normal-map-energy",
            "White mapped surfaces of slopes up to 75°, seen from 0° to 85°, in light from everywhere; "
            "and in glowing rooms, by light sampling and without",
            "1", "conservation of energy", "± 1 %, 2 %", Level::Merge,
            light | CRT_FEATURE_NORMAL_MAP | CRT_FEATURE_TEXTURE | CRT_FEATURE_MIRROR | CRT_FEATURE_PLASTIC |
                CRT_FEATURE_ENVIRONMENT_LIGHT,
            normalMapEnergy),
        row("G34", "interpolated-normals",
            "A white floor whose interpolated normals are tilted by up to 75°, under a light from one "
            "direction, seen from before and behind them",
            "1/π of the cosine with the normal, and of (1 − cos θ)/2 of that with the floor",
            "vectors in double", "± 1e-5", Level::Commit,
            light | CRT_FEATURE_SMOOTH_NORMALS | CRT_FEATURE_POINT_LIGHT, interpolatedNormals),
        row("G35", "interpolated-normals-energy",
            "White surfaces whose interpolated normals are tilted by 20° and 50°, of each kind that "
            "reflects, in light from everywhere; and in glowing rooms, by light sampling and without",
            "1", "conservation of energy", "± 1e-5 of Lambert and mirrors, 1 %, 2 %", Level::Merge,
            light | CRT_FEATURE_SMOOTH_NORMALS | CRT_FEATURE_NORMAL_MAP | CRT_FEATURE_TEXTURE |
                CRT_FEATURE_MIRROR | CRT_FEATURE_PLASTIC | CRT_FEATURE_ROUGH_CONDUCTOR |
                CRT_FEATURE_ENVIRONMENT_LIGHT,
            interpolatedNormalsEnergy),
        row("G52", "interpolated-glass",
            "Balls of 20 to 1,280 triangles with the normals of a sphere, of clear glass, and of rough "
            "glass by light sampling and without, in light from everywhere; sheets of glass and panes with "
            "tilted interpolated and mapped normals",
            "the light around them; F + (1 − F)/n²; 1", "conservation of energy; Fresnel's equations",
            "2e-5 in every pixel; ± 0.3 %; ± 0.5 %; 1e-5", Level::Commit,
            light | CRT_FEATURE_SMOOTH_NORMALS | CRT_FEATURE_NORMAL_MAP | CRT_FEATURE_TEXTURE |
                CRT_FEATURE_DIELECTRIC | CRT_FEATURE_ROUGH_DIELECTRIC | CRT_FEATURE_THIN_DIELECTRIC |
                CRT_FEATURE_ENVIRONMENT_LIGHT,
            interpolatedGlass),
    };
}

}  // namespace crt::verify
