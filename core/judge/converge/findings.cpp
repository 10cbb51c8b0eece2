#include "judge/converge/findings.h"
#include "film/error_text.h"

#include "base/unit_text.h"
#include "judge/converge/quantity_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace crt::converge {
namespace {

using Fits = std::vector<const ConfigurationFit*>;

/// Quotient of two independent positive estimates, as one of `comparisons` that are looked at: on a
/// logarithmic scale half widths add in quadrature, and Student's quantile becomes that of confidence 1 −
/// (1 − c)/comparisons (Bonferroni), so that a configuration that came out first by chance is not reported
/// as first.
Estimate quotient(const Estimate& a, const Estimate& b, std::size_t comparisons, std::uint32_t replicates,
                  double confidence) {
    const auto quantile = [&](double alpha) {
        return stats::studentQuantile(1 - alpha / 2, std::max(1.0, replicates - 1.0));
    };
    const double wider =
        quantile((1 - confidence) / static_cast<double>(comparisons)) / quantile(1 - confidence);
    const double value = a.value / b.value;
    const double up = wider * std::hypot(std::log(a.high / a.value), std::log(b.value / b.low));
    const double down = wider * std::hypot(std::log(a.value / a.low), std::log(b.high / b.value));
    return {value, value * std::exp(-down), value * std::exp(up)};
}

std::string configurations(std::size_t count) {
    return count == 1 ? "1 configuration" : fmt::format("{} configurations", count);
}

std::uint32_t fewestReplicates(const Fits& fits) {
    std::uint32_t least = std::numeric_limits<std::uint32_t>::max();
    for (const ConfigurationFit* fit : fits) least = std::min(least, fit->replicates);
    return least;
}

/// Number of pairs of which any could have come out as first and next.
std::size_t pairsOf(const Fits& fits) {
    return std::max<std::size_t>(1, fits.size() * (fits.size() - 1) / 2);
}

/// Reports the first to reach an error that all in `reached` measured, and its lead over the next.
std::string order(Fits reached, const std::function<const Target&(const ConfigurationFit&)>& target,
                  const std::string& goal, double confidence) {
    std::sort(reached.begin(), reached.end(), [&](const auto* a, const auto* b) {
        return target(*a).seconds->value < target(*b).seconds->value;
    });
    const Target& first = target(*reached[0]);
    std::string text =
        fmt::format("{} reaches {} relative RMSE first: {}{}, start-up included", labelOf(reached[0]->key),
                    goal, first.at_first_point ? "at most " : "", secondsText(*first.seconds));
    if (reached.size() < 2) return text;
    const Target& next = target(*reached[1]);
    const Estimate factor =
        quotient(*next.seconds, *first.seconds, pairsOf(reached), fewestReplicates(reached), confidence);
    // Where the fewest samples were enough, only a bound of the time is known.
    if (factor.low > 1 && !next.at_first_point)
        return text + fmt::format(", {} times sooner than the next one, {}", numberText(factor, 2),
                                  labelOf(reached[1]->key));
    return text + fmt::format("; the next, {}, is not distinguishable from it", labelOf(reached[1]->key));
}

/// Reports the first of those that reached the target; if none did, no forecast is made.
Finding race(const Fits& fits, std::size_t which, double relative_rmse, double confidence) {
    Fits reached;
    for (const ConfigurationFit* fit : fits)
        if (fit->fitted && fit->targets.at(which).seconds && fit->targets[which].reached)
            reached.push_back(fit);
    const std::string goal = percentText(relative_rmse, 1);
    if (reached.empty())
        return {Tone::Warning, fmt::format("No configuration reached {} relative RMSE.", goal)};
    const auto target = [which](const ConfigurationFit& fit) -> const Target& { return fit.targets[which]; };
    std::string text = order(reached, target, goal, confidence);
    if (reached.size() == 1 && fits.size() > 1) text += "; no other did";
    return {Tone::Neutral, text + "."};
}

/// The same at the least error that all have reached.
std::vector<Finding> commonRace(const Fits& fits, double confidence) {
    Fits reached;
    for (const ConfigurationFit* fit : fits)
        if (fit->fitted && fit->common.reached && fit->common.seconds) reached.push_back(fit);
    if (reached.size() < 2) return {};
    const auto target = [](const ConfigurationFit& fit) -> const Target& { return fit.common; };
    const std::string goal = percentText(reached[0]->common.relative_rmse, 2);
    return {{Tone::Neutral, fmt::format("This is the smallest error that all configurations have reached: "
                                        "{}.",
                                        order(reached, target, goal, confidence))}};
}

/// Render time alone, for the least error that all have reached: what is left when start-up is forgotten.
std::vector<Finding> efficiency(const Fits& fits, double confidence) {
    Fits fitted;
    for (const ConfigurationFit* fit : fits)
        if (fit->fitted && std::isfinite(fit->efficiency.value)) fitted.push_back(fit);
    if (fitted.size() < 2) return {};
    std::sort(fitted.begin(), fitted.end(),
              [](const auto* a, const auto* b) { return a->efficiency.value > b->efficiency.value; });
    const ConfigurationFit &most = *fitted.front(), &least = *fitted.back();
    const std::string error = percentText(most.common.relative_rmse, 2);
    const Estimate factor =
        quotient(most.efficiency, least.efficiency, pairsOf(fitted), fewestReplicates(fitted), confidence);
    if (!(factor.low > 1))
        return {{Tone::Neutral, fmt::format("Start-up aside, the efficiencies at {} relative RMSE are not "
                                            "distinguishable from each other.",
                                            error)}};
    const Estimate lead = quotient(most.efficiency, fitted[1]->efficiency, pairsOf(fitted),
                                   fewestReplicates(fitted), confidence);
    const std::string who =
        lead.low > 1 || fitted.size() == 2
            ? fmt::format("{} is the most efficient", labelOf(most.key))
            : fmt::format("{} and {} are the most efficient", labelOf(most.key), labelOf(fitted[1]->key));
    return {{Tone::Neutral, fmt::format("Start-up aside, {} at {} relative RMSE: {}{} times the least, {}.",
                                        who, error, most.common.at_first_point ? "at least " : "",
                                        numberText(factor, 2), labelOf(least.key))}};
}

/// Configurations that render the same bits share errors, which explains equal slopes.
std::vector<Finding> sameBits(const Fits& fits) {
    std::vector<Finding> findings;
    std::vector<Key> told;
    for (const ConfigurationFit* fit : fits) {
        if (fit->same_bits.empty() || std::find(told.begin(), told.end(), fit->key) != told.end()) continue;
        std::string names = labelOf(fit->key);
        for (const Key& key : fit->same_bits) names += " = " + labelOf(key);
        told.insert(told.end(), fit->same_bits.begin(), fit->same_bits.end());
        findings.push_back(
            {Tone::Good, fmt::format("The same bits, so one error, slope and verdict: {}.", names)});
    }
    return findings;
}

std::vector<Finding> bias(const Fits& fits, double margin) {
    std::vector<Finding> findings;
    Fits pass, unclear, blind;
    for (const ConfigurationFit* fit : fits) {
        switch (fit->judgement.verdict) {
            case stats::Verdict::Fail:
                findings.push_back(
                    {Tone::Bad, fmt::format("{} FAILS: {}", labelOf(fit->key), fit->judgement.reason)});
                break;
            case stats::Verdict::Pass: pass.push_back(fit); break;
            case stats::Verdict::Inconclusive: (fit->has_reference ? unclear : blind).push_back(fit); break;
        }
    }
    if (!pass.empty())
        findings.push_back(
            {Tone::Good,
             fmt::format("No relevant bias: the image mean of {} lies within ±{} of the reference.",
                         pass.size() == fits.size() ? "every configuration" : configurations(pass.size()),
                         percentText(margin, 1))});
    for (const ConfigurationFit* fit : unclear)
        findings.push_back(
            {Tone::Warning, fmt::format("{} is undecided: {}", labelOf(fit->key), fit->judgement.reason)});
    if (!blind.empty())
        findings.push_back({Tone::Warning,
                            "There is no reference for this scene: errors are the spread between "
                            "replicates, which does not contain a bias."});
    const auto noisy = [](const ConfigurationFit* fit) {
        return fit->has_reference && fit->source == ErrorSource::BetweenReplicates;
    };
    if (std::any_of(fits.begin(), fits.end(), noisy))
        findings.push_back({Tone::Neutral,
                            "The reference is too noisy to measure errors against: errors are the spread "
                            "between replicates, and the reference judges bias."});
    for (const ConfigurationFit* fit : fits) {
        if (!fit->fitted || !fit->error.flattening) continue;
        const double floor = std::sqrt(std::max(fit->error.floor().value, 0.0));
        findings.push_back({floor > margin ? Tone::Bad : Tone::Warning,
                            fmt::format("{} flattens: its error stops falling near {}.", labelOf(fit->key),
                                        percentText(floor, 2))});
    }
    return findings;
}

/// The rate at which error falls: one sentence for all.
std::vector<Finding> slopes(const Fits& fits) {
    Fits fitted;
    for (const ConfigurationFit* fit : fits)
        if (fit->fitted && fit->unknown_error.empty() && std::isfinite(fit->slope_samples.value))
            fitted.push_back(fit);
    if (fitted.empty()) return {};
    const auto [steepest, flattest] = std::minmax_element(
        fitted.begin(), fitted.end(),
        [](const auto* a, const auto* b) { return a->slope_samples.value < b->slope_samples.value; });
    const auto slope = [](const ConfigurationFit& fit) {
        return fmt::format("{} from {:.0f} to {:.0f} samples ({})", numberText(fit.slope_samples),
                           fit.slope_range[0], fit.slope_range[1], labelOf(fit.key));
    };
    std::string text = "Error falls with samples to the power " + slope(**steepest);
    if ((*steepest)->slope_samples.value != (*flattest)->slope_samples.value)
        text += " to " + slope(**flattest);
    return {{Tone::Neutral, text + "; independent samples have −0.5."}};
}

/// Compares the error that an image states with its actual error, by the interval of the figure: right as
/// far as is known, off by less than a tenth, or wrong. A tenth is what one would act upon.
Finding trustIn(const ConfigurationFit& fit) {
    constexpr double kTenth = 1.1;
    const Estimate& ratio = *fit.points.back().calibration;
    const std::string name = labelOf(fit.key), text = numberText(ratio);
    if (!std::isfinite(ratio.high) || !(ratio.low > 0))
        return {Tone::Warning, fmt::format("It is unknown whether the error that {} states is right: "
                                           "predicted over actual is {}.",
                                           name, text)};
    const bool holds_one = ratio.low <= 1 && 1 <= ratio.high;
    if (holds_one && ratio.low > 1 / kTenth && ratio.high < kTenth)
        return {
            Tone::Good,
            fmt::format("The error that {} states can be trusted: predicted over actual is {}.",
                        name, text)};
    if (holds_one)
        return {Tone::Neutral, fmt::format("The error that {} states shows no fault, but is known to no "
                                           "better than a tenth: predicted over actual is {}.",
                                           name, text)};
    const char* how = ratio.value < 1 ? "understates" : "overstates";
    if (ratio.value > 1 / kTenth && ratio.value < kTenth)
        return {Tone::Neutral,
                fmt::format("{} {} its own error by less than a tenth: predicted over actual is {}.", name,
                            how, text)};
    return {Tone::Warning,
            fmt::format("{} {} its own error: predicted over actual is {}.", name, how, text)};
}

/// At the most samples. Of equal bits one stands for all.
std::vector<Finding> trust(const Fits& fits) {
    std::vector<Finding> findings;
    std::vector<Key> told;
    for (const ConfigurationFit* fit : fits) {
        // An image cannot see its own bias; where there is one, that is said already.
        if (fit->points.empty() || !fit->points.back().calibration || fit->error.flattening ||
            !fit->unknown_error.empty())
            continue;
        if (!std::isfinite(fit->points.back().calibration->value) ||
            std::find(told.begin(), told.end(), fit->key) != told.end())
            continue;
        told.insert(told.end(), fit->same_bits.begin(), fit->same_bits.end());
        findings.push_back(trustIn(*fit));
    }
    return findings;
}

std::vector<Finding> unknownErrors(const Fits& fits) {
    std::vector<Finding> findings;
    for (const ConfigurationFit* fit : fits)
        if (!fit->unknown_error.empty())
            findings.push_back({Tone::Warning, fmt::format("The error of {} is not yet known: {}.",
                                                           labelOf(fit->key), fit->unknown_error)});
    return findings;
}

std::vector<Finding> omissions(const Run& run, const std::string& scene) {
    std::vector<Finding> findings;
    for (const Configuration& configuration : run.configurations)
        if (configuration.key.scene == scene && !configuration.omitted.empty())
            findings.push_back({Tone::Warning, fmt::format("{} was left out: {}", labelOf(configuration.key),
                                                           configuration.omitted)});
    return findings;
}

void append(std::vector<Finding>& to, std::vector<Finding> from) {
    std::move(from.begin(), from.end(), std::back_inserter(to));
}

}  // namespace

std::vector<Finding> findingsOfScene(const Run& run, const Analysis& analysis, const std::string& scene) {
    Fits fits;
    for (std::size_t i = 0; i < run.configurations.size(); ++i)
        if (run.configurations[i].key.scene == scene && run.configurations[i].omitted.empty())
            fits.push_back(&analysis.fits.at(i));
    std::vector<Finding> findings;
    if (!fits.empty())
        for (std::size_t which = 0; which < analysis.options.targets.size(); ++which)
            findings.push_back(
                race(fits, which, analysis.options.targets[which], analysis.options.confidence));
    append(findings, commonRace(fits, analysis.options.confidence));
    append(findings, efficiency(fits, analysis.options.confidence));
    append(findings, sameBits(fits));
    append(findings, slopes(fits));
    append(findings, bias(fits, analysis.options.equivalence_margin));
    append(findings, unknownErrors(fits));
    append(findings, trust(fits));
    append(findings, omissions(run, scene));
    return findings;
}

std::vector<std::string> scenesOf(const Run& run) {
    std::vector<std::string> scenes;
    for (const Configuration& configuration : run.configurations)
        if (std::find(scenes.begin(), scenes.end(), configuration.key.scene) == scenes.end())
            scenes.push_back(configuration.key.scene);
    return scenes;
}

std::string verdictLine(const ConfigurationFit& fit) {
    std::string text = fmt::format("{} {}: ", fit.key.scene, labelOf(fit.key));
    if (!fit.points.empty()) {
        if (fit.unknown_error.empty())
            text += fmt::format("error {} at {} spp", errorText(fit.points.back().relative_rmse),
                                fit.points.back().samples);
        else
            text += fmt::format("error not yet known at {} spp", fit.points.back().samples);
        if (fit.fitted && fit.unknown_error.empty() && std::isfinite(fit.slope_samples.value))
            text += fmt::format(", slope {} from {:.0f} spp on", numberText(fit.slope_samples),
                                fit.slope_range[0]);
        text += ", ";
    }
    return text + fmt::format("{}: {}", stats::verdictName(fit.judgement.verdict), fit.judgement.reason);
}

std::string labelOf(const Key& key) {
    return key.variant.empty() ? key.backend : key.backend + ", " + key.variant;
}

}  // namespace crt::converge
