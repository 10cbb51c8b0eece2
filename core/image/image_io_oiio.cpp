// The image codec module: EXR and PNG through OpenImageIO, JPEG through libjpeg-turbo, sound PNG files that
// are textures through libdeflate, Radiance HDR and TGA by its own readers, behind image_module.h. Built as
// a separate library; nothing else in crt includes OpenImageIO.
//
// Over 450 lines: it is all of the module, and all that knows OpenImageIO.
#include "image/image_headers.h"
#include "image/image_module.h"
#include "image/jpeg_reader.h"
#include "image/png_reader.h"
#include "image/radiance_reader.h"
#include "image/tga_reader.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <fstream>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

namespace {

using OIIO::ImageInput;
using OIIO::ImageOutput;
using OIIO::ImageSpec;
using OIIO::TypeDesc;

/// Metadata that readers expect as a number; everything else is text.
constexpr const char* kFloatAttributes[] = {"renderTimeSeconds", "utcOffset"};
constexpr const char* kIntAttributes[] = {"samplesPerPixel"};

template <class Names>
bool contains(const Names& names, const char* name) {
    return std::any_of(std::begin(names), std::end(names),
                       [name](const char* n) { return std::strcmp(n, name) == 0; });
}

/// The functions below throw this to guarded(), which catches it.
struct Failure {
    std::string reason;
};

/// OpenImageIO's own words, or ours when it has none.
std::string wordsOr(std::string words, const char* otherwise) {
    while (!words.empty() && (words.back() == '\n' || words.back() == ' ')) words.pop_back();
    return words.empty() ? otherwise : words;
}

/// Runs `body`; no exception leaves this file.
template <class Body>
std::int32_t guarded(char* reason, std::uint32_t reason_size, Body&& body) noexcept {
    const auto say = [&](const char* text) {
        if (reason != nullptr && reason_size > 0) std::snprintf(reason, reason_size, "%s", text);
        return 1;
    };
    try {
        body();
        return 0;
    } catch (const Failure& failure) {
        return say(failure.reason.c_str());
    } catch (const std::bad_alloc&) {
        return say("there is not enough memory for its pixels");
    } catch (const std::exception& exception) {
        return say(exception.what());
    } catch (...) {
        return say("OpenImageIO failed in an unknown way");
    }
}

void addMetadata(ImageSpec& spec, const CrtImageText* metadata, std::uint32_t count) {
    for (std::uint32_t i = 0; i < count; ++i) {
        const char* name = metadata[i].name;
        const char* value = metadata[i].value;
        if (contains(kFloatAttributes, name)) {
            spec.attribute(name, std::strtof(value, nullptr));
        } else if (contains(kIntAttributes, name)) {
            spec.attribute(
                name, static_cast<int>(std::min<long long>(std::strtoll(value, nullptr, 10), 0x7fffffff)));
        } else {
            spec.attribute(name, value);
        }
    }
}

/// A file for OpenImageIO to write to that remembers the first failure. Left to itself the library writes
/// through a buffer, and what the last flush of it could not write, on a full disk, it does not say: the
/// image would be cut off in silence.
class CheckedFile final : public OIIO::Filesystem::IOProxy {
public:
    explicit CheckedFile(const char* path)
        : IOProxy(path, Write), descriptor_(::open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)) {
        if (descriptor_ < 0) error_number_ = errno;
    }
    ~CheckedFile() override { CheckedFile::close(); }
    CheckedFile(const CheckedFile&) = delete;
    CheckedFile& operator=(const CheckedFile&) = delete;

    const char* proxytype() const override { return "crt"; }
    bool opened() const override { return descriptor_ >= 0; }
    void close() override {
        if (descriptor_ >= 0 && ::close(descriptor_) != 0 && error_number_ == 0) error_number_ = errno;
        descriptor_ = -1;
    }
    bool seek(std::int64_t offset) override {
        m_pos = offset;
        return offset >= 0;
    }
    std::size_t write(const void* bytes, std::size_t size) override {
        const std::size_t written = pwrite(bytes, size, m_pos);
        m_pos += static_cast<std::int64_t>(written);
        return written;
    }
    std::size_t pwrite(const void* bytes, std::size_t size, std::int64_t offset) override {
        std::size_t done = 0;
        while (done < size) {
            const ssize_t n = ::pwrite(descriptor_, static_cast<const char*>(bytes) + done, size - done,
                                       offset + static_cast<std::int64_t>(done));
            if (n < 0 && errno == EINTR) continue;
            if (n < 0 && error_number_ == 0) error_number_ = errno;
            if (n <= 0) break;
            done += static_cast<std::size_t>(n);
        }
        return done;
    }
    void flush() const override {}

    void requireNoFailure() const {
        if (error_number_ != 0) throw Failure{std::strerror(error_number_)};
    }

private:
    int descriptor_ = -1;
    int error_number_ = 0;
};

void writeWith(const char* format, const char* path, const ImageSpec& spec, const TypeDesc& type,
               const void* pixels) {
    CheckedFile file(path);  // Outlives the writer, whose destructor may still write.
    file.requireNoFailure();
    const std::unique_ptr<ImageOutput> output = ImageOutput::create(format);
    if (!output) throw Failure{wordsOr(OIIO::geterror(), "this OpenImageIO was built without the format")};
    output->set_ioproxy(&file);
    const auto write = [&] {
        if (!output->open(path, spec))
            throw Failure{wordsOr(output->geterror(), "the file cannot be opened")};
        if (!output->write_image(type, pixels))
            throw Failure{wordsOr(output->geterror(), "the pixels cannot be written")};
        if (!output->close()) throw Failure{wordsOr(output->geterror(), "the file cannot be completed")};
    };
    try {
        write();
    } catch (const std::exception&) {
        file.requireNoFailure();
        throw;
    } catch (const Failure&) {
        file.requireNoFailure();  // The error of the disk is more precise than that of the library.
        throw;
    }
    file.close();
    file.requireNoFailure();
}

std::int32_t writeExr(const char* path, const CrtImagePlanes* image, char* reason,
                      std::uint32_t reason_size) {
    return guarded(reason, reason_size, [&] {
        const std::uint32_t floats = image->float_channel_count, integers = image->integer_channel_count;
        ImageSpec spec(static_cast<int>(image->width), static_cast<int>(image->height),
                       static_cast<int>(floats + integers), TypeDesc::FLOAT);
        spec.channelnames.clear();
        spec.channelformats.clear();
        for (std::uint32_t c = 0; c < floats; ++c) {
            spec.channelnames.emplace_back(image->float_channels[c]);
            spec.channelformats.emplace_back(TypeDesc::FLOAT);
        }
        for (std::uint32_t c = 0; c < integers; ++c) {
            spec.channelnames.emplace_back(image->integer_channels[c]);
            spec.channelformats.emplace_back(TypeDesc::UINT32);
        }
        if (integers == 0) spec.channelformats.clear();
        for (std::size_t c = 0; c < spec.channelnames.size(); ++c) {
            if (spec.channelnames[c] == "Z") spec.z_channel = static_cast<int>(c);
            if (spec.channelnames[c] == "A") spec.alpha_channel = static_cast<int>(c);
        }
        spec.x = image->left;
        spec.y = image->top;
        if (image->whole_width > 0) {
            spec.full_width = static_cast<int>(image->whole_width);
            spec.full_height = static_cast<int>(image->whole_height);
        }
        spec.attribute("compression", "zip");
        if (image->chromaticities != nullptr)
            spec.attribute("chromaticities", TypeDesc(TypeDesc::FLOAT, 8), image->chromaticities);
        if (image->world_to_camera != nullptr)
            spec.attribute("worldToCamera", TypeDesc::TypeMatrix, image->world_to_camera);
        if (image->world_to_ndc != nullptr)
            spec.attribute("worldToNDC", TypeDesc::TypeMatrix, image->world_to_ndc);
        if (image->adopted_neutral != nullptr)
            spec.attribute("adoptedNeutral", TypeDesc(TypeDesc::FLOAT, TypeDesc::VEC2),
                           image->adopted_neutral);
        if (image->white_luminance_cd_m2 > 0)
            spec.attribute("whiteLuminance", image->white_luminance_cd_m2);
        // Left to itself the library stamps the present time on every EXR, and the same image would never be
        // the same file.
        spec.attribute("DateTime", "");
        addMetadata(spec, image->metadata, image->metadata_count);

        // "Native" pixels, float and integer side by side: handing OpenImageIO floats for a uint32 channel
        // would scale them by 2^32.
        const std::size_t pixels = std::size_t{image->width} * image->height;
        std::vector<unsigned char> packed(pixels * (floats + integers) * 4);
        unsigned char* next = packed.data();
        for (std::size_t p = 0; p < pixels; ++p) {
            if (floats > 0) std::memcpy(next, image->floats + p * floats, floats * 4);
            next += floats * 4;
            if (integers > 0) std::memcpy(next, image->integers + p * integers, integers * 4);
            next += integers * 4;
        }
        writeWith("exr", path, spec, integers == 0 ? TypeDesc(TypeDesc::FLOAT) : TypeDesc(TypeDesc::UNKNOWN),
                  packed.data());
    });
}

std::int32_t writePng(const char* path, std::uint32_t width, std::uint32_t height, const std::uint8_t* rgb,
                      const CrtImageText* metadata, std::uint32_t metadata_count, char* reason,
                      std::uint32_t reason_size) {
    return guarded(reason, reason_size, [&] {
        ImageSpec spec(static_cast<int>(width), static_cast<int>(height), 3, TypeDesc::UINT8);
        spec.attribute("oiio:ColorSpace", "sRGB");
        addMetadata(spec, metadata, metadata_count);
        writeWith("png", path, spec, TypeDesc::UINT8, rgb);
    });
}

/// The image that read() returns, with the data that it points to.
struct OwnedImage : CrtImagePlanes {
    OwnedImage() : CrtImagePlanes{} {}
    std::vector<std::string> float_names, integer_names, metadata_text;
    std::vector<const char*> float_pointers, integer_pointers;
    std::vector<CrtImageText> texts;
    std::vector<float> float_values;
    std::vector<std::uint32_t> integer_values;
    std::array<float, 8> primaries{};
};

bool isInteger(const ImageSpec& spec, int channel) {
    // 8- and 16-bit integers are codes of a fraction; 32-bit ones are counts and ids.
    const TypeDesc type = spec.channelformat(channel);
    return type.basetype == TypeDesc::UINT32 || type.basetype == TypeDesc::INT32;
}

/// Formats of renders to compare, by the first bytes of such a file. Not left to OpenImageIO: it hands a
/// file that it does not know to each of some thirty readers in turn, video codecs among them, which costs
/// 0.2 s and trusts the least hardened of them with whatever the file holds. TIFF and JPEG are not among
/// them: their readers did not stand fuzzing (docs/decisions/0005).
struct KnownFormat {
    const char* name;  ///< As OpenImageIO calls it.
    std::string_view signature;
    void (*check_header)(const std::string& path) = nullptr;
};
constexpr KnownFormat kKnownFormats[] = {
    {"openexr", std::string_view("\x76\x2f\x31\x01", 4), crt::image::checkExrHeader},
    {"png", std::string_view("\x89PNG\r\n\x1a\n", 8), crt::image::checkPngHeader},
};

/// First bytes of a file.
std::string beginningOf(const char* path) {
    char beginning[16] = {};
    std::ifstream file(path, std::ios::binary);
    file.read(beginning, sizeof beginning);
    return {beginning, static_cast<std::size_t>(file.gcount())};
}

/// Null for a file of no known format.
std::unique_ptr<ImageInput> openKnown(const char* path, ImageSpec& spec, const ImageSpec& wishes) {
    const std::string beginning = beginningOf(path);
    const std::string_view there(beginning);
    for (const KnownFormat& format : kKnownFormats) {
        if (there.substr(0, format.signature.size()) != format.signature) continue;
        if (format.check_header != nullptr) format.check_header(path);
        std::unique_ptr<ImageInput> input = ImageInput::create(format.name);
        if (!input)
            throw Failure{wordsOr(OIIO::geterror(), "this OpenImageIO was built without the format")};
        if (!input->open(path, spec, wishes))
            throw Failure{wordsOr(input->geterror(), "it cannot be opened")};
        if (spec.deep) throw Failure{"it is a deep image"};
        if (spec.depth > 1) throw Failure{"it is a volume"};
        return input;
    }
    return nullptr;
}

bool isPng(const ImageInput& input) { return std::strcmp(input.format_name(), "png") == 0; }

std::unique_ptr<ImageInput> openImage(const char* path, ImageSpec& spec) {
    if (std::unique_ptr<ImageInput> input = openKnown(path, spec, ImageSpec())) return input;
    throw Failure{
        "it is not an EXR, PNG, PFM, PPM or Radiance HDR file; OpenImageIO's oiiotool converts other "
        "formats: oiiotool IN -o OUT.exr"};
}

crt::image::RadianceHeader radianceHeader(const char* path) {
    crt::image::RadianceHeader header;
    const std::string why = crt::image::readRadiance(path, &header, nullptr, 0);
    if (!why.empty()) throw Failure{why};
    return header;
}

void takeTags(const crt::image::RadianceHeader& header, CrtUnappliedTags& tags) {
    tags.exposure = static_cast<float>(header.exposure);
    for (std::size_t k = 0; k < 3; ++k)
        tags.color_correction[k] = static_cast<float>(header.color_correction[k]);
}

std::unique_ptr<OwnedImage> readRadianceImage(const char* path, std::uint64_t most_bytes) {
    crt::image::RadianceHeader header = radianceHeader(path);
    crt::image::checkMemory(header.width, header.height, 3 * sizeof(float), most_bytes);
    auto owned = std::make_unique<OwnedImage>();
    owned->float_values.resize(std::size_t{header.width} * header.height * 3);
    const std::string why =
        crt::image::readRadiance(path, &header, owned->float_values.data(), owned->float_values.size());
    if (!why.empty()) throw Failure{why};
    owned->float_names = {"R", "G", "B"};
    for (const std::string& name : owned->float_names) owned->float_pointers.push_back(name.c_str());
    owned->width = owned->whole_width = header.width;
    owned->height = owned->whole_height = header.height;
    owned->float_channel_count = 3;
    owned->float_channels = owned->float_pointers.data();
    owned->floats = owned->float_values.data();
    if (header.chromaticities) {
        owned->primaries = *header.chromaticities;
        owned->chromaticities = owned->primaries.data();
    }
    takeTags(header, owned->tags);
    return owned;
}

std::int32_t readImage(const char* path, std::uint64_t most_bytes, const CrtImagePlanes** image,
                       char* reason, std::uint32_t reason_size) {
    return guarded(reason, reason_size, [&] {
        if (crt::image::beginsAsRadiance(path)) {
            *image = readRadianceImage(path, most_bytes).release();
            return;
        }
        ImageSpec spec;
        const std::unique_ptr<ImageInput> input = openImage(path, spec);
        const auto width = static_cast<std::uint64_t>(std::max(spec.width, 0)),
                   height = static_cast<std::uint64_t>(std::max(spec.height, 0));
        crt::image::checkMemory(width, height,
                                static_cast<std::uint64_t>(std::max(spec.nchannels, 0)) * sizeof(float),
                                most_bytes);
        crt::image::checkRows(width, height, spec.pixel_bytes(true));

        auto owned = std::make_unique<OwnedImage>();
        owned->left = spec.x - spec.full_x;
        owned->top = spec.y - spec.full_y;
        owned->whole_width = static_cast<std::uint32_t>(std::max(spec.full_width, 0));
        owned->whole_height = static_cast<std::uint32_t>(std::max(spec.full_height, 0));
        // The names of a format without named channels follow from their number.
        for (int c = 0; c < spec.nchannels; ++c)
            (isInteger(spec, c) ? owned->integer_names : owned->float_names).push_back(spec.channel_name(c));
        const std::size_t pixels = std::size_t(spec.width) * std::size_t(spec.height);
        owned->float_values.resize(pixels * owned->float_names.size());
        owned->integer_values.resize(pixels * owned->integer_names.size());

        // Runs of one kind at a time: one call for all would convert counts to fractions of 2^32.
        std::size_t float_channel = 0, integer_channel = 0;
        for (int first = 0; first < spec.nchannels;) {
            const bool integer = isInteger(spec, first);
            int end = first + 1;
            while (end < spec.nchannels && isInteger(spec, end) == integer) ++end;
            const std::size_t stride =
                4 * (integer ? owned->integer_names.size() : owned->float_names.size());
            void* target = integer ? static_cast<void*>(owned->integer_values.data() + integer_channel)
                                   : static_cast<void*>(owned->float_values.data() + float_channel);
            const TypeDesc type =
                integer ? TypeDesc(spec.channelformat(first).basetype == TypeDesc::INT32 ? TypeDesc::INT32
                                                                                         : TypeDesc::UINT32)
                        : TypeDesc(TypeDesc::FLOAT);
            if (pixels > 0 &&
                !input->read_image(0, 0, first, end, type, target, static_cast<OIIO::stride_t>(stride)))
                throw Failure{wordsOr(input->geterror(), "its pixels cannot be read")};
            (integer ? integer_channel : float_channel) += static_cast<std::size_t>(end - first);
            first = end;
        }

        // Reserved at once, because the C view points into the strings.
        owned->metadata_text.reserve(2 * spec.extra_attribs.size());
        for (const OIIO::ParamValue& attribute : spec.extra_attribs) {
            const std::string name = attribute.name().string();
            const TypeDesc type = attribute.type();
            if (name == "chromaticities" && type.basetype == TypeDesc::FLOAT && type.basevalues() == 8) {
                std::memcpy(owned->primaries.data(), attribute.data(), sizeof owned->primaries);
                owned->chromaticities = owned->primaries.data();
                continue;
            }
            // Attributes that OpenImageIO adds itself are not in the file.
            const bool scalar = type == TypeDesc::STRING || type == TypeDesc::INT || type == TypeDesc::FLOAT;
            std::string value = scalar ? attribute.get_string() : std::string();
            if (value.empty() || name.rfind("oiio:", 0) == 0) continue;
            owned->metadata_text.push_back(name);
            owned->metadata_text.push_back(std::move(value));
        }
        for (std::size_t i = 0; i < owned->metadata_text.size(); i += 2)
            owned->texts.push_back({owned->metadata_text[i].c_str(), owned->metadata_text[i + 1].c_str()});
        for (const std::string& name : owned->float_names) owned->float_pointers.push_back(name.c_str());
        for (const std::string& name : owned->integer_names) owned->integer_pointers.push_back(name.c_str());

        CrtImagePlanes& view = *owned;
        view.width = static_cast<std::uint32_t>(spec.width);
        view.height = static_cast<std::uint32_t>(spec.height);
        view.float_channel_count = static_cast<std::uint32_t>(owned->float_names.size());
        view.integer_channel_count = static_cast<std::uint32_t>(owned->integer_names.size());
        view.float_channels = owned->float_pointers.data();
        view.integer_channels = owned->integer_pointers.data();
        view.floats = owned->float_values.data();
        view.integers = owned->integer_values.data();
        view.metadata = owned->texts.data();
        view.metadata_count = static_cast<std::uint32_t>(owned->texts.size());
        if (isPng(*input)) view.tags = crt::image::tagsOfPng(path);
        view.srgb_encoded =
            spec.format.basetype == TypeDesc::UINT8 || spec.format.basetype == TypeDesc::UINT16;
        *image = owned.release();
    });
}

// ---- Images as values
// -------------------------------------------------------------------------------------

/// The channels that are the colour: R, G and B, or the only one beside alpha.
std::vector<int> colorChannels(const ImageSpec& spec) {
    std::vector<int> rgb;
    for (const char* const name : {"R", "G", "B"})
        if (const int c = spec.channelindex(name); c >= 0) rgb.push_back(c);
    if (rgb.size() == 3) return rgb;
    std::vector<int> others;
    for (int c = 0; c < spec.nchannels; ++c)
        if (c != spec.alpha_channel && c != spec.z_channel) others.push_back(c);
    if (others.size() == 1) return others;
    std::string names;
    for (const std::string& name : spec.channelnames) names += (names.empty() ? "" : ", ") + name;
    throw Failure{"it has the channels " + names.substr(0, 200) + "; a texture needs R, G and B, or a "
                  "single channel other than alpha (A) and depth (Z)"};
}

std::uint32_t texelType(const ImageSpec& spec) {
    switch (spec.format.basetype) {
        case TypeDesc::UINT8: return CRT_TEXELS_UINT8;
        case TypeDesc::UINT16: return CRT_TEXELS_UINT16;
        case TypeDesc::HALF:
        case TypeDesc::FLOAT: return CRT_TEXELS_FLOAT;
        default: throw Failure{"its pixels are neither floats nor of 8 or 16 bits"};
    }
}

enum class Part { Color, Alpha };

/// The rectangle of a file's pixels in its image: an EXR's data window may be smaller or larger than its
/// display window.
struct Placement {
    explicit Placement(const ImageSpec& spec)
        : width(spec.full_width > 0 ? spec.full_width : spec.width),
          height(spec.full_height > 0 ? spec.full_height : spec.height),
          left(spec.full_width > 0 ? spec.x - spec.full_x : 0),
          top(spec.full_height > 0 ? spec.y - spec.full_y : 0),
          is_whole(left == 0 && top == 0 && width == spec.width && height == spec.height) {}

    /// Copies the pixels that lie in the picture; the other pixels of `to` stay as they are. `bytes`: of a
    /// pixel.
    void place(const ImageSpec& spec, const unsigned char* from, unsigned char* to,
               std::size_t bytes) const {
        const std::int64_t first = std::max<std::int64_t>(0, -left),
                           end = std::min<std::int64_t>(spec.width, width - left);
        for (std::int64_t row = 0; row < spec.height && first < end; ++row) {
            const std::int64_t at = row + top;
            if (at < 0 || at >= height) continue;
            std::memcpy(to + static_cast<std::size_t>(at * width + left + first) * bytes,
                        from + static_cast<std::size_t>(row * spec.width + first) * bytes,
                        static_cast<std::size_t>(end - first) * bytes);
        }
    }

    /// A display window costs memory without pixels in the file: a header of 1 kB may name gigabytes.
    void requireReasonable(const ImageSpec& spec) const {
        constexpr std::int64_t kAlwaysPixels = std::int64_t{1} << 24, kMostTimes = 64;
        const std::int64_t read = std::int64_t{spec.width} * spec.height;
        if (width * height > std::max(kAlwaysPixels, kMostTimes * read))
            throw Failure{fmt::format("its display window has {} x {} pixels, its data window only {} x {}; "
                                      "above {} million pixels it may have {} times as many",
                                      width, height, spec.width, spec.height, kAlwaysPixels >> 20,
                                      kMostTimes)};
    }

    std::int64_t width, height;  ///< Of the picture (its display window).
    std::int64_t left, top;      ///< Of the file's first pixel in it.
    bool is_whole;
};

std::vector<int> channelsOf(const ImageSpec& spec, Part part) {
    if (part == Part::Color) return colorChannels(spec);
    return spec.alpha_channel >= 0 ? std::vector<int>{spec.alpha_channel} : std::vector<int>{};
}

/// The caller's buffer.
struct Target {
    unsigned char* data;  ///< Null to read only the header.
    std::uint64_t bytes;
};

/// Throws Failure with a reader's message, unless it is empty.
void require(const std::string& why) {
    if (!why.empty()) throw Failure{why};
}

void readJpegPart(Part part, const char* path, CrtTexelsInfo& info, const Target& to) {
    require(crt::image::readJpeg(path, &info, part == Part::Color ? to.data : nullptr, to.bytes));
    if (part == Part::Alpha) info.channels = 0;
}

void readTgaPart(Part part, const char* path, CrtTexelsInfo& info, const Target& to) {
    if (!crt::image::beginsAsTga(path))
        throw Failure{"it is not a PNG, JPEG, TGA, EXR, Radiance HDR or PFM file"};
    const auto tga_part = part == Part::Color ? crt::image::TgaPart::Color : crt::image::TgaPart::Alpha;
    require(crt::image::readTga(path, tga_part, &info, to.data, to.bytes));
}

void readRadiancePart(Part part, const char* path, CrtTexelsInfo& info, const Target& to) {
    crt::image::RadianceHeader header = radianceHeader(path);
    info.width = header.width;
    info.height = header.height;
    info.channels = part == Part::Color ? 3 : 0;
    info.type = CRT_TEXELS_FLOAT;
    info.has_chromaticities = header.chromaticities.has_value();
    if (header.chromaticities)
        std::copy(header.chromaticities->begin(), header.chromaticities->end(), info.chromaticities);
    takeTags(header, info.tags);
    if (to.data != nullptr && part == Part::Color)
        require(crt::image::readRadiance(path, &header, reinterpret_cast<float*>(to.data),
                                         to.bytes / sizeof(float)));
}

/// EXR and PNG.
void readPartOf(ImageInput& input, const ImageSpec& spec, Part part, const char* path, CrtTexelsInfo& info,
                const Target& to) {
    const auto width = static_cast<std::uint64_t>(std::max(spec.width, 0)),
               height = static_cast<std::uint64_t>(std::max(spec.height, 0));
    crt::image::checkRows(width, height, spec.pixel_bytes(true));
    const Placement placement(spec);
    placement.requireReasonable(spec);
    const std::vector<int> channels = channelsOf(spec, part);
    info.width = static_cast<std::uint32_t>(placement.width);
    info.height = static_cast<std::uint32_t>(placement.height);
    info.channels = static_cast<std::uint32_t>(channels.size());
    info.type = texelType(spec);
    info.has_chromaticities =
        spec.getattribute("chromaticities", TypeDesc(TypeDesc::FLOAT, 8), info.chromaticities);
    if (isPng(input)) info.tags = crt::image::tagsOfPng(path);
    // OpenEXR, "Technical Introduction": colours are multiplied by alpha.
    info.is_associated = !isPng(input) && spec.alpha_channel >= 0;
    const TypeDesc type = info.type == CRT_TEXELS_UINT8    ? TypeDesc(TypeDesc::UINT8)
                          : info.type == CRT_TEXELS_UINT16 ? TypeDesc(TypeDesc::UINT16)
                                                           : TypeDesc(TypeDesc::FLOAT);
    const std::size_t pixel = channels.size() * type.size();
    if (!channels.empty())
        crt::image::checkChannels(width * height, spec.pixel_bytes(true),
                                  static_cast<std::uint64_t>(spec.nchannels), pixel);
    if (to.data == nullptr) return;

    if (std::uint64_t{info.width} * info.height * pixel != to.bytes)
        throw Failure{"it has changed while it was read"};
    std::vector<unsigned char> own;  // The file's pixels, where the picture has others.
    if (!placement.is_whole) own.resize(static_cast<std::size_t>(width * height) * pixel);
    auto* const bytes = placement.is_whole ? to.data : own.data();
    if (part == Part::Color && isPng(input) && crt::image::readPng(path, info, bytes, to.bytes)) return;
    for (std::size_t c = 0; c < channels.size();) {
        std::size_t end = c + 1;
        while (end < channels.size() && channels[end] == channels[end - 1] + 1) ++end;
        if (!input.read_image(0, 0, channels[c], channels[end - 1] + 1, type, bytes + c * type.size(),
                              static_cast<OIIO::stride_t>(pixel)))
            throw Failure{wordsOr(input.geterror(), "its pixels cannot be read")};
        c = end;
    }
    if (placement.is_whole) return;
    std::memset(to.data, 0, to.bytes);
    placement.place(spec, bytes, to.data, pixel);
}

std::int32_t readPart(Part part, const char* path, CrtTexelsInfo* info, const Target& to, char* reason,
                      std::uint32_t reason_size) {
    return guarded(reason, reason_size, [&] {
        *info = {};
        if (beginningOf(path).compare(0, 3, "\xff\xd8\xff") == 0) return readJpegPart(part, path, *info, to);
        if (crt::image::beginsAsRadiance(path)) return readRadiancePart(part, path, *info, to);
        ImageSpec spec, wishes;
        wishes.attribute("oiio:UnassociatedAlpha", 1);  // Else colours of PNG come multiplied by alpha.
        if (const std::unique_ptr<ImageInput> input = openKnown(path, spec, wishes))
            return readPartOf(*input, spec, part, path, *info, to);
        readTgaPart(part, path, *info, to);
    });
}

std::int32_t readTexels(const char* path, CrtTexelsInfo* info, void* buffer, std::uint64_t buffer_bytes,
                        char* reason, std::uint32_t reason_size) {
    return readPart(Part::Color, path, info, {static_cast<unsigned char*>(buffer), buffer_bytes}, reason,
                    reason_size);
}

std::int32_t readAlpha(const char* path, CrtTexelsInfo* info, void* buffer, std::uint64_t buffer_bytes,
                       char* reason, std::uint32_t reason_size) {
    return readPart(Part::Alpha, path, info, {static_cast<unsigned char*>(buffer), buffer_bytes}, reason,
                    reason_size);
}

void freeImage(const CrtImagePlanes* image) { delete static_cast<const OwnedImage*>(image); }

}  // namespace

extern "C" __attribute__((visibility("default"))) const CrtImageModule* CRT_IMAGE_MODULE_ENTRY(void);

extern "C" const CrtImageModule* CRT_IMAGE_MODULE_ENTRY(void) {
    static const bool reads_in_strips [[maybe_unused]] =
        OIIO::attribute("read_chunk", static_cast<int>(crt::image::kStripRows));
    static const CrtImageModule table{sizeof(CrtImageModule),
                                      0,
                                      "OpenImageIO " OIIO_VERSION_STRING,
                                      writeExr,
                                      writePng,
                                      readImage,
                                      freeImage,
                                      readTexels,
                                      readAlpha};
    return &table;
}
