/// Where the sun of a scene stands: by its direction, or by date, time and place.
#pragma once

#include "scene/yaml/scene_reader.h"

#include <optional>

namespace crt {

/// The unit vector from the scene to the sun, by the keys `direction`, or `date`, `time`, `utc_offset`,
/// `latitude_deg`, `longitude_deg`, `north` and `up`. Nothing, with an error, when they are wrong or all of
/// the sun, which is `diameter_deg` wide, is below the horizon then.
std::optional<Vec3d> readTowardsSun(const SectionReader& section, double diameter_deg);

/// A unit vector, also from components whose squares overflow or vanish. Nothing where all are 0, or one is
/// infinite.
std::optional<Vec3d> unitVector(const Vec3d& v);

}  // namespace crt
