/// Image files as values of a scene: textures, and light that comes from far away. Bounded, by content, and
/// as the file holds them: a texture of 8 bits stays 8 bits until it becomes something else.
#pragma once

#include "image/unapplied_tags.h"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace crt {

/// 16384 x 16384.
inline constexpr std::uint64_t kMostTexels = std::uint64_t{1} << 28;

enum class TexelType { Uint8, Uint16, Float };

struct TexelsInfo {
    std::uint32_t width = 0, height = 0;
    std::uint32_t channels = 0;  ///< 1: grey, or alpha; 3: red, green, blue; 0: there is no alpha.
    TexelType type = TexelType::Uint8;
    std::optional<std::array<double, 8>> chromaticities;  ///< Of floats, where the file says them.
    bool is_associated = false;  ///< Colours are multiplied by the alpha beside them, as EXR has it.
    CrtUnappliedTags tags{};

    std::uint64_t count() const { return std::uint64_t{width} * height; }
    std::uint64_t bytes() const;
};

/// Row-major, the top row first: [height][width][channels].
struct Texels {
    TexelsInfo info;
    std::vector<unsigned char> bytes;
};

/// The header of a PNG, JPEG, TGA, EXR, Radiance HDR or PFM. Throws crt::Error(Scene), "cannot read the
/// image 'x.png': …", for a file that is missing, of another format, larger than kMostTexels, whose pixels
/// cannot lie in a file of its size, or take more than half of the memory that is free.
TexelsInfo texelsInfo(const std::string& path);

/// The pixels too. Throws crt::Error(Scene) also for one that is truncated or damaged.
Texels readTexels(const std::string& path);

/// The alpha of an image's pixels; one that has none has no channels and no bytes. Throws as readTexels().
Texels readAlpha(const std::string& path);

/// Divides colours, which are floats, by the alpha of the same pixels. Those of alpha 0 stay: they are light
/// without a surface.
void divideByAlpha(Texels& colors, const Texels& alpha);

/// An image in a separate file, or as bytes in a file of another kind.
struct ImageSource {
    std::string name;                            ///< For messages: the path, or "a.glb (image 2)".
    std::shared_ptr<const std::string> bytes{};  ///< Null: `name` is the path of a file.
};
TexelsInfo texelsInfo(const ImageSource& source);
Texels readTexels(const ImageSource& source);
Texels readAlpha(const ImageSource& source);

/// Encoding of the numbers of a file.
enum class TexelColor {
    Auto,    ///< sRGB for 8 and 16 bits, linear for floats.
    Srgb,    ///< Encoded by IEC 61966-2-1.
    Linear,  ///< Proportional to light; integers are fractions of their largest.
};

/// Linear sRGB of every texel, three floats each; grey ones repeated, colours of other primaries converted.
/// Codes of 8 and 16 bits are in [0, 1]; floats are what the file holds, also NaN. Throws crt::Error(Scene)
/// for primaries that span no colours.
std::vector<float> linearRgb(const Texels& texels, TexelColor color, const std::string& path);

/// The linear value of each code of 8 bits (256) or 16 (65536); empty for floats.
std::vector<float> linearOfCodes(TexelType type, TexelColor color);

/// From the file's primaries to linear sRGB; nothing where it is that already. Throws as linearRgb().
std::optional<std::array<std::array<double, 3>, 3>> primariesToSrgb(const TexelsInfo& info,
                                                                    const std::string& path);

}  // namespace crt
