/// Radiance HDR pictures, within bounds: both encodings (RGBE and XYZE), all eight orders of pixels, and
/// flat rows beside both kinds of run lengths. Part of the image module (image_module.h). Not by
/// OpenImageIO: it ignores the order of pixels and refuses half of these files.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace crt::image {

/// The contents of the header.
struct RadianceHeader {
    std::uint32_t width = 0, height = 0;
    /// {Rx, Ry, Gx, Gy, Bx, By, Wx, Wy} of its PRIMARIES, or those of CIE XYZ.
    std::optional<std::array<float, 8>> chromaticities;
    double exposure = 1;                              ///< By which the pixels have been multiplied.
    std::array<double, 3> color_correction{1, 1, 1};  ///< By which red, green and blue have been.
};

bool beginsAsRadiance(const char* path);

/// Fills in *header, and with a buffer of `count` floats the pixels, too: row-major, the top row first,
/// three floats each. Returns why not; empty when all is well. A file that ends early, or whose runs do not
/// fit, is refused.
std::string readRadiance(const char* path, RadianceHeader* header, float* pixels, std::uint64_t count);

}  // namespace crt::image
