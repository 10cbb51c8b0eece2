// The one definition of an image's error: luminance, relative to mean luminance.
#include "catch.h"
#include "film/luminance_error.h"

#include <cmath>
#include <random>
#include <vector>

using namespace crt;
using namespace crt::stats;

TEST_CASE("luminance weights are row Y of RGB to XYZ", "[luminance]") {
    // Rec. 709 as the standard prints it, to the digits that the white's chromaticity settles.
    const Rgb srgb = luminanceWeights(ColorSpace::LinearSrgb);
    CHECK(srgb[0] == Approx(0.2126).margin(1e-4));
    CHECK(srgb[1] == Approx(0.7152).margin(1e-4));
    CHECK(srgb[2] == Approx(0.0722).margin(1e-4));
    CHECK(srgb[0] + srgb[1] + srgb[2] == Approx(1).margin(1e-12));
    CHECK(luminanceWeights(ColorSpace::Xyz) == Rgb{0, 1, 0});
    for (const ColorSpace space : {ColorSpace::LinearSrgb, ColorSpace::AcesCg, ColorSpace::Xyz}) {
        // Y of any colour comes back from the space's three values.
        const Rgb weights = luminanceWeights(space);
        const Matrix3d m = xyzToRgb(space);
        const Vec3d xyz{0.3, 0.7, 0.2};
        Rgb rgb{};
        for (std::size_t c = 0; c < 3; ++c) rgb[c] = m[c][0] * xyz[0] + m[c][1] * xyz[1] + m[c][2] * xyz[2];
        CHECK(luminance(rgb, weights) == Approx(0.7).epsilon(1e-12));
    }
    const std::array<double, 8> rec709{0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329};
    const Rgb by_primaries = luminanceWeights(rec709);
    for (std::size_t c = 0; c < 3; ++c) CHECK(by_primaries[c] == Approx(srgb[c]).margin(1e-4));
}

TEST_CASE("an error is of luminance, relative to mean luminance, whatever the colour", "[luminance]") {
    // A blue image: mean (R + G + B)/3 would be 4.6 times its luminance.
    const Rgb weights = luminanceWeights(ColorSpace::LinearSrgb);
    const std::vector<float> blue{0, 0, 1, 0, 0, 3}, off{0, 0, 2, 0, 0, 2};
    const LuminanceError error = luminanceError(luminances(off, weights), luminances(blue, weights));
    CHECK(error.relative_rmse == Approx(0.5).epsilon(1e-6));
    CHECK(error.relative_bias == Approx(0).margin(1e-6));
    CHECK(error.reference_mean == Approx(2 * weights[2]).epsilon(1e-6));
    CHECK(error.mse == Approx(weights[2] * weights[2]).epsilon(1e-6));
}

TEST_CASE("errors relative to what is negative, black or below the noise subtracted", "[luminance]") {
    CHECK(relativeBias(-2.2, -2) == Approx(-0.1));
    CHECK(relativeBias(0, 0) == 0);
    CHECK(std::isinf(relativeBias(1, 0)));
    CHECK(relativeRmse(4, -2) == 1);
    CHECK(relativeRmse(-1e-9, 2) == 0);
    CHECK(relativeRmse(0, 0) == 0);
    CHECK(std::isnan(relativeRmse(std::nan(""), 2)));
    CHECK(channelScale(-3, 1) == 3);
    CHECK(channelScale(0, 1) == 1);
    CHECK(std::isnan(meanLuminance({})));
}

TEST_CASE("effective pixels tell equal variances from unequal ones", "[luminance]") {
    CHECK(effectivePixels(std::vector<double>(100, 0.0), 7) == 100);
    CHECK(effectivePixels(std::vector<double>{1, 0, 0, 0}, 1e9) == Approx(1));
    // 4000 estimates of 7 degrees of freedom: σ² = 1 everywhere; then 16 in one pixel of eight and 1 in
    // the rest, which makes (23/8)² / (263/8) of them.
    std::mt19937_64 engine(5);
    std::chi_squared_distribution<double> chi(7);
    std::vector<double> equal(4000), unequal(4000);
    for (double& v : equal) v = chi(engine) / 7;
    for (std::size_t i = 0; i < unequal.size(); ++i) unequal[i] = (i % 8 == 0 ? 16 : 1) * chi(engine) / 7;
    CHECK(effectivePixels(equal, 7) == Approx(4000).epsilon(0.05));
    CHECK(effectivePixels(unequal, 7) == Approx(4000 * 529.0 / 8 / 263).epsilon(0.12));
}
