#include "compile/touching_media.h"

#include "compile/box.h"
#include "compile/coplanar.h"
#include "kernel/dialect/features.h"
#include "kernel/dialect/layout.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace crt {
namespace {

using namespace kernel;

/// A triangle that bounds a medium.
struct Bounding {
    std::uint32_t slot, id, object;
    Box box;
};

std::vector<Bounding> boundingTriangles(const unsigned char* blob) {
    const auto& scene = *reinterpret_cast<const CrtScene*>(blob);
    const auto* triangles = CRT_ARRAY(CrtTriangle, blob, scene.triangles);
    const auto* primitives = CRT_ARRAY(CrtPrimitive, blob, scene.primitives);
    const auto* materials = CRT_ARRAY(CrtMaterial, blob, scene.materials);
    std::vector<Bounding> all;
    for (std::uint32_t slot = 0; slot < scene.triangle_count; ++slot) {
        const CrtTriangle& triangle = triangles[slot];
        if (triangle.shape != 0) continue;  // a shape or an instance
        const CrtPrimitive& primitive = primitives[triangle.id];
        if (materials[primitive.material].medium == 0) continue;
        const Corners corners = cornersOf(blob, slot);
        Box box;
        for (const Vec3d& p : corners.p) box.add(p, corners.clearance);
        all.push_back({slot, triangle.id, primitive.object, box});
    }
    return all;
}

/// For each object: the boxes of the others that meet its own.
std::vector<std::vector<Box>> boxesAround(const std::vector<Bounding>& all) {
    struct Object {
        std::uint32_t number;
        Box box;
    };
    std::uint32_t last = 0;
    for (const Bounding& b : all) last = std::max(last, b.object);
    std::vector<Box> boxes(last + std::size_t{1});
    for (const Bounding& b : all) boxes[b.object].add(b.box);
    std::vector<Object> objects;
    for (std::uint32_t i = 0; i < boxes.size(); ++i)
        if (boxes[i].lower[0] <= boxes[i].upper[0]) objects.push_back({i, boxes[i]});
    std::sort(objects.begin(), objects.end(),
              [](const Object& a, const Object& b) { return a.box.lower[0] < b.box.lower[0]; });
    std::vector<std::vector<Box>> around(boxes.size());
    for (auto a = objects.begin(); a != objects.end(); ++a)
        for (auto b = a + 1; b != objects.end() && b->box.lower[0] <= a->box.upper[0]; ++b)
            if (a->box.meets(b->box)) {
                around[a->number].push_back(b->box);
                around[b->number].push_back(a->box);
            }
    return around;
}

/// Leaves those out that are far from all other objects.
void keepNearOthers(std::vector<Bounding>& all) {
    const std::vector<std::vector<Box>> around = boxesAround(all);
    std::erase_if(all, [&](const Bounding& b) {
        const std::vector<Box>& others = around[b.object];
        return std::none_of(others.begin(), others.end(),
                            [&](const Box& other) { return b.box.meets(other); });
    });
}

}  // namespace

void markTouchingMedia(unsigned char* blob) {
    const auto& scene = *reinterpret_cast<const CrtScene*>(blob);
    if ((scene.features & CRT_FEATURE_MEDIA) == 0) return;
    std::vector<Bounding> all = boundingTriangles(blob);
    if (std::all_of(all.begin(), all.end(),
                    [&](const Bounding& b) { return b.object == all.front().object; }))
        return;
    keepNearOthers(all);
    // Sweep and prune along one axis (Baraff 1992).
    std::sort(all.begin(), all.end(), [](const Bounding& a, const Bounding& b) {
        return a.box.lower[0] != b.box.lower[0] ? a.box.lower[0] < b.box.lower[0] : a.id < b.id;
    });
    std::vector<std::uint32_t> touching;  // Ids. Marked at the end: objects are compared until then.
    for (auto a = all.begin(); a != all.end(); ++a)
        for (auto b = a + 1; b != all.end() && b->box.lower[0] <= a->box.upper[0]; ++b) {
            if (a->object == b->object || !a->box.meets(b->box)) continue;
            const Corners of_a = cornersOf(blob, a->slot), of_b = cornersOf(blob, b->slot);
            if (!inOnePlane(of_a, of_b) || !overlap(of_a, of_b)) continue;
            touching.push_back(a->id);
            touching.push_back(b->id);
        }
    auto* primitives = const_cast<CrtPrimitive*>(CRT_ARRAY(CrtPrimitive, blob, scene.primitives));
    for (const std::uint32_t id : touching) primitives[id].object |= CRT_PRIMITIVE_TOUCHES;
}

}  // namespace crt
