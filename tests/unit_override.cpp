// The effects of --set: keys that exclude the one that is set, and keys that null removes; and suggestions
// of messages for values in the form of another program.
#include "scene/yaml/scene_exclusion.h"
#include "scene_texts.h"

#include <cmath>
#include <numbers>

using namespace crt;
using namespace crt::test;

namespace {

constexpr const char* kLens = "film: {resolution: [8, 8]}\ncamera: {focal_length: 1, sensor: [1, 1]}\n";
constexpr const char* kAngle = "film: {resolution: [8, 8]}\ncamera: {fov: 20}\n";

Scene with(const std::string& body, const std::vector<std::string>& arguments) {
    std::vector<SceneOverride> overrides;
    for (const std::string& argument : arguments) overrides.push_back(parseOverride(argument));
    return parse(body, overrides);
}

double fovOf(const Scene& scene) {
    return 2 * std::atan(scene.camera.tan_half_width) * 180 / std::numbers::pi;
}

}  // namespace

TEST_CASE("a key that is set takes the place of those that exclude it", "[override]") {
    CHECK(fovOf(with(kLens, {"camera.fov=50"})) == Approx(50));
    CHECK(with(kAngle, {"camera.focal_length=4", "camera.sensor=[2, 2]"}).camera.tan_half_width == 0.25);
    CHECK(with(kAngle, {"camera.sensor=[2, 2]", "camera.focal_length=4"}).camera.tan_half_width == 0.25);

    const std::string light = "lights: [{type: spot, position: [0, 2, 0], direction: [0, -1, 0], ";
    const Scene spectral = with(light + "luminous_flux_lm: 800, spectrum: {blackbody: 3000}}]\n",
                                {"lights.0.radiant_intensity=5", "lights.0.target=[1, 2, 0]"});
    CHECK(spectral.point_lights[0].spectrum == constantSpectrum(5));
    CHECK(spectral.point_lights[0].direction == Vec3d{1, 0, 0});

    const std::string sky = "environment: {image: nosuch.exr, scale: 2, rotation_deg: 5}\n";
    CHECK(with(sky, {"environment.radiance=3"}).environment->radiance == constantSpectrum(3));
    // A map that the path makes excludes as one that is given.
    CHECK(with("environment: {radiance: 1}\n",
               {"environment.sky={type: 5, direction: [0, -1, 0], zenith_luminance_cd_m2: 1000}"})
              .environment->sky->type == 5);
    CHECK(with("environment: {radiance: 1}\n",
               {"environment.sky.type=5", "environment.sky.direction=[0, -1, 0]",
                "environment.sky.zenith_luminance_cd_m2=1000"})
              .environment->sky->type == 5);
}

// Fails when a name with a dot is cut, or a number that is also a name is not an index.
TEST_CASE("items of lists are found by index and by name", "[override]") {
    const auto object = [](const std::string& name) {
        return fmt::format("  - {{name: {}, sphere: {{radius: 1}}, material: m}}\n", name);
    };
    const std::string body =
        "materials: {m: {type: diffuse, reflectance: 0}, n: {type: mirror, reflectance: 1}}\n"
        "objects:\n" +
        object("helmet") + object("helmet.001") + object("'1'") + object("the lamp");
    const auto changed = [&](const std::string& path) {
        const Scene scene = with(body, {path + ".material=n"});
        std::string text;
        for (const crt::Object& o : scene.objects)
            text += o.material == scene.objects[0].material ? 'a' : 'b';
        return text;
    };
    CHECK(changed("objects.helmet.001") == "abaa");
    CHECK(changed("objects.the lamp") == "aaab");
    CHECK(changed("objects.1") == "abaa");
    CHECK(changed("objects.helmet") == "abbb");  // The first, to which the others are compared.
    CHECK_THAT(
        refusedOverride(body, "objects.helmt.material=n"),
        Contains("from 0 to 3 or an item's name, found 'helmt'") && Contains("did you mean 'helmet'?"));
    CHECK_THAT(refusedOverride(body + object("helmet"), "objects.helmet.material=n"),
               Contains("2 items are called 'helmet'") && Contains("0, 4"));
}

TEST_CASE("a spectrum of one kind becomes one of another kind", "[override]") {
    const std::string body =
        "spectra: {s: {table: {nm: [400, 700], value: [1, 1]}, outside: clamp, scale: 2}}\n"
        "environment: {radiance: s}\n";
    const Scene scene = with(body, {"spectra.s.blackbody=3000"});
    CHECK(scene.environment->radiance.max() == Approx(2));
    const std::string object =
        "materials: {m: {type: diffuse, reflectance: {rgb: [1, 0, 0], space: linear}}}\n";
    CHECK(with(object, {"materials.m.reflectance.data=cornell/white"}).materials[0].reflectance.max() < 1);
}

TEST_CASE("null takes an optional key away, with what goes together with it", "[override]") {
    const double usual = fovOf(parse("film: {resolution: [8, 8]}\n"));
    CHECK(fovOf(with(kLens, {"camera.focal_length=null"})) == Approx(usual));
    CHECK(fovOf(with(kAngle, {"camera.fov=null"})) == Approx(usual));
    CHECK(with(kAngle, {"camera.aperture_radius=null"}).camera.aperture_radius == 0);

    const std::string lamp =
        "materials: {m: {type: diffuse, reflectance: 0}}\nobjects: [{mesh: " + kTriangle +
        ", material: m, emission: {radiance: 1}}]\n";
    CHECK(with(lamp, {}).objects[0].emission == 0);
    CHECK(with(lamp, {"objects.0.emission=null"}).objects[0].emission == -1);
    CHECK_FALSE(with("environment: {radiance: 1}\n", {"environment=null"}).environment);

    // null does not remove required keys, and does not create missing ones.
    CHECK_THAT(
        refusedOverride("materials: {m: {type: diffuse, reflectance: 0}}\n", "materials.m.reflectance=null"),
        Contains("found nothing"));
    CHECK_THAT(refusedOverride(lamp, "objects.0.emission.radiance=null"),
               Contains("needs radiance or luminance_cd_m2"));
    CHECK_THAT(refusedOverride("environment: {radiance: 1}\n", "environment.radiance=null"),
               Contains("environment needs radiance or image or sky"));
    CHECK_THAT(refusedOverride(kAngle, "camera.fvo=null"), Contains("did you mean 'fov'?"));
    CHECK_THAT(refusedOverride("spectra: {a: 1}\n", "spectra.a=null"), Contains("found nothing"));
}

TEST_CASE("arguments that exclude one another are told", "[override][refused]") {
    CHECK_THAT(
        refused(kAngle, {{"camera.fov", "50"}, {"camera.focal_length", "1"}, {"camera.sensor", "[1, 1]"}}),
        Contains("'fov' and 'focal_length' in camera exclude each other"));
    CHECK_THAT(refused("spectra: {a: {glass: BK7}}\n",
                       {{"spectra.a.rgb", "[1, 1, 1]"}, {"spectra.a.blackbody", "3000"}}),
               Contains("'rgb' and 'blackbody' in spectrum 'a' exclude each other"));
    // Nothing takes the radiance's place here, so it does not vanish.
    CHECK_THAT(refusedOverride("environment: {radiance: 1}\n", "environment.scale=2"),
               Contains("'radiance' and 'scale' in environment exclude each other"));
    CHECK_THAT(refusedOverride(kAngle, "camera.focal_length=1"),
               Contains("'focal_length' in camera needs 'sensor' too"));
}

TEST_CASE("what gives way follows from the rules of every section", "[override]") {
    for (const SectionSchema& section : sceneSchema())
        for (const KeyRule& rule : section.rules) {
            if (rule.kind == KeyRule::Kind::Together) continue;
            for (const std::string& key : rule.keys) {
                INFO(section.name << " " << key);
                const std::set<std::string> gone =
                    givingWay(section, [&](const std::string& other) { return other == key; });
                CHECK_FALSE(gone.contains(key));
                if (rule.kind != KeyRule::Kind::ExactlyOne) continue;
                for (const std::string& other : rule.keys) CHECK((other == key || gone.contains(other)));
            }
        }
}

// ---- Hints ----------------------------------------------------------------------------------------------

TEST_CASE("a colour written as elsewhere is told how to be written", "[hints][refused]") {
    CHECK_THAT(refusedReflectance("[0.7, 0.5, 0.25]"), Contains("write {rgb: [0.7, 0.5, 0.25]}"));
    CHECK_THAT(refusedReflectance("red"), Contains("write {rgb: [1, 0, 0]}"));
    CHECK_THAT(refusedReflectance("\"#ff8000\""), Contains("write {rgb: [1, 0.502, 0]}"));
    CHECK_THAT(refusedReflectance("'#f00'"), Contains("write {rgb: [1, 0, 0]}"));
    CHECK_THAT(refused("environment:\n  radiance: [2, 1, 1]\n"),
               Contains("write {rgb: [2, 1, 1], space: linear}"));
    CHECK_THAT(refused("materials:\n  m:\n    type: diffuse\n    reflectance: #ff0000\n"),
               Contains("'#' begins a comment; write {rgb: [1, 0, 0]}"));
    // An index is no colour.
    CHECK_THAT(refused("materials: {m: {type: dielectric, ior: [1, 1, 1]}}\n"), !Contains("rgb"));
    CHECK_THAT(refusedReflectance("[0.7, 0.5]"), !Contains("write"));
}

TEST_CASE("a value in place of the map around it is told the map", "[hints][refused]") {
    const auto object = [](const std::string& keys) {
        return refused(
            "materials: {m: {type: diffuse, reflectance: 0}}\n"
            "objects:\n  - {material: m, " +
            keys + "}\n");
    };
    const std::string mesh = "mesh: " + kTriangle;
    CHECK_THAT(object(mesh + ", emission: 5"), Contains("write {radiance: 5}"));
    CHECK_THAT(object(mesh + ", emission: glow"), Contains("write {radiance: glow}"));
    CHECK_THAT(object(mesh + ", emission: [5, 4, 3]"),
               Contains("write {radiance: {rgb: [5, 4, 3], space: linear}}"));
    CHECK_THAT(object("sphere: 2"), Contains("write {radius: 2}"));
    CHECK_THAT(object("box: [1, 2, 3]"), Contains("write {size: [1, 2, 3]}"));
    CHECK_THAT(refused("environment: 1\n"), Contains("write {radiance: 1}"));
    CHECK_THAT(refused("environment: sky.exr\n"), Contains("write {image: sky.exr}"));
}

TEST_CASE("words of other programs are told crt's", "[hints][refused]") {
    const auto sphere = refused(
        "materials: {m: {type: diffuse, reflectance: 0}}\n"
        "objects:\n  - {material: m, sphere: {radius: 1, center: [0, 1, 0]}}\n");
    CHECK_THAT(sphere, Contains("'transform: [{translate: [x, y, z]}]'"));
    CHECK_THAT(refused("materials: {m: {type: glass, ior: 1.5}}\n"), Contains("did you mean 'dielectric'?"));
    CHECK_THAT(refused("materials: {m: {type: diffuse, color: 0.5}}\n"),
               Contains("its colour is 'reflectance'"));
    CHECK_THAT(refused("materials: {m: {type: conductor, metal: Au, roughness: 0.3}}\n"),
               Contains("write type: rough_conductor"));
    CHECK_THAT(refused("materials: {m: {type: dielectric, ior: 1.5, roughness: 0.3}}\n"),
               Contains("write type: rough_dielectric"));
    const auto lumens = refused(
        "materials: {m: {type: diffuse, reflectance: 0}}\n"
        "objects:\n  - {material: m, mesh: " +
        kTriangle + ", emission: {lumens: 800}}\n");
    CHECK_THAT(lumens, Contains("its brightness is 'luminous_flux_lm'"));
    CHECK_THAT(refused("lights: [{type: area}]\n"), Contains("an object with an 'emission'"));
}
