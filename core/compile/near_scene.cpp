#include "compile/near_scene.h"

#include "base/log.h"
#include "base/parallel.h"
#include "compile/accelerator.h"
#include "compile/blob_writer.h"
#include "compile/bvh_build.h"
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
        const Range range = rangeOf(box);
        marked_ += range.cells();
        if (marked_ > kMostMarked) return false;
        forEach(range, [&](std::uint64_t bit) {
            bits_[bit / 64] |= std::uint64_t{1} << bit % 64;
            return false;
        });
        return true;
    }

    bool anyMarked(const TriangleBounds& box) const {
        const Range range = rangeOf(box);
        return range.cells() > kMostLooks ||
               forEach(range, [&](std::uint64_t bit) { return (bits_[bit / 64] >> bit % 64 & 1) != 0; });
    }

private:
    static constexpr int kLogBits = 26;  // 8 MB
    static constexpr std::uint64_t kBits = std::uint64_t{1} << kLogBits;
    static constexpr std::uint64_t kMostMarked = kBits / 16;
    static constexpr std::uint64_t kMostLooks = 4096;

    struct Range {
        std::array<std::uint32_t, 3> first, last;
        std::uint64_t cells() const {
            std::uint64_t product = 1;
            for (std::size_t k = 0; k < 3; ++k) product *= last[k] - first[k] + 1;
            return product;
        }
    };

    Range rangeOf(const TriangleBounds& box) const {
        const auto cell = [&](float x) {
            return static_cast<std::uint32_t>(std::clamp((x + 1) * 0.5f * side_, 0.0f, side_ - 1));
        };
        Range range{};
        for (std::size_t k = 0; k < 3; ++k) {
            range.first[k] = cell(box.lower[k]);
            range.last[k] = cell(box.upper[k]);
        }
        return range;
    }

    /// Until `visit` returns true; whether it did.
    template <class Visit>
    static bool forEach(const Range& range, const Visit& visit) {
        for (std::uint32_t z = range.first[2]; z <= range.last[2]; ++z)
            for (std::uint32_t y = range.first[1]; y <= range.last[1]; ++y)
                for (std::uint32_t x = range.first[0]; x <= range.last[0]; ++x) {
                    const std::uint64_t cell = (std::uint64_t{z} << 20 | std::uint64_t{y} << 10 | x) + 1;
                    if (visit(cell * 0x9e3779b97f4a7c15ull >> (64 - kLogBits)))
                        return true;  // Fibonacci hashing
                }
        return false;
    }

    float side_;
    std::uint64_t marked_ = 0;
    std::vector<std::uint64_t> bits_;
};

/// Slots of the triangles that come near what is asked.
std::vector<std::uint32_t> slotsNearAsked(const CompiledScene& scene, const kernel::CrtScene& header) {
    const auto* triangles = CRT_ARRAY(CrtTriangle, scene.data(), header.triangles);
    const auto* faces = CRT_ARRAY(CrtFace, scene.data(), header.faces);
    const auto* primitives = CRT_ARRAY(CrtPrimitive, scene.data(), header.primitives);
    const std::uint32_t count = header.triangle_count;
    const float largest = largestClearance(faces, count);
    // All surfaces that near_surfaces.h reaches lie within this distance of the triangle: rays go as far as
    // the largest clearance, and begin some epsilon off.
    const float reach = 2 * largest + 64 * CRT_EPSILON;

    MarkedCells cells(count);
    const std::uint64_t step = askedEmitterStep(scene.emitters);
    bool all = false;
    for (std::uint32_t slot = 0; slot < count && scene.emitters > 0 && !all; ++slot) {
        const std::uint32_t emitter = primitives[triangles[slot].id].light;
        if (emitter != CRT_NONE && emitter % step == 0) all = !cells.mark(boundsOf(triangles[slot], reach));
    }
    for (const std::uint32_t id : askedTriangles(scene.triangles)) {
        TriangleBounds middle{};
        for (std::size_t k = 0; k < 3; ++k) {
            const float* p = triangles[id].p + 3 * k;  // without nodes a triangle's slot is its id
            middle.lower[k] = (p[0] + p[1] + p[2]) / 3 - reach;
            middle.upper[k] = (p[0] + p[1] + p[2]) / 3 + reach;
        }
        all = !cells.mark(middle) || all;
    }
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
