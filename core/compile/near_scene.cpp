#include "compile/near_scene.h"

#include "base/log.h"
#include "base/parallel.h"
#include "compile/accelerator.h"
#include "compile/blob_writer.h"
#include "compile/bvh_build.h"
#include "compile/grid_cells.h"
#include "compile/near_surfaces.h"
#include "kernel/geometry/surface.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

namespace crt {
namespace {

using kernel::CrtFace;
using kernel::CrtPrimitive;
using kernel::CrtTriangle;
using kernel::u64;  // CRT_ARRAY computes with it

constexpr std::size_t kSlotsAtOnce = std::size_t{1} << 16;  // of what a thread looks at, at a time

/// Space within ±1 as cells, some of them marked. Cells share the bits of a hash table, so that an unmarked
/// one may look marked, never the other way round.
class MarkedCells {
public:
    /// Cells about as large as the triangles of a surface with this number of triangles.
    explicit MarkedCells(std::size_t triangles)
        : side_(static_cast<float>(std::clamp<std::size_t>(
              std::bit_ceil(static_cast<std::size_t>(std::sqrt(static_cast<double>(triangles)))), 64,
              1024))),
          bits_(kBits / 64) {}

    /// Returns false if the search is pointless because too many cells are marked.
    bool mark(const TriangleBounds& box) {
        const CellRange range = cellsOf(box, side_);
        marked_ += range.cells();
        if (marked_ > kMostMarked) return false;
        anyCell(range, [&](std::uint64_t cell) {
            const std::uint64_t bit = cellHash(cell + 1, kLogBits);
            bits_[bit / 64] |= std::uint64_t{1} << bit % 64;
            return false;
        });
        return true;
    }

    bool anyMarked(const TriangleBounds& box) const {
        const CellRange range = cellsOf(box, side_);
        return range.cells() > kMostLooks || anyCell(range, [&](std::uint64_t cell) {
                   const std::uint64_t bit = cellHash(cell + 1, kLogBits);
                   return (bits_[bit / 64] >> bit % 64 & 1) != 0;
               });
    }

private:
    static constexpr int kLogBits = 26;  // 8 MB
    static constexpr std::uint64_t kBits = std::uint64_t{1} << kLogBits;
    static constexpr std::uint64_t kMostMarked = kBits / 16;
    static constexpr std::uint64_t kMostLooks = 4096;

    float side_;
    std::uint64_t marked_ = 0;
    std::vector<std::uint64_t> bits_;
};

/// Slots of the triangles that come near what is asked.
std::vector<std::uint32_t> slotsNearAsked(const CompiledScene& scene, const kernel::CrtScene& header) {
    const auto* triangles = CRT_ARRAY(CrtTriangle, scene.data(), header.triangles);
    const auto* faces = CRT_ARRAY(CrtFace, scene.data(), header.faces);
    const std::uint32_t count = header.triangle_count;
    const float reach = reachOf(largestClearance(faces, count));

    MarkedCells cells(count);
    bool all = false;
    // Without nodes a triangle's slot is its id.
    for (const std::uint32_t id : askedEmitters(scene))
        all = all || !cells.mark(boundsOf(triangles[id], reach));
    for (const std::uint32_t id : askedTriangles(scene.triangles))
        all = all || !cells.mark(aroundMiddle(triangles[id], reach));
    std::vector<std::vector<std::uint32_t>> parts(partsOf(count, kSlotsAtOnce));
    parallelFor(count, kSlotsAtOnce, [&](std::size_t first, std::size_t end) {
        for (std::size_t slot = first; slot < end; ++slot)
            if (triangles[slot].shape < CRT_SLOT_INSTANCE &&
                (all || cells.anyMarked(boundsOf(triangles[slot], reach))))
                parts[first / kSlotsAtOnce].push_back(static_cast<std::uint32_t>(slot));
    });
    std::vector<std::uint32_t> near;
    for (const std::vector<std::uint32_t>& part : parts) near.insert(near.end(), part.begin(), part.end());
    return near;
}

}  // namespace

CompiledScene nearScene(const CompiledScene& scene) {
    kernel::CrtScene header = scene.header();
    const auto* triangles = CRT_ARRAY(CrtTriangle, scene.data(), header.triangles);
    const auto* faces = CRT_ARRAY(CrtFace, scene.data(), header.faces);
    const auto* primitives = CRT_ARRAY(CrtPrimitive, scene.data(), header.primitives);

    const std::vector<std::uint32_t> near = slotsNearAsked(scene, header);
    std::vector<TriangleBounds> bounds;
    bounds.reserve(near.size());
    for (const std::uint32_t slot : near) bounds.push_back(boundsOf(triangles[slot], 0));
    logDebug("{} of {} triangles are checked for near surfaces", near.size(), scene.triangles);
    Bvh bvh;
    if (near.empty())  // all are instances: there is nothing to make a tree of
        header.accelerator = CRT_ACCELERATOR_BRUTE_FORCE;
    else
        bvh = buildBvh(bounds, CRT_BOX_PADDING, "looking for surfaces too near to each other");

    std::vector<CrtTriangle> near_triangles;
    std::vector<CrtFace> near_faces;
    for (const std::uint32_t i : bvh.order) {
        near_triangles.push_back(triangles[near[i]]);
        near_faces.push_back(faces[near[i]]);
    }
    BlobWriter blob;
    header.nodes = blob.append(bvh.nodes);
    header.triangles = blob.append(near_triangles);
    header.faces = blob.append(near_faces);
    header.triangle_count = static_cast<std::uint32_t>(near.size());
    header.primitives = blob.append(std::span<const CrtPrimitive>(primitives, header.primitives.count));
    const auto* shapes = CRT_ARRAY(kernel::CrtShape, scene.data(), header.shapes);
    header.shapes = blob.append(std::span<const kernel::CrtShape>(shapes, header.shapes.count));

    CompiledScene reduced;
    reduced.blob = blob.finish(header);
    reduced.size_bytes = reduced.blob.size() * sizeof(CompiledScene::Line);
    reduced.triangles = scene.triangles;
    reduced.shapes = scene.shapes;
    reduced.instances = scene.instances;
    reduced.emitters = scene.emitters;
    reduced.scale_exponent = scene.scale_exponent;
    return reduced;
}

}  // namespace crt
