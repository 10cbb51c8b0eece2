// FLIP against the authors' own program: flip-evaluator 1.7 (PyPI), flip.evaluate(reference, test, …,
// applyMagma=False), linear inputs, whose map was averaged in doubles. It computes in floats: where an error
// comes from nearly equal values, powers of 0.7 and 0.5 lift roundings of 1e-7 to some 1e-4 of one pixel,
// and 1e-6 of a mean.
#include "judge/stats/flip.h"

#include "base/error.h"
#include "catch.h"

#include <algorithm>
#include <cmath>
#include <limits>

using namespace crt::stats;

namespace {

constexpr std::uint32_t kWidth = 96, kHeight = 64;

double fraction(double v) { return v - std::floor(v); }

/// Ramps, waves, and a disc of checkers: edges, points, colours, smooth ground.
std::vector<float> picture() {
    std::vector<float> rgb;
    for (std::uint32_t y = 0; y < kHeight; ++y)
        for (std::uint32_t x = 0; x < kWidth; ++x) {
            const double u = (x + 0.5) / kWidth, v = (y + 0.5) / kHeight;
            const double checker = (x / 8 + y / 8) % 2;
            const bool disc = (u - 0.6) * (u - 0.6) + (v - 0.4) * (v - 0.4) < 0.04;
            rgb.push_back(static_cast<float>(disc ? 0.9 * checker
                                                  : 0.2 + 0.6 * (0.5 + 0.5 * std::sin(9 * u + 2 * v))));
            rgb.push_back(static_cast<float>(disc ? 0.1 + 0.5 * checker
                                                  : 0.1 + 0.7 * (0.5 + 0.5 * std::sin(5 * u * v * 7 + 1))));
            rgb.push_back(static_cast<float>(disc ? 0.3 : 0.8 * u * v));
        }
    return rgb;
}

/// The same with noise that grows to the right.
std::vector<float> noisyPicture() {
    std::vector<float> rgb = picture();
    for (std::uint32_t y = 0; y < kHeight; ++y)
        for (std::uint32_t x = 0; x < kWidth; ++x)
            for (std::uint32_t c = 0; c < 3; ++c) {
                const double noise = fraction(std::sin(x * 12.9898 + y * 78.233 + c * 37.719) * 43758.5453);
                float& value = rgb[(std::size_t{y} * kWidth + x) * 3 + c];
                value = static_cast<float>(
                    std::clamp(value + 0.25 * (noise - 0.5) * (x + 0.5) / kWidth, 0.0, 1.0));
            }
    return rgb;
}

/// Times 20^−1.5 at the left to 20^1.5 at the right.
std::vector<float> highRange(std::vector<float> rgb) {
    for (std::size_t i = 0; i < rgb.size(); ++i)
        rgb[i] *= static_cast<float>(std::pow(20, 3 * ((i / 3 % kWidth) + 0.5) / kWidth - 1.5));
    return rgb;
}

RgbView view(const std::vector<float>& rgb) { return {rgb, kWidth, kHeight}; }
float largest(const FlipResult& r) { return *std::max_element(r.error.begin(), r.error.end()); }

}  // namespace

TEST_CASE("LDR-FLIP is that of its authors", "[flip]") {
    const std::vector<float> reference = picture(), test = noisyPicture();
    const FlipResult r = flipLdr(view(test), view(reference));
    CHECK(r.mean == Approx(0.07754641904307391).margin(2e-6));
    CHECK(largest(r) == Approx(0.30574477).margin(1e-4));
    CHECK(flipLdr(view(test), view(reference), 30).mean == Approx(0.15271128726813762).margin(2e-6));
    // Black against white: no feature, one number. Theirs is 8.6e-6 higher, because its feature taps add up
    // to some 1e-7 instead of 0, and the exponent 0.5 makes that 3e-4: 0.96738^(1 − 2.7e-4).
    const std::vector<float> black(reference.size(), 0.0f), white(reference.size(), 1.0f);
    CHECK(flipLdr(view(white), view(black)).mean == Approx(0.9673883318901062).margin(2e-5));
}

TEST_CASE("HDR-FLIP is that of its authors, and so is its range of exposures", "[flip]") {
    const std::vector<float> reference = highRange(picture()), test = highRange(noisyPicture());
    const FlipResult r = flipHdr(view(test), view(reference));
    CHECK(r.start_exposure == Approx(-4.814606666564941).margin(1e-5));
    CHECK(r.stop_exposure == Approx(2.7734339237213135).margin(1e-5));
    CHECK(r.exposures == 8);
    CHECK(r.mean == Approx(0.130635169818774).margin(2e-6));
    CHECK(largest(r) == Approx(0.87448394).margin(1e-4));

    std::vector<float> dark = reference;  // Five rows of eight are black: the median is too.
    std::fill_n(dark.begin(), 40 * kWidth * 3, 0.0f);
    const FlipResult d = flipHdr(view(test), view(dark));
    CHECK(d.exposures == 29);
    CHECK(d.stop_exposure == Approx(24.083297729492188).margin(1e-5));
    CHECK(d.mean == Approx(0.6848505338283152).margin(2e-6));
}

TEST_CASE("FLIP of an image and itself is 0, and of NaN is NaN", "[flip]") {
    std::vector<float> image = highRange(picture());
    CHECK(flipLdr(view(image), view(image)).mean == 0.0);
    CHECK(flipHdr(view(image), view(image)).mean == 0.0);
    std::vector<float> broken = image;
    broken[17] = std::numeric_limits<float>::quiet_NaN();
    CHECK(std::isnan(flipLdr(view(broken), view(image)).mean));
    CHECK(std::isnan(flipHdr(view(image), view(broken)).mean));
    const std::vector<float> black(image.size(), 0.0f);
    CHECK(std::isnan(flipHdr(view(image), view(black)).mean));
    CHECK_THROWS_AS(flipLdr({image, kWidth, kHeight - 1}, view(image)), crt::Error);
}
