// The statements of crt converge about renders whose truth is known by construction: one JSON object per
// line for every statement in every situation, with the number of wrong ones. bench/run false-alarms makes a
// page of them.
//
//     false_alarms REPEATS
#include "base/error.h"
#include "judge/converge/findings.h"
#include "judge/converge/fits.h"
#include "synthetic_run.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

using namespace crt;
using namespace crt::converge;

namespace {

/// Counts of a statement: how often it was made, and how often it was wrong.
struct Tally {
    double stated = 0;  ///< Part that may be wrong.
    std::uint64_t asked = 0, wrong = 0;
};

/// Statements in the order in which they first came.
class Tallies {
public:
    void count(const std::string& statement, double stated, bool wrong) {
        const auto [found, is_new] = places_.try_emplace(statement, tallies_.size());
        if (is_new) tallies_.push_back({statement, {stated, 0, 0}});
        Tally& tally = tallies_[found->second].second;
        ++tally.asked;
        tally.wrong += wrong ? 1 : 0;
    }
    /// One without bounds says nothing, and is not asked.
    void interval(const std::string& statement, const Estimate& estimate, double truth) {
        if (!std::isfinite(estimate.high)) return;
        count(statement, 0.05, !(estimate.low <= truth && truth <= estimate.high));
    }
    void print(const std::string& situation) const {
        for (const auto& [statement, tally] : tallies_)
            fmt::print(
                "{{\"situation\": \"{}\", \"statement\": \"{}\", "
                "\"stated\": {}, \"asked\": {}, \"wrong\": {}}}\n",
                situation, statement, tally.stated, tally.asked, tally.wrong);
        std::fflush(stdout);
    }

private:
    std::map<std::string, std::size_t> places_;
    std::vector<std::pair<std::string, Tally>> tallies_;
};

/// Of a render whose variance falls as N^−rate up to `turns_at`, and as 1/N from there on.
double samplesTo(const SyntheticRender& what, double relative_rmse) {
    const double mse = relative_rmse * relative_rmse, by_rate = std::pow(what.variance / mse, 1 / what.rate);
    return by_rate <= what.turns_at ? by_rate : what.variance * std::pow(what.turns_at, 1 - what.rate) / mse;
}

/// Intervals of one configuration against what they should hold.
void countIntervals(Tallies& tallies, const ConfigurationFit& fit, const SyntheticRender& what) {
    const double v = what.variance, b2 = what.bias * what.bias + what.mean_bias * what.mean_bias;
    const Point& last = fit.points.back();
    const double n = static_cast<double>(last.samples),
                 variance = v / n * std::pow(std::min(n, what.turns_at), 1 - what.rate);
    const double mse = variance + (fit.source == ErrorSource::Reference ? b2 : 0);
    tallies.interval("relative RMSE", last.relative_rmse, std::sqrt(mse));
    if (fit.fitted && std::isfinite(fit.error.variance.value) && what.rate == 1 &&
        (b2 == 0 || what.has_reference))
        tallies.interval("variance of a sample", fit.error.variance, v);
    if (fit.error.bias_squared) tallies.interval("squared bias", *fit.error.bias_squared, b2);
    if (last.mean_bias) tallies.interval("bias of the image mean", *last.mean_bias, what.mean_bias);
    if (fit.fitted && b2 == 0 && what.rate == 1 && std::isfinite(fit.slope_samples.value))
        tallies.interval("slope", fit.slope_samples, -0.5);
    tallies.interval("seconds, start-up included", last.seconds,
                     what.before_first_sample + what.launch_seconds +
                         what.seconds_per_sample * static_cast<double>(last.samples));
    if (fit.fitted && b2 == 0)
        for (const Target& target : fit.targets)
            if (target.samples && !target.at_first_point)
                tallies.interval(fmt::format("samples to {} %", 100 * target.relative_rmse), *target.samples,
                                 samplesTo(what, target.relative_rmse));
    const double predicted =
        what.prediction * std::sqrt(v / std::pow(n, what.rate)) * std::sqrt(1 + 0.05 * 0.05);
    if (last.calibration && what.prediction > 0 && std::isfinite(last.calibration->value))
        tallies.interval("predicted over actual error", *last.calibration, predicted / std::sqrt(mse));
}

/// Verdicts that are wrong, whatever the situation: FAIL of a correct backend, PASS of a biased one.
void countVerdict(Tallies& tallies, const ConfigurationFit& fit, bool right, bool flat) {
    using stats::Verdict;
    if (right) {
        tallies.count("FAIL of a correct backend", 0.001, fit.judgement.verdict == Verdict::Fail);
        if (fit.fitted && !flat) tallies.count("a bias floor without a bias", 0.001, fit.error.flattening);
    } else {
        tallies.count("PASS of a biased backend", 0.001, fit.judgement.verdict == Verdict::Pass);
    }
}

struct Situation {
    std::string name;
    SyntheticRender what;
    bool right = true;
};

std::vector<Situation> situations() {
    SyntheticRender plain;
    plain.variance = 0.02;
    plain.looks = 9;  // To 256 samples: 0.9 %.
    std::vector<Situation> list;
    const auto add = [&](const std::string& name, bool right,
                         const std::function<void(SyntheticRender&)>& change) {
        list.push_back({name, plain, right});
        change(list.back().what);
    };
    const double own = plain.variance / 256;
    add("exact reference, 16 replicates", true, [](SyntheticRender&) {});
    for (const unsigned r : {2u, 3u, 5u})
        add(fmt::format("{} replicates", r), true, [r](SyntheticRender& w) { w.replicates = r; });
    add("2 replicates, unequal variances", true,
        [](SyntheticRender& w) { w.replicates = 2, w.inequality = 100; });
    add("one pixel", true, [](SyntheticRender& w) { w.pixels = 1; });
    add("unequal variances, 100 : 1", true, [](SyntheticRender& w) { w.inequality = 100; });
    add("reference as noisy as the images", true, [&](SyntheticRender& w) { w.reference_variance = own; });
    add("reference noisier, four times the variance", true,
        [&](SyntheticRender& w) { w.reference_variance = 4 * own; });
    add("noisy reference, unequal variances", true,
        [&](SyntheticRender& w) { w.reference_variance = own, w.inequality = 100; });
    add("noisy reference, 4 replicates", true,
        [&](SyntheticRender& w) { w.reference_variance = own, w.replicates = 4; });
    add("noisy reference, one pixel", true,
        [&](SyntheticRender& w) { w.reference_variance = own, w.pixels = 1; });
    add("no reference", true, [](SyntheticRender& w) { w.has_reference = false; });
    add("no reference, 3 replicates", true,
        [](SyntheticRender& w) { w.has_reference = false, w.replicates = 3; });
    add("a channel below 0, one of 0", true, [&](SyntheticRender& w) {
        w.colour = {1.3, 0, -0.2}, w.reference_variance = own;
    });
    add("bias of 0.5 %, within the margin", true, [](SyntheticRender& w) { w.mean_bias = 0.005; });
    add("bias of 1 %, on the margin", false, [](SyntheticRender& w) { w.mean_bias = 0.01; });
    add("bias of 1.2 %, noisy reference", false,
        [&](SyntheticRender& w) { w.mean_bias = 0.012, w.reference_variance = own; });
    add("pixels off by 3 %, noisy reference", false,
        [&](SyntheticRender& w) { w.bias = 0.03, w.reference_variance = own; });
    add("bias of 1.5 % in a channel below 0", false, [](SyntheticRender& w) {
        w.colour = {1.3, 0.9, -0.2}, w.colour_bias = {0, 0, 0.015};
    });
    for (const unsigned r : {16u, 4u})
        for (const int rarity : {200, 2000, 20000})
            add(fmt::format("fireflies, one path in {}, {} replicates", rarity, r), true,
                [=](SyntheticRender& w) { w.fireflies = 1.0 / rarity, w.replicates = r; });
    for (const int rarity : {200, 2000, 20000})
        add(fmt::format("fireflies, one path in {}, 16 replicates, no bound given", rarity), true,
            [=](SyntheticRender& w) { w.fireflies = 1.0 / rarity, w.brightest_known = false; });
    for (const double turns_at : {8.0, 64.0, 512.0, 1e300})
        add(turns_at > 1e6 ? "error² as 1/N²"
                           : fmt::format("error² as 1/N², from {} samples on as 1/N", turns_at),
            true, [=](SyntheticRender& w) {
                w.rate = 2, w.turns_at = turns_at, w.variance = 2, w.prediction = 0;
            });
    add("start-up ± 20 %", true, [](SyntheticRender& w) {
        w.start_jitter = 0.2, w.launch_seconds = 0.001, w.seconds_per_sample = 0.0001;
    });
    return list;
}

void measure(const Situation& situation, int repeats) {
    Tallies tallies;
    for (int i = 0; i < repeats; ++i) {
        const Run run = syntheticRun(situation.what, 7919u * static_cast<std::uint64_t>(i) + 13);
        const ConfigurationFit fit = analyze(run).fits.at(0);
        countIntervals(tallies, fit, situation.what);
        if (situation.what.has_reference)
            countVerdict(tallies, fit, situation.right, situation.what.mean_bias != 0);
    }
    tallies.print(situation.name);
}

Configuration configurationOf(const std::string& backend, const std::string& variant,
                              const SyntheticRender& what) {
    Configuration configuration;
    configuration.key = {"scene", backend, variant};
    configuration.width = what.pixels;
    configuration.height = 1;
    return configuration;
}

/// Four configurations that are alike but for their seeds: every lead of one over another is a false alarm.
void measureRanking(int repeats) {
    SyntheticRender what;
    what.variance = 0.02;
    what.looks = 9;
    what.has_reference = false;
    Tallies tallies;
    for (int i = 0; i < repeats; ++i) {
        Run run;
        for (int c = 0; c < 4; ++c) {
            run.configurations.push_back(configurationOf("backend", fmt::format("variant={}", c), what));
            const auto seed = static_cast<std::uint64_t>(100 * (4 * i + c));
            for (Row& row : syntheticRows(run.configurations.back().key, what, seed))
                run.rows.push_back(std::move(row));
        }
        std::string text;
        for (const Finding& finding : findingsOfScene(run, analyze(run), "scene")) text += finding.text;
        tallies.count("'times sooner than the next'", 0.05, text.find("times sooner") != std::string::npos);
        tallies.count("'the most efficient'", 0.05, text.find("times the least") != std::string::npos);
    }
    tallies.print("four alike, without a reference");
}

/// Rows that are void, of a render that is right otherwise, and a bias far beyond the margin: both must
/// fail, always.
void measureFaults(int repeats) {
    Tallies tallies;
    for (int i = 0; i < repeats; ++i) {
        SyntheticRender what;
        what.variance = 0.02;
        what.looks = 9;
        const auto seed = static_cast<std::uint64_t>(7919 * i + 13);
        Run run = syntheticRun(what, seed);
        run.rows[static_cast<std::size_t>(i) % run.rows.size()].invalid_samples = 1;
        tallies.count("a void row without FAIL", 0,
                      analyze(run).fits[0].judgement.verdict != stats::Verdict::Fail);
        for (Row& row : run.rows) row.invalid_samples = 1;
        tallies.count("void rows alone without FAIL", 0,
                      analyze(run).fits[0].judgement.verdict != stats::Verdict::Fail);
        what.mean_bias = -0.05;
        tallies.count("a bias of −5 % without FAIL", 0,
                      analyze(syntheticRun(what, seed)).fits[0].judgement.verdict != stats::Verdict::Fail);
        what.mean_bias = 0;
        what.colour = {1.3, 0.9, -0.2};
        what.colour_bias = {0, 0, -0.05};
        tallies.count("a bias of −5 % in a channel below 0 without FAIL", 0,
                      analyze(syntheticRun(what, seed)).fits[0].judgement.verdict != stats::Verdict::Fail);
        what.colour_bias = {0, 0, 0};
        what.bias = 0.05;
        tallies.count("pixels off by 5 % without FAIL", 0,
                      analyze(syntheticRun(what, seed)).fits[0].judgement.verdict != stats::Verdict::Fail);
    }
    tallies.print("faults that must FAIL");
}

}  // namespace

int main(int argc, char** argv) {
    const int repeats = argc == 2 ? std::atoi(argv[1]) : 0;
    if (repeats <= 0) {
        std::fprintf(stderr, "false_alarms REPEATS\n");
        return 2;
    }
    try {
        for (const Situation& situation : situations()) measure(situation, repeats);
        measureRanking(repeats);
        measureFaults(repeats);
        return 0;
    } catch (const Error& error) {
        std::fprintf(stderr, "false_alarms: %s\n", error.what());
        return error.exitCode();
    }
}
