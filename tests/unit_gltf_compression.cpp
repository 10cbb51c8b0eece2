// Compressed meshes of glTF files: what the encoders of meshoptimizer and Draco make of a mesh is read back,
// and what is damaged or wrong is refused with its place.
#include "gltf_file_maker.h"

#include "base/error.h"
#include "base/temporary_folder.h"
#include "catch.h"
#include "scene/gltf/gltf_mesh.h"

#include <draco/compression/expert_encode.h>
#include <draco/mesh/mesh.h>
#include <meshoptimizer.h>

#include <cmath>

using namespace crt;
using namespace crt::test;

namespace {

constexpr std::size_t kSide = 12;

/// A wavy sheet of kSide² vertices, its corners in no order in particular.
struct Sheet {
    std::vector<float> points, normals, uvs;
    std::vector<std::uint32_t> corners;

    Sheet() {
        for (std::size_t i = 0; i < kSide * kSide; ++i) {
            const auto x = static_cast<float>(i % kSide), y = static_cast<float>(i / kSide);
            points.insert(points.end(), {x, y, std::sin(x) * std::cos(y)});
            const float slope = std::cos(x), length = std::sqrt(1 + slope * slope);
            normals.insert(normals.end(), {-slope / length, 0, 1 / length});
            uvs.insert(uvs.end(), {x / kSide, 1 - y / kSide});
        }
        for (std::uint32_t y = 0; y + 1 < kSide; ++y)
            for (std::uint32_t x = 0; x + 1 < kSide; ++x) {
                const std::uint32_t a = y * kSide + x, b = a + 1, c = b + kSide, d = a + kSide;
                corners.insert(corners.end(), {a, b, c, a, c, d});
            }
    }
    std::size_t count() const { return kSide * kSide; }
};

Mesh meshOf(const GltfMaker& maker) {
    const TemporaryFolder folder;
    GltfFile file(folder.write("a.glb", maker.glb()));
    std::uint64_t without_area = 0;
    return readGltfPrimitive(file, {}, without_area);
}

std::string refusalOf(const GltfMaker& maker) {
    try {
        (void)meshOf(maker);
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::Scene);
        return error.what();
    }
    return "accepted";
}

std::string encodedVertices(const std::string& bytes, std::size_t count, std::size_t stride) {
    std::string encoded(meshopt_encodeVertexBufferBound(count, stride), '\0');
    encoded.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(encoded.data()),
                                              encoded.size(), bytes.data(), count, stride));
    return encoded;
}

std::string encodedCorners(const std::vector<std::uint32_t>& corners, std::size_t vertices, bool triangles) {
    std::string encoded(triangles ? meshopt_encodeIndexBufferBound(corners.size(), vertices)
                                  : meshopt_encodeIndexSequenceBound(corners.size(), vertices),
                        '\0');
    auto* const bytes = reinterpret_cast<unsigned char*>(encoded.data());
    encoded.resize(triangles
                       ? meshopt_encodeIndexBuffer(bytes, encoded.size(), corners.data(), corners.size())
                       : meshopt_encodeIndexSequence(bytes, encoded.size(), corners.data(), corners.size()));
    return encoded;
}

/// A buffer view of compressed bytes. Its own buffer is a fallback that is not there.
int compressedView(GltfMaker& maker, const std::string& encoded, std::size_t count, std::size_t stride,
                   const char* mode, const char* filter = "NONE",
                   const char* extension = "EXT_meshopt_compression") {
    const int bytes = maker.view(encoded);
    const Json place = maker.root["bufferViews"][static_cast<std::size_t>(bytes)];
    Json item{{"buffer", 1}, {"byteLength", count * stride}};
    item["extensions"][extension] = {{"buffer", 0},
                                     {"byteOffset", place["byteOffset"]},
                                     {"byteLength", encoded.size()},
                                     {"byteStride", stride},
                                     {"count", count},
                                     {"mode", mode},
                                     {"filter", filter}};
    return maker.add("bufferViews", item);
}

std::string octahedral(const Sheet& sheet) {
    std::vector<float> wide;
    for (std::size_t i = 0; i < sheet.count(); ++i) {
        wide.insert(wide.end(), sheet.normals.begin() + 3 * static_cast<std::ptrdiff_t>(i),
                    sheet.normals.begin() + 3 * static_cast<std::ptrdiff_t>(i) + 3);
        wide.push_back(0);
    }
    std::string filtered(sheet.count() * 8, '\0');
    meshopt_encodeFilterOct(filtered.data(), sheet.count(), 8, 12, wide.data());
    return filtered;
}

std::string exponential(const std::vector<float>& values, std::size_t count) {
    std::string filtered(values.size() * 4, '\0');
    meshopt_encodeFilterExp(filtered.data(), count, values.size() / count * 4, 20, values.data());
    return filtered;
}

GltfMaker meshoptFile(bool triangles, bool filters, const char* extension = "EXT_meshopt_compression") {
    const Sheet sheet;
    GltfMaker maker;
    maker.root["extensionsRequired"] = {extension};
    Json fallback{{"byteLength", 1 << 20}};
    fallback["extensions"][extension] = {{"fallback", true}};
    maker.more_buffers = {fallback};
    const auto vertices = [&](const std::string& bytes, std::size_t stride, const char* filter) {
        return compressedView(maker, encodedVertices(bytes, sheet.count(), stride), sheet.count(), stride,
                              "ATTRIBUTES", filter, extension);
    };
    const int points =
        maker.accessor(vertices(filters ? exponential(sheet.points, sheet.count()) : bytesOf(sheet.points),
                                12, filters ? "EXPONENTIAL" : "NONE"),
                       GltfMaker::kFloat, "VEC3", sheet.count());
    const int normals = filters ? maker.accessor(vertices(octahedral(sheet), 8, "OCTAHEDRAL"),
                                                 GltfMaker::kShort, "VEC3", sheet.count(), true)
                                : maker.accessor(vertices(bytesOf(sheet.normals), 12, "NONE"),
                                                 GltfMaker::kFloat, "VEC3", sheet.count());
    if (filters) {
        const auto view = maker.root["accessors"][static_cast<std::size_t>(normals)]["bufferView"];
        maker.root["bufferViews"][view.get<std::size_t>()]["byteStride"] = 8;
    }
    const int corners = maker.accessor(
        compressedView(maker, encodedCorners(sheet.corners, sheet.count(), triangles), sheet.corners.size(),
                       4, triangles ? "TRIANGLES" : "INDICES", "NONE", extension),
        GltfMaker::kUnsignedInt, "SCALAR", sheet.corners.size());
    maker.node({{"mesh", maker.mesh({{"attributes", {{"POSITION", points}, {"NORMAL", normals}}},
                                     {"indices", corners}})}});
    return maker;
}

void checkSheet(const Mesh& mesh, double accuracy) {
    const Sheet sheet;
    REQUIRE(mesh.positions.size() == sheet.count());
    double worst_point = 0, worst_normal = 0;
    for (std::size_t i = 0; i < sheet.count(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            worst_point = std::max(worst_point, std::abs(mesh.positions[i][k] - sheet.points[3 * i + k]));
            worst_normal = std::max(worst_normal, std::abs(mesh.normals[i][k] - sheet.normals[3 * i + k]));
        }
    CHECK(worst_point <= accuracy * 12);
    CHECK(worst_normal <= accuracy * 100);
}

/// The corners of a mesh, each triangle from its lowest one on: compressors turn triangles.
std::vector<std::array<std::uint32_t, 3>> turned(std::vector<std::array<std::uint32_t, 3>> triangles) {
    for (auto& t : triangles) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    std::sort(triangles.begin(), triangles.end());
    return triangles;
}
std::vector<std::array<std::uint32_t, 3>> trianglesOf(const Sheet& sheet) {
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (std::size_t i = 0; i < sheet.corners.size(); i += 3)
        triangles.push_back({sheet.corners[i], sheet.corners[i + 1], sheet.corners[i + 2]});
    return turned(triangles);
}

std::string dracoBytes(const Sheet& sheet, bool edgebreaker, std::array<int, 3>& ids,
                       bool with_truth_values = false) {
    draco::Mesh mesh;
    mesh.SetNumFaces(sheet.corners.size() / 3);
    mesh.set_num_points(static_cast<std::uint32_t>(sheet.count()));
    for (std::uint32_t i = 0; i < sheet.corners.size() / 3; ++i)
        mesh.SetFace(draco::FaceIndex(i),
                     {draco::PointIndex(sheet.corners[3 * i]), draco::PointIndex(sheet.corners[3 * i + 1]),
                      draco::PointIndex(sheet.corners[3 * i + 2])});
    const auto add = [&](draco::GeometryAttribute::Type type, const std::vector<float>& values) {
        const auto width = static_cast<std::int8_t>(values.size() / sheet.count());
        draco::GeometryAttribute form;
        form.Init(type, nullptr, static_cast<std::uint8_t>(width), draco::DT_FLOAT32, false, width * 4, 0);
        const int id = mesh.AddAttribute(form, true, static_cast<std::uint32_t>(sheet.count()));
        for (std::uint32_t i = 0; i < sheet.count(); ++i)
            mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i),
                                                  &values[i * static_cast<std::size_t>(width)]);
        return id;
    };
    ids = {add(draco::GeometryAttribute::POSITION, sheet.points),
           add(draco::GeometryAttribute::NORMAL, sheet.normals),
           add(draco::GeometryAttribute::TEX_COORD, sheet.uvs)};
    for (int& id : ids) id = static_cast<int>(mesh.attribute(id)->unique_id());
    if (with_truth_values) {  // In the place of texture coordinates.
        draco::GeometryAttribute form;
        form.Init(draco::GeometryAttribute::GENERIC, nullptr, 2, draco::DT_BOOL, false, 2, 0);
        const int id = mesh.AddAttribute(form, true, static_cast<std::uint32_t>(sheet.count()));
        const std::array<bool, 2> both{true, false};
        for (std::uint32_t i = 0; i < sheet.count(); ++i)
            mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i), both.data());
        ids[2] = static_cast<int>(mesh.attribute(id)->unique_id());
    }
    draco::ExpertEncoder encoder(mesh);
    encoder.SetEncodingMethod(edgebreaker ? draco::MESH_EDGEBREAKER_ENCODING
                                          : draco::MESH_SEQUENTIAL_ENCODING);
    draco::EncoderBuffer buffer;
    REQUIRE(encoder.EncodeToBuffer(&buffer).ok());
    return {buffer.data(), buffer.size()};
}

GltfMaker dracoFile(bool edgebreaker, bool with_truth_values = false) {
    const Sheet sheet;
    GltfMaker maker;
    maker.root["extensionsRequired"] = {"KHR_draco_mesh_compression"};
    std::array<int, 3> ids{};
    const int view = maker.view(dracoBytes(sheet, edgebreaker, ids, with_truth_values));
    const auto accessor = [&](int component, const char* type, std::size_t count) {
        return maker.add("accessors", {{"componentType", component}, {"type", type}, {"count", count}});
    };
    const int points = accessor(GltfMaker::kFloat, "VEC3", sheet.count()),
              normals = accessor(GltfMaker::kFloat, "VEC3", sheet.count()),
              uvs = accessor(GltfMaker::kFloat, "VEC2", sheet.count()),
              corners = accessor(GltfMaker::kUnsignedShort, "SCALAR", sheet.corners.size());
    Json primitive{{"attributes", {{"POSITION", points}, {"NORMAL", normals}, {"TEXCOORD_0", uvs}}},
                   {"indices", corners}};
    primitive["extensions"]["KHR_draco_mesh_compression"] = {
        {"bufferView", view},
        {"attributes", {{"POSITION", ids[0]}, {"NORMAL", ids[1]}, {"TEXCOORD_0", ids[2]}}}};
    maker.node({{"mesh", maker.mesh(primitive)}});
    return maker;
}

Json& meshopt(GltfMaker& maker, std::size_t view) {
    return maker.root["bufferViews"][view]["extensions"]["EXT_meshopt_compression"];
}

}  // namespace

// Fails when a mode or a filter is taken for a different one, or the bytes of the fallback buffer are read.
TEST_CASE("buffer views that meshopt compressed hold what they held", "[gltf]") {
    const Sheet sheet;
    for (const bool triangles : {false, true})
        for (const bool filters : {false, true}) {
            INFO((triangles ? "triangles" : "indices") << (filters ? " with filters" : ""));
            const Mesh mesh = meshOf(meshoptFile(triangles, filters));
            checkSheet(mesh, filters ? 1e-5 : 0);
            CHECK(turned(mesh.triangles) == trianglesOf(sheet));
        }
    checkSheet(meshOf(meshoptFile(true, false, "KHR_meshopt_compression")), 0);
}

// Fails when attributes are exchanged, or points are taken in the order in which Draco stores values.
TEST_CASE("meshes that Draco compressed are what they were", "[gltf]") {
    const Sheet sheet;
    for (const bool edgebreaker : {false, true}) {
        INFO((edgebreaker ? "edgebreaker" : "sequential"));
        const Mesh mesh = meshOf(dracoFile(edgebreaker));
        REQUIRE(mesh.triangles.size() == sheet.corners.size() / 3);
        // Draco may renumber the points. x and y of a point give its old number.
        for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
            const Vec3d& p = mesh.positions[i];
            const auto was = static_cast<std::size_t>(p[0] + p[1] * kSide);
            REQUIRE(was < sheet.count());
            for (std::size_t k = 0; k < 3; ++k) {
                CHECK(p[k] == sheet.points[3 * was + k]);
                CHECK(mesh.normals[i][k] == sheet.normals[3 * was + k]);
            }
            CHECK(mesh.uvs[i][0] == sheet.uvs[2 * was]);
            CHECK(mesh.uvs[i][1] == 1 - sheet.uvs[2 * was + 1]);
        }
        double area = 0;
        for (const auto& t : mesh.triangles) {
            const Vec3d n = cross(mesh.positions[t[1]] - mesh.positions[t[0]],
                                  mesh.positions[t[2]] - mesh.positions[t[0]]);
            CHECK(n[2] > 0);
            area += n[2] / 2;
        }
        CHECK(area == Approx((kSide - 1.0) * (kSide - 1.0)));
    }
}

TEST_CASE("compressed meshes that are damaged or wrong are refused with their place", "[gltf]") {
    // View 1 of the file is that of positions: view 0 has its bytes.
    const auto refused = [](const std::function<void(Json&)>& change) {
        GltfMaker maker = meshoptFile(true, false);
        change(meshopt(maker, 1));
        return refusalOf(maker);
    };
    const std::string at = "/bufferViews/1";
    CHECK_THAT(refused([](Json& m) { m["mode"] = "SOMETHING"; }), Contains(at) && Contains("ATTRIBUTES"));
    CHECK_THAT(refused([](Json& m) { m.erase("mode"); }), Contains(at) && Contains("mode"));
    CHECK_THAT(refused([](Json& m) { m["filter"] = 7; }), Contains(at) && Contains("OCTAHEDRAL"));
    CHECK_THAT(refused([](Json& m) { m["filter"] = "QUATERNION"; }), Contains("quaternion filter needs 8"));
    CHECK_THAT(refused([](Json& m) { m["byteStride"] = 6; }), Contains("multiple of 4"));
    CHECK_THAT(refused([](Json& m) { m["byteStride"] = 0; }), Contains("multiple of 4"));
    CHECK_THAT(refused([](Json& m) { m["count"] = 4294967295u; }), Contains("are not the bytes"));
    CHECK_THAT(refused([](Json& m) { m["byteOffset"] = 1u << 30; }), Contains("are beyond buffer 0"));
    CHECK_THAT(refused([](Json& m) { m["byteLength"] = 9; }), Contains("cannot decompress"));
    CHECK_THAT(refused([](Json& m) { m["buffer"] = 9; }), Contains("there is no buffer 9"));
    CHECK_THAT(refused([](Json& m) { m = 5; }), Contains(at) && Contains("an object"));

    const auto refusedDraco = [](const std::function<void(GltfMaker&, Json&)>& change) {
        GltfMaker maker = dracoFile(true);
        change(maker, maker.root["meshes"][0]["primitives"][0]);
        return refusalOf(maker);
    };
    const char* const name = "KHR_draco_mesh_compression";
    CHECK_THAT(refusedDraco([](GltfMaker& m, Json&) { m.binary[20] = '\x7f', m.binary[0] = 'X'; }),
               Contains("/meshes/0/primitives/0") && Contains("Draco cannot decode it"));
    CHECK_THAT(refusedDraco([](GltfMaker&, Json& p) { p["mode"] = 5; }), Contains("/mode"));
    CHECK_THAT(refusedDraco([&](GltfMaker&, Json& p) { p["extensions"][name]["bufferView"] = 7; }),
               Contains("there is no buffer view 7"));
    CHECK_THAT(refusedDraco([&](GltfMaker&, Json& p) { p["extensions"][name].erase("attributes"); }),
               Contains("'attributes' is missing"));
    CHECK_THAT(
        refusedDraco([&](GltfMaker&, Json& p) { p["extensions"][name]["attributes"]["NORMAL"] = 99; }),
        Contains("/accessors/1") && Contains("no NORMAL"));
    CHECK_THAT(refusalOf(dracoFile(false, true)), Contains("/accessors/2") && Contains("no TEXCOORD_0"));
    CHECK_THAT(refusedDraco([](GltfMaker& m, Json&) { m.root["accessors"][0]["count"] = 9; }),
               Contains("/accessors/0/count"));
    CHECK_THAT(refusedDraco([](GltfMaker& m, Json&) { m.root["accessors"][3]["componentType"] = 5121; }),
               Contains("accepted") || Contains("/accessors/3"));
    CHECK_THAT(refusedDraco([](GltfMaker&, Json& p) { p.erase("indices"); }),
               Contains("'indices' is missing"));
}
