// Exif 2.32 (CIPA DC-008), 4.5: a file of TIFF, whose first directory has the orientation.
#include "image/exif_orientation.h"

#include <cstddef>

namespace crt::image {

std::uint32_t exifOrientation(std::string_view exif) {
    constexpr std::size_t kHead = 8, kCountBytes = 2, kEntryBytes = 12;
    constexpr std::uint32_t kOrientation = 0x0112, kShort = 3, kMost = 8;
    if (exif.size() < kHead) return 0;
    const bool little = exif.substr(0, 2) == "II";
    if (!little && exif.substr(0, 2) != "MM") return 0;
    const auto number = [&](std::size_t at, std::size_t bytes) {
        std::uint32_t value = 0;
        for (std::size_t i = 0; i < bytes; ++i)
            value = value << 8 | static_cast<unsigned char>(exif[at + (little ? bytes - 1 - i : i)]);
        return value;
    };
    const std::size_t directory = number(4, 4);
    if (directory > exif.size() - kCountBytes) return 0;
    const std::size_t entries = number(directory, kCountBytes);
    for (std::size_t i = 0; i < entries; ++i) {
        const std::size_t at = directory + kCountBytes + i * kEntryBytes;
        if (at + kEntryBytes > exif.size()) return 0;
        if (number(at, 2) != kOrientation || number(at + 2, 2) != kShort) continue;
        const std::uint32_t orientation = number(at + kEntryBytes - 4, 2);
        return orientation <= kMost ? orientation : 0;
    }
    return 0;
}

}  // namespace crt::image
