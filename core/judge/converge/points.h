/// One configuration at one number of samples per pixel.
#pragma once

#include "judge/converge/error_model.h"
#include "judge/converge/fits.h"

#include <cstdint>

namespace crt::converge {

/// `errors` and `times`: rows of that number of samples. They are the same, unless another configuration
/// renders the same bits and has more of them.
Point makePoint(std::uint64_t samples, const RowList& errors, const RowList& times, const Measure& measure,
                const ReferenceInfo* reference, const FitOptions& options);

}  // namespace crt::converge
