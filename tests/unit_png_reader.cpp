// PNG textures by libdeflate: the pixels are those that the file was made of; every file that is damaged, or
// of a kind that libpng is to read, is left to it.
#include "base/error.h"
#include "base/temporary_folder.h"
#include "catch.h"
#include "file_bytes.h"
#include "image/png_reader.h"
#include "image/texels.h"
#include "png_file.h"

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
