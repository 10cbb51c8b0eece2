// Light that no path finds: what is said of it, wherever it is said.
#include "catch.h"

#include "film/error_text.h"
#include "film/film_record.h"
#include "judge/converge/reference.h"
#include "scene/missing_light.h"
#include "scene/yaml/scene_yaml.h"

#include <fmt/format.h>

#include <string>
#include <vector>

namespace {

crt::Scene sceneOf(const std::string& lights, const std::string& material,
                   const std::string& integrator = "{}") {
    return crt::parseScene(
        fmt::format(
            "crt: 1\nintegrator: {}\nlights: [{}]\nmaterials:\n  white: {{type: diffuse, reflectance: "
            "0.5}}\n  other: {{type: diffuse, reflectance: 0.5}}\n  mirror: {{type: mirror, "
            "reflectance: 1}}\n  unused: {{type: dielectric, ior: 1.5}}\n  it: {}\nobjects:\n"
            "  - {{mesh: {{positions: [[0,0,0],[1,0,0],[0,1,0]], faces: [[0,1,2]]}}, material: white}}\n"
            "  - {{mesh: {{positions: [[0,0,1],[1,0,1],[0,1,1]], faces: [[0,1,2]]}}, material: it}}\n",
            integrator, lights, material),
        "scene.yaml", "");
}

constexpr const char* kPoint = "{type: point, position: [0, 0, 5], radiant_intensity: 1}";
constexpr const char* kSun = "{type: sun, direction: [0, 0, -1], radiance: 1}";
constexpr const char* kBoth =
    "{type: point, position: [0, 0, 5], radiant_intensity: 1}, "
    "{type: directional, direction: [0, 0, -1], irradiance: 1}";
constexpr const char* kDiffuse = "{type: diffuse, reflectance: 0.5}";

using Strings = std::vector<std::string>;

}  // namespace

TEST_CASE("missing light: what single directions do with lights that have no size", "[missing-light]") {
    const auto missing = [](const std::string& lights, const std::string& material) {
        return crt::missingLight(sceneOf(lights, material));
    };
    CHECK(missing(kPoint, kDiffuse).empty());
    CHECK(missing(kPoint, "{type: dielectric, ior: 1.5}") ==
          Strings{"light of point lights that smooth glass refracts or reflects"});
    CHECK(missing(kBoth, "{type: thin_dielectric, ior: 1.5}") ==
          Strings{"light of point and directional lights that panes reflect"});
    const Strings metals{"light of point lights that mirrors and smooth metals reflect"};
    CHECK(missing(kPoint, "{type: mirror, reflectance: 1}") == metals);
    CHECK(missing(kPoint, "{type: conductor, eta: 0.2, k: 3}") == metals);
    CHECK(missing(kPoint, "{type: rough_conductor, eta: 0.2, k: 3, roughness: 0}") == metals);
    CHECK(missing(kPoint, "{type: rough_conductor, eta: 0.2, k: 3, roughness: 0.3}").empty());
    CHECK(missing(kPoint, "{type: rough_dielectric, ior: 1.5, roughness: 0.3}").empty());
    CHECK(missing(kPoint, "{type: plastic, reflectance: 0.5, ior: 1.5}") ==
          Strings{"light of point lights that smooth coats reflect"});
    CHECK(missing(kPoint, "{type: plastic, reflectance: 0.5, ior: 1.5, roughness: 0.4}").empty());
    // Parts of mixes and sides count.
    CHECK(missing(kPoint, "{type: mix, materials: [other, mirror]}") == metals);
    // A light with a size is found, and one that shines nothing is not missed.
    CHECK(missing(kSun, "{type: dielectric, ior: 1.5}").empty());
    CHECK(
        missing("{type: point, position: [0, 0, 5], radiant_intensity: 0}", "{type: mirror, reflectance: 1}")
            .empty());
}

TEST_CASE("missing light: what settings leave out", "[missing-light]") {
    CHECK(crt::missingLight(sceneOf(kSun, kDiffuse, "{nee: false}")).empty());
    const std::string glass = "{type: dielectric, ior: 1.5}";
    CHECK(crt::missingLight(sceneOf(kSun, glass, "{max_depth: 2}")) ==
          Strings{"reflections by surfaces behind a glass body, for which 'max_depth: 2' is too small"});
    CHECK(crt::missingLight(sceneOf(kSun, glass, "{max_depth: 3}")).empty());
    // Panes are passed without scattering; and a depth of 0 is no mistake.
    CHECK(crt::missingLight(sceneOf(kSun, "{type: thin_dielectric, ior: 1.5}", "{max_depth: 1}")).empty());
    CHECK(crt::missingLight(sceneOf(kPoint, glass, "{max_depth: 0}")).empty());
    CHECK(crt::missingLight(sceneOf(kPoint, glass, "{type: normals}")).empty());
}

TEST_CASE("missing light: films keep it, and errors name it", "[missing-light]") {
    const crt::Scene scene = sceneOf(kPoint, "{type: mirror, reflectance: 1}");
    const crt::FilmRecord record = crt::readRecord(crt::recordText(crt::recordOf(scene)));
    CHECK(record.missing_light == crt::missingLight(scene));
    CHECK(record.missing_light.size() == 1);
    CHECK(crt::readRecord(crt::recordText(crt::recordOf(sceneOf(kPoint, kDiffuse)))).missing_light.empty());
    crt::ErrorEstimate error;
    CHECK(crt::errorText(error, true) == crt::errorText(error) + " + missing light");
    CHECK(crt::errorText(error, false) == crt::errorText(error));
}

TEST_CASE("reference: light sampling stays on for lights that nothing else finds", "[missing-light]") {
    using crt::converge::referenceScene;
    CHECK(referenceScene(sceneOf(kPoint, kDiffuse), false).integrator.nee);
    CHECK(referenceScene(sceneOf(kPoint, kDiffuse), true).integrator.nee);
    CHECK_FALSE(referenceScene(sceneOf(kSun, kDiffuse), false).integrator.nee);
    CHECK(referenceScene(sceneOf(kSun, kDiffuse), true).integrator.nee);
    CHECK(referenceScene(sceneOf(kSun, kDiffuse, "{nee: false}"), false).integrator.nee);
    // A light that shines nothing is no reason.
    CHECK_FALSE(
        referenceScene(sceneOf("{type: point, position: [0, 0, 5], radiant_intensity: 0}", kDiffuse), false)
            .integrator.nee);
}
