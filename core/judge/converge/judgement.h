/// PASS, FAIL or INCONCLUSIVE: what a configuration's rows and images say about its being right.
#pragma once

#include "judge/converge/error_model.h"
#include "judge/converge/fits.h"

#include <optional>

namespace crt::converge {

/// Relative bias of one channel's mean (in units of stats::channelScale) or, without `channel`, of mean
/// luminance. The variances of replicates and of the reference add up, with Welch's degrees of freedom.
Estimate meanBias(const RowList& rows, const ReferenceInfo& reference, std::optional<std::size_t> channel,
                  double confidence);

/// Void rows, pooled equivalence per channel, heavy tails, bias floor, tiles and pixels: the first that
/// decides does. Where the noise has heavy tails, a bias fails only if every replicate is too bright.
Judgement judge(const ConfigurationFit& fit, const ImageTests& tests, const RowsBySamples& by_samples,
                const ReferenceInfo* reference, const FitOptions& options);

}  // namespace crt::converge
