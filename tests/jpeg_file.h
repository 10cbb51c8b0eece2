/// JPEG files for tests, written by libjpeg.
#pragma once

#include <cstdint>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include <jpeglib.h>

/// `codes` row-major, `channels` (1, 3 or 4: CMYK) a pixel. With the best quality, colours have the full
/// resolution.
inline void writeJpeg(const std::string& path, unsigned width, unsigned height, int channels,
                      const std::vector<std::uint8_t>& codes, bool progressive = false, int quality = 100) {
    std::FILE* const file = std::fopen(path.c_str(), "wb");
    if (file == nullptr) throw std::runtime_error("cannot write " + path);
    jpeg_compress_struct codec{};
    jpeg_error_mgr errors{};
    codec.err = jpeg_std_error(&errors);
    jpeg_create_compress(&codec);
    jpeg_stdio_dest(&codec, file);
    codec.image_width = width;
    codec.image_height = height;
    codec.input_components = channels;
    codec.in_color_space = channels == 1 ? JCS_GRAYSCALE : channels == 3 ? JCS_RGB : JCS_CMYK;
    jpeg_set_defaults(&codec);
    jpeg_set_quality(&codec, quality, TRUE);
    for (int c = 0; quality == 100 && c < channels; ++c)
        codec.comp_info[c].h_samp_factor = codec.comp_info[c].v_samp_factor = 1;
    if (progressive) jpeg_simple_progression(&codec);
    jpeg_start_compress(&codec, TRUE);
    std::vector<std::uint8_t> row(std::size_t{width} * static_cast<unsigned>(channels));
    while (codec.next_scanline < height) {
        const auto first = codes.begin() + static_cast<std::ptrdiff_t>(codec.next_scanline * row.size());
        row.assign(first, first + static_cast<std::ptrdiff_t>(row.size()));
        JSAMPROW pointer = row.data();
        jpeg_write_scanlines(&codec, &pointer, 1);
    }
    jpeg_finish_compress(&codec);
    jpeg_destroy_compress(&codec);
    std::fclose(file);
}
