// The generated meshes: exactly the promised triangles, closed, right side out, and the same bytes from
// every run.
#include "catch.h"
#include "base/temporary_folder.h"
#include "scene/mesh/mesh_io.h"
#include "scene/mesh/ply_reader.h"
#include "file_bytes.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
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

namespace {

struct ExpectedPlant {
    const char* file;
    std::size_t triangles;
    bool has_bark;
    double widest;  ///< Its outermost point is nearer to the axis than this, and no nearer than half of it.
};
constexpr ExpectedPlant kPlants[] = {
    {"broadleaf.obj", 70000, true, .4},
    {"conifer.obj", 70000, true, .35},
    {"fern.obj", 2028, true, 1.6},
    {"grass.obj", 2800, false, 4.5},
};

/// The triangles of a plant's group, of which there may be none.
Mesh partOf(const std::string& file, const std::string& group) {
    std::istringstream text(slurp(file));
    std::string part;
    bool is_wanted = true, is_empty = true;
    for (std::string line; std::getline(text, line);) {
        if (line.rfind("g ", 0) == 0) is_wanted = line == "g " + group;
        if (line[0] != 'f' || is_wanted) part += line + '\n';
        is_empty &= line[0] != 'f' || !is_wanted;
    }
    if (is_empty) return {};
    const crt::TemporaryFolder folder;
    std::ofstream(folder / "part.obj") << part;
    const LoadedMesh loaded = loadObj(folder / "part.obj");
    CHECK(loaded.degenerate_faces == 0);
    return loaded.mesh;
}

/// Its foot is at the origin, it is one unit high, and its texture coordinates are within the unit square.
void checkPlant(const Mesh& m, const ExpectedPlant& e) {
    double lowest = 1, highest = 0, widest = 0;
    for (const Vec3d& p : m.positions) {
        lowest = std::min(lowest, p[1]);
        highest = std::max(highest, p[1]);
        widest = std::max(widest, std::hypot(p[0], p[2]));
    }
    CHECK(lowest > -.05);
    CHECK(highest == 1.0);
    CHECK(widest < e.widest);
    CHECK(widest > e.widest / 2);
    REQUIRE(m.uv_index.size() == m.triangles.size());
    for (const auto& uv : m.uvs) {
        REQUIRE((uv[0] >= 0 && uv[0] <= 1));
        REQUIRE((uv[1] >= 0 && uv[1] <= 1));
    }
}

}  // namespace

TEST_CASE("plants are closed wood, and leaves of two triangles", "[meshgen]") {
    for (const ExpectedPlant& e : kPlants) {
        CAPTURE(e.file);
        const LoadedMesh loaded = loadObj(kMeshes + e.file);
        CHECK(loaded.mesh.triangles.size() == e.triangles);
        CHECK(loaded.degenerate_faces == 0);
        checkPlant(loaded.mesh, e);

        const Mesh bark = partOf(kMeshes + e.file, "bark"), leaves = partOf(kMeshes + e.file, "leaves");
        CHECK(bark.triangles.empty() != e.has_bark);
        CHECK(bark.triangles.size() + leaves.triangles.size() == e.triangles);
        CHECK(openEdges(bark) == 0);
        if (e.has_bark) {
            CHECK(volume(bark) > 0);
            CHECK(agreement(bark) > 0.95);
        }
        // The triangles of a leaf meet at its midrib, from root to tip, in one sense.
        REQUIRE(leaves.triangles.size() % 2 == 0);
        for (std::size_t i = 0; i < leaves.triangles.size(); i += 2) {
            const auto &right = leaves.triangles[i], &left = leaves.triangles[i + 1];
            REQUIRE(right[0] == left[0]);
            REQUIRE(right[2] == left[1]);
            REQUIRE(dot(areaVector(leaves, right), areaVector(leaves, left)) > 0);
        }
    }
}

TEST_CASE("a tree is of its seed, and of as many triangles as are asked for", "[meshgen]") {
    const crt::TemporaryFolder folder;
    for (const std::string species : {"", " --conifer"}) {
        CAPTURE(species);
        const auto make = [&](const std::string& numbers) {
            return std::system((kMeshgen + "--tree " + numbers + " '" + folder / "tree.obj" + "'" + species +
                                " 2> '" + folder / "error.txt" + "'")
                                   .c_str());
        };
        REQUIRE(make("1 70000") == 0);
        CHECK((slurp(folder / "tree.obj") ==
               slurp(kMeshes + (species.empty() ? "broadleaf.obj" : "conifer.obj"))));
        REQUIRE(make("2 30000") == 0);
        const Mesh one = loadObj(folder / "tree.obj").mesh;
        CHECK(one.triangles.size() == 30000);
        CHECK(openEdges(partOf(folder / "tree.obj", "bark")) == 0);
        REQUIRE(make("3 30000") == 0);
        CHECK(loadObj(folder / "tree.obj").mesh.positions != one.positions);
        // Fewer than the wood alone has; and an odd number.
        CHECK(make("1 1000") != 0);
        CHECK_THAT(slurp(folder / "error.txt"), Contains("need more than that"));
        CHECK(make("1 70001") != 0);
    }
}

TEST_CASE("the ground of the forest has a trail, and a colour everywhere", "[meshgen]") {
    const Mesh m = loadPly(kMeshes + "terrain.ply").mesh;
    CHECK(m.triangles.size() == 80000);
    REQUIRE(m.colors.size() == m.positions.size());
    REQUIRE(m.normal_index.size() == m.triangles.size());
    for (const auto& t : m.triangles) REQUIRE(areaVector(m, t)[1] > 0);
    for (const Vec3d& n : m.normals) REQUIRE(n[1] > .5);
    // The sand at its beginning is the brightest of the first row.
    std::size_t brightest = 0;
    for (std::size_t j = 1; j <= 200; ++j)
        if (m.colors[j][0] > m.colors[brightest][0]) brightest = j;
    CHECK(std::abs(m.positions[brightest][0]) < .01);
    CHECK(m.positions[100][1] == 0);
}

TEST_CASE("every run writes the same bytes", "[meshgen]") {
    const crt::TemporaryFolder folder;
    REQUIRE(std::system((kMeshgen + "'" + folder.path() + "'").c_str()) == 0);
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::directory_iterator(kMeshes)) {
        const std::string file = entry.path().filename();
        CAPTURE(file);
        CHECK((slurp(folder / file) == slurp(kMeshes + file)));
        ++files;
    }
    CHECK(files == 11);
}

TEST_CASE("the bytes of plants and ground are the same on every machine", "[meshgen]") {
    const auto hash = [](const std::string& file) {  // FNV-1a
        std::uint64_t h = 0xcbf29ce484222325u;
        for (const char c : slurp(kMeshes + file)) h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
        return h;
    };
    CHECK(hash("broadleaf.obj") == 0xa2bfee0502acad63u);
    CHECK(hash("conifer.obj") == 0x2d135d66fcc86954u);
    CHECK(hash("fern.obj") == 0xd36bb3869224d3fcu);
    CHECK(hash("grass.obj") == 0x2ca15a8e23a14be0u);
    CHECK(hash("terrain.ply") == 0x20f3ff96ed21db37u);
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
