// The statements of converge where the truth is known by construction: noisy references, unequal pixels, few
// replicates, colours beyond the gamut. bench/false_alarms.cpp asks the same of more situations, more often.
#include "catch.h"
#include "film/error_text.h"
#include "judge/converge/error_model.h"
#include "judge/converge/fits.h"
#include "judge/converge/judgement.h"
#include "judge/converge/quantity_text.h"
#include "synthetic_run.h"

#include <map>
#include <string>

using namespace crt;
using namespace crt::converge;

namespace {

bool covers(const Estimate& estimate, double truth) {
    return estimate.low <= truth && truth <= estimate.high;
}

ConfigurationFit fitOf(const SyntheticRender& what, std::uint64_t seed) {
    return analyze(syntheticRun(what, seed)).fits.at(0);
}

/// 0.9 % at 256 samples, against a reference that took as many.
SyntheticRender noisyReference() {
    SyntheticRender what;
    what.variance = 0.02;
    what.looks = 9;
    what.reference_variance = what.variance / 256;
    return what;
}

}  // namespace

TEST_CASE("errors are relative to mean luminance, whatever the colour", "[fits]") {
    SyntheticRender what;
    const Point white = fitOf(what, 1).points.back();
    what.colour = {0.1, 0.3, 10.6};  // A blue of luminance 1: (R + G + B)/3 is 3.7.
    const Point blue = fitOf(what, 1).points.back();
    CHECK(blue.relative_rmse.value == white.relative_rmse.value);
    CHECK(blue.mean_bias->value == white.mean_bias->value);
    what.has_reference = false;
    CHECK(fitOf(what, 1).points.back().relative_rmse.value ==
          Approx(white.relative_rmse.value).epsilon(0.1));
}

TEST_CASE("a bias fails in a channel whose mean is 0 or below 0, too", "[fits]") {
    SyntheticRender what;
    what.variance = 0.02;
    for (const double mean : {-0.2, 0.0}) {
        what.colour = {1.3, 0.9, mean};
        what.colour_bias = {0, 0, 0};
        CHECK(fitOf(what, 2).judgement.verdict == stats::Verdict::Pass);
        for (const double bias : {0.02, -0.02}) {
            what.colour_bias = {0, 0, bias};
            CHECK(fitOf(what, 2).judgement.verdict == stats::Verdict::Fail);
        }
    }
}

// 500 repeats place 5 % of misses below 8 % at three standard deviations. Without the folds' part misses are
// 20 % and more.
TEST_CASE("the noise of the reference is in every interval", "[fits]") {
    for (const double times : {0.08, 1.0, 4.0}) {
        SyntheticRender what = noisyReference();
        what.reference_variance *= times;
        what.inequality = 10;
        constexpr int kRepeats = 500;
        std::map<std::string, int> missed;
        int fails = 0, floors = 0;
        for (std::uint64_t i = 0; i < kRepeats; ++i) {
            const ConfigurationFit fit = fitOf(what, 100000 + 100 * i);
            const Point& last = fit.points.back();
            const double rmse = std::sqrt(what.variance / 256);
            missed["relative RMSE"] += covers(last.relative_rmse, rmse) ? 0 : 1;
            missed["bias squared"] += covers(*fit.error.bias_squared, 0) ? 0 : 1;
            missed["bias squared at 256"] += covers(*last.bias_squared, 0) ? 0 : 1;
            missed["mean bias"] += covers(*last.mean_bias, 0) ? 0 : 1;
            missed["slope"] +=
                !std::isfinite(fit.slope_samples.value) || covers(fit.slope_samples, -0.5) ? 0 : 1;
            missed["calibration"] +=
                !std::isfinite(last.calibration->value) || covers(*last.calibration, 1) ? 0 : 1;
            fails += fit.judgement.verdict == stats::Verdict::Fail ? 1 : 0;
            floors += fit.error.flattening ? 1 : 0;
        }
        for (const auto& [name, count] : missed) {
            INFO(name << ": " << count << " of " << kRepeats << ", reference's variance times " << times);
            CHECK(count <= 40);
        }
        CHECK(fails <= 3);  // 0.1 % is claimed: 4 of 500 are a chance of 0.2 %.
        CHECK(floors <= 3);
    }
}

TEST_CASE("a real floor is seen through a noisy reference", "[fits]") {
    SyntheticRender what = noisyReference();
    what.bias = 0.05;
    what.pixels = 256;
    const ConfigurationFit fit = fitOf(what, 3);
    CHECK(fit.error.flattening);
    CHECK(fit.judgement.verdict == stats::Verdict::Fail);
    CHECK(covers(fit.error.floor(), 0.0025));
}

TEST_CASE("where the reference is noisier than the images, it judges bias, and errors are the spread",
          "[fits]") {
    SyntheticRender what = noisyReference();
    what.reference_variance *= 20;
    const ConfigurationFit fit = fitOf(what, 5);
    CHECK(fit.source == ErrorSource::BetweenReplicates);
    CHECK(fit.has_reference);
    CHECK(fit.points.back().relative_rmse.value == Approx(std::sqrt(what.variance / 256)).epsilon(0.1));
    CHECK(fit.slope_samples.high - fit.slope_samples.low < 0.1);
    REQUIRE(fit.error.bias_squared);
    CHECK(covers(*fit.error.bias_squared, 0));
    what.bias = 0.2;  // A bias that is seen is part of the error.
    const ConfigurationFit biased = fitOf(what, 5);
    CHECK(biased.source == ErrorSource::Reference);
    CHECK(covers(biased.points.back().relative_rmse, std::sqrt(what.variance / 256 + 0.04)));
}

TEST_CASE("an error below the noise of the reference is bounded, not a NaN", "[fits]") {
    SyntheticRender what = noisyReference();
    what.variance = 1e-6;
    what.reference_variance = 0.01;
    int at_zero = 0, covered = 0;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        Run run = syntheticRun(what, 100 * seed);
        for (Row& row : run.rows) row.between_replicates_mse.reset();  // Else that would be the error.
        const ConfigurationFit fit = analyze(run).fits.at(0);
        for (const Point& point : fit.points) {
            CHECK(std::isfinite(point.relative_rmse.value));
            CHECK(std::isfinite(point.relative_rmse.high));
            at_zero += point.relative_rmse.value == 0 ? 1 : 0;
            CHECK(errorText(point.relative_rmse).find("below ") == 0);
        }
        covered += covers(fit.points.back().relative_rmse, std::sqrt(what.variance / 256)) ? 1 : 0;
        CHECK(fit.judgement.verdict != stats::Verdict::Fail);
    }
    CHECK(covered >= 16);  // Of 20 intervals of 95 %: fewer are a chance of 0.3 %.
    CHECK(at_zero > 0);    // A logarithm would be a NaN there.
}

// The reference's mean is known from eight folds: a normal quantile misses 1.2 % where 0.1 % is stated.
TEST_CASE("the interval of the mean's bias knows that a reference has eight folds", "[fits]") {
    std::mt19937_64 engine(4);
    std::normal_distribution<double> normal;
    int missed = 0;
    constexpr int kRepeats = 4000;
    for (int i = 0; i < kRepeats; ++i) {
        std::vector<Row> rows(16);
        RowList list;
        for (Row& row : rows) {
            row.mean_luminance = 1 + 0.001 * normal(engine);
            row.image_mean = {row.mean_luminance, row.mean_luminance, row.mean_luminance};
            list.push_back(&row);
        }
        ReferenceInfo reference;
        for (int k = 0; k < 8; ++k) reference.fold_mean_luminance.push_back(1 + 0.01 * normal(engine));
        const stats::Summary mean = stats::summarize(reference.fold_mean_luminance);
        reference.mean_luminance = mean.mean;
        reference.mean_luminance_standard_error = mean.standardError();
        reference.image_mean.fill(mean.mean);
        reference.image_mean_standard_error.fill(mean.standardError());
        missed += covers(meanBias(list, reference, 1, 0.999), 0) ? 0 : 1;
    }
    INFO(missed << " of " << kRepeats);
    CHECK(missed <= 12);  // 4 are expected; more than 12 are a chance of 0.03 %.
}

// Estimates of b² around 0, of two replicates and of pixels one of which has most of the variance: the
// variance of s² and the inequality of the pixels both count. The jackknife is left out by giving an
// estimate without width.
TEST_CASE("the interval of a bias that is not there has the width of its scatter", "[fits]") {
    std::mt19937_64 engine(6);
    std::normal_distribution<double> normal;
    for (const std::uint32_t replicates : {2u, 16u})
        for (const double inequality : {1.0, 100.0}) {
            // Of two replicates the inequality itself is not known; the jackknife's one degree of freedom
            // decides.
            if (replicates == 2 && inequality > 1) continue;
            SyntheticRender what;
            what.inequality = inequality;
            what.pixels = 32;
            const ReferenceInfo exact = syntheticReference(what, {});
            int missed = 0;
            constexpr int kRepeats = 2000;
            for (int i = 0; i < kRepeats; ++i) {
                std::vector<double> variances(what.pixels);
                double squares = 0;
                for (std::uint32_t p = 0; p < what.pixels; ++p) {
                    std::vector<double> values;
                    for (std::uint32_t r = 0; r < replicates; ++r)
                        values.push_back(1 + std::sqrt(syntheticShare(what, p)) * normal(engine));
                    const stats::Summary summary = stats::summarize(values);
                    variances[p] = summary.variance;
                    squares += (summary.mean - 1) * (summary.mean - 1) / what.pixels;
                }
                Row row;
                row.error = syntheticMetrics(1);
                row.mean_luminance = 1;
                row.effective_pixels = stats::effectivePixels(variances, replicates - 1);
                RowsBySamples rows;
                rows[1][0] = &row;
                const Measure measure(rows, &exact, what.pixels);
                const double variance = syntheticMean(variances), value = squares - variance / replicates;
                missed += covers(measure.noNarrowerThanNoBias({value, value, value}, variance, row,
                                                              replicates, 0.95),
                                 0)
                              ? 0
                              : 1;
            }
            INFO(replicates << " replicates, variances " << inequality << " : 1, missed " << missed << " of "
                            << kRepeats);
            CHECK(missed < 0.08 * kRepeats);
            CHECK(missed > 0.01 * kRepeats);
        }
}

TEST_CASE("two replicates without a reference have values without bounds, and nothing that is a NaN",
          "[fits]") {
    SyntheticRender what;
    what.replicates = 2;
    what.has_reference = false;
    const ConfigurationFit fit = fitOf(what, 7);
    for (const Estimate& e : {fit.points.back().relative_rmse, fit.points.back().efficiency,
                              fit.error.variance, fit.slope_samples}) {
        CHECK(std::isfinite(e.value));
        CHECK_FALSE(std::isnan(e.low));
        CHECK(std::isinf(e.high));
    }
}

TEST_CASE("configurations that render the same bits share slope, error and verdict, and times are their own",
          "[fits]") {
    SyntheticRender what;
    what.variance = 0.02;
    what.looks = 9;
    Run run = syntheticRun(what, 8);
    what.seconds_per_sample *= 3;
    run.configurations.push_back(run.configurations[0]);
    run.configurations[1].key.backend = "slower";
    for (Row& row : syntheticRows(run.configurations[1].key, what, 8))
        if (row.samples <= 64) run.rows.push_back(row);  // It got less far in the time.
    // Jitter and bits are of one seed; what differs is how far each went.
    Analysis analysis = analyze(run);
    const ConfigurationFit &a = analysis.fits[0], &b = analysis.fits[1];
    REQUIRE(b.same_bits == std::vector<Key>{a.key});
    CHECK(a.slope_samples.value == b.slope_samples.value);
    CHECK(a.slope_samples.high == b.slope_samples.high);
    CHECK(a.error.variance.value == b.error.variance.value);
    CHECK(a.judgement.verdict == b.judgement.verdict);
    CHECK(a.efficiency.value / b.efficiency.value == Approx(3).epsilon(0.02));
    CHECK(b.time.per_sample.value == Approx(3 * a.time.per_sample.value).epsilon(0.02));

    run.rows.back().mean_luminance *= 1 + 1e-15;  // One bit: another image.
    CHECK(analyze(run).fits[1].same_bits.empty());
}

TEST_CASE("efficiencies are compared at an error that all have measured", "[fits]") {
    SyntheticRender what;
    what.variance = 4;
    what.looks = 7;  // To 64 samples: 25 %.
    Run run = syntheticRun(what, 9);
    run.configurations.push_back(run.configurations[0]);
    run.configurations[1].key.variant = "sobol";
    what.rate = 1.8;
    for (Row& row : syntheticRows(run.configurations[1].key, what, 10)) run.rows.push_back(row);
    const Analysis analysis = analyze(run);
    const ConfigurationFit &independent = analysis.fits[0], &sobol = analysis.fits[1];
    CHECK(independent.common.reached);
    CHECK(sobol.common.reached);
    CHECK(independent.common.relative_rmse == sobol.common.relative_rmse);
    CHECK(independent.common.relative_rmse == Approx(0.25).epsilon(0.1));
    // 64 samples against (4/0.0625)^(1/1.8) = 10.08 for the same error, whatever the lines v/N say.
    CHECK(sobol.efficiency.value / independent.efficiency.value == Approx(6.3).epsilon(0.1));
}

// 256 samples of 64 pixels in 16 replicates have 131 fireflies. Their bound is 266 mean squares, so that
// three paths of that brightness are more than all of them.
TEST_CASE("an error is not yet known where the noise is less than three of the scene's brightest paths",
          "[fits]") {
    SyntheticRender what;
    what.variance = 0.02;
    what.looks = 9;
    what.fireflies = 1 / 2000.0;
    int unknown = 0;
    constexpr int kRepeats = 50;
    for (std::uint64_t i = 0; i < kRepeats; ++i) {
        const ConfigurationFit fit = fitOf(what, 200000 + 100 * i);
        if (fit.unknown_error.find("brightest paths") == std::string::npos) continue;
        ++unknown;
        const Point& last = fit.points.back();
        CHECK(std::isinf(last.relative_rmse.high));
        CHECK(std::isinf(last.calibration->high));
        CHECK(std::isinf(last.mean_bias->high));
        CHECK(std::isinf(fit.slope_samples.high));
        CHECK_FALSE(fit.targets.at(0).samples);
    }
    CHECK(unknown >= 45);  // One firefly in 7,000 is bright enough to be three of the bound.
}

// The first look has met 82 fireflies, and some 330 are needed.
TEST_CASE("looks that have met too few of the brightest paths are in no fit", "[fits]") {
    SyntheticRender what;
    what.variance = 0.02;
    what.looks = 9;
    what.pixels = 512;
    what.fireflies = 1 / 100.0;
    int first = 0, known = 0, wrong = 0, slopes = 0, wrong_slopes = 0;
    constexpr int kRepeats = 60;
    for (std::uint64_t i = 0; i < kRepeats; ++i) {
        const ConfigurationFit fit = fitOf(what, 300000 + 100 * i);
        const bool knows_first = std::isfinite(fit.points.front().relative_rmse.high);
        first += knows_first ? 1 : 0;
        if (!fit.unknown_error.empty()) continue;
        ++known;
        wrong += covers(fit.points.back().relative_rmse, std::sqrt(what.variance / 256)) ? 0 : 1;
        if (!std::isfinite(fit.slope_samples.high)) continue;
        CHECK(knows_first == (fit.slope_range[0] == 1));
        ++slopes;
        wrong_slopes += covers(fit.slope_samples, -0.5) ? 0 : 1;
    }
    INFO(wrong << " of " << known << ", slopes " << wrong_slopes << " of " << slopes);
    CHECK(first <= 3);  // One path that is far brighter than the bound is enough.
    CHECK(known >= 50);
    CHECK(slopes >= 50);
    CHECK(wrong <= 8);  // 5 % of 60 with three standard errors.
    CHECK(wrong_slopes <= 8);
}

TEST_CASE("a heavy tail shows within the pixels where the scene gives no bound", "[fits]") {
    SyntheticRender what;
    what.variance = 0.02;
    what.looks = 9;
    what.brightest_known = false;
    for (std::uint64_t i = 0; i < 20; ++i) {
        what.fireflies = 1 / 2000.0;
        const ConfigurationFit rare = fitOf(what, 400000 + 100 * i);
        CHECK(rare.unknown_error.find("heavy tail") != std::string::npos);
        what.fireflies = 0;
        CHECK(fitOf(what, 400000 + 100 * i).unknown_error.empty());
    }
}

// Of 1,000 renders 194 state an error: those whose squares scatter little by chance. Without the widening
// for few pixels 17 % of their intervals are wrong.
TEST_CASE("the errors that are stated of a single pixel hold", "[fits]") {
    SyntheticRender what;
    what.variance = 0.02;
    what.looks = 9;
    what.pixels = 1;
    what.replicates = 8;
    int known = 0, wrong = 0;
    for (std::uint64_t i = 0; i < 1000; ++i) {
        const ConfigurationFit fit = fitOf(what, 500000 + 100 * i);
        if (!fit.unknown_error.empty()) continue;
        ++known;
        wrong += covers(fit.points.back().relative_rmse, std::sqrt(what.variance / 256)) ? 0 : 1;
    }
    INFO(wrong << " of " << known);
    CHECK(known >= 100);
    CHECK(wrong <= 0.05 * known + 3 * std::sqrt(0.0475 * known));
}
