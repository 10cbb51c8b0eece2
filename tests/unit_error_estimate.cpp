// error_estimate.h: variances against the textbook, intervals against their promised coverage, and the replicates of the Sobol sampler, which must be
// sequences of their own.
#include "error_estimate.h"
#include "kernel_test.h"

#include "catch.h"
#include "kernel/layout.h"
#include "kernel/sampler.h"
#include "sampling.h"

#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <set>
#include <vector>

using namespace crt;
using kernel::u32;
using kernel::u64;

namespace {

constexpr std::uint32_t kChannels = CRT_CHANNELS_BASE + CRT_REPLICATES;

/// A film of one row whose pixel p has mean truth[p] and independent normal samples of standard deviation sigma[p].
Film noisyFilm(const std::vector<double>& truth, const std::vector<double>& sigma, std::uint64_t samples, std::mt19937_64& random) {
    Film film({static_cast<std::uint32_t>(truth.size()), 1, kChannels, kAovReplicates});
    std::normal_distribution<double> normal;
    for (std::size_t p = 0; p < truth.size(); ++p)
        for (std::uint64_t s = 0; s < samples; ++s) {
            const double y = truth[p] + sigma[p] * normal(random);
            double* pairs = &film.sums[p * kChannels * 2];
            pairs[2] += y;
            pairs[6] += y * y;
            pairs[2 * (CRT_CHANNELS_BASE + kernel::crt_replicate(s))] += y;
        }
    film.counts.assign(truth.size(), samples);
    film.samples.add({0, samples});
    return film;
}

double mean(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size()); }

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

TEST_CASE("the replicates' variance is that of their means", "[error]") {
    std::mt19937_64 random(1);
    const Film film = noisyFilm({2.0}, {0.7}, 1024, random);
    std::array<double, CRT_REPLICATES> means{};
    for (u32 r = 0; r < CRT_REPLICATES; ++r) means[r] = film.replicateSum(0, 0, r) / 64;
    const stats::Summary all = stats::summarize(means);
    CHECK(LuminanceVariance(film)(0, 0) == Approx(all.variance / 16).epsilon(1e-12));
    CHECK(LuminanceVariance(film).degreesOfFreedom() == 15);

    // Half of them: 8 tell the variance of one replicate, and the film's mean is of 16.
    std::array<double, 8> even{}, odd{};
    for (u32 r = 0; r < 16; ++r) (r % 2 == 0 ? even : odd)[r / 2] = means[r];
    CHECK(LuminanceVariance(film, ReplicateSet::Even)(0, 0) == Approx(stats::summarize(even).variance / 16).epsilon(1e-12));
    CHECK(LuminanceVariance(film, ReplicateSet::Odd)(0, 0) == Approx(stats::summarize(odd).variance / 16).epsilon(1e-12));
    CHECK(LuminanceVariance(film, ReplicateSet::Odd).degreesOfFreedom() == 7);
}

TEST_CASE("a number of samples that is no multiple of the blocks is no bias", "[error]") {
    // 200 samples: three replicates with 64 and one with 8. Expected variance of the mean: sigma^2/200.
    std::mt19937_64 random(2);
    double sum = 0;
    constexpr int kRepeats = 20000;
    for (int i = 0; i < kRepeats; ++i) sum += LuminanceVariance(noisyFilm({1.0}, {1.0}, 200, random))(0, 0);
    // Its own relative standard deviation is sqrt(2/3): 0.58 % after 20,000.
    CHECK(sum / kRepeats == Approx(1.0 / 200).epsilon(0.023));
}

TEST_CASE("fewer samples than replicates: those that are there speak", "[error]") {
    std::mt19937_64 random(3);
    CHECK_FALSE(estimateError(noisyFilm({1.0}, {0.1}, 1, random)));
    const Film one_block = noisyFilm({1.0}, {0.1}, 64, random);
    CHECK(estimateError(one_block)->is_bound);
    CHECK_FALSE(estimateError(one_block, ReplicateSet::All, true)->is_bound);
    CHECK(LuminanceVariance(one_block).degreesOfFreedom() == 63);
    const Film five = noisyFilm({1.0}, {0.1}, 5 * 64, random);
    CHECK_FALSE(estimateError(five)->is_bound);
    CHECK(LuminanceVariance(five).degreesOfFreedom() == 4);
    CHECK(LuminanceVariance(five, ReplicateSet::Odd).degreesOfFreedom() == 1);
    CHECK(std::isfinite(LuminanceVariance(five)(0, 0)));
}

TEST_CASE("a pixel that lost samples has no error bar, and the others keep theirs", "[error]") {
    std::mt19937_64 random(4);
    Film film = noisyFilm({1.0, 1.0}, {0.1, 0.1}, 128, random);
    film.counts[1] = 127;
    CHECK(std::isfinite(LuminanceVariance(film)(0, 0)));
    CHECK(std::isinf(LuminanceVariance(film)(1, 0)));
    CHECK(estimateError(film));
}

TEST_CASE("intervals cover what they promise", "[error]") {
    std::mt19937_64 random(5);
    const auto scene = GENERATE(as<std::vector<double>>{}, std::vector<double>{0.5}, std::vector<double>{0.1, 0.2, 0.1, 0.9},
                                std::vector<double>(48, 0.4));
    const std::vector<double> truth(scene.size(), 3.0);
    constexpr int kRepeats = 4000;
    int mean_covered = 0, rmse_covered = 0, within_half_width = 0;
    double expected_mse = 0;
    for (const double s : scene) expected_mse += s * s / 1024 / static_cast<double>(scene.size());
    for (int i = 0; i < kRepeats; ++i) {
        const Film film = noisyFilm(truth, scene, 1024, random);
        const ErrorEstimate e = *estimateError(film);
        mean_covered += e.meanInterval(0.95).contains(3.0);
        rmse_covered += e.relative_rmse_95.contains(std::sqrt(expected_mse) / 3);
        within_half_width += trueRelativeRmse(film, truth) <= e.half_width_95;
    }
    INFO("pixels " << scene.size() << ": mean " << mean_covered << ", rmse " << rmse_covered << ", half-width " << within_half_width);
    if (scene.size() != 4) {
        // Equal variances: Satterthwaite's approximation is exact but for estimating the number of equivalent pixels.
        CHECK(consistent(mean_covered, kRepeats, 0.95));
        CHECK(consistent(rmse_covered, kRepeats, 0.95));
        CHECK(consistent(within_half_width, kRepeats, 0.95));
    } else {
        // One of four pixels carries 93 % of the variance. Satterthwaite's formula, its weights being estimates, then promises some points more than
        // it keeps; no interval may lose more than 3.
        CHECK(mean_covered > 0.92 * kRepeats);
        CHECK(rmse_covered > 0.92 * kRepeats);
        CHECK(within_half_width > 0.92 * kRepeats);
    }
}

// Found by fuzzing: the squares of variances left the range of doubles, and the degrees of freedom were no number.
TEST_CASE("the relative error does not depend on the unit of radiance", "[error]") {
    std::mt19937_64 random(5);
    const Film film = noisyFilm({1, 2, 3}, {0.5, 0.1, 2}, 64, random);
    const std::optional<ErrorEstimate> expected = estimateError(film);
    REQUIRE(expected);
    for (const int exponent : {-400, -200, 200, 400}) {
        CAPTURE(exponent);
        Film scaled = film;
        for (std::size_t i = 0; i < scaled.sums.size(); ++i) {
            const bool is_of_squares = i / 2 % kChannels == 3;
            scaled.sums[i] = std::ldexp(scaled.sums[i], is_of_squares ? 2 * exponent : exponent);
        }
        const std::optional<ErrorEstimate> error = estimateError(scaled);
        REQUIRE(error);
        CHECK(error->relative_rmse == expected->relative_rmse);
        CHECK(error->degrees_of_freedom == expected->degrees_of_freedom);
        CHECK(error->half_width_95 == expected->half_width_95);
    }
}

TEST_CASE("for one pixel the half-width is Student's", "[error]") {
    std::mt19937_64 random(6);
    const Film film = noisyFilm({3.0}, {0.5}, 1024, random);
    const ErrorEstimate e = *estimateError(film);
    const stats::Interval mean = e.meanInterval(0.95);
    CHECK(e.half_width_95 * e.mean_luminance == Approx(mean.halfWidth()).epsilon(1e-9));
    CHECK(e.samplesFor(e.half_width_95 / 2, 1024) == Approx(4096));
}

TEST_CASE("target checks are at powers of two, two even and two odd replicates at least", "[error]") {
    CHECK(nextTargetCheck(0) == 256);
    CHECK(nextTargetCheck(255) == 256);
    CHECK(nextTargetCheck(256) == 512);
    CHECK(nextTargetCheck(257) == 512);
    CHECK(nextTargetCheck(1023) == 1024);
    CHECK(nextTargetCheck(1024) == 2048);
}

TEST_CASE("who stops when the target is reached has reached it, also where luck could stop early", "[error]") {
    // One pixel, whose two even replicates of 256 samples have one degree of freedom: they agree by chance often enough that, were they believed, 1.2 % of
    // all images would stop with more than twice the error (this simulation says so), against 0.07 %. Many pixels are not all lucky at once.
    std::mt19937_64 random(7);
    constexpr double kTruth = 1.0, kTarget = 0.01;
    constexpr int kRepeats = 2000;
    int missed = 0, by_far = 0;
    for (int i = 0; i < kRepeats; ++i) {
        const double sigma = 0.3 * std::pow(0.8 / 0.3, static_cast<double>(i) / kRepeats);  // 3,500 to 25,000 independent samples would do.
        Film film({1, 1, kChannels, kAovReplicates});
        std::normal_distribution<double> normal;
        for (std::uint64_t check = nextTargetCheck(0); film.samples.count() < check; check = nextTargetCheck(check)) {
            for (std::uint64_t s = film.samples.count(); s < check; s += CRT_REPLICATE_BLOCK) {  // A block at a time; nobody looks at Y².
                const double y = CRT_REPLICATE_BLOCK * kTruth + std::sqrt(CRT_REPLICATE_BLOCK) * sigma * normal(random);
                film.sums[2] += y;
                film.sums[2 * (CRT_CHANNELS_BASE + kernel::crt_replicate(s))] += y;
            }
            film.counts[0] = check;
            film.samples.add({film.samples.count(), check});
            if (reachesTarget(film, kTarget)) break;
        }
        const double error = std::abs(film.mean(0, 0, 1) / kTruth - 1);
        missed += error > kTarget;
        by_far += error > 2 * kTarget;
    }
    INFO(missed << " of " << kRepeats << " images that stopped are worse than they say, " << by_far << " by far");
    CHECK(missed <= 0.05 * kRepeats);
    CHECK(by_far <= 8);  // Poisson: of 1.4 expected, one in 10⁵; of 23, likewise.

    CHECK_FALSE(reachesTarget(noisyFilm({1.0}, {1e-6}, 256, random), kTarget));
    CHECK(reachesTarget(noisyFilm({1.0}, {1e-6}, 1024, random), kTarget));
    CHECK(reachesTarget(noisyFilm(std::vector<double>(64, 1.0), std::vector<double>(64, 1e-3), 256, random), kTarget));
}

TEST_CASE("every sample belongs to one replicate, and takes the next place in it", "[error][sampler]") {
    Film film({1, 1, kChannels, kAovReplicates});
    std::array<u64, CRT_REPLICATES> next{};
    for (u64 s = 0; s < 5000; ++s) {
        const u32 r = kernel::crt_replicate(s);
        REQUIRE(kernel::crt_index_in_replicate(s) == next[r]++);
    }
    film.samples.add({0, 5000});
    for (u32 r = 0; r < CRT_REPLICATES; ++r) CHECK(film.replicateSamples(r) == next[r]);
    // Also of a part, as a merge of two halves sees it.
    Film part({1, 1, kChannels, kAovReplicates});
    part.samples.add({1500, 3333});
    std::array<u64, CRT_REPLICATES> in_part{};
    for (u64 s = 1500; s < 3333; ++s) ++in_part[kernel::crt_replicate(s)];
    for (u32 r = 0; r < CRT_REPLICATES; ++r) CHECK(part.replicateSamples(r) == in_part[r]);
}

TEST_CASE("each replicate is a scrambled Sobol sequence, and no two are alike", "[error][sampler]") {
    constexpr u32 kDimension = 5, kPoints = 64;
    std::set<std::vector<std::uint32_t>> sequences;
    for (u32 r = 0; r < CRT_REPLICATES; ++r) {
        std::vector<std::uint32_t> strata_x(kPoints), strata_y(kPoints), order;
        for (u64 i = 0; i < kPoints; ++i) {
            kernel::CrtSampler s = kernel::crt_sampler_begin(CRT_SAMPLER_SOBOL, 1, 7, 0, 3, r * CRT_REPLICATE_BLOCK + i);
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

TEST_CASE("replicates are independent: their means scatter as the variance of one says", "[error][sampler]") {
    // Mean of a smooth function over 64 points of each replicate. If replicates were stratified against each other, the mean of all would scatter less
    // than the spread between them claims; if they shared numbers, more.
    double claimed = 0, squares = 0;
    constexpr int kPixels = 600;
    for (u32 pixel = 0; pixel < kPixels; ++pixel) {
        std::array<double, CRT_REPLICATES> means{};
        for (u64 s = 0; s < CRT_REPLICATE_BLOCK * CRT_REPLICATES; ++s) {
            kernel::CrtSampler sampler = kernel::crt_sampler_begin(CRT_SAMPLER_SOBOL, 1, 1, 0, pixel, s);
            const kernel::CrtRandom2 u = kernel::crt_sample_2d(&sampler, 4);
            means[kernel::crt_replicate(s)] += static_cast<double>(u.x) * static_cast<double>(u.y) / CRT_REPLICATE_BLOCK;
        }
        const stats::Summary summary = stats::summarize(means);
        claimed += summary.variance / CRT_REPLICATES / kPixels;
        squares += std::pow(summary.mean - 0.25, 2) / kPixels;
    }
    // Relative standard deviation of `squares`: sqrt(2/600) = 5.8 %.
    CHECK(squares == Approx(claimed).epsilon(0.23));
}
