/// The border between the plugin and its kernels, of which some are compiled while it runs: the tree that a
/// kernel traverses, and the job that it does. Plain data.
#pragma once

#include <cstdint>

namespace crt::embree {

/// The address of a Node8; that of a Leaf8, marked; or a slot that holds no triangle. Addresses are
/// multiples of 64.
using Child = std::uintptr_t;
inline constexpr Child kLeaf = 1, kSlot = 2, kMarks = 63;
inline constexpr unsigned kSlotShift = 6;

struct alignas(64) Node8 {
    float bounds[6][8];  ///< Lower x, upper x, lower y, … of each child; of those that are not, empty.
    Child child[8];
};
static_assert(sizeof(Node8) == 256);

/// Eight triangles side by side. Where there is none the coordinates are NaN, which no ray hits.
struct alignas(64) Leaf8 {
    float p[9][8];  ///< CrtTriangle::p of each.
    std::uint32_t slot[8];
};
static_assert(sizeof(Leaf8) == 320);

/// Of nodes: Embree's, and one of slots.
inline constexpr std::uint32_t kMostLevels = 33;

/// Samples [first_sample, +sample_count) of the pixels [x0,x1) × [y0,y1), into the film's arrays
/// (CrtFilmView's layout).
struct TileJob {
    const unsigned char* blob;
    Child tree;  ///< The root; 0: the kernel traces by itself.
    std::uint32_t x0, y0, x1, y1;
    std::uint64_t first_sample;
    std::uint32_t sample_count;
    double* sums;
    std::uint64_t* counts;
    std::uint32_t* primitives;
    std::uint64_t* splats;          ///< Null: the film takes none.
    bool (*cancelled)(void* host);  ///< Asked now and then; true: the job may end at any place.
    void* host;
};

struct RayTotals {
    std::uint64_t closest, shadow;
};

/// [any thread], for disjoint pixels
using RenderTile = RayTotals (*)(const TileJob& job);

}  // namespace crt::embree

// The kernels of this backend carry the root along, and trace with it (kernels.h).
#define CRT_CONTEXT_EXTRA crt::embree::Child tree;
#define CRT_BACKEND_TRACE
// Two pixels take turns (kernels.h).
#define CRT_TAKES_TURNS 1
