// Bounds of external input: files that never end, outputs that would destroy something, geometry and light
// that arithmetic cannot carry. Of code: unit_trust.cpp.
#include "base/atomic_file.h"
#include "base/error.h"
#include "base/input_file.h"
#include "base/vec3d.h"
#include "catch.h"
#include "compile/compile.h"
#include "compile/near_surfaces.h"
#include "film/checkpoint.h"
#include "image/image_io.h"
#include "processor_time.h"
#include "refusal.h"
#include "base/temporary_folder.h"
#include "render/output_guard.h"
#include "scene/mesh/mesh_io.h"
#include "scene/mesh/triangulate.h"
#include "scene/yaml/scene_yaml.h"

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>

using namespace crt;
using crt::TemporaryFolder;
using crt::test::kSecondsAllowed;
using crt::test::refusal;
using crt::test::secondsOf;
namespace fs = std::filesystem;

namespace {

Film filmOf(std::uint64_t samples) {
    Film film({2, 1, channelsFor(0, 1), 0});
    film.samples.add({0, samples});
    for (std::uint64_t& count : film.counts) count = samples;
    return film;
}

const FilmIdentity kIdentity{"0123456789abcdef0123456789abcdef", "1.0"};

}  // namespace

// ---- Input files ----------------------------------------------------------------------------------------

TEST_CASE("only regular files are read, and a pipe is not waited for", "[limits][input]") {
    const TemporaryFolder folder;
    const std::string pipe = folder / "pipe";
    REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
    for (const auto& [file, what] : {std::pair{pipe, "is a pipe, not a regular file"},
                                     {std::string("/dev/zero"), "is a character device, not a regular file"},
                                     {folder.path(), "is a directory"}}) {
        CAPTURE(file);
        CHECK_THROWS_WITH(readInput(file, kMostSceneBytes), Contains(what));
        CHECK_THROWS_WITH(loadScene(file), Contains(what));
        CHECK_THROWS_WITH(loadObj(file), Contains(what));
        CHECK_THROWS_WITH(readSpectrumFile(file, Outside::Clamp), Contains(what));
        CHECK_THROWS_WITH(readImage(file), Contains(what));
        CHECK_THROWS_WITH(readCheckpoint(file), Contains(what));
    }
    CHECK_THROWS_WITH(loadScene(pipe), Contains("write '-' for standard input"));
    const std::string mesh =
        folder.write("mesh.obj", "mtllib pipe\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n");
    // Ends: a wait for a writer of the pipe would never end.
    refusal([&] { loadObj(mesh); });
}

TEST_CASE("a file that is too large is refused by its size before it is read", "[limits][input]") {
    const TemporaryFolder folder;
    const std::string file = folder.write("sparse", "");
    fs::resize_file(file, std::uintmax_t{1} << 42);
    CHECK_THROWS_WITH(readInput(file, kMostSceneBytes),
                      Contains("has 4 TiB, and the most for a file of this kind is 256 MiB"));
    CHECK_THROWS_WITH(loadObj(file), Contains("has 4 TiB"));
    CHECK(readInput(folder.write("exact", "12345"), 5) == "12345");
    CHECK_THROWS_WITH(readInput(folder.write("more", "123456"), 5), Contains("has 6 bytes"));
    // A file whose size the system does not tell.
    CHECK_FALSE(readInput("/proc/self/status", 1 << 20).empty());
    CHECK_THROWS_WITH(readInput("/proc/self/status", 100), Contains("more than 100 bytes"));
}

// ---- Outputs --------------------------------------------------------------------------------------------

TEST_CASE("no output replaces an input or another output", "[limits][output]") {
    const TemporaryFolder folder;
    const std::string scene = folder.write("scene.yaml", "crt: 1\n"),
                      mesh = folder.write("mesh.obj", "v 0 0 0\n");
    fs::create_hard_link(mesh, folder / "hard.obj");
    fs::create_symlink("mesh.obj", folder / "soft.obj");
    const auto refused = [&](const std::vector<std::string>& outputs,
                             const std::vector<std::string>& films = {}) {
        return refusal([&] { refuseOverInputs({scene, mesh}, outputs, films); });
    };
    CHECK(refused({folder / "a.exr", folder / "a.png"}, {folder / "a.crtfilm"}).empty());
    CHECK_THAT(refused({scene}), Contains("would replace an input file"));
    CHECK_THAT(refused({folder.path() + "/./scene.yaml"}), Contains("they are the same file"));
    CHECK_THAT(refused({}, {folder / "hard.obj"}), Contains("they are the same file"));
    CHECK_THAT(refused({folder / "soft.obj"}), Contains("they are the same file"));
    CHECK_THAT(refused({folder / "a.exr", folder / "a.exr"}), Contains("two outputs have the same name"));
    CHECK_THAT(refused({folder / "a.exr"}, {folder.path() + "//a.exr"}), Contains("are the same file"));
    CHECK(refused({}, {folder / "a.crtfilm", folder / "a.crtfilm"}).empty());
}

TEST_CASE("a film of more samples stays", "[limits][output]") {
    const TemporaryFolder folder;
    const std::string film = folder / "c.crtfilm", other = folder.write("notes.txt", "not a film\n");
    writeCheckpoint(film, filmOf(16), kIdentity);
    FilmGuard guard;
    guard.look(film, true, false);
    guard.requireRoom(16);
    CHECK_THROWS_WITH(guard.requireRoom(15),
                      Contains("holds 16 samples per pixel and would be replaced by 15") &&
                          Contains("--resume") && Contains("--overwrite"));
    CHECK_THROWS_WITH(guard.look(other, true, false),
                      Contains("a film would replace") && Contains("--overwrite"));
    guard.look(other, true, true);
    CHECK(guard.placeFor(other, 1) == other);

    // On the way to 32 samples the first films are smaller than what is there.
    const std::string beside = guard.placeFor(film, 4);
    CHECK(beside == folder / "c.partial.crtfilm");
    writeCheckpoint(beside, filmOf(4), kIdentity);
    CHECK(guard.placeFor(film, 8) == beside);
    CHECK(guard.placeFor(film, 16) == film);
    guard.written(film);
    CHECK_FALSE(fs::exists(beside));
    CHECK(guard.placeFor(film, 1) == film);
}

TEST_CASE("an output link that leads to nothing yet stays a link", "[limits][output]") {
    const TemporaryFolder folder;
    fs::create_directory(folder / "store");
    fs::create_symlink("store/image.pfm", folder / "image.pfm");
    fs::create_symlink("absent/image.pfm", folder / "lost.pfm");
    fs::create_symlink("loop", folder / "loop");
    AtomicFile file(folder / "image.pfm");
    file.write("x", 1);
    file.commit();
    CHECK(fs::is_symlink(folder / "image.pfm"));
    CHECK(fs::file_size(folder / "store/image.pfm") == 1);
    CHECK_THROWS_WITH(AtomicFile(folder / "lost.pfm"), Contains("whose directory does not exist"));
    CHECK(fs::is_symlink(folder / "lost.pfm"));
    CHECK_THROWS_WITH(AtomicFile(folder / "loop"), Contains("leads to itself"));
}

TEST_CASE("a file whose name is as long as a name may be is written", "[limits][image_io]") {
    const TemporaryFolder folder;
    for (const std::size_t length : {std::size_t{230}, std::size_t{240}, std::size_t{255}}) {
        const std::string path = folder / std::string(length, 'x');
        AtomicFile file(path);
        file.write("text", 4);
        file.commit();
        CHECK(fs::file_size(path) == 4);
    }
}

// ---- Geometry and light ---------------------------------------------------------------------------------

TEST_CASE("forty thousand triangles on one spot are compiled in a second", "[limits][near_surfaces]") {
    Scene scene;
    scene.camera.position = {0, 0, -3};
    scene.materials.resize(1);
    scene.emissions = {{constantSpectrum(1), false}};
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles.assign(40000, {0, 1, 2});
    scene.meshes = {mesh};
    for (const std::int32_t emission : {-1, 0}) {
        CAPTURE(emission);
        Object object;
        object.material = 0;
        object.emission = emission;
        scene.objects = {object};
        CompiledScene compiled;
        const double seconds = secondsOf([&] { compiled = compileScene(scene, 0); });
        CHECK(seconds < kSecondsAllowed);
        CHECK(findNearSurfaces(compiled).asked > 0);
    }
}

TEST_CASE("a disc of forty thousand lamps that share a corner is looked at in a second",
          "[limits][near_surfaces]") {
    Scene scene;
    scene.camera.position = {0, 0, -3};
    scene.materials.resize(1);
    scene.emissions = {{constantSpectrum(1), false}};
    Mesh mesh;
    mesh.positions = {{0, 0, 0}};
    constexpr std::uint32_t kCorners = 40000;
    for (std::uint32_t i = 0; i < kCorners; ++i)
        mesh.positions.push_back({std::cos(i * 2 * std::numbers::pi / kCorners),
                                  std::sin(i * 2 * std::numbers::pi / kCorners), 0});
    for (std::uint32_t i = 0; i < kCorners; ++i)
        mesh.triangles.push_back({0, 1 + i, 1 + (i + 1) % kCorners});
    scene.meshes = {mesh};
    Object object;
    object.material = 0;
    object.emission = 0;
    scene.objects = {object};
    CHECK(secondsOf([&] { compileScene(scene, 0); }) < kSecondsAllowed);
}

TEST_CASE("a polygon of forty thousand corners becomes triangles in a second", "[limits][mesh]") {
    constexpr std::size_t kCorners = 40000;
    const auto spiral = [](double t) { return Vec3d{t * std::cos(40 * t), t * std::sin(40 * t), 0}; };
    for (const std::string shape : {"star", "comb", "spiral"}) {
        CAPTURE(shape);
        std::vector<Vec3d> polygon;
        for (std::size_t i = 0; i < kCorners; ++i) {
            const double t = static_cast<double>(i) / kCorners, angle = 2 * std::numbers::pi * t;
            const double radius = i % 2 == 0 ? 1.0 : 0.3;
            if (shape == "star") polygon.push_back({radius * std::cos(angle), radius * std::sin(angle), 0});
            if (shape == "comb")
                polygon.push_back(i + 2 < kCorners ? Vec3d{t, i % 2 == 0 ? 1.0 : 1e-3, 0}
                                                   : Vec3d{i + 2 == kCorners ? 1.0 : 0.0, -1, 0});
            // Out along one arm, and back beside it.
            if (shape == "spiral")
                polygon.push_back(t < 0.5 ? spiral(1 + 2 * t) : spiral(1 + 2 * (1 - t)) * 0.98);
        }
        Triangulator triangulator;
        double area = 0, turned = 0, whole = 0;
        const double seconds = secondsOf([&] {
            for (const PolygonTriangle& t : triangulator.split(polygon)) {
                const double twice = cross(polygon[t[1]] - polygon[t[0]], polygon[t[2]] - polygon[t[0]])[2];
                area += std::abs(twice) / 2;
                turned += twice / 2;
            }
        });
        for (std::size_t i = 0; i < kCorners; ++i)
            whole += cross(polygon[i], polygon[(i + 1) % kCorners])[2] / 2;
        CHECK(seconds < kSecondsAllowed);
        CHECK(triangulator.crossingPolygons() == 0);
        CHECK(triangulator.split(polygon).size() == kCorners - 2);
        CHECK(std::abs(turned) == Approx(area).epsilon(1e-9));  // none overlaps another
        CHECK(area == Approx(std::abs(whole)).epsilon(1e-9));
    }
}

TEST_CASE("a polygon is what its outline encloses, whatever goes out of it and back", "[limits]") {
    const std::vector<Vec3d> square{{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}};
    // Out and back: to a side, along an edge and beyond it, inwards, of several parts.
    const std::vector<std::vector<Vec3d>> spikes{
        {{4, 2, 0}, {9, 3, 0}, {4, 2, 0}},
        {{4, 2, 0}, {4, 9, 0}},
        {{4, 2, 0}, {1, 1, 0}, {4, 2, 0}},
        {{4, 2, 0}, {6, 2, 0}, {9, 2, 0}, {6, 2, 0}, {4, 2, 0}},
        {{4, 2, 0}, {6, 2, 0}, {6, 5, 0}, {6, 2, 0}, {4, 2, 0}},
    };
    for (std::size_t k = 0; k < spikes.size(); ++k)
        for (std::size_t first = 0; first < square.size() + spikes[k].size(); ++first)
            for (const bool clockwise : {false, true}) {
                std::vector<Vec3d> polygon = square;
                polygon.insert(polygon.begin() + 2, spikes[k].begin(), spikes[k].end());
                std::rotate(polygon.begin(), polygon.begin() + static_cast<std::ptrdiff_t>(first),
                            polygon.end());
                if (clockwise) std::reverse(polygon.begin(), polygon.end());
                Triangulator triangulator;
                double area = 0, turned = 0;
                for (const PolygonTriangle& t : triangulator.split(polygon)) {
                    const Vec3d &a = polygon[t[0]], &b = polygon[t[1]], &c = polygon[t[2]];
                    area += std::abs(cross(b - a, c - a)[2]) / 2;
                    turned += cross(b - a, c - a)[2] / 2;
                }
                INFO("spike " << k << ", from corner " << first << (clockwise ? ", clockwise" : ""));
                CHECK(area == Approx(16));
                CHECK(turned == Approx(clockwise ? -16 : 16));
            }
}

TEST_CASE("light beyond what floats carry is refused with its place", "[limits][radiance]") {
    const auto lit = [](const std::string& radiance, const std::string& environment = "") {
        return refusal([&] {
            parseScene("crt: 1\nmaterials: {m: {type: diffuse, reflectance: 0.5}}\n" + environment +
                           "objects:\n  - {name: lamp, mesh: {positions: [[0,0,0],[1,0,0],[0,1,0]], faces: "
                           "[[0,1,2]]}, material: m, emission: {radiance: " +
                           radiance + "}}\n",
                       "scene.yaml", ".");
        });
    };
    CHECK(lit("1e25").empty());
    CHECK(lit("1e-25").empty());
    CHECK(lit("0").empty());
    CHECK_THAT(lit("1e38"), Contains("scene.yaml:4:") && Contains("it must be 0 to 1e+25"));
    CHECK_THAT(lit("1e308"), Contains("it must be 0 to 1e+25"));
    CHECK_THAT(lit("{blackbody: 5000, scale: 1e30}"),
               Contains("reaches") && Contains("it must be 0 to 1e+25"));
    CHECK_THAT(lit("1e-50"), Contains("scene.yaml:4:5: error: the brightest light is 'lamp', with a "
                                      "radiance of 1e-50, and the smallest value in single precision is "
                                      "1e-25"));
    CHECK(lit("1e-50", "environment: {radiance: 1}\n").empty());

    const TemporaryFolder folder;
    folder.write("lamp.mtl", "newmtl lamp\nKe 1e30 1e30 1e30\n");
    folder.write("lamp.obj", "mtllib lamp.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl lamp\nf 1 2 3\n");
    CHECK_THAT(
        refusal([&] { parseScene("crt: 1\nobjects:\n  - {obj: lamp.obj}\n", "scene.yaml", folder.path()); }),
        Contains("scene.yaml:3:5: error: the radiance of a material (Ke)") &&
            Contains("the largest value in single precision is 1e+25"));
}
