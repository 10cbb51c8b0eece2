// STL: the same mesh in both forms, what it becomes, what is left out, and that every refusal names the
// place.
#include "base/error.h"
#include "base/temporary_folder.h"
#include "captured_log.h"
#include "catch.h"
#include "refused_file.h"
#include "scene/import/import.h"
#include "scene/mesh/stl_reader.h"
#include "scene_texts.h"

#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

using namespace crt;
using crt::test::CapturedLog;

namespace {

using Facets = std::vector<std::array<float, 9>>;

/// Two triangles of a square.
const Facets kSquare{{0, 0, 0, 1, 0, 0, 1, 1, 0}, {0, 0, 0, 1, 1, 0, 0, 1, 0}};

std::string binary(const Facets& facets, std::uint32_t count, const std::string& header = "made by a test") {
    std::string content = header;
    content.resize(80, ' ');
    const auto append = [&](const void* data, std::size_t size) {
        content.append(static_cast<const char*>(data), size);
    };
    append(&count, sizeof count);
    for (const std::array<float, 9>& facet : facets) {
        content.append(12, '\0');
        append(facet.data(), sizeof facet);
        content.append(2, '\0');
    }
    return content;
}
std::string binary(const Facets& facets) {
    return binary(facets, static_cast<std::uint32_t>(facets.size()));
}

std::string ascii(const Facets& facets, const std::string& end = "\n") {
    std::string content = "solid a square" + end;
    for (const std::array<float, 9>& f : facets) {
        content += "  facet normal 0 0 1" + end + "    outer loop" + end;
        for (std::size_t k = 0; k < 3; ++k)
            content += fmt::format("      vertex {} {:e} +{}", f[3 * k], f[3 * k + 1], f[3 * k + 2]) + end;
        content += "    endloop" + end + "  endfacet" + end;
    }
    return content + "endsolid a square" + end;
}

void checkStlRefused(const std::string& content, int line, const std::string& words) {
    crt::test::checkRefusedFile("mesh.stl", content, line, words,
                                [](const std::string& path) { loadStl(path); });
}

}  // namespace

// Fails when corners are read in another order, or one place becomes several vertices.
TEST_CASE("an STL is the same mesh in both of its forms", "[stl]") {
    for (const std::string& content : {binary(kSquare), ascii(kSquare), ascii(kSquare, "\r\n"),
                                       binary(kSquare, 2, "solid, as some programs begin a binary file")}) {
        const Mesh mesh = readStl(content, "a.stl").mesh;
        CHECK(mesh.positions == std::vector<Vec3d>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
        CHECK(mesh.triangles == std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}});
        CHECK(mesh.normals.empty());
    }
    // Two parts in one file, and a zero with either sign.
    CHECK(
        readStl(ascii(kSquare) + ascii({{-0.0f, 0, 0, 0, 0, 5, 1, 0, 0}}), "a.stl").mesh.positions.size() ==
        5);
}

TEST_CASE("triangles of an STL that cannot be are left out with a warning", "[stl]") {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    Facets facets = kSquare;
    facets.push_back({0, 0, nan, 1, 0, 0, 1, 1, 0});
    facets.push_back({0, 0, 0, 1, 0, 0, 2, 0, 0});
    const CapturedLog log;
    CHECK(readStl(binary(facets), "a.stl").mesh.triangles.size() == 2);
    CHECK_THAT(log.text(), Contains("a.stl: 1 triangle left out: their vertices are not finite") &&
                               Contains("a.stl: 1 triangle without area left out"));
}

TEST_CASE("damaged STL files are refused at their place", "[stl]") {
    checkStlRefused("", 0, "is not an STL file");
    checkStlRefused("\x89PNG\r\n", 0, "begins neither with 'solid' nor");
    checkStlRefused(binary(kSquare, 3), 0, "with the 3 triangles that it says 234 would be");
    checkStlRefused(binary(kSquare, 4294967295u), 0, "4294967295 triangles");
    checkStlRefused(binary(kSquare).substr(0, 150), 0, "it has 150 bytes");
    checkStlRefused(binary({}), 0, "has no triangles");
    checkStlRefused("solid empty\nendsolid\n", 0, "has no triangles");
    checkStlRefused("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0\nvertex 1 0 0\n", 5, "'a number'");
    checkStlRefused("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n", 6,
                    "the file ends");
    checkStlRefused("solid a\nmesh\n", 2, "'facet' should follow here, found 'mesh'");
    const float nan = std::numeric_limits<float>::quiet_NaN();
    checkStlRefused(binary({{nan, 0, 0, 1, 0, 0, 1, 1, 0}}), 0, "no triangle has finite vertices");
    CHECK_THROWS_AS(loadStl("no_such_file.stl"), Error);
}

// Fails when the key, the import or the smoothing of edges is missing.
TEST_CASE("an STL is an object of a scene, and imported as one", "[stl][import]") {
    const TemporaryFolder folder;
    const std::string path = folder.write("part.stl", binary(kSquare));
    const Scene scene =
        crt::test::parse("materials: {m: {type: mirror, reflectance: 1}}\nobjects: [{stl: " + path +
                         ", material: m, normals: smooth}]\n");
    REQUIRE(scene.meshes.size() == 1);
    CHECK(scene.meshes[0].triangles.size() == 2);
    CHECK(scene.meshes[0].normals.size() > 0);
    CHECK_THAT(crt::test::refused("materials: {m: {type: mirror, reflectance: 1}}\nobjects: [{stl: " + path +
                                  ", material: m, vertex_colors: srgb}]\n"),
               Contains("this key needs colours from a PLY"));
    CHECK_THAT(crt::test::refused("objects: [{stl: " + path + "}]\n"), Contains("'material' is missing"));
    GltfFiles files;
    const crt::test::Quiet quiet;
    CHECK_THAT(importModel(files, path).scene,
               Contains("stl: part.stl") && Contains("normals: smooth") && Contains("crease_angle_deg: 30"));
}
