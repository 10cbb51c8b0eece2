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

/// How often each kind of test rejects, at two levels. Adjusted p-values below a level are alarms at it.
struct Alarms {
    static constexpr std::array<double, 2> kLevels{0.05, 0.001};
    std::array<int, 2> mean{}, tiles{}, pixels{};
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
        }
        // The figure, the word and the p beside it are one.
        CHECK(n.channels[0].beyondNoise() == (n.channels[0].p < 1 - n.confidence));
        CHECK((n.tiles.rejected > 0) == (n.tiles.smallest_p < n.tiles.alpha));
        CHECK((n.pixels.rejected > 0) == (n.pixels.smallest_p < n.pixels.alpha));
    }
    return alarms;
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
                }
            }
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
                std::array<int, 2> mean{}, tiles{};
                for (int i = 0; i < repeats; ++i) {
                    const Image few = maker.image(s), many = maker.image(s, {}, 16);
                    const NoiseComparison n =
                        better_first ? compareNoise(many, few) : compareNoise(few, many);
                    for (std::size_t l = 0; l < 2; ++l) {
                        mean[l] += n.channels[0].p < Alarms::kLevels[l];
                        tiles[l] += n.tiles.smallest_p < Alarms::kLevels[l];
                    }
                }
                INFO(nameOf(noise) << ", " << (equal ? "equal" : "unequal") << " pixels");
                for (std::size_t l = 0; l < 2; ++l) {
                    CHECK(mean[l] < tooMany(repeats, Alarms::kLevels[l]));
                    CHECK(tiles[l] < tooMany(repeats, Alarms::kLevels[l]));
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
        "| B | noise | pixels | dof | mean 5 %% | tiles 5 %% | pixels 5 %% | mean .1 %% | tiles .1 %% | "
        "pixels .1 %% |\n"
        "|---|---|---|---|---|---|---|---|---|---|\n");
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
                        for (const int count : {a.mean[l], a.tiles[l]})
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
