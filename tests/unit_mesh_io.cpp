// OBJ and MTL: what is accepted, what it becomes, and that every refusal names the line.
#include "catch.h"
#include "error.h"
#include "log.h"
#include "mesh_io.h"
#include "verify/temporary_folder.h"

#include <cmath>
#include <filesystem>

using namespace crt;
using crt::verify::TemporaryFolder;

namespace {

/// Counts warnings while it lives, and keeps them off the terminal.
class Warnings {
public:
    Warnings() : before_(warningCount()) { setLogLevel(LogLevel::Error); }
    ~Warnings() { setLogLevel(LogLevel::Info); }
    int count() const { return warningCount() - before_; }

private:
    int before_;
};

LoadedMesh loadText(const std::string& text, bool use_mtl = true) {
    const TemporaryFolder folder;
    return loadObj(folder.write("mesh.obj", text), use_mtl);
}

/// Loads an OBJ with a square, all of it in material "m" of the MTL given.
LoadedMesh loadMaterial(const std::string& statements) {
    const TemporaryFolder folder;
    folder.write("mesh.mtl", "# a comment\nnewmtl m\n" + statements);
    return loadObj(folder.write("mesh.obj", "mtllib mesh.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl m\nf 1 2 3 4\n"), true);
}

void checkRefused(const std::string& text, int line, const char* words) {
    const TemporaryFolder folder;
    const std::string path = folder.write("mesh.obj", text);
    CAPTURE(text);
    try {
        loadObj(path, true);
        FAIL_CHECK("accepted");
    } catch (const Error& e) {
        CHECK(e.kind() == ErrorKind::Scene);
        CHECK_THAT(e.what(), Contains(words));
        CHECK(e.place().file == path);
        CHECK(e.place().line == line);
    }
}

double area(const Mesh& mesh) {
    double sum = 0;
    for (const auto& t : mesh.triangles) {
        const Vec3d &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
        const Vec3d u{b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
        sum += std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]) / 2;
    }
    return sum;
}

double valueAt(const Spectrum& s, int nm) { return s[static_cast<std::size_t>(nm - kWavelengthMin_nm)]; }

const std::string kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

}  // namespace

TEST_CASE("a triangle", "[mesh_io]") {
    const LoadedMesh m = loadText(kTriangle + "f 1 2 3\n");
    CHECK(m.mesh.positions == std::vector<Vec3d>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    CHECK(m.mesh.triangles == std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}});
    CHECK(m.mesh.normals.empty());
    CHECK(m.mesh.normal_index.empty());
    CHECK(m.mesh.material.empty());
    CHECK(m.mesh.emission.empty());
    CHECK(m.files.size() == 1);
    CHECK(m.degenerate_faces == 0);
}

TEST_CASE("the same mesh in every spelling", "[mesh_io]") {
    const Mesh expected = loadText(kTriangle + "f 1 2 3\n").mesh;
    for (const char* text : {
             "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n",                       // Windows
             "v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r",                               // before that
             "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3",                                 // no newline at the end
             "\xEF\xBB\xBFv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",                   // byte-order mark
             "# c\n\n  v  0\t0 0 \nv 1 0 0 1.0\nv +0 1e0 0 .5 .5 .5\nf  1 2  3 \n",  // blanks, weights, colours
             "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n",                 // texture coordinates
             "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n",                            // counted from the end
             "f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n",                               // faces first
             "v 0 0 0\nv 1 0 \\\n0\nv 0 1 0\nf 1 \\\r\n 2 3\n",                    // joined lines
             "o thing\ng a b\ns off\nv 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\np 1\nf 1 2 3 # done\n",
             "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3\n",               // one corner without normal: flat
         }) {
        CAPTURE(text);
        const Mesh mesh = loadText(text).mesh;
        CHECK(mesh.positions == expected.positions);
        CHECK(mesh.triangles == expected.triangles);
        CHECK(mesh.normal_index.empty());
    }
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

TEST_CASE("normals without direction shade their faces flat", "[mesh_io]") {
    for (const char* normal : {"0 0 0", "nan 0 1", "inf 0 0"}) {
        const Warnings warnings;
        CAPTURE(normal);
        const LoadedMesh m = loadText(kTriangle + "v 1 1 0\nvn " + normal + "\nvn 0 0 1\nf 1//1 2//2 3//2\nf 2//2 4//2 3//2\n");
        REQUIRE(m.mesh.normal_index.size() == 2);
        CHECK(m.mesh.normal_index[0] == std::array<std::uint32_t, 3>{kNoNormal, kNoNormal, kNoNormal});
        CHECK(m.mesh.normal_index[1] == std::array<std::uint32_t, 3>{1, 1, 1});
        CHECK(warnings.count() == 1);
    }
}

TEST_CASE("polygons become triangles of the same area and side", "[mesh_io]") {
    const auto split = [](const std::vector<std::array<double, 2>>& outline) {
        std::string text;
        std::string face = "f";
        for (std::size_t i = 0; i < outline.size(); ++i) {
            // In a plane that is none of the coordinate planes.
            text += fmt::format("v {} {} {}\n", outline[i][0], outline[i][1], 0.5 * outline[i][0] + 0.25 * outline[i][1]);
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

    const Mesh comb = split({{0, 0}, {5, 0}, {5, 3}, {4, 3}, {4, 1}, {3, 1}, {3, 3}, {2, 3}, {2, 1}, {1, 1}, {1, 3}, {0, 3}});
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
    const Warnings warnings;
    const LoadedMesh m = loadText(kTriangle + "v 0.1 0.1 0.1\nv 0.2 0.2 0.2\nv 0.3 0.3 0.3\nf 1 2 2\nf 4 5 6\nf 1 2 3\n");
    CHECK(m.mesh.triangles.size() == 1);
    CHECK(m.degenerate_faces == 2);
    CHECK(warnings.count() == 1);
    // Small and far off is not the same as degenerate.
    CHECK(loadText("v 1e6 1e6 0\nv 1000000.001 1e6 0\nv 1e6 1000000.001 0\nf 1 2 3\n").mesh.triangles.size() == 1);
    CHECK(loadText("v 0 0 0\nv 1e-200 0 0\nv 0 1e-200 0\nf 1 2 3\n").mesh.triangles.size() == 1);
    CHECK(loadText("v 0 0 0\nv 1e200 0 0\nv 0 1e200 0\nf 1 2 3\n").mesh.triangles.size() == 1);
}

// Found by fuzzing: asking whether a file of such a name exists is an error of its own, which came out as std::filesystem::filesystem_error.
TEST_CASE("an mtllib whose name no file can have is refused with its line", "[mesh_io]") {
    CHECK_THROWS_WITH(loadText("v 0 0 0\nmtllib " + std::string(300, 'a') + "\n"), Contains("material file") && Contains("cannot be opened"));
}

// Found by fuzzing: tinyobjloader reads the first material of an mtllib that brought none.
TEST_CASE("an OBJ that names itself as its mtllib has no materials", "[mesh_io]") {
    const TemporaryFolder folder;
    const auto loaded = loadObj(folder.write("a.obj", "mtllib a.obj\n" + kTriangle + "usemtl red\nf 1 2 3\n"), true);
    CHECK(loaded.mesh.triangles.size() == 1);
    CHECK(loaded.materials.empty());
}

TEST_CASE("bad meshes are refused with their line", "[mesh_io]") {
    checkRefused("v 0 0 0\nv nan 0 0\n", 2, "finite");
    checkRefused("v 0 0 0\nv 0 -inf 0\n", 2, "finite");
    checkRefused("v 0 0 1e999\n", 1, "finite");
    checkRefused("v 0 0 0\n\n# x\nv 1 0\n", 4, "three numbers");
    checkRefused("v\n", 1, "three numbers");
    checkRefused("v 0 0 1,5\n", 1, "'1,5'");
    checkRefused("v 0 0 0\r\nv a b c\r\n", 2, "'a'");
    checkRefused(kTriangle + "vn 0 1\nf 1 2 3\n", 4, "three numbers");
    checkRefused(kTriangle + "f 1 2 4\n", 4, "vertex 4, but the file has 3");
    checkRefused(kTriangle + "f 1 2 3\nf 1 \\\n 2 9\n", 5, "vertex 9");
    checkRefused(kTriangle + "f 1 2 -4\n", 4, "vertex -4, but only 3");
    checkRefused(kTriangle + "f 0 1 2\n", 4, "'0'");
    checkRefused(kTriangle + "f 1 2 three\n", 4, "'three'");
    checkRefused(kTriangle + "f 1 2 3.5\n", 4, "'3.5'");
    checkRefused(kTriangle + "f 1 2 99999999999999999999\n", 4, "'99999999999999999999'");
    checkRefused(kTriangle + "f 1 2 3000000000\n", 4, "3000000000");
    checkRefused(kTriangle + "f 1//1 2//1 3//1\n", 4, "normal 1, but the file has 0");
    checkRefused(kTriangle + "vn 0 0 1\nf 1//1 2//1 3//-2\n", 5, "normal -2");
    checkRefused(kTriangle + "f 1 2\n", 4, "three corners");
    checkRefused(kTriangle, 0, "no faces");
    checkRefused("", 0, "no faces");
    {
        const Warnings quiet;
        checkRefused(kTriangle + "f 1 1 2\n", 0, "area");
    }
    checkRefused("mtllib missing.mtl\n" + kTriangle + "f 1 2 3\n", 1, "missing.mtl");

    const TemporaryFolder folder;
    CHECK_THROWS_WITH(loadObj(folder.path(), true), Contains("directory"));
    CHECK_THROWS_WITH(loadObj(folder.path() + "/none.obj", true), Contains("cannot be opened"));
}

TEST_CASE("material files are found, shared and may be ignored", "[mesh_io]") {
    const TemporaryFolder folder;
    const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    folder.write("my colours.mtl", "newmtl unused\nKd 1 1 1\nnewmtl  red one \nKd 1 0 0\n\nnewmtl lamp\nKd 0 0 0\nKe 4 4 4");
    const std::string obj = folder.write(
        "mesh.obj", "mtllib my colours.mtl\nmtllib my colours.mtl\n" + square +
                        "f 1 2 3\nusemtl red one\nf 1 2 3 4\nusemtl lamp\nf 1 3 4\nusemtl red one\nf 2 3 4\n");
    const LoadedMesh m = loadObj(obj, true);
    REQUIRE(m.materials.size() == 2);  // Only those used, in order of use.
    CHECK(m.materials[0].name == "red one");
    CHECK(m.materials[0].place.line == 3);
    CHECK(m.materials[1].name == "lamp");
    CHECK(m.mesh.material == std::vector<std::int32_t>{-1, 0, 0, 1, 0});
    REQUIRE(m.emissions.size() == 1);
    CHECK(m.mesh.emission == std::vector<std::int32_t>{-1, -1, -1, 0, -1});
    CHECK(m.files.size() == 2);

    const LoadedMesh plain = loadObj(obj, false);
    CHECK(plain.materials.empty());
    CHECK(plain.mesh.material.empty());
    CHECK(plain.files.size() == 1);

    folder.write("a.mtl", "newmtl a\nKd 1 0 0\n");
    folder.write("b.mtl", "newmtl b\nKd 0 1 0\n");
    const std::string two = "mtllib a.mtl b.mtl\n" + square + "usemtl b\nf 1 2 3\nusemtl a\nf 1 3 4\n";
    const LoadedMesh both = loadObj(folder.write("two.obj", two), true);
    CHECK(both.materials.at(0).name == "b");
    CHECK(both.materials.at(1).name == "a");

    const Warnings warnings;
    const std::string nowhere = square + "usemtl nowhere\nf 1 2 3\nusemtl nowhere\nf 1 3 4\n";
    const LoadedMesh undefined = loadObj(folder.write("c.obj", nowhere), true);
    CHECK(undefined.mesh.material.empty());
    CHECK(warnings.count() == 1);

    folder.write("bad.mtl", "newmtl a\nnewmtl\n");
    CHECK_THROWS_WITH(loadObj(folder.write("bad.obj", "mtllib bad.mtl\n" + square + "f 1 2 3\n"), true), Contains("name"));
}

TEST_CASE("MTL materials map onto ours", "[mesh_io][mtl]") {
    const Warnings warnings;
    SECTION("Kd is an sRGB colour; Ka is ignored") {
        const LoadedMesh m = loadMaterial("Ka 1 1 1\nKd 0.5 0.5 0.5\n");
        CHECK(m.materials.at(0).type == MaterialType::Diffuse);
        CHECK(m.materials[0].reflectance == constantSpectrum(srgbToLinear(.5)));
        CHECK(m.emissions.empty());
        CHECK(warnings.count() == 0);
    }
    SECTION("a highlight is left out, and said so once") {
        const LoadedMesh m = loadMaterial("Kd 0.8 0.1 0.1\nKs 0.5 0.5 0.5\nNs 250\nNi 1.45\nd 1\nillum 2\n");
        CHECK(m.materials.at(0).type == MaterialType::Diffuse);  // Ni alone does not make glass.
        CHECK(warnings.count() == 1);
    }
    SECTION("d below 1 is glass, with 1.5 when nothing says otherwise") {
        const LoadedMesh m = loadMaterial("Kd 1 1 1\nd 0\n");
        CHECK(m.materials.at(0).type == MaterialType::Dielectric);
        CHECK(m.materials[0].eta == constantSpectrum(1.5));
        CHECK(warnings.count() == 0);
        CHECK(loadMaterial("Tr 1\nNi 1.33\n").materials.at(0).eta == constantSpectrum(1.33));
        CHECK(loadMaterial("d 0.5\nNi 1\n").materials.at(0).eta == constantSpectrum(1.0));
        CHECK(warnings.count() == 1);
    }
    SECTION("so is illum 4, 6, 7, 9") {
        for (const int illum : {4, 6, 7, 9})
            CHECK(loadMaterial(fmt::format("Ni 1.7\nillum {}\n", illum)).materials.at(0).type == MaterialType::Dielectric);
        for (const int illum : {0, 1, 2, 3, 5, 8})
            CHECK(loadMaterial(fmt::format("Kd 1 1 1\nillum {}\n", illum)).materials.at(0).type == MaterialType::Diffuse);
    }
    SECTION("metals are mirrors") {
        const LoadedMesh pbr = loadMaterial("Kd 1 1 1\nKs 0 0 0\nPm 1\nPr 0\n");
        CHECK(pbr.materials.at(0).type == MaterialType::Mirror);
        CHECK(pbr.materials[0].reflectance == constantSpectrum(1));
        const LoadedMesh classic = loadMaterial("Kd 0 0 0\nKs 0.5 0.5 0.5\nillum 3\n");
        CHECK(classic.materials.at(0).type == MaterialType::Mirror);
        CHECK(classic.materials[0].reflectance == constantSpectrum(srgbToLinear(.5)));
        CHECK(warnings.count() == 0);
        CHECK(loadMaterial("Kd 1 1 1\nPm 1\nPr 0.4\n").materials.at(0).type == MaterialType::Mirror);
        CHECK(warnings.count() == 1);  // Rough.
        CHECK(loadMaterial("Kd 1 1 1\nPm 0.3\n").materials.at(0).type == MaterialType::Diffuse);
        CHECK(warnings.count() == 2);
    }
    SECTION("Ke shines; beyond 1 its strength is linear") {
        const LoadedMesh m = loadMaterial("Kd 0 0 0\nKe 10 10 10\n");
        REQUIRE(m.emissions.size() == 1);
        CHECK_FALSE(m.emissions[0].two_sided);
        CHECK(spectrumToXyz(m.emissions[0].radiance)[1] == Approx(10).epsilon(1e-3));
        const LoadedMesh dim = loadMaterial("Ke 0.5 0.5 0.5\n");
        CHECK(spectrumToXyz(dim.emissions.at(0).radiance)[1] == Approx(srgbToLinear(.5)).epsilon(1e-3));
        CHECK(loadMaterial("Ke 0 0 0\n").emissions.empty());
    }
    SECTION("colours out of range are clamped and said so") {
        CHECK(loadMaterial("Kd 2 2 2\n").materials.at(0).reflectance == constantSpectrum(1));
        CHECK(warnings.count() == 1);
    }
    SECTION("textures are left out and said so") {
        loadMaterial("Kd 1 1 1\nmap_Kd wood.png\n");
        CHECK(warnings.count() == 1);
    }
    SECTION("a broken index is refused") {
        CHECK_THROWS_WITH(loadMaterial("d 0\nNi 0\n"), Contains("Ni"));
        CHECK_THROWS_WITH(loadMaterial("Kd 1e999 0 0\n"), Contains("finite"));
    }
}

TEST_CASE("crt_reflectance names a measured spectrum beside the MTL", "[mesh_io][mtl]") {
    const TemporaryFolder folder;
    folder.write("paint.spd", "400 0.1\n700 0.7\n");
    folder.write("wrong.spd", "400 0.1\n700 1.7\n");
    folder.write("mesh.mtl", "newmtl m\nKd 1 0 0\ncrt_reflectance paint.spd\nnewmtl w\ncrt_reflectance\twrong.spd\n");
    const std::string head = "mtllib mesh.mtl\n" + kTriangle;
    const LoadedMesh m = loadObj(folder.write("mesh.obj", head + "usemtl m\nf 1 2 3\n"), true);
    CHECK(valueAt(m.materials.at(0).reflectance, 550) == Approx(.4));
    CHECK(valueAt(m.materials[0].reflectance, 800) == .7);
    CHECK(m.files.size() == 3);
    CHECK_THROWS_WITH(loadObj(folder.write("wrong.obj", head + "usemtl w\nf 1 2 3\n"), true), Contains("[0, 1]"));
}
