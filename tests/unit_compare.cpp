// Comparing images: metrics worked out by hand, and everything that must not pass for equal.
#include "catch.h"
#include "compare_text.h"
#include "error.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <limits>

using namespace crt;

namespace {

/// Two pixels side by side.
Image twoPixels(std::vector<float> values) {
    Image image;
    image.width = 2;
    image.height = 1;
    image.channels = {"R", "G", "B"};
    image.pixels = std::move(values);
    return image;
}

const std::vector<float> kReference{1, 2, 3, 0, 4, 2};  // Mean 2, so ε of relMSE is 0.02.

}  // namespace

TEST_CASE("an image is the same as itself", "[compare]") {
    const Image image = twoPixels(kReference);
    const CompareResult r = compareImages(image, image);
    CHECK(r.same);
    CHECK(r.metrics_valid);
    CHECK(r.differing_pixels == 0);
    CHECK_FALSE(r.first_difference);
    CHECK(r.max_ulp == 0);
    CHECK(r.rmse == 0.0);
    CHECK(r.relmse == 0.0);
    CHECK(r.mean_ratio == 1.0);
    CHECK_THAT(compareText(r), Contains("same bits: 0 of 2 pixels differ"));
    // Black against black has no relative anything, and is the same.
    const Image black = twoPixels(std::vector<float>(6, 0.0f));
    CHECK(compareImages(black, black).same);
    CHECK(compareImages(black, black, {1e-3, false}).same);
}

TEST_CASE("the metrics are those of their formulas", "[compare]") {
    const Image b = twoPixels(kReference);
    Image a = b;
    a.pixels[3] = 0.5f;  // 0 → 0.5
    a.pixels[5] = 1.0f;  // 2 → 1
    const CompareResult r = compareImages(a, b);
    CHECK_FALSE(r.same);
    CHECK(r.differing_pixels == 1);
    REQUIRE(r.first_difference);
    CHECK(r.first_difference->x == 1);
    CHECK(r.first_difference->y == 0);
    CHECK(r.first_difference->channel == "R");
    CHECK(r.first_difference->first == 0.5);
    CHECK(r.first_difference->second == 0.0);
    CHECK(r.max_absolute == 1.0);
    CHECK(r.max_ulp == 0x3f000000u);  // All floats between 0 and 0.5.
    CHECK(r.rmse == Approx(std::sqrt((0.25 + 1.0) / 6)));
    CHECK(r.relative_rmse == Approx(std::sqrt((0.25 + 1.0) / 6) / 2));
    CHECK(r.relmse == Approx((0.25 / (0.02 * 0.02) + 1.0 / (4 + 0.02 * 0.02)) / 6));
    CHECK(r.mae == Approx(1.5 / 6));
    CHECK(r.smape == Approx((2.0 + 2.0 / 3.0) / 6));
    CHECK(r.mean[0] == Approx(11.5 / 6));
    CHECK(r.mean[1] == Approx(2.0));
    CHECK(r.mean_ratio == Approx(11.5 / 12));
}

TEST_CASE("one bit is a difference, and ulps are counted across zero", "[compare]") {
    const Image b = twoPixels(kReference);
    Image a = b;
    a.pixels[2] = std::nextafter(3.0f, 4.0f);
    CompareResult r = compareImages(a, b);
    CHECK_FALSE(r.same);
    CHECK(r.max_ulp == 1);
    CHECK(r.first_difference->x == 0);
    CHECK(r.first_difference->channel == "B");

    const float tiny = std::numeric_limits<float>::denorm_min();
    CHECK(compareImages(twoPixels({tiny, 0, 0, 0, 0, 1}), twoPixels({-tiny, 0, 0, 0, 0, 1})).max_ulp == 2);
    // Equal as numbers, but not the same bits.
    r = compareImages(twoPixels({-0.0f, 0, 0, 0, 0, 1}), twoPixels({0, 0, 0, 0, 0, 1}));
    CHECK_FALSE(r.same);
    CHECK(r.max_ulp == 0);
    CHECK(r.max_absolute == 0.0);
}

TEST_CASE("a tolerance allows that much RMSE relative to the mean", "[compare]") {
    const Image b = twoPixels(kReference);
    Image a = b;
    a.pixels[0] += 0.12f;
    const double relative = 0.12 / std::sqrt(6.0) / 2;
    CHECK(compareImages(a, b, {relative * 1.001, false}).same);
    CHECK_FALSE(compareImages(a, b, {relative * 0.999, false}).same);
    CHECK_THAT(compareText(compareImages(a, b, {0.1, false})), Contains("same within the tolerance") && Contains("0.1 allowed"));
    // Anything is infinitely far from black.
    CHECK_FALSE(compareImages(a, twoPixels(std::vector<float>(6, 0.0f)), {1e6, false}).same);
}

TEST_CASE("a NaN or an infinity voids the metrics and never passes a tolerance", "[compare]") {
    const Image b = twoPixels(kReference);
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        Image a = b;
        a.pixels[4] = bad;
        for (const double tolerance : {0.0, 1e9}) {
            const CompareResult r = compareImages(a, b, {tolerance, false});
            CHECK_FALSE(r.same);
            CHECK_FALSE(r.metrics_valid);
            CHECK(r.not_finite == std::array<std::uint64_t, 2>{1, 0});
            CHECK(r.differing_pixels == 1);
            CHECK_THAT(compareText(r), Contains("not finite") && Contains("1 values in the first image, 0 in the second"));
        }
        // Bit for bit it equals itself, but that is said and no metric is given.
        const CompareResult self = compareImages(a, a);
        CHECK(self.same);
        CHECK_FALSE(self.metrics_valid);
        CHECK_THAT(compareText(self), Contains("not finite"));
        CHECK_FALSE(compareImages(a, a, {0.5, false}).same);
    }
}

TEST_CASE("images of other sizes are different and say so", "[compare]") {
    const Image a = twoPixels(kReference);
    Image b = a;
    b.width = 1;
    b.height = 2;
    const CompareResult r = compareImages(a, b, {1e9, false});
    CHECK_FALSE(r.same);
    CHECK_THAT(r.mismatch, Contains("2 × 1") && Contains("1 × 2"));
    CHECK_THAT(compareText(r), Contains("different: the images differ in size"));
    CHECK_THROWS_AS(differenceImage(a, b), Error);
}

TEST_CASE("channels are found by name, and extra ones matter only when asked for", "[compare]") {
    const Image a = twoPixels(kReference);
    Image b;
    b.width = 2;
    b.height = 1;
    b.channels = {"B", "Z", "G", "R"};
    b.pixels = {3, 9, 2, 1, 2, 9, 4, 0};
    b.integer_channels = {"sampleCount"};
    b.integers = {16, 16};
    CompareResult r = compareImages(a, b);
    CHECK(r.same);
    CHECK(r.other_channels == std::vector<std::string>{"Z", "sampleCount"});
    CHECK_THAT(compareText(r), Contains("not compared") && Contains("sampleCount"));
    r = compareImages(a, b, {0, true});
    CHECK_FALSE(r.same);
    CHECK_THAT(r.mismatch, Contains("Z") && Contains("sampleCount"));

    Image c = b;
    c.integers[1] = 17;
    CHECK(compareImages(c, b).same);
    r = compareImages(c, b, {0, true});
    CHECK_FALSE(r.same);
    CHECK(r.first_difference->channel == "sampleCount");
    CHECK(r.first_difference->first == 17.0);
    CHECK(r.rmse == 0.0);  // The colour is the same.

    // Without R, G and B every float channel counts.
    Image depth;
    depth.width = depth.height = 1;
    depth.channels = {"Z"};
    depth.pixels = {1.0f};
    Image nearer = depth;
    nearer.pixels[0] = 0.5f;
    CHECK(compareImages(depth, depth).same);
    CHECK(compareImages(nearer, depth).max_absolute == 0.5);
    Image grey = depth;
    grey.channels = {"Y"};
    CHECK_FALSE(compareImages(depth, grey).same);
    CHECK_FALSE(compareImages(depth, grey).mismatch.empty());
}

TEST_CASE("the JSON says the same as the struct", "[compare]") {
    const Image b = twoPixels(kReference);
    Image a = b;
    a.pixels[3] = 0.5f;
    nlohmann::json json = nlohmann::json::parse(compareJson(compareImages(a, b)));
    CHECK(json["same"] == false);
    CHECK(json["mismatch"].is_null());
    CHECK(json["differing_pixels"] == 1);
    CHECK(json["first_difference"]["x"] == 1);
    CHECK(json["metrics"]["max_absolute"] == 0.5);
    CHECK(json["metrics"]["rmse"].get<double>() == Approx(std::sqrt(0.25 / 6)));

    a.pixels[3] = std::numeric_limits<float>::quiet_NaN();
    json = nlohmann::json::parse(compareJson(compareImages(a, b)));
    CHECK(json["metrics"].is_null());
    CHECK(json["not_finite"][0] == 1);
    CHECK(json["first_difference"]["first"].is_null());
    a.width = 1;
    CHECK(nlohmann::json::parse(compareJson(compareImages(a, b)))["mismatch"].is_string());
}

TEST_CASE("difference images show where and how much", "[compare]") {
    const Image b = twoPixels(kReference);
    Image a = b;
    a.pixels[4] = 4.5f;
    CHECK(differenceImage(a, b).pixels == std::vector<float>{0, 0, 0, 0, 0.5f, 0});
    Image shown = falseColorDifference(a, b);
    CHECK(std::vector<float>(shown.pixels.begin(), shown.pixels.begin() + 3) == std::vector<float>{0, 0, 0});
    CHECK(shown.pixels[3] == 1.0f);  // A quarter of the mean: red.
    a.pixels[4] = std::nextafter(4.0f, 5.0f);
    shown = falseColorDifference(a, b);
    CHECK(shown.pixels[5] > 0.5f);  // One rounding: blue.
    a.pixels[4] = std::numeric_limits<float>::quiet_NaN();
    shown = falseColorDifference(a, b);
    CHECK(std::vector<float>(shown.pixels.begin() + 3, shown.pixels.end()) == std::vector<float>{1, 0, 1});
    CHECK_THROWS_AS(writeDifference("difference.txt", a, b), Error);
}
