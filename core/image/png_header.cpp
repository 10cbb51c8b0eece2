#include "image/png_header.h"

#include "image/exif_orientation.h"
#include "image/icc_profile.h"
#include "image/image_bounds.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string_view>

namespace crt::image {
namespace {

std::uint64_t bigEndianIn(std::string_view bytes, std::size_t at) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
    return value;
}

/// The bytes of a chunk.
using ReadChunk = std::function<std::string()>;
using TakeChunk = std::function<void(std::string_view name, std::uint64_t size, const ReadChunk& read)>;

/// By the PNG Specification, 5.3: length (big-endian), name, as many bytes, checksum. Throws DamagedHeader
/// unless every chunk lies within the file.
void forEachPngChunk(const std::string& path, const TakeChunk& take) {
    constexpr std::uint64_t kSignatureBytes = 8, kHeadBytes = 8, kChecksumBytes = 4;
    std::ifstream file(path, std::ios::binary);
    const std::uint64_t file_bytes = std::filesystem::file_size(path);
    std::string name;
    for (std::uint64_t at = kSignatureBytes; name != "IEND";) {
        std::string head(kHeadBytes, '\0');
        file.seekg(static_cast<std::streamoff>(at));
        if (!file.read(head.data(), kHeadBytes)) throw DamagedHeader("it ends before its last chunk");
        const std::uint64_t size = bigEndianIn(head, 0);
        name = head.substr(4);
        at += kHeadBytes + size + kChecksumBytes;
        if (at > file_bytes) throw DamagedHeader("one of its chunks goes beyond the end of the file");
        take(name, size, [&] {
            std::string bytes(size, '\0');
            file.read(bytes.data(), static_cast<std::streamsize>(size));
            return bytes;
        });
    }
}

constexpr std::size_t kPngHeaderBytes = 13;

/// By the PNG Specification, 11.2.2; 0 for a kind of colour that there is not.
std::uint64_t pngBitsAPixel(const std::string& header) {
    constexpr unsigned char kSamples[] = {1, 0, 3, 1, 2, 0, 4};
    const auto color = static_cast<unsigned char>(header[9]);
    return color < std::size(kSamples)
               ? kSamples[color] * std::uint64_t{static_cast<unsigned char>(header[8])}
               : 0;
}

}  // namespace

void checkPngHeader(const std::string& path) {
    std::uint64_t row_bits = 0, rows = 0, width = 0, deflated = 0;
    forEachPngChunk(path, [&](std::string_view name, std::uint64_t size, const ReadChunk& read) {
        if (name == "IHDR") {
            const std::string header = read();
            if (header.size() < kPngHeaderBytes) throw DamagedHeader("its header is too short");
            width = bigEndianIn(header, 0);
            rows = bigEndianIn(header, 4);
            row_bits = width * pngBitsAPixel(header);
        } else if (name == "IDAT") {
            deflated += size;
        }
    });
    if (width == 0 || rows == 0) throw DamagedHeader("its header says that it has no pixels");
    requireRoom(width, rows, static_cast<double>(row_bits) / 8 * static_cast<double>(rows),
                kDeflateBytesAByte * static_cast<double>(deflated));
}

CrtUnappliedTags tagsOfPng(const std::string& path) {
    constexpr std::uint64_t kMostExifBytes = 65536, kMostProfileBytes = std::uint64_t{4} << 20;
    constexpr double kUnits = 100000;
    CrtUnappliedTags tags{};
    bool is_srgb = false, has_profile = false;
    std::string profile;
    forEachPngChunk(path, [&](std::string_view name, std::uint64_t size, const ReadChunk& read) {
        if (name == "sRGB") is_srgb = true;
        if (name == "gAMA" && size == 4) tags.gamma = static_cast<float>(bigEndianIn(read(), 0) / kUnits);
        if (name == "cHRM" && size == 32) {
            const std::string chunk = read();  // The white comes first.
            for (std::size_t i = 0; i < 8; ++i)
                tags.chromaticities[(i + 6) % 8] =
                    static_cast<float>(static_cast<double>(bigEndianIn(chunk, 4 * i)) / kUnits);
        }
        if (name == "iCCP") {
            has_profile = true;
            profile = size <= kMostProfileBytes ? nameUnlessSrgbOfPng(read()) : "of more than 4 MiB";
        }
        if (name == "cICP" && size == 4)
            tags.code_points = static_cast<std::uint32_t>(bigEndianIn(read(), 0));
        if (name == "eXIf" && size <= kMostExifBytes) tags.orientation = exifOrientation(read());
    });
    // PNG Specification, third edition, 4.3: cICP counts before iCCP, that before sRGB, and that before the
    // others.
    if (tags.code_points != 0) profile.clear();
    if (tags.code_points != 0 || has_profile || is_srgb) {
        tags.gamma = 0;
        std::fill(std::begin(tags.chromaticities), std::end(tags.chromaticities), 0.0f);
    }
    profile.copy(tags.profile, sizeof tags.profile - 1);
    return tags;
}

}  // namespace crt::image
