#include "image/png_codec.h"

#include <png.h>

#include <algorithm>
#include <cerrno>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string_view>

namespace crt::image {
namespace {

/// libpng's words for what went wrong, or the system's.
struct PngErrors {
    char sentence[256] = {};
};

[[noreturn]] void failPng(png_structp codec, const char* words) {
    auto* const errors = static_cast<PngErrors*>(png_get_error_ptr(codec));
    std::snprintf(errors->sentence, sizeof errors->sentence, "%s", words);
    png_longjmp(codec, 1);
}

void ignorePngWarning(png_structp, const char*) {}

/// A step may jump out of libpng over its own frame, which therefore holds nothing to destroy.
template <class Step>
void runStep(png_structp codec, const PngErrors& errors, const Step& step) {
    if (setjmp(png_jmpbuf(codec)) != 0) throw std::runtime_error(errors.sentence);
    step();
}

struct CloseStream {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using Stream = std::unique_ptr<std::FILE, CloseStream>;

Stream openStream(const std::string& path, const char* mode) {
    Stream file(std::fopen(path.c_str(), mode));
    if (!file) throw std::runtime_error(std::strerror(errno));
    return file;
}

void writeBytes(png_structp codec, png_bytep bytes, std::size_t size) {
    auto* const file = static_cast<std::FILE*>(png_get_io_ptr(codec));
    if (std::fwrite(bytes, 1, size, file) != size) failPng(codec, std::strerror(errno));
}

void flushBytes(png_structp codec) {
    if (std::fflush(static_cast<std::FILE*>(png_get_io_ptr(codec))) != 0)
        failPng(codec, std::strerror(errno));
}

/// "2023:11:14 22:13:20"; false for any other form.
bool parseTime(const char* text, png_time* time) {
    unsigned year = 0, month = 0, day = 0, hour = 0, minute = 0, second = 0;
    if (std::sscanf(text, "%4u:%2u:%2u %2u:%2u:%2u", &year, &month, &day, &hour, &minute, &second) != 6)
        return false;
    *time = {static_cast<png_uint_16>(year), static_cast<png_byte>(month),  static_cast<png_byte>(day),
             static_cast<png_byte>(hour),    static_cast<png_byte>(minute), static_cast<png_byte>(second)};
    return true;
}

/// Keywords that the specification gives to what EXR files name otherwise (PNG Specification, 11.3.3.2).
struct Keyword {
    std::string_view in_png, elsewhere;
};
constexpr Keyword kKeywords[] = {
    {"Author", "Artist"}, {"Description", "ImageDescription"}, {"Title", "DocumentName"}};

const char* keywordOf(const char* name) {
    for (const Keyword& keyword : kKeywords)
        if (keyword.elsewhere == name) return keyword.in_png.data();
    return name;
}

std::string nameOf(const char* keyword) {
    for (const Keyword& known : kKeywords)
        if (known.in_png == keyword) return std::string(known.elsewhere);
    return keyword;
}

/// tEXt is Latin-1 and iTXt is UTF-8 (PNG Specification, 11.3.3).
png_text textOf(const CrtImageText& metadata) {
    const std::string_view value(metadata.value);
    const bool is_ascii = std::all_of(value.begin(), value.end(), [](unsigned char c) { return c < 0x80; });
    png_text text{};
    text.compression = is_ascii ? PNG_TEXT_COMPRESSION_NONE : PNG_ITXT_COMPRESSION_NONE;
    text.key = const_cast<char*>(keywordOf(metadata.name));
    text.text = const_cast<char*>(metadata.value);
    text.text_length = is_ascii ? value.size() : 0;
    text.itxt_length = is_ascii ? 0 : value.size();
    return text;
}

struct Writer {
    PngErrors errors;
    png_structp codec;
    png_infop info = nullptr;

    Writer() : codec(png_create_write_struct(PNG_LIBPNG_VER_STRING, &errors, failPng, ignorePngWarning)) {
        if (codec != nullptr) info = png_create_info_struct(codec);
        if (info == nullptr) {
            png_destroy_write_struct(&codec, nullptr);
            throw std::bad_alloc();
        }
    }
    ~Writer() { png_destroy_write_struct(&codec, &info); }
    Writer(const Writer&) = delete;
    Writer& operator=(const Writer&) = delete;
};

}  // namespace

struct PngFile::Reader {
    Stream file;
    PngErrors errors;
    png_structp codec;
    png_infop info = nullptr;
    int passes = 1;  ///< 7 where the image is interlaced.

    explicit Reader(const std::string& path)
        : file(openStream(path, "rbe")),
          codec(png_create_read_struct(PNG_LIBPNG_VER_STRING, &errors, failPng, ignorePngWarning)) {
        if (codec != nullptr) info = png_create_info_struct(codec);
        if (info == nullptr) {
            png_destroy_read_struct(&codec, nullptr, nullptr);
            throw std::bad_alloc();
        }
    }
    ~Reader() { png_destroy_read_struct(&codec, &info, nullptr); }
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;
};

PngFile::PngFile(const std::string& path) : reader_(std::make_unique<Reader>(path)) {
    Reader& reader = *reader_;
    runStep(reader.codec, reader.errors, [&] {
        png_init_io(reader.codec, reader.file.get());
        png_read_info(reader.codec, reader.info);
        png_set_expand(reader.codec);
        png_set_swap(reader.codec);  // Every machine that crt runs on is little-endian.
        reader.passes = png_set_interlace_handling(reader.codec);
        png_read_update_info(reader.codec, reader.info);
    });
    layout_ = {png_get_image_width(reader.codec, reader.info),
               png_get_image_height(reader.codec, reader.info), png_get_channels(reader.codec, reader.info),
               png_get_bit_depth(reader.codec, reader.info) / 8u};
}

PngFile::~PngFile() = default;

std::vector<std::pair<std::string, std::string>> PngFile::texts() const {
    png_textp texts = nullptr;
    const int count = png_get_text(reader_->codec, reader_->info, &texts, nullptr);
    std::vector<std::pair<std::string, std::string>> list;
    for (int i = 0; i < count; ++i) list.emplace_back(nameOf(texts[i].key), texts[i].text);
    return list;
}

void PngFile::readRows(const std::function<void(std::uint32_t y, const unsigned char* row)>& take) {
    Reader& reader = *reader_;
    // An interlaced image is complete after its last pass, so all of its rows are held.
    const bool interlaced = reader.passes > 1;
    std::vector<unsigned char> rows(layout_.rowBytes() * (interlaced ? layout_.height : 1));
    const auto row = [&](std::uint32_t y) {
        return rows.data() + (interlaced ? y * layout_.rowBytes() : 0);
    };
    for (int pass = 0; pass < reader.passes; ++pass)
        for (std::uint32_t y = 0; y < layout_.height; ++y) {
            runStep(reader.codec, reader.errors, [&] { png_read_row(reader.codec, row(y), nullptr); });
            if (pass + 1 == reader.passes) take(y, row(y));
        }
}

void writePng(const std::string& path, std::uint32_t width, std::uint32_t height, const std::uint8_t* rgb,
              const CrtImageText* metadata, std::uint32_t metadata_count) {
    Stream file = openStream(path, "wbe");
    png_time time{};
    bool has_time = false;
    std::vector<png_text> texts;
    for (std::uint32_t i = 0; i < metadata_count; ++i) {
        if (std::strcmp(metadata[i].name, "DateTime") == 0 && parseTime(metadata[i].value, &time)) {
            has_time = true;
        } else {
            texts.push_back(textOf(metadata[i]));
        }
    }
    Writer writer;
    runStep(writer.codec, writer.errors, [&] {
        png_set_write_fn(writer.codec, file.get(), writeBytes, flushBytes);
        png_set_IHDR(writer.codec, writer.info, width, height, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                     PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
        png_set_sRGB_gAMA_and_cHRM(writer.codec, writer.info, PNG_sRGB_INTENT_PERCEPTUAL);
        if (has_time) png_set_tIME(writer.codec, writer.info, &time);
        if (!texts.empty())
            png_set_text(writer.codec, writer.info, texts.data(), static_cast<int>(texts.size()));
        png_write_info(writer.codec, writer.info);
        for (std::uint32_t y = 0; y < height; ++y)
            png_write_row(writer.codec, rgb + std::size_t{3} * width * y);
        png_write_end(writer.codec, nullptr);
    });
    if (std::fclose(file.release()) != 0) throw std::runtime_error(std::strerror(errno));
}

}  // namespace crt::image
