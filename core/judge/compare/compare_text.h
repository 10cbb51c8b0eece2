/// The results of `crt compare` as text and as JSON.
#pragma once

#include "judge/compare/compare.h"
#include "judge/compare/compare_noise.h"
#include "judge/compare/compare_reference.h"

#include <string>

namespace crt {

/// A few lines without a final newline; as are all texts here.
std::string compareText(const CompareResult& result);
/// One JSON object; what is not a number is null.
std::string compareJson(const CompareResult& result);

/// Everything that is known of two images. `noise` and `reference` may be null: not looked at.
struct Comparison {
    const CompareResult* result = nullptr;
    const NoiseComparison* noise = nullptr;
    const ReferenceComparison* reference = nullptr;
};
std::string comparisonText(const Comparison& comparison);
std::string comparisonJson(const Comparison& comparison);

}  // namespace crt
