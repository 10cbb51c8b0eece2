// Brightness of the brightest paths of a scene: against arithmetic, for every storage of the surfaces.
#include "catch.h"

#include "captured_log.h"
#include "base/error.h"
#include "render/brightest_path.h"
#include "film/film_record.h"
#include "scene/yaml/scene_yaml.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

namespace {

constexpr double kPi = std::numbers::pi;

crt::Scene sceneOf(const std::string& lights, const std::string& material, const std::string& more = "") {
    const crt::test::CapturedLog quiet;
    return crt::parseScene(fmt::format("crt: 1\nlights: [{}]\nmaterials:\n  it: {}\n"
                                       "  black: {{type: diffuse, reflectance: 0}}\n"
                                       "  glass: {{type: dielectric, ior: 1.5}}\n"
                                       "  pane: {{type: thin_dielectric, ior: 1.5}}\n"
                                       "objects:\n  - {{rectangle: {{size: [0.1, 0.1]}}, material: it}}\n{}",
                                       lights, material, more),
                           "scene.yaml", "");
}

crt::BrightestPath brightestPathOf(const crt::Scene& scene, double accelerator_reach = 0) {
    const crt::test::CapturedLog quiet;
    return crt::brightestPathOf(crt::compileScene(scene, 0, {.accelerator_reach = accelerator_reach}));
}
crt::BrightestPath brightestPathOf(const std::string& lights, const std::string& material,
                                   const std::string& more = "") {
    return brightestPathOf(sceneOf(lights, material, more));
}

// Equal energy: at all four wavelengths a path carries the same, whose luminance scatters about that value.
constexpr const char* kSun = "{type: sun, direction: [0, 0, -1], radiance: 1000}";
constexpr const char* kPoint = "{type: point, position: [0, 0, 2], radiant_intensity: 12}";
constexpr const char* kMirror = "{type: mirror, reflectance: 1}";
constexpr const char* kDiffuse = "{type: diffuse, reflectance: 1}";
constexpr const char* kSheet =
    "  - {rectangle: {size: [9, 9]}, material: black, transform: [{translate: [0, 0, 1]}]}\n";

}  // namespace

TEST_CASE("brightest path: a mirror sends on the radiance of what it mirrors", "[brightest-path]") {
    const crt::BrightestPath found = brightestPathOf(kSun, kMirror);
    CHECK(found.luminance >= 1000);
    CHECK(found.luminance < 1600);
    CHECK(found.rare);
}

TEST_CASE("brightest path: a diffuse surface sends on what it scatters", "[brightest-path]") {
    const crt::BrightestPath found = brightestPathOf(kPoint, kDiffuse);
    CHECK(found.luminance >= 12 / 4.0 / kPi);
    CHECK(found.luminance < 1.6 * 12 / 4.0 / kPi);
    CHECK_FALSE(found.rare);
}

TEST_CASE("brightest path: a rough metal sends on the peak of its lobe", "[brightest-path]") {
    // GGX straight on: D(0) = 1/(π α²) with α = roughness²; f cos = F D/4.
    constexpr double kAlpha = 0.1 * 0.1, kFresnel = (1.0 + 9.0) / (9.0 + 9.0);  // n = 2, k = 3
    const std::string metal = "{type: rough_conductor, eta: 2, k: 3, roughness: 0.1}";
    const double per_irradiance = kFresnel / (4 * kPi * kAlpha * kAlpha);
    const crt::BrightestPath straight = brightestPathOf(kPoint, metal);
    CHECK(straight.luminance >= 0.95 * 12 / 4 * per_irradiance);
    CHECK(straight.luminance < 1.6 * 12 / 4 * per_irradiance);
    CHECK(straight.rare);
    // At 45°: the cosine with which a place is weighted makes up for that of the lobe.
    const crt::BrightestPath oblique =
        brightestPathOf("{type: point, position: [2, 0, 2], radiant_intensity: 12}", metal);
    CHECK(oblique.luminance >= 0.9 * 12 / 8 * per_irradiance);
    CHECK(oblique.luminance < 1.6 * 12 / 8 * per_irradiance);
    CHECK(oblique.rare);
}

TEST_CASE("brightest path: what hides a light hides its paths", "[brightest-path]") {
    CHECK(std::isinf(brightestPathOf(kSun, kMirror, kSheet).luminance));
    // In front of a point light, which is farther away, and behind one.
    CHECK(std::isinf(brightestPathOf(kPoint, kDiffuse, kSheet).luminance));
    CHECK(brightestPathOf("{type: point, position: [0, 0, 0.5], radiant_intensity: 12}", kDiffuse,
                          kSheet)
              .luminance > 1);
    // Light passes panes.
    CHECK(brightestPathOf(
              kSun, kMirror,
              "  - {rectangle: {size: [9, 9]}, material: pane, transform: [{translate: [0, 0, 1]}]}\n")
              .luminance >= 1000);
}

TEST_CASE("brightest path: a sheet among hundreds of surfaces hides a light", "[brightest-path]") {
    for (const int before : {30, 63, 64, 200}) {
        std::string objects;
        for (int i = 0; i < 260; ++i)
            objects += i == before ? kSheet
                                   : fmt::format(
                                         "  - {{rectangle: {{size: [0.1, 0.1]}}, material: black, "
                                         "transform: [{{translate: [{}, 3, 1]}}]}}\n",
                                         i);
        CHECK(std::isinf(brightestPathOf(kSun, kMirror, objects).luminance));
    }
}

TEST_CASE("brightest path: what emits or is black sends on nothing", "[brightest-path]") {
    CHECK(std::isinf(brightestPathOf(kSun, "{type: diffuse, reflectance: 0}").luminance));
    CHECK(std::isinf(brightestPathOf("", kDiffuse).luminance));
}

TEST_CASE("brightest path: a lamp counts at most with its radiance", "[brightest-path]") {
    const std::string lamp =
        "  - {rectangle: {size: [0.1, 0.1]}, material: black, emission: {radiance: 50},\n"
        "     transform: [{rotate: {axis: [1, 0, 0], angle_deg: 180}}, {translate: [0, 0, 0.02]}]}\n";
    for (const char* material : {kMirror, kDiffuse}) {
        const crt::BrightestPath found = brightestPathOf("", material, lamp);
        CHECK(found.luminance > 10);
        CHECK(found.luminance < 1.6 * 50);
    }
}

TEST_CASE("brightest path: it does not depend on what stores the surfaces", "[brightest-path]") {
    const std::string objects =
        "  - {sphere: {radius: 0.3}, material: glass, transform: [{translate: [0.5, 0, 0.4]}]}\n"
        "  - {cylinder: {radius: 0.1, from_z: 0, to_z: 0.5}, material: it,\n"
        "     transform: [{translate: [-0.5, 0, 0.4]}]}\n"
        "  - {disk: {radius: 0.2}, material: it, transform: [{translate: [0, 0.5, 0.1]}]}\n"
        "  - {box: {size: [0.2, 0.2, 0.2]}, material: glass, share: always,\n"
        "     transforms: [[{translate: [0, -0.5, 0.2]}], [{translate: [0.7, -0.5, 0.2]}]]}\n";
    for (const char* light : {kSun, kPoint}) {
        const crt::Scene scene = sceneOf(light, kDiffuse, objects);
        const crt::BrightestPath with_tree = brightestPathOf(scene),
                                 without = brightestPathOf(scene, std::numeric_limits<double>::infinity());
        CHECK(std::isfinite(with_tree.luminance));
        CHECK(with_tree == without);
    }
}

TEST_CASE("brightest path: films keep it", "[brightest-path]") {
    crt::FilmRecord record = crt::recordOf(sceneOf(kSun, kMirror));
    const auto again = [&] { return crt::readRecord(crt::recordText(record)).paths.brightest; };
    CHECK(again() == crt::BrightestPath{});
    record.paths.brightest = {105, true};
    CHECK(again() == crt::BrightestPath{105, true});
    record.paths.brightest = {0.5, false};
    CHECK(again() == crt::BrightestPath{0.5, false});
    record.paths.brightest.luminance = 0;
    CHECK_THROWS_AS(again(), crt::Error);
}
