// The generated meshes: exactly the promised triangles, closed, right side out, and the same bytes from
// every run.
#include "catch.h"
#include "base/temporary_folder.h"
#include "scene/mesh/mesh_io.h"
#include "file_bytes.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <map>
#include <sstream>

using namespace crt;

namespace {

const std::string kMeshgen = std::string("'") + CRT_BUILD_DIR + "/bin/crt-meshgen' ";
const std::string kMeshes = std::string(CRT_BUILD_DIR) + "/share/crt/meshes/";

Vec3d areaVector(const Mesh& m, const std::array<std::uint32_t, 3>& t) {
    return cross((m.positions[t[1]] - m.positions[t[0]]), (m.positions[t[2]] - m.positions[t[0]]));
}

/// Edges that are not met once from either side.
int openEdges(const Mesh& m) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> count;
    for (const auto& t : m.triangles)
        for (int i = 0; i < 3; ++i) ++count[{t[i], t[(i + 1) % 3]}];
    int open = 0;
    for (const auto& [edge, n] : count) {
        const auto back = count.find({edge.second, edge.first});
        open += n != 1 || back == count.end() || back->second != 1;
    }
    return open;
}

double volume(const Mesh& m) {
    double sum = 0;
    for (const auto& t : m.triangles)
        sum += dot(m.positions[t[0]], cross(m.positions[t[1]], m.positions[t[2]])) / 6;
    return sum;
}

/// Share of the surface whose vertex normals point out of it.
double agreement(const Mesh& m) {
    double good = 0, all = 0;
    for (std::size_t i = 0; i < m.triangles.size(); ++i) {
        const Vec3d n = areaVector(m, m.triangles[i]);
        for (const std::uint32_t v : m.normal_index[i]) {
            all += std::sqrt(dot(n, n));
            good += dot(n, m.normals[v]) > 0 ? std::sqrt(dot(n, n)) : 0;
        }
    }
    return good / all;
}

struct Expected {
    const char* file;
    std::size_t triangles;
    int open_edges;  ///< The figure lacks one triangle under its base; all else is closed.
    bool smooth;
    double volume;
};
constexpr Expected kExpected[] = {
    {"sphere.obj", 960, 0, true, 0.5152427},
    {"ball.obj", 16128, 0, true, 0.5231},
    {"figure.obj", 4745, 3, true, 0.150},
    {"dragon.obj", 100000, 0, true, 0.102},
    {"prism.obj", 8, 0, false, 1.1547005},
};

}  // namespace

TEST_CASE("generated meshes are what scenes expect", "[meshgen]") {
    for (const Expected& e : kExpected) {
        CAPTURE(e.file);
        const LoadedMesh loaded = loadObj(kMeshes + e.file);
        const Mesh& m = loaded.mesh;
        CHECK(m.triangles.size() == e.triangles);
        CHECK(loaded.degenerate_faces == 0);
        CHECK(loaded.materials.empty());
        CHECK(openEdges(m) == e.open_edges);
        CHECK(volume(m) == Approx(e.volume).epsilon(.02));

        // Stands on the ground, one unit high, centred.
        Vec3d low = m.positions[0], high = low;
        for (const Vec3d& p : m.positions)
            for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
        CHECK(low[1] == 0.0);
        CHECK(high[1] == 1.0);
        CHECK(low[0] + high[0] == Approx(0).margin(1e-8));
        CHECK(low[2] + high[2] == Approx(0).margin(1e-8));

        REQUIRE(m.normal_index.size() == (e.smooth ? e.triangles : 0));
        if (e.smooth) CHECK(agreement(m) > 0.995);
    }
}

TEST_CASE("normals are written with unit length", "[meshgen]") {
    for (const Expected& e : kExpected) {
        std::istringstream text(slurp(kMeshes + e.file));
        double worst = 0;
        for (std::string line; std::getline(text, line);) {
            Vec3d n;
            if (std::sscanf(line.c_str(), "vn %lf %lf %lf", &n[0], &n[1], &n[2]) == 3)
                worst = std::max(worst, std::abs(dot(n, n) - 1));
        }
        CAPTURE(e.file);
        CHECK(worst < 1e-8);
    }
}

TEST_CASE("the sphere is one", "[meshgen]") {
    const Mesh m = loadObj(kMeshes + "sphere.obj").mesh;
    const Vec3d centre{0, .5, 0};
    for (const Vec3d& p : m.positions)
        CHECK(std::sqrt(dot((p - centre), (p - centre))) == Approx(.5).epsilon(1e-8));
    CHECK(agreement(m) == 1.0);
    for (std::size_t i = 0; i < m.triangles.size(); ++i)
        for (int k = 0; k < 3; ++k) {
            const Vec3d out = (m.positions[m.triangles[i][k]] - centre);
            REQUIRE(dot(out, m.normals[m.normal_index[i][k]]) == Approx(.5).epsilon(1e-8));
        }
}

TEST_CASE("the dragon is an uneven load", "[meshgen]") {
    const Mesh m = loadObj(kMeshes + "dragon.obj").mesh;
    std::vector<double> area;
    for (const auto& t : m.triangles) area.push_back(std::sqrt(dot(areaVector(m, t), areaVector(m, t))));
    std::sort(area.begin(), area.end());
    CHECK(area.front() > 0);
    CHECK(area[area.size() * 99 / 100] > 10 * area[area.size() / 10]);
}

TEST_CASE("every run writes the same bytes", "[meshgen]") {
    const crt::TemporaryFolder folder;
    REQUIRE(std::system((kMeshgen + "'" + folder.path() + "'").c_str()) == 0);
    for (const Expected& e : kExpected) {
        CAPTURE(e.file);
        CHECK((slurp(folder / e.file) == slurp(kMeshes + e.file)));
    }
}

TEST_CASE("options are not taken for the name of a folder", "[meshgen]") {
    const crt::TemporaryFolder folder;
    const std::string there = "cd '" + folder.path() + "' && ";
    CHECK(std::system((there + kMeshgen + "--help > help.txt").c_str()) == 0);
    CHECK_THAT(slurp(folder / "help.txt"), Contains("usage: crt-meshgen OUTDIR"));
    CHECK(std::system((there + kMeshgen + "--out 2> error.txt").c_str()) != 0);
    CHECK_THAT(slurp(folder / "error.txt"), Contains("usage: crt-meshgen OUTDIR"));
    CHECK(folder.fileCount() == 2);
}
