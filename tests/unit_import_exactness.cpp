// Features of a glTF file that a scene cannot express, and their import: alpha of vertices, tangents,
// specular and glossiness, and lights that would leave the image black.
#include "imported.h"

#include "scene/import/scene_text.h"
#include "scene/light_units.h"

#include <cmath>

using namespace crt;
using namespace crt::test;

// Fails when alpha of COLOR_0 is left out, counts for an opaque material, or is taken of a texture.
TEST_CASE("The alpha of vertices is opacity where the material has some", "[gltf][import]") {
    const auto with = [](const Json& material, const std::vector<float>& alpha, bool textured = false) {
        return importOf(material, [&](GltfMaker& m) {
            if (textured) m.texture(rgba(2, 2, kFourTexels));
            std::vector<float> colors;
            for (const float a : alpha) colors.insert(colors.end(), {1, 0.5f, 0.25f, a});
            m.root["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = m.floats("VEC4", 4, colors);
        });
    };
    const std::vector<float> even{0.5f, 0.5f, 0.5f, 0.5f}, ramp{0, 1, 1, 0.5f};
    const Json factor{{"baseColorFactor", {1, 1, 1, 0.5}}};
    const Json blend{{"alphaMode", "BLEND"}}, mask{{"alphaMode", "MASK"}, {"alphaCutoff", 0.75}};
    CHECK_THAT(with(Json::object(), ramp).text, !Contains("opacity"));
    CHECK_THAT(with(blend, even).text, Contains("geometry_opacity: 0.5\n") && !Contains("vertex_opacity"));
    CHECK_THAT(with(mask, even).text, Contains("geometry_opacity: 0\n"));
    Json both = blend;
    both["pbrMetallicRoughness"] = factor;
    CHECK_THAT(with(both, even).text, Contains("geometry_opacity: 0.25\n"));
    const Imported soft = with(both, ramp);
    CHECK_THAT(soft.text, Contains("geometry_opacity: {attribute: opacity, factor: 0.5}\n") &&
                              Contains(", vertex_opacity: true}"));
    CHECK(soft.scene.meshes[0].uvs_are_opacity);
    CHECK(soft.scene.meshes[0].uvs[3] == std::array<double, 2>{0.5, 0});
    CHECK_THAT(with(mask, ramp).text, Contains("geometry_opacity: {attribute: opacity, cutoff: 0.75}\n"));
    // Next to a texture, only an even alpha can be kept.
    both["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
    CHECK_THAT(with(both, even, true).text, Contains("channel: alpha, factor: 0.25}"));
    const Imported lost = with(both, ramp, true);
    CHECK_THAT(lost.text, Contains("channel: alpha, factor: 0.5}") && !Contains("vertex_opacity"));
    CHECK_THAT(lost.log, Contains("the alpha of vertices together with a texture"));
}

// Fails when tangents are not read, or those that exporters make of the coordinates are reported as
// different.
TEST_CASE("Tangents that are not those of the texture coordinates are a loss", "[gltf][import]") {
    const auto lossOf = [](const std::vector<float>& tangents, bool mapped = true) {
        Json material = Json::object();
        if (mapped) material["normalTexture"] = {{"index", 0}};
        return importOf(material,
                        [&](GltfMaker& m) {
                            m.texture(rgba(2, 2, kFourTexels));
                            m.root["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] =
                                m.floats("VEC4", 4, tangents);
                        })
            .log;
    };
    const auto four = [](float x, float y, float w) {
        std::vector<float> all;
        for (int i = 0; i < 4; ++i) all.insert(all.end(), {x, y, 0, w});
        return all;
    };
    CHECK_THAT(lossOf(four(1, 0, 1)), !Contains("TANGENT"));
    CHECK_THAT(lossOf(four(0.98f, 0.199f, 1)), !Contains("TANGENT"));  // 11.5 degrees
    CHECK_THAT(lossOf(four(0, 0, 1)), !Contains("TANGENT"));
    CHECK_THAT(lossOf(four(0.95f, 0.312f, 1)), Contains("tangents (TANGENT) that differ"));  // 18 degrees
    CHECK_THAT(lossOf(four(1, 0, -1)), Contains("tangents (TANGENT) that differ"));
    CHECK_THAT(lossOf(four(0, 1, 1)), Contains("tangents (TANGENT) that differ"));
    CHECK_THAT(lossOf(four(0, 1, 1), false), !Contains("TANGENT"));
}

// Fails when metals are taken for dielectrics, what is mirrored is not taken off the diffuse colour, alpha
// is not the glossiness, or the extension wins over what the file says better.
TEST_CASE("Specular and glossiness become a metal or a dielectric", "[gltf][import]") {
    const auto textOf = [](const Json& value, bool textured = false, Json material = Json::object()) {
        material["extensions"]["KHR_materials_pbrSpecularGlossiness"] = value;
        const Imported result = importOf(material, [&](GltfMaker& maker) {
            maker.root["extensionsUsed"] =
                maker.root["extensionsRequired"] = {"KHR_materials_pbrSpecularGlossiness"};
            if (textured) maker.texture(rgba(2, 2, kFourTexels));
        });
        return result.text + result.log;
    };
    const Json plastic{{"diffuseFactor", {0.5, 0.25, 0.125, 1}},
                       {"specularFactor", {0.25, 0.25, 0.25}},
                       {"glossinessFactor", 0.75}};
    CHECK_THAT(textOf(plastic), Contains("base_color: {rgb: [0.375, 0.1875, 0.09375], space: linear}\n    "
                                         "specular_roughness: 0.25\n    specular_ior: 3\n"));
    const Json gold{{"diffuseFactor", {0, 0, 0, 1}}, {"specularFactor", {1, 0.5, 0.25}}};
    CHECK_THAT(textOf(gold), Contains("base_color: {rgb: [1, 0.5, 0.25], space: linear}\n    "
                                      "base_metalness: 1\n    specular_roughness: 0\n"));
    const Json by_texture{{"diffuseFactor", {0, 0, 0, 1}}, {"specularGlossinessTexture", {{"index", 0}}}};
    CHECK_THAT(textOf(by_texture, true),
               Contains("base_color: {texture: a.glb, image: 0}\n    base_metalness: 1\n    "
                        "specular_roughness: " +
                        yamlNumber(1 - (255 + 128 + 64) / 4.0 / 255)) &&
                   Contains("glossiness by a texture: crt uses its mean"));
    const Json painted{{"diffuseTexture", {{"index", 0}}}, {"specularFactor", {0, 0, 0}}};
    CHECK_THAT(textOf(painted, true),
               Contains("base_color: {texture: a.glb, image: 0}\n") && Contains("specular_ior: 1\n"));
    const Json both{
        {"pbrMetallicRoughness",
         {{"baseColorTexture", {{"index", 0}}}, {"metallicFactor", 0}, {"roughnessFactor", 0.5}}}};
    CHECK_THAT(textOf(gold, true, both),
               Contains("base_color: {texture: a.glb, image: 0}\n    specular_roughness: 0.5\n"));
    // Half of the texels are a metal's: the green ones of 128 and 200.
    const Json mixed{{"diffuseTexture", {{"index", 0}}}, {"specularGlossinessTexture", {{"index", 0}}}};
    const std::string text = textOf(mixed, true);
    CHECK_THAT(text,
               Contains("type: mix\n    materials: [\"material 0 (dielectric)\", \"material 0 "
                        "(metal)\"]\n    amount: {texture: a.glb, image: 0, channel: green, cutoff: "));
    CHECK_THAT(text, Contains("base_color: {texture: a.glb, image: 0, factor: [0.96, 0.96, 0.96]}\n    "
                              "specular_roughness: ") &&
                         Contains("base_color: {texture: a.glb, image: 0}\n    base_metalness: 1\n"));
    CHECK_THAT(text, Contains("metal where it is bright"));
    const double cutoff = std::stod(text.substr(text.find("cutoff: ") + 8));
    CHECK(srgbToLinear(cutoff) == Approx(0.2));
    // A metal that has the diffuse texture of something else keeps that.
    const Json shiny{{"diffuseTexture", {{"index", 0}}}, {"specularFactor", {0.6, 0.6, 0.6}}};
    CHECK_THAT(textOf(shiny, true),
               Contains("base_color: {texture: a.glb, image: 0, factor: [0.4, 0.4, 0.4]}"
                        "\n    specular_roughness: 0\n") &&
                   Contains("a metal with a texture of diffuse colour: crt makes it a dielectric"));
    CHECK_THAT(textOf({{"diffuseFactor", "red"}, {"specularFactor", {1}}, {"glossinessFactor", {}}}),
               Contains("base_metalness: 1\n"));
}

// Fails when metal and glass are black beside lights that they cannot show, or other models get a sky.
TEST_CASE("Lights of a file have a sky beside them where most of it is metal or glass", "[gltf][import]") {
    const auto with = [](double metal, double rough, const Json& extensions = Json::object()) {
        return importOf({{"pbrMetallicRoughness", {{"metallicFactor", metal}, {"roughnessFactor", rough}}},
                         {"extensions", extensions}},
                        [](GltfMaker& m) {
                            m.root["extensions"]["KHR_lights_punctual"]["lights"] = {
                                {{"type", "directional"}, {"intensity", 2}}};
                            m.node({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
                        });
    };
    const Json glass{{"KHR_materials_transmission", {{"transmissionFactor", 1}}}};
    for (const Imported& dark : {with(1, 0.1), with(0, 0.5, glass)}) {
        REQUIRE(dark.scene.environment.has_value());
        CHECK(dark.scene.point_lights.size() == 1);
        CHECK_THAT(dark.log,
                   Contains("a grey sky in addition to the file's lights") && Contains("--set "
                                                                                       "environment=null"));
        // Half as bright as white, whatever the exposure.
        CHECK(photometric(dark.scene.environment->radiance) / (kLuminousEfficacy_lm_W * cieYIntegral()) *
                  std::exp2(dark.scene.film.exposure_ev) ==
              Approx(0.5).epsilon(0.02));
    }
    for (const Imported& lit : {with(1, 0.6), with(0, 0.1), with(0.25, 0.1)}) {
        CHECK_FALSE(lit.scene.environment.has_value());
        CHECK_THAT(lit.log, !Contains("sky"));
    }
}

TEST_CASE("Lamps of an OBJ that are too weak have a sky beside them", "[import]") {
    const TemporaryFolder folder;
    const CapturedLog log;
    const std::string path = folder.write(
        "a.obj",
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl lamp\nf 1 2 3\nusemtl red\nf 1 2 4\n");
    folder.write("a.mtl", "newmtl red\nKd 1 0 0\nnewmtl lamp\nKe 0.01 0.01 0.01\n");
    const Scene weak = loadScene(path);
    CHECK(weak.environment.has_value());
    CHECK_FALSE(loadScene(path, {parseOverride("environment=null")}).environment.has_value());
    CHECK(weak.point_lights.empty());
    CHECK_THAT(log.text(), Contains("too weak"));
    folder.write("a.mtl", "newmtl red\nKd 1 0 0\nnewmtl lamp\nKe 1 1 1\n");
    CHECK_FALSE(loadScene(path).environment.has_value());
}
