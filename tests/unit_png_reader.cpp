// PNG textures by libdeflate: the pixels are those that the file was made of; every file that is damaged, or
// of a kind that libpng is to read, is left to it.
#include "base/error.h"
#include "base/temporary_folder.h"
#include "catch.h"
#include "file_bytes.h"
#include "image/image_io.h"
#include "image/png_reader.h"
#include "image/srgb_encoding.h"
#include "image/texels.h"
#include "png_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

using namespace crt;

namespace {

std::string noise(const PngKind& kind) {
    std::mt19937 random(kind.bits + kind.color);
    std::string codes(kind.height * kind.width * kind.pixel(), '\0');
    for (std::size_t i = 0; i < codes.size(); ++i)  // Runs, too, which compress.
        codes[i] = static_cast<char>(i / 64 % 2 != 0 ? random() : i / 8);
    return codes;
}

/// As textures have them: without alpha, 16 bits with the lower byte first.
std::vector<unsigned char> texelsOf(const PngKind& kind, const std::string& codes) {
    const std::size_t bytes = kind.bits / 8, channels = (kind.color & 2) != 0 ? 3 : 1;
    std::vector<unsigned char> texels;
    for (std::size_t at = 0; at < codes.size(); at += kind.pixel())
        for (std::size_t k = 0; k < channels; ++k)
            for (std::size_t b = bytes; b-- > 0;)
                texels.push_back(static_cast<unsigned char>(codes[at + k * bytes + b]));
    return texels;
}

CrtTexelsInfo infoOf(const PngKind& kind) {
    CrtTexelsInfo info{};
    info.width = kind.width;
    info.height = kind.height;
    info.channels = (kind.color & 2) != 0 ? 3 : 1;
    info.type = kind.bits == 8 ? CRT_TEXELS_UINT8 : CRT_TEXELS_UINT16;
    return info;
}

/// True if the reader takes the file, and its result.
bool reads(const std::string& path, const PngKind& kind, std::vector<unsigned char>& texels) {
    const CrtTexelsInfo info = infoOf(kind);
    texels.assign(std::size_t{info.width} * info.height * info.channels * kind.bits / 8, 99);
    return image::readPng(path, info, texels.data(), texels.size());
}

bool reads(const std::string& path, const PngKind& kind) {
    std::vector<unsigned char> texels;
    return reads(path, kind, texels);
}

}  // namespace

TEST_CASE("a PNG of each kind, its rows filtered in every way", "[png]") {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/a.png";
    for (const unsigned color : {0u, 2u, 4u, 6u})
        for (const unsigned bits : {8u, 16u})
            for (const std::size_t part : {std::size_t{7}, std::size_t{100000}}) {
                INFO("colour type " << color << ", " << bits << " bits, chunks of " << part);
                const PngKind kind{37, 23, bits, color};
                const std::string codes = noise(kind);
                spit(path, pngOf(kind, zlibStream(filteredRows(kind, codes)), pngChunk("tEXt", "a"), part));
                std::vector<unsigned char> texels;
                CHECK(reads(path, kind, texels));
                CHECK(texels == texelsOf(kind, codes));
                // The way of a scene, whose header libpng reads.
                const Texels read = readTexels(path);
                CHECK(read.bytes == texels);
                CHECK(read.info.type == (bits == 8 ? TexelType::Uint8 : TexelType::Uint16));
            }
}

TEST_CASE("a PNG of a rarer kind is left to libpng, which reads it", "[png]") {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/a.png";
    const auto check = [&](const PngKind& kind, const std::string& png,
                           const std::vector<unsigned char>& expected) {
        spit(path, png);
        CHECK_FALSE(reads(path, kind));
        CHECK(readTexels(path).bytes == expected);
    };
    const std::vector<unsigned char> one{10, 20, 30};
    const std::string pixel("\0\x0a\x14\x1e", 4);
    check({1, 1, 8, 2, true}, pngOf({1, 1, 8, 2, true}, zlibStream(pixel)), one);
    const std::string palette = pngChunk("PLTE", "\x0a\x14\x1e");
    check({1, 1, 8, 3}, pngOf({1, 1, 8, 3}, zlibStream(std::string(2, '\0')), palette), one);
    // A colour that is transparent; a palette that only suggests.
    check({1, 1}, pngOf({1, 1}, zlibStream(pixel), pngChunk("tRNS", std::string("\0\1\0\2\0\3", 6))), one);
    check({1, 1}, pngOf({1, 1}, zlibStream(pixel), pngChunk("PLTE", "abc")), one);
    // A stream that promises a window of 256 bytes.
    std::string narrow = zlibStream(pixel);
    narrow.replace(0, 2, "\x08\x1d");
    check({1, 1}, pngOf({1, 1}, narrow), one);
}

namespace {

/// An image of `kind` in which sample k of pixel (x, y) is the code (7x + 13y + 29k) mod 2^bits; a palette
/// is chosen from by that code.
unsigned codeAt(const PngKind& kind, unsigned x, unsigned y, unsigned k) {
    return (7 * x + 13 * y + 29 * k) % (1u << std::min(kind.bits, 8u));
}

/// Rows of every pass, unfiltered (PNG Specification, 8.2): each pass is a separate image.
std::string passesOf(const PngKind& kind) {
    struct Pass {
        unsigned x, y, dx, dy;
    };
    static constexpr Pass kAdam7[] = {{0, 0, 8, 8}, {4, 0, 8, 8}, {0, 4, 4, 8}, {2, 0, 4, 4},
                                      {0, 2, 2, 4}, {1, 0, 2, 2}, {0, 1, 1, 2}};
    static constexpr Pass kWhole[] = {{0, 0, 1, 1}};
    static constexpr unsigned kSamples[] = {1, 0, 3, 1, 2, 0, 4};
    std::string rows;
    const auto add = [&](const Pass& pass) {
        for (unsigned y = pass.y; y < kind.height && pass.x < kind.width; y += pass.dy) {
            std::vector<unsigned> bits;
            for (unsigned x = pass.x; x < kind.width; x += pass.dx)
                for (unsigned k = 0; k < kSamples[kind.color]; ++k) {
                    const unsigned code = codeAt(kind, x, y, k) * (kind.bits == 16 ? 257 : 1);
                    for (unsigned bit = kind.bits; bit-- > 0;) bits.push_back(code >> bit & 1);
                }
            bits.resize((bits.size() + 7) / 8 * 8);
            rows += '\0';
            for (std::size_t at = 0; at < bits.size(); at += 8) {
                unsigned byte = 0;
                for (std::size_t bit = 0; bit < 8; ++bit) byte = byte << 1 | bits[at + bit];
                rows += static_cast<char>(byte);
            }
        }
    };
    if (kind.interlaced) {
        for (const Pass& pass : kAdam7) add(pass);
    } else {
        add(kWhole[0]);
    }
    return rows;
}

/// Colour `code` of the palette: (code, 255 − code, 3 code mod 256), and its alpha 255 − 2 code.
std::string paletteChunks(unsigned bits) {
    std::string colors, alphas;
    for (unsigned code = 0; code < 1u << bits; ++code) {
        for (const unsigned value : {code, 255 - code, 3 * code % 256}) colors += static_cast<char>(value);
        alphas += static_cast<char>((510 - 2 * code) % 256);
    }
    return pngChunk("PLTE", colors) + pngChunk("tRNS", alphas);
}

/// The 8-bit code of channel k (3 is alpha) of pixel (x, y); grey is 0.
unsigned expectedAt(const PngKind& kind, unsigned x, unsigned y, unsigned k) {
    const unsigned largest = (1u << std::min(kind.bits, 8u)) - 1;
    const auto sample = [&](unsigned i) { return codeAt(kind, x, y, i) * 255 / largest; };
    if (kind.color != 3) return sample(k == 3 ? (kind.color & 2 ? 3 : 1) : k);
    const unsigned code = codeAt(kind, x, y, 0);
    const unsigned color[] = {code, 255 - code, 3 * code % 256, (510 - 2 * code) % 256};
    return color[k];
}

}  // namespace

TEST_CASE("a PNG of any kind, interlaced or not, has the colours and the alpha it was made of", "[png]") {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/a.png";
    const struct {
        unsigned color;
        std::vector<unsigned> bits;
    } kinds[] = {{0, {1, 2, 4, 8, 16}}, {2, {8, 16}}, {3, {1, 2, 4, 8}}, {4, {8, 16}}, {6, {8, 16}}};
    for (const auto& [color, all_bits] : kinds)
        for (const unsigned bits : all_bits)
            for (const bool interlaced : {false, true}) {
                INFO("colour type " << color << ", " << bits << " bits, interlaced " << interlaced);
                const PngKind kind{13, 11, bits, color, interlaced};
                spit(path, pngOf(kind, zlibStream(passesOf(kind)), color == 3 ? paletteChunks(bits) : ""));
                const Texels texels = readTexels(path), alpha = readAlpha(path);
                const Image image = readImage(path);
                const unsigned channels = color == 0 || color == 4 ? 1 : 3;
                const bool has_alpha = color >= 3;
                REQUIRE(texels.info.channels == channels);
                REQUIRE(alpha.info.channels == (has_alpha ? 1u : 0u));
                REQUIRE(image.width == kind.width);
                REQUIRE(image.height == kind.height);
                // Grey is compared as colours are.
                const std::size_t planes = image.channels.size();
                REQUIRE(planes == (has_alpha && channels == 3 ? 4u : 3u));
                const std::size_t bytes = bits == 16 ? 2 : 1;
                bool same = true;
                for (unsigned y = 0; y < kind.height; ++y)
                    for (unsigned x = 0; x < kind.width; ++x) {
                        const std::size_t at = y * std::size_t{kind.width} + x;
                        // Both bytes of a 16-bit code are the 8-bit code.
                        for (unsigned k = 0; k < channels; ++k)
                            for (std::size_t byte = 0; byte < bytes; ++byte)
                                same = same && texels.bytes[(at * channels + k) * bytes + byte] ==
                                                   expectedAt(kind, x, y, k);
                        const double coverage = has_alpha ? expectedAt(kind, x, y, 3) / 255.0 : 1;
                        if (has_alpha) same = same && alpha.bytes[at * bytes] == expectedAt(kind, x, y, 3);
                        for (unsigned k = 0; k < 3; ++k) {
                            const double code = expectedAt(kind, x, y, channels == 1 ? 0 : k) / 255.0;
                            same = same && std::abs(image.pixels[at * planes + k] -
                                                    coverage * srgbToLinear(code)) < 1e-6;
                        }
                    }
                CHECK(same);
            }
}

TEST_CASE("metadata come back from a PNG, under the keywords of the specification", "[png]") {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/a.png";
    Image image;
    image.width = image.height = 1;
    image.channels = {"R", "G", "B"};
    image.pixels = {0, 0, 0};
    image.metadata = {{"crt/scene",
                       "Stra\xc3\x9f"
                       "e.yaml"},
                      {"crt/seed", "7"},
                      {"ImageDescription", "A lamp"}};
    writeImage(path, OutputFormat::Png, image);
    const Image back = readImage(path);
    CHECK(metadataValue(back, "crt/scene") ==
          "Stra\xc3\x9f"
          "e.yaml");
    CHECK(metadataValue(back, "crt/seed") == "7");
    CHECK(metadataValue(back, "ImageDescription") == "A lamp");
    const std::string bytes = slurp(path);
    CHECK(bytes.find("iTXt") != std::string::npos);
    CHECK(bytes.find(std::string("tEXtDescription\0A lamp", 22)) != std::string::npos);
}

TEST_CASE("a PNG with any byte damaged is left to libpng", "[png]") {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/a.png";
    const PngKind kind{9, 6};
    const std::string codes = noise(kind),
                      png = pngOf(kind, zlibStream(filteredRows(kind, codes)), pngChunk("tEXt", "a"), 40);
    for (std::size_t i = 8; i < png.size(); ++i) {
        std::string damaged = png;
        damaged[i] = static_cast<char>(damaged[i] ^ 0x20);
        INFO("byte " << i);
        spit(path, damaged);
        CHECK_FALSE(reads(path, kind));
        spit(path, png.substr(0, i));
        CHECK_FALSE(reads(path, kind));
    }
    CHECK_FALSE(image::readPng(folder.path() + "/none.png", infoOf(kind), nullptr, 0));
}

TEST_CASE("a PNG whose checksums hold and whose pixels do not is refused in the words of libpng", "[png]") {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/a.png";
    const PngKind kind{9, 6};
    const std::string rows = filteredRows(kind, noise(kind)), stream = zlibStream(rows);
    const auto check = [&](const std::string& png) {
        spit(path, png);
        CHECK_FALSE(reads(path, kind));
        try {
            (void)readTexels(path);
            FAIL_CHECK("it was read");
        } catch (const Error& e) {
            CHECK(e.kind() == ErrorKind::Scene);
            CHECK_THAT(e.what(), Contains("cannot read the image"));
        }
    };
    check(pngOf(kind, stream.substr(0, stream.size() / 2)));              // cut
    check(pngOf(kind, zlibStream(rows.substr(0, rows.size() - 30))));     // a row too few
    std::string unknown = rows;
    unknown[0] = 5;
    check(pngOf(kind, zlibStream(unknown)));                              // no such filter
    check(pngOf(kind, zlibStream(rows), pngChunk("CrIt", "a")));          // a chunk that must be understood
    std::string flipped = stream;
    flipped[stream.size() / 2] = static_cast<char>(~flipped[stream.size() / 2]);
    spit(path, pngOf(kind, flipped));
    CHECK_FALSE(reads(path, kind));

    // The reader accepts what libpng forgives: pixels apart, and more of them than there are.
    const std::string more = pngOf(kind, zlibStream(rows + rows));
    for (const std::string& png :
         {more, pngHeader(kind) + pngChunk("IDAT", stream) + pngChunk("tEXt", "a") + pngChunk("IDAT", "") +
                    pngChunk("IEND", "")}) {
        spit(path, png);
        CHECK_FALSE(reads(path, kind));
        CHECK(readTexels(path).bytes == texelsOf(kind, noise(kind)));
    }
}

TEST_CASE("pixels of a PNG that are not those of the header read before are left alone", "[png]") {
    const TemporaryFolder folder;
    const std::string path = folder.path() + "/a.png";
    const PngKind kind{9, 6};
    spit(path, pngOf(kind, zlibStream(filteredRows(kind, noise(kind)))));
    CHECK(reads(path, kind));
    CHECK_FALSE(reads(path, {6, 9}));
    CHECK_FALSE(reads(path, {9, 6, 16}));
    CHECK_FALSE(reads(path, {9, 6, 8, 0}));
    std::vector<unsigned char> small(9 * 6 * 3 - 1);
    CHECK_FALSE(image::readPng(path, infoOf(kind), small.data(), small.size()));
}
