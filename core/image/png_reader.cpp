#include "image/png_reader.h"

#include "system/huge_pages.h"

#include <libdeflate.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <new>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

namespace crt::image {
namespace {

/// The whole image is in memory once more while its rows are made. Of larger ones libpng holds a few rows.
constexpr std::uint64_t kMostFilteredBytes = std::uint64_t{1} << 28;

constexpr std::size_t kSignatureBytes = 8;

std::uint32_t bigEndian(const unsigned char* bytes) {
    return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 |
           std::uint32_t{bytes[3]};
}

/// Large arrays, not cleared.
struct FileBytes {
    explicit FileBytes(std::size_t size_) : size(size_), data(new unsigned char[size_]) {
        adviseHugePages(data.get(), size);
    }
    std::size_t size;
    std::unique_ptr<unsigned char[]> data;
};

/// The IHDR of a file that is read here.
struct Kind {
    std::uint32_t width = 0, height = 0;
    std::size_t samples = 0;       ///< A pixel, alpha among them.
    std::size_t sample_bytes = 0;  ///< 1 or 2.

    std::size_t pixel() const { return samples * sample_bytes; }
    std::size_t row() const { return width * pixel(); }
    /// Each row with the byte of its filter before it.
    std::uint64_t filtered() const { return std::uint64_t{height} * (row() + 1); }
};

/// By the PNG Specification, 11.2.2. Nothing for palettes, fewer than 8 bits and interlaced images.
std::optional<Kind> kindOf(const unsigned char* header, const CrtTexelsInfo& info) {
    constexpr unsigned kGrey = 0, kRgb = 2, kGreyAlpha = 4, kRgbAlpha = 6;
    const unsigned bits = header[8], color = header[9];
    const bool plain = header[10] == 0 && header[11] == 0 && header[12] == 0;
    if (!plain || (bits != 8 && bits != 16)) return std::nullopt;
    Kind kind{bigEndian(header), bigEndian(header + 4), 0, bits / 8};
    switch (color) {
        case kGrey: kind.samples = 1; break;
        case kGreyAlpha: kind.samples = 2; break;
        case kRgb: kind.samples = 3; break;
        case kRgbAlpha: kind.samples = 4; break;
        default: return std::nullopt;
    }
    const bool same = kind.width == info.width && kind.height == info.height &&
                      (color & kRgb ? 3 : 1) == info.channels &&
                      (bits == 8 ? CRT_TEXELS_UINT8 : CRT_TEXELS_UINT16) == info.type;
    if (!same || kind.filtered() > kMostFilteredBytes) return std::nullopt;
    return kind;
}

std::optional<FileBytes> contentOf(const std::string& path, const CrtTexelsInfo& info) {
    // More than pixels take that cannot be compressed: 8 bytes each at most, and a byte a row.
    constexpr std::uint64_t kOtherChunks = std::uint64_t{16} << 20;
    const std::uint64_t pixels = std::uint64_t{info.width} * info.height;
    const std::uint64_t most = std::min(9 * pixels, kMostFilteredBytes) + kOtherChunks;
    std::error_code unknown;
    const std::uint64_t size = std::filesystem::file_size(path, unknown);
    if (unknown || size < kSignatureBytes || size > most) return std::nullopt;
    std::ifstream file(path, std::ios::binary);
    FileBytes bytes(size);
    if (!file.read(reinterpret_cast<char*>(bytes.data.get()), static_cast<std::streamsize>(size)))
        return std::nullopt;
    return bytes;
}

struct Compressed {
    Kind kind;
    std::size_t bytes = 0;  ///< Of pixels; moved together to the beginning of the file's content.
};

/// Nothing unless all that follows the header is as the specification has it: sound checksums, the pixels in
/// one sequence, and nothing else that must be understood.
std::optional<Compressed> compressedOf(FileBytes& file, const CrtTexelsInfo& info) {
    constexpr std::size_t kHead = 8, kHeader = 13, kChecksum = 4;
    unsigned char* const content = file.data.get();
    Compressed compressed;
    std::string_view before;
    bool began = false;
    for (std::size_t at = kSignatureBytes; file.size - at >= kHead + kChecksum;) {
        const std::size_t size = bigEndian(content + at);
        if (size > file.size - at - kHead - kChecksum) return std::nullopt;
        unsigned char* const data = content + at + kHead;
        const std::string_view name(reinterpret_cast<const char*>(data) - 4, 4);
        if (libdeflate_crc32(0, data - 4, size + 4) != bigEndian(data + size)) return std::nullopt;
        if (before.empty()) {
            if (name != "IHDR" || size != kHeader) return std::nullopt;
            const std::optional<Kind> kind = kindOf(data, info);
            if (!kind) return std::nullopt;
            compressed.kind = *kind;
            before = "IHDR";
        } else if (name == "IDAT") {
            if (began && before != "IDAT") return std::nullopt;
            std::memmove(content + compressed.bytes, data, size);
            compressed.bytes += size;
            began = true;
            before = "IDAT";
        } else if (name == "IEND") {
            if (!began) return std::nullopt;
            return compressed;
        } else {
            // Those that must be understood have a capital; tRNS makes an alpha.
            if ((name[0] & 0x20) == 0 || name == "tRNS") return std::nullopt;
            before = "other";
        }
        at += kHead + size + kChecksum;
    }
    return std::nullopt;
}

/// As many bytes as rows have; false unless the stream is sound, all of it.
bool inflate(const unsigned char* stream, std::size_t stream_bytes, FileBytes& filtered) {
    // A stream may promise a window of less than 32 KiB, which zlib sees kept and libdeflate does not.
    constexpr unsigned char kDeflateWith32KiB = 0x78;
    if (stream_bytes == 0 || stream[0] != kDeflateWith32KiB) return false;
    const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> decompressor(
        libdeflate_alloc_decompressor(), &libdeflate_free_decompressor);
    if (!decompressor) return false;
    std::size_t taken = 0;
    return libdeflate_zlib_decompress_ex(decompressor.get(), stream, stream_bytes, filtered.data.get(),
                                         filtered.size, &taken, nullptr) == LIBDEFLATE_SUCCESS &&
           taken == stream_bytes;
}

unsigned char paeth(int left, int above, int corner) {
    const int to_left = std::abs(above - corner), to_above = std::abs(left - corner),
              to_corner = std::abs(left + above - 2 * corner);
    return static_cast<unsigned char>(to_left <= to_above && to_left <= to_corner ? left
                                      : to_above <= to_corner                     ? above
                                                                                  : corner);
}

/// Undoes the filter of a row in place, by the PNG Specification, 9.2; `above`: the row before, undone.
template <std::size_t kPixel>
bool unfilter(unsigned filter, unsigned char* row, const unsigned char* above, std::size_t size) {
    const auto add = [&](std::size_t i, unsigned predicted) {
        row[i] = static_cast<unsigned char>(row[i] + predicted);
    };
    switch (filter) {
        case 0: return true;
        case 1:
            for (std::size_t i = kPixel; i < size; ++i) add(i, row[i - kPixel]);
            return true;
        case 2:
            for (std::size_t i = 0; i < size; ++i) add(i, above[i]);
            return true;
        case 3:
            for (std::size_t i = 0; i < kPixel; ++i) add(i, above[i] / 2u);
            for (std::size_t i = kPixel; i < size; ++i) add(i, (row[i - kPixel] + above[i]) / 2u);
            return true;
        case 4: {
            unsigned char left[kPixel] = {}, corner[kPixel] = {};
            for (std::size_t i = 0; i < size; i += kPixel)
                for (std::size_t k = 0; k < kPixel; ++k) {
                    add(i + k, paeth(left[k], above[i + k], corner[k]));
                    left[k] = row[i + k];
                    corner[k] = above[i + k];
                }
            return true;
        }
        default: return false;
    }
}

bool unfilter(const Kind& kind, unsigned char* row, const unsigned char* above) {
    const unsigned filter = row[-1];
    switch (kind.pixel()) {
        case 1: return unfilter<1>(filter, row, above, kind.row());
        case 2: return unfilter<2>(filter, row, above, kind.row());
        case 3: return unfilter<3>(filter, row, above, kind.row());
        case 4: return unfilter<4>(filter, row, above, kind.row());
        case 6: return unfilter<6>(filter, row, above, kind.row());
        default: return unfilter<8>(filter, row, above, kind.row());
    }
}

/// The colours of a row, without alpha, the lower byte of 16 bits first.
void takeColors(const Kind& kind, std::size_t channels, const unsigned char* row, unsigned char* out) {
    if (kind.samples == channels && kind.sample_bytes == 1) {
        std::memcpy(out, row, kind.row());
        return;
    }
    for (std::size_t x = 0; x < kind.width; ++x, row += kind.pixel())
        for (std::size_t k = 0; k < channels; ++k) {
            const unsigned char* const sample = row + k * kind.sample_bytes;
            for (std::size_t b = kind.sample_bytes; b-- > 0;) *out++ = sample[b];
        }
}

bool read(const std::string& path, const CrtTexelsInfo& info, unsigned char* buffer,
          std::uint64_t buffer_bytes) {
    std::optional<FileBytes> file = contentOf(path, info);
    if (!file) return false;
    const std::optional<Compressed> compressed = compressedOf(*file, info);
    if (!compressed) return false;
    const Kind& kind = compressed->kind;
    const std::size_t row = info.channels * kind.sample_bytes * kind.width;
    if (row * kind.height != buffer_bytes) return false;
    FileBytes filtered(kind.filtered());
    if (!inflate(file->data.get(), compressed->bytes, filtered)) return false;
    const std::vector<unsigned char> nothing(kind.row());
    const unsigned char* above = nothing.data();
    unsigned char* next = filtered.data.get() + 1;
    for (std::uint32_t y = 0; y < kind.height; ++y, next += kind.row() + 1) {
        if (!unfilter(kind, next, above)) return false;
        takeColors(kind, info.channels, next, buffer + y * row);
        above = next;
    }
    return true;
}

}  // namespace

bool readPng(const std::string& path, const CrtTexelsInfo& info, unsigned char* buffer,
             std::uint64_t buffer_bytes) {
    try {
        return read(path, info, buffer, buffer_bytes);
    } catch (const std::bad_alloc&) {
        return false;  // libpng takes less.
    }
}

}  // namespace crt::image
