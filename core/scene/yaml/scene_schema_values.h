/// Shared elements of the table of keys: ranges, defaults as YAML, keys of every kind of map.
#pragma once

#include "scene/scene.h"
#include "scene/scene_limits.h"
#include "scene/yaml/scene_schema.h"

#include <fmt/format.h>

#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace crt::schema {

using Kind = ValueKind;
using Shape = ValueShape;

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr ValueRange kNotNegative{0, kInfinity, false, false};
inline constexpr ValueRange kRadiance{0, kMostRadiance, false, false};
inline constexpr ValueRange kPositive{0, kInfinity, true, false};

/// A default read off core/scene/scene.h, so that the manual cannot disagree with the code.
inline std::string yaml(double value) { return fmt::format("{}", value); }
inline std::string yaml(bool value) { return value ? "true" : "false"; }
inline std::string yaml(int value) { return fmt::format("{}", value); }
inline std::string yaml(std::uint64_t value) { return fmt::format("{}", value); }
inline std::string yaml(const Vec3d& v) { return fmt::format("[{}, {}, {}]", v[0], v[1], v[2]); }
template <class Enum>
std::string yaml(const std::vector<std::string>& choices, Enum value) {
    return choices[static_cast<std::size_t>(value)];
}

/// The key that picks a variant of a section; `what` as in "this kind of material".
inline KeySchema typeKey(std::string word, const std::string& what) {
    return {.name = "type",
            .kind = Kind::Choice,
            .choices = {std::move(word)},
            .required = true,
            .doc = "Picks this kind of " + what + "."};
}

}  // namespace crt::schema
