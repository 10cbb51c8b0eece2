/// Feature mask → kernel: the smallest of those compiled ahead that covers the scene.
#pragma once

#include "embree_tree.h"

#include "backend/crt_backend.h"

#include <cstdint>

namespace crt::embree {

/// Samples [first_sample, +sample_count) of the pixels [x0,x1) × [y0,y1), into the film's arrays
/// (CrtFilmView's layout).
struct TileJob {
    const unsigned char* blob;
    const Tree* tree;  ///< Null: the kernel traces by itself.
    std::uint32_t x0, y0, x1, y1;
    std::uint64_t first_sample;
    std::uint32_t sample_count;
    double* sums;
    kernel::u64* counts;
    std::uint32_t* primitives;
    kernel::u64* splats;  ///< Null: the film takes none.
    bool (*cancelled)(void* host);  ///< Asked now and then; true: the job may end at any place.
    void* host;
};

struct RayTotals {
    std::uint64_t closest = 0, shadow = 0;
};

struct Program {
    const char* name;
    std::uint64_t features;
    RayTotals (*render)(const TileJob& job);  ///< [any thread], for disjoint pixels
};

const Program& chooseProgram(std::uint64_t scene_features, CrtKernelChoice choice);

}  // namespace crt::embree
