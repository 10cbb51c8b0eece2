// Where the digits are: the centre that a scene gets, large triangles in pieces, and shapes far from the
// centre.
#include "compiled_scenes.h"

#include "compile/divide.h"
#include "compile/focus.h"
#include "verify/shapes.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

using namespace compile_test;
using crt::Focus;
using crt::Mesh;
using crt::operator+;
using crt::operator-;
using crt::operator*;

namespace {

/// litFloor, and a triangle of size 1 at `far`.
Scene withFarTriangle(const Vec3d& far) {
    Scene scene = litFloor();
    Mesh mesh;
    crt::verify::addTriangle(mesh, far, far + Vec3d{0, 1, 0}, far + Vec3d{0, 0, 1});
    scene.meshes.push_back(mesh);
    scene.objects.emplace_back();
    scene.objects.back().mesh = 2;
    scene.objects.back().material = 0;
    return scene;
}

std::optional<Focus> focusOf(const Scene& scene) {
    return crt::focusOf(scene, crt::placementsOf(scene, std::nullopt), crt::placedShapes(scene));
}

/// One floor of half size `half`, divided around the origin as for details of 1.
Mesh dividedFloor(
    double half, const std::function<void(Scene&)>& change = [](Scene&) {}) {
    Scene scene = litFloor();
    for (Vec3d& p : scene.meshes[0].positions) p = p * (half / 5);
    change(scene);
    auto divided = crt::dividedMeshes(scene, crt::placementsOf(scene, std::nullopt), {{0, 0, 0}, 1});
    return divided.empty() ? scene.meshes[0] : divided.begin()->second;
}

/// Edges that a mesh has a number of times other than twice, by the places of their ends.
std::vector<std::pair<Vec3d, Vec3d>> openEdges(const Mesh& mesh) {
    std::map<std::pair<Vec3d, Vec3d>, int> count;
    for (const auto& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3d a = mesh.positions[t[k]], b = mesh.positions[t[(k + 1) % 3]];
            ++count[a < b ? std::pair{a, b} : std::pair{b, a}];
        }
    std::vector<std::pair<Vec3d, Vec3d>> open;
    for (const auto& [edge, times] : count)
        if (times != 2) open.push_back(edge);
    return open;
}

double areaOf(const Mesh& mesh) {
    double area = 0;
    for (const auto& t : mesh.triangles) {
        const Vec3d& a = mesh.positions[t[0]];
        area += crt::length(crt::cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a)) / 2;
    }
    return area;
}

}  // namespace

TEST_CASE("the centre follows the camera where the middle of the scene is too far", "[compile][focus]") {
    CHECK_FALSE(focusOf(litFloor()));
    CHECK_FALSE(focusOf(withFarTriangle({300, 0, 0})));
    for (const double far : {1e4, 1e6, 1e9}) {
        INFO("a triangle at " << far);
        const std::optional<Focus> focus = focusOf(withFarTriangle({far, 0.3 * far, 0}));
        REQUIRE(focus);
        CHECK(crt::length(focus->centre) < 6);
        CHECK(focus->detail < 10);
        const CompiledScene c = compiled(withFarTriangle({far, 0.3 * far, 0}));
        CHECK(c.centre == focus->centre);
        for (const CrtTriangle& t : listOf<CrtTriangle>(c, headerOf(c).triangles))
            for (const float p : t.p) CHECK(std::abs(p) <= 1);
    }
    // From far away, too: then it is what the camera looks at, and not what stands somewhere else.
    Scene telephoto = withFarTriangle({1e6, 0, 0});
    telephoto.camera.position = {0, 3e5, -4e5};
    const std::optional<Focus> there = focusOf(telephoto);
    REQUIRE(there);
    CHECK(crt::length(there->centre) < 6);
    // A camera that sees nothing in a scene without details keeps the middle.
    Scene away = litFloor();
    away.camera.position = {0, 1e9, 0};
    away.camera.target = {0, 2e9, 1};
    CHECK_FALSE(focusOf(away));
}

TEST_CASE("with a centre of its own, moving and scaling a scene still changes no bit", "[compile][focus]") {
    const Scene scene = withFarTriangle({0x1p20, 0x1p18, 0});
    REQUIRE(focusOf(scene));
    const auto positions = [](const CompiledScene& c) {
        std::vector<float> all;
        for (const CrtTriangle& t : listOf<CrtTriangle>(c, headerOf(c).triangles))
            all.insert(all.end(), std::begin(t.p), std::end(t.p));
        return all;
    };
    const CompiledScene here = compiled(scene);
    CHECK(positions(here) == positions(compiled(crt::verify::moved(scene, 1, {0x1p22, -0x1p21, 0x1p10}))));
    for (const int exponent : {-300, -40, 40, 300})
        CHECK(positions(here) ==
              positions(compiled(crt::verify::moved(scene, std::ldexp(1.0, exponent), {}))));
    Scene turned = scene;
    std::reverse(turned.meshes[0].triangles.begin(), turned.meshes[0].triangles.end());
    CHECK(compiled(turned).centre == here.centre);
}

TEST_CASE("pieces of a large triangle are it, and no larger than they are far away", "[compile][focus]") {
    for (const double half : {1e3, 1e5, 1e7}) {
        INFO("half size " << half);
        const Mesh floor = dividedFloor(half);
        CHECK(floor.triangles.size() > 8 * std::log2(half));
        CHECK(floor.triangles.size() < 64 * std::log2(half));
        CHECK(areaOf(floor) == Approx(4 * half * half).epsilon(1e-12));
        for (const auto& [a, b] : openEdges(floor))
            CHECK((std::max(std::abs(a[0]), std::abs(a[2])) == half &&
                   std::max(std::abs(b[0]), std::abs(b[2])) == half));
        for (const auto& t : floor.triangles) {
            double nearest = 1e300, longest = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                const Vec3d a = floor.positions[t[k]], edge = floor.positions[t[(k + 1) % 3]] - a;
                longest = std::max(longest, crt::length(edge));
                nearest = std::min(nearest, crt::length(a));
            }
            CHECK(longest <= 6 * (nearest + 1));
        }
    }
    CHECK(dividedFloor(0.5).triangles.size() == 2);
}

TEST_CASE("a closed box stays closed in pieces, whatever objects its faces are", "[compile][focus]") {
    // One face emits, and stays whole with all of its edges.
    const Mesh box = crt::verify::boxMesh({-1e4, -3, -2e5}, {1e4, 7, 1e5}, true);
    for (const int lit : {-1, 5}) {
        Scene scene;
        scene.materials.resize(1);
        scene.emissions.push_back({crt::constantSpectrum(2), false});
        for (std::size_t face = 0; face < 6; ++face) {
            Mesh mesh = box;
            mesh.triangles = {box.triangles[2 * face], box.triangles[2 * face + 1]};
            scene.meshes.push_back(mesh);
            scene.objects.emplace_back();
            scene.objects.back().mesh = static_cast<std::uint32_t>(face);
            scene.objects.back().emission = static_cast<int>(face) == lit ? 0 : -1;
        }
        const auto placements = crt::placementsOf(scene, std::nullopt);
        const crt::DividedMeshes divided = crt::dividedMeshes(scene, placements, {{3, 2, 1}, 1});
        CHECK(divided.size() == (lit < 0 ? 4u : 3u));  // two faces are far away
        Mesh all;
        for (const crt::Object& object : scene.objects) {
            const auto own = divided.find(&object);
            const Mesh& mesh = own != divided.end() ? own->second : scene.meshes[object.mesh];
            for (auto t : mesh.triangles) {
                for (std::uint32_t& i : t) i += static_cast<std::uint32_t>(all.positions.size());
                all.triangles.push_back(t);
            }
            all.positions.insert(all.positions.end(), mesh.positions.begin(), mesh.positions.end());
        }
        CHECK(all.triangles.size() > 100);
        CHECK(openEdges(all).empty());
        CHECK(areaOf(all) == Approx(areaOf(box)).epsilon(1e-12));
    }
}

TEST_CASE("pieces keep coordinates, normals and materials of their triangle", "[compile][focus]") {
    const Mesh floor = dividedFloor(1e4, [](Scene& scene) {
        Mesh& mesh = scene.meshes[0];
        mesh.uvs = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};
        mesh.normals = {{0, 1, 0}};
        mesh.uv_index = mesh.triangles;
        mesh.normal_index = {{0, 0, 0}, {0, crt::kNoNormal, 0}};
        mesh.material = {0, -1};
    });
    REQUIRE(floor.uv_index.size() == floor.triangles.size());
    REQUIRE(floor.normal_index.size() == floor.triangles.size());
    REQUIRE(floor.material.size() == floor.triangles.size());
    for (std::size_t i = 0; i < floor.triangles.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3d& p = floor.positions[floor.triangles[i][k]];
            const auto& uv = floor.uvs[floor.uv_index[i][k]];
            CHECK(uv[0] == Approx((p[0] + 1e4) / 2e4).margin(1e-15));
            CHECK(uv[1] == Approx((p[2] + 1e4) / 2e4).margin(1e-15));
            if (floor.material[i] != 0) continue;
            REQUIRE(floor.normal_index[i][k] != crt::kNoNormal);
            CHECK(floor.normals[floor.normal_index[i][k]] == Vec3d{0, 1, 0});
        }
    CHECK(std::count(floor.material.begin(), floor.material.end(), 0) > 10);
    CHECK(std::count(floor.material.begin(), floor.material.end(), -1) > 10);
}

TEST_CASE("shapes keep their area, however far from the centre they stand", "[compile][focus][shapes]") {
    // Rays and light sampling use the same record.
    for (const double far : {0.0, 1e3, 1e5, 1e7})
        for (const crt::QuadricType type :
             {crt::QuadricType::Disk, crt::QuadricType::Cylinder, crt::QuadricType::Sphere}) {
            Scene scene = litFloor();
            scene.meshes.emplace_back();
            crt::Object object;
            object.mesh = 2;
            object.material = 0;
            object.shape = crt::Quadric{type, 0.0025, type == crt::QuadricType::Disk ? 0.0 : -0.001,
                                        type == crt::QuadricType::Disk ? 0.0 : 0.002, false};
            object.transforms[0][3] = far;
            scene.objects.push_back(object);
            const CompiledScene c = compiled(scene);
            const auto shapes = listOf<CrtShape>(c, headerOf(c).shapes);
            REQUIRE(shapes.size() == 1);
            const double unit = std::ldexp(1.0, -c.scale_exponent);
            INFO("type " << static_cast<int>(type) << " at " << far);
            CHECK(static_cast<double>(shapes[0].radius) * unit == Approx(0.0025).epsilon(5e-4));
            if (type != crt::QuadricType::Disk)
                CHECK((static_cast<double>(shapes[0].to_z) - static_cast<double>(shapes[0].from_z)) * unit ==
                      Approx(0.003).epsilon(1e-3));
        }
}
