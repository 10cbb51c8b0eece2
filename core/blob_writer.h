/// The block of memory that a compiled scene is (kernel/layout.h), while it grows.
#pragma once

#include "error.h"
#include "kernel/layout.h"

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
    BlobWriter() : bytes_(sizeof(kernel::CrtScene)) {}

    template <class T>
    kernel::CrtSpan append(std::span<const T> items) {
        if (items.empty()) return {0, 0};
        bytes_.resize((bytes_.size() + 63) / 64 * 64);
        const std::size_t offset = bytes_.size();
        // 64 GiB is what offsets of 16 bytes in 32 bits reach.
        if ((offset + items.size_bytes()) / 16 > std::numeric_limits<std::uint32_t>::max())
            throw Error(ErrorKind::Scene, "the scene is too large: its compiled form exceeds 64 GiB");
        bytes_.resize(offset + items.size_bytes());
        std::memcpy(bytes_.data() + offset, items.data(), items.size_bytes());
        return {static_cast<std::uint32_t>(offset / 16), static_cast<std::uint32_t>(items.size())};
    }

    template <class T>
    kernel::CrtSpan append(const std::vector<T>& items) {
        return append(std::span<const T>(items));
    }

    std::vector<unsigned char> finish(const kernel::CrtScene& header) {
        std::memcpy(bytes_.data(), &header, sizeof(header));
        bytes_.resize((bytes_.size() + 63) / 64 * 64);
        return std::move(bytes_);
    }

private:
    std::vector<unsigned char> bytes_;
};

}  // namespace crt
