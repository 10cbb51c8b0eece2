#include "judge/converge/judgement.h"

#include "film/luminance_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace crt::converge {
namespace {

using stats::Verdict;

/// "+0.31 %", with a true minus sign.
std::string signedPercent(double value) {
    return fmt::format("{}{:.2g} %", value < 0 ? "−" : "+", 100 * std::abs(value));
}

std::string voidText(const ConfigurationFit& fit) {
    return fmt::format("{} row{} void: samples were NaN or infinite.", fit.void_rows,
                       fit.void_rows == 1 ? " is" : "s are");
}

double foldsOf(const ReferenceInfo& reference) {
    return reference.fold_mean_luminance.empty() ? 8
                                                 : static_cast<double>(reference.fold_mean_luminance.size());
}

/// Every replicate's mean lies above what is allowed, and the signs of this number of replicates are proof:
/// the noise of light has its long tail above, so that a replicate without bias is too bright with a
/// probability of one half at most. Too dark it may well be, where light is found by rare paths that none of
/// them has met.
bool surelyTooBright(const RowList& rows, const ReferenceInfo& reference, std::size_t channel,
                     const FitOptions& options) {
    if (std::exp2(-static_cast<double>(rows.size())) > (1 - options.verdict_confidence) / 3) return false;
    const double truth = reference.image_mean[channel],
                 margin = options.equivalence_margin * stats::channelScale(truth, reference.mean_luminance);
    const double of_reference =
        reference.image_mean_standard_error[channel] *
        stats::studentQuantile(0.5 + 0.5 * options.verdict_confidence, foldsOf(reference) - 1);
    return std::all_of(rows.begin(), rows.end(), [&](const Row* row) {
        return row->image_mean[channel] > truth + margin + of_reference;
    });
}

/// Equivalence of all three channels, and the end of an interval that lies farthest out.
struct Pooled {
    Verdict verdict = Verdict::Pass;
    bool too_bright = false;  ///< In a channel, by the signs of the replicates: see surelyTooBright().
    double worst = 0;
    std::array<Estimate, 3> mean_bias;
};
Pooled poolChannels(const RowList& rows, const ReferenceInfo& reference, const FitOptions& options) {
    Pooled pooled;
    for (std::size_t channel = 0; channel < 3; ++channel) {
        const Estimate bias = meanBias(rows, reference, channel, options.verdict_confidence);
        pooled.mean_bias[channel] = bias;
        pooled.too_bright = pooled.too_bright || surelyTooBright(rows, reference, channel, options);
        const Verdict verdict = stats::equivalence({bias.low, bias.high}, options.equivalence_margin);
        if (verdict == Verdict::Fail ||
            (verdict == Verdict::Inconclusive && pooled.verdict == Verdict::Pass))
            pooled.verdict = verdict;
        if (std::max(std::abs(bias.low), std::abs(bias.high)) > std::abs(pooled.worst))
            pooled.worst = std::abs(bias.low) > std::abs(bias.high) ? bias.low : bias.high;
    }
    return pooled;
}

double relativeVarianceOf(const ReferenceInfo& reference) {
    return std::pow(stats::relativeRmse(reference.mean_variance, reference.mean_luminance), 2);
}

/// Verdicts of replicates, tiles and pixels with a reference; empty if they find no error.
std::optional<Judgement> faultOf(const ConfigurationFit& fit, const ImageTests& tests, const Pooled& pooled,
                                 const ReferenceInfo& reference, const FitOptions& options) {
    const double margin = options.equivalence_margin, confidence = 100 * options.verdict_confidence;
    if (pooled.verdict == Verdict::Fail && (!tests.heavy_tails || pooled.too_bright))
        return Judgement{Verdict::Fail,
                         fmt::format("The image mean is off by more than {:.2g} % at {:.3g} % confidence.",
                                     100 * margin, confidence),
                         {}};
    // A few values that carry the answer make intervals too short and too long alike: no verdict could be
    // trusted.
    if (tests.heavy_tails)
        return Judgement{
            Verdict::Inconclusive,
            fmt::format("One value carries {:.2g} % of the squared error, more than normal noise allows: "
                        "the error bar is unreliable.",
                        100 * tests.largest_share.value_or(0)),
            {}};
    if (fit.fitted && fit.error.verdict_floor.low > margin * margin) {
        if (fit.error.floor().value < relativeVarianceOf(reference))
            return Judgement{Verdict::Inconclusive,
                             "The error has a floor, but it is below the error of the reference. A "
                             "reference with more samples would decide.",
                             {}};
        return Judgement{Verdict::Fail,
                         fmt::format("The error does not fall below {:.2g} %: pixels are off.",
                                     100 * std::sqrt(fit.error.verdict_floor.low)),
                         {}};
    }
    if (tests.smallest_tile_p && *tests.smallest_tile_p < options.family_alpha)
        return Judgement{Verdict::Fail,
                         fmt::format("A tile differs from the reference (p = {:.1e} after Holm).",
                                     *tests.smallest_tile_p),
                         {}};
    if (tests.smallest_pixel_p && *tests.smallest_pixel_p < options.family_alpha)
        // No proof: where light is found by rare chance, a pixel's replicates may all have missed it and
        // agree with each other on too little.
        return Judgement{Verdict::Inconclusive,
                         fmt::format("A pixel differs from the reference (p = {:.1e} after Šidák), or "
                                     "there are too few replicates for a normal distribution. More samples "
                                     "would decide.",
                                     *tests.smallest_pixel_p),
                         {}};
    return std::nullopt;
}

}  // namespace

Estimate meanBias(const RowList& rows, const ReferenceInfo& reference, std::optional<std::size_t> channel,
                  double confidence) {
    const double truth = channel ? reference.image_mean[*channel] : reference.mean_luminance;
    const double scale = channel ? stats::channelScale(truth, reference.mean_luminance) : std::abs(truth);
    std::vector<double> means;
    for (const Row* row : rows) means.push_back(channel ? row->image_mean[*channel] : row->mean_luminance);
    const stats::Summary summary = stats::summarize(means);
    const double of_reference =
        channel ? reference.image_mean_standard_error[*channel] : reference.mean_luminance_standard_error;
    const double a = summary.variance / static_cast<double>(summary.count), b = of_reference * of_reference;
    const double folds = foldsOf(reference);
    const double bias = (summary.mean - truth) / scale;
    if (a + b == 0) return {bias, bias, bias};
    const double dof =
        (a + b) * (a + b) / (a * a / static_cast<double>(summary.count - 1) + b * b / (folds - 1));
    const double half = stats::studentQuantile(0.5 + 0.5 * confidence, dof) * std::sqrt(a + b) / scale;
    return {bias, bias - half, bias + half};
}

Judgement judge(const ConfigurationFit& fit, const ImageTests& tests, const RowsBySamples& by_samples,
                const ReferenceInfo* reference, const FitOptions& options) {
    RowList rows;
    if (const auto last = lastFullColumn(by_samples); last != by_samples.rend()) rows = rowsOf(last->second);
    std::optional<Pooled> pooled;
    if (fit.has_reference && !rows.empty()) pooled = poolChannels(rows, *reference, options);
    Judgement judgement;
    if (fit.void_rows > 0) {
        judgement = {Verdict::Fail, voidText(fit), {}};
    } else if (rows.empty()) {
        judgement = {Verdict::Inconclusive, "Fewer than two replicates were rendered.", {}};
    } else if (!pooled) {
        judgement = {Verdict::Inconclusive, "There is no reference, so a bias is invisible.", {}};
    } else if (const std::optional<Judgement> fault = faultOf(fit, tests, *pooled, *reference, options)) {
        judgement = *fault;
    } else {
        const double margin = 100 * options.equivalence_margin,
                     confidence = 100 * options.verdict_confidence;
        const std::string worst = signedPercent(pooled->worst);
        judgement = {pooled->verdict,
                     pooled->verdict == Verdict::Pass
                         ? fmt::format("The image mean is within ±{:.2g} % of the reference; the {:.3g} % "
                                       "interval reaches {}.",
                                       margin, confidence, worst)
                         : fmt::format("The {:.3g} % interval of the image mean's bias reaches {}; ±{:.2g} "
                                       "% is allowed. More samples would decide.",
                                       confidence, worst, margin),
                     {}};
    }
    if (pooled) judgement.mean_bias = pooled->mean_bias;
    return judgement;
}

}  // namespace crt::converge
