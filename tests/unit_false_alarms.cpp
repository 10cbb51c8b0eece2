// `crt compare` on pairs of images whose difference is known: alarms where there is none, and planted errors
// that must be found.
#include "base/statistics.h"
#include "catch.h"
#include "image/image_metadata.h"
#include "judge/compare/compare_noise.h"
#include "judge/stats/image_tests.h"
#include "judge/stats/pooled_tests.h"
#include "synthetic_noise.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>

using namespace crt;
using synthetic::Noise;
using synthetic::Planted;
using synthetic::Scenario;

namespace {

/// Rates at which each kind of test rejects, at two levels. Adjusted p-values below a level are alarms at
/// it.
struct Alarms {
    static constexpr std::array<double, 2> kLevels{0.05, 0.001};
    std::array<int, 2> mean{}, tiles{}, pixels{}, squares{}, colour{};
    bool pixels_tested = true;
    int repeats = 0;
};

Alarms countAlarms(const Scenario& s, int repeats, const Planted& planted = {}, double quality_of_b = 1,
                   std::uint64_t seed = 1) {
    synthetic::Maker maker(seed);
    Alarms alarms;
    alarms.repeats = repeats;
    for (int i = 0; i < repeats; ++i) {
        const Image a = maker.image(s, planted), b = maker.image(s, {}, quality_of_b);
        const NoiseComparison n = compareNoise(a, b);
        REQUIRE(n.unknown.empty());
        REQUIRE(n.channels.size() == 1);
        alarms.pixels_tested = n.pixels_untested.empty();
        CHECK(alarms.pixels_tested == (s.replicates >= 8));
        for (std::size_t l = 0; l < 2; ++l) {
            alarms.mean[l] += n.channels[0].p < Alarms::kLevels[l];
            alarms.tiles[l] += n.tiles.smallest_p < Alarms::kLevels[l];
            alarms.pixels[l] += n.pixels.smallest_p < Alarms::kLevels[l];
            alarms.squares[l] += n.rms_z_p < Alarms::kLevels[l];
            alarms.colour[l] += std::any_of(n.colours.begin(), n.colours.end(), [&](const ColourShift& c) {
                return 3 * c.p < Alarms::kLevels[l];
            });
        }
        // The figure, the word and the p beside it are one.
        CHECK(n.channels[0].beyondNoise() == (n.channels[0].p < 1 - n.confidence));
        CHECK((n.tiles.rejected > 0) == (n.tiles.smallest_p < n.tiles.alpha));
        CHECK((n.pixels.rejected > 0) == (n.pixels.smallest_p < n.pixels.alpha));
    }
    return alarms;
}

bool alarmed(const NoiseComparison& n) {
    return n.tiles.rejected > 0 || n.pixels.rejected > 0 || n.rmsBeyondNoise() ||
           std::any_of(n.channels.begin(), n.channels.end(),
                       [](const auto& c) { return c.beyondNoise(); }) ||
           std::any_of(n.colours.begin(), n.colours.end(), [&](const auto& c) { return n.beyondNoise(c); });
}

/// The same image, which does not say how large its noise is.
Image unstated(const Image& image) {
    Image plain = image;
    plain.channels = {"R", "G", "B"};
    plain.pixels.clear();
    for (std::size_t i = 0; i < image.pixels.size(); i += image.channels.size())
        plain.pixels.insert(plain.pixels.end(), image.pixels.begin() + static_cast<std::ptrdiff_t>(i),
                            image.pixels.begin() + static_cast<std::ptrdiff_t>(i + 3));
    return plain;
}

/// Fewest alarms that are as rare as one in 10,000 test runs when they come at the stated level or below.
int tooMany(int repeats, double level) {
    int k = 0;
    while (stats::clopperPearson(static_cast<std::uint64_t>(k), static_cast<std::uint64_t>(repeats), 0.9998)
               .lower <= level)
        ++k;
    return k;
}

const char* nameOf(Noise noise) {
    constexpr std::array<const char*, 5> kNames{"normal", "skewed", "rare light", "fireflies", "coverage"};
    return kNames[static_cast<std::size_t>(noise)];
}

/// A pixel's standard error over its mean: large enough that the kind of noise matters.
double noiseOf(Noise noise) {
    // RareLight: a path in every fourth pixel. Fireflies: one in every twentieth. Coverage: 64 samples.
    constexpr std::array<double, 5> kRelative{0.3, 1, 2, 7, 0.125};
    return kRelative[static_cast<std::size_t>(noise)];
}

}  // namespace

TEST_CASE(
    "what is only noise raises no more alarms than is stated, "
    "whatever the noise and however little is known of it",
    "[false-alarms]") {
    constexpr int kRepeats = 60;
    for (const Noise noise :
         {Noise::Normal, Noise::Skewed, Noise::RareLight, Noise::Fireflies, Noise::Coverage})
        for (const bool equal : {true, false})
            for (const std::uint32_t replicates : {2u, 4u, 8u, 16u}) {
                const Alarms alarms =
                    countAlarms({noise, equal, replicates, noiseOf(noise), 40, 24}, kRepeats);
                INFO(nameOf(noise) << ", " << (equal ? "equal" : "unequal") << " pixels, " << replicates - 1
                                   << " degrees of freedom");
                for (std::size_t l = 0; l < 2; ++l) {
                    const int too_many = tooMany(kRepeats, Alarms::kLevels[l]);
                    INFO("level " << Alarms::kLevels[l]);
                    CHECK(alarms.mean[l] < too_many);
                    CHECK(alarms.tiles[l] < too_many);
                    CHECK(alarms.pixels[l] < too_many);
                    CHECK(alarms.squares[l] < too_many);
                }
            }
}

TEST_CASE("noise of colour raises no more alarms of colour than is stated, with and without stated noise",
          "[false-alarms]") {
    constexpr int kRepeats = 60;
    for (const Noise noise : {Noise::Normal, Noise::Skewed, Noise::RareLight, Noise::Fireflies})
        for (const bool stated : {true, false}) {
            const Scenario s{noise, true, 2, noiseOf(noise), 40, 24, true};
            synthetic::Maker maker(5);
            std::array<int, 2> colour{}, mean{}, tiles{};
            for (int i = 0; i < kRepeats; ++i) {
                const Image a = maker.image(s), b = maker.image(s);
                const NoiseComparison n =
                    stated ? compareNoise(a, b) : compareNoise(unstated(a), unstated(b));
                REQUIRE(n.stated == stated);
                const bool rare = noise == Noise::RareLight || noise == Noise::Fireflies;
                REQUIRE((n.colour_unjudged.empty() || rare));  // Few pixels have light in both images.
                for (std::size_t l = 0; l < 2; ++l) {
                    const double level = Alarms::kLevels[l] / 3;  // Of three channels any.
                    for (const ColourShift& c : n.colours) colour[l] += c.p < level;
                    for (const ChannelBias& c : n.channels) mean[l] += c.p < level;
                    tiles[l] += n.tiles.smallest_p < Alarms::kLevels[l];
                }
            }
            INFO(nameOf(noise) << (stated ? "" : ", not stated"));
            for (std::size_t l = 0; l < 2; ++l) {
                CHECK(colour[l] < tooMany(kRepeats, Alarms::kLevels[l]));
                CHECK(mean[l] < tooMany(kRepeats, Alarms::kLevels[l]));
                CHECK(tiles[l] < tooMany(kRepeats, Alarms::kLevels[l]));
            }
        }
}

TEST_CASE("what lies in few pixels, in colour or in both directions raises an alarm", "[false-alarms]") {
    using Plant = void (*)(Image&);
    const auto pixel = [](Image& image, std::size_t x, std::size_t y) {
        return &image.pixels[(y * image.width + x) * image.channels.size()];
    };
    static const auto at = pixel;
    const std::vector<std::pair<const char*, Plant>> plants{
        {"one pixel brighter by 1,000 times the mean",
         [](Image& image) {
             for (int c = 0; c < 3; ++c) at(image, 17, 20)[c] += 1000;
         }},
        {"a cube of seven pixels black",
         [](Image& image) {
             for (std::size_t i = 0; i < 7; ++i)
                 for (int c = 0; c < 3; ++c) at(image, 17 + i % 3, 10 + i / 3)[c] = 0;
         }},
        {"R doubled at the same luminance",
         [](Image& image) {
             for (std::size_t i = 0; i < image.pixels.size(); i += image.channels.size()) {
                 const double more = image.pixels[i];
                 image.pixels[i] += static_cast<float>(more);
                 image.pixels[i + 1] -= static_cast<float>(more * 0.2126390 / 0.7151687);
             }
         }},
        {"every second pixel up and the others down by half", [](Image& image) {
             for (std::size_t i = 0, p = 0; i < image.pixels.size(); i += image.channels.size(), ++p)
                 for (std::size_t c = 0; c < 3; ++c) image.pixels[i + c] *= p % 2 == 0 ? 1.5f : 0.5f;
         }}};
    for (const std::uint32_t replicates : {2u, 4u, 16u})
        for (const auto& [what, plant] : plants) {
            synthetic::Maker maker(replicates);
            int found = 0, clean = 0;
            for (int i = 0; i < 10; ++i) {
                const Scenario s{Noise::Normal, true, replicates, 0.05, 40, 24, true};
                Image a = maker.image(s);
                const Image b = maker.image(s);
                clean += alarmed(compareNoise(a, b));
                plant(a);
                found += alarmed(compareNoise(a, b));
            }
            INFO(what << ", " << replicates << " replicates");
            CHECK(found == 10);
            CHECK(clean <= 1);
        }
}

TEST_CASE("light in six pixels, all of it half as bright again, raises an alarm", "[false-alarms]") {
    for (const std::uint32_t replicates : {2u, 4u, 16u}) {
        synthetic::Maker maker(replicates);
        int found = 0;
        for (int i = 0; i < 10; ++i) {
            const Scenario s{Noise::Normal, true, replicates, 0.02, 32, 32};
            std::array<Image, 2> images{maker.image(s), maker.image(s)};
            for (Image& image : images)
                for (std::size_t p = 0; p < std::size_t{32} * 32; ++p)
                    for (std::size_t c = 0; c < 4; ++c)
                        if (p % 170 != 5) image.pixels[4 * p + c] = 0;  // Six pixels are left.
            for (std::size_t p = 0; p < images[0].pixels.size(); p += 4)
                for (std::size_t c = 0; c < 3; ++c) images[0].pixels[p + c] *= 1.5f;
            found += alarmed(compareNoise(images[0], images[1]));
        }
        INFO(replicates << " replicates");
        CHECK(found == 10);
    }
}

TEST_CASE("light in one pixel of a part in which neither image has noise raises an alarm",
          "[false-alarms]") {
    // Of images with fewer replicates no single pixel is judged.
    synthetic::Maker maker(16);
    int found = 0, clean = 0;
    for (int i = 0; i < 10; ++i) {
        const Scenario s{Noise::Normal, true, 16, 0.02, 32, 32};
        std::array<Image, 2> images{maker.image(s), maker.image(s)};
        for (Image& image : images)  // Half of it is black.
            std::fill(image.pixels.begin(), image.pixels.begin() + 4 * 32 * 16, 0.0f);
        clean += alarmed(compareNoise(images[0], images[1]));
        for (std::size_t c = 0; c < 3; ++c) images[0].pixels[4 * (32 * 8 + 16) + c] = 0.5f;
        found += alarmed(compareNoise(images[0], images[1]));
    }
    CHECK(found == 10);
    CHECK(clean <= 1);
}

TEST_CASE(
    "what is only noise raises no more alarms than is stated when one image has sixteen times the samples",
    "[false-alarms]") {
    for (const Noise noise : {Noise::Normal, Noise::Skewed, Noise::RareLight, Noise::Fireflies})
        for (const bool equal : {true, false})
            for (const bool better_first : {true, false}) {
                // A mean that hangs on few rare paths, of which fewer samples may have met none, is the
                // worst case.
                const int repeats = noise == Noise::Fireflies && !equal ? 400 : 60;
                synthetic::Maker maker(7);
                const Scenario s{noise, equal, 4, noiseOf(noise), 64, 64};
                std::array<int, 2> mean{}, tiles{}, squares{};
                for (int i = 0; i < repeats; ++i) {
                    const Image few = maker.image(s), many = maker.image(s, {}, 16);
                    const NoiseComparison n =
                        better_first ? compareNoise(many, few) : compareNoise(few, many);
                    for (std::size_t l = 0; l < 2; ++l) {
                        mean[l] += n.channels[0].p < Alarms::kLevels[l];
                        tiles[l] += n.tiles.smallest_p < Alarms::kLevels[l];
                        squares[l] += n.rms_z_p < Alarms::kLevels[l];
                    }
                }
                INFO(nameOf(noise) << ", " << (equal ? "equal" : "unequal") << " pixels");
                for (std::size_t l = 0; l < 2; ++l) {
                    CHECK(mean[l] < tooMany(repeats, Alarms::kLevels[l]));
                    CHECK(tiles[l] < tooMany(repeats, Alarms::kLevels[l]));
                    CHECK(squares[l] < tooMany(repeats, Alarms::kLevels[l]));
                }
            }
}

TEST_CASE("planted errors are found: 2 % of the image, 20 % of a tile", "[false-alarms]") {
    for (const std::uint32_t replicates : {2u, 4u, 16u})
        for (const Noise noise : {Noise::Normal, Noise::Skewed}) {
            INFO(nameOf(noise) << ", " << replicates - 1 << " degrees of freedom");
            CHECK(countAlarms({noise, true, replicates, 0.1, 64, 64}, 10, {0.02, 0}).mean[1] == 10);
            const Alarms tile = countAlarms({noise, true, replicates, 0.1, 64, 64}, 10, {0, 0.2});
            CHECK(tile.tiles[1] == 10);
        }
}

TEST_CASE("(a table) false alarms of compare", "[.][false-alarm-table]") {
    constexpr int kRepeats = 300;
    std::printf(
        "Alarms in %% of %d pairs of 64 x 64 pixels where nothing "
        "is wrong, at the stated levels 5 %% and 0.1 %%.\n\n",
        kRepeats);
    std::printf(
        "| B | noise | pixels | dof | mean 5 %% | tiles 5 %% | squares 5 %% | pixels 5 %% | mean .1 %% | "
        "tiles .1 %% | squares .1 %% | pixels .1 %% |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (const double quality : {1.0, 16.0})
        for (const Noise noise :
             {Noise::Normal, Noise::Skewed, Noise::RareLight, Noise::Fireflies, Noise::Coverage})
            for (const bool equal : {true, false})
                for (const std::uint32_t replicates : {2u, 4u, 8u, 16u}) {
                    const Alarms a = countAlarms({noise, equal, replicates, noiseOf(noise), 64, 64},
                                                 kRepeats, {}, quality);
                    std::printf("| %s | %s | %s | %u |", quality == 1 ? "alike" : "16 times the samples",
                                nameOf(noise), equal ? "equal" : "unequal", replicates - 1);
                    for (std::size_t l = 0; l < 2; ++l) {
                        for (const int count : {a.mean[l], a.tiles[l], a.squares[l]})
                            std::printf(" %.2f |", 100.0 * count / a.repeats);
                        std::printf(a.pixels_tested ? " %.2f |" : " - |", 100.0 * a.pixels[l] / a.repeats);
                    }
                    std::printf("\n");
                    std::fflush(stdout);
                }
}

TEST_CASE("(a table) power of compare", "[.][false-alarm-table]") {
    constexpr int kRepeats = 100;
    std::printf(
        "| noise | a pixel's standard error | dof | 2 %% everywhere: mean | 20 %% in a tile: tiles "
        "|\n|---|---|---|---|---|\n");
    for (const Noise noise : {Noise::Normal, Noise::Skewed, Noise::RareLight})
        for (const double relative : {0.05, 0.1, 0.2})
            for (const std::uint32_t replicates : {2u, 4u, 16u}) {
                const Scenario s{noise, true, replicates, relative, 64, 64};
                const int mean = countAlarms(s, kRepeats, {0.02, 0}).mean[1],
                          tile = countAlarms(s, kRepeats, {0, 0.2}).tiles[1];
                std::printf("| %s | %g %% | %u | %d %% | %d %% |\n", nameOf(noise), 100 * relative,
                            replicates - 1, mean, tile);
                std::fflush(stdout);
            }
}

TEST_CASE("backends that render the same do not fail, whatever the noise and however few the replicates",
          "[false-alarms]") {
    constexpr int kRepeats = 60;
    for (const Noise noise :
         {Noise::Normal, Noise::Skewed, Noise::RareLight, Noise::Fireflies, Noise::Coverage})
        for (const bool equal : {true, false})
            for (const int renders : {2, 4, 16}) {
                synthetic::Maker maker(3);
                const Scenario s{noise, equal, 2, noiseOf(noise), 24, 16};
                int means = 0, tiles = 0, pixels = 0, fails = 0;
                for (int i = 0; i < kRepeats; ++i) {
                    stats::Replicates a(s.width, s.height, 1), b(s.width, s.height, 1);
                    for (int r = 0; r < renders; ++r)
                        for (stats::Replicates* side : {&a, &b}) {
                            const Image image = maker.image(s);
                            std::vector<double> values;
                            for (std::size_t p = 0; p < image.pixels.size(); p += image.channels.size())
                                values.push_back(image.pixels[p]);
                            side->add(values);
                        }
                    const stats::GateResult g = stats::gate(a, b);
                    means += g.channels[0].verdict == stats::Verdict::Fail;
                    tiles += g.tiles.rejected > 0;
                    pixels += g.pixels.rejected > 0;
                    fails += g.verdict == stats::Verdict::Fail;
                }
                INFO(nameOf(noise) << ", " << (equal ? "equal" : "unequal") << " pixels, " << renders
                                   << " renders");
                const int too_many = tooMany(kRepeats, 0.001);
                CHECK(means < too_many);
                CHECK(tiles < too_many);
                CHECK(pixels < too_many);
                CHECK(fails < too_many);
            }
}

TEST_CASE("a pixel whose replicates agree exactly by chance is no alarm", "[false-alarms]") {
    // Coins: eight replicates of one sample each agree in one pixel of 128, and B knows the pixel much
    // better.
    const Alarms alarms =
        countAlarms({Noise::Coverage, false, 8, noiseOf(Noise::Coverage), 64, 64}, 60, {}, 16);
    CHECK(alarms.pixels[0] < tooMany(60, 0.05));
    CHECK(alarms.pixels[1] < tooMany(60, 0.001));
}
