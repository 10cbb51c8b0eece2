/// Shared parts of the JSON files of `crt converge`.
#pragma once

#include "judge/converge/measurement.h"

#include <nlohmann/json.hpp>

#include <array>
#include <optional>
#include <string>

namespace crt::converge {

using Json = nlohmann::ordered_json;

/// JSON has no infinity and no NaN: they become null, as what is not known does.
Json number(double value);
Json number(const std::optional<double>& value);
Json numbers(const std::array<double, 3>& values);
Json interval(const Estimate& e);
Json interval(const std::optional<Estimate>& e);

Json referenceJson(const ReferenceInfo& r);
Json environmentJson(const Environment& e);

/// A whole file at once, or none. Throws crt::Error(Output).
void writeWhole(const std::string& path, const std::string& text);

}  // namespace crt::converge
