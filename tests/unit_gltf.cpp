// glTF files: what the reader makes of each kind of accessor and primitive, and what it refuses and where.
#include "gltf_file_maker.h"

#include "base/error.h"
#include "base/temporary_folder.h"
#include "base/vec3d.h"
#include "captured_log.h"
#include "scene/gltf/gltf_mesh.h"
#include "scene/yaml/scene_yaml.h"

#include <fmt/format.h>

#include <functional>
#include <numeric>

using namespace crt;
using namespace crt::test;

namespace {

Mesh meshOf(const std::string& content, const GltfPrimitive& which = {}, bool text = false) {
    const TemporaryFolder folder;
    GltfFile file(folder.write(text ? "a.gltf" : "a.glb", content));
    std::uint64_t without_area = 0;
    return readGltfPrimitive(file, which, without_area);
}

Vec3d areaOf(const Mesh& mesh) {
    Vec3d sum{};
    for (const auto& t : mesh.triangles)
        sum = sum + cross(mesh.positions[t[1]] - mesh.positions[t[0]],
                          mesh.positions[t[2]] - mesh.positions[t[0]]) *
                        0.5;
    return sum;
}

/// The sentence of the crt::Error(Scene) that reading a scene of the file ends with.
std::string refusalOf(const std::string& content, const char* name = "a.glb") {
    const TemporaryFolder folder;
    const CapturedLog log;
    try {
        (void)loadScene(folder.write(name, content));
    } catch (const Error& e) {
        CHECK(e.kind() == ErrorKind::Scene);
        return e.what();
    }
    return "it is read";
}

std::string refusalOf(const std::function<void(GltfMaker&)>& change) {
    GltfMaker maker = squareFile();
    change(maker);
    return refusalOf(maker.glb());
}

Json& primitiveOf(GltfMaker& maker) { return maker.root["meshes"][0]["primitives"][0]; }

}  // namespace

// Fails when v is not turned up, normals are lost, or a GLB's bytes are taken from the wrong chunk.
TEST_CASE("A primitive of a GLB has positions, normals and texture coordinates with v up", "[gltf]") {
    const Mesh mesh = meshOf(squareFile().glb());
    REQUIRE(mesh.positions.size() == 4);
    CHECK(mesh.positions[2] == Vec3d{1, 1, 0});
    CHECK(mesh.normals[3] == Vec3d{0, 0, 1});
    CHECK(mesh.uvs[0] == std::array<double, 2>{0, 0});
    CHECK(mesh.uvs[2] == std::array<double, 2>{1, 1});
    CHECK(areaOf(mesh) == Vec3d{0, 0, 1});
    CHECK(meshOf(squareFile().gltf(), {}, true).positions == mesh.positions);
}

// Fails when a width is read wrongly, or a strip's odd triangles face the other way.
TEST_CASE("Indices of every type, strips and fans, and none at all are the same square", "[gltf]") {
    const auto withIndices = [](const std::string& bytes, int type, std::size_t count, int mode) {
        GltfMaker maker = squareFile();
        primitiveOf(maker)["indices"] = maker.accessor(maker.view(bytes), type, "SCALAR", count);
        primitiveOf(maker)["mode"] = mode;
        return areaOf(meshOf(maker.glb()));
    };
    const Vec3d whole{0, 0, 1};
    const std::vector<std::uint8_t> bytes{0, 1, 2, 0, 2, 3}, strip{0, 1, 3, 2}, fan{0, 1, 2, 3};
    CHECK(withIndices(bytesOf(bytes), GltfMaker::kUnsignedByte, 6, 4) == whole);
    CHECK(withIndices(bytesOf(std::vector<std::uint16_t>(bytes.begin(), bytes.end())),
                      GltfMaker::kUnsignedShort, 6, 4) == whole);
    CHECK(withIndices(bytesOf(std::vector<std::uint32_t>(bytes.begin(), bytes.end())),
                      GltfMaker::kUnsignedInt, 6, 4) == whole);
    CHECK(withIndices(bytesOf(strip), GltfMaker::kUnsignedByte, 4, 5) == whole);
    CHECK(withIndices(bytesOf(fan), GltfMaker::kUnsignedByte, 4, 6) == whole);
    GltfMaker maker = squareFile();
    primitiveOf(maker).erase("indices");
    primitiveOf(maker)["mode"] = 6;
    CHECK(areaOf(meshOf(maker.glb())) == whole);
}

// Fails when codes are not divided by their largest, or strides and offsets are left out.
TEST_CASE("Quantized accessors are decoded, with strides and offsets", "[gltf]") {
    GltfMaker maker = squareFile();
    // Each position has a fourth number, which is not its own, and the accessor begins behind one element.
    const std::vector<std::int16_t> codes{9, 9, 9,     9,     0, 0, 0,      9,     32767, 0,
                                          0, 9, 32767, 32767, 0, 9, -32768, 32767, 0,     9};
    const int position = maker.accessor(maker.view(bytesOf(codes), 8), GltfMaker::kShort, "VEC3", 4, true);
    maker.root["accessors"][static_cast<std::size_t>(position)]["byteOffset"] = 8;
    primitiveOf(maker)["attributes"]["POSITION"] = position;
    const std::vector<std::uint8_t> colors{255, 0, 51,  255, 0,   255, 0,   255,
                                           0,   0, 255, 255, 255, 255, 255, 255};
    primitiveOf(maker)["attributes"]["COLOR_0"] =
        maker.accessor(maker.view(bytesOf(colors)), GltfMaker::kUnsignedByte, "VEC4", 4, true);
    const Mesh mesh = meshOf(maker.glb(), {.color_factor = {0.5, 1, 1}});
    CHECK(mesh.positions[1] == Vec3d{1, 0, 0});
    CHECK(mesh.positions[3] == Vec3d{-1, 1, 0});
    CHECK(mesh.colors[0] == std::array<float, 3>{0.5f, 0, 0.2f});
}

// Fails when the changes of a sparse accessor are not applied, or are applied to the wrong elements.
TEST_CASE("A sparse accessor changes some elements of another, or of zeros", "[gltf]") {
    GltfMaker maker = squareFile();
    const Json sparse{
        {"count", 2},
        {"indices",
         {{"bufferView", maker.view(bytesOf(std::vector<std::uint16_t>{1, 3}))},
          {"componentType", GltfMaker::kUnsignedShort}}},
        {"values", {{"bufferView", maker.view(bytesOf(std::vector<float>{5, 0, 0, 0, 7, 0}))}}}};
    const std::size_t position = primitiveOf(maker)["attributes"]["POSITION"].get<std::size_t>();
    maker.root["accessors"][position]["sparse"] = sparse;
    const Mesh changed = meshOf(maker.glb());
    CHECK(changed.positions == std::vector<Vec3d>{{0, 0, 0}, {5, 0, 0}, {1, 1, 0}, {0, 7, 0}});
    maker.root["accessors"][position].erase("bufferView");
    CHECK(meshOf(maker.glb()).positions == std::vector<Vec3d>{{0, 0, 0}, {5, 0, 0}, {0, 0, 0}, {0, 7, 0}});
}

// Fails when a check is missing: then it is read, or ends elsewhere.
TEST_CASE("What is wrong in a glTF file is told with a JSON pointer", "[gltf]") {
    const auto pointsTo = [](const std::string& pointer, const std::function<void(GltfMaker&)>& change) {
        INFO(pointer);
        CHECK_THAT(refusalOf(change), Contains("a.glb: " + pointer + ":"));
    };
    const auto set = [](const char* pointer, const Json& value) {
        return [=](GltfMaker& m) { m.root[Json::json_pointer(pointer)] = value; };
    };
    pointsTo("/nodes/0/mesh", set("/nodes/0/mesh", 7));
    pointsTo("/nodes/0/mesh", set("/nodes/0/mesh", "seven"));
    pointsTo("/nodes/0/matrix", set("/nodes/0/matrix", {1, 2, 3}));
    pointsTo("/nodes/0/children/0", set("/nodes/0/children", {5}));
    pointsTo("/scene", set("/scene", 3));
    pointsTo("/scenes/0/nodes/1", [](GltfMaker& m) { m.root["scenes"][0]["nodes"].push_back(-1); });
    pointsTo("/meshes/0/primitives/0/indices", [](GltfMaker& m) { primitiveOf(m)["indices"] = 99; });
    pointsTo("/meshes/0/primitives/0/attributes/POSITION",
             [](GltfMaker& m) { primitiveOf(m)["attributes"]["POSITION"] = 99; });
    pointsTo("/meshes/0/primitives/0/mode", [](GltfMaker& m) { primitiveOf(m)["mode"] = 9; });
    pointsTo("/meshes/0/weights", [](GltfMaker& m) {
        primitiveOf(m)["targets"] = {{{"POSITION", 0}}};
        m.root["meshes"][0]["weights"] = {0, 0.5};
    });
    pointsTo("/nodes/0/weights", [](GltfMaker& m) {
        primitiveOf(m)["targets"] = {{{"POSITION", 0}}};
        m.root["nodes"][0]["weights"] = {-1};
    });
    pointsTo("/meshes/0/weights", set("/meshes/0/weights", 1));
    pointsTo("/asset/version", set("/asset/version", ""));
    pointsTo("/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression", [](GltfMaker& m) {
        primitiveOf(m)["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", 0}};
    });
    pointsTo("/extensionsRequired/0", set("/extensionsRequired", {"KHR_texture_basisu"}));
    pointsTo("/extensionsRequired/0", set("/extensionsRequired", {"VENDOR_something"}));
    pointsTo("/accessors/0/bufferView", set("/accessors/0/bufferView", 99));
    pointsTo("/accessors/0", set("/accessors/0/count", 5));
    pointsTo("/accessors/0", set("/accessors/0/count", 4294967290u));
    pointsTo("/accessors/0/count", set("/accessors/0/count", 0));
    pointsTo("/accessors/0", set("/accessors/0/byteOffset", 4));
    pointsTo("/accessors/0", set("/accessors/0/byteOffset", 18446744073709551615u));
    pointsTo("/accessors/0/type", set("/accessors/0/type", "VEC9"));
    pointsTo("/accessors/0/componentType", set("/accessors/0/componentType", 5124));
    pointsTo("/accessors/0", set("/bufferViews/0/byteStride", 4));
    pointsTo("/accessors/0", set("/bufferViews/0/byteStride", 252));
    pointsTo("/bufferViews/0/byteStride", set("/bufferViews/0/byteStride", 256));
    pointsTo("/bufferViews/0/byteStride", set("/bufferViews/0/byteStride", 14));
    pointsTo("/bufferViews/0", set("/bufferViews/0/byteLength", 100000));
    pointsTo("/bufferViews/0", set("/bufferViews/0/byteOffset", 18446744073709551600u));
    pointsTo("/bufferViews/0/buffer", set("/bufferViews/0/buffer", 1));
    pointsTo("/meshes/0/primitives/0/attributes/NORMAL", [](GltfMaker& m) {
        primitiveOf(m)["attributes"]["NORMAL"] = m.points({0, 0, 1});
    });
    pointsTo("/meshes/0/primitives/0/attributes/POSITION", [](GltfMaker& m) {
        primitiveOf(m)["attributes"]["POSITION"] = m.points({0, 0, 0, 1, NAN, 0, 1, 1, 0, 0, 1, 0});
    });
    pointsTo("/meshes/0/primitives/0/attributes/TEXCOORD_0", [](GltfMaker& m) {
        primitiveOf(m)["attributes"]["TEXCOORD_0"] = m.floats("VEC2", 2, {0, 0, 1, INFINITY, 0, 0, 0, 0});
    });
    pointsTo("/meshes/0/primitives/0/indices", [](GltfMaker& m) {
        primitiveOf(m)["indices"] = m.accessor(m.view(bytesOf(std::vector<std::uint16_t>{0, 1, 4})),
                                               GltfMaker::kUnsignedShort, "SCALAR", 3);
    });
    pointsTo("/meshes/0/primitives/0/indices", [](GltfMaker& m) {
        primitiveOf(m)["indices"] =
            m.accessor(m.view(bytesOf(std::vector<float>{0, 1, 2})), GltfMaker::kFloat, "SCALAR", 3);
    });
    pointsTo("/materials/0/pbrMetallicRoughness/baseColorTexture", [](GltfMaker& m) {
        m.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 3}}}}}});
        primitiveOf(m)["material"] = 0;
    });
    pointsTo("/nodes/0/extensions/KHR_lights_punctual/light",
             [](GltfMaker& m) { m.root["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 2; });
    pointsTo("/accessors/0/sparse/indices", [](GltfMaker& m) {
        const int few = m.view(bytesOf(std::vector<std::uint16_t>{9, 9}));
        m.root["accessors"][0]["sparse"] = {
            {"count", 1},
            {"indices", {{"bufferView", few}, {"componentType", GltfMaker::kUnsignedShort}}},
            {"values", {{"bufferView", 0}}}};
    });
}

// Fails when a file is refused for what it does not use.
TEST_CASE("Morph targets whose weights are 0 change nothing", "[gltf]") {
    GltfMaker maker = squareFile();
    const TemporaryFolder folder;
    const CapturedLog log;
    const std::size_t size = loadScene(folder.write("a.glb", maker.glb())).meshes.at(0).positions.size();
    primitiveOf(maker)["targets"] = {{{"POSITION", 0}}, {{"POSITION", 99}}};
    maker.root["meshes"][0]["weights"] = {0, 0.0};
    CHECK(loadScene(folder.write("b.glb", maker.glb())).meshes.at(0).positions.size() == size);
    CHECK(log.warnings() == 0);
}

// Fails when nodes are followed without asking whether they were met: it does not end.
TEST_CASE("Nodes in a circle, and those with two parents, are refused", "[gltf]") {
    CHECK_THAT(refusalOf([](GltfMaker& m) { m.root["nodes"][0]["children"] = {0}; }),
               Contains("/nodes/0: this node is its own ancestor"));
    CHECK_THAT(refusalOf([](GltfMaker& m) {
                   m.add("nodes", {{"mesh", 0}});
                   m.root["nodes"][0]["children"] = {1, 1};
               }),
               Contains("/nodes/1: this node is its own ancestor, or has two parents"));
}

// Fails, by a stack overflow, when nodes or JSON are followed by recursion.
TEST_CASE("A hundred thousand nodes below one another are read, and deep JSON is refused", "[gltf]") {
    GltfMaker maker = squareFile();
    Json nodes = Json::array();
    constexpr int kNodes = 100000;
    for (int i = 0; i < kNodes; ++i) nodes.push_back({{"children", {i + 1}}});
    nodes.push_back({{"mesh", 0}, {"translation", {1, 2, 3}}});
    maker.root["nodes"] = nodes;
    const TemporaryFolder folder;
    const CapturedLog log;
    const Scene scene = loadScene(folder.write("a.glb", maker.glb()));
    REQUIRE(scene.objects.size() == 1);
    CHECK(scene.objects[0].transforms[0] == Matrix4d{1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1});
    const std::string deep = "{\"asset\": {\"version\": \"2.0\", \"extras\": " + std::string(100000, '[') +
                             std::string(100000, ']') + "}}";
    CHECK_THAT(refusalOf(deep, "a.gltf"), Contains("nested more than 64 deep"));
}

// Fails when a container is read beyond its end, or what is no glTF is taken for one.
TEST_CASE("Damaged containers are refused", "[gltf]") {
    const std::string good = squareFile().glb();
    for (std::size_t size = 0; size < good.size(); size += size < 60 ? 1 : 37) {
        INFO(size);
        CHECK_THAT(refusalOf(good.substr(0, size)), Contains("a.glb"));
    }
    std::string other = good;
    other[4] = 1;
    CHECK_THAT(refusalOf(other), Contains("GLB of version 1"));
    CHECK_THAT(refusalOf("", "a.gltf"), Contains("this file is empty"));
    CHECK_THAT(refusalOf("{}", "a.gltf"), Contains("'asset' is missing"));
    CHECK_THAT(refusalOf("{\"asset\": {\"version\": \"1.0\"}}", "a.gltf"), Contains("this is glTF 1.0"));
    CHECK_THAT(refusalOf("{\"asset\": {\"version\": \"2.0\"}}", "a.gltf"), Contains("nothing is visible"));
    CHECK_THAT(refusalOf("solid cube", "a.gltf"), Contains("its JSON cannot be read"));
    CHECK_THAT(refusalOf("{\"asset\": {\"version\": \"2.0\"}, \"x\": 1e999}", "a.gltf"),
               Contains("its JSON cannot be read"));
}

// Fails when a name is joined to the folder without a look at what it is.
TEST_CASE("Buffers outside the folder of a glTF file are refused unless they are allowed", "[gltf]") {
    GltfMaker maker = squareFile();
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder / "model");
    folder.write("outside.bin", maker.binary);
    folder.write("model/inside one.bin", maker.binary);
    const auto sceneOf = [&](const std::string& uri, bool allow) {
        Json json = maker.root;
        json["buffers"] = {{{"byteLength", maker.binary.size()}, {"uri", uri}}};
        folder.write("model/a.gltf", json.dump());
        return parseScene(
            fmt::format("crt: 1\nmaterials: {{a: {{type: diffuse, reflectance: 1}}}}\nobjects:\n"
                        "  - {{gltf: {{file: a.gltf, mesh: 0, allow_outside: {}}}, material: a}}\n",
                        allow),
            "scene", folder / "model");
    };
    CHECK(sceneOf("inside%20one.bin", false).objects.size() == 1);
    CHECK(sceneOf("../outside.bin", true).objects.size() == 1);
    CHECK_THROWS_WITH(sceneOf("../outside.bin", false), Contains("/buffers/0/uri: '../outside.bin' lies "
                                                                 "outside the folder"));
    CHECK_THROWS_WITH(sceneOf("%2e%2e/outside.bin", false), Contains("outside the folder"));
    CHECK_THROWS_WITH(sceneOf("..\\outside.bin", false), Contains("outside the folder"));
    CHECK_THROWS_WITH(sceneOf(folder / "outside.bin", false), Contains("outside the folder"));
    std::filesystem::create_symlink(folder / "outside.bin", folder / "model/link.bin");
    CHECK_THROWS_WITH(sceneOf("link.bin", false), Contains("outside the folder"));
    CHECK_THROWS_WITH(sceneOf("https://example.org/a.bin", true), Contains("crt does not load 'https:'"));
    CHECK_THROWS_WITH(sceneOf("file:///etc/passwd", true), Contains("crt does not load 'file:'"));
    CHECK_THROWS_WITH(sceneOf("data:;base64,A!", true), Contains("not base64"));
    CHECK_THROWS_WITH(sceneOf("none.bin", false), Contains("/buffers/0/uri"));
}
