/// The inputs from which a kernel of a GPU-like backend is compiled.
#pragma once

#include <cstdint>

namespace crt::plugin {

/// An entry point, by its bit in CRT_ENTRIES of a backend's kernels file.
enum class Entry : std::uint32_t { Render = 1, Trace = 2, Shade = 4, Choose = 8 };

/// Its name there.
inline const char* entryName(Entry entry) {
    switch (entry) {
        case Entry::Trace: return "crt_trace";
        case Entry::Shade: return "crt_shade_queue";
        case Entry::Choose: return "crt_choose_queue";
        case Entry::Render: break;
    }
    return "crt_render";
}

struct KernelSpec {
    Entry entry = Entry::Render;
    std::uint64_t features = 0;
    bool operator==(const KernelSpec& other) const {
        return entry == other.entry && features == other.features;
    }
};

}  // namespace crt::plugin
