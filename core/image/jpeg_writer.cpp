#include "image/jpeg_writer.h"

#include "image/jpeg_errors.h"

#include <cerrno>
#include <cstring>
#include <string>
#include <vector>

namespace crt::image {
namespace {

constexpr int kQuality = 95;
constexpr std::size_t kMostCommentBytes = 65533;  // A marker's length has 16 bits and counts itself.

/// False where libjpeg gave up. Nothing here has a destructor: a jump leaves it.
bool encode(jpeg_compress_struct& codec, JpegErrors& errors, std::FILE* file, std::uint32_t width,
            std::uint32_t height, const std::uint8_t* rgb, const std::vector<std::string>& comments) {
    codec.err = jpeg_std_error(&errors.manager);
    errors.manager.error_exit = failJpeg;
    if (setjmp(errors.escape) != 0) return false;
    jpeg_create_compress(&codec);
    jpeg_stdio_dest(&codec, file);
    codec.image_width = width;
    codec.image_height = height;
    codec.input_components = 3;
    codec.in_color_space = JCS_RGB;
    jpeg_set_defaults(&codec);
    jpeg_set_quality(&codec, kQuality, TRUE);
    for (int c = 0; c < codec.num_components; ++c)
        codec.comp_info[c].h_samp_factor = codec.comp_info[c].v_samp_factor = 1;
    codec.optimize_coding = TRUE;
    jpeg_start_compress(&codec, TRUE);
    for (const std::string& comment : comments)
        jpeg_write_marker(&codec, JPEG_COM, reinterpret_cast<const JOCTET*>(comment.data()),
                          static_cast<unsigned>(comment.size()));
    while (codec.next_scanline < height) {
        auto* row = const_cast<JSAMPROW>(rgb + std::size_t{codec.next_scanline} * width * 3);
        jpeg_write_scanlines(&codec, &row, 1);
    }
    jpeg_finish_compress(&codec);
    return true;
}

}  // namespace

std::string writeJpeg(const char* path, std::uint32_t width, std::uint32_t height, const std::uint8_t* rgb,
                      const CrtImageText* metadata, std::uint32_t metadata_count) {
    std::vector<std::string> comments;
    for (std::uint32_t i = 0; i < metadata_count; ++i)
        comments.push_back(
            (std::string(metadata[i].name) + ": " + metadata[i].value).substr(0, kMostCommentBytes));
    std::FILE* const file = std::fopen(path, "wb");
    if (file == nullptr) return std::strerror(errno);
    jpeg_compress_struct codec{};
    JpegErrors errors{};
    std::string why;
    if (!encode(codec, errors, file, width, height, rgb, comments)) why = errors.sentence;
    jpeg_destroy_compress(&codec);
    if (std::fclose(file) != 0 && why.empty()) why = std::strerror(errno);
    return why;
}

}  // namespace crt::image
