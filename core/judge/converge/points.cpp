#include "judge/converge/points.h"

#include "judge/converge/jackknife.h"
#include "judge/converge/judgement.h"

#include <algorithm>
#include <cmath>

namespace crt::converge {
namespace {

double secondsOf(const Row& row) { return row.seconds_before_first_sample + row.render_wall_seconds; }

/// √ of a mean squared error. In logarithms where the error is known well; else from a line, which may
/// begin at 0: below the reference's own noise there is no logarithm.
Estimate rootOf(const SampleCounts& counts, const Statistic& mse, double confidence) {
    const Estimate e = jackknife(counts, mse, Scale::Linear, confidence);
    if (e.low > 0.25 * e.value) {
        const Statistic root = [&](const Resample& resample) { return std::sqrt(mse(resample)); };
        return jackknife(counts, root, Scale::Logarithmic, confidence);
    }
    if (!std::isfinite(e.value)) return e;
    const auto root_of = [](double value) { return std::sqrt(std::max(value, 0.0)); };
    return {root_of(e.value), root_of(e.low), root_of(e.high)};
}

template <class Value>
std::optional<double> meanOfKnown(const RowList& rows, const Value& value) {
    double sum = 0;
    for (const Row* row : rows) {
        const std::optional<double> known = row->error ? value(*row->error) : std::nullopt;
        if (!known) return std::nullopt;
        sum += *known / static_cast<double>(rows.size());
    }
    return sum;
}

/// A column of errors and a column of times, which are of the same replicates or, with the same bits, of
/// others.
class PointMaker {
public:
    PointMaker(const RowList& errors, const RowList& times, const Measure& measure,
               const FitOptions& options)
        : errors_(errors), times_(times), measure_(measure), options_(options) {}

    Point make(std::uint64_t samples, const ReferenceInfo* reference) const {
        Point point;
        point.samples = samples;
        point.replicates = static_cast<std::uint32_t>(times_.size());
        point.seconds = timeOf([](const Row& row) { return secondsOf(row); });
        point.render_seconds = timeOf([](const Row& row) { return row.render_wall_seconds; });
        point.relative_rmse = rootOf(counts(), mse(), options_.confidence);
        SampleCounts both = counts();
        both.times = times_.size();
        const Statistic squares = mse();
        const Statistic efficiency = [&](const Resample& r) {
            return 1 / (squares(r) * meanTime(r, secondsOf));
        };
        point.efficiency = jackknife(both, efficiency, Scale::Logarithmic, options_.confidence);
        if (measure_.hasReference()) {
            point.bias_squared = biasSquared();
            point.mean_bias = meanBias(errors_, *reference, std::nullopt, options_.confidence);
        }
        calibrate(point);
        point.relmse = meanOfKnown(errors_, [](const ErrorMetrics& e) { return std::optional(e.relmse); });
        point.smape = meanOfKnown(errors_, [](const ErrorMetrics& e) { return std::optional(e.smape); });
        point.mae = meanOfKnown(errors_, [](const ErrorMetrics& e) { return std::optional(e.mae); });
        point.flip_mean = meanOfKnown(errors_, [](const ErrorMetrics& e) { return e.flip_mean; });
        point.delta_e2000_mean =
            meanOfKnown(errors_, [](const ErrorMetrics& e) { return e.delta_e2000_mean; });
        return point;
    }

private:
    SampleCounts counts() const { return measure_.counts(errors_.size()); }
    Statistic mse() const {
        return [this](const Resample& resample) {
            return meanOver(resample.errors, [&](std::size_t r) {
                return measure_.mse(*errors_[r], resample.reference_part);
            });
        };
    }
    template <class Seconds>
    double meanTime(const Resample& resample, const Seconds& seconds) const {
        return meanOver(resample.times, [&](std::size_t r) { return seconds(*times_[r]); });
    }
    template <class Seconds>
    Estimate timeOf(const Seconds& seconds) const {
        SampleCounts counts;
        counts.times = times_.size();
        return jackknife(
            counts, [&](const Resample& r) { return meanTime(r, seconds); }, Scale::Logarithmic,
            options_.confidence);
    }

    std::optional<Estimate> biasSquared() const {
        const Statistic statistic = [this](const Resample& resample) {
            return meanOver(resample.errors, [&](std::size_t r) {
                return measure_.biasSquared(*errors_[r], resample.reference_part);
            });
        };
        const Estimate estimate =
            jackknife(measure_.countsOfBias(errors_.size()), statistic, Scale::Linear, options_.confidence);
        if (!std::isfinite(estimate.value)) return std::nullopt;
        double variance = 0;
        for (const Row* row : errors_)
            variance += measure_.variance(*row) / static_cast<double>(errors_.size());
        return measure_.noNarrowerThanNoBias(estimate, variance, *errors_.front(), errors_.size(),
                                             options_.confidence);
    }

    /// Predicted over actual error, both as root mean squares over replicates, and how often a prediction's
    /// interval holds the actual error.
    void calibrate(Point& point) const {
        bool all_predict = true;
        for (const Row* row : errors_) {
            all_predict = all_predict && row->predicted_relative_rmse.has_value();
            const bool by_reference = measure_.source() == ErrorSource::Reference;
            const double squared =
                by_reference ? measure_.mse(*row, 0) : point.relative_rmse.value * point.relative_rmse.value;
            // An error below the reference's noise cannot be held against a prediction.
            if (!row->predicted_relative_rmse || !(squared > 0)) continue;
            const Estimate& predicted = *row->predicted_relative_rmse;
            ++point.predicted;
            point.covered +=
                predicted.low <= std::sqrt(squared) && std::sqrt(squared) <= predicted.high ? 1 : 0;
        }
        if (!all_predict) return;
        const Statistic squares = mse();
        const Statistic ratio = [&](const Resample& resample) {
            const double predicted = meanOver(resample.errors, [&](std::size_t r) {
                return errors_[r]->predicted_relative_rmse->value *
                       errors_[r]->predicted_relative_rmse->value;
            });
            return std::sqrt(predicted / squares(resample));
        };
        point.calibration = jackknife(counts(), ratio, Scale::Logarithmic, options_.confidence);
    }

    const RowList &errors_, &times_;
    const Measure& measure_;
    const FitOptions& options_;
};

}  // namespace

Point makePoint(std::uint64_t samples, const RowList& errors, const RowList& times, const Measure& measure,
                const ReferenceInfo* reference, const FitOptions& options) {
    return PointMaker(errors, times, measure, options).make(samples, reference);
}

}  // namespace crt::converge
