#include "image/jpeg_reader.h"

#include "image/exif_orientation.h"
#include "image/icc_profile.h"
#include "image/image_bounds.h"
#include "image/jpeg_errors.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>

// After jpeglib.h, which it needs.
#include <jerror.h>

namespace crt::image {
namespace {

/// A progressive file may have any number of scans, each of which costs the time of the whole image;
/// encoders make some ten.
constexpr int kMostScans = 64;

constexpr int kExifMarker = JPEG_APP0 + 1, kProfileMarker = JPEG_APP0 + 2;

/// Level -1 is damaged data, of which libjpeg makes the best; here they are failures, but for what costs no
/// pixel.
void warn(j_common_ptr codec, int level) {
    if (level >= 0) return;
    const int code = codec->err->msg_code;
    if (code != JWRN_EXTRANEOUS_DATA && code != JWRN_ADOBE_XFORM && code != JWRN_JFIF_MAJOR &&
        code != JWRN_BOGUS_ICC)
        failJpeg(codec);
}

void countScans(j_common_ptr codec) {
    auto* const reader = reinterpret_cast<j_decompress_ptr>(codec);
    if (reader->input_scan_number <= kMostScans) return;
    auto* const errors = reinterpret_cast<JpegErrors*>(codec->err);
    std::snprintf(errors->sentence, sizeof errors->sentence, "it has more than %d scans", kMostScans);
    std::longjmp(errors->escape, 1);
}

/// Of the first block of EXIF: "Exif", two zeros, and the block.
std::uint32_t orientationIn(const jpeg_decompress_struct& codec) {
    constexpr std::string_view kMark("Exif\0\0", 6);
    for (const jpeg_marker_struct* marker = codec.marker_list; marker != nullptr; marker = marker->next) {
        const std::string_view data(reinterpret_cast<const char*>(marker->data), marker->data_length);
        if (marker->marker == kExifMarker && data.substr(0, kMark.size()) == kMark)
            return exifOrientation(data.substr(kMark.size()));
    }
    return 0;
}

bool hasProfile(const jpeg_decompress_struct& codec) {
    constexpr std::string_view kMark("ICC_PROFILE\0", 12);
    for (const jpeg_marker_struct* marker = codec.marker_list; marker != nullptr; marker = marker->next) {
        const std::string_view data(reinterpret_cast<const char*>(marker->data), marker->data_length);
        if (marker->marker == kProfileMarker && data.substr(0, kMark.size()) == kMark) return true;
    }
    return false;
}

/// No jump leaves this while the profile is held.
void takeProfile(jpeg_decompress_struct& codec, CrtTexelsInfo& info) {
    if (!hasProfile(codec)) return;
    JOCTET* profile = nullptr;
    unsigned size = 0;
    const bool sound = jpeg_read_icc_profile(&codec, &profile, &size) != FALSE;
    const std::string name =
        sound ? nameUnlessSrgb({reinterpret_cast<const char*>(profile), size}, "without a name") : "damaged";
    std::free(profile);
    name.copy(info.tags.profile, sizeof info.tags.profile - 1);
}

/// All that lives beyond a jump: nothing here has a destructor.
struct Reader {
    jpeg_decompress_struct codec;
    JpegErrors errors;
    jpeg_progress_mgr progress;
};

/// False where libjpeg gave up; `reader.errors.sentence` says why.
bool decode(Reader& reader, std::FILE* file, CrtTexelsInfo* info, unsigned char* buffer,
            std::uint64_t buffer_bytes) {
    jpeg_decompress_struct& codec = reader.codec;
    codec.err = jpeg_std_error(&reader.errors.manager);
    reader.errors.manager.error_exit = failJpeg;
    reader.errors.manager.emit_message = warn;
    if (setjmp(reader.errors.escape) != 0) return false;
    jpeg_create_decompress(&codec);
    reader.progress.progress_monitor = countScans;
    codec.progress = &reader.progress;
    jpeg_stdio_src(&codec, file);
    jpeg_save_markers(&codec, kExifMarker, 0xffff);
    jpeg_save_markers(&codec, kProfileMarker, 0xffff);
    jpeg_read_header(&codec, TRUE);
    info->tags.orientation = orientationIn(codec);
    takeProfile(codec, *info);
    const auto refuse = [&](const char* why) {
        std::snprintf(reader.errors.sentence, sizeof reader.errors.sentence, "%s", why);
        return false;
    };
    if (codec.jpeg_color_space == JCS_CMYK || codec.jpeg_color_space == JCS_YCCK)
        return refuse("its colours are CMYK, for print; convert it to RGB");
    codec.out_color_space = codec.jpeg_color_space == JCS_GRAYSCALE ? JCS_GRAYSCALE : JCS_RGB;
    codec.dct_method = JDCT_ISLOW;  // The same pixels whatever the processor.
    jpeg_calc_output_dimensions(&codec);
    info->width = codec.output_width;
    info->height = codec.output_height;
    info->channels = static_cast<std::uint32_t>(codec.out_color_components);
    info->type = CRT_TEXELS_UINT8;
    if (buffer == nullptr) return true;

    const std::uint64_t row = std::uint64_t{info->width} * info->channels;
    if (row * info->height != buffer_bytes) return refuse("it has changed while it was read");
    jpeg_start_decompress(&codec);
    while (codec.output_scanline < codec.output_height) {
        JSAMPROW next = buffer + row * codec.output_scanline;
        jpeg_read_scanlines(&codec, &next, 1);
    }
    jpeg_finish_decompress(&codec);
    return true;
}

}  // namespace

std::string readJpeg(const char* path, CrtTexelsInfo* info, unsigned char* buffer,
                     std::uint64_t buffer_bytes) {
    std::FILE* const file = std::fopen(path, "rbe");
    if (file == nullptr) return "it cannot be opened";
    Reader reader{};
    const bool good = decode(reader, file, info, buffer, buffer_bytes);
    jpeg_destroy_decompress(&reader.codec);
    std::fclose(file);
    if (!good) return reader.errors.sentence;
    // A block of 8 x 8 takes a bit or more for each component, of which colour has a quarter at best; coded
    // as arithmetic, blocks that are alike take almost nothing.
    if (reader.codec.arith_code != FALSE) return {};
    constexpr std::uint64_t kPixelsAByte = 1024;
    std::error_code unknown;
    if (std::uint64_t{info->width} * info->height / kPixelsAByte > std::filesystem::file_size(path, unknown))
        return "its header says more pixels than a file of its size can hold";
    return {};
}

}  // namespace crt::image
