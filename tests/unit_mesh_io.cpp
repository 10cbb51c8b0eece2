// OBJ: what is accepted, what it becomes, what is left out, and that every refusal names the line.
#include "base/error.h"
#include "base/temporary_folder.h"
#include "captured_log.h"
#include "catch.h"
#include "refused_file.h"
#include "scene/mesh/mesh_io.h"

#include <cmath>
#include <filesystem>

using namespace crt;
using crt::TemporaryFolder;
using crt::test::CapturedLog;

namespace {

LoadedMesh loadText(const std::string& text) {
    const TemporaryFolder folder;
    return loadObj(folder.write("mesh.obj", text));
}

void checkRefused(const std::string& text, int line, const char* words) {
    crt::test::checkRefusedFile("mesh.obj", text, line, words,
                                [](const std::string& path) { loadObj(path); });
}

double area(const Mesh& mesh) {
    double sum = 0;
    for (const auto& t : mesh.triangles) {
        const Vec3d &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
        const Vec3d u{b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
        sum +=
            std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]) / 2;
    }
    return sum;
}

const std::string kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

}  // namespace

TEST_CASE("a triangle", "[mesh_io]") {
    const LoadedMesh m = loadText(kTriangle + "f 1 2 3\n");
    CHECK(m.mesh.positions == std::vector<Vec3d>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    CHECK(m.mesh.triangles == std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}});
    CHECK(m.mesh.normals.empty());
    CHECK(m.mesh.normal_index.empty());
    CHECK(m.mesh.material.empty());
    CHECK(m.files.size() == 1);
    CHECK(m.degenerate_faces == 0);
}

TEST_CASE("the same mesh in every spelling", "[mesh_io]") {
    const Mesh expected = loadText(kTriangle + "f 1 2 3\n").mesh;
    for (const char* text : {
             "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n",                         // Windows
             "v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r",                                 // before that
             "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3",                                   // no newline at the end
             "\xEF\xBB\xBFv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",                     // byte-order mark
             "# c\n\n  v  0\t0 0 \nv 1 0 0 1.0\nv +0 1e0 0 .5 .5 .5\nf  1 2  3 \n",  // blanks, weights,
                                                                                     // colours
             "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n",                   // texture coordinates
             "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/ 2/ 3/\n",                              // without numbers
             "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//1 2//1 3//1\n",                        // nor the normal
             "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n",                              // counted from the end
             "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n",                                 // faces first
             "v 0 0 0\nv 1 0 \\\n0\nv 0 1 0\nf 1 \\\r\n 2 3\n",                      // joined lines
             "o thing\ng a b\ns off\nv 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\np 1\nf 1 2 3 # done\n",
             "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3\n",  // one corner without normal: flat
         }) {
        CAPTURE(text);
        const Mesh mesh = loadText(text).mesh;
        CHECK(mesh.positions == expected.positions);
        CHECK(mesh.triangles == expected.triangles);
        CHECK(mesh.normal_index.empty());
    }
    // UTF-16 of either order, as some editors of Windows save it.
    const std::string ascii = kTriangle + "f 1 2 3\n";
    std::string little = "\xFF\xFE", big = "\xFE\xFF";
    for (const char c : ascii) little += {c, '\0'}, big += {'\0', c};
    CHECK(loadText(little).mesh.triangles == expected.triangles);
    CHECK(loadText(big).mesh.triangles == expected.triangles);
    // Negative indices count from where the face stands, not from the end of the file.
    const Mesh two = loadText(kTriangle + "f -3 -2 -1\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf -3 -2 -1\n").mesh;
    CHECK(two.triangles == std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {3, 4, 5}});
}

TEST_CASE("numbers are rounded correctly", "[mesh_io]") {
    const Mesh m = loadText("v 0.1 123456.789012345678 -1e-300\nv 1 0 1e-999\nv 0 1 0\nf 1 2 3\n").mesh;
    CHECK(m.positions[0] == Vec3d{0.1, 123456.789012345678, -1e-300});
    CHECK(m.positions[1][2] == 0.0);
}

TEST_CASE("smooth normals", "[mesh_io]") {
    const LoadedMesh m = loadText(kTriangle + "vn 0 0 2\nvn 3e200 0 4e200\nf 1//1 2/7/2 3//-2\n");
    REQUIRE(m.mesh.normal_index.size() == 1);
    CHECK(m.mesh.normal_index[0] == std::array<std::uint32_t, 3>{0, 1, 0});
    CHECK(m.mesh.normals[0] == Vec3d{0, 0, 1});
    CHECK(m.mesh.normals[1][0] == Approx(.6));
    CHECK(m.mesh.normals[1][2] == Approx(.8));
}

TEST_CASE("normals without direction, or that are not there, shade their faces flat", "[mesh_io]") {
    struct Case {
        const char *normal, *named, *said;
    };
    for (const Case& c :
         {Case{"0 0 0", "1", "mesh.obj: 1 face shaded flat: one of their normals has no direction"},
          {"nan 0 1", "1",
           "mesh.obj:5: the numbers of a vertex normal must be finite, found 'nan'; 1 face shaded flat"},
          {"inf 0 0", "1", "found 'inf'; 1 face shaded flat"},
          {"-1.#IND00 -1.#IND00 -1.#IND00", "1",
           "mesh.obj:5: expected a number, found '-1.#IND00'; 1 face shaded flat"},
          {"0 1", "1", "mesh.obj:5: a vertex normal needs three numbers; 1 face shaded flat"},
          {"1 0 0", "9",
           "mesh.obj:7: 1 face shaded flat: they use a normal that is not in the file, which has 2"},
          {"1 0 0", "-9", "mesh.obj:7: 1 face shaded flat"},
          {"1 0 0", "0", "mesh.obj:7: 1 face shaded flat"},
          {"1 0 0", "x", "mesh.obj:7: 1 face shaded flat"}}) {
        CAPTURE(c.normal, c.named);
        const CapturedLog log;
        const LoadedMesh m = loadText(kTriangle + "v 1 1 0\nvn " + c.normal + "\nvn 0 0 1\nf 1//" + c.named +
                                      " 2//2 3//2\nf 2//2 4//2 3//2\n");
        REQUIRE(m.mesh.normal_index.size() == 2);
        CHECK(m.mesh.normal_index[0] == std::array<std::uint32_t, 3>{kNoNormal, kNoNormal, kNoNormal});
        CHECK(m.mesh.normal_index[1] == std::array<std::uint32_t, 3>{1, 1, 1});
        CHECK(m.mesh.normals.at(1) == Vec3d{0, 0, 1});
        CHECK(log.warnings() == 1);
        CHECK_THAT(log.text(), Contains(c.said));
    }
    // All of them wild, as when an exporter forgets to write normals: no normals at all.
    const CapturedLog log;
    const LoadedMesh m = loadText(kTriangle + "f 1//1 2//2 3//3\n");
    CHECK(m.mesh.triangles.size() == 1);
    CHECK(m.mesh.normal_index.empty());
    CHECK(log.warnings() == 1);
}

TEST_CASE("a vertex that is no number costs its faces, not the file", "[mesh_io]") {
    for (const char* vertex : {"nan 0 0", "0 -inf 0", "-1.#IND00 0 0", "1,5 0 0", "7 7", "", "0 0 1e999"}) {
        CAPTURE(vertex);
        const CapturedLog log;
        const LoadedMesh m = loadText(kTriangle + "v " + vertex + "\nf 1 2 4\nf 1 2 3\n");
        CHECK(m.mesh.triangles == std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}});
        for (const Vec3d& p : m.mesh.positions)
            for (const double x : p) CHECK(std::isfinite(x));
        CHECK(log.warnings() == 1);
        CHECK_THAT(log.text(), Contains("mesh.obj:4: ") && Contains("1 face left out for such vertices"));
    }
    const CapturedLog log;
    CHECK(loadText(kTriangle + "f 1 2\nf 1 2 3\n").mesh.triangles.size() == 1);
    CHECK_THAT(log.text(), Contains("mesh.obj:4: 1 face with fewer than three corners left out"));
}

TEST_CASE("what an OBJ has beside triangles is left out and said in one line", "[mesh_io]") {
    const CapturedLog log;
    loadText("v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nl 1 2\nl 2 3\np 1\nf 1 2 3\n");
    CHECK(log.warnings() == 1);
    CHECK_THAT(log.text(), Contains("left out: 2 line statements, 1 point statement, colours of vertices"));
}

TEST_CASE("another format is named as what it is", "[mesh_io]") {
    using namespace std::string_literals;
    std::string stl(84 + 50, '\0');
    stl[80] = 1;
    for (const auto& [content, words] : std::vector<std::pair<std::string, std::string>>{
             {"ply\nformat ascii 1.0\n", "this is a PLY file; use 'ply:' instead of 'obj:'"},
             {"glTF\x02\0\0\0"s, "this is a binary glTF file (.glb); crt reads OBJ"},
             {"{\n  \"asset\": {\"version\": \"2.0\"}}", "this is a glTF file"},
             {"\x89PNG\r\n\x1a\n", "this is a PNG image"},
             {"\xFF\xD8\xFF\xE0", "this is a JPEG image"},
             {"solid cube\nfacet normal 0 0 1\n", "this is an STL file"},
             {stl, "this is an STL file"},
             {"OFF\n3 1 0\n", "this is an OFF file"},
             {"# materials\nnewmtl a\nKd 1 1 1\n",
              "this is a material file (MTL); name the OBJ that uses it"},
             {"PK\x03\x04", "this is a ZIP archive"},
             {"crt: 1\n", "this is a scene of crt"}}) {
        CAPTURE(words);
        const TemporaryFolder folder;
        CHECK_THROWS_WITH(loadObj(folder.write("mesh.obj", content)), Contains(words));
    }
    // Materials inside an OBJ with faces do not make it an MTL.
    CHECK(loadText("newmtl a\n" + kTriangle + "f 1 2 3\n").mesh.triangles.size() == 1);
}

TEST_CASE("polygons become triangles of the same area and side", "[mesh_io]") {
    const auto split = [](const std::vector<std::array<double, 2>>& outline) {
        std::string text;
        std::string face = "f";
        for (std::size_t i = 0; i < outline.size(); ++i) {
            // In a plane that is none of the coordinate planes.
            text += fmt::format("v {} {} {}\n", outline[i][0], outline[i][1],
                                0.5 * outline[i][0] + 0.25 * outline[i][1]);
            face += fmt::format(" {}", i + 1);
        }
        return loadText(text + face + "\n").mesh;
    };
    const double tilt = std::sqrt(1 + .25 + .0625);

    const Mesh quad = split({{0, 0}, {2, 0}, {2, 1}, {0, 1}});
    CHECK(quad.triangles == std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}});
    CHECK(area(quad) == Approx(2 * tilt));

    const Mesh arrow = split({{0, 0}, {2, -1}, {.5, 0}, {2, 1}});  // Its third corner is a dent.
    CHECK(arrow.triangles.size() == 2);
    CHECK(area(arrow) == Approx(.5 * tilt));

    const Mesh comb = split(
        {{0, 0}, {5, 0}, {5, 3}, {4, 3}, {4, 1}, {3, 1}, {3, 3}, {2, 3}, {2, 1}, {1, 1}, {1, 3}, {0, 3}});
    CHECK(comb.triangles.size() == 10);
    CHECK(area(comb) == Approx((15 - 4) * tilt));

    std::vector<std::array<double, 2>> star;
    for (int i = 0; i < 40; ++i) {
        const double angle = i * 2 * 3.14159265358979 / 40, radius = i % 2 ? .3 : 1.0;
        star.push_back({radius * std::cos(angle), radius * std::sin(angle)});
    }
    const Mesh flower = split(star);
    CHECK(flower.triangles.size() == 38);
    CHECK(area(flower) == Approx(40 * .5 * .3 * std::sin(2 * 3.14159265358979 / 40) * tilt).epsilon(1e-6));
    for (const auto& t : flower.triangles) {  // All wound like the outline.
        const Vec3d &a = flower.positions[t[0]], &b = flower.positions[t[1]], &c = flower.positions[t[2]];
        CHECK((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0);
    }
}

TEST_CASE("triangles without area are dropped and counted", "[mesh_io]") {
    const CapturedLog log;
    const LoadedMesh m =
        loadText(kTriangle + "v 0.1 0.1 0.1\nv 0.2 0.2 0.2\nv 0.3 0.3 0.3\nf 1 2 2\nf 4 5 6\nf 1 2 3\n");
    CHECK(m.mesh.triangles.size() == 1);
    CHECK(m.degenerate_faces == 2);
    CHECK(log.warnings() == 1);
    // A file of nothing else is sound; its user decides what that means.
    for (const char* only : {"f 1 1 2\n", "v 1 2 x\nf 1 1 2\n"}) {
        const LoadedMesh nothing = loadText(kTriangle + only);
        CHECK(nothing.mesh.triangles.empty());
        CHECK(nothing.degenerate_faces == 1);
    }
    // Small and far off is not the same as degenerate.
    CHECK(
        loadText("v 1e6 1e6 0\nv 1000000.001 1e6 0\nv 1e6 1000000.001 0\nf 1 2 3\n").mesh.triangles.size() ==
        1);
    CHECK(loadText("v 0 0 0\nv 1e-200 0 0\nv 0 1e-200 0\nf 1 2 3\n").mesh.triangles.size() == 1);
    CHECK(loadText("v 0 0 0\nv 1e200 0 0\nv 0 1e200 0\nf 1 2 3\n").mesh.triangles.size() == 1);
}

// Found by fuzzing: asking whether a file of such a name exists is a separate error, which came out as
// std::filesystem::filesystem_error.
TEST_CASE("an mtllib whose name no file can have is missing like others", "[mesh_io][mtl]") {
    const CapturedLog log;
    CHECK(
        loadText("mtllib " + std::string(300, 'a') + "\n" + kTriangle + "f 1 2 3\n").mesh.triangles.size() ==
        1);
    CHECK_THAT(log.text(), Contains("aaa…' does not exist"));
}

// Found by fuzzing: an OBJ that names itself has no materials.
TEST_CASE("an OBJ that names itself as its mtllib has no materials", "[mesh_io][mtl]") {
    const CapturedLog log;
    const TemporaryFolder folder;
    const auto loaded =
        loadObj(folder.write("a.obj", "mtllib a.obj\n" + kTriangle + "usemtl red\nf 1 2 3\n"));
    CHECK(loaded.mesh.triangles.size() == 1);
    REQUIRE(loaded.materials.size() == 1);
    CHECK_FALSE(loaded.materials[0].mtl);
}

TEST_CASE("bad meshes are refused with their line", "[mesh_io]") {
    // Of positions that cannot be read, where they leave no face.
    checkRefused("v 0 0 0\nv nan 0 0\n", 2, "finite");
    checkRefused("v 0 0 0\nv 0 -inf 0\n", 2, "finite");
    checkRefused("v 0 0 1e999\n", 1, "finite");
    checkRefused("v 0 0 0\n\n# x\nv 1 0\n", 4, "three numbers");
    checkRefused("v\n", 1, "three numbers");
    checkRefused("v 0 0 1,5\nv 0 1,5 0\nv 1 0 0\nf 1 2 3\n", 1, "'1,5'");
    checkRefused("v 0 0 0\r\nv a b c\r\n", 2, "'a'");
    checkRefused(kTriangle + "f 1 2\n", 4, "three corners");
    // Of indices that lead nowhere.
    checkRefused(kTriangle + "f 1 2 3\nf 1 2 4\n", 5, "vertex 4, but the file has 3");
    checkRefused(kTriangle + "f 1 2 3\nf 1 \\\n 2 9\n", 5, "vertex 9");
    checkRefused(kTriangle + "f 1 2 -4\n", 4, "vertex -4, but only 3");
    checkRefused(kTriangle + "f 0 1 2\n", 4, "'0'");
    checkRefused(kTriangle + "f 1 2 three\n", 4, "'three'");
    checkRefused(kTriangle + "f 1 2 3.5\n", 4, "'3.5'");
    checkRefused(kTriangle + "f 1 2 99999999999999999999\n", 4, "'99999999999999999999'");
    checkRefused(kTriangle + "f 1 2 3000000000\n", 4, "3000000000");
    checkRefused(kTriangle, 0, "no faces");
    checkRefused("", 0, "no faces");
    checkRefused(kTriangle + "l 1 2 3\np 1\np 2\n", 0,
                 "this mesh has no faces, only 1 line statement, 2 point statements");
    checkRefused("cstype bspline\nsurf 0 1 0 1 1 2 3 4\n", 0, "1 free form");

    const TemporaryFolder folder;
    CHECK_THROWS_WITH(loadObj(folder.path()), Contains("directory"));
    CHECK_THROWS_WITH(loadObj(folder.path() + "/none.obj"), Contains("cannot be opened"));
}
