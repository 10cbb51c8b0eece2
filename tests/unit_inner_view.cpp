// The place of a camera within a building, and that everything else is looked at from around it.
#include "base/temporary_folder.h"
#include "captured_log.h"
#include "catch.h"
#include "gltf_file_maker.h"
#include "processor_time.h"
#include "scene/import/import.h"
#include "scene/import/inner_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

using namespace crt;
using namespace crt::test;

namespace {

/// Of hollow boxes the front sides are within. Painted ones have six materials, from the box's on; the floor
/// has that.
struct Box {
    Vec3d lower, upper;
    std::uint32_t material;
    bool hollow = false, painted = false;
};

/// Corners by bits x, y, z; seen from outside counter-clockwise. The floor first.
constexpr std::array<std::array<int, 4>, 6> kSides{
    {{0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}, {0, 2, 3, 1}, {4, 5, 7, 6}}};

Vec3d cornerOf(const Box& box, int corner) {
    return {corner & 1 ? box.upper[0] : box.lower[0], corner & 2 ? box.upper[1] : box.lower[1],
            corner & 4 ? box.upper[2] : box.lower[2]};
}

template <class Do>
void forTriangles(const std::vector<Box>& boxes, Do&& what) {
    for (const Box& box : boxes)
        for (std::size_t side = 0; side < kSides.size(); ++side)
            for (const std::size_t k : {1u, 2u}) {
                const auto& s = kSides[side];
                const auto material = box.material + static_cast<std::uint32_t>(box.painted ? side : 0);
                what(cornerOf(box, s[0]), cornerOf(box, s[box.hollow ? k + 1 : k]),
                     cornerOf(box, s[box.hollow ? k : k + 1]), material);
            }
}

std::vector<PaintedTriangle> trianglesOf(const std::vector<Box>& boxes) {
    std::vector<PaintedTriangle> triangles;
    forTriangles(boxes, [&](const Vec3d& a, const Vec3d& b, const Vec3d& c, std::uint32_t material) {
        triangles.emplace_back(a, b, c, material);
    });
    return triangles;
}

bool within(const Vec3d& point, const Box& box) {
    bool all = true;
    for (std::size_t k = 0; k < 3; ++k) all = all && point[k] > box.lower[k] && point[k] < box.upper[k];
    return all;
}

/// A room of 6 × 3 × 5 within walls that are a quarter thick, with a table and a chest.
const Box kRoom{{0, 0, 0}, {6, 3, 5}, 1, true, true}, kTable{{2, 0, 2}, {4, 1, 3}, 7},
    kChest{{0.25, 0, 0.25}, {1, 1.5, 1}, 8};
const std::vector<Box> kHouse{{{-0.25, -0.25, -0.25}, {6.25, 3.25, 5.25}, 0}, kRoom, kTable, kChest};

std::vector<Box> scaled(std::vector<Box> boxes, double factor, const Vec3d& moved) {
    for (Box& box : boxes) {
        box.lower = box.lower * factor + moved;
        box.upper = box.upper * factor + moved;
    }
    return boxes;
}

std::string objOf(const std::vector<Box>& boxes) {
    std::string text = "mtllib a.mtl\n";
    forTriangles(boxes, [&](const Vec3d& a, const Vec3d& b, const Vec3d& c, std::uint32_t material) {
        text += fmt::format("usemtl m{}\n", material);
        for (const Vec3d& p : {a, b, c}) text += fmt::format("v {} {} {}\n", p[0], p[1], p[2]);
        text += "f -3 -2 -1\n";
    });
    return text;
}

std::string mtlOf(std::size_t materials) {
    std::string text;
    for (std::size_t i = 0; i < materials; ++i) text += fmt::format("newmtl m{}\nKd 0.5 0.5 0.5\n", i);
    return text;
}

}  // namespace

// Fails when the camera stays outside, stands in a wall or in the furniture, looks at a wall beside it, or
// the unit of the model counts.
TEST_CASE("a house with a furnished room is looked at from within", "[import]") {
    for (const auto& [factor, moved] :
         {std::pair{1.0, Vec3d{0, 0, 0}}, {1e-3, Vec3d{5, 0, 0}}, {250.0, Vec3d{-1e4, 300, 0}}}) {
        const auto view = innerView(trianglesOf(scaled(kHouse, factor, moved)), 1.5);
        REQUIRE(view);
        const Vec3d position = (view->position - moved) * (1 / factor);
        const Vec3d target = (view->target - moved) * (1 / factor);
        INFO(fmt::format("{} {} {}", position[0], position[1], position[2]));
        CHECK(within(position, kRoom));
        CHECK_FALSE(within(position, kTable));
        CHECK_FALSE(within(position, kChest));
        CHECK(length(target - position) == Approx(view->distance / factor));
        CHECK(view->distance / factor > 1.5);
        // Level, and both pieces are before it.
        CHECK(target[1] == Approx(position[1]).margin(1e-9));
        for (const Box& piece : {kTable, kChest})
            CHECK(dot((piece.lower + piece.upper) * 0.5 - position, target - position) > 0);
    }
}

// Fails when the backs of walls count as what is seen: from outside a room of single sheets shows nothing
// else.
TEST_CASE("a room of walls without a thickness is looked at from within", "[import]") {
    const auto view = innerView(trianglesOf({kRoom}), 1.5);
    REQUIRE(view);
    CHECK(within(view->position, kRoom));
}

// Fails when bodies within bodies, hollow ware, or many things side by side are taken for a building.
TEST_CASE("what is no building is looked at from around", "[import]") {
    const auto around = [](const std::vector<Box>& boxes) {
        return !innerView(trianglesOf(boxes), 1.5).has_value();
    };
    std::vector<Box> nested, row;
    for (std::uint32_t i = 0; i < 8; ++i) {
        const double half = 8 - i;
        nested.push_back({{-half, -half, -half}, {half, half, half}, i});
        row.push_back({{2.0 * i, 0, 0}, {2.0 * i + 1, 1, 1}, i});
    }
    CHECK(around(nested));
    CHECK(around(row));
    CHECK(around({{{-1, -1, -1}, {1, 1, 1}, 0}}));  // One material.
    CHECK(around({}));
    CHECK(around(scaled(kHouse, 1e30, {0, 0, 0})));
    CHECK(around(scaled(kHouse, 1e300, {0, 0, 0})));  // Not in single precision.
    CHECK(around(scaled(kHouse, 0, {1, 1, 1})));
    // A painted chest of other colours within, with something in it: it shows half of them outside.
    CHECK(around({{{-1, -1, -1}, {7, 4, 6}, 9, false, true}, kRoom, kTable}));
    // A machine in its casing, a single sheet: between its parts the casing is seen from its back.
    std::vector<Box> machine{{{0, 0, 0}, {6, 6, 6}, 99}};
    for (std::uint32_t i = 0; i < 27; ++i) {
        const Vec3d corner{0.4 + 2 * (i % 3), 0.4 + 2 * (i / 3 % 3), 0.4 + 2 * (i / 9)};
        machine.push_back({corner, corner + Vec3d{1.2, 1.2, 1.2}, i});
    }
    CHECK(around(machine));
}

// Fails when a room counts as open though light reaches it nowhere, or as closed though one wall is missing,
// and when the lamp is as bright as for another wall.
TEST_CASE("a place is within what surrounds it, and not within what is open", "[import]") {
    const std::vector<PaintedTriangle> closed = trianglesOf({{{-1, -2, -3}, {1, 2, 3}, 0}});
    for (const auto& [ahead, nearest, farthest] :
         {std::tuple{Vec3d{1, 0, 0}, 1.0, 1.04}, {Vec3d{0, 1, 0}, 2.0, 2.07}, {Vec3d{0, 0, -1}, 3.0, 3.1}}) {
        const auto distance = distanceWithin(closed, {0, 0, 0}, ahead, 0.5);
        REQUIRE(distance);
        CHECK(*distance >= nearest);
        CHECK(*distance < farthest);
    }
    CHECK_FALSE(distanceWithin(closed, {1.5, 0, 0}, {1, 0, 0}, 1));
    for (std::size_t side = 0; side < 6; ++side) {
        auto open = closed;
        open.erase(open.begin() + static_cast<std::ptrdiff_t>(2 * side),
                   open.begin() + static_cast<std::ptrdiff_t>(2 * side + 2));
        CHECK_FALSE(distanceWithin(open, {0, 0, 0}, {1, 0, 0}, 1));
    }
    CHECK_FALSE(distanceWithin({}, {0, 0, 0}, {1, 0, 0}, 1));
    for (const double factor : {0.0, 1e30, 1e300})  // The last one is not in single precision.
        CHECK_FALSE(
            distanceWithin(trianglesOf(scaled({kRoom}, factor, {0, 0, 0})), {0, 0, 0}, {1, 0, 0}, 1));
}

// Fails when a camera of the file under a dome sees a black picture, or a free one has a lamp beside it.
TEST_CASE("a camera of a glTF that is surrounded has a lamp with it", "[gltf][import]") {
    const TemporaryFolder folder;
    const auto lightOf = [&](const Vec3d& camera, bool has_lamp) {
        GltfMaker maker;
        maker.add("materials", {{"name", "sky"}});
        std::vector<float> corners;
        for (const PaintedTriangle& t : trianglesOf({{{-9, -9, -9}, {9, 9, 9}, 0}}))
            for (const auto& way : {std::array<float, 3>{}, t.to_second, t.to_third})
                for (std::size_t k = 0; k < 3; ++k) corners.push_back(t.corner[k] + way[k]);
        maker.node({{"mesh", maker.mesh({{"attributes", {{"POSITION", maker.points(corners)}}},
                                         {"material", 0}})}});
        maker.add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 0.1}}}});
        maker.node({{"camera", 0}, {"translation", {camera[0], camera[1], camera[2]}}});
        if (has_lamp) {
            maker.root["extensions"]["KHR_lights_punctual"]["lights"] = {
                {{"type", "point"}, {"intensity", 2}}};
            maker.node({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
        }
        GltfFiles files;
        const CapturedLog log;
        return importModel(files, folder.write("a.glb", maker.glb())).scene;
    };
    CHECK_THAT(lightOf({0, 0, 0}, false), Contains("name: camera, type: point") && !Contains("type: sun"));
    CHECK_THAT(lightOf({0, 0, 30}, false), Contains("type: sun") && !Contains("type: point"));
    CHECK_THAT(lightOf({0, 0, 0}, true), !Contains("name: camera"));
}

// Fails when a format loses the choice, its materials or its placements on the way.
TEST_CASE("twenty thousand triangles on one spot, or boxes in each other, take seconds",
          "[import][limits]") {
    std::vector<PaintedTriangle> triangles;
    for (std::uint32_t i = 0; i < 20000; ++i)
        triangles.emplace_back(Vec3d{0, 0, 0}, Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, i);
    CHECK(secondsOf([&] { CHECK_FALSE(innerView(triangles, 1)); }) < 4 * kSecondsAllowed);
    const auto boxes = trianglesOf(std::vector<Box>(5000, {{-1, -1, -1}, {1, 1, 1}, 0}));
    CHECK(secondsOf([&] { CHECK_FALSE(distanceWithin(boxes, {0, 0, 0}, {1, 0, 0}, 3)); }) <
          4 * kSecondsAllowed);
}

TEST_CASE("a house as OBJ and as glTF is seen by a camera within it, with a lamp there", "[gltf][import]") {
    const TemporaryFolder folder;
    const auto importOf = [&](const std::string& path) {
        const CapturedLog log;
        GltfFiles files;
        const std::string text = importModel(files, path).scene;
        CHECK_THAT(log.text(), Contains("a camera inside it, where it sees more of the materials") &&
                                   Contains("a grey sky and a lamp at the camera"));
        CHECK_THAT(text, Contains("name: camera, type: point") && !Contains("type: sun"));
        return text;
    };
    folder.write("a.mtl", mtlOf(9));
    const std::string obj = importOf(folder.write("a.obj", objOf(kHouse)));

    GltfMaker maker;
    for (int i = 0; i < 9; ++i) maker.add("materials", {{"name", fmt::format("m{}", i)}});
    std::vector<Json> primitives;
    // Mirrored in the file, and by its node back again.
    forTriangles(kHouse, [&](const Vec3d& a, const Vec3d& b, const Vec3d& c, std::uint32_t material) {
        std::vector<float> corners;
        for (const Vec3d& p : {a, c, b}) {
            corners.push_back(static_cast<float>(-p[0]));
            for (std::size_t k : {1u, 2u}) corners.push_back(static_cast<float>(p[k]));
        }
        primitives.push_back(
            {{"attributes", {{"POSITION", maker.points(corners)}}}, {"material", material}});
    });
    const int mesh = maker.mesh(primitives[0]);
    maker.root["meshes"][static_cast<std::size_t>(mesh)]["primitives"] = primitives;
    maker.node({{"mesh", mesh}, {"scale", {-1, 1, 1}}});
    const std::string gltf = importOf(folder.write("a.glb", maker.glb()));
    const auto cameraOf = [](const std::string& text) {
        const std::size_t at = text.find("camera:");
        return text.substr(at, text.find('\n', at) - at);
    };
    CHECK(cameraOf(obj) == cameraOf(gltf));
}
