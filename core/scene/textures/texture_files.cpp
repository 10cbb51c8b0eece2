#include "scene/textures/texture_files.h"

#include "base/byte_hash.h"
#include "base/frame_cache.h"
#include "base/log.h"
#include "base/parallel.h"
#include "spectra/sigmoid.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <new>
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

std::array<std::uint16_t, 3> texelOfCodes(const SigmoidTable& table, const std::vector<float>& linear,
                                          const std::vector<SigmoidTable::Level>& levels,
                                          const std::array<std::uint32_t, 3>& codes) {
    const std::array<float, 3> color{linear[codes[0]], linear[codes[1]], linear[codes[2]]};
    const std::size_t channel = largestOf(color);
    return texelOf(table.coefficients(color, channel, levels[codes[channel]]));
}

std::vector<SigmoidTable::Level> levelsOf(const std::vector<float>& linear) {
    std::vector<SigmoidTable::Level> levels;
    for (const float value : linear) levels.push_back(SigmoidTable::level(value));
    return levels;
}

/// The texels of all colours of 8 bits, each made when it is first asked for. 128 MB of address space, of
/// which what images do not touch takes no memory; neighbouring colours lie close to each other, as their
/// texels do in photographs. Shared by the images that are decoded at the same time. [any thread]
class ByteColors {
public:
    static std::shared_ptr<ByteColors> get(TexelColor color) {
        static std::mutex mutex;
        static std::array<std::weak_ptr<ByteColors>, 2> known;
        const std::scoped_lock lock(mutex);
        std::weak_ptr<ByteColors>& weak = known[color == TexelColor::Linear];
        std::shared_ptr<ByteColors> colors = weak.lock();
        if (!colors) weak = colors = std::make_shared<ByteColors>(color);
        return colors;
    }

    explicit ByteColors(TexelColor color)
        : linear_(linearOfCodes(TexelType::Uint8, color)),
          levels_(levelsOf(linear_)),
          texels_(static_cast<std::uint64_t*>(std::calloc(std::size_t{1} << 24, sizeof(std::uint64_t)))) {
        if (!texels_) throw std::bad_alloc();
        for (std::size_t i = 0; i < 256; ++i)
            for (std::size_t bit = 0; bit < 8; ++bit)
                spread_[i] |= static_cast<std::uint32_t>(i >> bit & 1) << 3 * bit;
    }

    /// Three words, the first lowest; above them a mark.
    std::uint64_t texel(std::uint8_t r, std::uint8_t g, std::uint8_t b) const {
        const std::size_t i = spread_[r] << 2 | spread_[g] << 1 | spread_[b];
        const std::atomic_ref<std::uint64_t> known(texels_.get()[i]);
        std::uint64_t texel = known.load(std::memory_order_relaxed);
        if (texel != 0) return texel;
        const std::array<std::uint16_t, 3> words = texelOfCodes(table_, linear_, levels_, {r, g, b});
        texel = words[0] | std::uint64_t{words[1]} << 16 | std::uint64_t{words[2]} << 32 |
                std::uint64_t{1} << 63;
        known.store(texel, std::memory_order_relaxed);  // Others make the same of it.
        return texel;
    }

private:
    struct Free {
        void operator()(std::uint64_t* memory) const { std::free(memory); }
    };
    const SigmoidTable& table_ = SigmoidTable::get();
    std::vector<float> linear_;
    std::vector<SigmoidTable::Level> levels_;
    std::array<std::uint32_t, 256> spread_{};
    std::unique_ptr<std::uint64_t, Free> texels_;
};

void encodeBytes(const Texels& texels, TexelColor color, std::span<std::uint16_t> words) {
    const std::shared_ptr<ByteColors> colors = ByteColors::get(color);
    const std::size_t channels = texels.info.channels;
    parallelFor(texels.info.count(), kPart, [&](std::size_t first, std::size_t end) {
        const std::size_t g = channels == 3 ? 1 : 0, b = channels == 3 ? 2 : 0;
        for (std::size_t i = first; i < end; ++i) {
            const unsigned char* const code = &texels.bytes[i * channels];
            const std::uint64_t texel = colors->texel(code[0], code[g], code[b]);
            for (std::size_t k = 0; k < 3; ++k)
                words[3 * i + k] = static_cast<std::uint16_t>(texel >> 16 * k);
        }
    });
}

void encodeShorts(const Texels& texels, TexelColor color, std::span<std::uint16_t> words) {
    const SigmoidTable& table = SigmoidTable::get();
    const std::vector<float> linear = linearOfCodes(texels.info.type, color);
    const std::vector<SigmoidTable::Level> levels = levelsOf(linear);
    const std::size_t channels = texels.info.channels;
    parallelFor(texels.info.count(), kPart, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) {
            std::array<std::uint32_t, 3> codes;
            for (std::size_t k = 0; k < 3; ++k)
                codes[k] = codeAt<std::uint16_t>(texels.bytes, i * channels + (channels == 3 ? k : 0));
            const std::array<std::uint16_t, 3> texel = texelOfCodes(table, linear, levels, codes);
            std::copy(texel.begin(), texel.end(), &words[3 * i]);
        }
    });
}

/// Codes of 8 or 16 bits times a factor for each channel.
template <class Code>
void encodeScaled(const Texels& texels, const TexelUse& use, std::span<std::uint16_t> words) {
    const SigmoidTable& table = SigmoidTable::get();
    std::array<std::vector<float>, 3> linear;
    std::array<std::vector<SigmoidTable::Level>, 3> levels;
    for (std::size_t k = 0; k < 3; ++k) {
        linear[k] = linearOfCodes(texels.info.type, use.color);
        for (float& value : linear[k]) value = static_cast<float>(value * use.factor[k]);
        levels[k] = levelsOf(linear[k]);
    }
    const std::size_t channels = texels.info.channels;
    parallelFor(texels.info.count(), kPart, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) {
            std::array<std::size_t, 3> code;
            std::array<float, 3> color;
            for (std::size_t k = 0; k < 3; ++k) {
                code[k] = codeAt<Code>(texels.bytes, i * channels + (channels == 3 ? k : 0));
                color[k] = linear[k][code[k]];
            }
            const std::size_t channel = largestOf(color);
            const auto texel = texelOf(table.coefficients(color, channel, levels[channel][code[channel]]));
            std::copy(texel.begin(), texel.end(), &words[3 * i]);
        }
    });
}

/// Values of floats beyond the range of a reflectance.
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
                        fmt::format("the image '{}' has a texel that is NaN or infinite, at x = {}, y = {}; "
                                    "replace it in the image", path,
                                    i % texels.info.width, i / texels.info.width),
                        {path});
        if (outside > 0)
            logWarning(
                "the image '{}' has {} values outside [0, 1], the range of reflectance and roughness; they "
                "were clamped",
                path, outside.load());
    }
};

void encodeFloats(const Texels& texels, const TexelUse& use, const std::string& path,
                  std::span<std::uint16_t> words) {
    std::vector<float> rgb = linearRgb(texels, use.color, path);
    if (use.hasFactor())
        for (std::size_t i = 0; i < rgb.size(); ++i) rgb[i] = static_cast<float>(rgb[i] * use.factor[i % 3]);
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

void encodeSpectra(const Texels& texels, const TexelUse& use, const std::string& path,
                   std::span<std::uint16_t> words) {
    const bool scaled = use.hasFactor();
    switch (texels.info.type) {
        case TexelType::Uint8:
            return scaled ? encodeScaled<std::uint8_t>(texels, use, words)
                          : encodeBytes(texels, use.color, words);
        case TexelType::Uint16:
            return scaled ? encodeScaled<std::uint16_t>(texels, use, words)
                          : encodeShorts(texels, use.color, words);
        case TexelType::Float: return encodeFloats(texels, use, path, words);
    }
}

/// Threshold and factor of numbers, on their words.
void change(const TexelUse& use, std::span<std::uint16_t> words) {
    if (use.cutoff < 0 && use.factor[0] == 1) return;
    parallelFor(words.size(), kPart, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) {
            double value = words[i] / 65535.0;
            if (use.cutoff >= 0) value = value >= use.cutoff ? 1 : 0;
            words[i] = static_cast<std::uint16_t>(value * use.factor[0] * 65535 + 0.5);
        }
    });
}

void encodeNumbers(const Texels& texels, std::size_t channel, const std::string& path,
                   std::span<std::uint16_t> words) {
    const std::size_t channels = texels.info.channels, offset = channels == 3 ? channel : 0;
    if (channels == 0) return std::fill(words.begin(), words.end(), std::uint16_t{65535});
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

void encodeNormals(const Texels& texels, const std::string& path, std::span<std::uint16_t> words) {
    for (std::size_t k = 0; k < 3; ++k) {
        std::vector<std::uint16_t> one(texels.info.count());
        encodeNumbers(texels, k, path, one);
        for (std::size_t i = 0; i < one.size(); ++i) words[3 * i + k] = one[i];
    }
}

/// The words of an image, the top row first.
void decode(const ImageSource& source, const TexelUse& use, std::uint32_t width, std::uint32_t height,
            std::span<std::uint16_t> words) {
    const std::string& file = source.name;
    const bool alpha = use.kind == TexelKind::Numbers && use.channel == kAlphaChannel;
    Texels texels = alpha ? readAlpha(source) : readTexels(source);
    if (texels.info.width != width || texels.info.height != height)
        throw Error(ErrorKind::Scene,
                    fmt::format("the image '{}' has changed since its header was read", file), {file});
    if (use.kind == TexelKind::Spectra && texels.info.is_associated)
        divideByAlpha(texels, readAlpha(source));
    if (use.kind == TexelKind::Spectra)
        encodeSpectra(texels, use, file, words);
    else if (use.kind == TexelKind::Normals)
        encodeNormals(texels, file, words);
    else
        encodeNumbers(texels, alpha ? 0 : use.channel, file, words);
    if (use.kind == TexelKind::Numbers) change(use, words);
}

/// The content of an image: its digest where it lies in another file, else the file and its time.
std::string contentOf(const ImageSource& source) {
    if (source.bytes) {
        ByteHash hash;
        hash.add(source.bytes->data(), source.bytes->size());
        return hash.digits128();
    }
    std::error_code unknown;
    return fmt::format("{} {} {}", source.name, std::filesystem::file_size(source.name, unknown),
                       std::filesystem::last_write_time(source.name, unknown).time_since_epoch().count());
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

std::shared_ptr<const TextureImage> numberRamp(double most) {
    auto image = std::make_shared<TextureImage>();
    image->file = "opacity of vertices";
    image->width = 2;
    image->height = 1;
    image->kind = TexelKind::Numbers;
    image->decode = [most](std::span<std::uint16_t> words) {
        words[0] = 0;
        words[1] = static_cast<std::uint16_t>(most * 65535 + 0.5);
    };
    return image;
}

std::shared_ptr<const TextureImage> TextureFiles::open(const std::string& path, const TexelUse& use) {
    std::error_code unknown;
    const std::string same = std::filesystem::weakly_canonical(path, unknown).string();
    auto& known = open_[{unknown ? path : same, use}];
    if (!known) known = make({path}, use);
    return known;
}

std::shared_ptr<const TextureImage> TextureFiles::open(const ImageSource& source, const TexelUse& use) {
    if (!source.bytes) return open(source.name, use);
    auto& known = open_[{source.name, use}];
    if (!known) known = make(source, use);
    return known;
}

std::shared_ptr<const TextureImage> TextureFiles::make(const ImageSource& source, const TexelUse& use) {
    const std::string& path = source.name;
    const TexelsInfo info = texelsInfo(source);
    const PixelUse pixels = use.kind != TexelKind::Spectra    ? PixelUse::Numbers
                            : use.color == TexelColor::Linear ? PixelUse::LinearColors
                                                              : PixelUse::EncodedColors;
    for (const std::string& sentence : sentencesOf(info.tags, path, pixels))
        if (told_.insert(sentence).second) logWarning("{}", sentence);
    if (use.kind == TexelKind::Spectra) (void)primariesToSrgb(info, path);  // refuses those it does not know
    if (use.kind == TexelKind::Normals && info.channels != 3)
        throw Error(ErrorKind::Scene,
                    fmt::format("the image '{}' is grey: a normal map stores the components of normals as "
                                "red, green and blue",
                                path),
                    {path});
    auto image = std::make_shared<TextureImage>();
    image->file = path;
    image->width = info.width;
    image->height = info.height;
    image->kind = use.kind;
    image->decode = [source, use, width = info.width, height = info.height](std::span<std::uint16_t> words) {
        if (!KeptFrames::wanted()) return decode(source, use, width, height, words);
        static FrameCache<std::pair<std::string, TexelUse>, std::vector<std::uint16_t>> kept;
        const auto made = kept.of([&] { return std::pair(contentOf(source), use); },
                                  [&] {
                                      std::vector<std::uint16_t> all(words.size());
                                      decode(source, use, width, height, all);
                                      return all;
                                  });
        std::copy(made->begin(), made->end(), words.begin());
    };
    return image;
}

}  // namespace crt
