// Noise and bias of images, and errors against a reference with noise, on images whose noise is known
// because it was made here.
#include "base/error.h"
#include "catch.h"
#include "image/image_metadata.h"
#include "judge/compare/compare_noise.h"
#include "judge/compare/compare_reference.h"
#include "judge/compare/compare_text.h"
#include "judge/compare/image_noise.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <tuple>
#include <utility>

using namespace crt;

namespace {

constexpr std::uint32_t kWidth = 40, kHeight = 24;
constexpr double kNoise = 0.2;  // Standard error of every value; means are 1, 2 and 3.

class Random {
public:
    explicit Random(std::uint64_t seed) : bits_(seed) {}
    double normal() { return stats::normalQuantile((static_cast<double>(bits_() >> 11) + 0.5) * 0x1p-53); }

private:
    std::mt19937_64 bits_;
};

Image blank(std::vector<std::string> channels, const std::string& seed) {
    Image image;
    image.width = kWidth;
    image.height = kHeight;
    image.channels = std::move(channels);
    image.metadata = {{"crt/seed", seed}, {kErrorDofKey, "15"}};
    return image;
}

/// R, G and B with noise, and what it is.
Image withStandardError(std::uint64_t seed, double factor = 1, double stated = kNoise) {
    Random random(seed);
    Image image = blank({"R", "G", "B", "StdError.R", "StdError.G", "StdError.B"}, std::to_string(seed));
    for (std::uint32_t p = 0; p < kWidth * kHeight; ++p) {
        for (int c = 0; c < 3; ++c)
            image.pixels.push_back(static_cast<float>(factor * (c + 1) + kNoise * random.normal()));
        for (int c = 0; c < 3; ++c) image.pixels.push_back(static_cast<float>(stated));
    }
    return image;
}

/// Eight folds whose mean has this standard error, and the mean of them.
Image withFolds(std::uint64_t seed, double standard_error) {
    Random random(seed);
    std::vector<std::string> channels{"R", "G", "B"};
    for (std::size_t k = 0; k < kFolds; ++k)
        for (const char* c : {"R", "G", "B"}) channels.push_back("Fold." + std::to_string(k) + "." + c);
    Image image = blank(channels, std::to_string(seed));
    for (std::uint32_t p = 0; p < kWidth * kHeight; ++p) {
        std::vector<float> folds;
        for (std::size_t i = 0; i < 3 * kFolds; ++i)
            folds.push_back(static_cast<float>(static_cast<double>(i % 3 + 1) +
                                               standard_error * std::sqrt(8.0) * random.normal()));
        for (std::size_t c = 0; c < 3; ++c) {
            double sum = 0;
            for (std::size_t k = 0; k < kFolds; ++k) sum += folds[3 * k + c];
            image.pixels.push_back(static_cast<float>(sum / kFolds));
        }
        image.pixels.insert(image.pixels.end(), folds.begin(), folds.end());
    }
    return image;
}

}  // namespace

TEST_CASE("an image's noise is read from what it carries", "[compare-noise]") {
    const auto stated = noisyImage(withStandardError(1), NoiseOf::Color);
    REQUIRE(stated);
    CHECK(stated->channels == std::vector<std::string>{"R", "G", "B"});
    CHECK(stated->variances.size() == kWidth * kHeight * 3);
    CHECK(stated->variances[5] == Approx(kNoise * kNoise));
    CHECK_FALSE(noisyImage(withStandardError(1), NoiseOf::Luminance));

    CHECK(stated->dof == 15);
    CHECK_THAT(stated->source, Contains("15 degrees of freedom"));
    Image silent = withStandardError(1);
    silent.metadata.pop_back();
    CHECK(noisyImage(silent, NoiseOf::Color)->dof == 1);  // The fewest that there can be.
    CHECK_THAT(noisyImage(silent, NoiseOf::Color)->source, Contains("not stated, taken as 1"));

    const auto folds = noisyImage(withFolds(2, kNoise), NoiseOf::Color);
    REQUIRE(folds);
    CHECK(folds->dof == 7);
    CHECK(stats::summarize(folds->variances).mean ==
          Approx(kNoise * kNoise).epsilon(0.05));  // 2880 χ² of 7: their mean is good to 1 %.
    const auto luminance = noisyImage(withFolds(2, kNoise), NoiseOf::Luminance);
    REQUIRE(luminance);
    const auto w = luminanceWeights(withFolds(2, kNoise));
    CHECK(stats::summarize(luminance->variances).mean ==
          Approx(kNoise * kNoise * (w[0] * w[0] + w[1] * w[1] + w[2] * w[2])).epsilon(0.08));
    CHECK(stats::summarize(luminance->values).mean == Approx(w[0] + 2 * w[1] + 3 * w[2]).epsilon(0.01));

    Image variance = blank({"R", "G", "B", "Variance.Y"}, "3");
    for (std::uint32_t p = 0; p < kWidth * kHeight; ++p)
        variance.pixels.insert(variance.pixels.end(), {1, 1, 1, 0.25f});
    CHECK(noisyImage(variance, NoiseOf::Luminance)->variances[7] == 0.25);
    CHECK_FALSE(noisyImage(variance, NoiseOf::Color));
    variance.pixels[3] = std::numeric_limits<float>::infinity();  // The noise estimate of one sample.
    CHECK_FALSE(noisyImage(variance, NoiseOf::Luminance));
}

TEST_CASE("luminance weights are those of the primaries", "[compare-noise]") {
    Image image = blank({}, "1");
    image.chromaticities = {0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.31271, 0.32902};
    const auto srgb = luminanceWeights(image);
    CHECK(srgb[0] == Approx(0.212636821677324).epsilon(1e-9));
    CHECK(srgb[2] == Approx(0.072180196481425).epsilon(1e-9));
    image.chromaticities = {1, 0, 0, 1, 0, 0, 1.0 / 3, 1.0 / 3};  // XYZ: luminance is Y.
    CHECK(luminanceWeights(image)[0] == Approx(0).margin(1e-15));
    CHECK(luminanceWeights(image)[1] == Approx(1));
    // Of a space that crt writes, they give back the film's Y, to which the variances belong: in ACEScg too,
    // whose white is not D65.
    image.chromaticities = chromaticities(ColorSpace::AcesCg);
    const Vec3d rgb = multiply(xyzToRgb(ColorSpace::AcesCg), Vec3d{1.4, 0.7, 0.2});
    const auto aces = luminanceWeights(image);
    CHECK(aces[0] * rgb[0] + aces[1] * rgb[1] + aces[2] * rgb[2] == Approx(0.7).epsilon(1e-9));
    image.chromaticities = {0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.3290};  // Display P3
    CHECK(luminanceWeights(image)[0] == Approx(0.22897).margin(1e-5));
    CHECK(luminanceWeights(image)[1] == Approx(0.69174).margin(1e-5));
}

TEST_CASE("noise alone is no bias, and z says that it is noise", "[compare-noise]") {
    int covered = 0, alarms = 0;
    for (std::uint64_t i = 0; i < 40; ++i) {
        const NoiseComparison n = compareNoise(withStandardError(2 * i + 1), withStandardError(2 * i + 2));
        REQUIRE(n.unknown.empty());
        REQUIRE(n.channels.size() == 3);
        CHECK(n.rms_z == Approx(1).margin(0.06));
        for (const ChannelBias& c : n.channels) {
            covered += c.interval.contains(0);
            // 960 pixels of 15 degrees of freedom each: next to the normal quantile, not the 4.07 of one
            // pixel; or, where the differences scatter strongly, that of sums which are known to be
            // symmetric and no more (3.605).
            const double standard_error = kNoise * std::sqrt(2.0 / 960);
            CHECK(c.interval.halfWidth() > 3.2905 * standard_error * (1 - 2e-3));
            CHECK(c.interval.halfWidth() < 3.605 * standard_error * 1.15);
        }
        alarms += n.tiles.rejected > 0 || n.pixels.rejected > 0;
    }
    CHECK(covered >= 118);  // 99.9 % of 120; two misses have a probability of 0.007.
    CHECK(alarms == 0);     // 0.1 % each.
}

TEST_CASE("a bias is found: in the mean, in a tile, in a pixel", "[compare-noise]") {
    const Image b = withStandardError(1);
    const NoiseComparison mean = compareNoise(withStandardError(2, 1.03), b);
    CHECK_FALSE(mean.channels[2].interval.contains(0));
    CHECK(mean.channels[2].interval.contains(0.09));
    CHECK(mean.channels[2].p < 1e-6);
    CHECK(mean.anyBeyondNoise());

    Image tile = withStandardError(3);
    for (std::uint32_t y = 8; y < 16; ++y)
        for (std::uint32_t x = 16; x < 24; ++x)
            tile.pixels[(y * kWidth + x) * 6 + 1] += 0.4f;  // Two standard errors of a pixel.
    const NoiseComparison in_tile = compareNoise(tile, b);
    CHECK(in_tile.tiles.rejected == 1);
    CHECK(in_tile.tiles.worst == (1 * 5 + 2) * 3 + 1);
    CHECK(in_tile.channels[1].interval.contains(0));
    CHECK(in_tile.anyBeyondNoise());

    Image pixel = withStandardError(4);
    pixel.pixels[(7 * kWidth + 9) * 6] += 4;
    const NoiseComparison in_pixel = compareNoise(pixel, b);
    CHECK(in_pixel.pixels.rejected == 1);
    CHECK(in_pixel.pixels.worst / 3 == 7 * kWidth + 9);
    CHECK(in_pixel.anyBeyondNoise());
    CHECK(in_pixel.z[(7 * kWidth + 9) * 3] > 10);
    const Image map = zMap(in_pixel, kWidth, kHeight);
    const auto color = map.pixels.begin() + (7 * kWidth + 9) * 3;
    CHECK(std::vector<float>(color, color + 3) == std::vector<float>{1, 0, 0});
}

TEST_CASE("standard errors that are stated too small are seen in z", "[compare-noise]") {
    const NoiseComparison n =
        compareNoise(withStandardError(1, 1, kNoise / 2), withStandardError(2, 1, kNoise / 2));
    CHECK(n.rms_z == Approx(2).margin(0.1));
    CHECK(n.anyBeyondNoise());
}

TEST_CASE("images of one seed, and without noise, are not judged, and one that knows its noise is enough",
          "[compare-noise]") {
    CHECK_THAT(compareNoise(withStandardError(1), withStandardError(1)).unknown, Contains("seed 1"));
    Image plain = blank({"R", "G", "B"}, "9");
    plain.pixels.assign(std::size_t{3} * kWidth * kHeight, 2.0f);
    CHECK_FALSE(compareNoise(plain, plain).unknown.empty());
    const NoiseComparison half = compareNoise(withStandardError(1), plain);
    CHECK(half.unknown.empty());
    CHECK(half.source_b.empty());
    CHECK(half.channels[1].interval.contains(0));
    CHECK_FALSE(half.channels[0].interval.contains(0));
    const NoiseComparison folds = compareNoise(withStandardError(1), withFolds(2, 0.05));
    CHECK(folds.source_b == "8 folds");
    CHECK(folds.rms_z == Approx(1).margin(0.06));
}

TEST_CASE("words, figures and JSON of a noise comparison agree in every branch", "[compare-noise]") {
    const auto said = [](const Image& a, const Image& b) {
        const CompareResult result = compareImages(a, b);
        const NoiseComparison noise = compareNoise(a, b);
        const std::string text = comparisonText({&result, &noise, nullptr});
        const auto json = nlohmann::json::parse(comparisonJson({&result, &noise, nullptr}))["noise"];
        if (!json.contains("unknown")) {  // The result is that of all tests together.
            const auto beyond = [](const auto& row) { return row["beyond_noise"].template get<bool>(); };
            const auto rejected = [&](const char* tests) { return json[tests].value("rejected", 0) > 0; };
            const bool any = json["rms_z_beyond_noise"].get<bool>() || rejected("tiles") ||
                             rejected("pixels") ||
                             std::any_of(json["bias"].begin(), json["bias"].end(), beyond) ||
                             std::any_of(json["colour"].begin(), json["colour"].end(), beyond);
            CHECK_THAT(text, Contains(any ? "the images differ by more than noise"
                                          : "no difference beyond noise was found"));
        }
        return std::pair{text, json};
    };
    const auto withMetadata = [](Image image, const char* key, const char* value) {
        for (auto& [name, text] : image.metadata)
            if (name == key) text = value;
        return image;
    };
    const Image a = withStandardError(1), b = withStandardError(2), biased = withStandardError(2, 1.1);

    // Noise, and more than noise: the word is that of the interval beside it.
    for (const auto& [other, word, not_said, beyond] :
         {std::tuple{&b, "may be noise", "more than noise", false},
          {&biased, "more than noise", "may be", true}}) {
        const auto [text, json] = said(a, *other);
        CHECK_THAT(text, Contains(word) && !Contains(not_said));
        for (const auto& channel : json["bias"]) {
            CHECK(channel["beyond_noise"] == beyond);
            const bool outside =
                channel["interval"][0].get<double>() > 0 || channel["interval"][1].get<double>() < 0;
            CHECK(outside == beyond);
            CHECK((channel["p"].get<double>() < 0.001) == beyond);
        }
        CHECK((json["tiles"]["rejected"] > 0) == beyond);
        CHECK_THAT(text, Contains(std::to_string(json["tiles"]["rejected"].get<int>()) +
                                  " of 45 tests differ beyond noise"));
    }

    // Too few degrees of freedom for single pixels, in either image.
    for (const auto& [first, second] :
         {std::pair{withMetadata(a, kErrorDofKey, "3"), b}, {a, withMetadata(b, kErrorDofKey, "3")}}) {
        const auto [text, json] = said(first, second);
        CHECK_THAT(text, Contains("pixels            not tested: a variance with 3 degrees of freedom"));
        CHECK(json["pixels"]["untested"].is_string());
    }

    // Nothing is said, and why.
    Image lost = a;
    lost.pixels[3] = std::numeric_limits<float>::infinity();
    Image plain = blank({"R", "G", "B"}, "9");
    plain.pixels.assign(std::size_t{3} * kWidth * kHeight, 2.0f);
    for (const auto& [first, second, why] : {std::tuple{&a, &a, "both have seed 1"},
                                             {&lost, &b, "A lacks the noise of some"},
                                             {&b, &lost, "B lacks the noise of some"}}) {
        const NoiseComparison noise = compareNoise(*first, *second);
        CHECK_THAT(noise.unknown, Contains(why));
        CHECK(noise.channels.empty());
        CHECK(noise.z.empty());
        const auto [text, json] = said(*first, *second);
        CHECK_THAT(json["unknown"].get<std::string>(), Contains(why));
        if (first != second) CHECK_THAT(text, Contains("Noise or bias? Not known: ") && Contains(why));
        CHECK_THROWS_WITH(writeZMap("z.pfm", noise, kWidth, kHeight), Contains(why));
    }

    // Without any stated noise the signs of the differences judge, where there are enough of them.
    Image other_plain = plain;
    other_plain.metadata = {{"crt/seed", "10"}};
    for (const auto& [differing, word] :
         {std::pair{63u, "not judged, too few pixels differ"}, {64u, "more than noise"}}) {
        for (std::uint32_t p = 0; p < differing; ++p) other_plain.pixels[std::size_t{3} * p] = 2.5f;
        const auto [words, figures] = said(other_plain, plain);
        CHECK_THAT(words,
                   Contains("Neither image states its noise") && Contains(word) && !Contains("rms z"));
        CHECK(figures["rms_z"].is_null());
        CHECK(figures["pixels"]["untested"].is_string());
        CHECK_THROWS_WITH(writeZMap("z.pfm", compareNoise(other_plain, plain), kWidth, kHeight),
                          Contains("neither image states"));
    }

    // Against black nothing is relative, and no NaN is printed.
    Image black = b;
    for (std::size_t i = 0; i < black.pixels.size(); ++i)
        if (i % 6 < 3) black.pixels[i] = 0;
    const auto [text, json] = said(a, black);
    CHECK_THAT(text.substr(text.find("Noise or bias?")),
               Contains("more than noise") && !Contains("nan") && !Contains("inf"));

    // A difference by rounding alone is no bias, though no noise explains it.
    Image rounded = plain;
    rounded.metadata = {{"crt/seed", "11"}};
    for (Image* image : {&rounded, &plain}) {
        image->channels.emplace_back("StdError.Y");
        image->pixels.clear();
        for (std::uint32_t p = 0; p < kWidth * kHeight; ++p)
            image->pixels.insert(image->pixels.end(),
                                 {2, 2, image == &rounded ? std::nextafter(2.0f, 3.0f) : 2.0f, 0});
    }
    const auto [words, figures] = said(rounded, plain);
    CHECK_THAT(words, Contains("may be noise") && Contains("0 of 15 tests differ beyond noise"));
    CHECK(figures["bias"][0]["beyond_noise"] == false);
}

TEST_CASE(
    "errors against a reference: its variance is subtracted, and its choice moves them as far as is said",
    "[compare-noise]") {
    const Image a = withStandardError(1), b = withStandardError(2, 1.1);
    constexpr double reference_noise = 0.1;
    const ReferenceComparison r = compareWithReference(a, b, withFolds(3, reference_noise), false);
    REQUIRE(r.reference_rms_error);
    // All are of luminance: of three independent channels with their weights.
    const auto w = luminanceWeights(a);
    const double share = std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]),
                 mean_y = w[0] + 2 * w[1] + 3 * w[2];
    CHECK(*r.reference_rms_error == Approx(reference_noise * share / mean_y).epsilon(0.03));
    const ReferenceError& of_a = r.errors[0];
    CHECK(of_a.metrics.mse == Approx(kNoise * kNoise + reference_noise * reference_noise).epsilon(0.08));
    REQUIRE(of_a.corrected_relative_rmse);
    CHECK(*of_a.corrected_relative_rmse == Approx(kNoise * share / mean_y).epsilon(0.05));
    CHECK(*r.errors[1].corrected_relative_rmse ==
          Approx(std::hypot(kNoise * share, 0.1 * mean_y) / mean_y).epsilon(0.05));
    CHECK(of_a.relative_rmse.value > *of_a.corrected_relative_rmse);
    CHECK(of_a.relative_rmse.value ==
          Approx(*compareImages(a, withFolds(3, reference_noise)).relative_rmse));
    CHECK(of_a.warnings.empty());

    // The spread, against that of newly made references.
    std::vector<double> means;
    for (std::uint64_t seed = 10; seed < 60; ++seed)
        means.push_back(
            compareWithReference(a, a, withFolds(seed, reference_noise), true).errors[0].metrics.mean_ratio);
    const double actual = std::sqrt(stats::summarize(means).variance);
    REQUIRE(of_a.mean_ratio.spread);
    CHECK(*of_a.mean_ratio.spread > actual / 2);
    CHECK(*of_a.mean_ratio.spread < actual * 2);
    CHECK(of_a.flip.spread);
}

TEST_CASE("a reference that may hold the image's samples, or is noisier than the error, is said",
          "[compare-noise]") {
    const Image a = withStandardError(3);
    const ReferenceComparison same_seed =
        compareWithReference(a, withStandardError(4), withFolds(3, 0.1), true);
    REQUIRE(same_seed.errors[0].warnings.size() == 1);
    CHECK_THAT(same_seed.errors[0].warnings[0], Contains("same samples"));
    CHECK(same_seed.errors[1].warnings.empty());

    const Image noisy = withFolds(5, 1);
    Image own = noisy;  // As near to the reference as can be, though the reference is bad.
    own.metadata = {{"crt/seed", "6"}};
    const ReferenceComparison below = compareWithReference(own, a, noisy, true);
    CHECK(below.errors[0].within_reference_noise);
    CHECK_FALSE(below.errors[0].corrected_relative_rmse);

    Image small = a;
    small.height = 1;
    CHECK_THROWS_AS(compareWithReference(small, a, noisy, true), Error);
    Image broken = a;
    broken.pixels[0] = std::numeric_limits<float>::quiet_NaN();
    const ReferenceComparison voided = compareWithReference(broken, a, noisy, true);
    CHECK_FALSE(voided.errors[0].metrics.valid());
    const CompareResult same = compareImages(a, a);
    const std::string words = comparisonText({&same, nullptr, &voided});
    CHECK_THAT(words, Contains("void: 1 values are not finite, 0 in the reference") &&
                          Contains("less R's noise  void"));
    CHECK(std::isnan(voided.errors[0].rmse.value));
    CHECK(voided.errors[1].metrics.valid());
}

TEST_CASE("text and JSON of a comparison say what was found and what is not known", "[compare-noise]") {
    const Image a = withStandardError(1), b = withStandardError(2, 1.1), reference = withFolds(3, 0.1);
    const CompareResult result = compareImages(a, b);
    const NoiseComparison noise = compareNoise(a, b);
    const ReferenceComparison errors = compareWithReference(a, b, reference, false);
    const std::string text = comparisonText({&result, &noise, &errors});
    CHECK_THAT(text, Contains("bias R") && Contains("more than noise") &&
                         Contains("noise of A        StdError.R, G, B, 15 degrees of freedom per pixel"));
    CHECK_THAT(text, Contains("has its variance subtracted") && Contains("±") &&
                         Contains("Against the reference R"));
    for (std::size_t begin = 0; begin < text.size(); begin = text.find('\n', begin) + 1) {
        CHECK(text.substr(begin, text.find('\n', begin) - begin).size() < 140);
        if (text.find('\n', begin) == std::string::npos) break;
    }
    const nlohmann::json json = nlohmann::json::parse(comparisonJson({&result, &noise, &errors}));
    CHECK(json["noise"]["bias"].size() == 3);
    CHECK(json["reference"]["a"]["rmse_spread"].is_number());
    CHECK(json["reference"]["a"]["relative_rmse_less_reference_variance"].get<double>() ==
          Approx(*errors.errors[0].corrected_relative_rmse));
    CHECK(json["metrics"]["flip_kind"] == "HDR");
    CHECK(json["metrics"]["flip"].get<double>() > 0);
}
