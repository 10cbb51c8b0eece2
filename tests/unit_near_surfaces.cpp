// Surfaces too near to one another, lamps in the plane of another surface, and bodies that touch.
#include "compile/coplanar.h"
#include "compile/near_pairs.h"
#include "compile/near_scene.h"
#include "compile/near_surfaces.h"
#include "compiled_scenes.h"

#include "base/error.h"
#include "scene_texts.h"

#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <string>

using namespace compile_test;

TEST_CASE("a lamp in the plane of another surface that it overlaps is found, and nothing else",
          "[compile]") {
    const auto quad = [](double x0, double x1, double y, double z0, double z1) {
        crt::Mesh mesh;
        mesh.positions = {{x0, y, z0}, {x1, y, z0}, {x1, y, z1}, {x0, y, z1}};
        mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
        return mesh;
    };
    const auto found = [&](const crt::Mesh& lamp, bool many) {
        Scene scene;
        scene.camera.position = {0, 1, 0};
        scene.emissions = {{crt::constantSpectrum(1), false}};
        scene.materials.resize(1);
        scene.meshes = {quad(-2, 2, 2, -2, 2), lamp, quad(-2, 2, 0, -2, 2)};
        for (std::uint32_t i = 0; i < 3; ++i) {
            crt::Object object;
            object.mesh = i;
            object.material = 0;
            object.emission = i == 1 ? 0 : -1;
            scene.objects.push_back(object);
        }
        scene.integrator.accelerator = many ? crt::Accelerator::Bvh : crt::Accelerator::None;
        return crt::findCoplanarLight(crt::compileScene(scene, 0));
    };
    for (const bool tree : {false, true}) {
        CAPTURE(tree);
        // In the ceiling; partly; larger than the ceiling; turned over.
        const std::optional<crt::CoplanarLight> inside = found(quad(-0.5, 0.5, 2, -0.5, 0.5), tree);
        REQUIRE(inside);
        CHECK((inside->light == 2 || inside->light == 3));
        CHECK((inside->surface == 0 || inside->surface == 1));
        CHECK(found(quad(1.5, 2.5, 2, -0.5, 0.5), tree));
        CHECK(found(quad(-9, 9, 2, -9, 9), tree));
        CHECK(found(quad(0.5, -0.5, 2, -0.5, 0.5), tree));
        CHECK(found(quad(-0.5, 0.5, 2 - 1e-6, -0.5, 0.5), tree));  // below what rays can tell
        // Surfaces at the advised distance, next to the ceiling, at its edge, or on the floor are right.
        CHECK_FALSE(found(quad(-0.5, 0.5, 2 - 2 * inside->least_gap, -0.5, 0.5), tree));
        CHECK_FALSE(found(quad(3, 4, 2, -0.5, 0.5), tree));
        CHECK_FALSE(found(quad(2, 3, 2, -0.5, 0.5), tree));
        crt::Mesh standing;
        standing.positions = {{-0.5, 0, 0}, {0.5, 0, 0}, {0.5, 1, 0}, {-0.5, 1, 0}};
        standing.triangles = {{0, 1, 2}, {0, 2, 3}};
        CHECK_FALSE(found(standing, tree));
    }
}

namespace {

/// Two wavy sheets of 2 · side² triangles each, the upper one `gap` above the lower, and a lamp.
Scene twoSheets(std::size_t side, double gap) {
    Scene scene = litFloor();
    crt::Mesh& sheet = scene.meshes[0];
    sheet = {};
    const auto add = [&](double height) {
        const auto first = static_cast<std::uint32_t>(sheet.positions.size()),
                   row = static_cast<std::uint32_t>(side + 1);
        for (std::size_t y = 0; y <= side; ++y)
            for (std::size_t x = 0; x <= side; ++x) {
                const double u = static_cast<double>(x) / static_cast<double>(side),
                             v = static_cast<double>(y) / static_cast<double>(side);
                sheet.positions.push_back(
                    {10 * u - 5, height + 0.3 * std::sin(9 * u) * std::cos(7 * v), 10 * v - 5});
            }
        for (std::uint32_t y = 0; y < side; ++y)
            for (std::uint32_t x = 0; x < side; ++x) {
                const std::uint32_t a = first + y * row + x;
                sheet.triangles.push_back({a, a + row, a + 1});
                sheet.triangles.push_back({a + 1, a + row, a + row + 1});
            }
    };
    add(0);
    add(gap);
    return scene;
}

/// 40,000 small triangles: those that are asked about just below the plane y = 0, above each one that is not
/// asked about, and the others far off, so that the plane goes through the scene's middle.
Scene pairsAboutThePlane(double gap) {
    constexpr std::size_t kCount = 40000, kSide = 100;
    Scene scene = litFloor();
    crt::Mesh& mesh = scene.meshes[0];
    mesh = {};
    const std::vector<std::uint32_t> ids = crt::askedTriangles(kCount + 2);  // with the lamp
    const std::set<std::uint32_t> asked(ids.begin(), ids.end());
    std::array<std::size_t, 3> next{};  // Of those that are asked, their neighbours, and the others.
    for (std::uint32_t id = 0; id < kCount; ++id) {
        const std::size_t kind = asked.count(id) != 0 ? 0 : next[1] < kSide * kSide ? 1 : 2;
        const std::size_t place = next[kind]++;
        const double x = (static_cast<double>(place % kSide) - 49.5) * 0.1,
                     z = (static_cast<double>(place / kSide % kSide) - 49.5) * 0.1;
        const double y = kind == 0                                     ? -0.5 * gap
                         : kind == 1                                   ? 0.5 * gap
                         : place % (2 * kSide * kSide) < kSide * kSide ? -6
                                                                       : 6;
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        for (const auto& [dx, dz] : {std::pair{-0.02, -0.02}, {0.02, -0.02}, {0.0, 0.02}})
            mesh.positions.push_back({x + dx, y, z + dz});
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return scene;
}

constexpr double kEverywhere = std::numeric_limits<double>::infinity();

}  // namespace

TEST_CASE("a backend that brings its own acceleration structure gets no BVH, and the same scene otherwise",
          "[compile]") {
    const Scene scene = twoSheets(20, 1);
    const CompiledScene with = compiled(scene),
                        without = crt::compileScene(scene, 0, {.accelerator_reach = 4});
    CHECK_FALSE(with.without_nodes);
    CHECK(with.nodes > 0);
    CHECK(without.without_nodes);
    CHECK(without.nodes == 0);
    CHECK(without.build_seconds == 0);
    CHECK(headerOf(without).nodes.count == 0);
    CHECK(headerOf(without).accelerator == CRT_ACCELERATOR_BVH);
    CHECK(without.header().features == with.header().features);
    CHECK(without.hash == with.hash);
    CHECK(without.size_bytes < with.size_bytes);
    const auto left_out = [](const CompiledScene& c) {
        return std::any_of(c.left_out.begin(), c.left_out.end(),
                           [](const auto& what) { return what.first == "BVH"; });
    };
    CHECK(left_out(without));
    CHECK_FALSE(left_out(with));
    // Every slot is its triangle's id.
    const std::vector<CrtTriangle> triangles = listOf<CrtTriangle>(without, headerOf(without).triangles);
    REQUIRE(triangles.size() == 1602);
    for (std::uint32_t slot = 0; slot < triangles.size(); ++slot) REQUIRE(triangles[slot].id == slot);

    // The camera stands at z = -5 in a scene that is 10 wide: 0.625 of the compiled scene. From beyond the
    // reach, and with a lens that goes there, rays need the nodes.
    const auto nodesAt = [&](double z, double aperture) {
        Scene moved = scene;
        moved.camera.position[2] = z;
        moved.camera.aperture_radius = aperture;
        return crt::compileScene(moved, 0, {.accelerator_reach = 4}).nodes;
    };
    CHECK(nodesAt(-31, 0) == 0);
    CHECK(nodesAt(-33, 0) > 0);
    CHECK(nodesAt(-31, 2) > 0);
    // Where no BVH is needed, none is left out.
    CHECK_FALSE(crt::compileScene(litFloor(), 0, {.accelerator_reach = 4}).without_nodes);
}

TEST_CASE("surfaces too near and lamps in a plane are found without a BVH as with one", "[compile]") {
    // Of 40,000 triangles an even choice is looked at.
    for (const double gap : {3e-7, 1e-6, 1.1e-6, 1.0}) {
        const Scene scene = twoSheets(100, gap);
        const CompiledScene with = compiled(scene),
                            without = crt::compileScene(scene, 0, {.accelerator_reach = kEverywhere});
        REQUIRE(without.without_nodes);
        const CompiledScene reduced = crt::nearScene(without);
        const crt::NearSurfaces expected = crt::findNearSurfaces(with),
                                found = crt::findNearSurfaces(reduced);
        INFO("gap " << gap << ", near " << expected.near << " of " << expected.asked);
        CHECK(expected.asked == 10000);
        CHECK(found.asked == expected.asked);
        CHECK(found.near == expected.near);
        CHECK(found.nearest_clearance == expected.nearest_clearance);
        if (gap == 1.0) CHECK(expected.near == 0);
        CHECK(crt::mayHaveNearSurfaces(without) == (expected.near > 0));
        // So near that some are found, or the comparison was of nothing.
        if (gap == 1e-6) CHECK(expected.near > 0);
    }

    // Neighbours that are not checked, beyond the plane through the middle where cells end.
    for (const double gap : {3e-7, 1e-6, 3e-6, 1e-5}) {
        const Scene scene = pairsAboutThePlane(gap);
        const CompiledScene with = compiled(scene),
                            without = crt::compileScene(scene, 0, {.accelerator_reach = kEverywhere});
        REQUIRE(without.without_nodes);
        const crt::NearSurfaces expected = crt::findNearSurfaces(with),
                                found = crt::findNearSurfaces(crt::nearScene(without));
        INFO("gap " << gap << ", near " << expected.near << " of " << expected.asked);
        CHECK(found.near == expected.near);
        CHECK(crt::mayHaveNearSurfaces(without) == (expected.near > 0));
        if (gap == 1e-6) CHECK(expected.near > 0);
    }

    // Of a large scene only what lies near is kept.
    const CompiledScene large = crt::compileScene(twoSheets(300, 1), 0, {.accelerator_reach = kEverywhere});
    CHECK(headerOf(crt::nearScene(large)).triangle_count < large.triangles / 2);

    Scene lamp = twoSheets(100, 1);
    lamp.meshes[1].positions = {{-1, 3, -1}, {1, 3, -1}, {1, 3, 1}, {-1, 3, 1},
                                {-2, 3, -2}, {2, 3, -2}, {2, 3, 2}};
    lamp.meshes.push_back(lamp.meshes[1]);
    lamp.meshes.back().triangles = {{4, 5, 6}};
    lamp.objects.push_back(lamp.objects[0]);
    lamp.objects.back().mesh = 2;
    const auto with = crt::findCoplanarLight(compiled(lamp));
    const CompiledScene without_nodes = crt::compileScene(lamp, 0, {.accelerator_reach = kEverywhere});
    CHECK(crt::mayHaveNearSurfaces(without_nodes));
    const auto without = crt::findCoplanarLight(crt::nearScene(without_nodes));
    REQUIRE(with);
    REQUIRE(without);
    CHECK(without->surface == with->surface);
    CHECK(without->least_gap == with->least_gap);
}

namespace {

/// Boxes of side 1 with these centres.
CompiledScene boxesAt(const std::vector<std::string>& centres) {
    std::string text =
        "environment: {radiance: 1}\n"
        "materials:\n"
        "  water: {type: dielectric, ior: 1.33, absorption: 0.5}\n"
        "objects:\n";
    for (const std::string& centre : centres)
        text += "  - {box: {size: [1, 1, 1]}, material: water, transform: [{translate: " + centre + "}]}\n";
    return compiled(crt::test::parse(text));
}

std::set<std::uint32_t> marked(const CompiledScene& scene) {
    std::set<std::uint32_t> ids;
    const std::vector<CrtPrimitive> primitives = listOf<CrtPrimitive>(scene, headerOf(scene).primitives);
    for (std::uint32_t id = 0; id < primitives.size(); ++id)
        if ((primitives[id].object & CRT_PRIMITIVE_TOUCHES) != 0) ids.insert(id);
    return ids;
}

/// By all pairs of triangles.
std::set<std::uint32_t> touching(const CompiledScene& scene) {
    std::set<std::uint32_t> ids;
    const std::vector<CrtTriangle> triangles = listOf<CrtTriangle>(scene, headerOf(scene).triangles);
    const std::vector<CrtPrimitive> primitives = listOf<CrtPrimitive>(scene, headerOf(scene).primitives);
    const auto object = [&](std::uint32_t slot) {
        return primitives[triangles[slot].id].object & ~CRT_PRIMITIVE_TOUCHES;
    };
    for (std::uint32_t a = 0; a < triangles.size(); ++a)
        for (std::uint32_t b = 0; b < triangles.size(); ++b) {
            const crt::Corners of_a = crt::cornersOf(scene.data(), a),
                               of_b = crt::cornersOf(scene.data(), b);
            if (object(a) != object(b) && crt::inOnePlane(of_a, of_b) && crt::overlap(of_a, of_b))
                ids.insert(triangles[a].id);
        }
    return ids;
}

}  // namespace

TEST_CASE("triangles of bodies that touch are marked, whatever is far away", "[compile]") {
    // Side by side, on top, apart; one within the box around the others without touching any.
    const CompiledScene scene = boxesAt({"[0, 0, 0]", "[9, 9, 9]", "[1, 0.3, 0]", "[1, 1.3, 0.2]",
                                         "[-1.5, 0, 0]", "[0, 1.2, 0]", "[9, 8, 9]", "[-9, 0, 0]"});
    CHECK(marked(scene) == touching(scene));
    CHECK(marked(scene).size() >= 12);
    CHECK(marked(boxesAt({"[0, 0, 0]", "[1.5, 0, 0]", "[-3, 0, 0]"})).empty());
}
