// Error metrics by hand and by their invariances, and CIEDE2000 against its published pairs.
#include "judge/stats/color_difference.h"
#include "judge/stats/metrics.h"

#include "base/error.h"
#include "catch.h"

#include <cmath>
#include <limits>
#include <vector>

using namespace crt::stats;

namespace {

const std::vector<float> kReference{1, 2, 3, 0, 4, 2},
    kTest{1, 2, 3, 0.5f, 4, 1};  // Means 2 and 11.5/6: ε is 0.02.

std::vector<float> scaled(std::vector<float> values, float factor) {
    for (float& v : values) v *= factor;
    return values;
}

}  // namespace

TEST_CASE("error metrics are those of their formulas", "[metrics]") {
    const ErrorMetrics m = errorMetrics(kTest, kReference);
    REQUIRE(m.valid());
    CHECK(m.mse == Approx(1.25 / 6));
    CHECK(m.rmse == Approx(std::sqrt(1.25 / 6)));
    CHECK(m.relative_rmse == Approx(std::sqrt(1.25 / 6) / 2));
    CHECK(m.relmse == Approx((0.25 / (0.02 * 0.02) + 1.0 / (4 + 0.02 * 0.02)) / 6));
    CHECK(m.smape == Approx((2.0 + 2.0 / 3.0) / 6));
    CHECK(m.mae == Approx(1.5 / 6));
    CHECK(m.max_absolute == 1.0);
    CHECK(m.mean_ratio == Approx(11.5 / 12));
}

TEST_CASE("the 99th percentile leaves out one value of a hundred", "[metrics]") {
    std::vector<float> test(200, 0.0f), reference(200, 1.0f);
    for (std::size_t i = 0; i < 200; ++i)
        test[i] = 1 + static_cast<float>((i * 77) % 200 + 1);  // Errors 1 … 200, shuffled.
    const ErrorMetrics m = errorMetrics(test, reference);
    CHECK(m.p99_absolute == 198.0);
    CHECK(m.max_absolute == 200.0);
    CHECK(errorMetrics(std::vector<float>{3}, std::vector<float>{1}).p99_absolute == 2.0);
}

TEST_CASE("relative metrics do not know the exposure, absolute ones are proportional to it", "[metrics]") {
    const ErrorMetrics m = errorMetrics(kTest, kReference),
                       dark = errorMetrics(scaled(kTest, 0x1p-30f), scaled(kReference, 0x1p-30f));
    CHECK(dark.relmse == Approx(m.relmse).epsilon(1e-14));
    CHECK(dark.relative_rmse == Approx(m.relative_rmse).epsilon(1e-14));
    CHECK(dark.smape == Approx(m.smape).epsilon(1e-14));
    CHECK(dark.mean_ratio == m.mean_ratio);
    CHECK(dark.rmse == Approx(m.rmse * 0x1p-30));
    CHECK(dark.p99_absolute == m.p99_absolute * 0x1p-30);
}

TEST_CASE("one NaN or infinity voids every metric and is counted by kind and side", "[metrics]") {
    constexpr float nan = std::numeric_limits<float>::quiet_NaN(),
                    infinity = std::numeric_limits<float>::infinity();
    std::vector<float> test = kTest, reference = kReference;
    test[1] = nan;
    test[2] = -infinity;
    reference[2] = infinity;
    const ErrorMetrics m = errorMetrics(test, reference);
    CHECK_FALSE(m.valid());
    CHECK(m.test.nan == 1);
    CHECK(m.test.infinite == 1);
    CHECK(m.reference.nan == 0);
    CHECK(m.reference.infinite == 1);
    for (const double number : {m.test_mean, m.mean_ratio, m.mse, m.rmse, m.relative_rmse, m.relmse, m.smape,
                                m.mae, m.p99_absolute, m.max_absolute})
        CHECK(std::isnan(number));
    CHECK_FALSE(errorMetrics({}, {}).valid());
    CHECK_THROWS_AS(errorMetrics(kTest, std::vector<float>{1}), crt::Error);
}

TEST_CASE("against black, relative errors are infinite and not a number is made of 0/0", "[metrics]") {
    const std::vector<float> black(6, 0.0f);
    CHECK(errorMetrics(black, black).relative_rmse == 0.0);
    CHECK(errorMetrics(black, black).relmse == 0.0);
    CHECK(errorMetrics(black, black).smape == 0.0);
    CHECK(std::isinf(errorMetrics(kTest, black).relative_rmse));
    CHECK(errorMetrics(kReference, black).smape == Approx(2.0 * 5 / 6));
}

TEST_CASE("CIEDE2000 gives Sharma's 34 pairs", "[metrics]") {
    struct Pair {
        Lab a, b;
        double difference;
    };
    // Table 1 of Sharma, Wu and Dalal 2005, Color Research and Application 30(1).
    const std::vector<Pair> pairs{{{50, 2.6772, -79.7751}, {50, 0, -82.7485}, 2.0425},
                                  {{50, 3.1571, -77.2803}, {50, 0, -82.7485}, 2.8615},
                                  {{50, 2.8361, -74.0200}, {50, 0, -82.7485}, 3.4412},
                                  {{50, -1.3802, -84.2814}, {50, 0, -82.7485}, 1.0000},
                                  {{50, -1.1848, -84.8006}, {50, 0, -82.7485}, 1.0000},
                                  {{50, -0.9009, -85.5211}, {50, 0, -82.7485}, 1.0000},
                                  {{50, 0, 0}, {50, -1, 2}, 2.3669},
                                  {{50, -1, 2}, {50, 0, 0}, 2.3669},
                                  {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0009}, 7.1792},
                                  {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0010}, 7.1792},
                                  {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0011}, 7.2195},
                                  {{50, 2.4900, -0.0010}, {50, -2.4900, 0.0012}, 7.2195},
                                  {{50, -0.0010, 2.4900}, {50, 0.0009, -2.4900}, 4.8045},
                                  {{50, -0.0010, 2.4900}, {50, 0.0010, -2.4900}, 4.8045},
                                  {{50, -0.0010, 2.4900}, {50, 0.0011, -2.4900}, 4.7461},
                                  {{50, 2.5, 0}, {50, 0, -2.5}, 4.3065},
                                  {{50, 2.5, 0}, {73, 25, -18}, 27.1492},
                                  {{50, 2.5, 0}, {61, -5, 29}, 22.8977},
                                  {{50, 2.5, 0}, {56, -27, -3}, 31.9030},
                                  {{50, 2.5, 0}, {58, 24, 15}, 19.4535},
                                  {{50, 2.5, 0}, {50, 3.1736, 0.5854}, 1.0000},
                                  {{50, 2.5, 0}, {50, 3.2972, 0}, 1.0000},
                                  {{50, 2.5, 0}, {50, 1.8634, 0.5757}, 1.0000},
                                  {{50, 2.5, 0}, {50, 3.2592, 0.3350}, 1.0000},
                                  {{60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}, 1.2644},
                                  {{63.0109, -31.0961, -5.8663}, {62.8187, -29.7946, -4.0864}, 1.2630},
                                  {{61.2901, 3.7196, -5.3901}, {61.4292, 2.2480, -4.9620}, 1.8731},
                                  {{35.0831, -44.1164, 3.7933}, {35.0232, -40.0716, 1.5901}, 1.8645},
                                  {{22.7233, 20.0904, -46.6940}, {23.0331, 14.9730, -42.5619}, 2.0373},
                                  {{36.4612, 47.8580, 18.3852}, {36.2715, 50.5065, 21.2231}, 1.4146},
                                  {{90.8027, -2.0831, 1.4410}, {91.1528, -1.6435, 0.0447}, 1.4441},
                                  {{90.9257, -0.5406, -0.9208}, {88.6381, -0.8985, -0.7239}, 1.5381},
                                  {{6.7747, -0.2908, -2.4247}, {5.8714, -0.0985, -2.2286}, 0.6377},
                                  {{2.0776, 0.0795, -1.1350}, {0.9033, -0.0636, -0.5514}, 0.9082}};
    REQUIRE(pairs.size() == 34);
    for (const Pair& pair : pairs) {
        INFO("(" << pair.a.lightness << ", " << pair.a.a << ", " << pair.a.b << ")");
        CHECK(deltaE2000(pair.a, pair.b) == Approx(pair.difference).margin(0.5e-4 + 1e-9).epsilon(0));
        CHECK(deltaE2000(pair.b, pair.a) == Approx(deltaE2000(pair.a, pair.b)).epsilon(1e-12));
    }
}

TEST_CASE("L*a*b* of linear sRGB", "[metrics]") {
    CHECK(labFromLinearSrgb({1, 1, 1}).lightness == Approx(100));
    CHECK(labFromLinearSrgb({1, 1, 1}).a == Approx(0).margin(1e-9));
    CHECK(labFromLinearSrgb({0, 0, 0}).lightness == Approx(0).margin(1e-12));
    constexpr double middle = 0.18418651851244416;  // ((50 + 16)/116)³
    CHECK(labFromLinearSrgb({middle, middle, middle}).lightness == Approx(50).epsilon(1e-12));
    // sRGB's red, from the standard's XYZ of it: 53.24, 80.09, 67.20.
    const Lab red = labFromLinearSrgb({1, 0, 0});
    CHECK(red.lightness == Approx(53.24).margin(0.01));
    CHECK(red.a == Approx(80.09).margin(0.03));
    CHECK(red.b == Approx(67.20).margin(0.03));
    const Color back = xyzToLinearSrgb(linearSrgbToXyz({0.3, 0.7, 0.1}));
    CHECK(back[0] == Approx(0.3).epsilon(1e-12));
    CHECK(back[2] == Approx(0.1).epsilon(1e-12));
}

TEST_CASE("the colour difference of images: clipped as on a screen, void with NaN", "[metrics]") {
    const std::vector<float> a{1, 1, 1, 0, 0, 0}, b{7, 1, 1, 0, 0, -3};
    CHECK(deltaE2000(RgbView{a, 2, 1}, RgbView{b, 2, 1}).max == 0.0);
    const std::vector<float> black(6, 0.0f);
    const ColorDifference white_black = deltaE2000(RgbView{a, 2, 1}, RgbView{black, 2, 1});
    CHECK(white_black.max == Approx(100));
    CHECK(white_black.mean == Approx(50));
    const std::vector<float> broken{1, 1, std::numeric_limits<float>::infinity(), 0, 0, 0};
    CHECK(std::isnan(deltaE2000(RgbView{broken, 2, 1}, RgbView{a, 2, 1}).mean));
}
