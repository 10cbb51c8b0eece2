// The gate by simulation: what is equal passes, a bias in the mean, in one tile and in one pixel is found,
// fireflies are not judged.
#include "judge/stats/image_tests.h"

#include "base/error.h"
#include "catch.h"

#include <cmath>
#include <limits>
#include <random>

using namespace crt::stats;

namespace {

constexpr std::uint32_t kWidth = 20, kHeight = 12,
                        kChannels = 3;  // Three by two tiles, those at the border smaller.
constexpr std::size_t kValues = std::size_t{kWidth} * kHeight * kChannels;

class Random {
public:
    explicit Random(std::uint64_t seed) : bits_(seed) {}
    double exponential() { return -std::log((static_cast<double>(bits_() >> 11) + 0.5) * 0x1p-53); }

private:
    std::mt19937_64 bits_;
};

/// Place and size of an estimator's error.
struct Bias {
    std::uint32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
    double factor = 1;
};

/// Sixteen images whose pixels have mean x + 1 and are as skewed as path tracing: sums of `paths`
/// exponential values. Channels share their noise.
Replicates simulate(Random& random, int paths, const Bias& bias = {}) {
    Replicates replicates(kWidth, kHeight, kChannels);
    for (int r = 0; r < 16; ++r) {
        std::vector<double> image;
        for (std::uint32_t y = 0; y < kHeight; ++y)
            for (std::uint32_t x = 0; x < kWidth; ++x) {
                double sum = 0;
                for (int i = 0; i < paths; ++i) sum += random.exponential();
                const bool inside = x >= bias.x0 && x < bias.x1 && y >= bias.y0 && y < bias.y1;
                for (std::uint32_t c = 0; c < kChannels; ++c)
                    image.push_back((x + 1) * sum / paths * (inside ? bias.factor : 1) * (c + 1));
            }
        replicates.add(image);
    }
    return replicates;
}

}  // namespace

TEST_CASE("means and moments of replicates are those of all their values", "[image-tests]") {
    Replicates replicates(9, 9, 1);
    for (const double level : {1.0, 3.0, 8.0}) {
        std::vector<double> image(81, level);
        image[80] = 10 * level;  // The last pixel is a separate tile.
        replicates.add(image);
    }
    CHECK(replicates.tilesAcross() == 2);
    CHECK(replicates.imageMean(0).mean == Approx(4.0 * 90 / 81));
    CHECK(replicates.tileMean(0, 0).mean == 4.0);
    CHECK(replicates.tileMean(0, 0).variance == Approx(13.0));
    CHECK(replicates.tileMean(3, 0).mean == 40.0);
    CHECK(replicates.pixel(80, 0).mean == Approx(40.0));
    CHECK(replicates.pixel(80, 0).variance == Approx(1300.0));
    CHECK(replicates.pixel(79, 0).variance == Approx(13.0));
    // Deviations −3, −1, 4, and ten times that in one pixel.
    CHECK(replicates.largestValue().share == Approx(1600.0 / (26 * 80 + 2600)));
    // 16/26 of its own pixel's, as two thirds at most: t(1) = √(3 · 16/26 / (2 − 3 · 16/26))
    // = 3.464, P =
    // .179.
    CHECK(replicates.largestValue().normal_p == Approx(std::min(1.0, 3 * 0.1789)).epsilon(1e-3));
    CHECK_THROWS_AS(replicates.add(std::vector<double>(80)), crt::Error);
}

TEST_CASE("the P of equality: rounding is none, a difference without noise is certain", "[image-tests]") {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    CHECK(equalityP({1, 0, 15}, {1 + 0x1p-21, 0, 15}) == 1.0);
    CHECK(equalityP({1, 0, 15}, {1.01, 0, 15}) == 0.0);
    CHECK(equalityP({0, 0, 15}, {0, 0, 15}) == 1.0);
    CHECK(equalityP({1, 0.5, infinity}, {3, 0.5, infinity}) == Approx(normalTwoSided(2)));
    CHECK(equalityP({1, 0.5, 15}, {3, 0.5, 15}) == Approx(studentTwoSided(2, 30)));
    CHECK(std::isnan(equalityP({1, infinity, 15}, {3, 0.5, 15})));
}

TEST_CASE("families of tests count how many they are", "[image-tests]") {
    const std::vector<double> p{0.2, 0.009, 0.6, 0.0005};
    CHECK(holmFamily(p, 0.05).rejected == 2);
    CHECK(holmFamily(p, 0.05).smallest_p == Approx(0.002));
    CHECK(holmFamily(p, 0.05).worst == 3);
    CHECK(sidakFamily(p, 0.05).rejected == 2);
    CHECK(sidakFamily(p, 0.01).rejected == 1);
    CHECK(sidakFamily(p, 0.05).smallest_p == Approx(1 - std::pow(1 - 0.0005, 4)));
    CHECK(sidakFamily({}, 0.05).rejected == 0);
    CHECK(std::isnan(
        holmFamily(std::vector<double>{0.5, std::numeric_limits<double>::quiet_NaN()}, 0.05).smallest_p));
}

TEST_CASE("what is equal passes, and raises false alarms no more often than allowed", "[image-tests]") {
    Random random(1);
    GateOptions options;
    options.delta = 0.05;
    options.confidence = 0.95;  // A tenth of alarms among three families would show.
    constexpr int repeats = 300;
    int passes = 0, fails = 0, tile_alarms = 0, pixel_alarms = 0;
    for (int i = 0; i < repeats; ++i) {
        const GateResult r = gate(simulate(random, 8), simulate(random, 8), options);
        passes += r.verdict == Verdict::Pass;
        fails += r.verdict == Verdict::Fail;
        tile_alarms += r.tiles.rejected > 0;
        pixel_alarms += r.pixels.rejected > 0;
    }
    // alpha is 5 % a family, less for channels with common noise; four deviations of the binomial count
    // above it.
    const double most = repeats * 0.05 + 4 * std::sqrt(repeats * 0.05 * 0.95);
    INFO(passes << " pass, " << fails << " fail, alarms of tiles " << tile_alarms << ", of pixels "
                << pixel_alarms);
    CHECK(tile_alarms < most);
    CHECK(pixel_alarms < most);
    CHECK(fails == Approx(tile_alarms + pixel_alarms).margin(5));
    CHECK(passes > 0.9 * repeats);
}

TEST_CASE("a bias of the mean, of one tile, of one pixel is found where it is", "[image-tests]") {
    Random random(2);
    const Replicates fair = simulate(random, 64);
    const GateResult mean = gate(simulate(random, 64, {0, 0, kWidth, kHeight, 1.03}), fair);
    CHECK(mean.verdict == Verdict::Fail);
    CHECK(mean.channels[1].verdict == Verdict::Fail);
    CHECK(mean.channels[1].relative_interval.contains(0.03));

    GateOptions loose;
    loose.delta = 0.05;  // The mean alone would pass.
    const GateResult tile = gate(simulate(random, 64, {8, 0, 16, 8, 1.05}), fair, loose);
    CHECK(tile.verdict == Verdict::Fail);
    CHECK(tile.channels[1].verdict == Verdict::Pass);
    CHECK(tile.tiles.rejected == 3);
    CHECK(tile.tiles.worst / kChannels == 1);

    const GateResult pixel = gate(simulate(random, 64, {3, 9, 4, 10, 1.5}), fair, loose);
    CHECK(pixel.verdict == Verdict::Fail);
    CHECK(pixel.pixels.rejected == 3);
    CHECK(pixel.pixels.worst / kChannels == 9 * kWidth + 3);
}

TEST_CASE("too few samples are inconclusive, and so is what one value decides, and what is no number",
          "[image-tests]") {
    Random random(3);
    GateOptions strict;
    strict.delta = 1e-3;
    const GateResult few = gate(simulate(random, 4), simulate(random, 4), strict);
    CHECK(few.verdict == Verdict::Inconclusive);
    REQUIRE_FALSE(few.reasons.empty());

    Replicates firefly = simulate(random, 64);
    std::vector<double> image(kValues, 1.0);
    image[100] = 1e6;
    firefly.add(image);
    GateOptions any_mean;
    any_mean.delta = 1e9;  // The means would pass: it is the one value alone that counts here.
    const GateResult one = gate(firefly, simulate(random, 64), any_mean);
    CHECK(one.largest.share > 0.9);
    CHECK(one.largest.isHeavyTailed(0.05));
    CHECK(one.verdict == Verdict::Inconclusive);

    image[100] = std::numeric_limits<double>::quiet_NaN();
    Replicates broken = simulate(random, 64);
    broken.add(image);
    const GateResult none = gate(broken, simulate(random, 64), {});
    CHECK(none.not_finite == 1);
    CHECK(none.verdict == Verdict::Inconclusive);
    CHECK_THROWS_AS(gate(broken, Replicates(kWidth, kHeight, 1)), crt::Error);
}

TEST_CASE("in few lit pixels normal noise is no heavy tail, and a firefly is one", "[image-tests]") {
    // By 1, 2 or 6 pixels of 4, 8 or 16 normal values, one value always carries more than 5 % of the
    // squares.
    std::mt19937_64 engine(11);
    std::normal_distribution<double> normal;
    constexpr int kRepeats = 300;
    for (const std::uint32_t pixels : {1u, 2u, 6u})
        for (const int renders : {4, 8, 16}) {
            int alarms = 0, found = 0, large = 0;
            for (int i = 0; i < kRepeats; ++i) {
                Replicates usual(pixels, 1, 1), firefly(pixels, 1, 1);
                for (int r = 0; r < renders; ++r) {
                    std::vector<double> image;
                    for (std::uint32_t p = 0; p < pixels; ++p)
                        image.push_back(p + 1 + 0.01 * normal(engine));
                    usual.add(image);
                    if (r == 0) image[0] += 1;
                    firefly.add(image);
                }
                large += usual.largestValue().share > 0.05;
                alarms += usual.largestValue().isHeavyTailed(0.05);
                found += firefly.largestValue().isHeavyTailed(0.05);
            }
            INFO(pixels << " pixels, " << renders << " renders: " << alarms << " and " << found);
            CHECK(large > 0.9 * kRepeats);
            CHECK(alarms <= 11);  // Of 300 at 1 %, more are a chance of 1 in 10,000.
            // Of four values the largest carries up to three quarters whatever happens: they see less.
            CHECK(found == kRepeats);
        }
}

TEST_CASE("heavy tails protect no bias of which the ranks are sure", "[image-tests]") {
    Random random(12);
    const auto withFirefly = [&](double factor) {
        Replicates replicates(kWidth, kHeight, kChannels);
        for (int r = 0; r < 16; ++r) {
            std::vector<double> image;
            for (std::size_t i = 0; i < kValues; ++i)
                image.push_back(factor * (1 + 0.1 * random.exponential()));
            if (r == 0) image[100] = 1e3;
            replicates.add(image);
        }
        return replicates;
    };
    const Replicates fair = withFirefly(1);
    const GateResult same = gate(withFirefly(1), fair), bright = gate(withFirefly(1.5), fair),
                     dark = gate(withFirefly(0.5), fair);
    for (const GateResult* result : {&same, &bright, &dark}) CHECK(result->largest.isHeavyTailed(0.05));
    CHECK(same.verdict == Verdict::Inconclusive);
    CHECK(bright.channels[0].separated);
    CHECK(bright.verdict == Verdict::Fail);
}

TEST_CASE("black is equal to black alone", "[image-tests]") {
    Replicates black(8, 8, 1), grey(8, 8, 1);
    for (int r = 0; r < 4; ++r) {
        black.add(std::vector<double>(64, 0.0));
        grey.add(std::vector<double>(64, 0.5));
    }
    CHECK(gate(black, black).verdict == Verdict::Pass);
    CHECK(gate(grey, grey).verdict == Verdict::Pass);
    CHECK(gate(grey, black).verdict == Verdict::Fail);
    CHECK(gate(black, grey).verdict == Verdict::Fail);
}
