/// The block of memory that a compiled scene is (kernel/dialect/layout.h), while it grows.
#pragma once

#include "base/error.h"
#include "base/large_memory.h"
#include "compile/compile.h"
#include "kernel/dialect/layout.h"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace crt {

/// Arrays are appended behind the header, each on a 64-byte boundary.
class BlobWriter {
public:
    BlobWriter() { grow(sizeof(kernel::CrtScene)); }

    /// Reserves room for this number of bytes in all, so that hundreds of megabytes are not moved while they
    /// grow.
    void reserve(std::size_t bytes) {
        lines_.reserve(linesFor(bytes));
        touchLargeMemory(lines_.data() + lines_.size(), (lines_.capacity() - lines_.size()) * sizeof(Line));
    }

    template <class T>
    kernel::CrtSpan append(std::span<const T> items) {
        if (items.empty()) return {0, 0};
        const std::size_t offset = room(items.size_bytes());
        std::memcpy(bytes() + offset, items.data(), items.size_bytes());
        return {static_cast<std::uint32_t>(offset / 16), static_cast<std::uint32_t>(items.size())};
    }

    template <class T>
    kernel::CrtSpan append(const std::vector<T>& items) {
        return append(std::span<const T>(items));
    }

    /// Room for `count` items, all zero, which fill(std::span<T>) fills in.
    template <class T, class Fill>
    kernel::CrtSpan appendFilled(std::size_t count, const Fill& fill) {
        if (count == 0) return {0, 0};
        const std::size_t offset = room(count * sizeof(T));
        fill(std::span<T>(reinterpret_cast<T*>(bytes() + offset), count));
        return {static_cast<std::uint32_t>(offset / 16), static_cast<std::uint32_t>(count)};
    }

    /// The array that was appended, to be filled in when nothing more will be appended.
    template <class T>
    std::span<T> items(const kernel::CrtSpan& span) {
        return {reinterpret_cast<T*>(bytes() + std::size_t{span.offset} * 16), span.count};
    }

    std::vector<CompiledScene::Line> finish(const kernel::CrtScene& header) {
        std::memcpy(bytes(), &header, sizeof(header));
        return std::move(lines_);
    }

private:
    using Line = CompiledScene::Line;
    static std::size_t linesFor(std::size_t bytes) { return (bytes + sizeof(Line) - 1) / sizeof(Line); }
    unsigned char* bytes() { return reinterpret_cast<unsigned char*>(lines_.data()); }
    /// Offset at which `bytes` more begin.
    std::size_t room(std::size_t bytes) {
        const std::size_t offset = lines_.size() * sizeof(Line);
        // 64 GiB is what offsets of 16 bytes in 32 bits reach.
        if ((offset + bytes) / 16 > std::numeric_limits<std::uint32_t>::max())
            throw Error(ErrorKind::Scene, "the scene is too large: its compiled form exceeds 64 GiB");
        grow(bytes);
        return offset;
    }
    void grow(std::size_t bytes) { lines_.resize(lines_.size() + linesFor(bytes)); }

    std::vector<Line> lines_;
};

}  // namespace crt
