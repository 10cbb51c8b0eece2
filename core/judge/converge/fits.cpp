#include "judge/converge/fits.h"

#include "judge/converge/error_model.h"
#include "judge/converge/jackknife.h"
#include "judge/converge/judgement.h"
#include "judge/converge/points.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace crt::converge {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Product of two independent positive estimates: on a logarithmic scale half widths add in quadrature.
Estimate product(const Estimate& a, const Estimate& b) {
    const double value = a.value * b.value;
    const double down = std::hypot(std::log(a.value / a.low), std::log(b.value / b.low));
    const double up = std::hypot(std::log(a.high / a.value), std::log(b.high / b.value));
    return {value, value * std::exp(-down), value * std::exp(up)};
}

/// The fits of one configuration.
class Fitter {
public:
    Fitter(const ErrorModel& error, const TimeModel& time, const FitOptions& options)
        : error_(error), time_(time), options_(options) {}

    TimeFit timeFit() const {
        TimeFit fit;
        const SampleCounts counts = timeCounts();
        const auto line = [&](const Resample& r) { return time_.line(r); };
        fit.launch = jackknife(
            counts, [&](const Resample& r) { return line(r).intercept; }, Scale::Linear,
            options_.confidence);
        fit.per_sample = jackknife(
            counts, [&](const Resample& r) { return line(r).slope; }, Scale::Logarithmic,
            options_.confidence);
        const std::vector<std::size_t> all = allOf(time_.replicates());
        fit.before_first_sample = time_.beforeFirstSample({{}, all, 0});
        fit.r2 = line({{}, all, 0}).r2;
        return fit;
    }

    ErrorFit errorFit() const {
        ErrorFit fit;
        const SampleCounts counts = error_.counts();
        const Statistic variance = [&](const Resample& r) { return error_.line(r).slope; };
        const Statistic intercept = [&](const Resample& r) { return error_.line(r).intercept; };
        fit.variance = jackknife(counts, variance, Scale::Logarithmic, options_.confidence);
        fit.intercept = jackknife(counts, intercept, Scale::Linear, options_.confidence);
        fit.faster_than_inverse = fit.intercept.high < 0;
        if (error_.measure().hasReference()) fit.bias_squared = biasSquared(options_.confidence);
        if (fit.bias_squared && !std::isfinite(fit.bias_squared->value)) fit.bias_squared.reset();
        fit.verdict_floor = fit.bias_squared
                                ? *biasSquared(options_.verdict_confidence)
                                : jackknife(counts, intercept, Scale::Linear, options_.verdict_confidence);
        fit.flattening = fit.verdict_floor.low > 0;
        return fit;
    }

    /// Reason why no interval of the error can be trusted; empty if they can. Rare bright paths that carry
    /// the variance are met by few of the replicates, or only as samples become more.
    std::string unknownError() const {
        if (std::string reason = error_.unmetReason(); !reason.empty()) return reason;
        constexpr double kFewestValues = 2;  // As for an image (film/error_estimate.h).
        if (const double values = error_.valuesOfError(); values < kFewestValues)
            return fmt::format(
                "the squared errors of its replicates scatter like those of only {:.2g} normal values, and "
                "{} are needed",
                values, kFewestValues);
        const Estimate power = jackknife(
            error_.counts(), [&](const Resample& r) { return error_.variancePower(r); }, Scale::Linear,
            options_.verdict_confidence);
        if (power.low > -1)
            return "the variance between its replicates falls more slowly than 1/N, so rare paths that "
                   "carry it may only now be sampled";
        return {};
    }

    Estimate slopeSamples() const {
        return jackknife(
            error_.counts(), [&](const Resample& r) { return error_.slope(r); }, Scale::Linear,
            options_.confidence);
    }

    /// Columns whose render time is no more than the jitter of its start say nothing of t − t0.
    Estimate slopeSeconds(const Estimate& launch) const {
        const Statistic slope = [&](const Resample& resample) {
            const std::vector<double> all_seconds = time_.renderSeconds(resample),
                                      errors = error_.errors(resample);
            std::vector<double> seconds, mse;
            for (std::size_t i = 0, j = 0; i < errors.size(); ++i) {
                while (j < all_seconds.size() && time_.samples()[j] < error_.samples()[i]) ++j;
                if (j == all_seconds.size()) break;
                const double t = all_seconds[j] - launch.value;
                if (time_.samples()[j] != error_.samples()[i] || !error_.seen()[i] ||
                    t < 3 * (launch.high - launch.value))
                    continue;
                seconds.push_back(t);
                mse.push_back(errors[i]);
            }
            return logSlope(seconds, mse) / 2;
        };
        return jackknife(bothCounts(), slope, Scale::Linear, options_.confidence);
    }

    Target target(double relative_rmse, const ErrorFit& error) const {
        const double mse = relative_rmse * relative_rmse;
        const std::vector<std::size_t> all = allOf(error_.replicates());
        Target target;
        target.relative_rmse = relative_rmse;
        // Measurements of another backend with the same bits hold for this one.
        const double measured = error_.samplesTo({all, {}, 0}, mse, false);
        target.reached = std::isfinite(measured) && measured <= time_.lastSamples();
        target.at_first_point = error_.reachesAtOnce(mse);
        if (!target.reached) {
            if (!error.flattening || error.floor().low < mse) forecast(target, mse);
            return target;
        }
        const Statistic samples = [&](const Resample& r) { return error_.samplesTo(r, mse, true); };
        const Estimate needed = jackknife(error_.counts(), samples, Scale::Logarithmic, options_.confidence);
        if (!std::isfinite(needed.value)) return target;
        target.samples = needed;
        const Statistic seconds = [&](const Resample& r) { return time_.secondsTo(r, samples(r)); };
        target.seconds = jackknife(bothCounts(), seconds, Scale::Logarithmic, options_.confidence);
        return target;
    }

    /// Beyond what was measured, by all laws that fit: the power of the last columns, with its interval, and
    /// 1/N, to which Sobol points slow down sooner or later; 1/N² is the fastest.
    void forecast(Target& target, double mse) const {
        constexpr double kInverse = -1, kInverseSquare = -2;
        const Estimate power = jackknife(
            error_.counts(), [&](const Resample& r) { return error_.lastPower(r); }, Scale::Linear,
            options_.confidence);
        if (!(power.value < kSlowestPower)) return;
        const double fitting = std::max(power.value, kInverseSquare),
                     steepest = std::clamp(power.low, kInverseSquare, std::min(kInverse, fitting)),
                     flattest = std::max(power.high, kInverse);
        const auto by = [&](double exponent) {
            return
                [this, mse, exponent](const Resample& r) { return error_.samplesBeyond(r, mse, exponent); };
        };
        const auto range = [&](const SampleCounts& counts, const auto& statisticBy) {
            const auto estimate = [&](double exponent) {
                return jackknife(counts, statisticBy(exponent), Scale::Logarithmic, options_.confidence);
            };
            const double high =
                flattest < kSlowestPower ? estimate(flattest).high : std::numeric_limits<double>::infinity();
            return Estimate{estimate(fitting).value, estimate(steepest).low, high};
        };
        const Estimate samples = range(error_.counts(), by);
        if (!std::isfinite(samples.value)) return;
        target.powers = {{steepest, flattest}};
        target.samples = samples;
        target.seconds = range(bothCounts(), [&](double exponent) {
            return
                [this, samples = by(exponent)](const Resample& r) { return time_.secondsTo(r, samples(r)); };
        });
    }

    Estimate efficiency(const Target& common, const Estimate& per_sample) const {
        if (!common.reached || !common.samples) return {kNaN, kNaN, kNaN};
        const auto inverse = [](const Estimate& e) { return Estimate{1 / e.value, 1 / e.high, 1 / e.low}; };
        const Estimate cost = product(*common.samples, per_sample);
        const double level = common.relative_rmse * common.relative_rmse;
        return inverse({level * cost.value, level * cost.low, level * cost.high});
    }

private:
    SampleCounts timeCounts() const {
        SampleCounts counts;
        counts.times = time_.replicates();
        return counts;
    }
    SampleCounts bothCounts() const {
        SampleCounts counts = error_.counts();
        counts.times = time_.replicates();
        return counts;
    }
    std::optional<Estimate> biasSquared(double confidence) const {
        const Statistic statistic = [&](const Resample& r) { return error_.biasSquared(r); };
        const Estimate estimate = jackknife(error_.measure().countsOfBias(error_.replicates()), statistic,
                                            Scale::Linear, confidence);
        return error_.measure().noNarrowerThanNoBias(estimate, error_.varianceOfBias(), error_.lastRow(),
                                                     error_.replicates(), confidence);
    }

    const ErrorModel& error_;
    const TimeModel& time_;
    const FitOptions& options_;
};

// ------------------------------------------------------------------------- configurations

bool sameBits(const Row& a, const Row& b) {
    const auto mse = [](const Row& row) { return row.error ? row.error->mse : -1; };
    return a.seed == b.seed && a.image_mean == b.image_mean && a.mean_luminance == b.mean_luminance &&
           mse(a) == mse(b) && a.fold_mse == b.fold_mse;
}

/// True if all common rows are the same, and there are at least two of them.
bool sameBits(const RowsBySamples& a, const RowsBySamples& b) {
    std::size_t common = 0;
    for (const auto& [samples, rows] : a) {
        const auto others = b.find(samples);
        if (others == b.end()) continue;
        for (const auto& [replicate, row] : rows) {
            const auto other = others->second.find(replicate);
            if (other == others->second.end()) continue;
            if (!sameBits(*row, *other->second)) return false;
            ++common;
        }
    }
    return common >= 2;
}

/// A configuration on its way through the analysis.
struct Subject {
    const Configuration* configuration;
    const ReferenceInfo* reference;
    RowsBySamples own, errors;  ///< Its rows, and those that say its error.
    ImageTests tests;
    std::optional<Measure> measure;
    std::optional<ErrorModel> error_model;
    std::optional<TimeModel> time_model;
    ConfigurationFit fit;
};

void collectRows(Subject& subject, const Run& run) {
    subject.fit.key = subject.configuration->key;
    subject.tests = subject.configuration->tests;
    subject.fit.omitted = !subject.configuration->omitted.empty();
    for (const Row& row : run.rows) {
        if (row.key != subject.configuration->key) continue;
        if (row.isVoid())
            ++subject.fit.void_rows;
        else
            subject.own[row.samples][row.replicate] = &row;
    }
    subject.errors = subject.own;
}

/// For each number of samples the rows of the configuration with the most replicates there; they are not
/// mixed, because the variance between them must be of all replicates of one configuration. The tests of
/// images come from the configuration with the most samples.
void shareSameBits(std::vector<Subject>& subjects) {
    const auto progress = [](const Subject& s) {
        return s.own.empty() ? std::pair<std::uint64_t, std::size_t>{}
                             : std::pair{s.own.rbegin()->first, s.own.rbegin()->second.size()};
    };
    for (Subject& subject : subjects) {
        const Subject* farthest = &subject;
        for (const Subject& other : subjects) {
            const Key &a = subject.configuration->key, &b = other.configuration->key;
            if (&other == &subject || a.scene != b.scene || a.variant != b.variant ||
                !sameBits(subject.own, other.own))
                continue;
            subject.fit.same_bits.push_back(b);
            for (const auto& [samples, rows] : other.own)
                if (RowsBySamples::mapped_type& mine = subject.errors[samples]; rows.size() > mine.size())
                    mine = rows;
            if (progress(other) > progress(*farthest)) farthest = &other;
        }
        subject.tests = farthest->configuration->tests;
    }
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The error is not yet known: values without bounds, and no targets.
void forgetErrors(ConfigurationFit& fit) {
    const auto unbounded = [](Estimate& e, double least) { e = {e.value, least, kInfinity}; };
    unbounded(fit.error.variance, 0);
    unbounded(fit.error.intercept, -kInfinity);
    unbounded(fit.error.verdict_floor, -kInfinity);
    if (fit.error.bias_squared) unbounded(*fit.error.bias_squared, -kInfinity);
    unbounded(fit.slope_samples, -kInfinity);
    unbounded(fit.slope_seconds, -kInfinity);
    fit.error.flattening = fit.error.faster_than_inverse = false;
    for (Target& target : fit.targets) target = {target.relative_rmse, false, {}, false, {}, {}};
}

void forgetErrors(Point& point) {
    for (Estimate* e : {&point.relative_rmse, &point.efficiency}) *e = {e->value, 0, kInfinity};
    if (point.bias_squared) *point.bias_squared = {point.bias_squared->value, -kInfinity, kInfinity};
    if (point.calibration) *point.calibration = {point.calibration->value, 0, kInfinity};
    point.covered = point.predicted = 0;
}

void makePoints(Subject& subject, const FitOptions& options) {
    for (const auto& [samples, of_replicates] : subject.own) {
        const auto found = subject.errors.find(samples);
        if (of_replicates.size() < 2 || found == subject.errors.end() || found->second.size() < 2) continue;
        const RowList errors = rowsOf(found->second), times = rowsOf(of_replicates);
        subject.fit.points.push_back(
            makePoint(samples, errors, times, *subject.measure, subject.reference, options));
        Point& point = subject.fit.points.back();
        const bool met = subject.measure->unmetReason(errors).empty();
        if (met && subject.fit.unknown_error.empty()) continue;
        forgetErrors(point);
        // Paths that were not sampled are missing from the mean, too.
        if (point.mean_bias && (!met || errors.front()->rare_luminance > 0))
            *point.mean_bias = {point.mean_bias->value, -kInfinity, kInfinity};
    }
}

void fitSubject(Subject& subject, const FitOptions& options) {
    ConfigurationFit& fit = subject.fit;
    Block times = balancedBlock(subject.own), errors = balancedBlock(subject.errors);
    fit.replicates = static_cast<std::uint32_t>(times.replicates());
    fit.fitted = times.columns() >= 3 && times.replicates() >= 2 && errors.columns() >= 3;
    if (!fit.fitted) return;
    subject.time_model.emplace(std::move(times));
    subject.error_model.emplace(std::move(errors), *subject.measure);
    const Fitter fitter(*subject.error_model, *subject.time_model, options);
    fit.time = fitter.timeFit();
    fit.error = fitter.errorFit();
    fit.slope_samples = fitter.slopeSamples();
    fit.slope_range = subject.error_model->slopeSamples();
    fit.slope_seconds = fitter.slopeSeconds(fit.time.launch);
    fit.targets.clear();
    for (const double target : options.targets) fit.targets.push_back(fitter.target(target, fit.error));
    fit.unknown_error = fitter.unknownError();
    if (!fit.unknown_error.empty()) forgetErrors(fit);
}

/// The reference of a configuration's errors, its points and its fits. A reference that is noisier than the
/// images judges bias only; unless it sees one, which is then part of the error.
void measureAndFit(Subject& subject, const FitOptions& options) {
    const double pixels = static_cast<double>(subject.configuration->width) * subject.configuration->height;
    subject.measure.emplace(subject.errors, subject.reference, std::max(1.0, pixels));
    Measure& measure = *subject.measure;
    subject.fit.has_reference = measure.hasReference();
    for (RowsBySamples* rows : {&subject.own, &subject.errors})
        for (auto& [samples, of_replicates] : *rows)
            std::erase_if(of_replicates,
                          [&](const auto& entry) { return !std::isfinite(measure.mse(*entry.second, 0)); });
    const auto last = lastFullColumn(subject.errors);
    const bool noisy = last != subject.errors.rend() && measure.referenceIsNoisy(rowsOf(last->second));
    if (noisy) {
        measure.measureErrorsBetweenReplicates();
        fitSubject(subject, options);
        if (subject.fit.fitted && subject.fit.error.flattening)
            measure = Measure(subject.errors, subject.reference, std::max(1.0, pixels));
    }
    subject.fit.source = measure.source();
    if (!noisy || measure.source() == ErrorSource::Reference) fitSubject(subject, options);
    makePoints(subject, options);
}

/// The upper end of the interval of the last point, so that parts of the replicates reach it, too.
double leastError(const Subject& subject) {
    double least = std::numeric_limits<double>::infinity();
    for (const Point& point : subject.fit.points)
        if (static_cast<double>(point.samples) <= subject.time_model->lastSamples())
            least = std::min(least, point.relative_rmse.high);
    return least;
}

void compareAtCommonError(std::vector<Subject>& subjects, const FitOptions& options) {
    for (Subject& subject : subjects) {
        if (!subject.fit.fitted || !subject.fit.unknown_error.empty()) continue;
        double level = 0;
        for (const Subject& other : subjects)
            if (other.fit.fitted && other.fit.unknown_error.empty() &&
                other.configuration->key.scene == subject.configuration->key.scene)
                level = std::max(level, leastError(other));
        const Fitter fitter(*subject.error_model, *subject.time_model, options);
        if (std::isfinite(level)) subject.fit.common = fitter.target(level, subject.fit.error);
        subject.fit.efficiency = fitter.efficiency(subject.fit.common, subject.fit.time.per_sample);
    }
}

}  // namespace

const ConfigurationFit* Analysis::find(const Key& key) const {
    const auto found =
        std::find_if(fits.begin(), fits.end(), [&](const ConfigurationFit& fit) { return fit.key == key; });
    return found == fits.end() ? nullptr : &*found;
}

ImageTests imageTestsOf(const stats::GateResult& gate) {
    ImageTests tests;
    if (gate.not_finite > 0) return tests;
    tests.smallest_tile_p = gate.tiles.smallest_p;
    tests.tile_p_uniformity = gate.tile_uniformity_p;
    tests.smallest_pixel_p = gate.pixels.smallest_p;
    tests.largest_share = gate.largest.share;
    tests.heavy_tails = gate.largest.isHeavyTailed(stats::GateOptions{}.largest_share);
    return tests;
}

const ReferenceInfo* findReference(const Run& run, const std::string& scene) {
    const auto found = std::find_if(run.references.begin(), run.references.end(),
                                    [&](const ReferenceInfo& r) { return r.scene == scene; });
    return found == run.references.end() ? nullptr : &*found;
}

Analysis analyze(const Run& run, const FitOptions& options) {
    std::vector<Subject> subjects;
    for (const Configuration& configuration : run.configurations) {
        subjects.push_back(
            {&configuration, findReference(run, configuration.key.scene), {}, {}, {}, {}, {}, {}, {}});
        collectRows(subjects.back(), run);
    }
    shareSameBits(subjects);
    for (Subject& subject : subjects) measureAndFit(subject, options);
    compareAtCommonError(subjects, options);
    Analysis analysis;
    analysis.options = options;
    for (Subject& subject : subjects) {
        if (subject.configuration->omitted.empty())
            subject.fit.judgement =
                judge(subject.fit, subject.tests, subject.errors, subject.reference, options);
        else
            subject.fit.judgement.reason = subject.configuration->omitted;
        analysis.fits.push_back(std::move(subject.fit));
    }
    return analysis;
}

}  // namespace crt::converge
