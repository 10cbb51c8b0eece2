#include "converge/fits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <span>

namespace crt::converge {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

using Replicates = std::span<const std::size_t>;
using Functional = std::function<double(Replicates)>;

enum class Scale { Linear, Logarithmic };

/// Tukey's jackknife: pseudo-values R·θ − (R − 1)·θ₍₋ᵣ₎ are treated as R independent values of θ. A functional that is undefined (not finite) on some
/// subset has no bounds. `widening` multiplies the half width. Of very many replicates, whole groups are left out instead of single ones (Wolter,
/// Introduction to Variance Estimation, 4.2): the time would grow with R², and no interval is better for more degrees of freedom.
Estimate jackknife(std::size_t count, const Functional& functional, Scale scale, double confidence, double widening = 1) {
    constexpr std::size_t kMostGroups = 256;
    const std::size_t groups = std::min(count, kMostGroups);
    std::vector<std::size_t> all(count);
    std::iota(all.begin(), all.end(), std::size_t{0});
    const auto onScale = [&](Replicates replicates) {
        const double value = functional(replicates);
        return scale == Scale::Logarithmic ? std::log(value) : value;
    };
    const auto back = [&](double value) { return scale == Scale::Logarithmic ? std::exp(value) : value; };
    const double whole = onScale(all);
    if (!std::isfinite(whole)) return {kNaN, kNaN, kNaN};

    const Estimate unbounded{back(whole), back(-kInfinity), kInfinity};
    if (count < 2) return unbounded;
    std::vector<double> pseudo_values(groups);
    for (std::size_t left_out = 0; left_out < groups; ++left_out) {
        std::vector<std::size_t> rest;
        std::copy_if(all.begin(), all.end(), std::back_inserter(rest), [&](std::size_t r) { return r % groups != left_out; });
        const double without = onScale(rest);
        if (!std::isfinite(without)) return unbounded;
        pseudo_values[left_out] = static_cast<double>(groups) * whole - static_cast<double>(groups - 1) * without;
    }
    const double half = widening * stats::meanInterval(stats::summarize(pseudo_values), confidence).halfWidth();
    return {back(whole), back(whole - half), back(whole + half)};
}

/// An estimate of b² whose interval is no narrower than `spread`, the estimate's where b = 0, makes it. The square of a mean that happens to be right
/// hardly changes with any one replicate, so that the jackknife alone would be sure of a b² below 0.
Estimate withSpreadOfNoBias(Estimate estimate, double spread, std::size_t replicates, double confidence) {
    if (!std::isfinite(estimate.value) || replicates < 2) return estimate;
    const double half = stats::studentQuantile(0.5 + 0.5 * confidence, static_cast<double>(replicates - 1)) * spread;
    return {estimate.value, std::min(estimate.low, estimate.value - half), std::max(estimate.high, estimate.value + half)};
}

/// The rows of one configuration that count, as [replicate][column]; every replicate has every column.
struct Block {
    std::vector<double> samples;                      ///< Of the columns, ascending.
    std::vector<std::vector<const Row*>> rows;        ///< [replicate][column]
    std::size_t replicates() const { return rows.size(); }
    std::size_t columns() const { return samples.size(); }
};

using RowsBySamples = std::map<std::uint64_t, std::map<std::uint32_t, const Row*>>;

/// The largest N that at least three quarters of the replicates reached, and two at least: a budget ends in the middle of an N.
RowsBySamples::const_reverse_iterator lastFullColumn(const RowsBySamples& by_samples) {
    std::size_t most = 0;
    for (const auto& [samples, rows] : by_samples) most = std::max(most, rows.size());
    const std::size_t enough = std::max<std::size_t>(2, (3 * most + 3) / 4);
    return std::find_if(by_samples.rbegin(), by_samples.rend(), [&](const auto& column) { return column.second.size() >= enough; });
}

/// The replicates that reached that column, and the Ns that all of them have.
Block balancedBlock(const RowsBySamples& by_samples) {
    Block block;
    const auto last = lastFullColumn(by_samples);
    if (last == by_samples.rend()) return block;

    block.rows.resize(last->second.size());
    for (const auto& [samples, rows] : by_samples) {
        if (samples > last->first) break;
        const auto has = [&rows = rows](const auto& entry) { return rows.count(entry.first) == 1; };
        if (!std::all_of(last->second.begin(), last->second.end(), has)) continue;
        block.samples.push_back(static_cast<double>(samples));
        std::size_t r = 0;
        for (const auto& [replicate, row] : last->second) block.rows[r++].push_back(rows.at(replicate));
    }
    return block;
}

double average(const std::array<double, 3>& channels) { return (channels[0] + channels[1] + channels[2]) / 3; }

/// How rows of one configuration become relative errors.
struct Measure {
    ErrorSource source = ErrorSource::BetweenReplicates;
    double scale = 1;                 ///< Mean of the reference, or of the replicates.
    double reference_variance = 0;    ///< Relative².
    double pixels = 1;                ///< Of an image.

    /// Relative mean squared error. NaN where the row does not say.
    double mse(const Row& row) const {
        if (source == ErrorSource::Reference) return row.error->mse / (scale * scale) - reference_variance;
        return row.between_replicates_mse ? *row.between_replicates_mse / (scale * scale) : kNaN;
    }
    /// Its mean over replicates estimates the squared bias.
    std::optional<double> biasSquared(const Row& row) const {
        if (source != ErrorSource::Reference || !row.between_replicates_mse) return std::nullopt;
        return mse(row) - *row.between_replicates_mse / (scale * scale);
    }
    /// Standard deviation that an estimate of b² has where there is no bias, from images of that relative MSE whose pixels are independent and alike:
    /// P times the square of a mean of R normal values, less its expectation.
    double spreadOfNoBias(double relative_mse, std::size_t replicates) const {
        return std::sqrt(2 / pixels) * relative_mse / static_cast<double>(replicates);
    }
    double widening(std::size_t replicates) const {
        if (source == ErrorSource::Reference) return 1;
        return replicates > 2 ? std::sqrt(static_cast<double>(replicates - 1) / static_cast<double>(replicates - 2)) : kInfinity;
    }
};

Measure chooseMeasure(const RowsBySamples& by_samples, const ReferenceInfo* reference) {
    Measure measure;
    bool all_have_error = reference != nullptr && reference->kind != ReferenceKind::None && average(reference->image_mean) > 0;
    stats::Summary means;
    for (const auto& [samples, rows] : by_samples) {
        std::vector<double> image_means;
        for (const auto& [replicate, row] : rows) {
            all_have_error = all_have_error && row->error.has_value();
            image_means.push_back(average(row->image_mean));
        }
        means = stats::summarize(image_means);  // What is left is that of the most samples.
    }
    if (all_have_error) {
        measure.source = ErrorSource::Reference;
        measure.scale = average(reference->image_mean);
        measure.reference_variance = reference->mean_variance / (measure.scale * measure.scale);
    } else if (means.count > 0) {
        measure.scale = means.mean;
    }
    return measure;
}

double meanOver(Replicates replicates, const std::function<double(std::size_t)>& value) {
    double sum = 0;
    for (const std::size_t r : replicates) sum += value(r);
    return sum / static_cast<double>(replicates.size());
}

double secondsOf(const Row& row) { return row.seconds_before_first_sample + row.render_wall_seconds; }

/// Line through (x, y) whose errors are relative to y: weights 1/y², then 1/line², so that a low point does not weigh more for being low.
stats::LineFit relativeLine(std::span<const double> x, std::span<const double> y) {
    std::vector<double> weights(y.size());
    std::transform(y.begin(), y.end(), weights.begin(), [](double value) { return 1 / (value * value); });
    const stats::LineFit first = stats::weightedLine(x, y, weights);
    for (std::size_t i = 0; i < x.size(); ++i)
        if (const double on_line = first.at(x[i]); on_line > 0.25 * y[i]) weights[i] = 1 / (on_line * on_line);
    return stats::weightedLine(x, y, weights);
}

/// Straight line through logarithms, all points alike.
double logSlope(const std::vector<double>& x, const std::vector<double>& y) {
    std::vector<double> log_x, log_y;
    for (std::size_t i = 0; i < x.size(); ++i) {
        if (!(x[i] > 0) || !(y[i] > 0)) continue;
        log_x.push_back(std::log(x[i]));
        log_y.push_back(std::log(y[i]));
    }
    if (log_x.size() < 3) return kNaN;
    return stats::weightedLine(log_x, log_y, std::vector<double>(log_x.size(), 1.0)).slope;
}

/// The fits of one configuration, for any subset of its replicates.
class Model {
public:
    Model(const Block& block, const Measure& measure) : block_(block), measure_(measure) {
        std::vector<double> before;
        for (const auto& rows : block.rows) before.push_back(rows.back()->seconds_before_first_sample);
        std::nth_element(before.begin(), before.begin() + static_cast<std::ptrdiff_t>(before.size() / 2), before.end());
        before_first_sample_ = before[before.size() / 2];
    }

    double beforeFirstSample() const { return before_first_sample_; }

    /// Relative MSE of the columns, mean over replicates.
    std::vector<double> errors(Replicates replicates) const {
        return columns(replicates, [&](const Row& row) { return measure_.mse(row); });
    }
    std::vector<double> renderSeconds(Replicates replicates) const {
        return columns(replicates, [](const Row& row) { return row.render_wall_seconds; });
    }

    stats::LineFit timeLine(Replicates replicates) const { return relativeLine(block_.samples, renderSeconds(replicates)); }

    /// Intercept b², slope v.
    stats::LineFit errorLine(Replicates replicates) const {
        std::vector<double> x, y;
        const std::vector<double> mse = errors(replicates);
        for (std::size_t i = 0; i < mse.size(); ++i) {
            if (!(mse[i] > 0)) continue;  // Below the noise of the reference: nothing relative can be said.
            x.push_back(1 / block_.samples[i]);
            y.push_back(mse[i]);
        }
        if (x.size() < 3) return {kNaN, kNaN, kNaN, kNaN, kNaN, kNaN, kNaN, 0};
        return relativeLine(x, y);
    }

    double biasSquared(Replicates replicates) const {
        return weighted(columns(replicates, [&](const Row& row) { return measure_.biasSquared(row).value_or(kNaN); }));
    }
    /// Measure's, all columns taken for one: they are looks at the same renders.
    double spreadOfNoBias(Replicates replicates) const { return measure_.spreadOfNoBias(weighted(errors(replicates)), replicates.size()); }

    double slopeSamples(Replicates replicates) const { return logSlope(block_.samples, errors(replicates)) / 2; }

    /// Columns whose render time is no more than the jitter of its start say nothing of t − t0.
    double slopeSeconds(Replicates replicates, const Estimate& launch) const {
        std::vector<double> seconds = renderSeconds(replicates);
        for (double& t : seconds) {
            t -= launch.value;
            if (t < 3 * (launch.high - launch.value)) t = -1;
        }
        return logSlope(seconds, errors(replicates)) / 2;
    }

    double efficiency(Replicates replicates) const { return 1 / (errorLine(replicates).slope * timeLine(replicates).slope); }

    /// Samples at which the relative MSE falls to `target`: on the straight line between points in logarithms; beyond the last, on the line of the
    /// last four where `extrapolate` allows it. NaN when it is not reached.
    double samplesTo(Replicates replicates, double target, bool extrapolate) const {
        const std::vector<double> mse = errors(replicates);
        if (mse[0] <= target) return block_.samples[0];
        for (std::size_t i = 1; i < mse.size(); ++i) {
            if (!(mse[i] <= target)) continue;
            const double low = std::max(mse[i], 1e-3 * target);  // Not above 0 below the reference's noise.
            return block_.samples[i - 1] * std::pow(block_.samples[i] / block_.samples[i - 1], std::log(target / mse[i - 1]) / std::log(low / mse[i - 1]));
        }
        if (!extrapolate) return kNaN;
        const std::size_t first = mse.size() > 4 ? mse.size() - 4 : 0;
        const double slope = logSlope({block_.samples.begin() + static_cast<std::ptrdiff_t>(first), block_.samples.end()},
                                      {mse.begin() + static_cast<std::ptrdiff_t>(first), mse.end()});
        return slope < -0.2 ? block_.samples.back() * std::pow(target / mse.back(), 1 / slope) : kNaN;
    }

    double secondsTo(Replicates replicates, double target, bool extrapolate) const {
        const double samples = samplesTo(replicates, target, extrapolate);
        const stats::LineFit line = timeLine(replicates);
        const std::vector<double> seconds = renderSeconds(replicates);
        const auto right = std::lower_bound(block_.samples.begin(), block_.samples.end(), samples);
        if (!std::isfinite(samples)) return kNaN;
        if (right == block_.samples.end()) return before_first_sample_ + line.at(samples);
        const auto i = static_cast<std::size_t>(right - block_.samples.begin());
        if (i == 0) return before_first_sample_ + seconds[0];
        const double share = (samples - block_.samples[i - 1]) / (block_.samples[i] - block_.samples[i - 1]);
        return before_first_sample_ + seconds[i - 1] + share * (seconds[i] - seconds[i - 1]);
    }

private:
    /// Mean over columns for estimates of b², whose variance falls with 1/N² or faster.
    double weighted(const std::vector<double>& of_columns) const {
        double sum = 0, weights = 0;
        for (std::size_t i = 0; i < of_columns.size(); ++i) {
            const double weight = block_.samples[i] * block_.samples[i];
            sum += weight * of_columns[i];
            weights += weight;
        }
        return sum / weights;
    }
    std::vector<double> columns(Replicates replicates, const std::function<double(const Row&)>& value) const {
        std::vector<double> means(block_.columns());
        for (std::size_t i = 0; i < means.size(); ++i)
            means[i] = meanOver(replicates, [&](std::size_t r) { return value(*block_.rows[r][i]); });
        return means;
    }

    const Block& block_;
    const Measure& measure_;
    double before_first_sample_ = 0;
};

/// Relative bias of the image mean, channels averaged where `channel` is empty. Replicates and reference both err.
Estimate meanBias(const std::vector<const Row*>& rows, const ReferenceInfo& reference, std::optional<std::size_t> channel, double confidence) {
    std::vector<double> ratios;
    const auto ratio = [&](const std::array<double, 3>& means) {
        return channel ? means[*channel] / reference.image_mean[*channel] : average(means) / average(reference.image_mean);
    };
    for (const Row* row : rows) ratios.push_back(ratio(row->image_mean));
    const stats::Summary summary = stats::summarize(ratios);
    const double of_reference = channel ? reference.image_mean_standard_error[*channel] / reference.image_mean[*channel]
                                        : average(reference.image_mean_standard_error) / average(reference.image_mean);
    const double half = std::hypot(stats::meanInterval(summary, confidence).halfWidth(), stats::normalQuantile(0.5 + confidence / 2) * of_reference);
    return {summary.mean - 1, summary.mean - 1 - half, summary.mean - 1 + half};
}

std::optional<double> meanOfKnown(const std::vector<const Row*>& rows, const std::function<std::optional<double>(const ErrorMetrics&)>& metric) {
    std::vector<double> values;
    for (const Row* row : rows) {
        const std::optional<double> value = row->error ? metric(*row->error) : std::nullopt;
        if (!value) return std::nullopt;
        values.push_back(*value);
    }
    return stats::summarize(values).mean;
}

/// Predicted over actual error, both as root mean squares over replicates, and how often a prediction's interval holds the actual error.
void calibrate(Point& point, const std::vector<const Row*>& rows, const Measure& measure, double confidence) {
    const double actual_mse = point.relative_rmse.value * point.relative_rmse.value;
    for (const Row* row : rows) {
        if (!row->predicted_relative_rmse) continue;
        const double actual = std::sqrt(measure.source == ErrorSource::Reference ? measure.mse(*row) : actual_mse);
        ++point.predicted;
        point.covered += row->predicted_relative_rmse->low <= actual && actual <= row->predicted_relative_rmse->high ? 1 : 0;
    }
    if (point.predicted != rows.size()) return;
    point.calibration = jackknife(rows.size(), [&](Replicates replicates) {
        const double predicted = meanOver(replicates, [&](std::size_t r) { return std::pow(rows[r]->predicted_relative_rmse->value, 2); });
        return std::sqrt(predicted / meanOver(replicates, [&](std::size_t r) { return measure.mse(*rows[r]); }));
    }, Scale::Logarithmic, confidence, measure.widening(rows.size()));
}

Point makePoint(std::uint64_t samples, const std::vector<const Row*>& rows, const Measure& measure, const ReferenceInfo* reference,
                const FitOptions& options) {
    const auto over = [&](const std::function<double(const Row&)>& value) {
        return [&rows, value](Replicates replicates) { return meanOver(replicates, [&](std::size_t r) { return value(*rows[r]); }); };
    };
    const auto estimate = [&](const Functional& functional, Scale scale, double widening = 1) {
        return jackknife(rows.size(), functional, scale, options.confidence, widening);
    };
    const double widening = measure.widening(rows.size());
    const Functional mse = over([&](const Row& row) { return measure.mse(row); });
    const Functional seconds = over(secondsOf);

    Point point;
    point.samples = samples;
    point.replicates = static_cast<std::uint32_t>(rows.size());
    point.seconds = estimate(seconds, Scale::Logarithmic);
    point.render_seconds = estimate(over([](const Row& row) { return row.render_wall_seconds; }), Scale::Logarithmic);
    point.relative_rmse = estimate([&](Replicates replicates) { return std::sqrt(mse(replicates)); }, Scale::Logarithmic, widening);
    point.efficiency = estimate([&](Replicates replicates) { return 1 / (mse(replicates) * seconds(replicates)); }, Scale::Logarithmic, widening);
    const bool knows_bias = std::all_of(rows.begin(), rows.end(), [&](const Row* row) { return measure.biasSquared(*row).has_value(); });
    if (knows_bias)
        point.bias_squared = withSpreadOfNoBias(estimate(over([&](const Row& row) { return *measure.biasSquared(row); }), Scale::Linear),
                                                measure.spreadOfNoBias(point.relative_rmse.value * point.relative_rmse.value, rows.size()),
                                                rows.size(), options.confidence);
    if (measure.source == ErrorSource::Reference) point.mean_bias = meanBias(rows, *reference, std::nullopt, options.confidence);
    calibrate(point, rows, measure, options.confidence);
    point.relmse = meanOfKnown(rows, [](const ErrorMetrics& e) { return std::optional(e.relmse); });
    point.smape = meanOfKnown(rows, [](const ErrorMetrics& e) { return std::optional(e.smape); });
    point.mae = meanOfKnown(rows, [](const ErrorMetrics& e) { return std::optional(e.mae); });
    point.flip_mean = meanOfKnown(rows, [](const ErrorMetrics& e) { return e.flip_mean; });
    point.delta_e2000_mean = meanOfKnown(rows, [](const ErrorMetrics& e) { return e.delta_e2000_mean; });
    return point;
}

Target reachTarget(const Model& model, std::size_t replicates, double relative_rmse, const ErrorFit& error, double first_mse, double widening,
                   double confidence) {
    const double mse = relative_rmse * relative_rmse;
    std::vector<std::size_t> all(replicates);
    std::iota(all.begin(), all.end(), std::size_t{0});
    Target target;
    target.relative_rmse = relative_rmse;
    target.reached = std::isfinite(model.samplesTo(all, mse, false));
    target.at_first_point = first_mse <= mse;
    const bool forbidden = error.flattening && error.floor().low >= mse;
    if (!target.reached && forbidden) return target;
    const auto estimate = [&](const Functional& functional) { return jackknife(replicates, functional, Scale::Logarithmic, confidence, widening); };
    const Estimate samples = estimate([&](Replicates subset) { return model.samplesTo(subset, mse, true); });
    if (!std::isfinite(samples.value)) return target;
    target.samples = samples;
    target.seconds = estimate([&](Replicates subset) { return model.secondsTo(subset, mse, true); });
    return target;
}

void fit(ConfigurationFit& result, const Block& block, const Measure& measure, const FitOptions& options) {
    result.replicates = static_cast<std::uint32_t>(block.replicates());
    result.fitted = block.columns() >= 3 && block.replicates() >= 2;
    if (!result.fitted) return;
    const Model model(block, measure);
    const double widening = measure.widening(block.replicates());
    const auto estimate = [&](const Functional& functional, Scale scale, double widen, double confidence) {
        return jackknife(block.replicates(), functional, scale, confidence, widen);
    };
    std::vector<std::size_t> all(block.replicates());
    std::iota(all.begin(), all.end(), std::size_t{0});

    result.time.before_first_sample = model.beforeFirstSample();
    result.time.launch = estimate([&](Replicates r) { return model.timeLine(r).intercept; }, Scale::Linear, 1, options.confidence);
    result.time.per_sample = estimate([&](Replicates r) { return model.timeLine(r).slope; }, Scale::Logarithmic, 1, options.confidence);
    result.time.r2 = model.timeLine(all).r2;

    ErrorFit& error = result.error;
    const Functional intercept = [&](Replicates r) { return model.errorLine(r).intercept; };
    const auto biasSquared = [&](double confidence) {
        return withSpreadOfNoBias(estimate([&](Replicates r) { return model.biasSquared(r); }, Scale::Linear, 1, confidence),
                                  model.spreadOfNoBias(all), all.size(), confidence);
    };
    error.variance = estimate([&](Replicates r) { return model.errorLine(r).slope; }, Scale::Logarithmic, widening, options.confidence);
    error.intercept = estimate(intercept, Scale::Linear, widening, options.confidence);
    error.faster_than_inverse = error.intercept.high < 0;
    if (const Estimate bias = biasSquared(options.confidence); std::isfinite(bias.value)) error.bias_squared = bias;
    error.verdict_floor = error.bias_squared ? biasSquared(options.verdict_confidence)
                                             : estimate(intercept, Scale::Linear, widening, options.verdict_confidence);
    error.flattening = error.verdict_floor.low > 0;

    result.slope_samples = estimate([&](Replicates r) { return model.slopeSamples(r); }, Scale::Linear, widening, options.confidence);
    result.slope_seconds =
        estimate([&](Replicates r) { return model.slopeSeconds(r, result.time.launch); }, Scale::Linear, widening, options.confidence);
    result.efficiency = estimate([&](Replicates r) { return model.efficiency(r); }, Scale::Logarithmic, widening, options.confidence);
    const double first_mse = model.errors(all).front();
    for (const double target : options.targets)
        result.targets.push_back(reachTarget(model, block.replicates(), target, error, first_mse, widening, options.confidence));
}

/// "+0.31 %", with a true minus sign.
std::string signedPercent(double value) { return fmt::format("{}{:.2g} %", value < 0 ? "−" : "+", 100 * std::abs(value)); }

/// Void rows, pooled equivalence per channel, bias floor, tiles and pixels, then the guard against heavy tails: the first that speaks decides.
Judgement judge(const ConfigurationFit& fits, const ImageTests& tests, const RowsBySamples& by_samples, const ReferenceInfo* reference,
                const FitOptions& options) {
    using stats::Verdict;
    Judgement judgement;
    const auto say = [&](Verdict verdict, std::string reason) {
        judgement.verdict = verdict;
        judgement.reason = std::move(reason);
        return judgement;
    };
    std::vector<const Row*> rows;
    if (const auto last = lastFullColumn(by_samples); last != by_samples.rend())
        for (const auto& [replicate, row] : last->second) rows.push_back(row);
    Verdict pooled = Verdict::Pass;
    double worst = 0;
    if (fits.source == ErrorSource::Reference && !rows.empty()) {
        judgement.mean_bias.emplace();
        for (std::size_t channel = 0; channel < 3; ++channel) {
            if (!(reference->image_mean[channel] > 0)) continue;
            const Estimate bias = meanBias(rows, *reference, channel, options.verdict_confidence);
            (*judgement.mean_bias)[channel] = bias;
            const Verdict verdict = stats::equivalence({bias.low, bias.high}, options.equivalence_margin);
            if (verdict == Verdict::Fail || (verdict == Verdict::Inconclusive && pooled == Verdict::Pass)) pooled = verdict;
            if (std::max(std::abs(bias.low), std::abs(bias.high)) > std::abs(worst))
                worst = std::abs(bias.low) > std::abs(bias.high) ? bias.low : bias.high;
        }
    }
    const double confidence = 100 * options.verdict_confidence;
    if (fits.void_rows > 0)
        return say(Verdict::Fail, fmt::format("{} row{} void: samples were NaN or infinite.", fits.void_rows, fits.void_rows == 1 ? " is" : "s are"));
    if (rows.empty()) return say(Verdict::Inconclusive, "Fewer than two replicates were rendered.");
    if (fits.source == ErrorSource::BetweenReplicates)
        return say(Verdict::Inconclusive, "There is no reference, so a bias cannot be seen.");
    if (pooled == Verdict::Fail)
        return say(Verdict::Fail, fmt::format("The image mean is off by more than {:.2g} % at {:.3g} % confidence.", 100 * options.equivalence_margin,
                                              confidence));
    if (fits.fitted && fits.error.verdict_floor.low > options.equivalence_margin * options.equivalence_margin)
        return say(Verdict::Fail, fmt::format("The error does not fall below {:.2g} %: pixels are off.", 100 * std::sqrt(fits.error.verdict_floor.low)));
    if (tests.smallest_tile_p && *tests.smallest_tile_p < options.family_alpha)
        return say(Verdict::Fail, fmt::format("A tile differs from the reference (p = {:.1e} after Holm).", *tests.smallest_tile_p));
    if (tests.smallest_pixel_p && *tests.smallest_pixel_p < options.family_alpha)
        // No proof: where light is found by rare chance, a pixel's replicates may all have missed it and agree with each other on too little.
        return say(Verdict::Inconclusive, fmt::format("A pixel differs from the reference (p = {:.1e} after Šidák), or its replicates are too few to be normal. "
                                                      "More samples decide.",
                                                      *tests.smallest_pixel_p));
    if (tests.variance_of_variance && !(*tests.variance_of_variance < 0.1))
        return say(Verdict::Inconclusive, fmt::format("The tail is too heavy for the error bar (VOV {:.2g}, trusted below 0.1).",
                                                      *tests.variance_of_variance));
    if (tests.largest_share && !(*tests.largest_share < 0.05))
        return say(Verdict::Inconclusive, fmt::format("One value carries {:.2g} % of all squared error, too much for the error bar.", 100 * *tests.largest_share));
    if (pooled == Verdict::Inconclusive)
        return say(Verdict::Inconclusive, fmt::format("The {:.3g} % interval of the image mean's bias reaches {}; ±{:.2g} % is allowed. More samples decide.",
                                                      confidence, signedPercent(worst), 100 * options.equivalence_margin));
    return say(Verdict::Pass, fmt::format("The image mean is within ±{:.2g} % of the reference; the {:.3g} % interval reaches {}.",
                                          100 * options.equivalence_margin, confidence, signedPercent(worst)));
}

}  // namespace

const ConfigurationFit* Analysis::find(const Key& key) const {
    const auto found = std::find_if(fits.begin(), fits.end(), [&](const ConfigurationFit& fit) { return fit.key == key; });
    return found == fits.end() ? nullptr : &*found;
}

ImageTests imageTestsOf(const stats::GateResult& gate) {
    ImageTests tests;
    if (gate.not_finite > 0) return tests;
    tests.smallest_tile_p = gate.tiles.smallest_p;
    tests.tile_p_uniformity = gate.tile_uniformity_p;
    tests.smallest_pixel_p = gate.pixels.smallest_p;
    tests.largest_share = gate.largest_share;
    return tests;
}

const ReferenceInfo* findReference(const Run& run, const std::string& scene) {
    const auto found = std::find_if(run.references.begin(), run.references.end(), [&](const ReferenceInfo& r) { return r.scene == scene; });
    return found == run.references.end() ? nullptr : &*found;
}

Analysis analyze(const Run& run, const FitOptions& options) {
    Analysis analysis;
    analysis.options = options;
    for (const Configuration& configuration : run.configurations) {
        ConfigurationFit result;
        result.key = configuration.key;
        RowsBySamples by_samples;
        for (const Row& row : run.rows) {
            if (row.key != configuration.key) continue;
            if (row.isVoid())
                ++result.void_rows;
            else
                by_samples[row.samples][row.replicate] = &row;
        }
        const ReferenceInfo* reference = findReference(run, configuration.key.scene);
        Measure measure = chooseMeasure(by_samples, reference);
        measure.pixels = std::max(1.0, static_cast<double>(configuration.width) * configuration.height);
        result.source = measure.source;
        for (auto& [samples, rows] : by_samples)
            std::erase_if(rows, [&](const auto& entry) { return !std::isfinite(measure.mse(*entry.second)); });
        for (const auto& [samples, of_replicates] : by_samples) {
            if (of_replicates.size() < 2) continue;
            std::vector<const Row*> rows;
            for (const auto& [replicate, row] : of_replicates) rows.push_back(row);
            result.points.push_back(makePoint(samples, rows, measure, reference, options));
        }
        fit(result, balancedBlock(by_samples), measure, options);
        if (configuration.omitted.empty())
            result.judgement = judge(result, configuration.tests, by_samples, reference, options);
        else
            result.judgement.reason = configuration.omitted;
        analysis.fits.push_back(std::move(result));
    }
    return analysis;
}

}  // namespace crt::converge
