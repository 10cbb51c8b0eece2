/// Values of a scene that depend on the place on a surface.
#pragma once

#include "base/error.h"
#include "kernel/dialect/features.h"
#include "spectra/spectra.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace crt {

/// Index into Scene::textures; −1: the value is the same everywhere.
using TextureIndex = std::int32_t;
inline constexpr TextureIndex kNoTexture = -1;

/// Encoding of the texels of an image.
enum class TexelKind {
    Spectra = CRT_TEXTURE_SPECTRA,  ///< Reflectances: three words, the coefficients of a sigmoid
                                    ///< (kernel/values/texture.h).
    Numbers = CRT_TEXTURE_NUMBERS,  ///< In [0, 1]: one word, of 65535.
    Normals = CRT_TEXTURE_NORMALS,  ///< Directions, each component in [−1, 1]: three words, 0 to 65535.
};
constexpr std::size_t wordsOf(TexelKind kind) { return kind == TexelKind::Numbers ? 1 : 3; }

/// An image file whose texels are decoded on demand. They may be gigabytes: only the compiled scene holds
/// them, into which they are decoded directly.
struct TextureImage {
    std::string file;
    std::uint32_t width = 0, height = 0;
    TexelKind kind = TexelKind::Spectra;
    /// Fills in the words of all texels, the top row first. Throws crt::Error(Scene) for a file that is
    /// damaged, or whose texels are no values. [any thread]
    std::function<void(std::span<std::uint16_t> words)> decode;

    std::size_t words() const { return std::size_t{width} * height * wordsOf(kind); }
};

enum class TextureFilter { Bilinear, Nearest };
enum class TextureWrap { Repeat, Mirror, Clamp };

/// A single value, or another texture.
struct TextureValue {
    Spectrum spectrum;
    TextureIndex texture = kNoTexture;
};

struct Texture {
    /// But for images the kinds of the kernel.
    enum class Kind {
        Image = CRT_TEXTURE_SPECTRA,
        VertexColors = CRT_TEXTURE_VERTICES,
#define CRT_PATTERN_KIND(number, NAME, Name, word, KERNELS) Name = number,
        CRT_PATTERN_LIST(CRT_PATTERN_KIND)
#undef CRT_PATTERN_KIND
    };
    Kind kind = Kind::Image;
    std::shared_ptr<const TextureImage> image;  ///< Image.
    TextureFilter filter = TextureFilter::Bilinear;
    TextureWrap wrap = TextureWrap::Repeat;
    std::array<TextureValue, 2> values;  ///< Patterns. Textures among them come before this one.
    std::vector<double> numbers;         ///< Patterns: of their keys, in the order of the schema.
    /// Images of spectra: what the texels are multiplied with, at most colours of vertices that come before.
    std::optional<TextureValue> factor;
    /// Texture coordinates → those of the image, both with v up: rows of two and an offset, (u', v') = (m0
    /// u + m1 v + m2, m3 u + m4 v + m5). The image is the unit square, as are the squares of a checker.
    std::array<double, 6> transform{1, 0, 0, 0, 1, 0};
    bool of_opacity = false;  ///< Image: of meshes whose coordinates are opacities alone (Mesh).
    SourcePlace place;
};

/// Patterns, by their keys in scene files.
inline constexpr std::pair<Texture::Kind, const char*> kPatternWords[] = {
#define CRT_PATTERN_WORD(number, NAME, Name, word, KERNELS) {Texture::Kind::Name, #word},
    CRT_PATTERN_LIST(CRT_PATTERN_WORD)
#undef CRT_PATTERN_WORD
};

}  // namespace crt
