#include "judge/converge/points.h"

#include "judge/converge/jackknife.h"
#include "judge/converge/judgement.h"

#include <algorithm>
#include <cmath>

namespace crt::converge {
namespace {

/// √ of a mean squared error. In logarithms where the error is known well, or where a few pixels make it
/// scatter as χ², whose upper end a line does not reach; else from a line, which may begin at 0: below the
/// reference's own noise there is no logarithm.
Estimate rootOf(const SampleCounts& counts, const Statistic& mse, bool few_pixels, double confidence) {
    const Estimate e = jackknife(counts, mse, Scale::Linear, confidence);
    if (e.low > 0.25 * e.value || (few_pixels && counts.folds == 0 && e.value > 0)) {
        const Statistic root = [&](const Resample& resample) { return std::sqrt(mse(resample)); };
        return jackknife(counts, root, Scale::Logarithmic, confidence);
    }
    if (!std::isfinite(e.value)) return e;
    const auto root_of = [](double value) { return std::sqrt(std::max(value, 0.0)); };
    return {root_of(e.value), root_of(e.low), root_of(e.high)};
}

/// True if two positive estimates of one quantity agree: on a logarithmic scale half widths add in
/// quadrature.
bool holds(const Estimate& predicted, const Estimate& expected) {
    const Estimate &less = predicted.value < expected.value ? predicted : expected,
                   &more = predicted.value < expected.value ? expected : predicted;
    const double apart = std::log(more.value / less.value);
    return apart <= std::hypot(std::log(less.high / less.value), std::log(more.value / more.low));
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
        point.seconds = timeOf([this](const Resample& r) { return secondsWithStart(r); });
        point.render_seconds = timeOf([this](const Resample& r) { return renderSeconds(r); });
        point.relative_rmse = rootOf(counts(), mse(), Measure::hasFewPixels(errors_), options_.confidence);
        SampleCounts both = counts();
        both.times = times_.size();
        const Statistic squares = mse();
        const Statistic efficiency = [&](const Resample& r) {
            return 1 / (squares(r) * secondsWithStart(r));
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
    SampleCounts counts() const { return measure_.counts(errors_); }
    Statistic mse() const {
        return [this](const Resample& resample) {
            const double unmet = resample.unmet ? measure_.unmet(*errors_.front(), errors_.size()) : 0;
            return unmet + meanOver(resample.errors, [&](std::size_t r) {
                       return measure_.mse(*errors_[r], resample.reference_part);
                   });
        };
    }
    double renderSeconds(const Resample& resample) const {
        return meanOver(resample.times, [&](std::size_t r) { return times_[r]->render_wall_seconds; });
    }
    double secondsWithStart(const Resample& resample) const {
        return meanStart(times_, resample.times) + renderSeconds(resample);
    }
    Estimate timeOf(const Statistic& seconds) const {
        SampleCounts counts;
        counts.times = times_.size();
        return jackknife(counts, seconds, Scale::Logarithmic, options_.confidence);
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
    /// interval holds what it predicts: the expected error, which the replicates give with a separate
    /// interval.
    void calibrate(Point& point) const {
        bool all_predict = true;
        const Estimate& expected = point.relative_rmse;
        for (const Row* row : errors_) {
            all_predict = all_predict && row->predicted_relative_rmse.has_value();
            // An error below the reference's noise cannot be held against a prediction.
            if (!row->predicted_relative_rmse || !(expected.low > 0) || !std::isfinite(expected.high))
                continue;
            ++point.predicted;
            point.covered += holds(*row->predicted_relative_rmse, expected) ? 1 : 0;
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
