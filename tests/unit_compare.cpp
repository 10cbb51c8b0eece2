// Comparing images: metrics worked out by hand, and everything that must not pass for equal.
#include "base/error.h"
#include "catch.h"
#include "image/image_metadata.h"
#include "judge/compare/compare_reference.h"
#include "judge/compare/compare_text.h"

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
    CHECK(r.rmse_over_mean == Approx(std::sqrt((0.25 + 1.0) / 6) / 2));
    // The error is of luminance, here by the weights of sRGB: Y of b is 1.8594 and 3.0051, and a's second
    // pixel is off by 0.5 R − 1 B.
    const double red = 0.2126390, green = 0.7151687, blue = 0.0721923,
                 mean_y = (red + 2 * green + 3 * blue + 4 * green + 2 * blue) / 2;
    REQUIRE(r.relative_rmse);
    CHECK(*r.relative_rmse == Approx(std::abs(0.5 * red - blue) / std::sqrt(2.0) / mean_y).epsilon(1e-3));
    CHECK_THAT(compareText(r), Contains("(RMSE of luminance, over B's mean luminance)"));
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
    CHECK_THAT(compareText(compareImages(a, b, {0.1, false})),
               Contains("same within the tolerance") && Contains("0.1 allowed"));
    // Anything is infinitely far from black.
    CHECK_FALSE(compareImages(a, twoPixels(std::vector<float>(6, 0.0f)), {1e6, false}).same);
}

TEST_CASE("a NaN or an infinity voids the metrics and never passes a tolerance", "[compare]") {
    const Image b = twoPixels(kReference);
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        Image a = b;
        a.pixels[4] = bad;
        for (const double tolerance : {0.0, 1e9}) {
            const CompareResult r = compareImages(a, b, {tolerance, false});
            CHECK_FALSE(r.same);
            CHECK_FALSE(r.metrics_valid);
            CHECK(r.not_finite == std::array<std::uint64_t, 2>{1, 0});
            CHECK(r.differing_pixels == 1);
            CHECK_THAT(compareText(r),
                       Contains("not finite") && Contains("1 values in the first image, 0 in the second"));
        }
        // Bit for bit it equals itself, but that is said and no metric is given.
        const CompareResult self = compareImages(a, a);
        CHECK(self.same);
        CHECK_FALSE(self.metrics_valid);
        CHECK_THAT(compareText(self), Contains("not finite"));
        CHECK_FALSE(compareImages(a, a, {0.5, false}).same);
        CHECK_THAT(compareText(compareImages(a, a, {0.5, false})),
                   Contains("not the same within a tolerance, since values are not finite"));
        CHECK_FALSE(compareImages(a, b).relative_rmse);
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

TEST_CASE("images of other exposure, white balance or colour space are not compared", "[compare]") {
    const auto under = [](const char* exposure, const char* balance, std::optional<ColorSpace> space) {
        Image image = twoPixels(kReference);
        if (*exposure != 0) image.metadata.emplace_back(kExposureKey, exposure);
        if (*balance != 0) image.metadata.emplace_back(kWhiteBalanceKey, balance);
        if (space) image.chromaticities = chromaticities(*space);
        return image;
    };
    const Image plain = under("0", "none", ColorSpace::LinearSrgb);
    CHECK(compareImages(plain, plain).same);
    const Image brighter = under("1", "none", ColorSpace::LinearSrgb),
                balanced = under("0", "0.447574,0.407443", ColorSpace::LinearSrgb);
    const Image aces = under("0", "none", ColorSpace::AcesCg);
    for (const auto& [other, words] :
         {std::pair{&brighter, "A and B differ in exposure: +0 EV and +1 EV"},
          {&balanced, "A and B differ in white balance: none and of 0.447574,0.407443"},
          {&aces, "A and B differ in colour space: sRGB and ACEScg"}}) {
        const CompareResult r =
            compareImages(plain, *other, {1e9, false});  // No tolerance makes them comparable.
        CHECK_FALSE(r.same);
        CHECK(r.mismatch == words);
        CHECK_THAT(compareText(r), Contains(std::string("different: ") + words));
        CHECK(nlohmann::json::parse(compareJson(r))["same"] == false);
        CHECK(nlohmann::json::parse(compareJson(r))["mismatch"] == words);
        // The same as a reference: not an error of the image, but a wrong question.
        CHECK_THROWS_WITH(compareWithReference(plain, plain, *other, false),
                          Contains("differ in") && Contains("A and R"));
        CHECK_THROWS_WITH(compareWithReference(*other, plain, *other, false), Contains("B and R"));
        // An image that says nothing is taken to be alike, with a word where that is not the usual.
        const Image silent = under("", "", std::nullopt);
        const CompareResult supposed = compareImages(silent, *other);
        CHECK(supposed.mismatch.empty());
        REQUIRE(supposed.notes.size() == 1);
        CHECK_THAT(supposed.notes[0], Contains("A does not state its") && Contains("assumes that of B"));
        CHECK_THAT(compareText(supposed), Contains("note") && Contains(supposed.notes[0]));
        CHECK(nlohmann::json::parse(compareJson(supposed))["notes"].size() == 1);
        CHECK(supposed.same);
        REQUIRE(supposed.perceived);
        CHECK(supposed.perceived->delta_e_max == 0);
        CHECK(compareWithReference(silent, silent, *other, false).notes.size() == 2);
        CHECK(compareImages(silent, plain).notes.empty());
    }
    // Rounding of text and of floats is no difference.
    CHECK(compareImages(under("0.1", "0.44757,0.40744", {}),
                        under("0.10000000000000001", "0.447574,0.407443", {}))
              .mismatch.empty());
    // Depth has neither exposure nor white.
    Image depth = brighter, other_depth = plain;
    depth.channels = other_depth.channels = {"Z", "Ns.X", "Ns.Y"};
    CHECK(compareImages(depth, other_depth).same);
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
