// The result of `crt import` for a model: the scene reads back as the model itself does, and materials,
// textures, lights and cameras are what the formats say.
//
// Over 450 lines: one part of the formats after the other, each short.
#include "imported.h"

#include "scene/import/scene_text.h"
#include "scene/light_units.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <numbers>

using namespace crt;
using namespace crt::test;

// Fails when the text in memory is another than that of `crt import`, or refers to other files.
TEST_CASE("A model and the scene that is imported of it compile to equal bytes", "[gltf][import]") {
    GltfMaker maker = squareFile();
    maker.texture(rgba(2, 2, kFourTexels));
    maker.add("materials",
              {{"name", "Paint \"1\": no"},
               {"alphaMode", "BLEND"},
               {"normalTexture", {{"index", 0}, {"scale", 0.5}}},
               {"pbrMetallicRoughness",
                {{"baseColorTexture", {{"index", 0}}}, {"metallicRoughnessTexture", {{"index", 0}}}}}});
    maker.root["meshes"][0]["primitives"][0]["material"] = 0;
    maker.node({{"mesh", 0}, {"translation", {0.1, 0.2, -3}}, {"scale", {1, -2, 0.3}}});
    const TemporaryFolder folder;
    const CapturedLog log;
    const std::string model = folder.write("a model.glb", maker.glb());
    std::filesystem::create_directory(folder / "scenes");
    GltfFiles files;
    const std::string scene =
        folder.write("scenes/a.yaml",
                     importModel(files, model, {.folder = folder / "scenes", .allow_outside = false}).scene);
    const CompiledScene from_model = compileScene(loadScene(model), 0),
                        from_scene = compileScene(loadScene(scene), 0);
    REQUIRE(from_model.size_bytes == from_scene.size_bytes);
    CHECK(std::memcmp(from_model.data(), from_scene.data(), from_model.size_bytes) == 0);
    CHECK(from_model.hash == from_scene.hash);
}

// Fails when columns are taken for rows, a quaternion turns the other way, or parents are multiplied from
// the wrong side.
TEST_CASE("Nodes are placed by matrices, and by translation, rotation and scale", "[gltf][import]") {
    GltfMaker maker = squareFile();
    const double h = std::numbers::sqrt2 / 2;  // A quarter turn about z takes x to y.
    maker.root["nodes"] = {{{"translation", {1, 0, 0}}, {"children", {1}}},
                           {{"rotation", {0, 0, h, h}}, {"scale", {2, 3, 1}}, {"mesh", 0}},
                           {{"matrix", {0, 2, 0, 0, -3, 0, 0, 0, 0, 0, 1, 0, 1, 0, 0, 1}}, {"mesh", 0}}};
    maker.root["scenes"] = {{{"nodes", {0, 2}}}};
    const Scene scene = importOf(maker).scene;
    REQUIRE(scene.objects.size() == 1);  // One mesh, stored once.
    REQUIRE(scene.objects[0].transforms.size() == 2);
    const Matrix4d wanted{0, -3, 0, 1, 2, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    for (std::size_t i = 0; i < 16; ++i) {
        CHECK(scene.objects[0].transforms[0][i] == Approx(wanted[i]).margin(1e-12));
        CHECK(scene.objects[0].transforms[1][i] == wanted[i]);
    }
}

// Fails when channel, factor or threshold of a texture are not applied where its texels are decoded.
TEST_CASE("Channels of a texture become numbers, with factor and threshold", "[gltf][import]") {
    const auto texture = [](GltfMaker& m) { m.texture(rgba(2, 2, kFourTexels)); };
    const Json color{
        {"baseColorTexture", {{"index", 0}}}, {"baseColorFactor", {1, 1, 1, 0.5}}, {"metallicFactor", 0}};
    const Scene blend = importOf({{"alphaMode", "BLEND"}, {"pbrMetallicRoughness", color}}, texture).scene;
    const TextureIndex opacity = blend.materials[0].opacity_texture;
    REQUIRE(opacity != kNoTexture);
    const auto half = [](int code) { return static_cast<std::uint16_t>(code * 257 * 0.5 + 0.5); };
    CHECK(wordsOf(blend.textures[static_cast<std::size_t>(opacity)]) ==
          std::vector<std::uint16_t>{half(255), half(128), 0, half(64)});
    // From 0.1 of alpha times 0.5 on: codes from 51.
    const Scene mask =
        importOf({{"alphaMode", "MASK"}, {"alphaCutoff", 0.1}, {"pbrMetallicRoughness", color}}, texture)
            .scene;
    CHECK(wordsOf(mask.textures[static_cast<std::size_t>(mask.materials[0].opacity_texture)]) ==
          std::vector<std::uint16_t>{65535, 65535, 0, 65535});
    CHECK(importOf({{"pbrMetallicRoughness", color}}, texture).scene.materials[0].isOpaque());
}

// Fails when roughness is read from another channel than green, or metalness from another than blue.
TEST_CASE("Metalness and roughness in one texture become those of one material", "[gltf][import]") {
    const Json rough{
        {"name", "paint"},
        {"pbrMetallicRoughness", {{"metallicRoughnessTexture", {{"index", 0}}}, {"roughnessFactor", 0.5}}}};
    const Imported result = importOf(rough, [](GltfMaker& m) { m.texture(rgba(2, 2, kFourTexels)); });
    CHECK_THAT(result.text,
               Contains("base_metalness: {texture: a.glb, image: 0, channel: blue}\n    "
                        "specular_roughness: {texture: a.glb, image: 0, channel: green, factor: 0.5}\n"));
    const Scene& scene = result.scene;
    REQUIRE(scene.materials.size() == 3);
    for (std::size_t i = 0; i < 2; ++i) {
        const TextureIndex texture = scene.materials[i].roughness_texture;
        REQUIRE(texture != kNoTexture);
        CHECK(wordsOf(scene.textures[static_cast<std::size_t>(texture)])[2] ==
              static_cast<std::uint16_t>(200 * 257 * 0.5 + 0.5));
    }
    CHECK_THAT(result.log, !Contains("roughness"));
}

// Fails when a pane keeps its glass clear, or a texture of specular colour is left out or not multiplied.
TEST_CASE("Colours of thin glass and of specular reflections may be textures", "[gltf][import]") {
    const auto texture = [](GltfMaker& m) { m.texture(rgba(2, 2, kFourTexels)); };
    const Json stained{{"pbrMetallicRoughness",
                        {{"baseColorTexture", {{"index", 0}}}, {"baseColorFactor", {1, 0.5, 0.5, 1}}}},
                       {"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 1}}}}}};
    const Imported glass = importOf(stained, texture);
    CHECK_THAT(glass.text, Contains("tint: {texture: a.glb, image: 0, factor: [1, 0.5, 0.5]}\n"));
    CHECK_THAT(glass.log, !Contains("tint"));
    const Json silk{
        {"pbrMetallicRoughness", {{"metallicFactor", 0.5}}},
        {"extensions",
         {{"KHR_materials_specular",
           {{"specularColorFactor", {0.5, 0.25, 0.125}}, {"specularColorTexture", {{"index", 0}}}}}}}};
    const Imported gloss = importOf(silk, texture);
    // A metal reflects by its base colour: it is a separate material.
    CHECK_THAT(gloss.text,
               Contains("(dielectric)") &&
                   Contains("specular_color: {texture: a.glb, image: 0, factor: [0.5, 0.25, 0.125]}"));
    CHECK_THAT(gloss.log, !Contains("specular"));
}

// Fails when the roughness of a coat is read from another channel than green, or its factor is left out.
TEST_CASE("The roughness of a clear coat may be a texture", "[gltf][import]") {
    const Json coat{{"clearcoatFactor", 1},
                    {"clearcoatRoughnessFactor", 0.5},
                    {"clearcoatRoughnessTexture", {{"index", 0}}}};
    const Imported result = importOf({{"pbrMetallicRoughness", {{"metallicFactor", 0}}},
                                      {"extensions", {{"KHR_materials_clearcoat", coat}}}},
                                     [](GltfMaker& m) { m.texture(rgba(2, 2, kFourTexels)); });
    CHECK_THAT(result.text, Contains("coat_weight: 1\n    coat_roughness: {texture: a.glb, image: 0, "
                                     "channel: green, factor: 0.5}\n"));
    REQUIRE(result.scene.materials.size() == 1);
    CHECK(result.scene.materials[0].clearcoat->roughness_texture != kNoTexture);
    CHECK_THAT(result.log, !Contains("roughness"));
}

// Fails when the turn has the other sense, or v is turned up before the transform instead of behind it.
TEST_CASE("KHR_texture_transform moves an image as glTF says", "[gltf][import]") {
    const double ox = 0.1, oy = 0.2, turn = 0.3, sx = 2, sy = 3;
    const Json transform{{"offset", {ox, oy}}, {"rotation", turn}, {"scale", {sx, sy}}};
    const Scene scene =
        importOf({{"pbrMetallicRoughness",
                   {{"metallicFactor", 0},
                    {"baseColorTexture",
                     {{"index", 0}, {"extensions", {{"KHR_texture_transform", transform}}}}}}}},
                 [](GltfMaker& m) { m.texture(rgba(2, 2, kFourTexels)); })
            .scene;
    const std::array<double, 6>& m =
        scene.textures[static_cast<std::size_t>(scene.materials[0].reflectance_texture)].transform;
    for (const auto& [u, v] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {0.3, 0.7}}) {
        // The extension's text: T R S with R = (c s; -s c), v down.
        const double c = std::cos(turn), s = std::sin(turn);
        const double wanted_u = ox + c * sx * u + s * sy * v, wanted_v = oy - s * sx * u + c * sy * v;
        const double up = 1 - v;
        CHECK(m[0] * u + m[1] * up + m[2] == Approx(wanted_u));
        CHECK(1 - (m[3] * u + m[4] * up + m[5]) == Approx(wanted_v));
    }
}

// Fails when colours of vertices, or their factor, are left out.
TEST_CASE("Colours of vertices are the base colour, times its factor", "[gltf][import]") {
    const Imported result =
        importOf({{"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 1, 1, 1}}, {"metallicFactor", 0}}}},
                 [](GltfMaker& m) {
                     m.root["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
                         m.points({1, 0, 0, 0, 1, 0, 0, 0, 1, 0.25, 0.25, 0.25});
                 });
    CHECK_THAT(result.text, Contains("base_color: {attribute: colors}"));
    REQUIRE(result.scene.meshes[0].colors.size() == 4);
    CHECK(result.scene.meshes[0].colors[3] == std::array<float, 3>{0.125f, 0.25f, 0.25f});
}

// Fails when one of the two is left out, or the file's factor counts twice.
TEST_CASE("Colours of vertices multiply a texture of the base colour", "[gltf][import]") {
    const Imported result =
        importOf({{"pbrMetallicRoughness",
                   {{"baseColorFactor", {0.5, 1, 1, 1}}, {"baseColorTexture", {{"index", 0}}}}}},
                 [](GltfMaker& m) {
                     m.texture(rgba(2, 2, kFourTexels));
                     m.root["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
                         m.points({1, 0, 0, 0, 1, 0, 0, 0, 1, 0.25, 0.25, 0.25});
                 });
    CHECK_THAT(result.text, Contains("factor: [0.5, 1, 1], vertex_colors: true"));
    REQUIRE(result.scene.meshes[0].colors.size() == 4);
    CHECK(result.scene.meshes[0].colors[3] == std::array<float, 3>{0.25f, 0.25f, 0.25f});
    const auto& texture =
        result.scene.textures[static_cast<std::size_t>(result.scene.materials[0].reflectance_texture)];
    REQUIRE(texture.factor);
    CHECK(result.scene.textures[static_cast<std::size_t>(texture.factor->texture)].kind ==
          Texture::Kind::VertexColors);
}

// Fails when the image is left out, or what it is multiplied with.
TEST_CASE("An image that emits stays one", "[gltf][import]") {
    const auto texture = [](GltfMaker& m) { m.texture(rgba(2, 2, kFourTexels)); };
    const Imported lamp =
        importOf({{"emissiveFactor", {1, 0.5, 0}}, {"emissiveTexture", {{"index", 0}}}}, texture);
    CHECK_THAT(lamp.text,
               Contains("emission: {radiance: {rgb: [1, 0.5, 0], space: linear, scale: 1}, color: "
                        "{texture: a.glb, image: 0"));
    REQUIRE(lamp.scene.emissions.size() == 1);
    CHECK(lamp.scene.emissions[0].texture != kNoTexture);
    const Imported unlit =
        importOf({{"extensions", {{"KHR_materials_unlit", Json::object()}}},
                  {"pbrMetallicRoughness",
                   {{"baseColorFactor", {0.5, 1, 1, 1}}, {"baseColorTexture", {{"index", 0}}}}}},
                 texture);
    CHECK_THAT(unlit.text, Contains("color: {texture: a.glb, image: 0, factor: [0.5, 1, 1]") &&
                               Contains("two_sided: true}") && Contains("reflectance: 0\n"));
}

// Fails when an extension is read by another name, or becomes another key.
TEST_CASE("Extensions of materials become keys of OpenPBR", "[gltf][import]") {
    const auto textOf = [](const char* extension, const Json& value, Json material = Json::object()) {
        material["pbrMetallicRoughness"] = {{"metallicFactor", 0}, {"roughnessFactor", 0.25}};
        material["extensions"][extension] = value;
        return importOf(material).text;
    };
    CHECK_THAT(textOf("KHR_materials_ior", {{"ior", 1.7}}), Contains("specular_ior: 1.7\n"));
    CHECK_THAT(textOf("KHR_materials_specular", {{"specularFactor", 0.5}}),
               Contains("specular_weight: 0.5\n") && !Contains("specular_color"));
    CHECK_THAT(textOf("KHR_materials_specular", {{"specularColorFactor", {0.5, 0.5, 0.5}}}),
               Contains("specular_weight: 0.5\n") && !Contains("specular_color"));
    CHECK_THAT(
        textOf("KHR_materials_specular", {{"specularColorFactor", {1, 0.5, 0.25}}}),
        Contains("specular_color: {rgb: [1, 0.5, 0.25], space: linear}\n") && !Contains("specular_weight"));
    CHECK_THAT(textOf("KHR_materials_specular", {{"specularColorFactor", {4, 2, 1}}}),
               Contains("specular_weight: 4\n") &&
                   Contains("specular_color: {rgb: [1, 0.5, 0.25], space: linear}\n"));
    CHECK_THAT(
        textOf("KHR_materials_clearcoat", {{"clearcoatFactor", 0.75}, {"clearcoatRoughnessFactor", 0.1}}),
        Contains("coat_weight: 0.75\n    coat_roughness: 0.1\n    coat_ior: 1.5\n"));
    CHECK_THAT(
        textOf("KHR_materials_sheen", {{"sheenColorFactor", {0.5, 0.25, 0}}, {"sheenRoughnessFactor", 0.3}}),
        Contains("fuzz_weight: 0.5\n    fuzz_color: {rgb: [1, 0.5, 0], space: linear}\n    "
                 "fuzz_roughness: 0.3\n"));
    CHECK_THAT(textOf("KHR_materials_transmission", {{"transmissionFactor", 0.5}}),
               Contains("type: thin_dielectric") && Contains("amount: 0.5") && !Contains("tint:"));
    CHECK_THAT(
        textOf("KHR_materials_diffuse_transmission",
               {{"diffuseTransmissionFactor", 0.5}, {"diffuseTransmissionColorFactor", {1, 0.5, 0.25}}}),
        Contains("geometry_thin_walled: true\n    subsurface_weight: 0.5\n    subsurface_color: {rgb: "
                 "[1, 0.5, 0.25], space: linear}\n    subsurface_scatter_anisotropy: 1\n"));
    const Json body{
        {"KHR_materials_volume",
         {{"thicknessFactor", 2}, {"attenuationDistance", 0.5}, {"attenuationColor", {1, 0.5, 0.25}}}}};
    const std::string glass =
        textOf("KHR_materials_transmission", {{"transmissionFactor", 1}}, {{"extensions", body}});
    CHECK_THAT(glass,
               Contains("transmission_weight: 1\n    transmission_color: {rgb: [1, 0.5, 0.25], space: "
                        "linear}\n    transmission_depth: 0.5\n"));
    Json film = body;
    film["KHR_materials_iridescence"] = {{"iridescenceFactor", 1}, {"iridescenceThicknessMaximum", 300}};
    CHECK_THAT(textOf("KHR_materials_transmission", {{"transmissionFactor", 1}}, {{"extensions", film}}),
               Contains("thin_film_weight: 1\n    thin_film_thickness: 0.3\n    thin_film_ior: 1.3\n"));
    CHECK_THAT(
        textOf("KHR_materials_emissive_strength", {{"emissiveStrength", 4}},
               {{"emissiveFactor", {0.5, 0.25, 0}}, {"doubleSided", true}}),
        Contains("emission: {radiance: {rgb: [1, 0.5, 0], space: linear, scale: 2}, two_sided: true}"));
    CHECK_THAT(textOf("KHR_materials_unlit", Json::object()),
               Contains("reflectance: 0\n") && Contains("scale: 1}, two_sided: true}"));
}

// Fails when the default is taken, or the list of another variant.
TEST_CASE("A variant of a file's materials is chosen by its name", "[gltf][import]") {
    GltfMaker maker = squareFile();
    for (const char* name : {"plain", "red", "blue"}) maker.add("materials", {{"name", name}});
    maker.root["extensionsUsed"] = {"KHR_materials_variants"};
    maker.root["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "day"}},
                                                                      {{"name", "night"}}};
    Json& primitive = maker.root["meshes"][0]["primitives"][0];
    primitive["material"] = 0;
    primitive["extensions"]["KHR_materials_variants"]["mappings"] = {{{"material", 1}, {"variants", {0}}},
                                                                     {{"material", 2}, {"variants", {1}}}};
    const TemporaryFolder folder;
    const std::string path = folder.write("a.glb", maker.glb());
    const auto text = [&](const std::string& variant) {
        const CapturedLog log;
        GltfFiles files;
        return importModel(files, path, {.folder = {}, .allow_outside = false, .variant = variant}).scene;
    };
    CHECK_THAT(text(""), Contains("material: plain") && Contains("picks one of 'day', 'night'"));
    CHECK_THAT(text("day"), Contains("material: red") && !Contains("variants of materials"));
    CHECK_THAT(text("night"), Contains("material: blue"));
    CHECK_THROWS_WITH(text("nigth"), Contains("has no variant 'nigth', but 'day', 'night'") &&
                                         Contains("did you mean 'night'?"));
}

// Found by the fuzzer: a factor of 3e38 became a scene that crt itself refuses.
TEST_CASE("light beyond any use is refused at its place in the file", "[gltf][import]") {
    const auto refusal = [](const std::function<void(GltfMaker&)>& change) -> std::string {
        GltfMaker maker = squareFile();
        change(maker);
        const TemporaryFolder folder;
        GltfFiles files;
        try {
            return importModel(files, folder.write("a.glb", maker.glb())).scene;
        } catch (const Error& error) {
            CHECK(error.kind() == ErrorKind::Scene);
            return error.what();
        }
    };
    const auto emissive = [&](double factor) {
        return refusal([&](GltfMaker& maker) {
            maker.add("materials", {{"emissiveFactor", {0, 0, factor}}});
            maker.root["meshes"][0]["primitives"][0]["material"] = 0;
        });
    };
    CHECK_THAT(emissive(3.4e38), Contains("/materials/0/emissiveFactor: it is too large"));
    CHECK_THAT(emissive(50), Contains("emission: {radiance: {rgb: [0, 0, 1], space: linear, scale: 50}}"));
    const auto lamp = [&](double intensity) {
        return refusal([&](GltfMaker& maker) {
            maker.root["extensions"]["KHR_lights_punctual"]["lights"] = {
                {{"type", "point"}, {"intensity", intensity}}};
            maker.node({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
        });
    };
    CHECK_THAT(lamp(1e30), Contains("/lights/0: its colour or intensity is negative or too large"));
    CHECK_THAT(lamp(1e3), Contains("luminous_intensity_cd: 1000"));
}

// Fails when candelas and lux are not those of the file, or a light does not go along −z of its node.
TEST_CASE("Punctual lights keep their photometric units, colour and direction", "[gltf][import]") {
    GltfMaker maker = squareFile();
    const double h = std::numbers::sqrt2 / 2;  // A quarter turn about x takes −z to −y... and y to −z.
    maker.root["extensions"]["KHR_lights_punctual"]["lights"] = {
        {{"type", "point"}, {"intensity", 100}, {"color", {1, 0.5, 0.25}}},
        {{"type", "spot"}, {"intensity", 50}, {"spot", {{"innerConeAngle", 0.2}, {"outerConeAngle", 0.5}}}},
        {{"type", "directional"}, {"intensity", 3}}};
    for (int i = 0; i < 3; ++i)
        maker.node({{"translation", {1, 2, 3}},
                    {"rotation", {-h, 0, 0, h}},
                    {"extensions", {{"KHR_lights_punctual", {{"light", i}}}}}});
    const Scene scene = importOf(maker).scene;
    REQUIRE(scene.point_lights.size() == 3);
    const auto amount = [&](std::size_t i) {
        return scene.point_lights[i].strength * photometric(scene.point_lights[i].spectrum);
    };
    CHECK(amount(0) == Approx(100 * (0.2126 + 0.5 * 0.7152 + 0.25 * 0.0722)).epsilon(1e-3));
    CHECK(amount(1) == Approx(50));
    CHECK(amount(2) == Approx(3));
    CHECK(scene.point_lights[0].position == Vec3d{1, 2, 3});
    for (std::size_t i : {1u, 2u}) {
        CHECK(scene.point_lights[i].direction[1] == Approx(-1));
        CHECK(scene.point_lights[i].direction[2] == Approx(0).margin(1e-12));
    }
    CHECK(scene.point_lights[1].cone_angle_deg == Approx(0.5 * 180 / std::numbers::pi));
    CHECK(scene.point_lights[1].penumbra_deg == Approx(0.3 * 180 / std::numbers::pi));
    CHECK_FALSE(scene.environment);
}

// Fails when the angle is taken across the longer side, or the camera looks along +z.
TEST_CASE("A camera of a glTF file is that of the scene", "[gltf][import]") {
    for (const double aspect : {2.0, 0.5}) {
        GltfMaker maker = squareFile();
        maker.add("cameras", {{"type", "perspective"},
                              {"perspective", {{"yfov", 0.8}, {"aspectRatio", aspect}, {"znear", 0.1}}}});
        maker.node({{"camera", 0}, {"translation", {0.5, 0.5, 4}}});
        const Scene scene = importOf(maker).scene;
        CHECK(scene.camera.position == Vec3d{0.5, 0.5, 4});
        CHECK(scene.camera.target[2] < 4);
        CHECK(scene.camera.target[0] == Approx(0.5));
        CHECK(scene.camera.tan_half_height == Approx(std::tan(0.4)));
        CHECK(scene.camera.tan_half_width == Approx(std::tan(0.4) * aspect).epsilon(2e-3));
    }
}

// Fails when a corner of the model lies outside the frame, or the camera is much too far away.
TEST_CASE("A camera that is chosen sees all of the model, and not much else", "[gltf][import]") {
    for (const Vec3d& size : {Vec3d{1, 1, 1}, {100, 1, 1}, {1, 1e-3, 50}, {1e-6, 1e-6, 1e-6}}) {
        GltfMaker maker = squareFile();
        std::vector<float> points;
        for (int corner = 0; corner < 4; ++corner)
            for (std::size_t k = 0; k < 3; ++k)
                points.push_back(static_cast<float>(
                    size[0] * 10 + ((corner == 3 || corner == static_cast<int>(k)) ? size[k] : 0.0)));
        maker.root["meshes"][0]["primitives"][0]["attributes"] = {{"POSITION", maker.points(points)}};
        const Scene scene = importOf(maker).scene;
        const Vec3d view = scene.camera.target - scene.camera.position, ahead = view * (1 / length(view)),
                    side = cross(ahead, scene.camera.up), right = side * (1 / length(side)),
                    up = cross(right, ahead);
        double most = 0;
        for (const Vec3d& p : scene.meshes[0].positions) {
            const Vec3d d = p - scene.camera.position;
            const double depth = dot(d, ahead);
            CHECK(depth > 0);
            most = std::max({most, std::abs(dot(d, right)) / depth / scene.camera.tan_half_width,
                             std::abs(dot(d, up)) / depth / scene.camera.tan_half_height});
        }
        CHECK(most < 1);
        CHECK(most > 0.3);
    }
}

// Fails when something is left out without a word.
TEST_CASE("What is not in the scene as in the file is told once, and written into the scene",
          "[gltf][import]") {
    const Imported result = importOf({{"occlusionTexture", {{"index", 0}}},
                                      {"emissiveFactor", {1, 1, 1}},
                                      {"emissiveTexture", {{"index", 0}, {"texCoord", 2}}},
                                      {"normalTexture", {{"index", 0}, {"texCoord", 1}}}},
                                     [](GltfMaker& m) {
                                         m.texture(rgba(2, 2, kFourTexels));
                                         Json lines = m.root["meshes"][0]["primitives"][0];
                                         lines["mode"] = 1;
                                         m.root["meshes"][0]["primitives"].push_back(lines);
                                         m.root["extensionsUsed"] = {"VENDOR_thing"};
                                         m.root["animations"] = {{{"channels", Json::array()}}};
                                         m.add("skins", {{"joints", {0}}});
                                         m.root["nodes"][0]["skin"] = 0;
                                     });
    for (const char* what : {"ambient occlusion", "a mesh has no TEXCOORD_2", "a mesh has no TEXCOORD_1",
                             "points or lines", "the extension 'VENDOR_thing'", "a skin", "animations"}) {
        CHECK_THAT(result.text, Contains(what));
        CHECK_THAT(result.log, Contains(what));
    }
    CHECK_THAT(result.log, !Contains("cannot"));
}

// Fails when an OBJ's own materials are replaced, or a file without any is refused.
// Fails when bytes that are no UTF-8 get into the text of the scene, which is then refused.
TEST_CASE("Names of an OBJ that are no UTF-8 are no obstacle", "[import]") {
    const TemporaryFolder folder;
    const CapturedLog log;
    folder.write("a.mtl", "newmtl T\xfcr\nKd 1 0 0\n");
    const std::string obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl T\xfcr\nf 1 2 3\n";
    CHECK(loadScene(folder.write("a.obj", obj)).meshes.size() == 1);
    try {
        (void)loadScene(folder.write("\xe6.obj", obj));
        FAIL("nothing was refused");
    } catch (const Error& e) {
        CHECK_THAT(std::string(e.what()), Contains("its name is not UTF-8"));
    }
    CHECK(yamlText("T\xc3\xbcr \xe2\x82\n") == "\"T\xc3\xbcr ___\"");
}

TEST_CASE("An OBJ is imported with its materials, a camera and a sky", "[import]") {
    const TemporaryFolder folder;
    const CapturedLog log;
    const std::string path = folder.write("a b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const Scene bare = loadScene(path);
    REQUIRE(bare.objects.size() == 1);
    CHECK(bare.materials[0].name == "grey");
    CHECK(bare.environment.has_value());
    folder.write("a.mtl", "newmtl red\nKd 1 0 0\n");
    const Scene red =
        loadScene(folder.write("c.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"));
    CHECK(red.materials[0].name == "c.obj:red");
}
