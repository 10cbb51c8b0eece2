/// A replicate on disk, so that a run can go on: the luminances of every look, which the spread between
/// replicates needs, and the last image with its own standard error, which the tests and maps need.
#pragma once

#include "judge/converge/measurement.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace crt::converge {

/// Luminances of one look, row-major.
using LookPlane = std::vector<float>;

struct StoredReplicate {
    std::vector<std::pair<std::uint64_t, LookPlane>> looks;  ///< (samples per pixel, luminances), ascending.
    std::vector<float> rgb;                                  ///< Of the last look, [pixel][3].
    std::vector<float> standard_error;  ///< Of the last look, relative to its mean luminance, [pixel].
};

/// "box-embree-sampler%3dsobol-3.looks", different for different keys: what a file name does not take
/// becomes %XX.
std::string replicateFileName(const Key& key, std::uint32_t replicate);
void writeReplicate(const std::string& path, const StoredReplicate& replicate);

/// Nothing where there is no file. Throws crt::Error(Usage) if the file is not a replicate of this number of
/// pixels.
std::optional<StoredReplicate> readReplicate(const std::string& path, std::size_t pixels);

}  // namespace crt::converge
