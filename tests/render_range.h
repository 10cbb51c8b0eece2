/// Ranges of pixels and samples, as backends are asked for them.
#pragma once

#include "backend/crt_backend.h"

#include <cstdint>

/// The pixels from (x0, y0) to before (x1, y1), and of each `count` samples from `first`.
inline CrtRenderRange renderRange(std::uint32_t x0, std::uint32_t y0, std::uint32_t x1, std::uint32_t y1,
                                  std::uint64_t first, std::uint64_t count) {
    CrtRenderRange range{};
    range.struct_size = sizeof(range);
    range.x0 = x0;
    range.y0 = y0;
    range.x1 = x1;
    range.y1 = y1;
    range.first_sample = first;
    range.sample_count = count;
    return range;
}
