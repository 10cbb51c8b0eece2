/// PNG files of every kind by libpng. Part of the image module (image_module.h).
#pragma once

#include "image/image_module.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace crt::image {

/// Samples as they are read: palettes, fewer than 8 bits and tRNS are expanded (PNG Specification, 13.9).
struct PngLayout {
    std::uint32_t width = 0, height = 0;
    std::uint32_t samples = 0;       ///< A pixel: grey, grey and alpha, RGB, or RGB and alpha.
    std::uint32_t sample_bytes = 0;  ///< 1 or 2.

    bool hasAlpha() const { return samples % 2 == 0; }
    std::uint32_t colors() const { return samples - (hasAlpha() ? 1 : 0); }
    std::size_t pixelBytes() const { return std::size_t{samples} * sample_bytes; }
    std::size_t rowBytes() const { return width * pixelBytes(); }
};

/// A file to read once. Its header was checked (checkPngHeader). All functions throw std::runtime_error with
/// a sentence.
class PngFile {
public:
    /// Reads up to the pixels.
    explicit PngFile(const std::string& path);
    ~PngFile();
    PngFile(const PngFile&) = delete;
    PngFile& operator=(const PngFile&) = delete;

    const PngLayout& layout() const { return layout_; }
    /// Name, as EXR files have it, and text of its text chunks before the pixels.
    std::vector<std::pair<std::string, std::string>> texts() const;
    /// Calls `take` for each row from the top. 16-bit samples have this machine's byte order.
    void readRows(const std::function<void(std::uint32_t y, const unsigned char* row)>& take);

private:
    struct Reader;
    std::unique_ptr<Reader> reader_;
    PngLayout layout_;
};

/// Writes 8-bit RGB that is encoded as sRGB. Metadata become text chunks, but "DateTime" the chunk tIME.
void writePng(const std::string& path, std::uint32_t width, std::uint32_t height, const std::uint8_t* rgb,
              const CrtImageText* metadata, std::uint32_t metadata_count);

}  // namespace crt::image
