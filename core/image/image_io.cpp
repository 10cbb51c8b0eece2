// Over 450 lines: one format after the other, each short, and what they share.
#include "image/image_io.h"

#include "base/error.h"
#include "base/host.h"
#include "base/input_file.h"
#include "base/log.h"
#include "image/image_metadata.h"
#include "image/image_module.h"
#include "image/open_module.h"
#include "image/unapplied_tags.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

namespace crt {
namespace {

[[noreturn]] void refuseToWrite(const std::string& path, const std::string& why) {
    throw Error(ErrorKind::Output, fmt::format("cannot write '{}': {}", path, why), {path});
}
[[noreturn]] void refuseToRead(const std::string& path, const std::string& why) {
    throw Error(ErrorKind::Usage, fmt::format("cannot read the image '{}': {}", path, why), {path});
}

// ------------------------------------------------------------------------------------------------- PFM, PPM

/// "PF", size, −1 for little-endian, then rows from the bottom up (Debevec's Portable FloatMap).
void writePfm(const std::string& path, const Image& image) {
    static_assert(std::endian::native == std::endian::little);
    const std::array<std::size_t, 3> color = colorChannels(image);
    AtomicFile file(path);
    const std::string header = fmt::format("PF\n{} {}\n-1.0\n", image.width, image.height);
    file.write(header.data(), header.size());
    std::vector<float> row(std::size_t{3} * image.width);
    for (std::uint32_t y = image.height; y-- > 0;) {
        const float* pixel = image.pixels.data() + std::size_t{y} * image.width * image.channels.size();
        for (std::uint32_t x = 0; x < image.width; ++x, pixel += image.channels.size())
            for (std::size_t c = 0; c < 3; ++c) row[3 * x + c] = pixel[color[c]];
        file.write(row.data(), row.size() * sizeof(float));
    }
    file.commit();
}

void writePpm(const std::string& path, const Image& image, const EncodedImage& encoded) {
    AtomicFile file(path);
    const std::string header = fmt::format("P6\n{} {}\n255\n", image.width, image.height);
    file.write(header.data(), header.size());
    file.write(encoded.rgb.data(), encoded.rgb.size());
    file.commit();
}

/// Words of a PNM or PFM header: separated by white space, '#' begins a comment.
class HeaderReader {
public:
    HeaderReader(const std::string& path, std::string_view bytes) : path_(path), bytes_(bytes) {}

    std::string_view word() {
        while (at_ < bytes_.size() && (isSpace(bytes_[at_]) || bytes_[at_] == '#')) {
            if (bytes_[at_] == '#')
                while (at_ < bytes_.size() && bytes_[at_] != '\n') ++at_;
            else
                ++at_;
        }
        const std::size_t first = at_;
        while (at_ < bytes_.size() && !isSpace(bytes_[at_])) ++at_;
        return bytes_.substr(first, at_ - first);
    }
    std::uint32_t size(const char* what) {
        const std::string text(word());
        char* end = nullptr;
        const unsigned long long value = std::strtoull(text.c_str(), &end, 10);
        if (text.empty() || *end != '\0' || text[0] == '-' || value == 0 || value > 0x7fffffffull)
            refuseToRead(path_, fmt::format("its header has '{}' for the {}", text, what));
        return static_cast<std::uint32_t>(value);
    }
    double number(const char* what) {
        const std::string text(word());
        char* end = nullptr;
        const double value = std::strtod(text.c_str(), &end);
        if (text.empty() || *end != '\0' || !std::isfinite(value) || value == 0)
            refuseToRead(path_, fmt::format("its header has '{}' for the {}", text, what));
        return value;
    }
    /// Pixels begin one white space after the last word, or two where lines end as DOS ends them.
    std::string_view pixels(std::size_t expected_bytes) {
        std::size_t first = at_ + 1;
        if (bytes_.substr(at_, 2) == "\r\n" && bytes_.size() - first == expected_bytes + 1) ++first;
        const std::size_t there = first < bytes_.size() ? bytes_.size() - first : 0;
        if (there < expected_bytes)
            refuseToRead(path_, fmt::format("it is truncated: it has {} of {} bytes of pixels", there,
                                            expected_bytes));
        if (there > expected_bytes)
            logWarning("{}: {} bytes follow the pixels; crt ignores them", path_, there - expected_bytes);
        return bytes_.substr(first, expected_bytes);
    }

private:
    static bool isSpace(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
    const std::string& path_;
    std::string_view bytes_;
    std::size_t at_ = 2;  ///< After the mark.
};

Image emptyRgb(std::uint32_t width, std::uint32_t height) {
    Image image;
    image.width = width;
    image.height = height;
    image.channels = {"R", "G", "B"};
    return image;
}

/// Bytes of an image, or 0 when they are more than any file here has.
std::size_t pixelBytes(std::uint32_t width, std::uint32_t height, std::size_t bytes_a_pixel,
                       const std::string& path) {
    const unsigned __int128 bytes = static_cast<unsigned __int128>(width) * height * bytes_a_pixel;
    if (bytes >> 48) refuseToRead(path, fmt::format("its header says {} × {} pixels", width, height));
    return static_cast<std::size_t>(bytes);
}

Image readPfm(const std::string& path, std::string_view bytes) {
    if (bytes.size() > 2 && std::isspace(static_cast<unsigned char>(bytes[2])) == 0)
        refuseToRead(path, "a PFM begins with PF (colours) or Pf (grey) and a white space");
    const std::size_t channels = bytes[1] == 'F' ? 3 : 1;
    HeaderReader header(path, bytes);
    const std::uint32_t width = header.size("width");
    const std::uint32_t height = header.size("height");
    // Its sign is the byte order; its size a unit without an agreed meaning, which readers ignore.
    const bool little_endian = header.number("scale") < 0;
    const std::string_view pixels = header.pixels(pixelBytes(width, height, channels * 4, path));
    Image image = emptyRgb(width, height);
    image.pixels.resize(std::size_t{width} * height * 3);
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::size_t i = 0; i < std::size_t{width} * 3; ++i) {
            const std::size_t source = channels == 3 ? i : i / 3;
            std::uint32_t bits;
            std::memcpy(&bits, &pixels[((std::size_t{height} - 1 - y) * width * channels + source) * 4], 4);
            if (!little_endian) bits = __builtin_bswap32(bits);
            image.pixels[std::size_t{y} * width * 3 + i] = std::bit_cast<float>(bits);
        }
    return image;
}

Image readPpm(const std::string& path, std::string_view bytes) {
    HeaderReader header(path, bytes);
    const std::uint32_t width = header.size("width");
    const std::uint32_t height = header.size("height");
    const std::uint32_t maximum = header.size("maximum");
    if (maximum > 65535) refuseToRead(path, fmt::format("its maximum is {}, beyond 65535", maximum));
    const std::size_t bytes_a_value = maximum > 255 ? 2 : 1;
    const std::string_view pixels = header.pixels(pixelBytes(width, height, 3 * bytes_a_value, path));
    Image image = emptyRgb(width, height);
    image.chromaticities = chromaticities(ColorSpace::LinearSrgb);
    image.pixels.resize(std::size_t{width} * height * 3);
    const auto* code = reinterpret_cast<const unsigned char*>(pixels.data());
    for (float& value : image.pixels) {
        // 16-bit values are big-endian.
        const unsigned encoded = bytes_a_value == 2 ? code[0] * 256u + code[1] : code[0];
        code += bytes_a_value;
        value = static_cast<float>(srgbToLinear(static_cast<double>(encoded) / maximum));
    }
    return image;
}

// ---------------------------------------------------------------------------------------------- EXR, PNG,
// …

std::vector<CrtImageText> texts(const Image& image) {
    std::vector<CrtImageText> list;
    for (const auto& [name, value] : image.metadata) list.push_back({name.c_str(), value.c_str()});
    return list;
}

std::vector<const char*> pointers(const std::vector<std::string>& names) {
    std::vector<const char*> list;
    for (const std::string& name : names) list.push_back(name.c_str());
    return list;
}

/// Zeros for none.
template <std::size_t Size>
std::array<float, Size> floatsOf(const std::optional<std::array<double, Size>>& values) {
    std::array<float, Size> floats{};
    if (values)
        std::transform(values->begin(), values->end(), floats.begin(),
                       [](double v) { return static_cast<float>(v); });
    return floats;
}

using Reason = std::array<char, 512>;

void writeExr(const std::string& path, const Image& image) {
    colorChannels(image);
    const CrtImageModule& module = imageModule(ModuleFormat::Exr, path, ErrorKind::Output);
    const std::vector<const char*> float_names = pointers(image.channels),
                                   integer_names = pointers(image.integer_channels);
    const std::vector<CrtImageText> metadata = texts(image);
    const std::array<float, 8> primaries = floatsOf(image.chromaticities);

    CrtImagePlanes planes{};
    planes.width = image.width;
    planes.height = image.height;
    planes.float_channel_count = static_cast<std::uint32_t>(float_names.size());
    planes.integer_channel_count = static_cast<std::uint32_t>(integer_names.size());
    planes.float_channels = float_names.data();
    planes.integer_channels = integer_names.data();
    planes.floats = image.pixels.data();
    planes.integers = image.integers.data();
    planes.metadata = metadata.data();
    planes.metadata_count = static_cast<std::uint32_t>(metadata.size());
    planes.chromaticities = image.chromaticities ? primaries.data() : nullptr;
    planes.left = image.left;
    planes.top = image.top;
    planes.whole_width = image.whole_width;
    planes.whole_height = image.whole_height;
    const auto to_camera = floatsOf(image.world_to_camera), to_ndc = floatsOf(image.world_to_ndc);
    const auto neutral = floatsOf(image.adopted_neutral);
    planes.world_to_camera = image.world_to_camera ? to_camera.data() : nullptr;
    planes.world_to_ndc = image.world_to_ndc ? to_ndc.data() : nullptr;
    planes.adopted_neutral = image.adopted_neutral ? neutral.data() : nullptr;
    planes.white_luminance_cd_m2 = static_cast<float>(image.white_luminance_cd_m2.value_or(0));

    AtomicFile file(path);
    Reason reason{};
    if (module.write_exr(file.temporaryPath().c_str(), &planes, reason.data(), reason.size()) != 0)
        refuseToWrite(path, reason.data());
    file.commit();
}

/// A PNG or a JPEG.
void writeWithMetadata(const std::string& path, OutputFormat format, const Image& image,
                       const EncodedImage& encoded) {
    const CrtImageModule& module = imageModule(ModuleFormat::Plain, path, ErrorKind::Output);
    std::vector<CrtImageText> metadata = texts(image);
    // The colour space of the image is not that of the pixels any more.
    for (CrtImageText& text : metadata)
        if (std::strcmp(text.name, kColorInteropIdKey) == 0) text.value = kDisplaySrgbId;
    AtomicFile file(path);
    Reason reason{};
    const auto write = format == OutputFormat::Jpeg ? module.write_jpeg : module.write_png;
    if (write(file.temporaryPath().c_str(), image.width, image.height, encoded.rgb.data(), metadata.data(),
              static_cast<std::uint32_t>(metadata.size()), reason.data(), reason.size()) != 0)
        refuseToWrite(path, reason.data());
    file.commit();
}

Image readWithModule(const std::string& path) {
    const CrtImageModule& module = imageModule(moduleFormatOf(path), path, ErrorKind::Usage);
    const CrtImagePlanes* planes = nullptr;
    Reason reason{};
    // Half: the pixels are there twice when the module hands them over.
    if (module.read(path.c_str(), availableHostMemory() / 2, &planes, reason.data(), reason.size()) != 0)
        refuseToRead(path, reason.data());
    const std::unique_ptr<const CrtImagePlanes, void (*)(const CrtImagePlanes*)> guard(planes,
                                                                                       module.free_image);

    for (const std::string& sentence : sentencesOf(planes->tags, path, PixelUse::EncodedColors))
        logWarning("{}", sentence);

    Image image;
    image.width = planes->width;
    image.height = planes->height;
    const std::size_t pixels = std::size_t{image.width} * image.height;
    image.channels.assign(planes->float_channels, planes->float_channels + planes->float_channel_count);
    image.integer_channels.assign(planes->integer_channels,
                                  planes->integer_channels + planes->integer_channel_count);
    image.pixels.assign(planes->floats, planes->floats + pixels * planes->float_channel_count);
    image.integers.assign(planes->integers, planes->integers + pixels * planes->integer_channel_count);
    for (std::uint32_t i = 0; i < planes->metadata_count; ++i)
        image.metadata.emplace_back(planes->metadata[i].name, planes->metadata[i].value);
    const bool is_part = planes->whole_width != planes->width || planes->whole_height != planes->height ||
                         planes->left != 0 || planes->top != 0;
    if (is_part) {
        image.left = planes->left;
        image.top = planes->top;
        image.whole_width = planes->whole_width;
        image.whole_height = planes->whole_height;
    }
    if (planes->chromaticities != nullptr) {
        image.chromaticities.emplace();
        std::copy_n(planes->chromaticities, 8, image.chromaticities->begin());
    }
    if (!planes->srgb_encoded) return image;

    image.chromaticities = chromaticities(ColorSpace::LinearSrgb);
    const std::size_t channels = image.channels.size();
    const bool has_alpha = image.channels.back() == "A";
    for (std::size_t p = 0; p < pixels; ++p) {
        float* const pixel = &image.pixels[p * channels];
        const double alpha = has_alpha ? pixel[channels - 1] : 1;
        for (std::size_t k = 0; k + (has_alpha ? 1 : 0) < channels; ++k)
            pixel[k] = static_cast<float>(alpha * srgbToLinear(pixel[k]));
    }
    if (channels <= 2) {  // Grey, or grey with alpha.
        Image color = emptyRgb(image.width, image.height);
        color.metadata = std::move(image.metadata);
        color.chromaticities = image.chromaticities;
        for (std::size_t p = 0; p < pixels; ++p)
            color.pixels.insert(color.pixels.end(), 3, image.pixels[p * channels]);
        return color;
    }
    return image;
}

}  // namespace

std::optional<OutputFormat> formatOfFile(const std::string& path) {
    std::string extension = std::filesystem::path(path).extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (extension == ".exr") return OutputFormat::Exr;
    if (extension == ".png") return OutputFormat::Png;
    if (extension == ".jpg" || extension == ".jpeg") return OutputFormat::Jpeg;
    if (extension == ".ppm") return OutputFormat::Ppm;
    if (extension == ".pfm") return OutputFormat::Pfm;
    return std::nullopt;
}

void writeImage(const std::string& path, OutputFormat format, const Image& image) {
    if (image.width == 0 || image.height == 0) refuseToWrite(path, "the image has no pixels");
    if (image.pixels.size() != std::size_t{image.width} * image.height * image.channels.size() ||
        image.integers.size() != std::size_t{image.width} * image.height * image.integer_channels.size())
        throw Error(
            ErrorKind::Internal,
            fmt::format("the image for '{}' has a number of values that contradicts its size and channels",
                        path));
    switch (format) {
        case OutputFormat::Exr: return writeExr(path, image);
        case OutputFormat::Pfm: return writePfm(path, image);
        case OutputFormat::Png:
        case OutputFormat::Jpeg:
        case OutputFormat::Ppm: break;
    }
    const EncodedImage encoded = encodeSrgb8(image);
    if (format == OutputFormat::Ppm)
        writePpm(path, image, encoded);
    else
        writeWithMetadata(path, format, image, encoded);
    tellWhatIsLost(path, image, encoded);
}

Image readImage(const std::string& path) {
    try {
        requireInput(path);
    } catch (const InputRefused& refused) {
        refuseToRead(path, fmt::format("it {}", refused.what()));
    }
    std::ifstream file(path, std::ios::binary);
    char mark[2] = {};
    file.read(mark, 2);
    if (!file) refuseToRead(path, "it is empty");
    const bool pfm = mark[0] == 'P' && (mark[1] == 'F' || mark[1] == 'f');
    const bool ppm = mark[0] == 'P' && mark[1] == '6';
    if (!pfm && !ppm) return readWithModule(path);
    try {
        const std::string bytes = readInput(path, kMostImageBytes);
        return pfm ? readPfm(path, bytes) : readPpm(path, bytes);
    } catch (const InputRefused& refused) {
        refuseToRead(path, fmt::format("it {}", refused.what()));
    }
}

std::string metadataValue(const Image& image, const std::string& key) {
    for (const auto& [name, value] : image.metadata)
        if (name == key) return value;
    return {};
}

}  // namespace crt
