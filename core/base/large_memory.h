/// Memory of many megabytes, which the system takes longer to give than a program to fill.
#pragma once

#include "base/parallel.h"
#include "system/huge_pages.h"

#include <cstddef>

namespace crt {

/// Has all threads touch memory that is about to be filled, in pages of 2 MiB where the system has them. Its
/// contents are lost. Does nothing with less than 8 MB.
inline void touchLargeMemory(void* memory, std::size_t bytes) {
    constexpr std::size_t kPage = 4096, kPart = std::size_t{4} << 20;
    if (bytes < 2 * kPart) return;
    adviseHugePages(memory, bytes);
    auto* const first = static_cast<unsigned char*>(memory);
    parallelFor(bytes, kPart, [first](std::size_t begin, std::size_t end) {
        for (std::size_t at = begin; at < end; at += kPage) first[at] = 0;
    });
}

}  // namespace crt
