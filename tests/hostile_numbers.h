// Numbers in JSON files that no sane writer would produce.
#pragma once

#include "base/error.h"
#include "catch.h"

#include <nlohmann/json.hpp>

#include <cstdlib>
#include <string>

namespace crt {

/// Each number of `whole`, a text of JSON, becomes negative, a fraction, huge: then it is refused, or read
/// as it stands. `there_and_back`: text of a file → what crt read of it, written again.
template <typename ThereAndBack>
void requireNumbersReadOrRefused(const std::string& whole, const ThereAndBack& there_and_back) {
    using Json = nlohmann::json;
    const Json json = Json::parse(whole), flat = json.flatten();
    int refused = 0, numbers = 0;
    for (const auto& [pointer, value] : flat.items()) {
        if (!value.is_number()) continue;
        ++numbers;
        for (const char* hostile : {"-1", "1.5", "4294967360", "18446744073709551616", "1e300", "-1e300"}) {
            INFO(pointer << " = " << hostile);
            Json changed = json;
            changed[Json::json_pointer(pointer)] = Json::parse(hostile);
            try {
                const Json back = Json::parse(there_and_back(changed.dump()));
                CHECK(back.at(Json::json_pointer(pointer)).get<double>() == std::strtod(hostile, nullptr));
            } catch (const Error& error) {
                CHECK(error.kind() == ErrorKind::Usage);
                ++refused;
            }
        }
    }
    CHECK(numbers > 0);
    CHECK(refused > 0);
}

}  // namespace crt
