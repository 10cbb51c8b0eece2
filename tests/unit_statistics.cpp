// The statistics library: values of tables and of SciPy 1.17 (NumPy 2.4), and coverage and power by
// simulation. A simulation's band is four standard deviations of its binomial count; seeds are fixed, so it
// passes always or never.
#include "base/statistics.h"

#include "base/error.h"
#include "catch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <utility>

using namespace crt;
using namespace crt::stats;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Standard library distributions differ between libraries; these do not.
class Random {
public:
    explicit Random(std::uint64_t seed) : bits_(seed) {}
    double uniform() { return (static_cast<double>(bits_() >> 11) + 0.5) * 0x1p-53; }
    double normal() { return normalQuantile(uniform()); }
    double exponential() { return -std::log(uniform()); }
    std::vector<double> normals(std::size_t count, double mean = 0, double deviation = 1) {
        std::vector<double> values(count);
        for (double& v : values) v = mean + deviation * normal();
        return values;
    }

private:
    std::mt19937_64 bits_;
};

/// Is `hits` of `repeats` what probability p gives?
void checkRate(int hits, int repeats, double p) {
    INFO(hits << " of " << repeats << ", expected " << p * repeats);
    CHECK(std::abs(hits - p * repeats) < 4 * std::sqrt(p * (1 - p) * repeats));
}

}  // namespace

TEST_CASE("quantiles are those of the tables", "[statistics]") {
    CHECK(normalQuantile(0.975) == Approx(1.959963984540054).epsilon(1e-14));
    CHECK(normalQuantile(1e-9) == Approx(-5.9978070150076865).epsilon(1e-12));
    CHECK(studentQuantile(0.9995, 15) == Approx(4.072765195903846).epsilon(1e-12));
    CHECK(studentQuantile(0.9, 3.7) == Approx(1.5575658388615072).epsilon(1e-12));
    CHECK(chiSquaredQuantile(0.05, 10) == Approx(3.9402991361190605).epsilon(1e-12));
    CHECK(fisherQuantile(0.95, 5, 12) == Approx(3.1058752390841238).epsilon(1e-12));
    CHECK(studentTwoSided(-2.5, 7.3) == Approx(0.03965023466560043).epsilon(1e-12));
    CHECK(normalTwoSided(6) == Approx(1.973175290075389e-09).epsilon(1e-12));
    CHECK(studentTwoSided(kInfinity, 3) == 0.0);
    CHECK(std::isnan(studentTwoSided(kNan, 3)));
    CHECK_THROWS_AS(normalQuantile(1), Error);
    CHECK_THROWS_AS(studentQuantile(0.5, 0), Error);
}

// A film of 16384 x 16384 has 4e9 degrees of freedom; found by fuzzing: Boost's series no longer end
// somewhere above 1e10.
TEST_CASE("quantiles of very many degrees of freedom", "[statistics]") {
    CHECK(chiSquaredQuantile(0.975, 4e9) / 4e9 - 1 ==
          Approx(4.3826600603e-05).epsilon(1e-9));  // SciPy 1.17, and so below
    CHECK(chiSquaredQuantile(0.025, 4e9) / 4e9 - 1 == Approx(-4.3825653451e-05).epsilon(1e-9));
    CHECK(fisherQuantile(0.95, 4e9, 6e10) - 1 == Approx(3.79866228637e-05).epsilon(1e-9));
    CHECK(fisherQuantile(0.95, 2e9, 3e10) - 1 == Approx(5.3721405481e-05).epsilon(1e-9));
    for (const double dof : {0.9999e9, 1.0001e9, 1e12, 1e15, 1e19}) {
        CAPTURE(dof);
        const double z = normalQuantile(0.975),
                     expected = z * std::sqrt(2 / dof);  // normal, but for terms of 1/dof
        CHECK(chiSquaredQuantile(0.975, dof) / dof - 1 == Approx(expected).epsilon(1e-4));
        CHECK(fisherQuantile(0.975, dof, dof) - 1 == Approx(expected * std::sqrt(2.0)).epsilon(1e-4));
        CHECK(fisherQuantile(0.95, 1, dof) == Approx(3.8414588).epsilon(1e-6));
    }
}

TEST_CASE("a summary keeps a small spread about a large mean", "[statistics]") {
    const std::vector<double> values{1e9 + 4, 1e9 + 7, 1e9 + 13, 1e9 + 16};
    const Summary s = summarize(values);
    CHECK(s.mean == 1e9 + 10);
    CHECK(s.variance == 30.0);
    CHECK(s.standardError() == Approx(std::sqrt(7.5)));
    CHECK(std::isnan(summarize(std::vector<double>{1.0}).variance));
    CHECK(std::isnan(summarize({}).mean));
    CHECK(std::isnan(summarize(std::vector<double>{1, kNan, 2}).mean));
    CHECK_THROWS_AS(meanInterval(summarize(std::vector<double>{1.0}), 0.95), Error);
    CHECK_THROWS_AS(meanInterval(s, 95), Error);
}

TEST_CASE("Welch's test is SciPy's ttest_ind without equal variances", "[statistics]") {
    const std::vector<double> a{27.5, 21.0, 19.0, 23.6, 17.0, 17.9, 16.9, 20.1,
                                21.9, 22.6, 23.1, 19.6, 19.0, 21.7, 21.4};
    const std::vector<double> b{27.1, 22.0, 20.8, 23.4, 23.4, 23.5, 25.8, 22.0,
                                24.8, 20.2, 21.9, 22.1, 22.9, 30.5, 24.4};
    const WelchResult r = welch(summarize(a), summarize(b), 0.95);
    CHECK(r.difference == Approx(-2.833333333333332).epsilon(1e-12));
    CHECK(r.t == Approx(-2.8529548701715215).epsilon(1e-12));
    CHECK(r.dof == Approx(27.88730398842012).epsilon(1e-12));
    CHECK(r.p == Approx(0.008071938172194903).epsilon(1e-12));
    CHECK(r.interval.lower == Approx(-4.868022741791966).epsilon(1e-12));
    CHECK(r.interval.upper == Approx(-0.7986439248746979).epsilon(1e-12));
}

TEST_CASE("Welch's test of values without spread, and of NaN", "[statistics]") {
    const Summary one{1, 0, 4}, two{2, 0, 4}, bad{kNan, 1, 4};
    CHECK(welch(one, one, 0.95).p == 1.0);
    CHECK(welch(one, two, 0.95).p == 0.0);
    CHECK(welch(one, two, 0.95).interval.lower == -1.0);
    CHECK(std::isnan(welch(one, bad, 0.95).p));
    CHECK(equivalence(welch(one, bad, 0.95).interval, 1) == Verdict::Inconclusive);
    // Variances whose squares underflow still have degrees of freedom.
    CHECK(welch({0, 1e-200, 4}, {0, 1e-200, 4}, 0.95).dof == Approx(6));
}

TEST_CASE("an interval of a mean covers it as often as it says", "[statistics]") {
    constexpr int repeats = 4000;
    for (const double confidence : {0.95, 0.5}) {
        Random random(11);
        int covered = 0;
        for (int i = 0; i < repeats; ++i)
            covered += meanInterval(summarize(random.normals(5, 3, 2)), confidence).contains(3);
        checkRate(covered, repeats, confidence);
    }
}

TEST_CASE("Welch's interval covers the difference, however unequal the variances", "[statistics]") {
    constexpr int repeats = 4000;
    Random random(12);
    int covered = 0, alarms = 0;
    for (int i = 0; i < repeats; ++i) {
        const WelchResult r =
            welch(summarize(random.normals(8, 1, 1)), summarize(random.normals(16, 1, 5)), 0.95);
        covered += r.interval.contains(0);
        alarms += r.p < 0.05;
    }
    checkRate(covered, repeats, 0.95);
    CHECK(alarms == repeats - covered);
}

TEST_CASE("equivalence decides by the whole interval", "[statistics]") {
    CHECK(equivalence({-0.01, 0.01}, 0.01) == Verdict::Pass);
    CHECK(equivalence({-0.011, 0.001}, 0.01) == Verdict::Inconclusive);
    CHECK(equivalence({-1, 1}, 0.01) == Verdict::Inconclusive);
    CHECK(equivalence({0.011, 0.02}, 0.01) == Verdict::Fail);
    CHECK(equivalence({-0.02, -0.011}, 0.01) == Verdict::Fail);
    CHECK(equivalence({kNan, 0}, 0.01) == Verdict::Inconclusive);
    CHECK_THROWS_AS(equivalence({0, 0}, 0), Error);
}

TEST_CASE(
    "equivalence passes what is just not equivalent no more "
    "often than it may, and what is equal nearly always",
    "[statistics]") {
    constexpr int repeats = 4000;
    Random random(13);
    int false_passes = 0, false_fails = 0, passes = 0;
    for (int i = 0; i < repeats; ++i) {
        // Sixteen replicates; the standard error of the difference is a sixth of delta.
        const auto interval = [&](double difference) {
            return welch(summarize(random.normals(16, difference, 0.47)),
                         summarize(random.normals(16, 0, 0.47)), 0.95)
                .interval;
        };
        const Verdict at_delta = equivalence(interval(1), 1);
        false_passes += at_delta == Verdict::Pass;
        false_fails += at_delta == Verdict::Fail;
        passes += equivalence(interval(0), 1) == Verdict::Pass;
    }
    checkRate(false_passes, repeats, 0.025);
    checkRate(false_fails, repeats, 0.025);
    CHECK(passes > 0.999 * repeats);
}

TEST_CASE("Holm rejects stepwise", "[statistics]") {
    // Limits are 0.05/4, 0.05/3, 0.05/2, and 0.03 is beyond the third.
    CHECK(holm(std::vector<double>{0.01, 0.04, 0.03, 0.005}, 0.05) ==
          std::vector<bool>{true, false, false, true});
    CHECK(holm(std::vector<double>{0.01, 0.02, 0.03, 0.04}, 0.05) ==
          std::vector<bool>{true, false, false, false});
    CHECK(holm({}, 0.05).empty());
    CHECK_THROWS_AS(holm(std::vector<double>{kNan}, 0.05), Error);
}

TEST_CASE("Holm's family raises a false alarm no more often than alpha, and finds more than Bonferroni",
          "[statistics]") {
    constexpr int repeats = 4000, tests = 20, wrong = 10;
    Random random(14);
    int all_true_alarms = 0, mixed_alarms = 0, found = 0, bonferroni = 0;
    for (int i = 0; i < repeats; ++i) {
        std::vector<double> p(tests);
        for (double& v : p) v = random.uniform();
        const std::vector<bool> fallen = holm(p, 0.05);
        all_true_alarms += std::find(fallen.begin(), fallen.end(), true) != fallen.end();

        for (int j = 0; j < wrong; ++j)
            p[static_cast<std::size_t>(j)] = normalTwoSided(random.normal() + 3.5);
        const std::vector<bool> mixed = holm(p, 0.05);
        mixed_alarms += std::find(mixed.begin() + wrong, mixed.end(), true) != mixed.end();
        for (std::size_t j = 0; j < wrong; ++j) {
            found += mixed[j];
            bonferroni += p[j] <= 0.05 / tests;
        }
    }
    checkRate(all_true_alarms, repeats,
              1 - std::pow(1 - 0.05 / tests, tests));  // The smallest of 20 uniform values decides.
    CHECK(mixed_alarms < 0.05 * repeats);
    CHECK(mixed_alarms > 0.025 * repeats);
    CHECK(found > bonferroni + 1000);
}

TEST_CASE("Šidák's alpha, with digits left for millions of tests", "[statistics]") {
    CHECK(sidak(0.05, 1) == Approx(0.05).epsilon(1e-14));
    CHECK(sidak(0.05, 10) == Approx(0.005116196891823743).epsilon(1e-12));  // 1 − 0.95^(1/10)
    // −ln(1 − α)/m
    CHECK(sidak(1e-6, 1'000'000'000'000) == Approx(1.0000005000003333e-18).epsilon(1e-12));
    CHECK_THROWS_AS(sidak(0.05, 0), Error);
}

TEST_CASE("Clopper and Pearson's interval is SciPy's, and covers at least what it says", "[statistics]") {
    CHECK(clopperPearson(3, 20, 0.95).lower == Approx(0.03207093718554477).epsilon(1e-10));
    CHECK(clopperPearson(3, 20, 0.95).upper == Approx(0.37892682654529564).epsilon(1e-10));
    CHECK(clopperPearson(0, 10, 0.95).lower == 0.0);
    CHECK(clopperPearson(0, 10, 0.95).upper == Approx(0.30849710781876294).epsilon(1e-10));
    CHECK(clopperPearson(10, 10, 0.95).upper == 1.0);
    CHECK(clopperPearson(380, 400, 0.999).lower == Approx(0.9038563263364509).epsilon(1e-10));
    CHECK(clopperPearson(380, 400, 0.999).upper == Approx(0.9785824882276842).epsilon(1e-10));
    CHECK_THROWS_AS(clopperPearson(3, 2, 0.95), Error);

    // Exactly: the binomial probabilities of all counts whose interval has p.
    constexpr int trials = 30;
    for (const double p : {0.02, 0.3, 0.77}) {
        double covered = 0, probability = std::pow(1 - p, trials);
        for (int k = 0; k <= trials; ++k) {
            if (clopperPearson(static_cast<std::uint64_t>(k), trials, 0.95).contains(p))
                covered += probability;
            probability *= static_cast<double>(trials - k) / (k + 1) * p / (1 - p);
        }
        INFO("p " << p);
        CHECK(covered >= 0.95);
        CHECK(covered < 1 - 1e-6);
    }
}

TEST_CASE("the Kolmogorov-Smirnov test of uniform p-values", "[statistics]") {
    CHECK(kolmogorovSmirnovUniform(std::vector<double>{.02, .11, .17, .31, .38, .42, .55, .61, .86, .93}) ==
          Approx(0.7994599807966072).margin(3e-3));
    std::vector<double> squares;
    for (int i = 1; i <= 30; ++i) squares.push_back(.001 * i * i);
    CHECK(kolmogorovSmirnovUniform(squares) == Approx(0.015474229862033506).margin(1e-3));
    CHECK(kolmogorovSmirnovUniform(std::vector<double>(50, 0.5)) < 1e-9);
    CHECK_THROWS_AS(kolmogorovSmirnovUniform(std::vector<double>{kNan}), Error);

    constexpr int repeats = 4000;
    Random random(15);
    int alarms = 0, halves = 0, found = 0;
    for (int i = 0; i < repeats; ++i) {
        std::vector<double> p(64);
        for (double& v : p) v = random.uniform();
        const double uniform = kolmogorovSmirnovUniform(p);
        alarms += uniform < 0.05;
        halves += uniform < 0.5;
        for (double& v : p)
            v = normalTwoSided(normalQuantile(v) *
                               1.7);  // Standard errors that are stated 1.7 times too small.
        found += kolmogorovSmirnovUniform(p) < 0.05;
    }
    checkRate(alarms, repeats, 0.05);
    checkRate(halves, repeats, 0.5);
    CHECK(found > 0.9 * repeats);
}

TEST_CASE("the bootstrap's interval covers the mean, skewed values too, and repeats", "[statistics]") {
    std::vector<double> values;
    const ResampledStatistic mean = [&](std::span<const std::size_t> indices) {
        double sum = 0;
        for (const std::size_t i : indices) sum += values[i];
        return sum / static_cast<double>(indices.size());
    };
    // Exponential values are as skewed as squared errors are. The expected rates, below 95 %, are those of
    // 10000 and 6000 repeats with other seeds.
    constexpr int repeats = 1000;
    for (const auto& [count, expected] : {std::pair<std::size_t, double>{16, 0.902}, {64, 0.9325}}) {
        Random random(16);
        int covered = 0;
        for (int i = 0; i < repeats; ++i) {
            values.resize(count);
            for (double& v : values) v = random.exponential();
            covered += bootstrap(count, mean, 1000, 0.95, static_cast<std::uint64_t>(i)).contains(1);
        }
        checkRate(covered, repeats, expected);
    }
    // SciPy's own, method BCa, 400000 resamples of the 16 quantiles of an exponential; without bias and
    // acceleration it is [0.572, 1.457].
    values.clear();
    for (int i = 0; i < 16; ++i) values.push_back(-std::log((i + 0.5) / 16));
    const Interval known = bootstrap(16, mean, 40000, 0.95, 1);
    CHECK(known.lower == Approx(0.62286).margin(0.01));
    CHECK(known.upper == Approx(1.55422).margin(0.015));
    const Interval a = bootstrap(values.size(), mean, 500, 0.95, 7),
                   b = bootstrap(values.size(), mean, 500, 0.95, 7);
    CHECK(a.lower == b.lower);
    CHECK(a.upper == b.upper);
    CHECK(bootstrap(values.size(), mean, 500, 0.95, 8).lower != a.lower);
    values.assign(10, 3.0);
    CHECK(bootstrap(10, mean, 100, 0.95, 1).lower == 3.0);
    values[4] = kNan;
    CHECK(std::isnan(bootstrap(10, mean, 100, 0.95, 1).lower));
}

TEST_CASE("a weighted line is NumPy's", "[statistics]") {
    const std::vector<double> x{1, 2, 4, 8, 16}, y{3.1, 4.9, 9.2, 16.8, 33.5}, w{4, 3, 2, 1, 0.5};
    const LineFit fit = weightedLine(x, y, w);
    CHECK(fit.slope == Approx(2.015542521994134).epsilon(1e-12));
    CHECK(fit.intercept == Approx(1.0020527859237522).epsilon(1e-12));
    CHECK(fit.slope_variance == Approx(0.0006538363963158137).epsilon(1e-10));
    CHECK(fit.intercept_variance == Approx(0.014944831915790031).epsilon(1e-10));
    CHECK(fit.covariance == Approx(-0.0021171845214035872).epsilon(1e-10));
    CHECK(fit.r2 == Approx(0.9995173894944493).epsilon(1e-12));
    const LineFit known = weightedLine(x, y, w, Weights::InverseVariances);
    CHECK(known.slope_variance == Approx(0.007697947214076244).epsilon(1e-10));
    CHECK(known.chi_squared == Approx(0.2548093841642215).epsilon(1e-10));
    CHECK(known.varianceAt(0) == known.intercept_variance);
    CHECK(known.at(2) == Approx(1.0020527859237522 + 2 * 2.015542521994134));
    CHECK(std::isnan(
        weightedLine(std::vector<double>{1, 2}, std::vector<double>{1, 2}, std::vector<double>{1, 1})
            .slope_variance));
    CHECK_THROWS_AS(
        weightedLine(std::vector<double>{1, 1}, std::vector<double>{1, 2}, std::vector<double>{1, 1}),
        Error);
    CHECK_THROWS_AS(weightedLine(x, y, std::vector<double>{1, 1, 0, 1, 1}), Error);
}

TEST_CASE(
    "a line's variances are those of repeats, at the intercept, along it, with known and unknown factor",
    "[statistics]") {
    constexpr int repeats = 4000;
    const std::vector<double> x{1, 2, 4, 8, 16, 32}, deviation{2, 1, 1, 0.5, 0.5, 0.25};
    std::vector<double> w, y(x.size());
    for (const double d : deviation) w.push_back(1 / (d * d));
    Random random(17);
    int intercepts = 0, at_ten = 0, unknown_factor = 0;
    for (int i = 0; i < repeats; ++i) {
        for (std::size_t j = 0; j < x.size(); ++j) y[j] = 5 - 0.3 * x[j] + deviation[j] * random.normal();
        const LineFit fit = weightedLine(x, y, w, Weights::InverseVariances), scaled = weightedLine(x, y, w);
        intercepts +=
            std::abs(fit.intercept - 5) < normalQuantile(0.975) * std::sqrt(fit.intercept_variance);
        at_ten += std::abs(fit.at(10) - 2) < normalQuantile(0.975) * std::sqrt(fit.varianceAt(10));
        unknown_factor += std::abs(scaled.slope + 0.3) <
                          studentQuantile(0.975, scaled.dof) * std::sqrt(scaled.slope_variance);
    }
    checkRate(intercepts, repeats, 0.95);
    checkRate(at_ten, repeats, 0.95);
    checkRate(unknown_factor, repeats, 0.95);
}
