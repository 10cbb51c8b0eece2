#include "scene/textures/texture_files.h"

#include "base/log.h"
#include "base/parallel.h"
#include "spectra/sigmoid.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

namespace crt {
namespace {

constexpr std::size_t kPart = std::size_t{1} << 16;  // Texels that a thread takes at a time.

std::size_t largestOf(const std::array<float, 3>& color) {
    std::size_t channel = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (color[k] > color[channel]) channel = k;
    return channel;
}

template <class Code>
Code codeAt(const std::vector<unsigned char>& bytes, std::size_t i) {
    Code code;
    std::memcpy(&code, &bytes[i * sizeof code], sizeof code);
    return code;
}

/// Colours of 8 or 16 bits. The table of coefficients is asked once for neighbours that are equal.
template <class Code>
void encodeCodes(const Texels& texels, const std::vector<float>& linear, std::span<std::uint16_t> words) {
    const SigmoidTable& table = SigmoidTable::get();
    std::vector<SigmoidTable::Level> levels;
    for (const float value : linear) levels.push_back(SigmoidTable::level(value));
    const std::size_t channels = texels.info.channels;
    parallelFor(texels.info.count(), kPart, [&](std::size_t first, std::size_t end) {
        std::array<Code, 3> before{};
        std::array<std::uint16_t, 3> texel{};
        for (std::size_t i = first; i < end; ++i) {
            std::array<Code, 3> codes;
            for (std::size_t k = 0; k < 3; ++k)
                codes[k] = codeAt<Code>(texels.bytes, i * channels + (channels == 3 ? k : 0));
            if (i == first || codes != before) {
                const std::array<float, 3> color{linear[codes[0]], linear[codes[1]], linear[codes[2]]};
                const std::size_t channel = largestOf(color);
                texel = texelOf(table.coefficients(color, channel, levels[codes[channel]]));
                before = codes;
            }
            std::copy(texel.begin(), texel.end(), &words[3 * i]);
        }
    });
}

/// What floats may hold beyond a reflectance.
struct Odd {
    std::atomic<std::uint64_t> outside{0};
    std::atomic<std::size_t> not_finite;  ///< The first; the number of texels: none.

    explicit Odd(std::size_t texels) : not_finite(texels) {}
    void look(float value, std::size_t texel) {
        if (!std::isfinite(value)) {
            std::size_t first = not_finite.load();
            while (texel < first && !not_finite.compare_exchange_weak(first, texel)) continue;
        } else if (!(value >= -1e-6f && value <= 1.0f + 1e-6f)) {
            ++outside;
        }
    }
    void tell(const Texels& texels, const std::string& path) const {
        if (const std::size_t i = not_finite; i < texels.info.count())
            throw Error(ErrorKind::Scene,
                        fmt::format("the image '{}' has a texel that is no number, at x = {}, y = {}", path,
                                    i % texels.info.width, i / texels.info.width),
                        {path});
        if (outside > 0)
            logWarning(
                "the image '{}' has {} numbers outside [0, 1], which a reflectance or roughness cannot be; "
                "they were clamped",
                path, outside.load());
    }
};

void encodeFloats(const Texels& texels, TexelColor color, const std::string& path,
                  std::span<std::uint16_t> words) {
    const std::vector<float> rgb = linearRgb(texels, color, path);
    const SigmoidTable& table = SigmoidTable::get();
    Odd odd(texels.info.count());
    parallelFor(texels.info.count(), kPart, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) {
            const std::array<float, 3> c{rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2]};
            for (const float value : c) odd.look(value, i);
            const std::size_t channel = largestOf(c);
            const auto texel = texelOf(table.coefficients(c, channel, SigmoidTable::level(c[channel])));
            std::copy(texel.begin(), texel.end(), &words[3 * i]);
        }
    });
    odd.tell(texels, path);
}

void encodeSpectra(const Texels& texels, TexelColor color, const std::string& path,
                   std::span<std::uint16_t> words) {
    const std::vector<float> linear = linearOfCodes(texels.info.type, color);
    switch (texels.info.type) {
        case TexelType::Uint8: return encodeCodes<std::uint8_t>(texels, linear, words);
        case TexelType::Uint16: return encodeCodes<std::uint16_t>(texels, linear, words);
        case TexelType::Float: return encodeFloats(texels, color, path, words);
    }
}

void encodeNumbers(const Texels& texels, std::size_t channel, const std::string& path,
                   std::span<std::uint16_t> words) {
    const std::size_t channels = texels.info.channels, offset = channels == 3 ? channel : 0;
    Odd odd(texels.info.count());
    parallelFor(texels.info.count(), kPart, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) {
            const std::size_t at = i * channels + offset;
            if (texels.info.type == TexelType::Uint8) {
                words[i] = static_cast<std::uint16_t>(texels.bytes[at] * 257u);
            } else if (texels.info.type == TexelType::Uint16) {
                words[i] = codeAt<std::uint16_t>(texels.bytes, at);
            } else {
                const float value = codeAt<float>(texels.bytes, at);
                odd.look(value, i);
                const float bounded = value > 0 ? std::min(value, 1.0f) : 0.0f;
                words[i] = static_cast<std::uint16_t>(bounded * 65535.0f + 0.5f);
            }
        }
    });
    odd.tell(texels, path);
}

}  // namespace

std::array<std::uint16_t, 3> texelOf(const std::array<float, 3>& coefficients) {
    constexpr float kMost = 8191.0f;
    std::array<float, 3> c = coefficients;
    float largest = std::max({std::abs(c[0]), std::abs(c[1]), std::abs(c[2])});
    if (largest > kMost) {
        for (float& x : c) x *= kMost / largest;
        largest = kMost;
    }
    // The power of two above the largest, with room for rounding up; 2^-2 to 2^13. By bits: there are
    // millions of texels.
    const auto bits = std::bit_cast<std::uint32_t>(largest * (8192.0f / 8191.0f));
    const int exponent = std::clamp(static_cast<int>(bits >> 23) - 126, -2, 13);
    const auto unit = std::bit_cast<float>(static_cast<std::uint32_t>(127 + 15 - exponent) << 23);
    const auto code = [](float x, float half) {
        return std::min(static_cast<std::uint32_t>(x + (half + 0.5f)),
                        static_cast<std::uint32_t>(2 * half - 1));
    };
    const auto e = static_cast<std::uint32_t>(exponent + 2);
    return {static_cast<std::uint16_t>(code(c[0] * unit, 32768)),
            static_cast<std::uint16_t>(code(c[1] * unit * 0.25f, 8192) << 2 | (e & 3)),
            static_cast<std::uint16_t>(code(c[2] * unit * 0.25f, 8192) << 2 | e >> 2)};
}

std::shared_ptr<const TextureImage> TextureFiles::open(const std::string& path, const TexelUse& use) {
    std::error_code unknown;
    const std::string same = std::filesystem::weakly_canonical(path, unknown).string();
    auto& known = open_[{unknown ? path : same, use}];
    if (known) return known;
    const TexelsInfo info = texelsInfo(path);
    if (use.kind == TexelKind::Spectra) (void)primariesToSrgb(info, path);  // refuses those it does not know
    auto image = std::make_shared<TextureImage>();
    image->file = path;
    image->width = info.width;
    image->height = info.height;
    image->kind = use.kind;
    image->decode = [path, use, width = info.width, height = info.height](std::span<std::uint16_t> words) {
        const Texels texels = readTexels(path);
        if (texels.info.width != width || texels.info.height != height)
            throw Error(ErrorKind::Scene,
                        fmt::format("the image '{}' has changed since its header was read", path), {path});
        if (use.kind == TexelKind::Spectra)
            encodeSpectra(texels, use.color, path, words);
        else
            encodeNumbers(texels, use.channel, path, words);
    };
    return known = std::move(image);
}

}  // namespace crt
