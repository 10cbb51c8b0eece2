#include "converge/findings.h"

#include "converge/quantity_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace crt::converge {
namespace {

using Fits = std::vector<const ConfigurationFit*>;

/// Quotient of two independent positive estimates: on a logarithmic scale half widths add in quadrature.
Estimate quotient(const Estimate& a, const Estimate& b) {
    const double value = a.value / b.value, half = std::hypot(std::log(a.high / a.value), std::log(b.high / b.value));
    return {value, value * std::exp(-half), value * std::exp(half)};
}


std::string configurations(std::size_t count) { return count == 1 ? "1 configuration" : fmt::format("{} configurations", count); }

/// Who reaches the target first, and how much sooner than the next.
Finding race(const Fits& fits, std::size_t which, double relative_rmse) {
    Fits reached, projected;
    for (const ConfigurationFit* fit : fits) {
        if (!fit->fitted || !fit->targets.at(which).seconds) continue;
        (fit->targets[which].reached ? reached : projected).push_back(fit);
    }
    const auto sooner = [&](const ConfigurationFit* a, const ConfigurationFit* b) {
        return a->targets[which].seconds->value < b->targets[which].seconds->value;
    };
    std::sort(reached.begin(), reached.end(), sooner);
    std::sort(projected.begin(), projected.end(), sooner);
    const std::string goal = percentText(relative_rmse, 1);
    if (reached.empty()) {
        if (projected.empty()) return {Tone::Warning, fmt::format("No configuration reached {} relative RMSE.", goal)};
        return {Tone::Neutral, fmt::format("No configuration reached {} relative RMSE; {} would be the first, after about {}.", goal,
                                           labelOf(projected[0]->key), secondsText(projected[0]->targets[which].seconds->value, 2))};
    }
    const Target& first = reached[0]->targets[which];
    std::string text = fmt::format("{} reaches {} relative RMSE first: {}{}, start-up included", labelOf(reached[0]->key), goal,
                                   first.at_first_point ? "at most " : "", secondsText(*first.seconds));
    if (reached.size() > 1) {
        const Estimate factor = quotient(*reached[1]->targets[which].seconds, *first.seconds);
        if (factor.low > 1)
            text += fmt::format(", {} times sooner than the next, {}", numberText(factor, 2), labelOf(reached[1]->key));
        else
            text += fmt::format("; the next, {}, is not distinguishable from it", labelOf(reached[1]->key));
    } else if (fits.size() > 1) {
        text += "; no other did";
    }
    return {Tone::Neutral, text + "."};
}

/// Render time alone: what is left when start-up is forgotten.
std::vector<Finding> efficiency(const Fits& fits) {
    Fits fitted;
    for (const ConfigurationFit* fit : fits)
        if (fit->fitted && std::isfinite(fit->efficiency.value)) fitted.push_back(fit);
    if (fitted.size() < 2) return {};
    std::sort(fitted.begin(), fitted.end(), [](const auto* a, const auto* b) { return a->efficiency.value > b->efficiency.value; });
    const Estimate factor = quotient(fitted.front()->efficiency, fitted.back()->efficiency);
    return {{Tone::Neutral, fmt::format("Start-up aside, {} is the most efficient: {} times the least, {}.", labelOf(fitted.front()->key),
                                        numberText(factor, 2), labelOf(fitted.back()->key))}};
}

std::vector<Finding> bias(const Fits& fits, double margin) {
    std::vector<Finding> findings;
    Fits pass, unclear, blind;
    for (const ConfigurationFit* fit : fits) {
        switch (fit->judgement.verdict) {
            case stats::Verdict::Fail: findings.push_back({Tone::Bad, fmt::format("{} FAILS: {}", labelOf(fit->key), fit->judgement.reason)}); break;
            case stats::Verdict::Pass: pass.push_back(fit); break;
            case stats::Verdict::Inconclusive: (fit->source == ErrorSource::Reference ? unclear : blind).push_back(fit); break;
        }
    }
    if (!pass.empty())
        findings.push_back({Tone::Good, fmt::format("No bias that matters: the image mean of {} lies within ±{} of the reference.",
                                                    pass.size() == fits.size() ? "every configuration" : configurations(pass.size()), percentText(margin, 1))});
    for (const ConfigurationFit* fit : unclear)
        findings.push_back({Tone::Warning, fmt::format("{} is undecided: {}", labelOf(fit->key), fit->judgement.reason)});
    if (!blind.empty())
        findings.push_back({Tone::Warning, "There is no reference for this scene: errors are the spread between replicates, in which a bias does not show."});
    for (const ConfigurationFit* fit : fits) {
        if (!fit->fitted || !fit->error.flattening) continue;
        const double floor = std::sqrt(std::max(fit->error.floor().value, 0.0));
        findings.push_back({floor > margin ? Tone::Bad : Tone::Warning,
                            fmt::format("{} flattens: its error stops falling near {}.", labelOf(fit->key), percentText(floor, 2))});
    }
    return findings;
}

/// How fast error falls: one sentence for all.
std::vector<Finding> slopes(const Fits& fits) {
    Fits fitted;
    for (const ConfigurationFit* fit : fits)
        if (fit->fitted && std::isfinite(fit->slope_samples.value)) fitted.push_back(fit);
    if (fitted.empty()) return {};
    const auto [steepest, flattest] = std::minmax_element(
        fitted.begin(), fitted.end(), [](const auto* a, const auto* b) { return a->slope_samples.value < b->slope_samples.value; });
    std::string text = fmt::format("Error falls with samples to the power {} ({})", numberText((*steepest)->slope_samples), labelOf((*steepest)->key));
    if (*steepest != *flattest) text += fmt::format(" to {} ({})", numberText((*flattest)->slope_samples), labelOf((*flattest)->key));
    return {{Tone::Neutral, text + "; independent samples have −0.5."}};
}

/// Whether what images say of their own error is right, at the most samples that every replicate reached.
std::vector<Finding> trust(const Fits& fits) {
    Fits judged, wrong;
    double low = std::numeric_limits<double>::infinity(), high = 0;
    for (const ConfigurationFit* fit : fits) {
        // An image cannot see its own bias; where there is one, that is said already.
        if (fit->points.empty() || !fit->points.back().calibration || fit->error.flattening) continue;
        const Estimate& ratio = *fit->points.back().calibration;
        if (!std::isfinite(ratio.value)) continue;
        judged.push_back(fit);
        low = std::min(low, ratio.value);
        high = std::max(high, ratio.value);
        // A tenth is what one would act upon; less than the interval cannot be told.
        if (std::abs(ratio.value - 1) > 0.1 && (ratio.low > 1 || ratio.high < 1)) wrong.push_back(fit);
    }
    if (judged.empty()) return {};
    if (wrong.empty())
        return {{Tone::Good, fmt::format("The images' own error estimates can be trusted: predicted over actual error is {}.",
                                         judged.size() == 1 ? numberText(low) : numberText(low) + " to " + numberText(high))}};
    std::vector<Finding> findings;
    for (const ConfigurationFit* fit : wrong) {
        const Estimate& ratio = *fit->points.back().calibration;
        findings.push_back({Tone::Warning, fmt::format("{} {} its own error: predicted over actual is {}.", labelOf(fit->key),
                                                       ratio.value < 1 ? "understates" : "overstates", numberText(ratio))});
    }
    if (wrong.size() < judged.size())
        findings.push_back({Tone::Good, fmt::format("What {} of {} say of their own error can be trusted.", judged.size() - wrong.size(), judged.size())});
    return findings;
}

std::vector<Finding> omissions(const Run& run, const std::string& scene) {
    std::vector<Finding> findings;
    for (const Configuration& configuration : run.configurations)
        if (configuration.key.scene == scene && !configuration.omitted.empty())
            findings.push_back({Tone::Warning, fmt::format("{} was left out: {}", labelOf(configuration.key), configuration.omitted)});
    return findings;
}

void append(std::vector<Finding>& to, std::vector<Finding> from) {
    std::move(from.begin(), from.end(), std::back_inserter(to));
}

}  // namespace

std::vector<Finding> findingsOfScene(const Run& run, const Analysis& analysis, const std::string& scene) {
    Fits fits;
    for (std::size_t i = 0; i < run.configurations.size(); ++i)
        if (run.configurations[i].key.scene == scene && run.configurations[i].omitted.empty()) fits.push_back(&analysis.fits.at(i));
    std::vector<Finding> findings;
    if (!fits.empty())
        for (std::size_t which = 0; which < analysis.options.targets.size(); ++which)
            findings.push_back(race(fits, which, analysis.options.targets[which]));
    append(findings, efficiency(fits));
    append(findings, slopes(fits));
    append(findings, bias(fits, analysis.options.equivalence_margin));
    append(findings, trust(fits));
    append(findings, omissions(run, scene));
    return findings;
}

std::vector<std::string> scenesOf(const Run& run) {
    std::vector<std::string> scenes;
    for (const Configuration& configuration : run.configurations)
        if (std::find(scenes.begin(), scenes.end(), configuration.key.scene) == scenes.end()) scenes.push_back(configuration.key.scene);
    return scenes;
}

std::string verdictLine(const ConfigurationFit& fit) {
    std::string text = fmt::format("{} {}: ", fit.key.scene, labelOf(fit.key));
    if (!fit.points.empty()) {
        text += fmt::format("error {} at {} spp", errorText(fit.points.back().relative_rmse), fit.points.back().samples);
        if (fit.fitted && std::isfinite(fit.slope_samples.value)) text += fmt::format(", slope {}", numberText(fit.slope_samples));
        text += ", ";
    }
    return text + fmt::format("{}: {}", stats::verdictName(fit.judgement.verdict), fit.judgement.reason);
}

std::string labelOf(const Key& key) { return key.variant.empty() ? key.backend : key.backend + ", " + key.variant; }

}  // namespace crt::converge
