#include "image/image_headers.h"

#include "image/exif_orientation.h"
#include "image/icc_profile.h"
#include "image/memory_bound.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <string_view>

namespace crt::image {
namespace {

/// The first bytes of a file, taken off the front. Little-endian as every machine that crt runs on
/// (checkpoint.cpp).
class Bytes {
public:
    explicit Bytes(std::string_view rest) : rest_(rest) {}

    std::size_t left() const { return rest_.size(); }
    bool empty() const { return rest_.empty(); }
    std::string_view take(std::uint64_t size, const std::string& what) {
        if (size > rest_.size())
            throw DamagedHeader(fmt::format("{} goes beyond the end of the file", what));
        const std::string_view taken = rest_.substr(0, size);
        rest_.remove_prefix(size);
        return taken;
    }
    std::uint32_t u32(const std::string& what) {
        std::uint32_t value;
        std::memcpy(&value, take(sizeof value, what).data(), sizeof value);
        return value;
    }
    /// Up to and without a NUL.
    std::string text(const std::string& what) {
        constexpr std::size_t kMaxLength = 255;
        const std::size_t end = rest_.find('\0');
        if (end == std::string_view::npos || end > kMaxLength)
            throw DamagedHeader(fmt::format("{} has no end", what));
        const std::string value(rest_.substr(0, end));
        rest_.remove_prefix(end + 1);
        return value;
    }

private:
    std::string_view rest_;
};

std::uint64_t bigEndianIn(std::string_view bytes, std::size_t at) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
    return value;
}

/// As much of a file as a header takes.
std::string beginningOf(const std::string& path) {
    constexpr std::size_t kMaxHeaderBytes = std::size_t{16} << 20;
    std::ifstream file(path, std::ios::binary);
    std::string bytes(std::min<std::uintmax_t>(std::filesystem::file_size(path), kMaxHeaderBytes), '\0');
    file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
    return bytes;
}

/// Types of attributes whose size is the type's: OpenEXR reads that many bytes whatever the file says.
const std::map<std::string_view, std::uint32_t>& fixedSizes() {
    static const std::map<std::string_view, std::uint32_t> sizes{{"box2f", 16},
                                                                 {"box2i", 16},
                                                                 {"chromaticities", 32},
                                                                 {"compression", 1},
                                                                 {"deepImageState", 1},
                                                                 {"double", 8},
                                                                 {"envmap", 1},
                                                                 {"float", 4},
                                                                 {"int", 4},
                                                                 {"keycode", 28},
                                                                 {"lineOrder", 1},
                                                                 {"m33d", 72},
                                                                 {"m33f", 36},
                                                                 {"m44d", 128},
                                                                 {"m44f", 64},
                                                                 {"rational", 8},
                                                                 {"tiledesc", 9},
                                                                 {"timecode", 8},
                                                                 {"v2d", 16},
                                                                 {"v2f", 8},
                                                                 {"v2i", 8},
                                                                 {"v3d", 24},
                                                                 {"v3f", 12},
                                                                 {"v3i", 12}};
    return sizes;
}

/// Header of a part of an EXR file.
struct Part {
    std::uint64_t width = 0, height = 0, channels = 0;
};

/// The most bytes that one byte of Deflate expands to: two bits repeat 258 bytes.
constexpr double kDeflateBytesAByte = 1032;

/// Throws DamagedHeader when pixels of `bytes` do not come out of a file that holds `most_bytes` at most.
void requireRoom(std::uint64_t width, std::uint64_t height, double bytes, double most_bytes) {
    if (bytes > most_bytes)
        throw DamagedHeader(fmt::format(
            "its header says {} x {} pixels, more than a file of its size can hold", width, height));
}

/// Of EXR. DWAB makes at best two halves of 64, and Deflate the rest; it takes floats for halves.
void checkPixels(const std::string& path, std::uint64_t width, std::uint64_t height,
                 std::uint64_t channels) {
    constexpr double kLossyBytesAByte = 32 * 2;
    const double bytes =
        4.0 * static_cast<double>(width) * static_cast<double>(height) * static_cast<double>(channels);
    if (bytes == 0) throw DamagedHeader("its header says that it has no pixels");
    requireRoom(
        width, height, bytes,
        kLossyBytesAByte * kDeflateBytesAByte * static_cast<double>(std::filesystem::file_size(path)));
}

/// The value of an attribute, by "OpenEXR File Layout" (openexr.com). Attributes that are not listed here
/// are opaque to OpenEXR, too.
void checkValue(const std::string& path, const std::string& name, const std::string& type,
                std::string_view value, Part& part) {
    const std::string what = fmt::format("its attribute '{}'", name);
    const auto fixed = fixedSizes().find(type);
    if (fixed != fixedSizes().end() && value.size() != fixed->second)
        throw DamagedHeader(fmt::format("{} has {} bytes and its type, {}, takes {}", what, value.size(),
                                        type, fixed->second));
    Bytes bytes(value);
    if (type == "chlist") {
        constexpr std::uint64_t kBytesAChannel = 16;  // Type, linearity, sampling.
        std::uint64_t channels = 0;
        for (; !bytes.text(what).empty(); ++channels) bytes.take(kBytesAChannel, what);
        if (name == "channels") part.channels = channels;
        if (!bytes.empty()) throw DamagedHeader(fmt::format("{} has more bytes than channels", what));
    } else if (type == "stringvector") {
        while (!bytes.empty()) bytes.take(bytes.u32(what), what);
    } else if (type == "preview") {
        const std::uint64_t width = bytes.u32(what), height = bytes.u32(what);
        if (bytes.left() % 4 != 0 || width > bytes.left() || height > bytes.left() ||
            width * height != bytes.left() / 4)
            throw DamagedHeader(fmt::format("{} does not have {} x {} pixels", what, width, height));
    } else if (type == "tiledesc") {
        const std::uint64_t width = bytes.u32(what), height = bytes.u32(what);
        checkPixels(path, width, height, 1);
    } else if (type == "box2i" && (name == "dataWindow" || name == "displayWindow")) {
        std::int64_t corner[4];
        for (std::int64_t& c : corner) c = static_cast<std::int32_t>(bytes.u32(what));
        if (corner[2] < corner[0] || corner[3] < corner[1])
            throw DamagedHeader(fmt::format("{} is empty", what));
        // The display window may be any size; it holds no pixels.
        if (name == "dataWindow") {
            part.width = static_cast<std::uint64_t>(corner[2] - corner[0] + 1);
            part.height = static_cast<std::uint64_t>(corner[3] - corner[1] + 1);
        }
    }
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

void checkExrHeader(const std::string& path) {
    constexpr std::uint32_t kMultipart = 0x1000;
    const std::string beginning = beginningOf(path);
    Bytes bytes(beginning);
    bytes.u32("its mark");
    const bool multipart = bytes.u32("its version") & kMultipart;
    // A header is attributes and an empty name; several end with an empty header.
    for (bool more = true; more;) {
        more = false;
        Part part;
        for (std::string name = bytes.text("its header"); !name.empty(); name = bytes.text("its header")) {
            const std::string what = fmt::format("its attribute '{}'", name), type = bytes.text(what);
            checkValue(path, name, type, bytes.take(bytes.u32(what), what), part);
            more = multipart;
        }
        if (part.width == 0 || part.channels == 0)
            continue;  // OpenEXR says what is missing, and allocates nothing.
        checkPixels(path, part.width, part.height, part.channels);
        constexpr std::uint64_t kMostBytesAChannel = 4;
        checkRows(part.width, part.height, part.channels * kMostBytesAChannel);
    }
}

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

void checkMemory(std::uint64_t width, std::uint64_t height, std::uint64_t bytes_a_pixel,
                 std::uint64_t most_bytes) {
    if (width == 0 || height == 0) throw DamagedHeader("its header says that it has no pixels");
    const std::string why = refusalForMemory(width, height, bytes_a_pixel, most_bytes);
    if (!why.empty()) throw DamagedHeader(why);
}

void checkRows(std::uint64_t width, std::uint64_t height, std::uint64_t bytes_a_pixel) {
    constexpr double kMostBytes =
        1 << 30;  // 64 rows of 65,535 pixels, the widest film, with 64 channels of floats
    const double row_bytes = static_cast<double>(width) * static_cast<double>(bytes_a_pixel);
    if (row_bytes * static_cast<double>(kStripRows) >
        std::max(kMostBytes, row_bytes * static_cast<double>(height)))
        throw DamagedHeader(fmt::format("its rows of {} pixels are longer than can be read", width));
}

void checkChannels(std::uint64_t pixels, std::uint64_t bytes_a_pixel, std::uint64_t channels,
                   std::uint64_t bytes_read_a_pixel) {
    constexpr std::uint64_t kMostTimes = 64, kAlwaysBytes = std::uint64_t{1} << 30;
    if (bytes_a_pixel > kMostTimes * bytes_read_a_pixel && bytes_a_pixel * pixels > kAlwaysBytes)
        throw DamagedHeader(
            fmt::format("it has {} channels, and all of them are decoded to read some; above {} GiB of "
                        "pixels it may hold {} times what is read; write the channels that are needed into "
                        "a separate file",
                        channels, kAlwaysBytes >> 30, kMostTimes));
}

}  // namespace crt::image
