// The results of the host do not depend on the number of its threads, nor on how a file is cut into blocks.
#include "base/error.h"
#include "base/listener.h"
#include "base/log.h"
#include "base/parallel.h"
#include "base/stage.h"
#include "captured_log.h"
#include "catch.h"
#include "compile/compile.h"
#include "film/film_pack.h"
#include "film/resolve.h"
#include "base/temporary_folder.h"
#include "scene/mesh/obj_reader.h"
#include "scene/yaml/scene_yaml.h"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <set>
#include <thread>
#include <tuple>
#include <vector>

using namespace crt;
using crt::test::CapturedLog;
using crt::TemporaryFolder;

namespace {

constexpr unsigned kThreads[] = {1, 2, 3, 16};

/// A wavy sheet of 2 (n − 1)² triangles with normals and two materials that take turns; in every eleventh
/// row indices count backwards, and some triangles have no area.
std::string sheet(int n) {
    std::string text = "mtllib sheet.mtl\n";
    const auto height = [](int i, int j) { return 0.05 * std::sin(0.3 * i) * std::cos(0.2 * j); };
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i)
            text += fmt::format("v {} {:.7g} {}\nvn {:.6g} 1 {:.6g}\n", i * 0.01, height(i, j), j * 0.01,
                                0.1 * std::cos(0.3 * i), 0.1 * std::sin(0.2 * j));
    const int all = n * n;
    for (int j = 0; j + 1 < n; ++j) {
        if (j % 7 == 0) text += fmt::format("usemtl {}\n", j % 2 == 0 ? "red" : "blue");
        for (int i = 0; i + 1 < n; ++i) {
            const int back = j % 11 == 0 ? all + 1 : 0;
            const int a = j * n + i + 1 - back, b = a + n, c = a + 1, d = b + 1;
            text += fmt::format("f {0}//{0} {1}//{1} {2}//{2}\nf {2}//{2} {1}//{1} {3}//{3}\n", a, b, c, d);
            if (i % 50 == 0) text += fmt::format("f {0} {0} {1}\n", a, b);
        }
    }
    return text;
}

std::string sceneOf(const TemporaryFolder& folder) {
    folder.write("sheet.obj", sheet(230));
    folder.write("sheet.mtl", "newmtl blue\nKd 0.1 0.2 0.9\nnewmtl red\nKd 0.9 0.1 0.1\n");
    return folder.write("scene.yaml",
                        "crt: 1\ncamera: {position: [1, 3, 5], target: [1, 0, 1], fov: 40}\n"
                        "materials: {grey: {type: diffuse, reflectance: 0.5}}\nobjects:\n"
                        "  - {obj: sheet.obj}\n"
                        "  - {obj: sheet.obj, transform: [{translate: [0, 0.5, 0]}, {scale: [-1, 1, 1]}]}\n"
                        "  - {mesh: {positions: [[0,2,0],[1,2,0],[1,2,1],[0,2,1]], faces: [[0,1,2,3]]}, "
                        "material: grey, emission: {radiance: 5}}\n");
}

struct Made {
    std::vector<unsigned char> blob;
    std::string hash;
};

Made makeWith(unsigned threads, const std::string& path, double reach) {
    Made made;
    runWithThreads(threads, [&] {
        const CompiledScene compiled =
            compileScene(loadScene(path), 0xffffffffu, {.accelerator_reach = reach});
        made = {{compiled.data(), compiled.data() + compiled.size_bytes}, compiled.hash};
    });
    return made;
}

}  // namespace

TEST_CASE("any number of threads compiles a scene to the same bytes", "[threads]") {
    const CapturedLog log;
    const TemporaryFolder folder;
    const std::string path = sceneOf(folder);
    for (const double reach : {0.0, 1e9}) {
        const Made one = makeWith(1, path, reach);
        REQUIRE(one.blob.size() > 10'000'000);
        for (const unsigned threads : kThreads) {
            CAPTURE(threads, reach);
            const Made made = makeWith(threads, path, reach);
            CHECK(made.hash == one.hash);
            CHECK((made.blob == one.blob));  // not written out where it fails
        }
    }
}

TEST_CASE("any number of threads packs and resolves a film to the same bytes", "[threads]") {
    Film film({301, 257, channelsFor(kAovSquares | kAovPrimitive | kAovVariance, 1),
               kAovSquares | kAovPrimitive | kAovVariance});
    film.samples.add({0, 7});
    for (std::size_t i = 0; i < film.sums.size(); ++i) film.sums[i] = std::sin(0.1 * static_cast<double>(i));
    for (std::uint64_t& n : film.counts) n = 7;
    const auto make = [&](unsigned threads) {
        std::vector<unsigned char> packed;
        Image image;
        runWithThreads(threads, [&] {
            packed = packFilm(film);
            image = resolveImage(film, {}, kAovPrimitive | kAovVariance);
        });
        return std::tuple(
            packed, image.pixels.size(), image.integers,
            std::vector<unsigned char>(
                reinterpret_cast<const unsigned char*>(image.pixels.data()),
                reinterpret_cast<const unsigned char*>(image.pixels.data() + image.pixels.size())));
    };
    const auto one = make(1);
    for (const unsigned threads : kThreads) {
        CAPTURE(threads);
        CHECK((make(threads) == one));
    }
    Film unpacked(film.shape());
    REQUIRE(unpackFilm(std::get<0>(one), unpacked));
    CHECK((unpacked.sums == film.sums));
}

namespace {

/// All that an OBJ says, in one text.
std::string contentsOf(const std::string& text, std::size_t block_bytes) {
    Stage stage("reading");
    try {
        const ObjContents obj = readObj(text, "a.obj", stage, block_bytes);
        std::string all;
        for (const auto* vectors : {&obj.positions, &obj.normals}) {
            for (const Vec3d& v : *vectors) all += fmt::format("{} {} {}\n", v[0], v[1], v[2]);
            all += "--\n";
        }
        const auto nameOf = [&](std::int32_t part) {
            if (part < 0) return std::string("none");
            const MeshPart& names = obj.parts.at(static_cast<std::size_t>(part));
            return fmt::format("{}/{}", names.group, names.object);
        };
        for (const ObjBlock& block : obj.blocks) {
            std::size_t run = 0;
            for (std::size_t i = 0; i < block.faces.size(); ++i) {
                const ObjFace& face = block.faces[i];
                if (run + 1 < block.runs.size() && block.runs[run + 1].first_face == i) ++run;
                all += fmt::format("line {} material {} part {}:", face.line, block.runs.at(run).material,
                                   nameOf(block.runs[run].part));
                for (std::uint32_t c = 0; c < face.corner_count; ++c) {
                    const ObjCorner& corner = block.corners[face.first_corner + c];
                    all += fmt::format(" {}//{}", corner.position, corner.normal);
                }
                all += '\n';
            }
        }
        for (const std::string& name : obj.material_names) all += name + '\n';
        for (const auto& library : obj.libraries)
            all += fmt::format("{} {}\n", library.line, library.arguments);
        for (const MeshLoss* loss : {&obj.bad_positions, &obj.bad_normals, &obj.small_faces})
            all += fmt::format("{} {} {}\n", loss->count, loss->line, loss->sentence);
        return all + fmt::format("{} {} {} {}", obj.lines, obj.points, obj.free_forms, obj.vertex_colors);
    } catch (const Error& error) {
        return fmt::format("line {}: {}", error.place().line, error.what());
    }
}

}  // namespace

TEST_CASE("an OBJ says the same in blocks of any size", "[threads]") {
    const std::string vertices = "v 0 0 0\nv 1 0 0\r\nv 0 1 0\rv 1 1 0 0.5 0.5 0.5\nvn 0 0 1\n";
    const std::string texts[] = {
        "\xEF\xBB\xBF" + vertices + "mtllib a.mtl\nusemtl one\nf 1 2 3\nusemtl two\nf 2//1 3//1 4//-1\n",
        vertices +
            "f -1 -2 -3\nv 2 2 2\nf -1 -2 -3\n# \\\nf 1 2 \\\n 3 \\\n 4\nusemtl a\nl 1 2\np 1\nf 1 2\n",
        vertices + "usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\nusemtl a\nf 1 2 3\n" + vertices +
            "f 5 6 7 8\nf -1 -2 -4\n",
        vertices +
            "\xEF\xBB\xBFv 3 3 3\nmtllib a.mtl\nmtllib b.mtl\nmtllib a.mtl\n"
            "v nan 1 2\nvn x 1 2\nv 1\nf 1 2 5\n",
        vertices + "f 1 2 3\ng a b\nf 1 2 3\no c\nf 1 2 3\nusemtl m\nf 1 2 3\ng\nf 1 2 3\ng a b\nf 1 2 3\n",
        vertices + "f 1 2 3\nf 1 2 9\nf 1 2 x\n",     // what cannot be read goes before what is missing
        vertices + "f 1 2 3\nf -1 -2 -9\nf 1 2 x\n",  // in the order of lines
        vertices + "f 1 2 3\nf 1 2 99999999999\nf 1 2 9\n",
        vertices + "f 1 2 3\nf 1//9 2//-9 3//99999999999\nf 1 2 9\n",
        vertices + "f 1 2 3\nf 0 1 2\nf -1 -2 -99999999999\n",
    };
    for (const std::string& text : texts) {
        CAPTURE(text);
        const std::string whole = contentsOf(text, text.size() + 1);
        for (std::size_t block = 1; block < text.size(); ++block) {
            CAPTURE(block);
            REQUIRE(contentsOf(text, block) == whole);
        }
    }
    CHECK(contentsOf(texts[5], 1).starts_with("line 8: 'x' is not a face corner"));
    CHECK(contentsOf(texts[6], 1).starts_with("line 7: a face uses vertex -9, but only 4 vertices precede "
                                              "it"));
    CHECK(
        contentsOf(texts[7], 1).starts_with("line 7: a face uses vertex 99999999999, but the file has 4"));
}

TEST_CASE("work in parts covers everything once, and its exception arrives", "[threads]") {
    for (const unsigned threads : kThreads)
        runWithThreads(threads, [&] {
            std::vector<int> visits(10'007);
            parallelFor(visits.size(), 100, [&](std::size_t first, std::size_t end) {
                for (std::size_t i = first; i < end; ++i) ++visits[i];
            });
            CHECK(std::set<int>(visits.begin(), visits.end()) == std::set<int>{1});
            CHECK_THROWS_AS(parallelFor(1000, 10,
                                        [](std::size_t first, std::size_t) {
                                            if (first == 500) throw Error(ErrorKind::Scene, "no");
                                        }),
                            Error);
        });
}

TEST_CASE("threads are as many as are asked for", "[threads]") {
    const auto given_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    for (const unsigned threads : {1u, 2u, 5u}) {
        std::atomic<int> at_work{0}, most{0};
        runWithThreads(threads, [&] {
            parallelFor(64, 1, [&](std::size_t, std::size_t) {
                const int now = ++at_work;
                for (int before = most; before < now && !most.compare_exchange_weak(before, now);) {}
                // A busy machine may give the second thread its turn late.
                while (threads > 1 && most == 1 && std::chrono::steady_clock::now() < given_up)
                    std::this_thread::yield();
                std::this_thread::sleep_for(std::chrono::milliseconds(2));
                --at_work;
            });
        });
        CHECK(most <= static_cast<int>(threads));
        CHECK((most > 1) == (threads > 1));
    }
}

TEST_CASE("messages of parallel work reach the listener of whoever asked for it", "[threads]") {
    constexpr int kMessages = 2000;
    const Listener outer([](LogLevel, std::string_view) {});
    const ListenerScope outer_scope(outer);
    const Listener inner([](LogLevel, std::string_view) {});
    {
        const ListenerScope inner_scope(inner);
        runWithThreads(4, [] {
            parallelFor(kMessages, 1, [](std::size_t, std::size_t) { logWarning("from a part"); });
            parallelInvoke([] { logWarning("from one"); }, [] { logWarning("from the other"); });
        });
    }
    CHECK(inner.warnings() == kMessages + 2);
    CHECK(outer.warnings() == 0);
}
