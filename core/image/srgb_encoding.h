/// Images as screens show them: 8 bits of sRGB, and what that loses.
#pragma once

#include "image/image.h"
#include "spectra/spectra.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace crt {

/// Where R, G and B lie among the float channels: by name, because files and libraries reorder them.
std::array<std::size_t, 3> colorChannels(const Image& image);

/// From the image's colour space to linear sRGB; empty when it is sRGB already, which an image without
/// chromaticities is taken for. Throws crt::Error(Output) for primaries that span no colours.
std::optional<Matrix3d> toLinearSrgb(const Image& image);

/// 8-bit sRGB of an image, row-major, top row first, three bytes a pixel; what PNG and PPM hold.
struct EncodedImage {
    std::vector<std::uint8_t> rgb;
    std::uint64_t clipped_values = 0;  ///< Of 3·width·height: those outside [0,1], NaN among them (as 0).
};
EncodedImage encodeSrgb8(const Image& image);

/// Warns of a picture that is black, or far too bright, in 8 bits, and says by how many stops; else says how
/// many values were clipped.
void tellWhatIsLost(const std::string& path, const Image& image, const EncodedImage& encoded);

}  // namespace crt
