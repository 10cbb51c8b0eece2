/// The samples of each pixel that a backend's film holds.
#pragma once

#include "base/error.h"
#include "film/film.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace crt {

using Rectangle = std::array<std::uint32_t, 4>;

inline std::uint64_t areaOf(const Rectangle& r) { return std::uint64_t{r[2] - r[0]} * (r[3] - r[1]); }

inline bool overlap(const Rectangle& a, const Rectangle& b) {
    return a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
}

/// The samples that the backend's film holds. A film records ranges of samples that every pixel has; ranges
/// rendered rectangle by rectangle are held back here until their rectangles cover the window.
class Coverage {
public:
    Coverage() = default;
    Coverage(std::uint32_t width, std::uint32_t height) : window_area_(std::uint64_t{width} * height) {}

    /// Throws crt::Error(Usage) when a pixel would get a sample twice.
    void add(SampleRange samples, const Rectangle& rectangle) {
        if (areaOf(rectangle) == window_area_) {
            for (const Part& part : parts_) {
                if (part.samples.first < samples.second && samples.first < part.samples.second)
                    twice(samples);
            }
            whole_.add(samples);
            return;
        }
        // Refuses samples that are already there for all pixels.
        SampleRanges(whole_).add(samples);
        const auto same = std::find_if(parts_.begin(), parts_.end(),
                                       [&](const Part& part) { return part.samples == samples; });
        for (const Part& part : parts_) {
            if (part.samples.first >= samples.second || samples.first >= part.samples.second) continue;
            for (const Rectangle& other : part.rectangles) {
                if (overlap(other, rectangle)) twice(samples);
            }
        }
        Part& part = same != parts_.end() ? *same : parts_.emplace_back(Part{samples, {}, 0});
        part.rectangles.push_back(rectangle);
        part.area += areaOf(rectangle);
        if (part.area == window_area_) {
            // The rectangles do not overlap, so their areas tell.
            whole_.add(samples);
            parts_.erase(parts_.begin() + (&part - parts_.data()));
        }
    }

    bool isWhole() const { return parts_.empty(); }
    const SampleRanges& ranges() const { return whole_; }

private:
    struct Part {
        SampleRange samples;
        std::vector<Rectangle> rectangles;
        std::uint64_t area;
    };

    [[noreturn]] static void twice(SampleRange samples) {
        throw Error(ErrorKind::Usage, fmt::format("samples {}-{} would be rendered twice in some pixels",
                                                  samples.first, samples.second));
    }

    std::uint64_t window_area_ = 0;
    SampleRanges whole_;
    std::vector<Part> parts_;
};

}  // namespace crt
