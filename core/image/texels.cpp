#include "image/texels.h"

#include "base/error.h"
#include "base/host.h"
#include "base/input_file.h"
#include "image/image_io.h"
#include "image/memory_bound.h"
#include "image/open_module.h"
#include "spectra/spectra.h"
#include "system/huge_pages.h"

#include <fmt/format.h>

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <utility>

namespace crt {
namespace {

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
    throw Error(ErrorKind::Scene, fmt::format("cannot read the image '{}': {}", path, why), {path});
}

std::uint64_t bytesOf(TexelType type) {
    return type == TexelType::Uint8 ? 1 : type == TexelType::Uint16 ? 2 : 4;
}

void requireFile(const std::string& path) {
    try {
        requireInput(path);
    } catch (const InputRefused& refused) {
        refuse(path, fmt::format("it {}", refused.what()));
    }
}

/// Formats that crt reads itself.
bool isPfm(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    char mark[2] = {};
    file.read(mark, 2);
    return file && mark[0] == 'P' && (mark[1] == 'F' || mark[1] == 'f');
}

void requireSize(const std::string& path, std::uint64_t width, std::uint64_t height) {
    if (width * height > kMostTexels)
        refuse(path, fmt::format("it has {} x {} pixels; images in scenes have at most {} million", width,
                                 height, kMostTexels >> 20));
}

Texels readPfm(const std::string& path) {
    Image image;
    try {
        image = readImage(path);
    } catch (const Error& e) {
        throw Error(ErrorKind::Scene, e.what(), {path});
    }
    requireSize(path, image.width, image.height);
    Texels texels;
    texels.info = {image.width, image.height, 3, TexelType::Float, image.chromaticities, false, {}};
    texels.bytes.resize(image.pixels.size() * sizeof(float));
    std::memcpy(texels.bytes.data(), image.pixels.data(), texels.bytes.size());
    return texels;
}

TexelsInfo infoOf(const CrtTexelsInfo& raw) {
    TexelsInfo info;
    info.width = raw.width;
    info.height = raw.height;
    info.channels = raw.channels;
    info.type = raw.type == CRT_TEXELS_UINT8    ? TexelType::Uint8
                : raw.type == CRT_TEXELS_UINT16 ? TexelType::Uint16
                                                : TexelType::Float;
    if (raw.has_chromaticities != 0) {
        info.chromaticities.emplace();
        std::copy_n(raw.chromaticities, 8, info.chromaticities->begin());
    }
    info.is_associated = raw.is_associated != 0;
    info.tags = raw.tags;
    return info;
}

enum class Part { Color, Alpha };

/// Header, and pixels where there is a buffer.
TexelsInfo readWithModule(const std::string& path, Part part, void* buffer, std::uint64_t bytes) {
    const CrtImageModule& module = imageModule(moduleFormatOf(path), path, ErrorKind::Scene);
    CrtTexelsInfo raw{};
    std::array<char, 512> reason{};
    const auto read = part == Part::Color ? module.read_texels : module.read_alpha;
    if (read(path.c_str(), &raw, buffer, bytes, reason.data(), reason.size()) != 0)
        refuse(path, reason.data());
    requireSize(path, raw.width, raw.height);
    return infoOf(raw);
}

Texels readPart(const std::string& path, Part part) {
    Texels texels;
    texels.info = readWithModule(path, part, nullptr, 0);
    if (texels.info.channels == 0) return texels;
    // Half: what is made of the pixels takes as much again.
    if (const std::string why =
            refusalForMemory(texels.info.width, texels.info.height,
                             texels.info.channels * bytesOf(texels.info.type), availableHostMemory() / 2);
        !why.empty())
        refuse(path, why);
    texels.bytes.reserve(texels.info.bytes());
    adviseHugePages(texels.bytes.data(), texels.bytes.capacity());
    texels.bytes.resize(texels.info.bytes());
    readWithModule(path, part, texels.bytes.data(), texels.bytes.size());
    return texels;
}

/// Bytes under a path, for libraries that open a file by its name. Nothing is written to a disk.
class MemoryFile {
public:
    explicit MemoryFile(const ImageSource& source) : descriptor_(::memfd_create("crt image", MFD_CLOEXEC)) {
        bool good = descriptor_ >= 0;
        for (std::size_t at = 0; good && at < source.bytes->size();) {
            const ssize_t written =
                ::write(descriptor_, source.bytes->data() + at, source.bytes->size() - at);
            if (written > 0) at += static_cast<std::size_t>(written);
            good = written > 0 || (written < 0 && errno == EINTR);
        }
        if (good) return;
        const int why = errno;
        if (descriptor_ >= 0) ::close(descriptor_);
        refuse(source.name, fmt::format("there is not enough memory for it: {}", std::strerror(why)));
    }
    ~MemoryFile() { ::close(descriptor_); }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;
    std::string path() const { return fmt::format("/proc/self/fd/{}", descriptor_); }

private:
    int descriptor_;
};

/// The result of `read` for the image's path. Messages name the image.
template <class Read>
auto readSource(const ImageSource& source, const Read& read) {
    if (!source.bytes) return read(source.name);
    const MemoryFile file(source);
    const std::string path = file.path();
    try {
        return read(path);
    } catch (const Error& e) {
        std::string sentence = e.what();
        for (std::size_t at = 0; (at = sentence.find(path, at)) != std::string::npos;
             at += source.name.size())
            sentence.replace(at, path.size(), source.name);
        throw Error(e.kind(), sentence, {source.name});
    }
}

template <class Code>
void decode(const Texels& texels, const std::vector<float>& linear, std::vector<float>& rgb) {
    const std::size_t channels = texels.info.channels;
    for (std::size_t i = 0; i < texels.info.count(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            Code code;
            std::memcpy(&code, &texels.bytes[(i * channels + (channels == 3 ? k : 0)) * sizeof code],
                        sizeof code);
            if constexpr (std::is_same_v<Code, float>)
                rgb[3 * i + k] = linear.empty() ? code : static_cast<float>(srgbToLinear(double{code}));
            else
                rgb[3 * i + k] = linear[code];
        }
}

}  // namespace

std::uint64_t TexelsInfo::bytes() const { return count() * channels * bytesOf(type); }

TexelsInfo texelsInfo(const std::string& path) {
    requireFile(path);
    if (isPfm(path)) return readPfm(path).info;
    return readWithModule(path, Part::Color, nullptr, 0);
}

Texels readTexels(const std::string& path) {
    requireFile(path);
    if (isPfm(path)) return readPfm(path);
    return readPart(path, Part::Color);
}

Texels readAlpha(const std::string& path) {
    requireFile(path);
    if (!isPfm(path)) return readPart(path, Part::Alpha);
    Texels texels;
    texels.info = texelsInfo(path);
    texels.info.channels = 0;
    return texels;
}

void divideByAlpha(Texels& colors, const Texels& alpha) {
    // A quotient that is 1 but for the rounding of two halves is 1.
    constexpr float kRounding = 1.0f / 1024;
    const std::size_t channels = colors.info.channels;
    for (std::size_t i = 0; i < colors.info.count() && alpha.info.channels != 0; ++i) {
        float a;
        std::memcpy(&a, &alpha.bytes[i * sizeof a], sizeof a);
        if (!(a > 0) || a == 1) continue;
        for (std::size_t c = 0; c < channels; ++c) {
            unsigned char* const at = &colors.bytes[(i * channels + c) * sizeof(float)];
            float color;
            std::memcpy(&color, at, sizeof color);
            color /= a;
            if (color > 1 && color < 1 + kRounding) color = 1;
            std::memcpy(at, &color, sizeof color);
        }
    }
}

TexelsInfo texelsInfo(const ImageSource& source) {
    return readSource(source, [](const std::string& path) { return texelsInfo(path); });
}
Texels readTexels(const ImageSource& source) {
    return readSource(source, [](const std::string& path) { return readTexels(path); });
}
Texels readAlpha(const ImageSource& source) {
    return readSource(source, [](const std::string& path) { return readAlpha(path); });
}

std::vector<float> linearOfCodes(TexelType type, TexelColor color) {
    if (type == TexelType::Float) return {};
    std::vector<float> linear(type == TexelType::Uint8 ? 256 : 65536);
    const double largest = static_cast<double>(linear.size() - 1);
    for (std::size_t code = 0; code < linear.size(); ++code) {
        const double value = static_cast<double>(code) / largest;
        linear[code] = static_cast<float>(color == TexelColor::Linear ? value : srgbToLinear(value));
    }
    return linear;
}

std::optional<Matrix3d> primariesToSrgb(const TexelsInfo& info, const std::string& path) {
    if (!info.chromaticities) return std::nullopt;
    Image of;
    of.chromaticities = info.chromaticities;
    try {
        return toLinearSrgb(of);
    } catch (const Error&) {
        refuse(path, "its primaries span no colours");
    }
}

std::vector<float> linearRgb(const Texels& texels, TexelColor color, const std::string& path) {
    std::vector<float> rgb(texels.info.count() * 3);
    switch (texels.info.type) {
        case TexelType::Uint8:
            decode<std::uint8_t>(texels, linearOfCodes(texels.info.type, color), rgb);
            break;
        case TexelType::Uint16:
            decode<std::uint16_t>(texels, linearOfCodes(texels.info.type, color), rgb);
            break;
        case TexelType::Float:
            if (texels.info.channels == 3 && color != TexelColor::Srgb)
                std::memcpy(rgb.data(), texels.bytes.data(), rgb.size() * sizeof(float));
            else  // A table that is not empty says that the floats are encoded.
                decode<float>(texels, std::vector<float>(color == TexelColor::Srgb ? 1 : 0), rgb);
            break;
    }
    if (const std::optional<Matrix3d> to_srgb = primariesToSrgb(texels.info, path))
        for (std::size_t i = 0; i < rgb.size(); i += 3) {
            const Vec3d converted = multiply(*to_srgb, Vec3d{rgb[i], rgb[i + 1], rgb[i + 2]});
            for (std::size_t k = 0; k < 3; ++k) rgb[i + k] = static_cast<float>(converted[k]);
        }
    return rgb;
}

}  // namespace crt
