// The image module that reads EXR, through OpenImageIO, behind image_module.h. Built as a separate library;
// nothing else in crt includes OpenImageIO.
#include "image/exr_header.h"
#include "image/image_bounds.h"
#include "image/image_module.h"
#include "image/module_support.h"

#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace crt::image;
using OIIO::ImageInput;
using OIIO::ImageSpec;
using OIIO::TypeDesc;

/// OpenImageIO's own words, or ours when it has none.
std::string wordsOr(std::string words, const char* otherwise) {
    while (!words.empty() && (words.back() == '\n' || words.back() == ' ')) words.pop_back();
    return words.empty() ? otherwise : words;
}

bool isInteger(const ImageSpec& spec, int channel) {
    // 8- and 16-bit integers are codes of a fraction; 32-bit ones are counts and ids.
    const TypeDesc type = spec.channelformat(channel);
    return type.basetype == TypeDesc::UINT32 || type.basetype == TypeDesc::INT32;
}

std::unique_ptr<ImageInput> openExr(const char* path, ImageSpec& spec) {
    checkExrHeader(path);
    std::unique_ptr<ImageInput> input = ImageInput::create("openexr");
    if (!input) throw Failure{wordsOr(OIIO::geterror(), "this OpenImageIO was built without the format")};
    if (!input->open(path, spec)) throw Failure{wordsOr(input->geterror(), "it cannot be opened")};
    if (spec.deep) throw Failure{"it is a deep image"};
    if (spec.depth > 1) throw Failure{"it is a volume"};
    return input;
}

std::int32_t readImage(const char* path, std::uint64_t most_bytes, const CrtImagePlanes** image,
                       char* reason, std::uint32_t reason_size) {
    return guarded(reason, reason_size, [&] {
        ImageSpec spec;
        const std::unique_ptr<ImageInput> input = openExr(path, spec);
        const auto width = static_cast<std::uint64_t>(std::max(spec.width, 0)),
                   height = static_cast<std::uint64_t>(std::max(spec.height, 0));
        checkMemory(width, height, static_cast<std::uint64_t>(std::max(spec.nchannels, 0)) * sizeof(float),
                    most_bytes);
        checkRows(width, height, spec.pixel_bytes(true));

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
        owned->width = static_cast<std::uint32_t>(spec.width);
        owned->height = static_cast<std::uint32_t>(spec.height);
        owned->show();
        *image = owned.release();
    });
}

// ---- Images as values ---------------------------------------------------------------------------------

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

void requireFloats(const ImageSpec& spec) {
    if (spec.format.basetype != TypeDesc::HALF && spec.format.basetype != TypeDesc::FLOAT)
        throw Failure{"its pixels are integers; a texture in an EXR file has floats or halves"};
}

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

std::vector<int> channelsOf(const ImageSpec& spec, TexelPart part) {
    if (part == TexelPart::Color) return colorChannels(spec);
    return spec.alpha_channel >= 0 ? std::vector<int>{spec.alpha_channel} : std::vector<int>{};
}

void readPartOf(ImageInput& input, const ImageSpec& spec, TexelPart part, CrtTexelsInfo& info,
                const Target& to) {
    const auto width = static_cast<std::uint64_t>(std::max(spec.width, 0)),
               height = static_cast<std::uint64_t>(std::max(spec.height, 0));
    checkRows(width, height, spec.pixel_bytes(true));
    const Placement placement(spec);
    placement.requireReasonable(spec);
    const std::vector<int> channels = channelsOf(spec, part);
    info.width = static_cast<std::uint32_t>(placement.width);
    info.height = static_cast<std::uint32_t>(placement.height);
    info.channels = static_cast<std::uint32_t>(channels.size());
    requireFloats(spec);
    info.type = CRT_TEXELS_FLOAT;
    info.has_chromaticities =
        spec.getattribute("chromaticities", TypeDesc(TypeDesc::FLOAT, 8), info.chromaticities);
    // OpenEXR, "Technical Introduction": colours are multiplied by alpha.
    info.is_associated = spec.alpha_channel >= 0;
    const std::size_t pixel = channels.size() * sizeof(float);
    if (!channels.empty())
        checkChannels(width * height, spec.pixel_bytes(true), static_cast<std::uint64_t>(spec.nchannels),
                      pixel);
    if (to.data == nullptr) return;

    if (std::uint64_t{info.width} * info.height * pixel != to.bytes)
        throw Failure{"it has changed while it was read"};
    std::vector<unsigned char> own;  // The file's pixels, where the picture has others.
    if (!placement.is_whole) own.resize(static_cast<std::size_t>(width * height) * pixel);
    auto* const bytes = placement.is_whole ? to.data : own.data();
    for (std::size_t c = 0; c < channels.size();) {
        std::size_t end = c + 1;
        while (end < channels.size() && channels[end] == channels[end - 1] + 1) ++end;
        if (!input.read_image(0, 0, channels[c], channels[end - 1] + 1, TypeDesc::FLOAT,
                              bytes + c * sizeof(float), static_cast<OIIO::stride_t>(pixel)))
            throw Failure{wordsOr(input.geterror(), "its pixels cannot be read")};
        c = end;
    }
    if (placement.is_whole) return;
    std::memset(to.data, 0, to.bytes);
    placement.place(spec, bytes, to.data, pixel);
}

void readPart(TexelPart part, const char* path, CrtTexelsInfo& info, const Target& to) {
    ImageSpec spec;
    const std::unique_ptr<ImageInput> input = openExr(path, spec);
    readPartOf(*input, spec, part, info, to);
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const CrtImageModule* CRT_IMAGE_MODULE_ENTRY(void);

extern "C" const CrtImageModule* CRT_IMAGE_MODULE_ENTRY(void) {
    static const bool reads_in_strips [[maybe_unused]] =
        OIIO::attribute("read_chunk", static_cast<int>(kStripRows));
    static const CrtImageModule table{sizeof(CrtImageModule),
                                      0,
                                      "OpenImageIO " OIIO_VERSION_STRING,
                                      nullptr,
                                      nullptr,
                                      nullptr,
                                      readImage,
                                      freeImage,
                                      readPartBy<TexelPart::Color, readPart>,
                                      readPartBy<TexelPart::Alpha, readPart>};
    return &table;
}
