#include "image/exr_writer.h"

#include "image/module_support.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfThreading.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iterator>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

namespace crt::image {
namespace {

/// Metadata that readers expect as a number; everything else is text.
constexpr std::string_view kFloatAttributes[] = {"renderTimeSeconds", "utcOffset"};
constexpr std::string_view kIntAttributes[] = {"samplesPerPixel"};

template <class Names>
bool contains(const Names& names, std::string_view name) {
    return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

/// The names of metadata in crt, and those that OpenEXR's documentation gives them ("Standard Optional
/// Attributes").
constexpr std::pair<std::string_view, std::string_view> kNames[] = {{"DateTime", "capDate"},
                                                                    {"ImageDescription", "comments"}};

std::string nameInExr(std::string_view name) {
    for (const auto& [ours, theirs] : kNames)
        if (name == ours) return std::string(theirs);
    return std::string(name);
}

/// A file for OpenEXR to write to that remembers the first failure: the library writes a part of the file in
/// a destructor, which cannot tell that the disk was full.
class CheckedFile final : public Imf::OStream {
public:
    explicit CheckedFile(const char* path)
        : OStream(path), descriptor_(::open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)) {
        if (descriptor_ < 0) error_number_ = errno;
        requireNoFailure();
    }
    ~CheckedFile() override { closeFile(); }
    CheckedFile(const CheckedFile&) = delete;
    CheckedFile& operator=(const CheckedFile&) = delete;

    void write(const char* bytes, int size) override {
        for (auto left = static_cast<std::size_t>(size); left > 0;) {
            const ssize_t n = ::pwrite(descriptor_, bytes, left, static_cast<off_t>(at_));
            if (n < 0 && errno == EINTR) continue;
            if (n <= 0 && error_number_ == 0) error_number_ = n < 0 ? errno : EIO;
            requireNoFailure();
            bytes += n;
            left -= static_cast<std::size_t>(n);
            at_ += static_cast<std::uint64_t>(n);
        }
    }
    std::uint64_t tellp() override { return at_; }
    void seekp(std::uint64_t position) override { at_ = position; }

    /// The last thing to be done.
    void finish() {
        closeFile();
        requireNoFailure();
    }

private:
    void requireNoFailure() const {
        if (error_number_ != 0) throw Failure{std::strerror(error_number_)};
    }
    void closeFile() {
        if (descriptor_ >= 0 && ::close(descriptor_) != 0 && error_number_ == 0) error_number_ = errno;
        descriptor_ = -1;
    }

    int descriptor_;
    int error_number_ = 0;
    std::uint64_t at_ = 0;
};

void addMetadata(Imf::Header& header, const CrtImagePlanes& image) {
    for (std::uint32_t i = 0; i < image.metadata_count; ++i) {
        const char* const value = image.metadata[i].value;
        const std::string name = nameInExr(image.metadata[i].name);
        if (contains(kFloatAttributes, name))
            header.insert(name, Imf::FloatAttribute(std::strtof(value, nullptr)));
        else if (contains(kIntAttributes, name))
            header.insert(name, Imf::IntAttribute(static_cast<int>(
                                    std::min<long long>(std::strtoll(value, nullptr, 10), 0x7fffffff))));
        else
            header.insert(name, Imf::StringAttribute(value));
    }
}

Imath::M44f matrixOf(const float* rows) {
    Imath::M44f matrix;
    std::memcpy(matrix.x, rows, sizeof matrix.x);
    return matrix;
}

Imf::Header headerOf(const CrtImagePlanes& image, const Imath::Box2i& pixels) {
    const Imath::Box2i whole = image.whole_width > 0
                                   ? Imath::Box2i({0, 0}, {static_cast<int>(image.whole_width) - 1,
                                                           static_cast<int>(image.whole_height) - 1})
                                   : pixels;
    Imf::Header header(whole, pixels, 1, {0, 0}, 1, Imf::INCREASING_Y, Imf::ZIP_COMPRESSION);
    if (const float* const c = image.chromaticities)
        Imf::addChromaticities(header, {{c[0], c[1]}, {c[2], c[3]}, {c[4], c[5]}, {c[6], c[7]}});
    if (image.world_to_camera != nullptr) Imf::addWorldToCamera(header, matrixOf(image.world_to_camera));
    if (image.world_to_ndc != nullptr) Imf::addWorldToNDC(header, matrixOf(image.world_to_ndc));
    if (const float* const xy = image.adopted_neutral) Imf::addAdoptedNeutral(header, {xy[0], xy[1]});
    if (image.white_luminance_cd_m2 > 0) Imf::addWhiteLuminance(header, image.white_luminance_cd_m2);
    addMetadata(header, image);
    return header;
}

/// Gives OpenEXR a thread for each processor, once, if `bytes` are worth it. Otherwise, and if the system
/// refuses threads, it compresses in the thread that calls it.
void useThreadsFor(std::uint64_t bytes) {
    constexpr std::uint64_t kWorthThreads = std::uint64_t{4} << 20;
    static std::once_flag once;
    if (bytes < kWorthThreads) return;
    std::call_once(once, [] {
        try {
            Imf::setGlobalThreadCount(static_cast<int>(std::thread::hardware_concurrency()));
        } catch (const std::exception&) {
            // One thread does it all.
        }
    });
}

}  // namespace

void writeExr(const char* path, const CrtImagePlanes& image) {
    const Imath::V2i first(image.left, image.top);
    const Imath::Box2i pixels(
        first, first + Imath::V2i(static_cast<int>(image.width) - 1, static_cast<int>(image.height) - 1));
    Imf::Header header = headerOf(image, pixels);
    Imf::FrameBuffer planes;
    const auto add = [&](Imf::PixelType type, std::uint32_t count, const char* const* names,
                         const void* values) {
        const std::size_t pixel = std::size_t{count} * 4;
        for (std::uint32_t c = 0; c < count; ++c) {
            header.channels().insert(names[c], Imf::Channel(type));
            planes.insert(names[c], Imf::Slice::Make(type, static_cast<const char*>(values) + 4 * c, pixels,
                                                     pixel, pixel * image.width));
        }
    };
    add(Imf::FLOAT, image.float_channel_count, image.float_channels, image.floats);
    add(Imf::UINT, image.integer_channel_count, image.integer_channels, image.integers);
    useThreadsFor(std::uint64_t{image.width} * image.height *
                  (image.float_channel_count + image.integer_channel_count) * 4);

    CheckedFile file(path);
    {
        Imf::OutputFile output(file, header);
        output.setFrameBuffer(planes);
        output.writePixels(static_cast<int>(image.height));
    }
    file.finish();
}

}  // namespace crt::image
