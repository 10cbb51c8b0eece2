/// Image files as textures: opened once for each use, and decoded into spectra or numbers.
#pragma once

#include "image/texels.h"
#include "scene/texture.h"

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <tuple>

namespace crt {

/// Options for reading the texels of a file.
struct TexelUse {
    TexelKind kind = TexelKind::Spectra;
    TexelColor color = TexelColor::Auto;    ///< Spectra. Numbers are taken as they are.
    std::size_t channel = 0;                ///< Numbers: which of red, green, blue and alpha.
    std::array<double, 3> factor{1, 1, 1};  ///< In [0, 1], on linear colours; of numbers the first.
    double cutoff = -1;  ///< Numbers: 0 below it, 1 from it on, before the factor; below 0: as they are.

    auto operator<=>(const TexelUse&) const = default;

    bool hasFactor() const { return factor != std::array<double, 3>{1, 1, 1}; }
};

inline constexpr std::size_t kAlphaChannel = 3;

/// The images of a scene. The same file, used in the same way, is one image.
class TextureFiles {
public:
    /// Reads the header. Throws crt::Error(Scene) as texelsInfo() does.
    std::shared_ptr<const TextureImage> open(const std::string& path, const TexelUse& use);
    /// The same of an image that may lie in a file of another kind. Of one name there is one image.
    std::shared_ptr<const TextureImage> open(const ImageSource& source, const TexelUse& use);

private:
    std::shared_ptr<const TextureImage> make(const ImageSource& source, const TexelUse& use);

    std::map<std::pair<std::string, TexelUse>, std::shared_ptr<const TextureImage>> open_;
    std::set<std::string> told_;  ///< Warnings of what files say and crt does not apply: each once.
};

/// Numbers from 0 (u = 1/4) to `most` (u = 3/4), in two texels.
std::shared_ptr<const TextureImage> numberRamp(double most);

/// The three words of a texel that has this reflectance: its sigmoid's coefficients with an error of
/// 2⁻¹⁵ to 2⁻¹³ of the power of two above the largest. Beyond ±8191, where the sigmoid is 0 or 1,
/// all are scaled down.
std::array<std::uint16_t, 3> texelOf(const std::array<float, 3>& coefficients);

}  // namespace crt
