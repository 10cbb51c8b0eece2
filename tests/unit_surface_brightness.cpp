// Scene YAML: surfaces that emit by luminance, luminous flux or watts.
#include "base/temporary_folder.h"
#include "image/image_io.h"
#include "scene_texts.h"

#include "scene/light_units.h"
#include "scene/scene.h"

#include <numbers>

using namespace crt;
using namespace crt::test;

namespace {

constexpr double kPiHere = std::numbers::pi;

/// A black object of this geometry and this emission.
std::string shiningScene(const std::string& geometry, const std::string& emission,
                         const std::string& more = "") {
    return more + "materials: {black: {type: diffuse, reflectance: 0}}\nobjects: [{material: black, " +
           geometry + ", emission: {" + emission + "}}]\n";
}

Emission lampOf(const std::string& body) {
    const Scene scene = parse(body);
    REQUIRE(scene.emissions.size() == 1);
    return scene.emissions[0];
}

double luminanceOf(const std::string& body) { return photometric(lampOf(body).radiance); }

const std::string kLampQuad = "mesh: {positions: [[0,0,0],[2,0,0],[2,3,0],[0,3,0]], faces: [[0,1,2,3]]}";

}  // namespace

// Fails when the default colour is not D65, or the amount is taken for a radiance.
TEST_CASE("a surface may shine by its luminance", "[scene_yaml][lights]") {
    const Emission lamp = lampOf(shiningScene(kLampQuad, "luminance_cd_m2: 1000"));
    CHECK(photometric(lamp.radiance) == Approx(1000));
    const Spectrum d65 = illuminantSpectrum("D65").value();
    CHECK(lamp.radiance[100] / lamp.radiance[300] == Approx(d65[100] / d65[300]));
    CHECK(luminanceOf(shiningScene(kLampQuad, "luminance_cd_m2: 250, spectrum: {blackbody: 3000}")) ==
          Approx(250));
    CHECK(luminanceOf(shiningScene(kLampQuad, "luminance_cd_m2: 250, two_sided: true")) == Approx(250));
    CHECK(luminanceOf(shiningScene(kLampQuad, "luminance_cd_m2: 0")) == 0);
    // Lengths do not matter to it.
    CHECK(luminanceOf(shiningScene(kLampQuad, "luminance_cd_m2: 250", "unit: mm\n")) == Approx(250));
}

// Fails when placements, sides, the scale of a placement or the unit of length are left out.
TEST_CASE("a surface may shine by its flux: over π, its area and its sides", "[scene_yaml][lights]") {
    const std::string flux = "luminous_flux_lm: 1200";
    CHECK(luminanceOf(shiningScene(kLampQuad, flux)) == Approx(1200 / (kPiHere * 6)));
    CHECK(luminanceOf(shiningScene(kLampQuad, flux + ", two_sided: true")) == Approx(1200 / (kPiHere * 12)));
    CHECK(luminanceOf(shiningScene(kLampQuad, flux, "unit: cm\n")) == Approx(1200 / (kPiHere * 6e-4)));
    CHECK(luminanceOf(shiningScene(
              kLampQuad + ", transforms: [[{translate: [1, 2, 3]}], [{scale: 2}, {rotate: {axis: "
                          "[1, 1, 0], angle_deg: 40}}]]",
              flux)) == Approx(1200 / (kPiHere * (6 + 24))));
    CHECK(luminanceOf(shiningScene(kLampQuad + ", transform: [{scale: [2, 0.5, 7]}]", flux)) ==
          Approx(1200 / (kPiHere * 6)));
    const Emission lamp = lampOf(shiningScene(kLampQuad, "power_w: 5, spectrum: {blackbody: 3000}"));
    CHECK(integralOverWavelengths(lamp.radiance) == Approx(5 / (kPiHere * 6)));
}

// Fails when a shape's area is that of another one, or of all of a part of it.
TEST_CASE("flux of spheres, disks and cylinders", "[scene_yaml][lights]") {
    for (const auto& [shape, area] : {std::pair{"sphere: {radius: 0.5}", kPiHere},
                                      {"sphere: {radius: 0.5, from_z: 0}", kPiHere / 2},
                                      {"sphere: {radius: 0.5, from_z: -0.25, to_z: 0.125}", 0.375 * kPiHere},
                                      {"disk: {radius: 0.5}", kPiHere / 4},
                                      {"cylinder: {radius: 0.5, from_z: -1, to_z: 2}", 3 * kPiHere}}) {
        INFO(shape);
        CHECK(luminanceOf(shiningScene(shape, "luminous_flux_lm: 10")) == Approx(10 / (kPiHere * area)));
        CHECK(luminanceOf(shiningScene(std::string(shape) + ", transform: [{scale: -3}]",
                                       "luminous_flux_lm: 10")) == Approx(10 / (kPiHere * 9 * area)));
    }
}

// Fails when the colour is left out, or the radiance is no factor of the image.
TEST_CASE("a surface may shine in a colour by place", "[scene_yaml][lights]") {
    const Spectrum radiance =
        lampOf(shiningScene(kLampQuad, "radiance: 4, color: {table: {nm: [360, 830], value: [0, 1]}}"))
            .radiance;
    CHECK(radiance[0] == 0);
    CHECK(radiance[470] == Approx(4));
    CHECK(radiance[235] == Approx(2));
    const TemporaryFolder folder;
    Image image;
    image.width = image.height = 2;
    image.channels = {"R", "G", "B"};
    image.pixels = {0, 0, 0, 1, 1, 1, 0.5, 0.5, 0.5, 0, 0, 1};
    const std::string path = folder.path() + "/a.pfm";
    writeImage(path, OutputFormat::Pfm, image);
    const std::string with_uvs =
        "mesh: {positions: [[0,0,0],[2,0,0],[2,3,0],[0,3,0]], uvs: "
        "[[0,0],[1,0],[1,1],[0,1]], faces: [[0,1,2,3]]}";
    const std::string color = "color: {texture: " + path + "}";
    const Scene scene = parse(shiningScene(with_uvs, "luminance_cd_m2: 100, " + color));
    const Emission& lamp = scene.emissions[0];
    REQUIRE(lamp.texture != kNoTexture);
    const Texture& texture = scene.textures[static_cast<std::size_t>(lamp.texture)];
    REQUIRE(texture.factor);
    CHECK(texture.factor->spectrum == lamp.radiance);
    CHECK(photometric(lamp.radiance) == Approx(100));
    CHECK_THAT(refused(shiningScene(kLampQuad, "radiance: 1, " + color)),
               Contains("no texture coordinates") && Contains("give the mesh 'uvs'"));
    CHECK_THAT(refused(shiningScene("sphere: {radius: 1}", "radiance: 1, " + color)),
               Contains("only a mesh can emit an image"));
    CHECK_THAT(refused(shiningScene(with_uvs, "luminous_flux_lm: 1, " + color)),
               Contains("the flux of a surface with 'color' is not known"));
    CHECK_THAT(refused(shiningScene(with_uvs, "radiance: 1, color: {checker: [0, 1]}")),
               Contains("what emits is an image"));
    CHECK_THAT(
        refused(shiningScene(with_uvs, "radiance: 1, color: {texture: " + path + ", vertex_colors: true}")),
        Contains("without 'vertex_colors'"));
}

TEST_CASE("brightness of surfaces that cannot be is refused", "[scene_yaml][lights]") {
    CHECK_THAT(refused(shiningScene(kLampQuad, "two_sided: true")),
               Contains("needs radiance or luminance_cd_m2"));
    CHECK_THAT(refused(shiningScene(kLampQuad, "radiance: 1, luminance_cd_m2: 1")),
               Contains("luminance_cd_m2"));
    CHECK_THAT(refused(shiningScene(kLampQuad, "radiance: 1, spectrum: 1")), Contains("spectrum"));
    CHECK_THAT(refused(shiningScene(kLampQuad, "luminance_cd_m2: -1")), Contains("luminance_cd_m2"));
    CHECK_THAT(refused(shiningScene(kLampQuad, "luminous_flux_lm: 1, spectrum: 0")),
               Contains("no light that 'luminous_flux_lm' measures"));
    CHECK_THAT(refused(shiningScene(kLampQuad + ", transform: [{scale: 1e-20}]", "luminous_flux_lm: 1e9")),
               Contains("too bright"));
    CHECK_THAT(refused(shiningScene(kLampQuad + ", transform: [{scale: 1e200}]", "luminous_flux_lm: 1")),
               Contains("no area that this makes shine"));
}
