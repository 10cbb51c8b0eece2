#include "compile/near_pairs.h"

#include "base/parallel.h"
#include "compile/accelerator.h"
#include "compile/context_of.h"
#include "compile/coplanar.h"
#include "compile/grid_cells.h"
#include "compile/near_surfaces.h"
#include "kernel/geometry/slots.h"
#include "kernel/geometry/surface.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

namespace crt {
namespace {

using kernel::CrtFace;
using kernel::CrtPrimitive;
using kernel::CrtTriangle;
using kernel::u64;  // CRT_ARRAY computes with it

constexpr std::size_t kSlotsOfPart = std::size_t{1} << 13;  // of what a thread looks at, at a time

/// A place where something is looked for that lies too near to the surface of a slot.
struct Asked {
    TriangleBounds box;
    std::uint32_t slot;
    std::uint32_t first_ray;  ///< Of two; CRT_NONE: the surface is a light, and others of its plane count.
};

bool meet(const TriangleBounds& a, const TriangleBounds& b) {
    bool meets = true;
    for (std::size_t k = 0; k < 3; ++k)
        meets = meets && a.lower[k] <= b.upper[k] && b.lower[k] <= a.upper[k];
    return meets;
}

/// Places within ±1 by the cells that they meet. The cells of a level are twice as large as those
/// before. A place is in the first level of whose cells it meets at most 8.
class Places {
public:
    /// `typical`: some of the boxes that will be visited. The smallest cells are as small as they can be
    /// while such a box meets few of them.
    Places(std::vector<Asked> asked, const std::vector<TriangleBounds>& typical);

    /// Calls visit(place) for all whose boxes meet `box`, some of them repeatedly. Returns the number of
    /// boxes that were looked at.
    template <class Visit>
    std::uint64_t visitAll(const TriangleBounds& box, const Visit& visit) const {
        std::uint64_t looks = 0;
        const auto look = [&](std::uint32_t i) {
            ++looks;
            if (meet(box, asked_[i].box)) visit(asked_[i]);
        };
        for (std::size_t level = 0; level < levels_.size(); ++level) {
            const std::vector<std::uint32_t>& places = levels_[level];
            if (places.empty()) continue;
            const CellRange range = rangeOf(box, level);
            if (range.cells() > places.size()) {
                for (const std::uint32_t i : places) look(i);
                continue;
            }
            forEachCell(range, level, [&](std::size_t bucket) {
                ++looks;
                for (std::uint32_t e = first_[bucket]; e < first_[bucket + 1]; ++e) look(entries_[e]);
            });
        }
        return looks;
    }

private:
    CellRange rangeOf(const TriangleBounds& box, std::size_t level) const {
        return cellsOf(box, std::ldexp(side_, -static_cast<int>(level)));
    }

    template <class Visit>
    void forEachCell(const CellRange& range, std::size_t level, const Visit& visit) const {
        anyCell(range, [&](std::uint64_t cell) {
            visit(cellHash(std::uint64_t{level + 1} << 30 | cell, log_buckets_));
            return false;
        });
    }

    std::vector<Asked> asked_;
    float side_;  ///< Cells of the first level along an axis.
    int log_buckets_;
    std::vector<std::vector<std::uint32_t>> levels_;
    std::vector<std::uint32_t> first_, entries_;  ///< Places by the hash of their cells.
};

Places::Places(std::vector<Asked> asked, const std::vector<TriangleBounds>& typical)
    : asked_(std::move(asked)) {
    constexpr std::uint64_t kFewCells = 32;
    constexpr float kLeastSide = 64, kMostSide = 65536;
    const auto meetFew = [&] {
        std::uint64_t cells = 0;
        for (const TriangleBounds& box : typical)
            cells += std::min<std::uint64_t>(rangeOf(box, 0).cells(), 64 * kFewCells);
        return cells <= kFewCells * typical.size();
    };
    for (side_ = kMostSide; side_ > kLeastSide && !meetFew();) side_ /= 2;
    levels_.resize(std::size_t{1} + static_cast<std::size_t>(std::ilogb(side_)));
    log_buckets_ = std::max(10, static_cast<int>(std::bit_width(8 * asked_.size())));
    std::vector<std::size_t> level_of(asked_.size());
    for (std::uint32_t i = 0; i < asked_.size(); ++i) {
        std::size_t& level = level_of[i];
        while (rangeOf(asked_[i].box, level).cells() > 8) ++level;
        levels_[level].push_back(i);
    }
    const auto forEachEntry = [&](const auto& visit) {
        for (std::uint32_t i = 0; i < asked_.size(); ++i)
            forEachCell(rangeOf(asked_[i].box, level_of[i]), level_of[i],
                        [&](std::size_t bucket) { visit(bucket, i); });
    };
    // Counts, their sums, and then the entries from the last of each bucket to the first.
    first_.resize((std::size_t{1} << log_buckets_) + 1);
    forEachEntry([&](std::size_t bucket, std::uint32_t) { ++first_[bucket]; });
    std::uint32_t sum = 0;
    for (std::uint32_t& first : first_) first = sum += first;
    entries_.resize(sum);
    forEachEntry([&](std::size_t bucket, std::uint32_t i) { entries_[--first_[bucket]] = i; });
}

/// A ray of a place that is asked about, and what it hits.
struct Hit {
    std::uint32_t ray;
    kernel::CrtHit hit;
};

/// Looks at pairs of surfaces of a scene.
class Pairs {
public:
    explicit Pairs(const CompiledScene& scene);

    bool any() const;

private:
    struct Ray {
        NormalRay from;
        kernel::CrtShear shear;
    };

    float reach() const { return reachOf(largest_); }
    std::vector<Asked> askedPlaces();
    std::vector<TriangleBounds> typicalBoxes() const;
    bool isCoplanar(const Asked& light, std::uint32_t other) const;
    void hitBy(const Asked& asked, std::uint32_t slot, std::vector<Hit>& hits) const;
    bool anyNear(const std::vector<std::vector<Hit>>& parts) const;

    const CompiledScene& scene_;
    kernel::CrtContext context_;
    const CrtTriangle* triangles_;
    const CrtPrimitive* primitives_;
    std::uint32_t count_;
    float largest_;
    std::vector<Ray> rays_;             ///< Two for each triangle that is asked about and has area.
    std::vector<std::uint32_t> slots_;  ///< Its slot, for each of them.
    Places places_;
};

Pairs::Pairs(const CompiledScene& scene)
    : scene_(scene),
      context_(contextOf(scene)),
      triangles_(CRT_ARRAY(CrtTriangle, context_.blob, context_.scene->triangles)),
      primitives_(CRT_ARRAY(CrtPrimitive, context_.blob, context_.scene->primitives)),
      count_(context_.scene->triangle_count),
      largest_(largestClearance(CRT_ARRAY(CrtFace, context_.blob, context_.scene->faces), count_)),
      places_(askedPlaces(), typicalBoxes()) {}

/// Without nodes a triangle's slot is its id.
std::vector<Asked> Pairs::askedPlaces() {
    std::vector<Asked> all;
    for (const std::uint32_t slot : askedEmitters(scene_))
        all.push_back({boundsOf(triangles_[slot], reach()), slot, CRT_NONE});
    if (context_.scene->max_depth == 0) return all;
    for (const std::uint32_t slot : askedTriangles(scene_.triangles)) {
        const auto rays = normalRays(context_, slot, largest_);
        if (!rays) continue;
        all.push_back(
            {aroundMiddle(triangles_[slot], reach()), slot, static_cast<std::uint32_t>(rays_.size())});
        for (const NormalRay& from : *rays) {
            rays_.push_back({from, kernel::crt_shear(from.ray)});
            slots_.push_back(slot);
        }
    }
    return all;
}

std::vector<TriangleBounds> Pairs::typicalBoxes() const {
    constexpr std::size_t kBoxes = 1000;
    std::vector<std::uint32_t> slots = askedTriangles(scene_.triangles);
    slots.resize(std::min(slots.size(), kBoxes));
    std::vector<TriangleBounds> boxes;
    for (const std::uint32_t slot : slots) boxes.push_back(boundsOf(triangles_[slot], reach()));
    return boxes;
}

bool Pairs::isCoplanar(const Asked& light, std::uint32_t other) const {
    if (light.slot == other ||
        primitives_[triangles_[other].id].light == primitives_[triangles_[light.slot].id].light)
        return false;
    const Corners own = cornersOf(context_.blob, light.slot), corners = cornersOf(context_.blob, other);
    return inOnePlane(own, corners) && overlap(own, corners);
}

/// Of a triangle itself, too: what lies behind it counts no more than with findNearSurfaces.
void Pairs::hitBy(const Asked& asked, std::uint32_t slot, std::vector<Hit>& hits) const {
    for (std::uint32_t i = asked.first_ray; i < asked.first_ray + 2; ++i) {
        const auto& [from, shear] = rays_[i];
        kernel::CrtHit hit = kernel::crt_no_hit(from.ray.reach);
        kernel::crt_test_slot(&context_, triangles_, slot, from.ray, shear, &hit);
        if (hit.slot != CRT_NONE) hits.push_back({i, hit});
    }
}

/// Of several hits of a ray the nearest counts, and of equally near ones the lower id.
bool Pairs::anyNear(const std::vector<std::vector<Hit>>& parts) const {
    constexpr float kAnywhere = std::numeric_limits<float>::infinity();
    std::vector<kernel::CrtHit> best(rays_.size(), kernel::crt_no_hit(kAnywhere));
    for (const std::vector<Hit>& part : parts)
        for (const auto& [ray, hit] : part)
            if (hit.t < best[ray].t || (hit.t == best[ray].t && hit.id < best[ray].id)) best[ray] = hit;
    for (std::size_t i = 0; i < best.size(); ++i)
        if (best[i].slot != CRT_NONE && best[i].slot != slots_[i] &&
            clearanceBeyond(context_, slots_[i], rays_[i].from, best[i]))
            return true;
    return false;
}

bool Pairs::any() const {
    constexpr std::uint64_t kMostLooks = 10'000'000, kMostOfSlot = 64;
    std::atomic<std::uint64_t> looks{0};
    std::atomic<bool> found{false};
    std::vector<std::vector<Hit>> hits(partsOf(count_, kSlotsOfPart));
    parallelFor(count_, kSlotsOfPart, [&](std::size_t first, std::size_t end) {
        std::uint64_t own_looks = 0;
        for (auto slot = static_cast<std::uint32_t>(first); slot < end && !found; ++slot) {
            if (triangles_[slot].shape >= CRT_SLOT_INSTANCE) continue;
            own_looks += places_.visitAll(boundsOf(triangles_[slot], reach()), [&](const Asked& asked) {
                if (asked.first_ray != CRT_NONE)
                    hitBy(asked, slot, hits[first / kSlotsOfPart]);
                else if (!found && isCoplanar(asked, slot))
                    found = true;
            });
            if (looks + own_looks > kMostLooks + kMostOfSlot * count_) found = true;  // It would take long.
        }
        looks += own_looks;
    });
    return found || anyNear(hits);
}

}  // namespace

bool mayHaveNearSurfaces(const CompiledScene& scene) { return Pairs(scene).any(); }

}  // namespace crt
