#include "judge/converge/error_model.h"

#include "film/luminance_error.h"
#include "film/path_facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace crt::converge {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Line through (x, y) whose errors are relative to y: weights 1/y², then 1/line², so that a low point
/// does not weigh more for being low.
stats::LineFit relativeLine(std::span<const double> x, std::span<const double> y) {
    std::vector<double> weights(y.size());
    std::transform(y.begin(), y.end(), weights.begin(), [](double value) { return 1 / (value * value); });
    const stats::LineFit first = stats::weightedLine(x, y, weights);
    for (std::size_t i = 0; i < x.size(); ++i)
        if (const double on_line = first.at(x[i]); on_line > 0.25 * y[i])
            weights[i] = 1 / (on_line * on_line);
    return stats::weightedLine(x, y, weights);
}

}  // namespace

RowList rowsOf(const std::map<std::uint32_t, const Row*>& of_replicates) {
    RowList rows;
    for (const auto& [replicate, row] : of_replicates) rows.push_back(row);
    return rows;
}

RowsBySamples::const_reverse_iterator lastFullColumn(const RowsBySamples& by_samples) {
    std::size_t most = 0;
    for (const auto& [samples, rows] : by_samples) most = std::max(most, rows.size());
    const std::size_t enough = std::max<std::size_t>(2, (3 * most + 3) / 4);
    return std::find_if(by_samples.rbegin(), by_samples.rend(),
                        [&](const auto& column) { return column.second.size() >= enough; });
}

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

double meanOver(Indices replicates, const std::function<double(std::size_t)>& value) {
    double sum = 0;
    for (const std::size_t r : replicates) sum += value(r);
    return sum / static_cast<double>(replicates.size());
}

double meanStart(const RowList& of_replicates, Indices replicates) {
    double sum = 0, timed = 0;
    for (const std::size_t r : replicates)
        if (const std::optional<double> start = of_replicates[r]->seconds_before_first_sample) {
            sum += *start;
            ++timed;
        }
    return sum / timed;
}

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

// ------------------------------------------------------------------------- Measure

Measure::Measure(const RowsBySamples& by_samples, const ReferenceInfo* reference, double pixels)
    : pixels_(pixels) {
    bool has_error =
        reference != nullptr && reference->kind != ReferenceKind::None && reference->mean_luminance != 0;
    bool has_folds = has_error && reference->fold_distance.size() >= 3;
    double mean = 0;
    for (const auto& [samples, rows] : by_samples) {
        mean = 0;
        for (const auto& [replicate, row] : rows) {
            has_error = has_error && row->error.has_value();
            has_folds = has_folds && row->fold_mse.size() == reference->fold_distance.size();
            mean += row->mean_luminance /
                    static_cast<double>(rows.size());  // The rest is that of the most samples.
        }
    }
    scale_ = std::abs(mean);
    if (!has_error) return;
    source_ = ErrorSource::Reference;
    reference_ = reference;
    scale_ = std::abs(reference->mean_luminance);
    if (has_folds) divideReference();
}

void Measure::divideReference() {
    const std::size_t count = reference_->fold_distance.size();
    for (std::size_t part = 0; part <= count; ++part) {
        Part p;
        for (std::size_t k = 0; k < count; ++k)
            if (k + 1 != part) p.folds.push_back(k);
        const auto m = static_cast<double>(p.folds.size());
        double mean = 0;
        for (const std::size_t k : p.folds) {
            mean += reference_->fold_mean_luminance[k] / m;
            for (const std::size_t l : p.folds)
                p.pairs += reference_->fold_distance[k][l] / (2 * m * (m - 1));
        }
        p.scale = std::abs(mean);
        parts_.push_back(std::move(p));
    }
}

bool Measure::referenceIsNoisy(const RowList& column) const {
    if (reference_ == nullptr || column.empty()) return false;
    double mean = 0;
    for (const Row* row : column) mean += variance(*row) / static_cast<double>(column.size());
    return reference_->mean_variance / (scale_ * scale_) > 0.1 * mean;
}

SampleCounts Measure::countsOfBias(std::size_t replicates) const {
    SampleCounts counts;
    counts.errors = replicates;
    counts.folds = parts_.empty() ? 0 : parts_.size() - 1;
    return counts;
}

SampleCounts Measure::counts(const RowList& column) const {
    const std::size_t replicates = column.size();
    SampleCounts counts;
    counts.errors = replicates;
    if (source_ == ErrorSource::Reference) {
        counts = countsOfBias(replicates);
    } else {
        // Deviations from a common mean are not independent of each other.
        const double few = replicates > 2
                               ? static_cast<double>(replicates - 1) / static_cast<double>(replicates - 2)
                               : std::numeric_limits<double>::infinity();
        counts.widening = std::sqrt(few);
    }
    counts.widening *= fewPixelsWidening(column);
    counts.unmet = column.front()->rare_luminance > 0;
    return counts;
}

/// Replicates of a few pixels often scatter as fewer values than an error needs to be known. Those that do
/// not are a selection: their scatter is too small by chance, and so are intervals from it. Normal squares
/// over K pixels have the relative variance 2/K. Their mean is independent of their relative scatter (Basu
/// 1955, Sankhyā 15), so that intervals as wide as this hold in any such selection.
double Measure::fewPixelsWidening(const RowList& column) const {
    if (!hasFewPixels(column)) return 1;
    const stats::Summary squares = stats::summarize(variancesOf(column));
    const double scatter = squares.variance / (squares.mean * squares.mean);
    return std::sqrt(std::max(1.0, 2 / *column.front()->effective_pixels / scatter));
}

bool Measure::hasFewPixels(const RowList& column) {
    constexpr double kFewPixels = 6;  // From here on 99 % of normal images have an error that is known.
    return column.size() >= 3 && column.front()->effective_pixels.value_or(kFewPixels) < kFewPixels;
}

std::vector<double> Measure::variancesOf(const RowList& column) const {
    std::vector<double> variances;
    for (const Row* row : column) variances.push_back(variance(*row));
    return variances;
}

double Measure::unmet(const Row& row, std::size_t replicates) const {
    const double of_path = row.rare_luminance / static_cast<double>(row.samples) / scale_;
    return kUnmet * of_path * of_path / (pixels_ * static_cast<double>(replicates));
}

std::string Measure::unmetReason(const RowList& column) const {
    // A heavy tail that is seen in fewer values has not shown its end (decision 0078).
    constexpr double kFewestOfHeavyTail = 500;
    const Row& row = *column.front();
    if (row.rare_luminance > 0) {
        // Without a variance between replicates their squared error stands in for it.
        const double noise = meanOver(allOf(column.size()), [&](std::size_t r) {
            return column[r]->between_replicates_mse ? variance(*column[r]) : mse(*column[r], 0);
        });
        if (noise >= unmet(row, column.size())) return {};
        return "its noise is less than that of three of the scene's brightest paths, so some may not have "
               "been sampled";
    }
    if (row.heavy_tail_values && *row.heavy_tail_values < kFewestOfHeavyTail)
        return fmt::format(
            "the noise of its pixels has a heavy tail and only {:.0f} degrees of freedom, and {} are needed",
            *row.heavy_tail_values, kFewestOfHeavyTail);
    return {};
}

double Measure::mse(const Row& row, std::size_t reference_part) const {
    return source_ == ErrorSource::Reference ? referenceMse(row, reference_part) : variance(row);
}

double Measure::referenceMse(const Row& row, std::size_t reference_part) const {
    if (parts_.empty()) return (row.error->mse - reference_->mean_variance) / (scale_ * scale_);
    const Part& part = parts_[reference_part];
    double sum = 0;
    for (const std::size_t k : part.folds) sum += row.fold_mse[k];
    return (sum / static_cast<double>(part.folds.size()) - part.pairs) / (part.scale * part.scale);
}

double Measure::variance(const Row& row) const {
    return row.between_replicates_mse ? *row.between_replicates_mse / (scale_ * scale_) : kNaN;
}

Estimate Measure::noNarrowerThanNoBias(const Estimate& estimate, double variance, const Row& row,
                                       std::size_t replicates, double confidence) const {
    if (!std::isfinite(estimate.value) || replicates < 2 || reference_ == nullptr) return estimate;
    const double of_mean = variance / static_cast<double>(replicates);
    const double of_reference = reference_->mean_variance / (scale_ * scale_), sum = of_mean + of_reference;
    if (!(sum > 0)) return estimate;
    const double pixels = row.effective_pixels.value_or(pixels_),
                 reference_pixels = reference_->effective_pixels.value_or(pixels_);
    // Pixels where both are noisy count as much as they can (Cauchy and Schwarz), which makes the interval
    // longer.
    const double pixels_of_sum =
        std::pow(sum / (of_mean / std::sqrt(pixels) + of_reference / std::sqrt(reference_pixels)), 2);
    const double folds =
        reference_->fold_distance.empty() ? 8 : static_cast<double>(reference_->fold_distance.size());
    const double dof = sum * sum /
                       (of_mean * of_mean / (pixels * static_cast<double>(replicates - 1)) +
                        of_reference * of_reference / (reference_pixels * (folds - 1)));
    const double above = sum * (stats::fisherQuantile(0.5 + 0.5 * confidence, pixels_of_sum, dof) - 1);
    const double below = sum * (1 - stats::fisherQuantile(0.5 - 0.5 * confidence, pixels_of_sum, dof));
    return {estimate.value, std::min(estimate.low, estimate.value - above),
            std::max(estimate.high, estimate.value + below)};
}

// ------------------------------------------------------------------------- ErrorModel

ErrorModel::ErrorModel(Block block, const Measure& measure) : block_(std::move(block)), measure_(measure) {
    const std::vector<std::size_t> all = allOf(block_.replicates());
    for (std::size_t i = 0; i < block_.columns(); ++i) {
        if (!measure_.unmetReason(column(i)).empty()) first_known_ = i + 1;
        const Statistic error = [&, i](const Resample& resample) { return errors(resample)[i]; };
        seen_.push_back(error({all, {}, 0}) > 3 * foldError(counts(), error));
    }
    std::fill_n(seen_.begin(), first_known_, false);
}

std::vector<double> ErrorModel::errors(const Resample& resample) const {
    std::vector<double> means(block_.columns());
    for (std::size_t i = 0; i < means.size(); ++i) {
        means[i] = meanOver(resample.errors, [&](std::size_t r) {
            return measure_.mse(*block_.rows[r][i], resample.reference_part);
        });
        if (resample.unmet) means[i] += measure_.unmet(*block_.rows.front()[i], block_.replicates());
    }
    return means;
}

stats::LineFit ErrorModel::line(const Resample& resample) const {
    std::vector<double> x, y;
    const std::vector<double> mse = errors(resample);
    for (std::size_t i = 0; i < mse.size(); ++i) {
        if (!seen_[i]) continue;
        if (!(mse[i] > 0)) return {kNaN, kNaN, kNaN, kNaN, kNaN, kNaN, kNaN, 0};
        x.push_back(1 / block_.samples[i]);
        y.push_back(mse[i]);
    }
    if (x.size() < 3) return {kNaN, kNaN, kNaN, kNaN, kNaN, kNaN, kNaN, 0};
    return relativeLine(x, y);
}

double ErrorModel::slope(const Resample& resample) const {
    std::vector<double> mse = errors(resample);
    for (std::size_t i = 0; i < mse.size(); ++i) {
        if (!seen_[i])
            mse[i] = -1;
        else if (!(mse[i] > 0))
            return kNaN;
    }
    return logSlope(block_.samples, mse) / 2;
}

double ErrorModel::biasSquared(const Resample& resample) const {
    std::vector<double> of_columns(block_.columns());
    for (std::size_t i = 0; i < of_columns.size(); ++i)
        of_columns[i] = meanOver(resample.errors, [&](std::size_t r) {
            return measure_.biasSquared(*block_.rows[r][i], resample.reference_part);
        });
    return weighted(of_columns);
}

double ErrorModel::varianceOfBias() const {
    const std::vector<std::size_t> all = allOf(block_.replicates());
    std::vector<double> of_columns(block_.columns());
    for (std::size_t i = 0; i < of_columns.size(); ++i)
        of_columns[i] = meanOver(all, [&](std::size_t r) { return measure_.variance(*block_.rows[r][i]); });
    return weighted(of_columns);
}

double ErrorModel::samplesTo(const Resample& resample, double target, bool extrapolate) const {
    std::vector<double> mse = errors(resample);
    if (first_known_ == mse.size()) return kNaN;
    if (mse[first_known_] <= target) return block_.samples[first_known_];
    for (std::size_t i = first_known_ + 1; i < mse.size(); ++i) {
        if (!(mse[i] <= target)) continue;
        const double low = std::max(mse[i], 1e-3 * target);  // Not above 0 below the reference's noise.
        const double share = std::log(target / mse[i - 1]) / std::log(low / mse[i - 1]);
        return block_.samples[i - 1] * std::pow(block_.samples[i] / block_.samples[i - 1], share);
    }
    return extrapolate ? samplesBeyond(resample, target, lastPower(resample)) : kNaN;
}

double ErrorModel::samplesBeyond(const Resample& resample, double target, double power) const {
    const double last = errors(resample).back();
    return power < kSlowestPower ? block_.samples.back() * std::pow(target / last, 1 / power) : kNaN;
}

double ErrorModel::lastPower(const Resample& resample) const {
    const std::vector<double> mse = errors(resample);
    const std::size_t fourth = mse.size() > 4 ? mse.size() - 4 : 0;
    const auto first = static_cast<std::ptrdiff_t>(std::max(fourth, first_known_));
    return logSlope({block_.samples.begin() + first, block_.samples.end()},
                    {mse.begin() + first, mse.end()});
}

double ErrorModel::valuesOfError() const {
    const std::vector<double> squares = measure_.variancesOf(lastColumn());
    if (squares.size() < 3) return std::numeric_limits<double>::infinity();
    const stats::Summary summary = stats::summarize(squares);
    double farthest = 0;
    for (const double square : squares) farthest = std::max(farthest, std::abs(square - summary.mean));
    const double scatter =
        summary.variance + 0.5 * farthest * farthest / static_cast<double>(summary.count - 1);
    return 2 * summary.mean * summary.mean / scatter;
}

double ErrorModel::variancePower(const Resample& resample) const {
    std::vector<double> variances;
    for (std::size_t i = 0; i < block_.columns(); ++i)
        variances.push_back(
            meanOver(resample.errors, [&](std::size_t r) { return measure_.variance(*block_.rows[r][i]); }));
    return logSlope(block_.samples, variances);
}

std::array<double, 2> ErrorModel::slopeSamples() const {
    std::array<double, 2> range{kNaN, kNaN};
    for (std::size_t i = 0; i < seen_.size(); ++i) {
        if (!seen_[i]) continue;
        if (std::isnan(range[0])) range[0] = block_.samples[i];
        range[1] = block_.samples[i];
    }
    return range;
}

bool ErrorModel::reachesAtOnce(double target) const {
    return first_known_ < block_.columns() && errors({allOf(replicates()), {}, 0})[first_known_] <= target;
}

RowList ErrorModel::column(std::size_t index) const {
    RowList rows;
    for (const RowList& of_replicate : block_.rows) rows.push_back(of_replicate[index]);
    return rows;
}

double ErrorModel::weighted(const std::vector<double>& of_columns) const {
    double sum = 0, weights = 0;
    for (std::size_t i = 0; i < of_columns.size(); ++i) {
        const double weight = block_.samples[i] * block_.samples[i];
        sum += weight * of_columns[i];
        weights += weight;
    }
    return sum / weights;
}

// ------------------------------------------------------------------------- TimeModel

TimeModel::TimeModel(Block block) : block_(std::move(block)) {
    for (const RowList& rows : block_.rows) last_rows_.push_back(rows.back());
}

std::vector<double> TimeModel::renderSeconds(const Resample& resample) const {
    std::vector<double> means(block_.columns());
    for (std::size_t i = 0; i < means.size(); ++i)
        means[i] =
            meanOver(resample.times, [&](std::size_t r) { return block_.rows[r][i]->render_wall_seconds; });
    return means;
}

stats::LineFit TimeModel::line(const Resample& resample) const {
    return relativeLine(block_.samples, renderSeconds(resample));
}

double TimeModel::secondsTo(const Resample& resample, double samples) const {
    if (!std::isfinite(samples)) return kNaN;
    const std::vector<double> seconds = renderSeconds(resample);
    const auto right = std::lower_bound(block_.samples.begin(), block_.samples.end(), samples);
    if (right == block_.samples.end()) return beforeFirstSample(resample) + line(resample).at(samples);
    const auto i = static_cast<std::size_t>(right - block_.samples.begin());
    if (i == 0) return beforeFirstSample(resample) + seconds[0];
    const double share = (samples - block_.samples[i - 1]) / (block_.samples[i] - block_.samples[i - 1]);
    return beforeFirstSample(resample) + seconds[i - 1] + share * (seconds[i] - seconds[i - 1]);
}

}  // namespace crt::converge
