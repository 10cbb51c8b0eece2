// Triangles of absorbing bodies that lie on those of others: marked as all pairs say.
#include "catch.h"
#include "compile/coplanar.h"
#include "compiled_scenes.h"
#include "kernel/dialect/layout.h"
#include "scene_texts.h"

#include <cstdint>
#include <set>
#include <string>

using namespace compile_test;

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
