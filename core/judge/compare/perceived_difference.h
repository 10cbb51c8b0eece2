/// The perceived difference of two images: FLIP and CIEDE2000 of their appearance on a screen.
#pragma once

#include "film/film.h"

#include <array>
#include <optional>
#include <span>
#include <vector>

namespace crt {

struct PerceivedDifference {
    double flip_mean = 0;  ///< Andersson et al. 2020 and 2021, in [0, 1]. NaN against black where exposures
                           ///< are chosen by the reference.
    bool high_range = false;  ///< HDR-FLIP, over all exposures that the reference asks for; else LDR-FLIP.
    double delta_e_mean = 0, delta_e_max = 0;  ///< CIEDE2000, 1 being white.
};

/// R, G and B of every pixel, which belong to `primaries` (none: sRGB's), in linear sRGB; nothing when they
/// are missing or the primaries span no colours.
std::optional<std::vector<float>> linearSrgb(const Image& image,
                                             const std::optional<std::array<double, 8>>& primaries);

/// Values as linearSrgb gives them, all finite. `display_referred`: both are as a screen shows them, as PNG
/// files are; else they are radiances.
PerceivedDifference perceivedDifference(std::span<const float> test, std::span<const float> reference,
                                        std::uint32_t width, std::uint32_t height, bool display_referred);

}  // namespace crt
