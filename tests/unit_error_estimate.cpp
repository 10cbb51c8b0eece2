// error_estimate.h: variances against the textbook, intervals against their promised coverage, and the
// replicates of the Sobol sampler, which must be independent sequences.
//
// Over 450 lines: one estimate, asked for bias, coverage and independence with the same noise.
#include "film/error_estimate.h"
#include "film/error_text.h"
#include "kernel_test.h"

#include "catch.h"
#include "cli/progress.h"
#include "kernel/dialect/layout.h"
#include "kernel/sampling/sampler.h"
#include "render/sampling.h"

#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>
#include <set>
#include <vector>

using namespace crt;
using kernel::u32;
using kernel::u64;

namespace {

/// A film for 2^shift replicates, whose last has no separate channel.
FilmShape shapeFor(u32 width, u32 height, u32 shift) {
    const u32 aovs = shift > 0 ? kAovReplicates : kAovSquares;
    return {width, height, channelsFor(aovs, 1u << shift), aovs};
}

void addSample(Film& film, std::size_t pixel, u64 sample, double y) {
    const u32 channels = film.shape().channels, replicates = film.replicates();
    double* pairs = &film.sums[pixel * channels * 2];
    pairs[2] += y;
    if (replicates == 1) pairs[2 * firstChannel(film.shape().aovs, kAovSquares)] += y * y;
    const u32 replicate = static_cast<u32>(sample % replicates);
    if (replicate + 1 < replicates) pairs[2 * (CRT_CHANNELS_BASE + replicate)] += y;
}

/// A film of one row whose pixel p has mean truth[p] and independent normal samples of standard deviation
/// sigma[p].
Film noisyFilm(const std::vector<double>& truth, const std::vector<double>& sigma, std::uint64_t samples,
               std::mt19937_64& random, u32 shift = 4) {
    Film film(shapeFor(static_cast<u32>(truth.size()), 1, shift));
    std::normal_distribution<double> normal;
    for (std::size_t p = 0; p < truth.size(); ++p)
        for (std::uint64_t s = 0; s < samples; ++s)
            addSample(film, p, s, truth[p] + sigma[p] * normal(random));
    film.counts.assign(truth.size(), samples);
    film.samples.add({0, samples});
    return film;
}

double mean(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Root mean square deviation of the film's pixels from the truth, over the film's mean.
double trueRelativeRmse(const Film& film, const std::vector<double>& truth) {
    double squares = 0;
    for (std::uint32_t p = 0; p < truth.size(); ++p) squares += std::pow(film.mean(p, 0, 1) - truth[p], 2);
    return std::sqrt(squares / static_cast<double>(truth.size())) / mean(truth);
}

/// Binomial 99.99 % band about `probability` for `trials`.
bool consistent(int hits, int trials, double probability) {
    return std::abs(hits - trials * probability) < 3.9 * std::sqrt(trials * probability * (1 - probability));
}

}  // namespace

TEST_CASE("the replicates' variance is that of their means, also of the last, which has no channel",
          "[error]") {
    std::mt19937_64 random(1);
    const u32 shift = GENERATE(1u, 2u, 3u, 4u);
    const u32 replicates = 1u << shift;
    const Film film = noisyFilm({2.0}, {0.7}, 1024, random, shift);
    REQUIRE(film.replicates() == replicates);
    std::vector<double> means;
    double sum = 0;
    for (u32 r = 0; r < replicates; ++r) {
        means.push_back(film.replicateSum(0, 0, r) / (1024.0 / replicates));
        sum += film.replicateSum(0, 0, r);
    }
    CHECK(sum == Approx(film.sum(0, 0, 1)).epsilon(1e-14));
    CHECK(LuminanceVariance(film)(0, 0) ==
          Approx(stats::summarize(means).variance / replicates).epsilon(1e-12));
    CHECK(LuminanceVariance(film).degreesOfFreedom() == replicates - 1);
}

TEST_CASE("the last replicate is no rounding beside a bright sample in another", "[error]") {
    Film film(shapeFor(1, 1, 1));
    addSample(film, 0, 0, 0x1p60);
    // Pairs as a backend adds them: the bright one in hi, what it would swallow in lo.
    film.sums[3] += 0.25;
    film.counts = {2};
    film.samples.add({0, 2});
    CHECK(film.replicateSum(0, 0, 1) == 0.25);
}

TEST_CASE("any number of samples is no bias, and neither is a merge of unequal ranges", "[error]") {
    std::mt19937_64 random(2);
    const u32 shift = GENERATE(1u, 4u);
    const std::vector<SampleRange> ranges = GENERATE(
        std::vector<SampleRange>{{0, 33}}, std::vector<SampleRange>{{0, 65}},
        std::vector<SampleRange>{{0, 200}}, std::vector<SampleRange>{{0, 33}, {100, 131}, {1000, 1007}});
    u64 samples = 0;
    for (const auto& [first, end] : ranges) samples += end - first;
    double sum = 0;
    constexpr int kRepeats = 20000;
    std::normal_distribution<double> normal;
    for (int i = 0; i < kRepeats; ++i) {
        Film film(shapeFor(1, 1, shift));
        for (const auto& [first, end] : ranges)
            for (u64 s = first; s < end; ++s) addSample(film, 0, s, 1 + normal(random));
        film.counts = {samples};
        film.samples = SampleRanges(ranges);
        sum += LuminanceVariance(film)(0, 0);
    }
    // Its own relative standard deviation is sqrt(2/(R - 1)): 1 % after 20,000 with two replicates.
    CHECK(sum / kRepeats == Approx(1.0 / static_cast<double>(samples)).epsilon(shift == 1 ? 0.04 : 0.011));
}

TEST_CASE("what replicates cannot tell is not told", "[error]") {
    std::mt19937_64 random(3);
    CHECK_FALSE(estimateError(noisyFilm({1.0}, {0.1}, 1, random, 1)));
    // Even samples alone: one replicate has them all.
    Film one_sided(shapeFor(1, 1, 1));
    for (u64 s = 0; s < 20; s += 2) {
        addSample(one_sided, 0, s, 1 + 0.1 * static_cast<double>(s));
        one_sided.samples.add({s, s + 1});
    }
    one_sided.counts = {10};
    CHECK_FALSE(LuminanceVariance(one_sided).fromReplicates());
    CHECK_FALSE(estimateError(one_sided));
    const Film single = noisyFilm({1.0}, {0.1}, 64, random, 0);
    CHECK(estimateError(single)->knowledge == ErrorKnowledge::Bound);
    CHECK(estimateError(single, PixelSet::All, {.independent = true})->knowledge == ErrorKnowledge::Known);
    CHECK(LuminanceVariance(single).degreesOfFreedom() == 63);
    CHECK(estimateError(noisyFilm({1.0}, {0.1}, 64, random))->knowledge == ErrorKnowledge::Known);
}

TEST_CASE("a pixel that lost samples has no error bar, and the others keep theirs", "[error]") {
    std::mt19937_64 random(4);
    Film film = noisyFilm({1.0, 1.0}, {0.1, 0.1}, 128, random);
    film.counts[1] = 127;
    CHECK(std::isfinite(LuminanceVariance(film)(0, 0)));
    CHECK(std::isinf(LuminanceVariance(film)(1, 0)));
    CHECK(estimateError(film));
}

TEST_CASE("the variance of a variance is measured without bias, for short tails and long ones", "[error]") {
    std::mt19937_64 random(11);
    // Replicates' means of one sample each. Var of k2/R = (k4/R + 2 k2²/(R − 1))/R²: normal k2 = 1, k4 =
    // 0; exponential k2 = 1, k4 = 6.
    const bool exponential = GENERATE(false, true);
    constexpr int kRepeats = 400000;
    double sum = 0;
    std::normal_distribution<double> normal;
    std::exponential_distribution<double> waiting;
    for (int i = 0; i < kRepeats; ++i) {
        Film film(shapeFor(1, 1, 2));
        for (u64 s = 0; s < 4; ++s) addSample(film, 0, s, exponential ? waiting(random) : normal(random));
        film.counts = {4};
        film.samples.add({0, 4});
        sum += LuminanceVariance(film).varianceOfVariance(0, 0) / kRepeats;
    }
    CHECK(sum == Approx(((exponential ? 6.0 : 0.0) / 4 + 2.0 / 3) / 16).epsilon(exponential ? 0.08 : 0.02));
}

namespace {

/// One sample of a pixel: what the intervals must not mistake.
using Draw = std::function<double(std::mt19937_64&, std::size_t)>;

struct Coverage {
    int known = 0, rmse = 0, half_width = 0, mean = 0;
    double ratio = 0;
};

/// Films of `width` × `height` pixels of mean 1 whose pixels' samples are independent draws of variance
/// sigma².
Coverage coverage(u32 width, u32 height, u32 shift, u64 samples, const Draw& draw,
                  const std::vector<double>& sigma, int repeats) {
    std::mt19937_64 random(21);
    double expected = 0;
    for (const double s : sigma)
        expected += s * s / static_cast<double>(samples) / static_cast<double>(sigma.size());
    Coverage c;
    for (int i = 0; i < repeats; ++i) {
        Film film(shapeFor(width, height, shift));
        double squares = 0;
        for (std::size_t p = 0; p < sigma.size(); ++p) {
            for (u64 s = 0; s < samples; ++s) addSample(film, p, s, draw(random, p));
            const double error = film.sum(static_cast<u32>(p % width), static_cast<u32>(p / width), 1) /
                                     static_cast<double>(samples) -
                                 1;
            squares += error * error / static_cast<double>(sigma.size());
        }
        film.counts.assign(sigma.size(), samples);
        film.samples.add({0, samples});
        const std::optional<ErrorEstimate> e = estimateError(film);
        if (!e || !e->known()) continue;
        ++c.known;
        c.rmse += e->relative_rmse_95.contains(std::sqrt(expected));
        c.half_width += std::sqrt(squares) <= e->half_width_95 * e->mean_luminance;
        c.mean += e->meanInterval(0.95).contains(1);
        c.ratio += e->relative_rmse * e->relative_rmse / expected / repeats;
    }
    return c;
}

}  // namespace

TEST_CASE("intervals of normal noise cover what they promise", "[error]") {
    std::normal_distribution<double> normal;
    const auto [width, height, shift, repeats] =
        GENERATE(table<u32, u32, u32, int>({{1, 1, 4, 4000}, {6, 8, 4, 2000}, {32, 32, 1, 1000}}));
    const std::vector<double> sigma(std::size_t{width} * height, 0.1);
    const Coverage c = coverage(
        width, height, shift, 32, [&](std::mt19937_64& r, std::size_t) { return 1 + 0.1 * normal(r); },
        sigma, repeats);
    INFO(width << " x " << height << ": mean " << c.mean << ", rmse " << c.rmse << ", half-width "
               << c.half_width << " of " << repeats);
    CHECK(c.known == repeats);
    CHECK(consistent(c.mean, repeats, 0.95));
    CHECK(c.rmse > 0.93 * repeats);
    CHECK(c.rmse < 0.985 * repeats);
    CHECK(c.half_width > 0.93 * repeats);
    CHECK(c.ratio == Approx(1).epsilon(width == 1 ? 0.05 : 0.03));
}

// An estimate without kurtosis: an interval from the normal distribution covers 28 % here.
TEST_CASE("intervals know long tails", "[error]") {
    // One sample in 500 carries 500 times the light: each pixel sees one in two images of 256 samples.
    constexpr double kChance = 1.0 / 500;
    std::bernoulli_distribution hit(kChance);
    const Draw draw = [&](std::mt19937_64& r, std::size_t) { return hit(r) ? 1 / kChance : 0.0; };
    const std::vector<double> sigma(32 * 32, std::sqrt((1 - kChance) / kChance));
    const Coverage c = coverage(32, 32, 1, 64, draw, sigma, 300);
    INFO("rmse " << c.rmse << ", half-width " << c.half_width << " of 300, known " << c.known);
    CHECK(c.known == 300);
    CHECK(c.rmse >= 0.9 * 300);  // 270 of 300 at 95 %: in one of 8,000 runs.
    CHECK(c.half_width >= 0.9 * 300);
    CHECK(c.ratio == Approx(1).epsilon(0.03));
}

TEST_CASE("an image whose light few paths carry does not know its error yet", "[error]") {
    // One path of a million carries all of the light.
    Film film(shapeFor(64, 64, 1));
    addSample(film, 3333, 5, 1e4);
    film.counts.assign(64 * 64, 256);
    film.samples.add({0, 256});
    const ErrorEstimate e = *estimateError(film);
    CHECK(e.knowledge == ErrorKnowledge::NotYet);
    CHECK(errorText(e) == "error not yet known");
    CHECK_FALSE(reachesTarget(film, 1e9));
}

// Paths from a floor to a glossy ball to a point light: the share of them that is brighter than y falls off
// as y^-1/2, from the brightness of the rest to that of the peak of the ball's lobe. Taken as known, 27 % of
// these images would state an interval that does not hold their error.
TEST_CASE("an image whose brightest paths are not yet met does not know its error", "[error]") {
    constexpr u32 kSide = 32;
    constexpr u64 kSamples = 64;
    constexpr int kImages = 200;
    constexpr double kChance = 0.003, kPeak = 1e5;
    // y = 1/u² for u from kPeak^-1/2 to 1: E[Y] = √kPeak, E[Y²] = ∫ u^-4 du, over that range of u.
    const double least = 1 / std::sqrt(kPeak), range = 1 - least;
    const double mean_y = (1 / least - 1) / range, mean_y2 = (1 / (least * least * least) - 1) / 3 / range;
    const double variance = kChance * mean_y2 - kChance * kChance * mean_y * mean_y;
    const double truth = std::sqrt(variance / static_cast<double>(kSamples)) / (1 + kChance * mean_y);
    std::mt19937_64 random(17);
    std::poisson_distribution<int> paths(kChance * kSide * kSide * kSamples);
    std::uniform_int_distribution<std::size_t> pixel(0, kSide * kSide - 1);
    std::uniform_int_distribution<u64> sample(0, kSamples - 1);
    std::uniform_real_distribution<double> u(least, 1);
    int known = 0, wrong = 0;
    for (int image = 0; image < kImages; ++image) {
        Film film(shapeFor(kSide, kSide, 1));
        for (std::size_t p = 0; p < kSide * kSide; ++p)
            for (u64 s = 0; s < 2; ++s) addSample(film, p, s, kSamples / 2.0);
        for (int n = paths(random); n > 0; --n) {
            const double at = u(random);
            addSample(film, pixel(random), sample(random), 1 / (at * at));
        }
        film.counts.assign(kSide * kSide, kSamples);
        film.samples.add({0, kSamples});
        const std::optional<ErrorEstimate> e = estimateError(film);
        if (!e || !e->known()) continue;
        ++known;
        wrong += !e->relative_rmse_95.contains(truth);
    }
    INFO(known << " of " << kImages << " know their error, " << wrong << " of them wrongly");
    CHECK(wrong <= 0.05 * kImages);
}

// A mirror that sends a small light to a floor. A film shows no trace of such paths before it meets one:
// what the scene may bring decides.
TEST_CASE("an image that has met few of its scene's brightest paths does not know its error", "[error]") {
    constexpr u32 kSide = 40;
    constexpr u64 kSamples = 64;
    constexpr int kImages = 400;
    constexpr double kBrightest = 4000, kNoise = 1;
    std::mt19937_64 random(19);
    std::normal_distribution<double> noise(1, kNoise / std::sqrt(kSamples / 2.0));
    std::uniform_int_distribution<std::size_t> pixel(0, kSide * kSide - 1);
    std::uniform_int_distribution<u64> sample(0, kSamples - 1);
    struct Counts {
        int known = 0, covered = 0, within = 0;
    };
    // Images with this number of those paths on average, estimated with and without the known facts of the
    // scene.
    const auto ask = [&](double expected) {
        std::array<Counts, 2> counts;
        std::poisson_distribution<int> paths(expected);
        const double share = expected / (kSide * kSide * kSamples),
                     truth = std::sqrt((share * kBrightest * kBrightest + kNoise * kNoise) / kSamples) /
                             (1 + share * kBrightest);
        for (int image = 0; image < kImages; ++image) {
            Film film(shapeFor(kSide, kSide, 1));
            for (std::size_t p = 0; p < kSide * kSide; ++p)
                for (u64 s = 0; s < 2; ++s) addSample(film, p, s, kSamples / 2.0 * noise(random));
            for (int n = paths(random); n > 0; --n)
                addSample(film, pixel(random), sample(random), kBrightest);
            film.counts.assign(kSide * kSide, kSamples);
            film.samples.add({0, kSamples});
            for (const bool asks_scene : {false, true}) {
                PathFacts facts;
                if (asks_scene) facts.brightest = {kBrightest, true};
                const ErrorEstimate e = estimateError(film, PixelSet::All, facts).value();
                Counts& c = counts[asks_scene];
                c.known += e.known();
                c.covered += e.known() && e.relative_rmse_95.contains(truth);
                c.within += e.known() && truth <= e.half_width_95;
            }
        }
        return counts;
    };
    const auto [blind, few] = ask(0.5);
    CHECK(blind.known - blind.covered > 0.4 * kImages);  // Those without one, e^-½ of them.
    CHECK(few.known < 0.05 * kImages);                   // P(3 or more) is .014.
    const Counts many = ask(12)[1];
    CHECK(many.known > 0.95 * kImages);  // P(fewer than 3) is 5e-4.
    CHECK(many.covered >= 0.93 * many.known);
    CHECK(many.within >= 0.93 * many.known);
    // Where ordinary paths are as bright, the film has met enough of them.
    const Film quiet = noisyFilm(std::vector<double>(64, 1), std::vector<double>(64, 1), 64, random);
    CHECK(estimateError(quiet, PixelSet::All, {.brightest = {5, false}})->known());
    CHECK(estimateError(quiet, PixelSet::All, {.brightest = {5, true}})->known());
    CHECK_FALSE(estimateError(quiet, PixelSet::All, {.brightest = {500, true}})->known());
}

// The share of paths that is brighter than y falls off as y^-3.2: variances have a mean, and their scatter
// has none. Without what the interval adds for pixels that were not met, 86 % would hold.
TEST_CASE("intervals contain what was not met", "[error]") {
    constexpr u32 kSide = 32;
    constexpr u64 kSamples = 16;
    constexpr int kImages = 400;
    constexpr double kIndex = 3.2, kMean = kIndex / (kIndex - 1), kSquare = kIndex / (kIndex - 2);
    const double truth = std::sqrt((kSquare - kMean * kMean) / static_cast<double>(kSamples)) / kMean;
    std::mt19937_64 random(21);
    std::uniform_real_distribution<double> u(1e-12, 1);
    int covered = 0, known = 0;
    for (int image = 0; image < kImages; ++image) {
        Film film(shapeFor(kSide, kSide, 1));
        for (std::size_t p = 0; p < kSide * kSide; ++p)
            for (u64 s = 0; s < kSamples; ++s) addSample(film, p, s, std::pow(u(random), -1 / kIndex));
        film.counts.assign(kSide * kSide, kSamples);
        film.samples.add({0, kSamples});
        const ErrorEstimate e = estimateError(film, PixelSet::All, {.brightest = {1, false}}).value();
        known += e.known();
        covered += e.known() && truth <= e.relative_rmse_95.upper;
    }
    INFO(covered << " of " << known);
    CHECK(known > 0.95 * kImages);
    CHECK(covered >= 0.93 * known);
}

// An estimate from the differences between neighbours alone never narrows: 6 pixels of different brightness.
TEST_CASE("of one sequence of independent samples an interval narrows with their number", "[error]") {
    const std::vector<double> brightness{0.5, 1, 2, 3, 5, 8};
    constexpr std::size_t kPixels = 40;
    const bool rare = GENERATE(false, true);
    const double squares = rare ? 50 : 2;  // E[Y²]/E[Y]²: of exponential noise, or of one path in fifty.
    std::mt19937_64 random(18);
    std::exponential_distribution<double> waiting;
    std::bernoulli_distribution hit(1 / squares);
    double luminance = 0, variance = 0;
    for (const double b : brightness) {
        luminance += b;
        variance += b * b * (squares - 1);
    }
    const auto estimate = [&](u64 samples) {
        Film film(shapeFor(kPixels, 1, 0));
        for (std::size_t p = 0; p < brightness.size(); ++p)
            for (u64 s = 0; s < samples; ++s)
                addSample(film, 3 * p, s, brightness[p] * (rare ? squares * hit(random) : waiting(random)));
        film.counts.assign(kPixels, samples);
        film.samples.add({0, samples});
        return *estimateError(film, PixelSet::All, {.independent = true});
    };
    constexpr u64 kFew = 2000;
    constexpr int kImages = 200;
    const double truth = std::sqrt(variance / kFew * kPixels) / luminance;
    int covered = 0;
    double width = 0;
    for (int i = 0; i < kImages; ++i) {
        const ErrorEstimate e = estimate(kFew);
        REQUIRE(e.known());
        covered += e.relative_rmse_95.contains(truth);
        width += (e.relative_rmse_95.upper / e.relative_rmse_95.lower - 1) / kImages;
    }
    const ErrorEstimate many = estimate(16 * kFew);
    INFO(covered << " of " << kImages << ", relative width " << width);
    CHECK(covered >= 0.9 * kImages);  // 180 of 200 at 95 %: fewer in one of 400 runs.
    CHECK(width < 1);                 // The differences of six pixels give 1.5.
    CHECK(many.relative_rmse_95.upper / many.relative_rmse_95.lower - 1 == Approx(width / 4).epsilon(0.25));
}

// The set of images with a known error must not depend on the amount of light that they happened to meet: if
// only those with many bright paths have one, they state too much on average: with a least of four degrees
// of freedom 1.12 times the error, where three paths an image are expected.
TEST_CASE("images that know their error are not a lucky choice", "[error]") {
    const double expected_paths = GENERATE(3, 4, 6);
    constexpr std::size_t kPixels = 32 * 32;
    constexpr int kImages = 2000;
    // A floor of luminance 1, and paths a thousand times as bright somewhere.
    constexpr double kBright = 1000;
    constexpr std::uint64_t kSamples = 32;
    const double chance = expected_paths / (kPixels * kSamples);
    const double truth = kBright * std::sqrt(chance * (1 - chance) / kSamples) / (1 + chance * kBright);
    std::mt19937_64 random(11);
    std::poisson_distribution<int> paths(expected_paths);
    std::uniform_int_distribution<std::size_t> pixel(0, kPixels - 1);
    std::uniform_int_distribution<std::uint64_t> sample(0, kSamples - 1);
    int known = 0, covered = 0;
    double stated = 0;
    for (int image = 0; image < kImages; ++image) {
        Film film(shapeFor(32, 32, 1));
        for (std::size_t p = 0; p < kPixels; ++p)
            for (std::uint64_t s = 0; s < film.replicates(); ++s)
                addSample(film, p, s, static_cast<double>(kSamples) / film.replicates());
        for (int n = paths(random); n > 0; --n) addSample(film, pixel(random), sample(random), kBright);
        film.counts.assign(kPixels, kSamples);
        film.samples.add({0, kSamples});
        const std::optional<ErrorEstimate> e = estimateError(film);
        if (!e || !e->known() || e->relative_rmse == 0) continue;  // Zero: no bright path was met.
        ++known;
        stated += e->relative_rmse / truth;
        covered += e->relative_rmse_95.contains(truth);
    }
    INFO(expected_paths << " paths: " << known << " of " << kImages << " know, covered " << covered
                        << ", stated : true " << stated / known);
    CHECK(covered > 0.93 * known);
    CHECK(stated / known > 0.9);
    CHECK(stated / known < 1.1);
}

// Found by fuzzing: the squares of variances left the range of doubles, and the degrees of freedom were no
// number.
TEST_CASE("the relative error does not depend on the unit of radiance", "[error]") {
    std::mt19937_64 random(5);
    const u32 shift = GENERATE(1u, 4u);
    std::vector<double> truth(40, 2.0), sigma(40, 0.5);
    sigma[3] = 2;
    const Film film = noisyFilm(truth, sigma, 64, random, shift);
    const std::optional<ErrorEstimate> expected = estimateError(film);
    REQUIRE(expected);
    for (const int exponent : {-400, -200, 200, 400}) {
        CAPTURE(exponent);
        Film scaled = film;
        for (double& sum : scaled.sums) sum = std::ldexp(sum, exponent);
        const std::optional<ErrorEstimate> error = estimateError(scaled);
        REQUIRE(error);
        CHECK(error->relative_rmse == expected->relative_rmse);
        CHECK(error->degrees_of_freedom == Approx(expected->degrees_of_freedom).epsilon(1e-9));
        CHECK(error->half_width_95 == Approx(expected->half_width_95).epsilon(1e-9));
    }
}

TEST_CASE("for one pixel the half-width is Student's", "[error]") {
    std::mt19937_64 random(6);
    const Film film = noisyFilm({3.0}, {0.5}, 1024, random);
    const ErrorEstimate e = *estimateError(film);
    const stats::Interval mean = e.meanInterval(0.95);
    CHECK(e.half_width_95 * e.mean_luminance == Approx(mean.halfWidth()).epsilon(1e-9));
}

TEST_CASE("a forecast is an interval, from 1/N at its lower end to 1/sqrt N at its upper one", "[error]") {
    ErrorEstimate e;
    e.knowledge = ErrorKnowledge::Known;
    e.relative_rmse = 0.02;
    e.half_width_95 = 0.03;
    e.relative_rmse_95 = {0.018, 0.022};
    const stats::Interval samples = e.samplesFor(0.01, 100);
    CHECK(samples.lower == Approx(270));  // 0.018 · 1.5 = 2.7 targets
    CHECK(samples.upper == Approx(100 * 3.3 * 3.3));
    CHECK(e.samplesFor(1, 100).upper == 100);  // It is there.
}

TEST_CASE("no forecast jumps by more than its interval while an image converges", "[error]") {
    // Noise of independent samples, which is the slowest that is forecast: each forecast must meet all that
    // come after it.
    std::mt19937_64 random(12);
    std::exponential_distribution<double> waiting;
    Film film(shapeFor(32, 32, 1));
    u64 there = 0;
    double lower = 0, upper = std::numeric_limits<double>::infinity();
    for (const u64 samples : {32, 40, 64, 65, 100, 128, 129, 200, 256, 300, 512, 513}) {
        for (std::size_t p = 0; p < 32 * 32; ++p)
            for (u64 s = there; s < samples; ++s) addSample(film, p, s, waiting(random));
        there = samples;
        film.counts.assign(32 * 32, samples);
        film.samples = SampleRanges({{0, samples}});
        const stats::Interval needed = estimateError(film)->samplesFor(0.01, static_cast<double>(samples));
        INFO(samples << " samples: " << needed.lower << " to " << needed.upper);
        CHECK(needed.lower <= upper);
        CHECK(needed.upper >= lower);
        lower = std::max(lower, needed.lower);
        upper = std::min(upper, needed.upper);
    }
}

TEST_CASE("target checks are at powers of two, after a million paths", "[error]") {
    constexpr u64 kMillion = 1u << 20;
    CHECK(nextTargetCheck(0, kMillion) == 64);
    CHECK(nextTargetCheck(63, kMillion) == 64);
    CHECK(nextTargetCheck(64, kMillion) == 128);
    CHECK(nextTargetCheck(257, kMillion) == 512);
    CHECK(nextTargetCheck(1024, kMillion) == 2048);
    CHECK(nextTargetCheck(0, 64 * 64) == 256);
    CHECK(nextTargetCheck(256, 64 * 64) == 512);
    CHECK(nextTargetCheck(0, 100 * 100) == 128);
    CHECK(nextTargetCheck(0, 1) == kMillion);
}

TEST_CASE("who stops when the target is reached has reached it, also where luck could stop early",
          "[error]") {
    // One pixel with sixteen replicates: looked at at every power of two, it must not stop at the luckiest.
    std::mt19937_64 random(7);
    constexpr double kTruth = 1.0, kTarget = 0.01;
    constexpr int kRepeats = 2000;
    int missed = 0, by_far = 0;
    for (int i = 0; i < kRepeats; ++i) {
        const double sigma =
            0.3 * std::pow(0.8 / 0.3, static_cast<double>(i) /
                                          kRepeats);  // 3,500 to 25,000 independent samples would do.
        Film film(shapeFor(1, 1, 4));
        std::normal_distribution<double> normal;
        for (std::uint64_t check = 64; film.samples.count() < check; check *= 2) {
            const double each = static_cast<double>(check - film.samples.count()) /
                                16;  // Of a replicate, together; Y² is not looked at.
            for (u64 r = 0; r < 16; ++r)
                addSample(film, 0, r, each * kTruth + std::sqrt(each) * sigma * normal(random));
            film.counts[0] = check;
            film.samples.add({film.samples.count(), check});
            if (reachesTarget(film, kTarget)) break;
        }
        const double error = std::abs(film.mean(0, 0, 1) / kTruth - 1);
        missed += error > kTarget;
        by_far += error > 2 * kTarget;
    }
    INFO(missed << " of " << kRepeats << " images that stopped are worse than they say, " << by_far
                << " by far");
    CHECK(missed <= 0.06 * kRepeats);
    CHECK(by_far <= 8);
    CHECK(reachesTarget(noisyFilm({1.0}, {1e-6}, 64, random), kTarget));
}

TEST_CASE("odd pixels veto what even ones would have stopped at", "[error]") {
    // Even pixels are exact; odd ones have not been met by their light but in a few places.
    Film film(shapeFor(32, 32, 1));
    std::mt19937_64 random(9);
    std::normal_distribution<double> normal;
    for (u32 y = 0; y < 32; ++y)
        for (u32 x = 0; x < 32; ++x)
            for (u64 s = 0; s < 64; ++s)
                addSample(film, y * 32 + x, s, 1 + ((x + y) % 2 == 0 ? 1e-3 : 0.3) * normal(random));
    film.counts.assign(32 * 32, 64);
    film.samples.add({0, 64});
    const auto half_width = [&](PixelSet which) { return estimateError(film, which)->half_width_95; };
    CHECK(half_width(PixelSet::Even) < 0.001);
    CHECK(half_width(PixelSet::Odd) > 0.03);
    CHECK(half_width(PixelSet::All) < 0.031);
    CHECK_FALSE(reachesTarget(film, 0.031));
    CHECK(reachesTarget(film, 0.05));
}

TEST_CASE("every sample belongs to one replicate, and takes the next place in it", "[error][sampler]") {
    const u32 shift = GENERATE(1u, 4u);
    const u32 replicates = 1u << shift;
    Film film(shapeFor(1, 1, shift));
    std::vector<u64> next(replicates, 0);
    for (u64 s = 0; s < 5000; ++s) {
        const u32 r = kernel::crt_replicate(s, shift);
        REQUIRE(kernel::crt_index_in_replicate(s, shift) == next[r]++);
    }
    film.samples.add({0, 5000});
    for (u32 r = 0; r < replicates; ++r) CHECK(film.replicateSamples(r) == next[r]);
    // Also of a part, as a merge of two halves sees it.
    Film part(shapeFor(1, 1, shift));
    part.samples.add({1501, 3334});
    std::vector<u64> in_part(replicates, 0);
    for (u64 s = 1501; s < 3334; ++s) ++in_part[kernel::crt_replicate(s, shift)];
    for (u32 r = 0; r < replicates; ++r) CHECK(part.replicateSamples(r) == in_part[r]);
}

TEST_CASE("each replicate is a scrambled Sobol sequence, and no two are alike", "[error][sampler]") {
    constexpr u32 kDimension = 5, kPoints = 64, kShift = 4;
    std::set<std::vector<std::uint32_t>> sequences;
    for (u32 r = 0; r < 1u << kShift; ++r) {
        std::vector<std::uint32_t> strata_x(kPoints), strata_y(kPoints), order;
        for (u64 i = 0; i < kPoints; ++i) {
            kernel::CrtSampler s = kernel::crt_sampler_begin(CRT_SAMPLER_SOBOL, kShift,
                                                             kernel::crt_seed(7, 0), 3, (i << kShift) + r);
            const kernel::CrtRandom2 u = kernel::crt_sample_2d(&s, kDimension);
            ++strata_x[static_cast<std::size_t>(u.x * kPoints)];
            ++strata_y[static_cast<std::size_t>(u.y * kPoints)];
            order.push_back(static_cast<std::uint32_t>(u.x * 4096));
        }
        // A (0, 6, 2)-net: one point in each of the 64 columns, and in each of the 64 rows.
        CHECK(strata_x == std::vector<std::uint32_t>(kPoints, 1));
        CHECK(strata_y == std::vector<std::uint32_t>(kPoints, 1));
        CHECK(sequences.insert(order).second);
    }
}

TEST_CASE("replicates are independent: their means scatter as the variance of one says",
          "[error][sampler]") {
    // Mean of a smooth function over 64 points of each replicate. If replicates were stratified against each
    // other, the mean of all would scatter less than the spread between them claims; if they shared numbers,
    // more.
    double claimed = 0, squares = 0;
    constexpr int kPixels = 600;
    constexpr u32 kShift = 4, kReplicates = 1u << kShift, kPoints = 64;
    for (u32 pixel = 0; pixel < kPixels; ++pixel) {
        std::array<double, kReplicates> means{};
        for (u64 s = 0; s < kPoints * kReplicates; ++s) {
            kernel::CrtSampler sampler =
                kernel::crt_sampler_begin(CRT_SAMPLER_SOBOL, kShift, kernel::crt_seed(1, 0), pixel, s);
            const kernel::CrtRandom2 u = kernel::crt_sample_2d(&sampler, 4);
            means[kernel::crt_replicate(s, kShift)] +=
                static_cast<double>(u.x) * static_cast<double>(u.y) / kPoints;
        }
        const stats::Summary summary = stats::summarize(means);
        claimed += summary.variance / kReplicates / kPixels;
        squares += std::pow(summary.mean - 0.25, 2) / kPixels;
    }
    // Relative standard deviation of `squares`: sqrt(2/600) = 5.8 %.
    CHECK(squares == Approx(claimed).epsilon(0.23));
}
