// Shared parts of scenes: files that they include, and named data.
#include "captured_log.h"
#include "catch.h"
#include "base/temporary_folder.h"
#include "scene/yaml/scene_yaml.h"
#include "spectra/data_catalogue.h"
#include "spectra/spectra_data.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

using namespace crt;
using crt::test::CapturedLog;
using crt::TemporaryFolder;

namespace {

void write(const TemporaryFolder& folder, const std::string& name, const std::string& text) {
    const std::filesystem::path path = std::filesystem::path(folder.path()) / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text;
}

Scene load(const TemporaryFolder& folder, const std::string& name,
           const std::vector<SceneOverride>& overrides = {}) {
    return loadScene((std::filesystem::path(folder.path()) / name).string(), overrides);
}

std::string refused(const TemporaryFolder& folder, const std::string& name,
                    const std::vector<SceneOverride>& overrides = {}) {
    try {
        load(folder, name, overrides);
    } catch (const Error& error) {
        CHECK(error.kind() == ErrorKind::Scene);
        return error.what();
    }
    FAIL("accepted: " << name);
    return {};
}

const char* const kRoom = R"(crt: 1
title: room
film: {resolution: [8, 4], exposure_ev: 2}
spectra:
  paint: 0.5
  other: 0.25
materials:
  wall: {type: diffuse, reflectance: paint}
  spare: {type: diffuse, reflectance: other}
objects:
  - {name: floor, mesh: {positions: [[0, 0, 0], [1, 0, 0], [0, 0, 1]], faces: [[0, 1, 2]]}, material: wall}
environment: {radiance: 1}
outputs: [{file: room.exr}, {file: room.png}]
)";

}  // namespace

TEST_CASE("an included scene counts as if it stood there", "[sharing]") {
    TemporaryFolder folder;
    write(folder, "shared/room.yaml", kRoom);
    write(folder, "a.yaml", R"(crt: 1
include: shared/room.yaml
film: {exposure_ev: 1}
spectra: {paint: 0.75, extra: 0.125}
objects:
  - {name: box, mesh: {positions: [[0, 1, 0], [1, 1, 0], [0, 1, 1]], faces: [[0, 1, 2]]}, material: wall}
environment: null
outputs: [{file: a.exr}]
)");
    CapturedLog log;
    const Scene scene = load(folder, "a.yaml");

    // Sections key by key, the including file first.
    CHECK(scene.title == "room");
    CHECK(scene.film.width == 8);
    CHECK(scene.film.exposure_ev == 1);
    // Objects of both, the included ones first; outputs and null of the scene alone.
    REQUIRE(scene.objects.size() == 2);
    CHECK(scene.objects[0].name == "floor");
    CHECK(scene.objects[1].name == "box");
    CHECK_FALSE(scene.environment.has_value());
    REQUIRE(scene.outputs.size() == 1);
    CHECK(scene.outputs[0].file == "a.exr");
    // A name of the including file replaces that of the included one wherever it is used.
    REQUIRE_FALSE(scene.materials.empty());
    CHECK(scene.materials[0].reflectance[0] == 0.75);

    // Both are read, so that no output replaces either.
    REQUIRE(scene.files_read.size() == 2);
    CHECK_THAT(scene.files_read[1], Contains("shared/room.yaml"));
    // Unused definitions of the scene itself are a warning; a shared file is there to be chosen from.
    CHECK_THAT(log.text(), Contains("'extra' is not used"));
    CHECK_THAT(log.text(), !Contains("'other'"));
    CHECK_THAT(log.text(), !Contains("'spare'"));
}

TEST_CASE("of several included files the later one wins, and each counts once", "[sharing]") {
    TemporaryFolder folder;
    write(folder, "base.yaml", kRoom);
    write(folder, "b.yaml", "crt: 1\ninclude: base.yaml\nfilm: {exposure_ev: 3}\ntitle: b\n");
    write(folder, "c.yaml", "crt: 1\ninclude: base.yaml\nfilm: {exposure_ev: 4}\n");
    write(folder, "main.yaml", "crt: 1\ninclude: [b.yaml, c.yaml]\n");
    const Scene scene = load(folder, "main.yaml");
    CHECK(scene.film.exposure_ev == 4);
    CHECK(scene.title == "b");
    CHECK(scene.objects.size() == 1);
    CHECK(scene.files_read.size() == 4);

    // --set changes what they say together, and cannot change which they are.
    CHECK(load(folder, "main.yaml", {{"film.exposure_ev", "5"}}).film.exposure_ev == 5);
    CHECK(load(folder, "main.yaml", {{"objects.0.name", "ground"}}).objects[0].name == "ground");
    CHECK_THAT(refused(folder, "main.yaml", {{"include", "b.yaml"}}), Contains("cannot change 'include'"));
}

TEST_CASE("what the including file gives takes away what it excludes", "[sharing]") {
    TemporaryFolder folder;
    write(folder, "lens.yaml", "crt: 1\ncamera: {position: [0, 0, -5], focal_length: 1, sensor: [1, 1]}\n");
    write(folder, "angle.yaml", "crt: 1\ncamera: {position: [0, 0, -5], fov: 90}\n");
    write(folder, "a.yaml", "crt: 1\ninclude: lens.yaml\nfilm: {resolution: [8, 8]}\ncamera: {fov: 90}\n");
    const Scene wide = load(folder, "a.yaml");
    CHECK(wide.camera.tan_half_width == Approx(1));
    CHECK(wide.camera.position[2] == -5);
    write(folder, "b.yaml", "crt: 1\ninclude: angle.yaml\nfilm: {resolution: [8, 8]}\n"
                            "camera: {focal_length: 1, sensor: [1, 1]}\n");
    CHECK(load(folder, "b.yaml").camera.tan_half_width == Approx(0.5));
    // Given by one file, they still exclude each other.
    write(folder, "c.yaml",
          "crt: 1\ninclude: lens.yaml\ncamera: {fov: 90, focal_length: 1, sensor: [1, 1]}\n");
    CHECK_THAT(refused(folder, "c.yaml"), Contains("exclude each other"));
}

TEST_CASE("names in an included file are looked up beside it", "[sharing]") {
    TemporaryFolder folder;
    write(folder, "lib/paint.csv", "360,0.5\n830,0.5\n");
    write(folder, "lib/room.yaml", "crt: 1\nenvironment: {radiance: {file: paint.csv}}\n");
    write(folder, "lib/deep/more.yaml", "crt: 1\ninclude: ../room.yaml\n");
    write(folder, "main.yaml", "crt: 1\ninclude: lib/deep/more.yaml\n");
    const Scene scene = load(folder, "main.yaml");
    REQUIRE(scene.environment.has_value());
    CHECK(scene.environment->radiance[0] == 0.5);
}

TEST_CASE("errors of included files have their file, line and column", "[sharing]") {
    TemporaryFolder folder;
    write(folder, "room.yaml", "crt: 1\nfilm:\n  resolutoin: [8, 4]\n");
    write(folder, "main.yaml", "crt: 1\ninclude: room.yaml\ncamera: {fov: 200}\n");
    const std::string text = refused(folder, "main.yaml");
    CHECK_THAT(text, Contains("room.yaml:3:3: error: unknown key 'resolutoin'"));
    CHECK_THAT(text, Contains("did you mean 'resolution'?"));
    // Those of the scene itself come first, whatever their line.
    CHECK(text.find("main.yaml:3:15: error: 'fov' is 200") < text.find("room.yaml:3:3"));

    write(folder, "main.yaml", "crt: 1\ninclude: rom.yaml\n");
    CHECK_THAT(refused(folder, "main.yaml"), Contains("main.yaml:2:10: error: cannot find 'rom.yaml'") &&
                                                 Contains("did you mean 'room.yaml'?"));
    write(folder, "main.yaml", "crt: 1\ninclude: [room.yaml, 3]\n");
    CHECK_THAT(refused(folder, "main.yaml"), Contains("main.yaml:2:22: error: expected text for 'include'"));
    write(folder, "room.yaml", "title: no version\n");
    write(folder, "main.yaml", "crt: 1\ninclude: room.yaml\n");
    CHECK_THAT(refused(folder, "main.yaml"), Contains("room.yaml:1:1: error: 'crt' is missing"));
    write(folder, "room.yaml", "crt: 2\n");
    CHECK_THAT(refused(folder, "main.yaml"), Contains("room.yaml:1:6: error: 'crt' is 2"));
    write(folder, "room.yaml", "[1, 2]\n");
    CHECK_THAT(refused(folder, "main.yaml"), Contains("room.yaml:1:1: error: an included file is a scene"));
    write(folder, "room.yaml", "");
    CHECK_THAT(refused(folder, "main.yaml"), Contains("room.yaml: error: there is nothing in this file"));
}

TEST_CASE("files that include themselves are refused", "[sharing]") {
    TemporaryFolder folder;
    write(folder, "main.yaml", "crt: 1\ninclude: a.yaml\n");
    write(folder, "a.yaml", "crt: 1\ninclude: sub/../main.yaml\n");
    std::filesystem::create_directories(std::filesystem::path(folder.path()) / "sub");
    CHECK_THAT(refused(folder, "main.yaml"),
               Contains("a.yaml:2:10: error:") && Contains("includes itself"));

    for (int i = 0; i < 20; ++i)
        write(folder, fmt::format("deep{}.yaml", i), fmt::format("crt: 1\ninclude: deep{}.yaml\n", i + 1));
    write(folder, "deep20.yaml", "crt: 1\n");
    CHECK_THAT(refused(folder, "deep0.yaml"), Contains("included more than 16 deep"));
}

TEST_CASE("named data are the tables that they say they are", "[sharing]") {
    const auto radiance = [](const std::string& form) {
        const Scene scene =
            parseScene("crt: 1\nenvironment: {radiance: " + form + "}\n", "scene.yaml", ".");
        return scene.environment->radiance;
    };
    // A spectrum with a separate form is the same under its name.
    CHECK(radiance("{data: illuminants/F11}") == radiance("{illuminant: F11}"));
    CHECK(radiance("{data: glasses/SF10, scale: 2}") == radiance("{glass: SF10, scale: 2}"));
    CHECK(radiance("{data: metals/Au/n}") == metalIndex("Au")->first);
    CHECK(radiance("{data: metals/copper/k}") == metalIndex("Cu")->second);
    // The lamp as Cornell published it: 0, 8, 15.6 and 18.4 at 400, 500, 600 and 700 nm, linear between.
    const Spectrum lamp = radiance("{data: cornell/lamp}");
    CHECK(lamp[0] == 0);
    CHECK(lamp[500 - 360] == 8);
    CHECK(lamp[550 - 360] == Approx(11.8));
    CHECK(lamp[470] == 18.4);

    // A file of the catalogue is noted as read.
    const Scene scene =
        parseScene("crt: 1\nenvironment: {radiance: {data: cornell/white}}\n", "scene.yaml", ".");
    REQUIRE(scene.files_read.size() == 1);
    CHECK_THAT(scene.files_read[0], Contains("share/crt/data/cornell/white.csv"));
}

TEST_CASE("the paints have the colours of their chart", "[sharing]") {
    // Published sRGB of the patches (X-Rite, ColorChecker Classic, for D50), in linear light. The tables
    // were measured on another chart: a few per cent of difference are those of the charts, a wrong row is
    // not.
    struct Patch {
        const char* name;
        std::array<int, 3> srgb;
    };
    for (const Patch& patch : {Patch{"dark_skin", {115, 82, 68}}, {"blue_sky", {98, 122, 157}},
                               {"orange", {214, 126, 44}}, {"green", {70, 148, 73}}, {"red", {175, 54, 60}},
                               {"yellow", {231, 199, 31}}, {"neutral_5", {122, 122, 121}}}) {
        INFO(patch.name);
        const auto paint = dataSpectrum(std::string("paints/") + patch.name);
        REQUIRE(paint);
        Spectrum lit = *illuminantSpectrum("D65");
        for (std::size_t i = 0; i < lit.values.size(); ++i) lit[i] *= paint->spectrum[i];
        const Vec3d rgb = multiply(xyzToRgb(ColorSpace::LinearSrgb), spectrumToXyz(lit));
        for (std::size_t c = 0; c < 3; ++c)
            CHECK(linearToSrgb(std::max(rgb[c], 0.0)) * 255 == Approx(patch.srgb[c]).margin(9));
    }
}

TEST_CASE("every row of the catalogue has a source, a quantity and a spectrum", "[sharing]") {
    const std::vector<std::string> names = dataNames();
    CHECK(names.size() >= 4 + 24 + 6 + 7 + 4);
    for (const std::string& name : names) {
        INFO(name);
        const auto row = findData(name);
        REQUIRE(row);
        CHECK(row->source.size() > 20);
        CHECK_FALSE(row->quantity.empty());
        CHECK(row->columns.size() == row->values.size());
        for (const std::vector<double>& column : row->values)
            CHECK(column.size() == row->wavelength_nm.size());
        CHECK(std::is_sorted(row->wavelength_nm.begin(), row->wavelength_nm.end()));
    }
    for (const std::string& name : dataSpectrumNames()) {
        INFO(name);
        const auto found = dataSpectrum(name);
        REQUIRE(found);
        CHECK(found->spectrum.min() >= 0);
        if (name.starts_with("paints/") || name == "cornell/white") CHECK(found->spectrum.max() < 1);
    }
}

TEST_CASE("data that there are not are refused with the nearest name", "[sharing]") {
    const auto said = [](const std::string& name) {
        try {
            parseScene("crt: 1\nenvironment: {radiance: {data: " + name + "}}\n", "scene.yaml", ".");
        } catch (const Error& error) {
            return std::string(error.what());
        }
        return std::string("accepted");
    };
    CHECK_THAT(said("cornell/whit"), Contains("scene.yaml:2:32: error: there is no data set "
                                              "'cornell/whit'") &&
                                         Contains("did you mean 'cornell/white'?"));
    CHECK_THAT(said("metals/Ag"), Contains("write metals/Ag/n or metals/Ag/k"));
    CHECK_THAT(said("metals/Unobtainium/n"), Contains("there is no data set"));
    // A name never leads out of the folders of data.
    for (const char* name : {"../data/cornell/white", "cornell/../cornell/white", "/etc/passwd", "cornell",
                             "cornell/white/n", "cornell//white", "'cornell/.white'"})
        CHECK_THAT(said(name), Contains("there is no data set"));
}

TEST_CASE("folders of CRT_DATA_PATH add families, with the header that data must have", "[sharing]") {
    TemporaryFolder folder;
    const std::string header =
        "# Grey\n# source: measured on Monday\n# quantity: reflectance\n# outside: clamp\n";
    write(folder, "root/mine/grey.csv", header + "400,0.5\n700,0.5\n");
    // A comment line that begins with two blanks continues the one before.
    write(folder, "root/mine/wrapped.csv",
          "# Grey,\n#   still\n# source: measured\n#  on Tuesday\r\n#    and again\n"
          "# quantity: reflectance\n# outside: clamp\n400,0.5\n700,0.5\n");
    write(folder, "root/mine/nameless.csv", "400,0.5\n700,0.5\n");
    write(folder, "root/mine/open.csv", "# x\n# source: y\n# quantity: z\n400,0.5\n700,0.5\n");
    write(folder, "beside.csv", header + "400,0.5\n700,0.5\n");
    setenv("CRT_DATA_PATH", (folder / "root").c_str(), 1);
    CHECK_FALSE(findData("../beside"));
    CHECK_FALSE(dataSpectrum("../beside"));
    const std::vector<std::string> names = dataNames();
    CHECK(std::count(names.begin(), names.end(), "mine/grey") == 1);
    CHECK(std::count(names.begin(), names.end(), "cornell/white") == 1);
    const auto grey = findData("mine/grey");
    REQUIRE(grey);
    CHECK(grey->title == "Grey");
    CHECK(grey->source == "measured on Monday");
    CHECK(dataSpectrum("mine/grey")->spectrum == constantSpectrum(0.5));
    const auto wrapped = findData("mine/wrapped");
    REQUIRE(wrapped);
    CHECK(wrapped->title == "Grey, still");
    CHECK(wrapped->source == "measured on Tuesday and again");
    CHECK(wrapped->quantity == "reflectance");
    CHECK_THROWS_WITH(findData("mine/nameless"), Contains("'# source: …'"));
    CHECK_THROWS_WITH(findData("mine/open"), Contains("'# outside: clamp'"));
    unsetenv("CRT_DATA_PATH");
}
