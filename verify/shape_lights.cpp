// Group G, the part about lamps that are spheres, disks and cylinders.
#include "verify/context.h"
#include "verify/references.h"
#include "verify/scenes.h"

#include "kernel/dialect/features.h"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

namespace crt::verify {
namespace {

/// A large white floor, y = 0, seen at the origin, and what shines on it.
std::string overFloor(const std::string& lamps, const std::string& integrator) {
    return fmt::format(
        "crt: 1\ncamera: {{position: [0, 1e-3, -1e-3], target: [0, 0, 0], fov: 0.01}}\n"
        "film: {{resolution: [4, 4]}}\nintegrator: {}\n"
        "materials: {{white: {{type: diffuse, reflectance: 1}}, black: {{type: diffuse, reflectance: 0}}}}\n"
        "objects:\n  - {{material: white, rectangle: {{size: [20, 20]}}, transform: [{{rotate: {{axis: [1, "
        "0, "
        "0], angle_deg: -90}}}}]}}\n{}",
        integrator, lamps);
}

std::string lamp(const std::string& shape, const std::string& transform, const char* two_sided = "false") {
    return fmt::format(
        "  - {{material: black, {}, transform: [{}], emission: {{radiance: 1, two_sided: {}}}}}\n", shape,
        transform, two_sided);
}

/// Irradiance over π of the floor's origin, cosine²/distance² over what faces it of a cylinder along x at
/// height `height`, from −half to half: its silhouette is a strip, of which the polar angle goes as far as
/// the tangents; by quadrature over the surface.
double cylinderFactor(double radius, double half, double height) {
    return rectangleIntegral(
               [&](double x, double phi) {
                   // phi from the lowest line of the cylinder.
                   const double y = height - radius * std::cos(phi), z = radius * std::sin(phi);
                   const double r2 = x * x + y * y + z * z, r = std::sqrt(r2);
                   // The normal is (0, −cos phi, sin phi), the way to the origin (−x, −y, −z) / r.
                   const double facing = (std::cos(phi) * y - std::sin(phi) * z) / r;
                   return facing > 0 ? facing * (y / r) / r2 * radius : 0.0;
               },
               -half, half, -std::acos(radius / height), std::acos(radius / height), 8) /
           kPi;
}

/// A floor and a ceiling two lengths from each other, and a lamp half-way, small against the distance: its
/// coordinates and its size are exact to less than what rounding makes of a ray that goes so far. `more`: a
/// further object, which no light meets.
std::string halfWay(const std::string& lamp, const std::string& more) {
    return fmt::format(
        "crt: 1\ncamera: {{position: [0, -0.999, -1e-3], target: [0, -1, 0], fov: 0.01}}\n"
        "film: {{resolution: [4, 4]}}\nintegrator: {}\n"
        "materials:\n  white: {{type: diffuse, reflectance: 1}}\n"
        "  black: {{type: diffuse, reflectance: 0}}\n"
        "  lace: {{type: diffuse, reflectance: 0, opacity: 0.5}}\n"
        "  pane: {{type: thin_dielectric, ior: 1.5}}\n"
        "objects:\n"
        "  - {{material: white, mesh: {{positions: [[-1, -1, -1], [-1, -1, 1], [1, -1, 1], [1, -1, -1]], "
        "faces: [[0, 1, 2, 3]]}}}}\n"
        "  - {{material: black, mesh: {{positions: [[-1, 1, -1], [1, 1, -1], [1, 1, 1], [-1, 1, 1]], "
        "faces: [[0, 1, 2, 3]]}}}}\n{}{}",
        kDirect, more, lamp);
}

/// Lamps that are small and far, of all kinds, where shadow rays meet only what stops them, and where they
/// may pass something.
void smallLamps(Context& context) {
    const double size = 1e-3;
    const char* const elsewhere[] = {
        "", "  - {material: lace, sphere: {radius: 0.01}, transform: [{translate: [0.9, 0.9, 0.9]}]}\n",
        "  - {material: pane, sphere: {radius: 0.01}, transform: [{translate: [0.9, 0.9, 0.9]}]}\n"};
    const auto mesh = [](const char* corners, const char* face) {
        return fmt::format("mesh: {{positions: [{}], faces: [{}]}}", corners, face);
    };
    const std::string scaled = fmt::format("{{scale: {}}}", size);
    const std::string upright = "{rotate: {axis: [1, 0, 0], angle_deg: 90}}, " + scaled;
    const std::tuple<const char*, std::string, double> lamps[] = {
        {"a square", lamp(mesh("[-1,0,-1],[1,0,-1],[1,0,1],[-1,0,1]", "[0,1,2,3]"), scaled),
         squareFormFactor(0, size)},
        {"a triangle", lamp(mesh("[-1,0,-1],[2,0,-1],[-1,0,2]", "[0,1,2]"), scaled),
         4.5 * size * size / kPi},
        {"a sphere", lamp("sphere: {radius: 1}", scaled), size * size},
        {"a disk", lamp("disk: {radius: 1}", upright), size * size / (size * size + 1)},
        {"a cylinder",
         lamp("cylinder: {radius: 0.5, from_z: -1, to_z: 1}",
              "{rotate: {axis: [0, 1, 0], angle_deg: 90}}, " + scaled),
         cylinderFactor(size / 2, size, 1)}};
    for (const auto& [what, lamp, factor] : lamps)
        for (const auto& [more, where] : {std::pair{elsewhere[0], ""},
                                          {elsewhere[1], ", in a scene with holes"},
                                          {elsewhere[2], ", in a scene with panes"}})
            context.estimate(fmt::format("{} a thousandth as large as its distance{}", what, where),
                             halfWay(lamp, more), meanRadiance, factor, 1e-3,
                             {.samples = 256, .most = 1024});
}

/// A camera inside a hollow shape of reflectance 0.5 that shines with radiance 1, at depth 1.
std::string insideLamp(const std::string& shape, const std::string& transform, const std::string& view,
                       const std::string& integrator, const char* two_sided) {
    return fmt::format(
        "crt: 1\ncamera: {{{}}}\nfilm: {{resolution: [8, 8]}}\nintegrator: {}\n"
        "materials: {{grey: {{type: diffuse, reflectance: 0.5}}}}\n"
        "objects: [{{material: grey, {}, transform: [{}], emission: {{radiance: 1, two_sided: {}}}}}]\n",
        view, integrator, shape, transform, two_sided);
}

/// A lamp lights itself: of a sphere every place sees all others alike (the integrating sphere), so that a
/// part of one, a share s of its area, shows 1 + s/2.
void lampsThatLightThemselves(Context& context) {
    const Effort effort{.samples = 256, .most = 65536};
    for (const auto& [technique, integrator] : kDirectTechniques)
        for (const char* two_sided : {"false", "true"}) {
            const auto ask = [&](const std::string& what, const std::string& shape,
                                 const std::string& transform, const std::string& view, double expected) {
                context.estimate(fmt::format("{}, two_sided {}, {}", what, two_sided, technique),
                                 insideLamp(shape, transform, view, integrator, two_sided), meanRadiance,
                                 expected, 2e-3, effort);
            };
            for (const auto& [place, centre] :
                 {std::pair{"at the origin", "0, 0, 0"}, {"far from it", "148376, 1234, -223423"}})
                ask(fmt::format("a sphere {}", place), "sphere: {radius: 3, inward: true}",
                    fmt::format("{{translate: [{}]}}", centre),
                    fmt::format(
                        "position: [{0}], target: [{1}], fov: 60", centre,
                        std::string_view(place) == "at the origin" ? "0, 0, 1" : "148376, 1234, -223422"),
                    1.5);
            ask("the lower half of a sphere", "sphere: {radius: 2, to_z: 0, inward: true}", "{scale: 0.5}",
                "position: [0, 0, 0.5], target: [0, 0, -1], up: [0, 1, 0], fov: 30", 1.25);
        }
}

void shapeLamps(Context& context) {
    const Effort effort{.samples = 256, .most = 65536};
    for (const auto& [technique, integrator] : kDirectTechniques) {
        const bool chance = std::string_view(technique) == "scattered rays";
        const auto ask = [&](const std::string& what, const std::string& lamps, double expected) {
            context.estimate(fmt::format("{}, {}", what, technique), overFloor(lamps, integrator),
                             meanRadiance, expected, 5e-3, effort);
        };
        // Straight above and at the side, near and far: (R/d)² times the cosine.
        for (const auto& [x, y, radius] : {std::tuple{0.0, 2.0, 1.0}, {1.5, 1.0, 0.8}, {0.0, 1.02, 1.0}})
            ask(fmt::format("a sphere of radius {} at ({}, {})", radius, x, y),
                lamp(fmt::format("sphere: {{radius: {}}}", radius),
                     fmt::format("{{translate: [{}, {}, 0]}}", x, y)),
                radius * radius * y / std::pow(x * x + y * y, 1.5));
        if (!chance)
            ask("a small sphere", lamp("sphere: {radius: 0.01}", "{translate: [0.5, 1, 0.3]}", "true"),
                1e-4 / std::pow(0.25 + 1 + 0.09, 1.5));
        for (const double height : {1.0, 0.2})
            ask(fmt::format("a disk of radius 1 at height {}", height),
                lamp("disk: {radius: 1}",
                     fmt::format("{{rotate: {{axis: [1, 0, 0], angle_deg: 90}}}}, {{translate: [0, {}, 0]}}",
                                 height)),
                1 / (1 + height * height));
        for (const double height : {1.0, 0.35})
            ask(fmt::format("a cylinder of radius 0.3 at height {}", height),
                lamp("cylinder: {radius: 0.3, from_z: -1, to_z: 1}",
                     fmt::format("{{rotate: {{axis: [0, 1, 0], angle_deg: 90}}}}, {{translate: [0, {}, 0]}}",
                                 height)),
                cylinderFactor(0.3, 1, height));
        ask("inside a sphere that shines inwards",
            lamp("sphere: {radius: 3, inward: true}", "{translate: [0.5, 0.7, -0.2]}"), 1);
        // The lower cap of a sphere is seen as the disk that ends it.
        ask("a cap like a disk",
            lamp("sphere: {radius: 1, to_z: -0.6}",
                 "{rotate: {axis: [1, 0, 0], angle_deg: -90}}, {translate: [0, 1.8, 0]}"),
            0.64 / (0.64 + 1.2 * 1.2));
    }
    // A tree of them.
    std::string lamps;
    double sum = 0;
    for (int i = 0; i < 30; ++i) {
        const double x = -1.5 + 0.6 * (i % 6), z = -1.2 + 0.6 * (i / 6), y = 1 + 0.05 * i, radius = 0.05;
        const double d2 = x * x + y * y + z * z;
        if (i % 2 == 0) {
            lamps += lamp("sphere: {radius: 0.05}", fmt::format("{{translate: [{}, {}, {}]}}", x, y, z));
            sum += radius * radius * y / std::pow(d2, 1.5);
        } else {
            lamps += lamp(
                "disk: {radius: 0.05}",
                fmt::format("{{rotate: {{axis: [1, 0, 0], angle_deg: 90}}}}, {{translate: [{}, {}, {}]}}", x,
                            y, z));
            // Howell, B-13: a disk parallel to the element, off its axis.
            const double H2 = y * y / (radius * radius), A2 = (x * x + z * z) / (radius * radius);
            const double Z = 1 + H2 + A2;
            sum += 0.5 * (1 - (Z - 2) / std::sqrt(Z * Z - 4 * A2));
        }
    }
    context.estimate("a tree of 30 spheres and disks", overFloor(lamps, kDirect), meanRadiance, sum, 5e-3,
                     effort);
    // Seen directly: the disk that a sphere fills.
    context.estimate("the solid angle of a sphere of radius 1 at a distance of 3",
                     "crt: 1\ncamera: {position: [0, 0, -3], target: [0, 0, 0], fov: 60}\n"
                     "film: {resolution: [32, 32]}\nintegrator: {max_depth: 0}\n"
                     "materials: {black: {type: diffuse, reflectance: 0}}\n"
                     "objects: [{material: black, sphere: {radius: 1}, emission: {radiance: 1}}]\n",
                     meanRadiance, kPi / 8 / (4.0 / 3), 2e-3, effort);
}

}  // namespace

std::vector<Case> shapeLightCases() {
    return {
        row("G42", "lamps-of-shapes",
            "A floor under spheres, disks, cylinders and caps that shine, near and far, from inside, and "
            "under thirty of them; a sphere seen directly",
            "(R/d)² cos θ, R²/(R² + h²), quadrature, 1; the sum; the disk that is seen",
            "form factors (Howell)", "± 0.5 %; ± 0.2 %", Level::Commit,
            CRT_FEATURE_SHAPES | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE | CRT_FEATURE_DIFFUSE |
                CRT_FEATURE_LIGHT_TREE,
            shapeLamps),
        row("G43", "lamps-that-light-themselves",
            "Inside spheres, whole and half, of reflectance 0.5 that shine inwards or on both sides",
            "1 + s/2 of a share s of a sphere", "integrating sphere: all places see each other alike",
            "± 0.2 %", Level::Commit,
            CRT_FEATURE_SHAPES | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE | CRT_FEATURE_DIFFUSE,
            lampsThatLightThemselves),
        row("G44", "small-lamps",
            "A floor under squares, triangles, spheres, disks and cylinders a thousandth as large as their "
            "distance, in the middle of the scene, alone and beside holes and panes",
            "A/(π h²), R²/h², quadrature", "form factors (Howell)", "± 0.1 %", Level::Commit,
            CRT_FEATURE_SHAPES | CRT_FEATURE_AREA_LIGHT | CRT_FEATURE_NEE | CRT_FEATURE_DIFFUSE |
                CRT_FEATURE_OPACITY | CRT_FEATURE_THIN_DIELECTRIC,
            smallLamps)};
}

}  // namespace crt::verify
