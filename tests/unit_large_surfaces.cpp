// Surfaces so large that single precision falsifies the light of a lamp near them.
#include "catch.h"
#include "compile/compile.h"
#include "compile/large_surfaces.h"
#include "scene_texts.h"

#include <fmt/format.h>

#include <string>

using crt::LargeSurface;

namespace {

/// A ground of half size `half` and a lamp of size 1 at height 1 over it.
std::optional<LargeSurface> found(const std::string& ground, double half, double lamp_turn_deg = 90) {
    const std::string quad = fmt::format(
        "positions: [[-{0},0,-{0}],[-{0},0,{0}],[{0},0,{0}],[{0},0,-{0}]], faces: [[0,1,2,3]]", half);
    std::string text = ground;
    for (std::size_t at; (at = text.find("QUAD")) != std::string::npos;) text.replace(at, 4, quad);
    for (std::size_t at; (at = text.find("HALF")) != std::string::npos;)
        text.replace(at, 4, fmt::format("{}", half));
    const crt::Scene scene = crt::test::parse(fmt::format(R"(
camera: {{position: [0.3, 2, -3], target: [0.3, 0, 0.2], fov: 40}}
materials: {{floor: {{type: diffuse, reflectance: 0.5}}, lamp: {{type: diffuse, reflectance: 0}}}}
objects:
  - {{name: ground, material: floor, {}}}
  - {{rectangle: {{size: [1, 1]}}, material: lamp, emission: {{radiance: 1}},
      transform: [{{rotate: {{axis: [1, 0, 0], angle_deg: {}}}}}, {{translate: [0.3, 1, 0.2]}}]}}
)",
                                                          text, lamp_turn_deg));
    const crt::test::Quiet quiet;
    return findLargeSurface(crt::compileScene(scene, 0), {});
}

}  // namespace

TEST_CASE("ground that crt does not divide is found where its clearance falsifies a light",
          "[large-surfaces]") {
    for (const char* ground :
         {"mesh: {QUAD, colors: [[1,1,1],[1,1,1],[1,1,1],[1,1,1]]}", "mesh: {QUAD}, emission: {radiance: 1}",
          "mesh: {QUAD}, transforms: [[{translate: [0, 0, 0]}], [{translate: [0, -5, 0]}]]",
          "mesh: {QUAD}, share: always"}) {
        CAPTURE(ground);
        const std::optional<LargeSurface> large = found(ground, 1e4);
        REQUIRE(large);
        // Scattered rays see this lamp 12.7 % too bright.
        CHECK(large->error == Approx(0.127).epsilon(0.3));
        CHECK(large->height == Approx(1).epsilon(1e-4));
        CHECK(2 * large->clearance / large->height == Approx(large->error));
        CHECK_FALSE(found(ground, 10));
        // A lamp that shines upwards does not light the ground.
        CHECK_FALSE(found(ground, 1e4, -90));
    }
    const std::optional<LargeSurface> ball =
        found("sphere: {radius: HALF}, transform: [{translate: [0, -HALF, 0]}]", 1e4);
    REQUIRE(ball);
    CHECK(ball->error == Approx(0.039).epsilon(0.5));
}

TEST_CASE("ground that crt divides, and disks, hold the light near them", "[large-surfaces]") {
    for (const double half : {10.0, 1e4, 1e5}) {
        CAPTURE(half);
        CHECK_FALSE(found("mesh: {QUAD}", half));
        CHECK_FALSE(
            found("disk: {radius: HALF}, transform: [{rotate: {axis: [1, 0, 0], angle_deg: -90}}]", half));
    }
}
