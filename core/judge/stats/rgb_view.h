/// The colour of an image, as the metrics of looks take it.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>

namespace crt::stats {

/// Linear sRGB, three values a pixel, top row first. The caller keeps the values.
struct RgbView {
    std::span<const float> values;
    std::uint32_t width = 0, height = 0;

    bool allFinite() const {
        for (const float v : values)
            if (!std::isfinite(v)) return false;
        return true;
    }
};

/// Throws crt::Error(Internal) unless both have one size and three values a pixel.
void requireSameSize(const RgbView& a, const RgbView& b);

}  // namespace crt::stats
