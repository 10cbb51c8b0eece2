/// From rows of one configuration to relative squared errors and seconds, and the curves through them, for
/// any part of the replicates and of the reference. fits.h makes intervals of them.
///
/// With a reference of k folds F the squared error of an image I is the mean over pairs of folds of
/// mean (I − F_i)(I − F_j): what the noise of the reference adds cancels, and leaving out a fold is
/// cheap.
#pragma once

#include "base/statistics.h"
#include "judge/converge/fits.h"
#include "judge/converge/jackknife.h"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace crt::converge {

/// [samples][replicate]
using RowsBySamples = std::map<std::uint64_t, std::map<std::uint32_t, const Row*>>;
using RowList = std::vector<const Row*>;

RowList rowsOf(const std::map<std::uint32_t, const Row*>& of_replicates);

/// The largest N that at least three quarters of the replicates reached, and two at least: a budget ends in
/// the middle of an N.
RowsBySamples::const_reverse_iterator lastFullColumn(const RowsBySamples& by_samples);

/// The rows of one configuration that count; every replicate has every column.
struct Block {
    std::vector<double> samples;  ///< Of the columns, ascending.
    std::vector<RowList> rows;    ///< [replicate][column]
    std::size_t replicates() const { return rows.size(); }
    std::size_t columns() const { return samples.size(); }
};

/// The replicates that reached lastFullColumn(), and the Ns that all of them have.
Block balancedBlock(const RowsBySamples& by_samples);

double meanOver(Indices replicates, const std::function<double(std::size_t)>& value);

/// Mean start-up of those of the replicates that timed one; NaN where none did.
double meanStart(const RowList& of_replicates, Indices replicates);

/// Converts rows of one configuration to relative errors. All are relative² where they are squares.
class Measure {
public:
    /// Against the reference where there is one and every row knows its error, else between replicates.
    /// `pixels`: of an image.
    Measure(const RowsBySamples& by_samples, const ReferenceInfo* reference, double pixels);

    ErrorSource source() const { return source_; }
    bool hasReference() const { return reference_ != nullptr; }
    /// True if the reference's own variance is more than a tenth of that of the images in a column. Its
    /// noise would hide their error.
    bool referenceIsNoisy(const RowList& column) const;
    /// Errors are the spread between replicates from now on; the reference judges bias only.
    void measureErrorsBetweenReplicates() { source_ = ErrorSource::BetweenReplicates; }
    bool usable() const { return scale_ > 0; }
    /// True if so few pixels have most of the variance that their replicates often scatter as fewer values
    /// than an error needs to be known.
    static bool hasFewPixels(const RowList& column);
    /// Of the errors of a column.
    SampleCounts counts(const RowList& column) const;
    /// Of biasSquared(), which always has the reference.
    SampleCounts countsOfBias(std::size_t replicates) const;

    /// Relative mean squared error against part of the reference (Resample::reference_part), its noise
    /// subtracted. NaN where the row does not say.
    double mse(const Row& row, std::size_t reference_part) const;
    /// Variance between replicates.
    double variance(const Row& row) const;
    std::vector<double> variancesOf(const RowList& column) const;
    /// Mean squared error, over this number of replicates, of kUnmet paths that are as bright as the scene's
    /// brightest, where these are rare. Up to this number may be missing.
    double unmet(const Row& row, std::size_t replicates) const;
    /// Reason why paths that no replicate has met may carry much of the error of a column: one sentence
    /// without a full stop; empty if that is not likely. Where the scene has rare bright paths the noise
    /// must amount to unmet(), as that of images (decision 0061). Elsewhere a heavy tail must have enough
    /// degrees of freedom (decision 0078).
    std::string unmetReason(const RowList& column) const;
    /// Their difference: its mean over replicates estimates the squared bias.
    double biasSquared(const Row& row, std::size_t reference_part) const {
        return referenceMse(row, reference_part) - variance(row);
    }

    /// The interval that an estimate of b² would have where b = 0, from `variance` of one image, widens
    /// `estimate`. The square of a mean that happens to be right hardly changes with any one replicate or
    /// fold, so that the jackknife alone would be sure of a b² below 0. Under b = 0 the squared mean over
    /// its variance has Fisher's F distribution, with the effective numbers of pixels as degrees of freedom;
    /// exactly so for one pixel.
    Estimate noNarrowerThanNoBias(const Estimate& estimate, double variance, const Row& row,
                                  std::size_t replicates, double confidence) const;

private:
    struct Part {
        std::vector<std::size_t> folds;
        double pairs = 0;  ///< Half the mean squared distance of its folds: subtracted.
        double scale = 1;
    };
    void divideReference();
    double fewPixelsWidening(const RowList& column) const;
    double referenceMse(const Row& row, std::size_t reference_part) const;

    ErrorSource source_ = ErrorSource::BetweenReplicates;
    const ReferenceInfo* reference_ = nullptr;
    double scale_ = 0;  ///< |Mean luminance| of the reference, or of the replicates.
    double pixels_ = 1;
    std::vector<Part> parts_;  ///< As Resample::reference_part counts them; empty without folds.
};

/// Squared error that falls with N by no more than this power is not known to fall.
inline constexpr double kSlowestPower = -0.2;

/// Errors of the columns of a block.
class ErrorModel {
public:
    ErrorModel(Block block, const Measure& measure);

    std::size_t replicates() const { return block_.replicates(); }
    const std::vector<double>& samples() const { return block_.samples; }
    SampleCounts counts() const { return measure_.counts(lastColumn()); }

    /// Relative MSE of the columns, mean over replicates.
    std::vector<double> errors(const Resample& resample) const;
    /// Measure::unmetReason() of the last column. Columns before one with a reason are left out of all fits.
    std::string unmetReason() const { return measure_.unmetReason(lastColumn()); }
    /// True if the error is at most `target` in the first column that is in fits.
    bool reachesAtOnce(double target) const;
    /// Known columns whose error stands out of the reference's noise; nothing relative can be said of the
    /// others.
    const std::vector<bool>& seen() const { return seen_; }

    /// Intercept b², slope v. NaN with fewer than three columns.
    stats::LineFit line(const Resample& resample) const;
    double slope(const Resample& resample) const;

    /// All columns weighted by N²: they are looks at the same renders, and the variance of b² falls with
    /// 1/N² or faster.
    double biasSquared(const Resample& resample) const;
    double varianceOfBias() const;
    const Row& lastRow() const { return *block_.rows.front().back(); }
    const Measure& measure() const { return measure_; }

    /// Samples at which the relative MSE falls to `target`: on the straight line between points in
    /// logarithms; beyond the last, on the line of the last four where `extrapolate` allows it. NaN when it
    /// is not reached.
    double samplesTo(const Resample& resample, double target, bool extrapolate) const;
    /// The same beyond the last column, where squared error falls with N to this power.
    double samplesBeyond(const Resample& resample, double target, double power) const;
    /// Power of N by which squared error falls over the last four columns, of known ones.
    double lastPower(const Resample& resample) const;
    /// The number of normal values of one variance that would make the squared error of an image scatter as
    /// it does between the replicates of the last column (Satterthwaite's 2 S²/Var S). With one half more
    /// of the largest deviation's square, for paths as bright that no replicate has met. Infinite with fewer
    /// than three replicates.
    double valuesOfError() const;
    /// Power of N by which the variance between replicates falls, over all columns.
    double variancePower(const Resample& resample) const;
    /// Samples of the first and of the last column that are in slope().
    std::array<double, 2> slopeSamples() const;

private:
    double weighted(const std::vector<double>& of_columns) const;
    RowList column(std::size_t index) const;
    RowList lastColumn() const { return column(block_.columns() - 1); }

    Block block_;
    const Measure& measure_;
    std::size_t first_known_ = 0;  ///< From this column on, none has an unmetReason().
    std::vector<bool> seen_;
};

/// Seconds of the columns of a block.
class TimeModel {
public:
    explicit TimeModel(Block block);

    std::size_t replicates() const { return block_.replicates(); }
    double beforeFirstSample(const Resample& resample) const {
        return meanStart(last_rows_, resample.times);
    }
    double lastSamples() const { return block_.samples.back(); }
    const std::vector<double>& samples() const { return block_.samples; }

    std::vector<double> renderSeconds(const Resample& resample) const;
    /// Intercept: launch; slope: seconds per sample per pixel.
    stats::LineFit line(const Resample& resample) const;
    /// Seconds that a user waits for this number of samples, start-up included.
    double secondsTo(const Resample& resample, double samples) const;

private:
    Block block_;
    RowList last_rows_;  ///< [replicate]
};

/// Slope of a straight line through logarithms, all points alike; those not above 0 are left out. NaN with
/// fewer than three.
double logSlope(const std::vector<double>& x, const std::vector<double>& y);

}  // namespace crt::converge
