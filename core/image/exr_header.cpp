#include "image/exr_header.h"

#include "image/image_bounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
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

/// DWAB makes at best two halves of 64, and Deflate the rest; it takes floats for halves.
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

}  // namespace crt::image
