// MTL: which files an OBJ's names lead to, what their materials become, and what is said about it.
#include "base/error.h"
#include "captured_log.h"
#include "catch.h"
#include "base/temporary_folder.h"
#include "scene/mesh/mesh_io.h"
#include "scene/yaml/scene_yaml.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <tuple>

using namespace crt;
using crt::test::CapturedLog;
using crt::TemporaryFolder;

namespace {

const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

/// Loads an OBJ with a square, all of it in material "m" of these statements.
MtlMaterial loadMaterial(const std::string& statements, MtlColor color = MtlColor::Linear) {
    const TemporaryFolder folder;
    folder.write("mesh.mtl", "# a comment\nnewmtl m\n" + statements);
    const std::string obj =
        folder.write("mesh.obj", "mtllib mesh.mtl\n" + kSquare + "usemtl m\nf 1 2 3 4\n");
    const LoadedMesh loaded = loadObj(obj, {.color = color});
    REQUIRE(loaded.materials.size() == 1);
    REQUIRE(loaded.materials[0].mtl);
    return *loaded.materials[0].mtl;
}

MaterialType typeOf(const std::string& statements) { return loadMaterial(statements).material.type; }

/// The name of the only material and whether a file defines it.
bool isDefined(const LoadedMesh& loaded) {
    REQUIRE(loaded.materials.size() == 1);
    return loaded.materials[0].mtl.has_value();
}

double valueAt(const Spectrum& s, int nm) { return s[static_cast<std::size_t>(nm - kWavelengthMin_nm)]; }

}  // namespace

// ---- Files --------------------------------------------------------------------------------

TEST_CASE("material files are found, shared and may be ignored", "[mesh_io][mtl]") {
    const TemporaryFolder folder;
    folder.write("my colours.mtl",
                 "newmtl unused\nKd 1 1 1\nnewmtl  red one \nKd 1 0 0\n\nnewmtl lamp\nKd 0 0 0\nKe 4 4 4");
    const std::string obj = folder.write(
        "mesh.obj",
        "mtllib my colours.mtl\nmtllib my colours.mtl\n" + kSquare +
            "f 1 2 3\nusemtl red one\nf 1 2 3 4\nusemtl lamp\nf 1 3 4\nusemtl red one\nf 2 3 4\n");
    const LoadedMesh m = loadObj(obj);
    REQUIRE(m.materials.size() == 2);  // Only those used, in order of use.
    CHECK(m.materials[0].name == "red one");
    CHECK(m.materials[0].mtl->material.place.line == 3);
    CHECK_FALSE(m.materials[0].mtl->emission);
    CHECK(m.materials[1].name == "lamp");
    CHECK(m.materials[1].mtl->emission);
    CHECK(m.mesh.material == std::vector<std::int32_t>{-1, 0, 0, 1, 0});
    CHECK(m.files.size() == 2);

    const LoadedMesh plain = loadObj(obj, {.use_mtl = false});
    CHECK(plain.materials.empty());
    CHECK(plain.mesh.material.empty());
    CHECK(plain.files.size() == 1);
}

TEST_CASE("several names of an mtllib are read in turn", "[mesh_io][mtl]") {
    const TemporaryFolder folder;
    folder.write("a.mtl", "newmtl a\nKd 1 1 1\n");
    folder.write("b.mtl", "newmtl b\nKd 0 0 0\nnewmtl a\nKd 0 0 0\n");
    const CapturedLog log;
    const std::string faces = kSquare + "usemtl b\nf 1 2 3\nusemtl a\nf 1 3 4\n";
    const LoadedMesh both = loadObj(folder.write("two.obj", "mtllib a.mtl b.mtl\n" + faces));
    CHECK(both.materials.at(0).name == "b");
    CHECK(both.materials.at(1).mtl->material.reflectance ==
          constantSpectrum(1));  // The first definition counts.
    CHECK_THAT(log.text(), Contains("b.mtl:3: 1 material was defined before; the first definition counts"));

    const CapturedLog quiet;
    const LoadedMesh one = loadObj(folder.write("one.obj", "mtllib nowhere.mtl b.mtl\n" + faces));
    CHECK(one.materials.at(0).mtl);
    CHECK(one.materials.at(1).mtl);
    CHECK(one.missing_files == std::vector<std::string>{"nowhere.mtl"});

    // Names with blanks side by side, and a material without a name for a usemtl without one.
    folder.write("my a.mtl", "newmtl\nKd 1 1 1\n");
    const LoadedMesh blanks =
        loadObj(folder.write("blanks.obj", "mtllib my a.mtl b.mtl\n" + faces + "usemtl\nf 1 2 3\n"));
    REQUIRE(blanks.materials.size() == 3);
    for (const LoadedMaterial& m : blanks.materials) CHECK(m.mtl);
    CHECK(blanks.missing_files.empty());
}

TEST_CASE("names of material files are forgiven backslashes, case, folders and quotes, with a warning",
          "[mesh_io][mtl]") {
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder / "Mats");
    folder.write("Mats/Red.mtl", "newmtl a\nKd 1 1 1\n");
    folder.write("Blue Paint.MTL", "newmtl a\nKd 1 1 1\n");
    struct Case {
        const char* name;
        int warnings;
    };
    for (const Case& c : {Case{"Mats/Red.mtl", 0},
                          {"Mats\\Red.mtl", 1},
                          {"mats/red.MTL", 1},
                          {".\\mats\\red.mtl", 1},
                          {"Blue Paint.MTL", 0},
                          {"\"Blue Paint.MTL\"", 0},
                          {"blue paint.mtl", 1},
                          {"C:\\art\\blue paint.mtl", 1},
                          {"/home/me/Blue Paint.MTL", 1}, {"Blue\\ Paint.MTL", 1}}) {
        CAPTURE(c.name);
        const CapturedLog log;
        CHECK(isDefined(loadObj(
            folder.write("mesh.obj", fmt::format("mtllib {}\n{}usemtl a\nf 1 2 3\n", c.name, kSquare)))));
        CHECK(log.warnings() == c.warnings);
        if (c.warnings > 0)
            CHECK_THAT(log.text(),
                       Contains("mesh.obj:1: the material file '") &&
                           Contains("' does not exist; crt read '"));
    }
    // Renamed together with its OBJ.
    folder.write("mesh.mtl", "newmtl a\nKd 1 1 1\n");
    const CapturedLog log;
    CHECK(
        isDefined(loadObj(folder.write("mesh.obj", "mtllib old.mtl\n" + kSquare + "usemtl a\nf 1 2 3\n"))));
    CHECK_THAT(log.text(), Contains("the material file 'old.mtl' does not exist; crt read '"));
    CHECK(log.warnings() == 1);
}

TEST_CASE("a missing material file, or name, costs materials, not the mesh", "[mesh_io][mtl]") {
    const TemporaryFolder folder;
    const CapturedLog log;
    const std::string faces =
        kSquare + "usemtl red\nf 1 2 3 4\nusemtl (null)\nf 1 2 3\nusemtl red\nf 1 3 4\n";
    const LoadedMesh m = loadObj(folder.write("mesh.obj", "mtllib missing.mtl\n" + faces));
    REQUIRE(m.materials.size() == 2);
    CHECK_FALSE(m.materials[0].mtl);
    CHECK(m.mesh.material == std::vector<std::int32_t>{0, 0, 1, 0});
    CHECK(m.missing_files == std::vector<std::string>{"missing.mtl"});
    CHECK(log.warnings() == 1);
    CHECK_THAT(log.text(), Contains("materials 'red', '(null)' are not defined, and the file 'missing.mtl' "
                                    "does not exist: 4 of 4 triangles have no material"));

    // A file that cannot be read is one that is missing.
    folder.write("locked.mtl", "newmtl red\nKd 1 1 1\n");
    std::filesystem::permissions(folder / "locked.mtl", std::filesystem::perms::none);
    if (::access((folder / "locked.mtl").c_str(), R_OK) != 0)
        CHECK_FALSE(loadObj(folder.write("locked.obj", "mtllib locked.mtl\n" + faces)).materials.at(0).mtl);
    std::filesystem::create_directory(folder / "folder.mtl");
    CHECK_FALSE(loadObj(folder.write("folder.obj", "mtllib folder.mtl\n" + faces)).materials.at(0).mtl);
}

TEST_CASE("statements of an MTL that make no sense cost themselves, not the mesh", "[mesh_io][mtl]") {
    const TemporaryFolder folder;
    folder.write("m.mtl",
                 "Kd 1 0 0\nnewmtl m\nKd 1,0 1 1\nKs 0.5 nan 0.5\nNi wet\nd\nKe 1 1\nmap_Kd\nglow 7\n");
    const CapturedLog log;
    const LoadedMesh loaded =
        loadObj(folder.write("mesh.obj", "mtllib m.mtl\n" + kSquare + "usemtl m\nf 1 2 3\n"));
    REQUIRE(loaded.materials.at(0).mtl);
    CHECK(loaded.materials[0].mtl->material.reflectance == constantSpectrum(0.6));
    CHECK_FALSE(loaded.materials[0].mtl->emission);
    CHECK_THAT(log.text(),
               Contains("m.mtl:1: 1 statement before the first newmtl left out") &&
                   Contains("no Kd read as grey 0.6 (1)") && Contains("unknown: glow (1)") &&
                   Contains("not understood: Kd (1, first at m.mtl:3) Ke (1, first at m.mtl:7) Ks (1, first "
                            "at m.mtl:4) Ni (1, first at m.mtl:5) d (1, first at m.mtl:6)"));
}

// ---- Materials --------------------------------------------------------------------------------

TEST_CASE("glass needs an index above 1 and light that passes", "[mesh_io][mtl]") {
    const CapturedLog log;
    for (const char* passes : {"d 0\n", "d 0.5\n", "d -halo 0.5\n", "Tr 1\n", "Tr 0.1\n", "Tf 0.9 1 1\n",
                               "Kt 0.5\n", "illum 4\n", "illum 6\n", "illum 7\n", "illum 9\n"}) {
        CAPTURE(passes);
        const Material glass = loadMaterial(std::string("Kd 1 1 1\nNi 1.33\n") + passes).material;
        CHECK(glass.type == MaterialType::Dielectric);
        CHECK(glass.eta == constantSpectrum(1.33));
        for (const char* index :
             {"", "Ni 1\n", "Ni 1.00\n", "Ni 0\n", "Ni 0.8\n", "Ni 5000\n", "Ni 1e999\n"}) {
            CAPTURE(index);
            CHECK(typeOf(std::string("Kd 1 1 1\n") + index + passes) == MaterialType::Diffuse);
        }
    }
    for (const char* blocks :
         {"", "d 1\n", "d 1\nTr 1\n", "Tr 0\n", "Tf 1 1 1\n", "Tf 0 0 0\n", "illum 0\n", "illum 1\n",
          "illum 2\n", "illum 3\n", "illum 5\n", "illum 8\n", "illum 10\n"}) {
        CAPTURE(blocks);
        CHECK(typeOf(std::string("Kd 1 1 1\nNi 1.5\n") + blocks) == MaterialType::Diffuse);
    }
}

TEST_CASE("materials of families of exporters are what they were", "[mesh_io][mtl]") {
    const CapturedLog log;
    // Maya
    CHECK(typeOf("illum 4\nKd 0.50 0.50 0.50\nKa 0.00 0.00 0.00\nTf 1.00 1.00 1.00\nNi 1.00\n") ==
          MaterialType::Diffuse);
    // Maya, of a Sponza that 3ds Max wrote: its Ni stays. Materials that let light pass do so in Maya's
    // files too.
    const std::string maya =
        "illum 4\nKd 0.78 0.78 0.78\nKa 0.00 0.00 0.00\nTf 1.00 1.00 1.00\nNi 1.50\nKs 0.00 0.00 0.00\nNs "
        "50.00\n";
    CHECK(typeOf(maya) == MaterialType::Diffuse);
    CHECK_THAT(log.text(), Contains("illum 4 with a white Tf read as opaque (1)"));
    CHECK(typeOf(maya + "Tf 0.5 0.5 0.5\n") == MaterialType::Dielectric);
    CHECK(typeOf(maya + "d 0.5\n") == MaterialType::Dielectric);
    CHECK(typeOf(maya + "illum 7\n") == MaterialType::Dielectric);
    // Maya, with a texture
    const Material textured = loadMaterial("illum 4\nKd 0 0 0\nmap_Kd a.jpg\nTf 1 1 1\n").material;
    CHECK(textured.reflectance[200] == Approx(0.6).epsilon(1e-3));
    CHECK_THAT(log.text(), Contains("a black Kd together with map_Kd read as grey 0.6 (1)"));
    // A Sponza in circulation
    CHECK(typeOf("Ns 7.843137\nKa 0 0 0\nKd 0.4704 0.4704 0.4704\nKs 0 0 0\nNi 1.000000\nd 0.000000\nillum "
                 "2\nmap_Kd KAMEN.JPG\n") == MaterialType::Diffuse);
    // 3ds Max, and so Crytek's Sponza
    CHECK(typeOf("\tNs 10.0000\n\tNi 1.5000\n\td 1.0000\n\tTr 0.0000\n\tTf 1.0000 1.0000 1.0000 \n\tillum "
                 "2\n\tKd 0.5880 0.5880 0.5880\n\tKs 0 0 0\n") == MaterialType::Diffuse);
    // MeshLab, vcglib, OpenMVS
    CHECK(typeOf("Ka 0.200000 0.200000 0.200000\nKd 1.000000 1.000000 1.000000\nKs 1.000000 1.000000 "
                 "1.000000\nTr 1.000000\nillum 2\nNs 0.000000\nmap_Kd a.jpg\n") == MaterialType::Diffuse);
    // Blender: an opaque one, and glass
    CHECK(typeOf("Ns 250\nKa 1 1 1\nKd 0.8 0.8 0.8\nKs 0.5 0.5 0.5\nKe 0 0 0\nNi 1.450000\nd "
                 "1.000000\nillum 2\n") == MaterialType::Diffuse);
    CHECK(typeOf("Ns 900\nKa 1 1 1\nKd 0.8 0.8 0.8\nKs 0.5 0.5 0.5\nKe 0 0 0\nNi 1.450000\nd "
                 "0.000000\nillum 4\n") == MaterialType::Dielectric);
}

TEST_CASE("other materials are mirrors or diffuse", "[mesh_io][mtl]") {
    const CapturedLog log;
    const Material pbr = loadMaterial("Kd 1 1 1\nKs 0 0 0\nPm 1\nPr 0\n").material;
    CHECK(pbr.type == MaterialType::Mirror);
    CHECK(pbr.reflectance == constantSpectrum(1));
    const Material classic = loadMaterial("Kd 0 0 0\nKs 0.5 0.5 0.5\nillum 3\n").material;
    CHECK(classic.type == MaterialType::Mirror);
    CHECK(classic.reflectance == constantSpectrum(.5));
    CHECK(typeOf("Kd 0.8 0.8 0.8\nKs 0.5 0.5 0.5\nillum 3\n") == MaterialType::Diffuse);
    const int before = log.warnings();
    CHECK(loadMaterial("Ka 1 1 1\nKd 0.5 0.5 0.5\n").material.reflectance == constantSpectrum(.5));
    CHECK(log.warnings() == before);
    CHECK_THAT(log.text(), Contains("info: ") && Contains("mesh.obj: 1 material: 1 diffuse\n"));
}

TEST_CASE("d between 0 and 1 without Ni is opacity, and so is map_d", "[mesh_io][mtl]") {
    const CapturedLog log;
    CHECK(loadMaterial("Kd 1 1 1\nd 0.25\n").material.opacity == .25);
    CHECK(loadMaterial("Kd 1 1 1\nTr 0.25\nNi 1\n").material.opacity == .75);
    CHECK(loadMaterial("Kd 1 1 1\nPm 1\nd 0.5\n").material.opacity == .5);
    CHECK(loadMaterial("Kd 1 1 1\nd 1\nTr 0.25\n").material.opacity == 1);
    CHECK(log.warnings() == 0);
    // 0 is written for opaque surfaces.
    for (const char* statements : {"d 0\n", "Tr 1\n", "d -1\n", "Tr 1.0\nNi 1.0\n"}) {
        CAPTURE(statements);
        CHECK(loadMaterial(std::string("Kd 1 1 1\n") + statements).material.opacity == 1);
    }
    CHECK(log.warnings() == 4);
    CHECK_THAT(log.text(), Contains("1 diffuse; d 0 without Ni above 1 read as opaque (1)") &&
                               Contains("1 diffuse; Tr 1 without Ni above 1 read as opaque (1)"));
    // Of glass it is nothing.
    CHECK(loadMaterial("Ni 1.5\nd 0.25\n").material.opacity == 1);

    const TemporaryFolder folder;
    folder.write("leaf.png", "");
    folder.write("mask.png", "");
    folder.write("mesh.obj", "mtllib mesh.mtl\n" + kSquare + "usemtl m\nf 1 2 3 4\n");
    const auto load = [&](const std::string& statements) {
        folder.write("mesh.mtl", "newmtl m\n" + statements);
        return *loadObj(folder.path() + "/mesh.obj").materials.at(0).mtl;
    };
    // Blender writes its Ni for everything; with images it is a surface.
    const MtlMaterial leaf = load("Kd 1 1 1\nNi 1.45\nd 0.9\nmap_Kd leaf.png\nmap_d -imfchan g mask.png\n");
    CHECK(leaf.material.type == MaterialType::Diffuse);
    REQUIRE(leaf.map_d);
    CHECK_THAT(leaf.map_d->file, Contains("mask.png"));
    CHECK(leaf.map_d->channel == 1);
    CHECK(leaf.material.opacity == .9);  // where the image cannot be read
    CHECK_FALSE(leaf.norm);
    CHECK(load("Kd 1 1 1\nNi 1.45\nd 0.9\nmap_Kd leaf.png\n").material.opacity == .9);
    CHECK(load("map_d mask.png\nd 0\n").material.opacity == 1);
    CHECK(load("norm -bm 1 mask.png\n").norm);
    CHECK(load("map_d -imfchan m mask.png\n").map_d->channel == 3);
    const CapturedLog lost;
    const MtlMaterial cut = load("map_Kd leaf.png\nmap_d leaf.png\n");
    REQUIRE(cut.map_d);
    CHECK(cut.map_d->channel == 3);
    CHECK_THAT(lost.text(), Contains("the alpha of the map_Kd read for the map_d, which is the same image"));
    CHECK_FALSE(load("map_d gone.png\nnorm away.png\n").map_d);
    CHECK_THAT(lost.text(),
               Contains("dropped: map_d (1), norm (1); 2 images do not exist, such as 'away.png'"));
    const MtlMaterial glass = load("Ni 1.5\nillum 6\nmap_d mask.png\nnorm mask.png\n");
    CHECK(glass.material.type == MaterialType::Dielectric);
    CHECK_FALSE((glass.map_d || glass.norm));
    CHECK_THAT(lost.text(), Contains("1 glass; dropped: map_d (1), norm (1)"));
}

TEST_CASE("options of images that change the picture are applied or named", "[mesh_io][mtl]") {
    const TemporaryFolder folder;
    folder.write("a.png", "");
    folder.write("mesh.obj", "mtllib mesh.mtl\n" + kSquare + "usemtl m\nf 1 2 3 4\n");
    const auto load = [&](const std::string& statement) {
        folder.write("mesh.mtl", "newmtl m\nKd 1 1 1\n" + statement + "\n");
        return *loadObj(folder.path() + "/mesh.obj").materials.at(0).mtl;
    };
    const CapturedLog log;
    for (const char* same : {"-o 0.5 0.25 7", "-s 2 3 1", "-clamp on", "-clamp off", "-t 0 0 0", "-mm 0 1",
                             "-mm 0.0 1.0", "-bm 0.3", "-boost 0", "-blendu on -blendv on", "-cc off"}) {
        CAPTURE(same);
        CHECK(load(std::string("map_Kd ") + same + " a.png").map_kd);
    }
    CHECK(load("map_d -imfchan b a.png").map_d->channel == 2);
    CHECK(log.warnings() == 0);
    const MtlMaterial moved = load("map_Kd -s 2 -o 0.5 -clamp on a.png");
    CHECK(moved.map_kd->transform == std::array<double, 6>{2, 0, 0.5, 0, 1, 0});
    CHECK(moved.map_kd->clamp);
    for (const auto& [keyword, option, arguments] : {std::tuple{"map_Kd", "-mm", "0.2 0.5"},
                                                     {"map_Kd", "-mm", "0.2"},
                                                     {"map_d", "-mm", "0 2"},
                                                     {"map_Kd", "-t", "0.1"},
                                                     {"map_Kd", "-boost", "1"},
                                                     {"norm", "-bm", "0.5"},
                                                     {"map_Kd", "-o", "1e7"},
                                                     {"map_Kd", "-s", "1 nan"},
                                                     {"map_Kd", "-blendu", "off"},
                                                     {"map_Kd", "-blendv", "off"},
                                                     {"map_Kd", "-cc", "on"},
                                                     {"map_Kd", "-texres", "64"},
                                                     {"map_Kd", "-imfchan", "r"},
                                                     {"map_d", "-imfchan", "l"},
                                                     {"map_Kd", "-colorspace", "linear"}}) {
        const std::string statement = fmt::format("{} {} {} a.png", keyword, option, arguments);
        CAPTURE(statement);
        const CapturedLog lost;
        const MtlMaterial mapped = load(statement);
        CHECK((mapped.map_kd || mapped.map_d || mapped.norm));
        CHECK(lost.warnings() == 1);
        CHECK_THAT(lost.text(),
                   Contains(fmt::format("not applied: {} {} (1, first at mesh.mtl:3)", keyword, option)));
    }
    CHECK(load("d -halo 0.5").material.opacity == 0.5);
    CHECK_THAT(log.text(), Contains("not applied: d -halo (1, first at mesh.mtl:3)"));
    CHECK_FALSE(load("map_Kd -clamp on").map_kd);
    CHECK_THAT(log.text(), Contains("not understood: map_Kd (1, first at mesh.mtl:3)"));
}

TEST_CASE("colours are linear unless they are said to be sRGB", "[mesh_io][mtl]") {
    const CapturedLog log;
    for (const MtlColor color : {MtlColor::Linear, MtlColor::Srgb}) {
        const auto decoded = [&](double x) { return color == MtlColor::Srgb ? srgbToLinear(x) : x; };
        CHECK(loadMaterial("Kd 0.5 0.5 0.5\n", color).material.reflectance == constantSpectrum(decoded(.5)));
        CHECK(loadMaterial("Kd 0 0 0\nKs 0.5\nillum 3\n", color).material.reflectance ==
              constantSpectrum(decoded(.5)));
        const MtlMaterial lamp = loadMaterial("Kd 0 0 0\nKe 0.5 0.5 0.5\n", color);
        REQUIRE(lamp.emission);
        CHECK_FALSE(lamp.emission->two_sided);
        CHECK(spectrumToXyz(lamp.emission->radiance)[1] == Approx(decoded(.5)).epsilon(1e-3));
        // Of a colour times a strength, the colour is decoded.
        const Vec3d strong = spectrumToXyz(loadMaterial("Ke 10 10 5\n", color).emission->radiance);
        const Vec3d expected = spectrumToXyz(rgbEmission({10, 10, 10 * decoded(.5)}));
        for (std::size_t k = 0; k < 3; ++k) CHECK(strong[k] == Approx(expected[k]).epsilon(1e-9));
    }
    CHECK_FALSE(loadMaterial("Ke 0 0 0\n").emission);
}

TEST_CASE("a colour of one number is grey, and one that is no colour is left out and said",
          "[mesh_io][mtl]") {
    const CapturedLog log;
    CHECK(loadMaterial("Kd 0.7\n").material.reflectance == constantSpectrum(.7));
    CHECK(log.warnings() == 0);
    CHECK(loadMaterial("Kd 0.25 # dark\n").material.reflectance == constantSpectrum(.25));
    CHECK(loadMaterial("kd 0.7 0.7 0.7\n").material.reflectance == constantSpectrum(.7));
    CHECK(log.warnings() == 0);
    CHECK(loadMaterial("Kd spectral blue.rfl 0.9\n").material.reflectance == constantSpectrum(.6));
    CHECK_THAT(log.text(),
               Contains("no Kd read as grey 0.6 (1); not understood: Kd spectral (1, first at mesh.mtl:3)"));
    CHECK(loadMaterial("Kd xyz 0.1 0.2 0.3\n").material.reflectance == constantSpectrum(.6));
    CHECK_THAT(log.text(), Contains("not understood: Kd xyz (1, first at mesh.mtl:3)"));
    CHECK(loadMaterial("Kd 2 2 2\n").material.reflectance == constantSpectrum(1));
    CHECK_THAT(log.text(), Contains("Kd above 1 clamped (1)"));
}

TEST_CASE("one line says what the materials of a file became and lost", "[mesh_io][mtl]") {
    const TemporaryFolder folder;
    std::string mtl, faces;
    for (int i = 0; i < 22; ++i)
        mtl += fmt::format(
            "newmtl wall{}\nKd 0.5 0.5 0.5\nKs 0.1 0.1 0.1\nNs 10\nNi 1\nd 0\nillum 2\nmap_Kd wall.png\n",
            i);
    for (int i = 0; i < 3; ++i)
        mtl += fmt::format("newmtl glass{}\nKd 1 1 1\nNi 1.5\nd 0.2\nTf 0.9 1 0.9\nillum 7\n", i);
    mtl += "newmtl lamp\nKe 5 5 5\nnewmtl chrome\nKd 0.9 0.9 0.9\nPm 0.8\nPr 0.3\nPs 0\nPc 0.5\n";
    for (int i = 0; i < 22; ++i) faces += fmt::format("usemtl wall{}\nf 1 2 3\n", i);
    faces +=
        "usemtl glass0\nf 1 2 3\nusemtl glass1\nf 1 2 3\nusemtl glass2\nf 1 2 3\nusemtl lamp\nf 1 2 "
        "3\nusemtl chrome\nf 1 2 3\n";
    folder.write("m.mtl", mtl);
    const CapturedLog log;
    loadObj(folder.write("mesh.obj", "mtllib m.mtl\n" + kSquare + faces));
    CHECK(log.warnings() == 1);
    CHECK_THAT(log.text(),
               Contains("mesh.obj: 27 materials: 23 diffuse, 1 mirror, 3 glass, 1 of them emitting; d 0 "
                        "without Ni above 1 read as opaque (22), d between 0 and 1 with Ni above 1 read as "
                        "clear glass (3), Pm from 0.5 to 1 read as 1 (1); "
                        "dropped: Ks (22), Ns (22), map_Kd (22), Tf (3), Pc (1), Pr (1); the image "
                        "'wall.png' does not exist\n"));
}

TEST_CASE("every documented keyword of an MTL is known and every other is said to be unknown",
          "[mesh_io][mtl]") {
    std::string all;
    for (const MtlKey& key : mtlKeys()) {
        CAPTURE(key.keyword);
        CHECK(findMtlKey(key.keyword) == &key);
        for (const std::string& alias : key.aliases) CHECK(findMtlKey(alias) == &key);
        CHECK_FALSE(key.doc.empty());
        if (key.keyword != "crt_reflectance") all += key.keyword + " 1 1 1\n";
    }
    const CapturedLog log;
    loadMaterial(all);
    CHECK_THAT(log.text(), !Contains("unknown"));
    loadMaterial("Kx 1 1 1\n");
    CHECK_THAT(log.text(), Contains("unknown: Kx (1)"));
    const std::string manual = sceneReferenceMarkdown();
    for (const MtlKey& key : mtlKeys()) CHECK_THAT(manual, Contains("| `" + key.keyword + "`"));
}

TEST_CASE("crt_reflectance names a measured spectrum beside the MTL", "[mesh_io][mtl]") {
    const TemporaryFolder folder;
    folder.write("paint.spd", "400 0.1\n700 0.7\n");
    folder.write("wrong.spd", "400 0.1\n700 1.7\n");
    folder.write("mesh.mtl",
                 "newmtl m\nKd 1 0 0\ncrt_reflectance paint.spd\nnewmtl w\ncrt_reflectance\twrong.spd\n");
    const std::string head = "mtllib mesh.mtl\n" + kSquare;
    const LoadedMesh m = loadObj(folder.write("mesh.obj", head + "usemtl m\nf 1 2 3\n"));
    const Spectrum& paint = m.materials.at(0).mtl->material.reflectance;
    CHECK(valueAt(paint, 550) == Approx(.4));
    CHECK(valueAt(paint, 800) == .7);
    CHECK(m.files.size() == 3);
    CHECK_THROWS_WITH(loadObj(folder.write("wrong.obj", head + "usemtl w\nf 1 2 3\n")), Contains("[0, 1]"));
}
