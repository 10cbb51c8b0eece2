#include "judge/compare/perceived_difference.h"

#include "base/error.h"
#include "image/image_io.h"
#include "judge/stats/color_difference.h"
#include "judge/stats/flip.h"

#include <algorithm>
#include <array>

namespace crt {

std::optional<std::vector<float>> linearSrgb(const Image& image,
                                             const std::optional<std::array<double, 8>>& primaries) {
    std::array<std::size_t, 3> places{};
    for (std::size_t c = 0; c < 3; ++c) {
        const auto found =
            std::find(image.channels.begin(), image.channels.end(), std::array{"R", "G", "B"}[c]);
        if (found == image.channels.end()) return std::nullopt;
        places[c] = static_cast<std::size_t>(found - image.channels.begin());
    }
    std::optional<Matrix3d> matrix;
    try {
        Image space;
        space.chromaticities = primaries;
        matrix = toLinearSrgb(space);
    } catch (const Error&) {
        return std::nullopt;  // Primaries without colours: there are differences to measure, but none to
                              // see.
    }
    std::vector<float> values;
    values.reserve(std::size_t{3} * image.width * image.height);
    for (std::size_t p = 0; p < std::size_t{image.width} * image.height; ++p) {
        const float* pixel = &image.pixels[p * image.channels.size()];
        Vec3d rgb{pixel[places[0]], pixel[places[1]], pixel[places[2]]};
        if (matrix) rgb = multiply(*matrix, rgb);
        for (const double v : rgb) values.push_back(static_cast<float>(v));
    }
    return values;
}

PerceivedDifference perceivedDifference(std::span<const float> test, std::span<const float> reference,
                                        std::uint32_t width, std::uint32_t height, bool display_referred) {
    const stats::RgbView a{test, width, height}, b{reference, width, height};
    const stats::ColorDifference color = stats::deltaE2000(a, b);
    const double flip = display_referred ? stats::flipLdr(a, b).mean : stats::flipHdr(a, b).mean;
    return {flip, !display_referred, color.mean, color.max};
}

}  // namespace crt
