/// What a kernel is compiled from.
#pragma once

#include <cstdint>

namespace crt::cuda {

/// The kernel of a module, by its bit in CRT_ENTRIES of kernels.cu.
enum class Entry : std::uint32_t { Render = 1, Trace = 2, Shade = 4, Choose = 8 };
/// Its name in kernels.cu.
const char* entryName(Entry entry);

/// What a module is compiled from.
struct KernelSpec {
    Entry entry = Entry::Render;
    std::uint64_t features = 0;
    bool operator==(const KernelSpec& other) const {
        return entry == other.entry && features == other.features;
    }
};

}  // namespace crt::cuda
