/// Limits of a scene whose file is valid: radiance within single precision, and memory in proportion to the
/// files.
#pragma once

#include "scene/scene.h"

#include <cstdint>
#include <string>
#include <vector>

namespace crt {

/// W·m⁻²·sr⁻¹·nm⁻¹. A float goes from 1e-38 to 3e38; what lies between these bounds and those is
/// room for the factors that a path multiplies radiance by (areas over squared distances, 1/pdf), so that
/// neither a bright sample becomes infinite nor a dim one zero.
inline constexpr double kMostRadiance = 1e25;
inline constexpr double kLeastRadiance = 1e-25;

/// Throws crt::Error(Scene), with the place, when a light of the scene is above kMostRadiance or the
/// brightest is below kLeastRadiance: the image would be wrong or black without a warning. Warns of a lamp
/// that is too dim beside others to shine at all.
void checkRadiance(const Scene& scene);

/// Limit of the memory that a scene takes beyond its files: placements, aliases and polygons written out.
/// 1.5 GB, and 50 bytes for each byte of its files, so that a large model is never refused for its size
/// alone; or what the environment variable CRT_SCENE_MEMORY says ("20GB").
class ExpansionLimit {
public:
    /// Throws crt::Error(Usage) when CRT_SCENE_MEMORY is no size.
    explicit ExpansionLimit(std::uint64_t input_bytes);

    std::uint64_t bytes() const { return bytes_; }
    /// Reason why `count` of `things` are too many, with the memory that they need and the way to allow it;
    /// empty if they are not.
    std::string refusal(std::uint64_t count, const std::string& things, std::uint64_t bytes_each) const;

private:
    std::uint64_t bytes_;
};

/// Peak memory of one, from reading to rendering: measured with a million (docs/decisions/0014).
inline constexpr std::uint64_t kBytesPerTriangle = 500;
inline constexpr std::uint64_t kBytesPerPlacement = 250;
/// Values of YAML behind an alias cost time, not memory: 16 million at 1.5 GB are some seconds.
inline constexpr std::uint64_t kBytesPerAliasedValue = 96;

}  // namespace crt
