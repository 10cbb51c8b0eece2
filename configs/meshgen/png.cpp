#include "png.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace crt::meshgen {
namespace {

std::string bigEndian(std::uint32_t value) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 255);
    return bytes;
}

/// PNG Specification, annex D.
std::uint32_t crcOf(const std::string& bytes) {
    std::uint32_t crc = 0xffffffffu;
    for (const char c : bytes) {
        crc ^= static_cast<unsigned char>(c);
        for (int bit = 0; bit < 8; ++bit) crc = crc & 1 ? 0xedb88320u ^ crc >> 1 : crc >> 1;
    }
    return ~crc;
}

std::uint32_t adlerOf(const std::string& bytes) {
    std::uint32_t a = 1, b = 0;
    for (const char c : bytes) {
        a = (a + static_cast<unsigned char>(c)) % 65521;
        b = (b + a) % 65521;
    }
    return b << 16 | a;
}

std::string chunk(const std::string& name, const std::string& data) {
    return bigEndian(static_cast<std::uint32_t>(data.size())) + name + data + bigEndian(crcOf(name + data));
}

/// RFC 1950 and 1951: blocks that are stored as they are.
std::string stored(const std::string& bytes) {
    constexpr std::size_t kMostOfABlock = 65535;
    std::string stream = "\x78\x01";
    for (std::size_t at = 0; at < bytes.size(); at += kMostOfABlock) {
        const std::size_t size = std::min(kMostOfABlock, bytes.size() - at);
        stream += static_cast<char>(at + size == bytes.size());
        for (const std::size_t word : {size, ~size}) {
            stream += static_cast<char>(word & 255);
            stream += static_cast<char>(word >> 8 & 255);
        }
        stream.append(bytes, at, size);
    }
    return stream + bigEndian(adlerOf(bytes));
}

}  // namespace

std::string pngOf(unsigned width, unsigned height, const std::function<Rgb(double u, double v)>& color) {
    std::string rows;
    for (unsigned y = 0; y < height; ++y) {
        rows += '\0';
        for (unsigned x = 0; x < width; ++x)
            for (const double c : color((x + 0.5) / width, (y + 0.5) / height))
                rows += static_cast<char>(std::lround(std::clamp(c, 0.0, 1.0) * 255));
    }
    const std::string header = bigEndian(width) + bigEndian(height) + std::string("\x08\x02\0\0\0", 5);
    return std::string("\x89PNG\r\n\x1a\n") + chunk("IHDR", header) + chunk("IDAT", stored(rows)) +
           chunk("IEND", "");
}

}  // namespace crt::meshgen
