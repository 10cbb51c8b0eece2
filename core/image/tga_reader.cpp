// Truevision TGA File Format Specification 2.0 (1991); the numbers of fields are its own.
#include "image/tga_reader.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <vector>

namespace crt::image {
namespace {

constexpr std::size_t kHeaderBytes = 18, kFooterBytes = 26, kExtensionBytes = 495;
constexpr unsigned kMapped = 1, kColor = 2, kGrey = 3, kRuns = 8;  // Field 3.

struct Header {
    unsigned id_bytes, map_type, kind;
    bool runs;
    unsigned map_first, map_length, map_depth;
    unsigned width, height, depth, descriptor;

    unsigned alphaBits() const { return descriptor & 15; }
    bool fromTheRight() const { return (descriptor & 16) != 0; }
    bool fromTheTop() const { return (descriptor & 32) != 0; }
    std::size_t pixelBytes() const { return (depth + 7) / 8; }
    std::size_t mapEntryBytes() const { return (map_depth + 7) / 8; }
    std::uint64_t mapBytes() const {
        return map_type == 0 ? 0 : std::uint64_t{map_length} * mapEntryBytes();
    }
};

Header headerOf(const std::array<unsigned char, kHeaderBytes>& bytes) {
    const auto pair = [&](std::size_t at) { return bytes[at] + 256u * bytes[at + 1]; };
    return {bytes[0], bytes[1],  bytes[2] & ~kRuns, (bytes[2] & kRuns) != 0,
            pair(3),  pair(5),   bytes[7],          pair(12),
            pair(14), bytes[16], bytes[17]};
}

bool isColorDepth(unsigned depth) { return depth == 15 || depth == 16 || depth == 24 || depth == 32; }

bool isPlausible(const Header& header) {
    if (header.map_type > 1 || (header.map_type == 1 && !isColorDepth(header.map_depth))) return false;
    if (header.width == 0 || header.height == 0) return false;
    switch (header.kind) {
        case kMapped: return header.map_type == 1 && (header.depth == 8 || header.depth == 16);
        case kColor: return isColorDepth(header.depth);
        case kGrey: return header.depth == 8;
        default: return false;
    }
}

struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, Close>;

bool take(const File& file, unsigned char* to, std::size_t bytes) {
    return std::fread(to, 1, bytes, file.get()) == bytes;
}

bool takeHeader(const File& file, Header& header) {
    std::array<unsigned char, kHeaderBytes> bytes;
    if (!file || !take(file, bytes.data(), bytes.size())) return false;
    header = headerOf(bytes);
    return isPlausible(header);
}

struct Pixel {
    unsigned char red, green, blue, alpha;
};

/// Of 15, 16, 24 or 32 bits, as they lie in the file: blue first.
Pixel colorOf(const unsigned char* bytes, unsigned depth) {
    if (depth >= 24) return {bytes[2], bytes[1], bytes[0], depth == 32 ? bytes[3] : std::uint8_t{255}};
    const unsigned bits = bytes[0] + 256u * bytes[1];
    const auto wide = [&](unsigned shift) {
        const unsigned five = bits >> shift & 31;
        return static_cast<unsigned char>(five << 3 | five >> 2);
    };
    return {wide(10), wide(5), wide(0), static_cast<unsigned char>(bits >> 15 != 0 ? 255 : 0)};
}

/// The type of alpha in field 24 of a file with an extension area; 3, "useful", without one.
unsigned alphaMeaning(const File& file, std::uint64_t file_bytes) {
    constexpr unsigned kUseful = 3;
    std::array<unsigned char, kFooterBytes> footer;
    if (file_bytes < kHeaderBytes + kFooterBytes ||
        std::fseek(file.get(), -static_cast<long>(kFooterBytes), SEEK_END) != 0 ||
        !take(file, footer.data(), footer.size()) ||
        !std::equal(footer.begin() + 8, footer.end(), "TRUEVISION-XFILE."))
        return kUseful;
    const std::uint64_t at =
        footer[0] + 256u * footer[1] + 65536u * footer[2] + (std::uint64_t{footer[3]} << 24);
    unsigned char meaning = 0;
    if (at == 0 || at + kExtensionBytes > file_bytes ||
        std::fseek(file.get(), static_cast<long>(at + kExtensionBytes - 1), SEEK_SET) != 0 ||
        !take(file, &meaning, 1))
        return kUseful;
    return meaning;
}

/// Puts pixels where they belong, in the order in which the file has them.
class Canvas {
public:
    Canvas(const Header& header, std::vector<Pixel> map, TexelPart part, std::size_t channels,
           unsigned char* to)
        : header_(header), map_(std::move(map)), part_(part), channels_(channels), to_(to) {}

    std::uint64_t left() const { return std::uint64_t{header_.width} * header_.height - next_; }

    /// False for a colour that the map does not have.
    bool put(const unsigned char* bytes) {
        Pixel pixel;
        if (header_.kind == kGrey) {
            pixel = {bytes[0], bytes[0], bytes[0], 255};
        } else if (header_.kind == kColor) {
            pixel = colorOf(bytes, header_.depth);
        } else {
            const unsigned index = bytes[0] + (header_.depth == 16 ? 256u * bytes[1] : 0u);
            if (index < header_.map_first || index - header_.map_first >= map_.size()) return false;
            pixel = map_[index - header_.map_first];
        }
        const std::uint64_t row = next_ / header_.width, column = next_ % header_.width;
        const std::uint64_t y = header_.fromTheTop() ? row : header_.height - 1 - row,
                            x = header_.fromTheRight() ? header_.width - 1 - column : column;
        unsigned char* const at = to_ + (y * header_.width + x) * channels_;
        at[0] = part_ == TexelPart::Alpha ? pixel.alpha : pixel.red;
        if (channels_ == 3) at[1] = pixel.green, at[2] = pixel.blue;
        ++next_;
        return true;
    }

private:
    const Header& header_;
    std::vector<Pixel> map_;
    TexelPart part_;
    std::size_t channels_;
    unsigned char* to_;
    std::uint64_t next_ = 0;
};

constexpr const char* kEndsEarly = "it ends before its pixels do";

/// Empty when all is well.
std::string takePixels(const File& file, const Header& header, Canvas& canvas) {
    constexpr std::size_t kLongestRun = 128;
    std::array<unsigned char, kLongestRun * 4> bytes;
    const std::size_t pixel = header.pixelBytes();
    while (canvas.left() > 0) {
        // Without runs, a file is as one in which no packet has a head.
        std::size_t count = std::min<std::uint64_t>(kLongestRun, canvas.left()), different = count;
        if (header.runs) {
            unsigned char head = 0;
            if (!take(file, &head, 1)) return kEndsEarly;
            count = (head & 127u) + 1u;
            different = (head & 128u) != 0 ? 1 : count;
            if (count > canvas.left()) return "it has more pixels than its header says";
        }
        if (!take(file, bytes.data(), different * pixel)) return kEndsEarly;
        for (std::size_t i = 0; i < count; ++i)
            if (!canvas.put(bytes.data() + (different == 1 ? 0 : i * pixel)))
                return "a pixel has a colour that is not in the colour map";
    }
    return {};
}

}  // namespace

bool beginsAsTga(const char* path) {
    Header header;
    return takeHeader(File(std::fopen(path, "rbe")), header);
}

std::string readTga(const char* path, TexelPart part, CrtTexelsInfo* info, unsigned char* buffer,
                    std::uint64_t buffer_bytes) {
    const File file(std::fopen(path, "rbe"));
    Header header;
    if (!takeHeader(file, header)) return "it is not a TGA file";
    if ((header.descriptor & 0xc0) != 0) return "its rows are interleaved, which crt does not support; save "
                                                "it without interleaving";
    std::error_code unknown;
    const std::uint64_t file_bytes = std::filesystem::file_size(path, unknown);
    const std::uint64_t pixels = std::uint64_t{header.width} * header.height,
                        before = kHeaderBytes + header.id_bytes + header.mapBytes();
    const std::uint64_t least =
        header.runs ? (pixels + 127) / 128 * (1 + header.pixelBytes()) : pixels * header.pixelBytes();
    if (unknown || before + least > file_bytes)
        return "its header says more pixels than a file of its size can hold";

    const unsigned color_depth = header.kind == kMapped ? header.map_depth : header.depth;
    bool has_alpha =
        header.kind != kGrey && header.alphaBits() > 0 && (color_depth == 16 || color_depth == 32);
    if (has_alpha) {
        const unsigned meaning = alphaMeaning(file, file_bytes);
        if (meaning == 4) return "its colours are premultiplied by alpha; save it without premultiplication";
        has_alpha = meaning == 3;
    }
    info->width = header.width;
    info->height = header.height;
    info->channels = part == TexelPart::Alpha ? has_alpha : header.kind == kGrey ? 1 : 3;
    info->type = CRT_TEXELS_UINT8;
    if (buffer == nullptr || info->channels == 0) return {};
    if (pixels * info->channels != buffer_bytes) return "it has changed while it was read";

    if (std::fseek(file.get(), static_cast<long>(kHeaderBytes + header.id_bytes), SEEK_SET) != 0)
        return kEndsEarly;
    std::vector<unsigned char> map_bytes(header.mapBytes());
    if (!take(file, map_bytes.data(), map_bytes.size())) return kEndsEarly;
    std::vector<Pixel> map(header.map_type == 0 ? 0 : header.map_length);
    for (std::size_t i = 0; i < map.size(); ++i)
        map[i] = colorOf(&map_bytes[i * header.mapEntryBytes()], header.map_depth);
    Canvas canvas(header, std::move(map), part, info->channels, buffer);
    return takePixels(file, header, canvas);
}

}  // namespace crt::image
