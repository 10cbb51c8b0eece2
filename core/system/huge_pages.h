/// Huge pages for large arrays: to be handed gigabytes in pages of 4 KiB takes as long as to decode them.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>

namespace crt {

/// Asks the system to back what is not in use yet of this memory by pages of 2 MiB. Changes nothing where it
/// has none. Pages are handed out whole: not for memory of which most is never touched.
inline void adviseHugePages(void* memory, std::size_t bytes) {
    constexpr std::uintptr_t kHugePage = std::uintptr_t{2} << 20;
    const auto address = reinterpret_cast<std::uintptr_t>(memory);
    const std::uintptr_t first = (address + kHugePage - 1) & ~(kHugePage - 1),
                         end = (address + bytes) & ~(kHugePage - 1);
    if (first < end) (void)::madvise(reinterpret_cast<void*>(first), end - first, MADV_HUGEPAGE);
}

}  // namespace crt
