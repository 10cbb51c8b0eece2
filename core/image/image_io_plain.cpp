// The image module for formats that small libraries or crt itself read: PNG through libpng, JPEG through
// libjpeg-turbo, sound PNG files that are textures through libdeflate, Radiance HDR and TGA by readers of
// crt's own, behind image_module.h. Nothing else in crt uses these libraries.
#include "image/image_bounds.h"
#include "image/image_module.h"
#include "image/jpeg_reader.h"
#include "image/jpeg_writer.h"
#include "image/module_support.h"
#include "image/png_codec.h"
#include "image/png_header.h"
#include "image/png_reader.h"
#include "image/radiance_reader.h"
#include "image/tga_reader.h"

#include <png.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <memory>
#include <string>

namespace {

using namespace crt::image;

/// Formats with a signature, by the first bytes of such a file.
bool beginsWith(const char* path, const std::string& signature) {
    std::string beginning(signature.size(), '\0');
    std::ifstream file(path, std::ios::binary);
    file.read(beginning.data(), static_cast<std::streamsize>(beginning.size()));
    return file && beginning == signature;
}
bool beginsAsPng(const char* path) { return beginsWith(path, "\x89PNG\r\n\x1a\n"); }
bool beginsAsJpeg(const char* path) { return beginsWith(path, "\xff\xd8\xff"); }

RadianceHeader radianceHeader(const char* path) {
    RadianceHeader header;
    require(readRadiance(path, &header, nullptr, 0));
    return header;
}

void takeTags(const RadianceHeader& header, CrtUnappliedTags& tags) {
    tags.exposure = static_cast<float>(header.exposure);
    for (std::size_t k = 0; k < 3; ++k)
        tags.color_correction[k] = static_cast<float>(header.color_correction[k]);
}

// ---- Images to compare --------------------------------------------------------------------------------

std::unique_ptr<OwnedImage> readRadianceImage(const char* path, std::uint64_t most_bytes) {
    RadianceHeader header = radianceHeader(path);
    checkMemory(header.width, header.height, 3 * sizeof(float), most_bytes);
    auto image = std::make_unique<OwnedImage>();
    image->float_values.resize(std::size_t{header.width} * header.height * 3);
    require(readRadiance(path, &header, image->float_values.data(), image->float_values.size()));
    image->float_names = {"R", "G", "B"};
    image->width = header.width;
    image->height = header.height;
    if (header.chromaticities) {
        image->primaries = *header.chromaticities;
        image->chromaticities = image->primaries.data();
    }
    takeTags(header, image->tags);
    return image;
}

/// Codes from 0 to 1.
std::unique_ptr<OwnedImage> readPngImage(const char* path, std::uint64_t most_bytes) {
    checkPngHeader(path);
    PngFile file(path);
    const PngLayout& layout = file.layout();
    checkMemory(layout.width, layout.height, layout.samples * sizeof(float), most_bytes);
    auto image = std::make_unique<OwnedImage>();
    image->width = layout.width;
    image->height = layout.height;
    image->float_names =
        layout.colors() == 1 ? std::vector<std::string>{"Y"} : std::vector<std::string>{"R", "G", "B"};
    if (layout.hasAlpha()) image->float_names.emplace_back("A");
    const std::size_t samples = std::size_t{layout.width} * layout.samples;
    image->float_values.resize(samples * layout.height);
    file.readRows([&](std::uint32_t y, const unsigned char* row) {
        float* const values = &image->float_values[y * samples];
        for (std::size_t i = 0; i < samples; ++i) {
            std::uint16_t code = row[i];
            if (layout.sample_bytes == 2) std::memcpy(&code, row + 2 * i, 2);
            values[i] = static_cast<float>(code) / (layout.sample_bytes == 2 ? 65535.0f : 255.0f);
        }
    });
    for (const auto& [keyword, text] : file.texts()) {
        image->metadata_text.push_back(keyword);
        image->metadata_text.push_back(text);
    }
    image->tags = tagsOfPng(path);
    image->srgb_encoded = 1;
    return image;
}

std::int32_t readImage(const char* path, std::uint64_t most_bytes, const CrtImagePlanes** image,
                       char* reason, std::uint32_t reason_size) {
    return guarded(reason, reason_size, [&] {
        std::unique_ptr<OwnedImage> read;
        if (beginsAsRadiance(path)) {
            read = readRadianceImage(path, most_bytes);
        } else if (beginsAsPng(path)) {
            read = readPngImage(path, most_bytes);
        } else {
            // TIFF and JPEG hold no renders to compare; a TGA has no signature.
            throw Failure{
                "it is not an EXR, PNG, PFM, PPM or Radiance HDR file; OpenImageIO's oiiotool converts "
                "other formats: oiiotool IN -o OUT.exr"};
        }
        read->whole_width = read->width;
        read->whole_height = read->height;
        read->show();
        *image = read.release();
    });
}

// ---- Images as values ---------------------------------------------------------------------------------

void readJpegPart(TexelPart part, const char* path, CrtTexelsInfo& info, const Target& to) {
    require(readJpeg(path, &info, part == TexelPart::Color ? to.data : nullptr, to.bytes));
    if (part == TexelPart::Alpha) info.channels = 0;
}

void readTgaPart(TexelPart part, const char* path, CrtTexelsInfo& info, const Target& to) {
    if (!beginsAsTga(path)) throw Failure{"it is not a PNG, JPEG, TGA, EXR, Radiance HDR or PFM file"};
    require(readTga(path, part, &info, to.data, to.bytes));
}

void readRadiancePart(TexelPart part, const char* path, CrtTexelsInfo& info, const Target& to) {
    RadianceHeader header = radianceHeader(path);
    info.width = header.width;
    info.height = header.height;
    info.channels = part == TexelPart::Color ? 3 : 0;
    info.type = CRT_TEXELS_FLOAT;
    info.has_chromaticities = header.chromaticities.has_value();
    if (header.chromaticities)
        std::copy(header.chromaticities->begin(), header.chromaticities->end(), info.chromaticities);
    takeTags(header, info.tags);
    if (to.data != nullptr && part == TexelPart::Color)
        require(readRadiance(path, &header, reinterpret_cast<float*>(to.data), to.bytes / sizeof(float)));
}

void readPngPart(TexelPart part, const char* path, CrtTexelsInfo& info, const Target& to) {
    checkPngHeader(path);
    PngFile file(path);
    const PngLayout& layout = file.layout();
    const bool is_color = part == TexelPart::Color;
    info.width = layout.width;
    info.height = layout.height;
    info.channels = is_color ? layout.colors() : layout.hasAlpha() ? 1 : 0;
    info.type = layout.sample_bytes == 2 ? CRT_TEXELS_UINT16 : CRT_TEXELS_UINT8;
    info.tags = tagsOfPng(path);
    if (to.data == nullptr || info.channels == 0) return;
    const std::size_t texel = std::size_t{info.channels} * layout.sample_bytes,
                      row_bytes = texel * layout.width;
    if (row_bytes * layout.height != to.bytes) throw Failure{"it has changed while it was read"};
    if (is_color && readPng(path, info, to.data, to.bytes)) return;
    const std::size_t first = is_color ? 0 : std::size_t{layout.colors()} * layout.sample_bytes;
    file.readRows([&](std::uint32_t y, const unsigned char* row) {
        unsigned char* out = to.data + y * row_bytes;
        for (std::uint32_t x = 0; x < layout.width; ++x, out += texel)
            std::memcpy(out, row + x * layout.pixelBytes() + first, texel);
    });
}

void readPart(TexelPart part, const char* path, CrtTexelsInfo& info, const Target& to) {
    if (beginsAsPng(path)) return readPngPart(part, path, info, to);
    if (beginsAsJpeg(path)) return readJpegPart(part, path, info, to);
    if (beginsAsRadiance(path)) return readRadiancePart(part, path, info, to);
    readTgaPart(part, path, info, to);
}

std::int32_t writePngFile(const char* path, std::uint32_t width, std::uint32_t height,
                          const std::uint8_t* rgb, const CrtImageText* metadata,
                          std::uint32_t metadata_count, char* reason, std::uint32_t reason_size) {
    return guarded(reason, reason_size,
                   [&] { writePng(path, width, height, rgb, metadata, metadata_count); });
}

std::int32_t writeJpegFile(const char* path, std::uint32_t width, std::uint32_t height,
                           const std::uint8_t* rgb, const CrtImageText* metadata,
                           std::uint32_t metadata_count, char* reason, std::uint32_t reason_size) {
    return guarded(reason, reason_size,
                   [&] { require(writeJpeg(path, width, height, rgb, metadata, metadata_count)); });
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const CrtImageModule* CRT_IMAGE_MODULE_ENTRY(void);

extern "C" const CrtImageModule* CRT_IMAGE_MODULE_ENTRY(void) {
    static const CrtImageModule table{sizeof(CrtImageModule),
                                      0,
                                      "libpng " PNG_LIBPNG_VER_STRING,
                                      nullptr,
                                      writePngFile,
                                      writeJpegFile,
                                      readImage,
                                      freeImage,
                                      readPartBy<TexelPart::Color, readPart>,
                                      readPartBy<TexelPart::Alpha, readPart>};
    return &table;
}
