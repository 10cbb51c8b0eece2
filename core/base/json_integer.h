/// Whole numbers in JSON files that others may have written. nlohmann's get() makes 2^64 - 1 of -1 and 1 of
/// 1.5, and what it does with 1e300 is undefined.
#pragma once

#include "base/error.h"

#include <fmt/format.h>

#include <cstdint>
#include <limits>
#include <string>

namespace crt {

/// `json`, a value of nlohmann's, as a whole number from 0 to `most`. Throws crt::Error(Usage), whose
/// message goes on from the name of the file: "has -1 for …".
template <typename Json>
std::uint64_t wholeNumber(const Json& json,
                          std::uint64_t most = std::numeric_limits<std::uint64_t>::max()) {
    const auto* const value = json.template get_ptr<const typename Json::number_unsigned_t*>();
    if (value == nullptr || *value > most)
        throw Error(ErrorKind::Usage,
                    fmt::format("has {} where a whole number from 0 to {} is expected",
                                json.is_number() ? json.dump() : json.type_name(), most));
    return *value;
}

}  // namespace crt
