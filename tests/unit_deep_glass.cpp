// Views through more surfaces of glass than max_depth lets paths pass.
#include "catch.h"
#include "render/deep_glass.h"
#include "scene_texts.h"

#include <fmt/format.h>

#include <string>

using crt::deepGlass;
using crt::DeepGlass;

namespace {

/// Slabs of glass across the view, and what `more` adds.
crt::Scene slabs(int count, int depth, const std::string& more = {}, const char* glass = "dielectric") {
    std::string objects;
    for (int i = 0; i < count; ++i)
        objects += fmt::format("  - {{box: {{size: [9, 9, 0.2]}}, material: glass, "
                               "transform: [{{translate: [0, 0, {}]}}]}}\n",
                               2 + i);
    return crt::test::parse(fmt::format(R"(
camera: {{position: [0.01, 0.02, 0], target: [0.01, 0.02, 1], fov: 20}}
integrator: {{max_depth: {}}}
environment: {{radiance: 1}}
materials:
  glass: {{type: {}, ior: 1.5}}
  wall: {{type: diffuse, reflectance: 0.5}}
objects:
{}{})",
                                        depth, glass, objects, more));
}

}  // namespace

TEST_CASE("glass that max_depth is too small for is found, with its share of the view", "[deep-glass]") {
    const std::optional<DeepGlass> nine = deepGlass(slabs(9, 16));
    REQUIRE(nine);
    CHECK(nine->surfaces == 18);
    CHECK(nine->share == 1);
    // 14 surfaces leave too few events for what is reflected between them; 10 leave enough.
    CHECK(deepGlass(slabs(7, 16)));
    CHECK_FALSE(deepGlass(slabs(5, 16)));
    CHECK_FALSE(deepGlass(slabs(9, 24)));
    CHECK_FALSE(deepGlass(slabs(0, 1, "  - {rectangle: {size: [9, 9]}, material: wall}\n")));
    // Panes are passed without an event, and rough glass is glass.
    CHECK_FALSE(deepGlass(slabs(9, 16, {}, "thin_dielectric")));
    CHECK(deepGlass(slabs(9, 16, {}, "rough_dielectric, roughness: 0.3")));
}

TEST_CASE("glass behind something opaque is not in the view", "[deep-glass]") {
    const char* wall =
        "  - {rectangle: {size: [9, 9]}, material: wall, transform: [{translate: [0, 0, 1]}]}\n";
    CHECK_FALSE(deepGlass(slabs(9, 16, wall)));
    // A sphere that hides a part of it, and a wall behind four slabs.
    const std::optional<DeepGlass> beside =
        deepGlass(slabs(9, 16, "  - {sphere: {radius: 0.15}, material: wall, "
                               "transform: [{translate: [0, 0, 1]}]}\n"));
    REQUIRE(beside);
    CHECK(beside->share > 0.2);
    CHECK(beside->share < 0.95);
    const char* between =
        "  - {rectangle: {size: [9, 9]}, material: wall, transform: [{translate: [0, 0, 5.5]}]}\n";
    CHECK_FALSE(deepGlass(slabs(9, 16, between)));
}

TEST_CASE("spheres of glass have two surfaces each", "[deep-glass]") {
    std::string balls;
    for (int i = 0; i < 4; ++i)
        balls += fmt::format("  - {{sphere: {{radius: 0.4}}, material: glass, "
                             "transform: [{{scale: 2}}, {{translate: [0, 0, {}]}}]}}\n",
                             3 + 2 * i);
    const std::optional<DeepGlass> found = deepGlass(slabs(0, 8, balls));
    REQUIRE(found);
    CHECK(found->surfaces == 8);
    CHECK(found->share < 1);
    CHECK_FALSE(deepGlass(slabs(0, 12, balls)));
}

TEST_CASE("rays meet glass anywhere in the view, and it alone", "[deep-glass]") {
    // Slabs from the middle of the view to its corner, seen from 0, 0, 0: 64 of 256 rays. In each corner.
    for (const double x : {-1.0, 1.0})
        for (const double y : {-1.0, 1.0}) {
            std::string stack;
            for (int i = 0; i < 9; ++i)
                stack += fmt::format(
                    "  - {{box: {{size: [9, 9, 0.2]}}, material: glass, "
                    "transform: [{{translate: [{}, {}, {}]}}]}}\n",
                    0.01 + 4.501 * x, 0.02 + 4.501 * y, 2 + i);
            const std::optional<DeepGlass> found = deepGlass(slabs(0, 16, stack));
            REQUIRE(found);
            CHECK(found->share == 0.25);
            CHECK(found->surfaces == 18);
        }
    // Around the camera, so that triangles cross its plane: one surface each. Behind it there is none.
    std::string shells, behind;
    for (int i = 0; i < 9; ++i) {
        shells += fmt::format("  - {{box: {{size: [{0}, {0}, {0}]}}, material: glass}}\n", 1 + 0.1 * i);
        behind += fmt::format(
            "  - {{box: {{size: [9, 9, 0.2]}}, material: glass, "
            "transform: [{{translate: [0, 0, {}]}}]}}\n",
            -2 - i);
    }
    const std::optional<DeepGlass> around = deepGlass(slabs(0, 8, shells));
    REQUIRE(around);
    CHECK(around->share == 1);
    CHECK(around->surfaces == 9);
    CHECK_FALSE(deepGlass(slabs(0, 8, behind)));
}
