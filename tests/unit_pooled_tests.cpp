// stats/pooled_tests.h: the parts of compare's tests, each against what it promises.
#include "base/statistics.h"
#include "catch.h"
#include "film/luminance_error.h"
#include "film/pooled_variance.h"
#include "judge/stats/pooled_tests.h"

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <tuple>
#include <vector>

using namespace crt::stats;

namespace {

/// Mean 0 and true variance 1, and an estimate of it with this number of degrees of freedom.
Mean estimated(std::mt19937_64& random, double variance, double dof) {
    return {std::sqrt(variance) * std::normal_distribution<double>()(random),
            variance * std::chi_squared_distribution<double>(dof)(random) / dof, dof};
}

/// True if this number of `trials` is too many for a test of this level, but one time in 10,000.
bool exceeds(int alarms, int trials, double level) {
    return clopperPearson(static_cast<std::uint64_t>(alarms), static_cast<std::uint64_t>(trials), 0.9998)
               .lower > level;
}

}  // namespace

TEST_CASE("equality of two means is rejected no more often than stated, however few the degrees of freedom",
          "[pooled-tests]") {
    constexpr int kTrials = 20000;
    std::mt19937_64 random(1);
    for (const auto& [dof_a, dof_b, variance_a] : {std::tuple{1.0, 1.0, 1.0},
                                                   {1.0, 1.0, 30.0},
                                                   {3.0, 3.0, 1.0},
                                                   {3.0, 1.0, 5.0},
                                                   {1.0, 15.0, 0.2},
                                                   {15.0, 15.0, 4.0},
                                                   {200.0, 3.0, 1.0}}) {
        std::array<int, 3> alarms{}, outside{};
        constexpr std::array<double, 3> kLevels{0.05, 0.01, 0.001};
        for (int i = 0; i < kTrials; ++i) {
            const Mean a = estimated(random, variance_a, dof_a), b = estimated(random, 1, dof_b);
            const double p = carefulEqualityP(a, b);
            for (std::size_t l = 0; l < kLevels.size(); ++l) {
                alarms[l] += p < kLevels[l];
                outside[l] += std::abs(a.value - b.value) > carefulHalfWidth(a, b, 1 - kLevels[l]);
            }
        }
        INFO(dof_a << " and " << dof_b << " degrees of freedom, variances " << variance_a << " and 1");
        for (std::size_t l = 0; l < kLevels.size(); ++l) {
            INFO(alarms[l] << " alarms at " << kLevels[l]);
            CHECK_FALSE(exceeds(alarms[l], kTrials, kLevels[l]));
            CHECK(alarms[l] == outside[l]);  // p and interval are one test.
        }
        if (dof_a >= 8 && dof_b >= 8)
            CHECK(alarms[0] > 0.04 * kTrials);  // Where enough is known, nothing is lost.
    }
    CHECK(carefulEqualityP({1, 0, 3}, {1 + 1e-7, 0, 3}) == 1);  // Rounding.
    CHECK(carefulEqualityP({1, 0, 3}, {1.001, 0, 3}) == 0);
    CHECK(std::isnan(carefulEqualityP({1, INFINITY, 3}, {1, 0, 3})));
}

TEST_CASE("sums of symmetric differences are judged rightly whatever their tails", "[pooled-tests]") {
    constexpr int kTrials = 20000;
    std::mt19937_64 random(2);
    const std::vector<double (*)(std::mt19937_64&)> kinds{
        [](std::mt19937_64& r) { return std::normal_distribution<double>()(r); },
        [](std::mt19937_64& r) { return std::cauchy_distribution<double>()(r); },
        [](std::mt19937_64& r) {
            return double(std::poisson_distribution<int>(0.02)(r)) - std::poisson_distribution<int>(0.02)(r);
        },
        [](std::mt19937_64& r) {
            return std::pow(std::gamma_distribution<double>(0.1)(r), 3) -
                   std::pow(std::gamma_distribution<double>(0.1)(r), 3);
        }};
    for (std::size_t kind = 0; kind < kinds.size(); ++kind) {
        std::array<int, 2> alarms{}, outside{};
        constexpr std::array<double, 2> kLevels{0.05, 0.001};
        for (int i = 0; i < kTrials; ++i) {
            DifferenceSums sums;
            for (int n = 0; n < 64; ++n) sums.add(kinds[kind](random));
            const double p = symmetricP(sums);
            for (std::size_t l = 0; l < kLevels.size(); ++l) {
                alarms[l] += p < kLevels[l];
                const double counted = static_cast<double>(sums.count);
                outside[l] += std::abs(sums.sum) > counted * symmetricHalfWidth(sums, 1 - kLevels[l]);
            }
        }
        INFO("kind " << kind);
        for (std::size_t l = 0; l < kLevels.size(); ++l) {
            INFO(alarms[l] << " alarms at " << kLevels[l]);
            CHECK_FALSE(exceeds(alarms[l], kTrials, kLevels[l]));
            CHECK(alarms[l] == outside[l]);
        }
        if (kind == 0)
            CHECK(alarms[0] > 0.05 / 4 * kTrials);  // The price of knowing nothing is a factor of three.
    }
    // The worst case: two signs are equal every other time, and no smaller factor would do.
    DifferenceSums two;
    for (int n = 0; n < 2; ++n) two.add(1);
    CHECK(symmetricP(two) >= 0.5);
    CHECK(symmetricP(two) < 0.5001);
    DifferenceSums few;
    for (int n = 0; n < 8; ++n) few.add(1);
    CHECK(std::isinf(symmetricHalfWidth(few, 0.999)));  // All signs are equal once in 128 times.
    CHECK(symmetricP(DifferenceSums{}) == 1);
}

TEST_CASE("variances add up, and so do their degrees of freedom", "[pooled-tests]") {
    const std::vector<double> variances{1, 2, 4, 0.5, 0};
    PixelSums sums, first, rest;
    for (std::size_t i = 0; i < variances.size(); ++i) {
        sums.add(static_cast<double>(i), variances[i]);
        (i < 2 ? first : rest).add(static_cast<double>(i), variances[i]);
    }
    first.add(rest);
    const Mean mean = sums.mean(3);
    CHECK(mean.value == 2);
    CHECK(mean.variance == Approx(7.5 / 25));
    CHECK(mean.dof == Approx(3 * effectivePixels(variances, 3)));
    CHECK(first.mean(3).variance == Approx(mean.variance));
    CHECK(first.mean(3).dof == Approx(mean.dof));
    PixelSums one;
    one.add(1, 4);
    CHECK(one.mean(3).dof == 3);
}

TEST_CASE("differences of 0 are no evidence of symmetry", "[pooled-tests]") {
    DifferenceSums sums;
    for (int n = 0; n < 1000; ++n) sums.add(n < 10 ? 1 : 0);
    CHECK(sums.count == 10);
    CHECK(std::isinf(symmetricHalfWidth(sums, 0.999)));
}

TEST_CASE("squares beyond the stated variances are found as seldom as stated where there is noise alone",
          "[pooled-tests]") {
    // Pixels whose variances differ a hundredfold, known with one degree of freedom or seven.
    constexpr int kTrials = 4000;
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    for (const int dof : {1, 7}) {
        std::array<int, 2> alarms{};
        int found = 0;
        constexpr std::array<double, 2> kLevels{0.05, 0.001};
        for (int i = 0; i < kTrials; ++i) {
            PixelSums squares, stated, louder;
            for (int pixel = 0; pixel < 64; ++pixel) {
                const double variance = pixel % 8 == 0 ? 100 : 1, d = std::sqrt(variance) * normal(random);
                double estimate = 0;
                for (int k = 0; k < dof; ++k) estimate += std::pow(normal(random), 2) * variance / dof;
                squares.add(0, d * d);
                louder.add(0, 16 * d * d);
                stated.add(0, estimate);
            }
            const Mean of_noise{0, stated.variance, scatteredDof(stated.degreesOfFreedom(dof), dof)};
            const double p = excessP(squares, of_noise);
            for (std::size_t l = 0; l < kLevels.size(); ++l) alarms[l] += p < kLevels[l];
            found += excessP(louder, of_noise) < 0.001;
        }
        INFO(dof << " degrees of freedom: " << alarms[0] << ", " << alarms[1] << " alarms, found " << found);
        CHECK_FALSE(exceeds(alarms[0], kTrials, 0.05));
        CHECK_FALSE(exceeds(alarms[1], kTrials, 0.001));
        CHECK(found > (dof == 1 ? 0.1 : 0.8) * kTrials);
    }
    PixelSums nothing, something;
    something.add(0, 1);
    CHECK(excessP(nothing, {0, 0, 1}) == 1);
    CHECK(excessP(something, {0, 0, 1}) == 0);
    // F(1, 1) is the square of Student's t(1): P(|t| ≥ 1) = 1/2.
    CHECK(excessP(something, {0, 1, 1}) == Approx(0.5));
}

TEST_CASE("a window has what of it lies in the image", "[pooled-tests]") {
    const std::vector<double> values{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};  // 4 × 3
    const std::vector<double> means = windowMeans(values, 4, 3, 1);
    CHECK(means[0] == Approx((1 + 2 + 5 + 6) / 4.0));
    CHECK(means[5] == Approx((1 + 2 + 3 + 5 + 6 + 7 + 9 + 10 + 11) / 9.0));
    CHECK(means[11] == Approx((7 + 8 + 11 + 12) / 4.0));
    CHECK(windowMeans(values, 4, 3, 0) == values);
}

TEST_CASE("a pooled variance is that of equal pixels, never 0 amid noise, and keeps what is not known",
          "[pooled-tests]") {
    // E[1/max(χ²₁, 1)] = P(χ²₁ < 1) + E[1/χ²₁; χ²₁ > 1] = 0.682689 + 0.483941 - 0.317311:
    // ∫ x^-3/2 e^-x/2 dx/√2π from 1 on, by parts. In a window of n pixels 1/n of the correction is
    // left out.
    const auto correction = [](double n) { return 1 - (1 - 0.849320) * (1 - 1 / n); };
    // Equal variances pool to themselves, with the degrees of freedom of all of them.
    const std::vector<double> equal(20 * 20, 2.5);
    const PooledVariances of_equal = pooledVariances(equal, 20, 20, 1);
    CHECK(of_equal.variances[10 * 20 + 10] == Approx(2.5 * correction(49)).epsilon(1e-4));
    CHECK(of_equal.degrees_of_freedom[10 * 20 + 10] == Approx(49));
    CHECK(of_equal.degrees_of_freedom[0] == Approx(16));
    // A single noisy pixel keeps its own, with its own degree of freedom; those about it get a part of it.
    std::vector<double> one(20 * 20, 0.0);
    one[10 * 20 + 10] = 49;
    const PooledVariances of_one = pooledVariances(one, 20, 20, 1);
    CHECK(of_one.variances[10 * 20 + 10] == Approx(49 * correction(49)).epsilon(1e-4));
    CHECK(of_one.variances[10 * 20 + 13] == Approx(correction(49)).epsilon(1e-4));
    CHECK(of_one.variances[10 * 20 + 14] == 0);
    CHECK(of_one.degrees_of_freedom[10 * 20 + 13] == Approx(3));
    // Unknown values add nothing, and stay so.
    std::vector<double> lost = equal;
    lost[10 * 20 + 10] = std::numeric_limits<double>::infinity();
    const PooledVariances of_lost = pooledVariances(lost, 20, 20, 1);
    CHECK(std::isinf(of_lost.variances[10 * 20 + 10]));
    CHECK(of_lost.variances[10 * 20 + 11] == Approx(2.5 * correction(48)).epsilon(1e-4));
    CHECK(pooledVariances(std::vector<double>{3}, 1, 1, 1).variances[0] == Approx(3));
    CHECK(of_lost.degrees_of_freedom[10 * 20 + 11] == Approx(48));
}

TEST_CASE("a pixel whose neighbourhood has missed the light has the variance of a larger one",
          "[pooled-tests]") {
    // One noisy pixel in the first block of 8 × 8 of 24 × 16.
    std::vector<double> variances(24 * 16, 0.0);
    variances[2 * 24 + 3] = 64;
    const std::vector<double> filled = crt::stats::variancesWithoutZeros(variances, 24, 16);
    CHECK(filled[2 * 24 + 3] == 64);
    CHECK(filled[7 * 24 + 7] == Approx(1));          // the block of 8 × 8
    CHECK(filled[7 * 24 + 8] == Approx(0.25));       // that of 16 × 16
    CHECK(filled[15 * 24 + 15] == Approx(0.25));
    CHECK(filled[15 * 24 + 16] == Approx(1.0 / 6));  // all of the image
    // Unknown variances stay unknown and add nothing.
    variances[0] = std::numeric_limits<double>::infinity();
    const std::vector<double> with_unknown = crt::stats::variancesWithoutZeros(variances, 24, 16);
    CHECK(std::isinf(with_unknown[0]));
    CHECK(with_unknown[1] == Approx(64.0 / 63));
    // An image without any noise has none.
    const std::vector<double> none(30, 0.0);
    CHECK(crt::stats::variancesWithoutZeros(none, 6, 5) == none);
    CHECK(crt::stats::variancesWithoutZeros({0, 3}, 2, 1) == std::vector<double>{1.5, 3});
}

TEST_CASE("a deviation over its pooled standard error has standard deviation 1", "[pooled-tests]") {
    // Normal noise, and each pixel's variance from two replicates. Over its own standard error the deviation
    // is Student's with one degree of freedom, which has no standard deviation at all.
    constexpr std::uint32_t kSide = 64;
    std::mt19937_64 random(5);
    double squares = 0, within = 0, count = 0;
    for (int image = 0; image < 10; ++image) {
        std::vector<double> deviations, variances;
        for (std::uint32_t p = 0; p < kSide * kSide; ++p) {
            const Mean pixel = estimated(random, 1 + 3.0 * (p % kSide) / kSide, 1);
            deviations.push_back(pixel.value);
            variances.push_back(pixel.variance);
        }
        const PooledVariances pooled = pooledVariances(variances, kSide, kSide, 1);
        for (std::size_t p = 0; p < deviations.size(); ++p) {
            const double z = deviations[p] / std::sqrt(pooled.variances[p]);
            squares += z * z;
            within += std::abs(z) <= 1.96;
            count += 1;
        }
    }
    // The mean about a pixel scatters by a fifth, which adds a per cent or two.
    CHECK(std::sqrt(squares / count) == Approx(1).epsilon(0.04));
    CHECK(within / count == Approx(0.95).epsilon(0.02));
}
