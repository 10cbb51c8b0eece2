/// PNG files for tests, made by hand (PNG Specification, second edition) and compressed by libdeflate.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <libdeflate.h>

struct PngKind {
    unsigned width, height;
    unsigned bits = 8;        ///< A sample; 8 or 16.
    unsigned color = 2;       ///< 0 grey, 2 RGB, 3 palette, 4 grey and alpha, 6 RGB and alpha.
    bool interlaced = false;  ///< By Adam7, for images of one pixel, which are the same but for the header.

    std::size_t pixel() const {
        constexpr std::size_t kSamples[] = {1, 0, 3, 1, 2, 0, 4};
        return kSamples[color] * bits / 8;
    }
};

inline std::string bigEndian32(std::uint32_t value) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 255);
    return bytes;
}

inline std::string pngChunk(const std::string& name, const std::string& data) {
    const std::string named = name + data;
    return bigEndian32(static_cast<std::uint32_t>(data.size())) + named +
           bigEndian32(libdeflate_crc32(0, named.data(), named.size()));
}

/// Rows with the byte of their filter before them: row y has filter y % 5.
inline std::string filteredRows(const PngKind& kind, const std::string& codes) {
    const std::size_t pixel = kind.pixel(), row = kind.width * pixel;
    const auto at = [&](std::size_t x, std::size_t y) {
        return static_cast<int>(static_cast<unsigned char>(codes.at(y * row + x)));
    };
    std::string filtered;
    for (std::size_t y = 0; y < kind.height; ++y) {
        filtered += static_cast<char>(y % 5);
        for (std::size_t x = 0; x < row; ++x) {
            const int left = x < pixel ? 0 : at(x - pixel, y), above = y == 0 ? 0 : at(x, y - 1),
                      corner = x < pixel || y == 0 ? 0 : at(x - pixel, y - 1);
            const int guess = left + above - corner, by_left = std::abs(guess - left),
                      by_above = std::abs(guess - above), by_corner = std::abs(guess - corner);
            const int paeth = by_left <= by_above && by_left <= by_corner ? left
                              : by_above <= by_corner                     ? above
                                                                          : corner;
            const int predicted[] = {0, left, above, (left + above) / 2, paeth};
            filtered += static_cast<char>(at(x, y) - predicted[y % 5]);
        }
    }
    return filtered;
}

inline std::string zlibStream(const std::string& bytes) {
    libdeflate_compressor* const compressor = libdeflate_alloc_compressor(6);
    std::string stream(libdeflate_zlib_compress_bound(compressor, bytes.size()), '\0');
    stream.resize(
        libdeflate_zlib_compress(compressor, bytes.data(), bytes.size(), stream.data(), stream.size()));
    libdeflate_free_compressor(compressor);
    if (stream.empty()) throw std::runtime_error("a stream that cannot be compressed");
    return stream;
}

/// The beginning of a PNG; `before` are whole chunks before its pixels.
inline std::string pngHeader(const PngKind& kind, const std::string& before = {}) {
    return "\x89PNG\r\n\x1a\n" +
           pngChunk("IHDR", bigEndian32(kind.width) + bigEndian32(kind.height) +
                                std::string{static_cast<char>(kind.bits), static_cast<char>(kind.color), 0,
                                            0, static_cast<char>(kind.interlaced)}) +
           before;
}

/// Of a zlib stream, cut into chunks of `part` bytes.
inline std::string pngOf(const PngKind& kind, const std::string& stream, const std::string& before = {},
                         std::size_t part = 1000) {
    std::string png = pngHeader(kind, before);
    for (std::size_t at = 0; at < stream.size(); at += part)
        png += pngChunk("IDAT", stream.substr(at, part));
    return png + pngChunk("IEND", "");
}
