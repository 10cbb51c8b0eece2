// Normals that are worked out from faces: known shapes, creases, and that neither order nor threads show.
#include "base/parallel.h"
#include "base/vec3d.h"
#include "captured_log.h"
#include "catch.h"
#include "scene/mesh/vertex_normals.h"
#include "scene_texts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

using namespace crt;
using crt::TemporaryFolder;
using crt::test::parse;
using crt::test::refused;

namespace {

constexpr double kPi = std::numbers::pi;

/// The unit cube, each side two triangles.
Mesh cube() {
    Mesh mesh;
    for (int i = 0; i < 8; ++i)
        mesh.positions.push_back({double(i & 1), double(i >> 1 & 1), double(i >> 2 & 1)});
    for (const auto& q : std::vector<std::array<std::uint32_t, 4>>{
             {0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
        mesh.triangles.push_back({q[0], q[1], q[2]});
        mesh.triangles.push_back({q[0], q[2], q[3]});
    }
    return mesh;
}

Vec3d faceNormal(const Mesh& mesh, std::size_t t) {
    const auto& v = mesh.triangles[t];
    const Vec3d n =
        cross(mesh.positions[v[1]] - mesh.positions[v[0]], mesh.positions[v[2]] - mesh.positions[v[0]]);
    return n * (1 / length(n));
}

Vec3d normalAt(const Mesh& mesh, std::size_t t, std::size_t k) {
    return mesh.normals.at(mesh.normal_index.at(t)[k]);
}

double distance(const Vec3d& a, const Vec3d& b) { return length(a - b); }

/// A sphere of rings and segments, whose poles many triangles share.
Mesh sphere(int segments, int rings) {
    Mesh mesh;
    for (int r = 0; r <= rings; ++r)
        for (int s = 0; s < segments; ++s) {
            const double a = kPi * r / rings, b = 2 * kPi * s / segments;
            if ((r == 0 || r == rings) && s > 0) continue;
            mesh.positions.push_back({std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)});
        }
    const auto at = [&](int r, int s) {
        if (r == 0) return 0u;
        if (r == rings) return static_cast<std::uint32_t>(mesh.positions.size() - 1);
        return static_cast<std::uint32_t>(1 + (r - 1) * segments + s % segments);
    };
    for (int r = 0; r < rings; ++r)
        for (int s = 0; s < segments; ++s) {
            if (r > 0) mesh.triangles.push_back({at(r, s), at(r + 1, s), at(r, s + 1)});
            if (r + 1 < rings) mesh.triangles.push_back({at(r, s + 1), at(r + 1, s), at(r + 1, s + 1)});
        }
    return mesh;
}

}  // namespace

TEST_CASE("a cube is round or has edges, as the crease angle says", "[vertex_normals]") {
    Mesh edges = cube();
    makeSmoothNormals(edges, 60);
    CHECK(edges.normals.size() == 24);
    for (std::size_t t = 0; t < 12; ++t)
        for (std::size_t k = 0; k < 3; ++k) CHECK(normalAt(edges, t, k) == faceNormal(edges, t));
    Mesh round = cube();
    makeSmoothNormals(round, 90);  // The angle itself is no crease.
    CHECK(round.normals.size() == 8);
    for (std::size_t t = 0; t < 12; ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            // Along the diagonal, however the sides are divided: one triangle there or two.
            const Vec3d out = round.positions[round.triangles[t][k]] * 2 - Vec3d{1, 1, 1};
            CHECK(distance(normalAt(round, t, k), out * (1 / std::sqrt(3.0))) < 1e-15);
        }
}

TEST_CASE("normals of a sphere are those of the sphere", "[vertex_normals]") {
    Mesh mesh = sphere(48, 24);
    makeSmoothNormals(mesh, 60);
    CHECK(mesh.normals.size() == mesh.positions.size());
    double worst = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k)
            worst = std::max(worst, distance(normalAt(mesh, t, k), mesh.positions[mesh.triangles[t][k]]));
    CHECK(worst < .003);
    // Weighted by area, or not at all, they would be four times as far off, and more.
    CHECK(worst > 0);
}

TEST_CASE("a side counts by its angle, however it is divided", "[vertex_normals]") {
    // A corner of three square sides, one of them a fan of ten triangles.
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    mesh.triangles = {{0, 2, 3}, {0, 3, 1}};
    std::uint32_t last = 1;
    for (int i = 1; i <= 10; ++i) {
        const double a = kPi / 2 * i / 10;
        std::uint32_t next = 2;
        if (i < 10) {
            next = static_cast<std::uint32_t>(mesh.positions.size());
            mesh.positions.push_back({std::cos(a), std::sin(a), 0});
        }
        mesh.triangles.push_back({0, last, next});
        last = next;
    }
    makeSmoothNormals(mesh, 100);
    const double d = 1 / std::sqrt(3.0);
    CHECK(distance(normalAt(mesh, 0, 0), {d, d, d}) < 1e-15);
    CHECK(mesh.normal_index[0][0] == mesh.normal_index[5][0]);
}

TEST_CASE("vertices at one place are one, and -0 is 0", "[vertex_normals]") {
    const Mesh whole = cube();
    Mesh torn;  // Each triangle has its own vertices, as in an STL.
    for (const auto& t : whole.triangles) {
        const auto n = static_cast<std::uint32_t>(torn.positions.size());
        torn.triangles.push_back({n, n + 1, n + 2});
        for (const std::uint32_t v : t) {
            Vec3d p = whole.positions[v];
            for (double& x : p)
                if (x == 0 && torn.positions.size() % 2 == 0) x = -0.0;
            torn.positions.push_back(p);
        }
    }
    const std::vector<std::uint32_t> place = verticesAtOnePlace(torn.positions);
    for (std::size_t v = 0; v < place.size(); ++v) {
        CHECK(torn.positions[place[v]] == torn.positions[v]);
        CHECK(place[v] <= v);
        CHECK(place[place[v]] == place[v]);
    }
    makeSmoothNormals(torn, 180);
    CHECK(torn.normals.size() == 8);
    const double d = 1 / std::sqrt(3.0);
    for (std::size_t t = 0; t < 12; ++t) CHECK(std::abs(normalAt(torn, t, 0)[0]) == Approx(d));
}

TEST_CASE("what has no common normal is flat, or apart", "[vertex_normals]") {
    // Two tents that touch at their tips alone.
    Mesh tips;
    tips.positions = {{0, 0, 0}, {1, 0, -1}, {0, 1, -1}, {-1, 0, 1}, {0, 1, 1}};
    tips.triangles = {{0, 1, 2}, {0, 3, 4}};
    makeSmoothNormals(tips, 180);
    CHECK(distance(normalAt(tips, 0, 0), faceNormal(tips, 0)) < 1e-15);
    CHECK(distance(normalAt(tips, 1, 0), faceNormal(tips, 1)) < 1e-15);
    // A neighbour that is inside out.
    Mesh turned;
    turned.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, .1}};
    turned.triangles = {{0, 1, 2}, {0, 3, 2}};
    makeSmoothNormals(turned, 180);
    CHECK(distance(normalAt(turned, 0, 0), faceNormal(turned, 0)) < 1e-15);
    CHECK(distance(normalAt(turned, 1, 0), faceNormal(turned, 1)) < 1e-15);
    // A sheet and its back share vertices and edges, and each side is shaded as one.
    Mesh sheet;
    sheet.positions = {{0, 0, 0}, {1, 0, .2}, {1, 1, 0}, {0, 1, .2}};
    sheet.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 2, 1}, {0, 3, 2}};
    makeSmoothNormals(sheet, 60);
    CHECK(sheet.normal_index[0][0] == sheet.normal_index[1][0]);
    CHECK(sheet.normal_index[2][0] == sheet.normal_index[3][0]);
    CHECK(distance(normalAt(sheet, 0, 0), normalAt(sheet, 2, 0) * -1) < 1e-15);
    // A triangle without area has no normal to give, and gets none.
    Mesh sliver;
    sliver.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}};
    sliver.triangles = {{0, 1, 2}, {0, 1, 3}};
    makeSmoothNormals(sliver, 180);
    CHECK(normalAt(sliver, 0, 0) == Vec3d{0, 0, 1});
    CHECK(sliver.normal_index[1] == std::array<std::uint32_t, 3>{kNoNormal, kNoNormal, kNoNormal});
}

TEST_CASE("neither size nor place of a mesh changes its normals", "[vertex_normals]") {
    Mesh mesh = sphere(12, 6);
    makeSmoothNormals(mesh, 180);
    for (const double scale : {1e-160, 1e-6, 1e150}) {
        Mesh other = sphere(12, 6);
        for (Vec3d& p : other.positions) p = p * scale;
        makeSmoothNormals(other, 180);
        REQUIRE(other.normals.size() == mesh.normals.size());
        for (std::size_t i = 0; i < mesh.normals.size(); ++i)
            CHECK(distance(other.normals[i], mesh.normals[i]) < 1e-14);
    }
}

TEST_CASE("any number of threads makes the same normals", "[vertex_normals][threads]") {
    const Mesh plain =
        sphere(400, 200);  // Beyond what one thread takes at a time, and poles of 400 triangles.
    Mesh one = plain;
    runWithThreads(1, [&] { makeSmoothNormals(one, .5); });
    CHECK(one.normals.size() > plain.positions.size());
    for (const unsigned threads : {2u, 3u, 16u}) {
        Mesh many = plain;
        runWithThreads(threads, [&] { makeSmoothNormals(many, .5); });
        CHECK(many.normals == one.normals);
        CHECK(many.normal_index == one.normal_index);
    }
}

TEST_CASE("an object says which normals its mesh has", "[vertex_normals][scene_yaml]") {
    const TemporaryFolder folder;
    folder.write("roof.obj",
                 "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 .1\nvn 1 0 0\nf 1//1 2//1 3//1\nf 1//1 3//1 4//1\n");
    const std::string grey = "materials: {grey: {type: diffuse, reflectance: 0.5}}\nobjects:\n";
    const auto object = [](const std::string& mesh, const std::string& keys) {
        return "- {" + mesh + ", material: grey" + keys + "}\n";
    };
    const std::string written =
        "mesh: {positions: [[0,0,0],[1,0,0],[1,1,0],[0,1,.1]], faces: [[0,1,2],[0,2,3]], normals: "
        "[[1,0,0],[1,0,0],[1,0,0],[1,0,0]]}";
    for (const std::string& mesh : {std::string("obj: roof.obj"), written}) {
        CAPTURE(mesh);
        const Scene scene = parse(
            grey + object(mesh, "") + object(mesh, ", normals: smooth") + object(mesh, ", normals: flat") +
                object(mesh, ", normals: smooth, crease_angle_deg: 1") + object(mesh, ", normals: file"),
            {}, folder.path());
        const auto meshOf = [&](std::size_t i) -> const Mesh& {
            return scene.meshes.at(scene.objects.at(i).mesh);
        };
        CHECK(normalAt(meshOf(0), 0, 0) == Vec3d{1, 0, 0});
        CHECK(normalAt(meshOf(4), 1, 2) == Vec3d{1, 0, 0});
        const Vec3d smooth = normalAt(meshOf(1), 0, 0);
        CHECK(smooth == normalAt(meshOf(1), 1, 0));
        CHECK(smooth[2] > .99);
        CHECK(smooth != faceNormal(meshOf(1), 0));
        CHECK((meshOf(2).normals.empty() && meshOf(2).normal_index.empty()));
        CHECK(normalAt(meshOf(3), 0, 0) == Vec3d{0, 0, 1});
        CHECK(distance(normalAt(meshOf(3), 1, 0), faceNormal(meshOf(3), 1)) < 1e-15);
    }
    CHECK_THAT(refused(grey + object(written, ", crease_angle_deg: 30")),
               Contains("only computed normals have creases") &&
                   Contains("add 'normals: smooth'"));
    CHECK_THAT(refused(grey + object(written, ", normals: round")), Contains("smooth"));
    CHECK_THAT(refused(grey + object(written, ", normals: smooth, crease_angle_deg: 181")),
               Contains("0 to 180"));
}
