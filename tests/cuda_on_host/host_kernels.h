/// Launches of the CUDA kernels, run as loops over grid, block and thread. The kernels promise that no
/// thread waits for another; so any order will do.
#pragma once

#include "backend/sdk/launch_pacer.h"

#include <cstdint>

namespace crt::cuda_on_host {

/// Film arrays as the kernels take them.
struct FilmPointers {
    double* sums;
    std::uint64_t* counts;
    std::uint32_t* primitives;
    std::uint64_t* splats;  ///< One plane, whatever the number of slices; null: none.
};

std::uint32_t rayCounterPairs();

/// crt_render over `launch`, in `slices` rows of the grid. `rays` has rayCounterPairs() pairs.
void launchRender(const void* scene_blob, const Launch& launch, std::uint32_t slices,
                  const FilmPointers& film, std::uint64_t* rays, unsigned host_threads);

/// The same by crt_trace and crt_shade_queue.
void launchWave(const void* scene_blob, const Launch& launch, std::uint32_t slices, const FilmPointers& film,
                std::uint64_t* rays, unsigned host_threads);

/// crt_add_slices over the pixels of `launch`.
void launchAddSlices(const void* scene_blob, const Launch& launch, std::uint32_t slices,
                     const FilmPointers& film, const FilmPointers& parts, unsigned host_threads);

/// A kernel by its name, with arguments as cuLaunchKernel takes them: a pointer to each. False when there is
/// none of that name.
bool launchByName(const char* name, unsigned grid_x, unsigned grid_y, unsigned block, void** arguments,
                  unsigned host_threads);
bool hasKernel(const char* name);

}  // namespace crt::cuda_on_host
